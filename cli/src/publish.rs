//! Puts a set of results in the place of the one before, all at once.

use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use ivx_cache::{exchange, wait_lock};
use ivx_engine::Results;

use crate::{At as _, Trouble};

/// What a set has beside figures and tables.
pub(crate) const RESULTS: &str = "results.ron";
const BESIDE: [&str; 4] = [RESULTS, "run.ron", "report.html", "report.md"];
/// The folders of a set.
const FOLDERS: [&str; 2] = ["figures", "tables"];
/// Around the name of a folder that is being written, beside it.
const BEFORE: &str = ".";
const AFTER: &str = ".ivx-new";
/// In such a folder: a set that is not whole yet, one that is or that was replaced, and one that was moved away.
const WRITING: &str = "writing";
const READY: &str = "ready";
const OLD: &str = "old";

/// Makes these files the set of results in a folder: whoever looks there finds all of the set before or all of this
/// one. Files there that no run wrote stay, and those that stood in the way are returned as what they are called now.
///
/// Waits while another process publishes there. A set that is being written lies beside the folder; what a killed
/// process left of one is cleared away first.
///
/// - `results`: where the results of the project lie.
/// - `files`: by their path in the folder.
///
/// # Errors
/// If the disk fails or is full. The folder then holds the set that it held, or this one.
pub(crate) fn publish(
    folder: &Path,
    results: &Path,
    files: &BTreeMap<String, String>,
) -> Result<Vec<PathBuf>, Trouble> {
    let (around, name) = (parent(folder)?, file_name(folder)?);
    // Sets of a project may lie in the folders of others: one lock is for them all.
    let is_of_project = folder.starts_with(results);
    let (lock, first) = if is_of_project {
        (results.join(".lock"), results)
    } else {
        (around.join(wrapped(name, ".ivx-lock")), around)
    };
    fs::create_dir_all(first).at(first)?;
    let _lock = wait_lock(&lock)?;
    fs::create_dir_all(around).at(around)?;
    // A link goes on pointing to where it did.
    let folder = &match fs::canonicalize(folder) {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            fs::canonicalize(around).at(around)?.join(name)
        }
        found => found.at(folder)?,
    };
    let (around, name) = (parent(folder)?, file_name(folder)?);
    let stage = around.join(wrapped(name, AFTER));
    let left = if is_of_project { unfinished(around)? } else { Vec::new() };
    // What cannot be cleared away of another folder does not stop this one.
    for left in left.iter().filter(|left| *left != name) {
        recover(around, left).ok();
    }
    recover(around, name)?;
    let written = write(&stage, folder, files).and_then(|()| swap(&stage, folder));
    if let Err(trouble) = written {
        // The first error is the one to tell; what stays is cleared away by the next run.
        fs::remove_dir_all(&stage).ok();
        return Err(full(trouble));
    }
    sync(around)?;
    clear(&stage, folder)
}

/// What a full disk leaves, said of one.
fn full(trouble: Trouble) -> Trouble {
    match trouble {
        Trouble::File { path, source }
            if matches!(source.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded) =>
        {
            let why = "the disk is full; the results that were there are as they were: run again once there is room";
            Trouble::Content { path, why: why.to_owned() }
        }
        other => other,
    }
}

/// What stands where a folder is to be; none if it is one, or nothing.
pub(crate) fn in_the_way(folder: &Path) -> Option<String> {
    match fs::read_dir(folder).err()?.kind() {
        ErrorKind::NotFound if fs::symlink_metadata(folder).is_err() => None,
        ErrorKind::NotFound => Some("is a link that leads nowhere: remove it".to_owned()),
        ErrorKind::NotADirectory => {
            Some("is a file, where a folder is to be: move it away".to_owned())
        }
        kind => Some(format!("cannot be written to: {kind}")),
    }
}

/// Why a folder is no place for results; none if it is one.
///
/// - `results`: where the results of the project lie.
pub(crate) fn refusal(folder: &Path, results: &Path) -> Option<String> {
    if folder == results {
        return Some("is where the results of all specs lie: name a folder in it".to_owned());
    }
    if let Some(why) = in_the_way(folder) {
        return Some(why);
    }
    let mut entries = fs::read_dir(folder).ok()?;
    let text = match fs::read_to_string(folder.join(RESULTS)) {
        Ok(text) => text,
        Err(_) if entries.next().is_none() => return None,
        Err(_) => return Some("holds other things than results: name an empty folder".to_owned()),
    };
    let read = Results::from_ron(&text).err();
    read.map(|why| format!("has a {RESULTS} that is none ({why}): name an empty folder"))
}

/// Writes a set beside the folder. What is the same there is not written again.
fn write(stage: &Path, folder: &Path, files: &BTreeMap<String, String>) -> Result<(), Trouble> {
    let new = stage.join(WRITING);
    fs::create_dir_all(&new).at(&new)?;
    match fs::metadata(folder) {
        Ok(before) if before.permissions().readonly() => {
            return Err(io::Error::from(ErrorKind::PermissionDenied)).at(folder);
        }
        Ok(before) => fs::set_permissions(&new, before.permissions()).at(&new)?,
        Err(_) => {}
    }
    for (name, text) in files {
        let (from, to) = (folder.join(name), new.join(name));
        let own = parent(&to)?;
        fs::create_dir_all(own).at(own)?;
        // One that says the same is that one, if the file system can do so.
        if !holds(&from, text) || fs::hard_link(&from, &to).is_err() {
            fs::write(&to, text).and_then(|()| File::open(&to)?.sync_all()).at(&to)?;
        }
    }
    for own in FOLDERS.map(|own| new.join(own)).iter().filter(|own| own.is_dir()) {
        sync(own)?;
    }
    sync(&new)?;
    let ready = stage.join(READY);
    fs::rename(&new, &ready).at(&ready)
}

/// Whether a plain file holds this text.
fn holds(path: &Path, text: &str) -> bool {
    let len = fs::symlink_metadata(path).ok().filter(fs::Metadata::is_file).map(|file| file.len());
    len == u64::try_from(text.len()).ok() && fs::read(path).is_ok_and(|own| own == text.as_bytes())
}

/// Exchanges a set that is ready and what is in the folder.
fn swap(stage: &Path, folder: &Path) -> Result<(), Trouble> {
    let ready = &stage.join(READY);
    if fs::symlink_metadata(folder).is_err() {
        return fs::rename(ready, folder).at(folder);
    }
    if exchange(ready, folder).is_ok() {
        return Ok(());
    }
    // A file system that cannot: between the two a kill leaves it to the next run to do the second.
    let old = stage.join(OLD);
    fs::rename(folder, &old).at(folder)?;
    fs::rename(ready, folder).at(folder).inspect_err(|_| {
        fs::rename(&old, folder).ok();
    })
}

/// The names of the folders of which something is being written around.
fn unfinished(around: &Path) -> Result<Vec<OsString>, Trouble> {
    let mut names = Vec::new();
    for entry in fs::read_dir(around).at(around)? {
        let entry = entry.at(around)?;
        if !entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            continue;
        }
        let name = entry.file_name();
        let name = name.as_encoded_bytes();
        let inner = name.strip_prefix(BEFORE.as_bytes());
        if inner.and_then(|name| name.strip_suffix(AFTER.as_bytes())).is_some() {
            let name = String::from_utf8_lossy(name);
            names.push(name[BEFORE.len()..name.len() - AFTER.len()].into());
        }
    }
    Ok(names)
}

/// Clears away what a killed process left of writing a folder.
fn recover(around: &Path, name: &OsStr) -> Result<(), Trouble> {
    let (folder, stage) = (around.join(name), around.join(wrapped(name, AFTER)));
    if !stage.exists() {
        return Ok(());
    }
    match fs::remove_dir_all(stage.join(WRITING)) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(error).at(&stage),
        _ => {}
    }
    if stage.join(OLD).exists() && fs::symlink_metadata(&folder).is_err() {
        fs::rename(stage.join(READY), &folder).at(&folder)?;
    }
    clear(&stage, &folder).map(drop)
}

/// Removes the set that was replaced. What no run had written is moved to where it was; what it is called now is
/// returned where that is another name.
fn clear(stage: &Path, folder: &Path) -> Result<Vec<PathBuf>, Trouble> {
    let mut moved = Vec::new();
    for left in [stage.join(READY), stage.join(OLD)] {
        if left.exists() {
            let set = Replaced { set: &left, folder, written: written(&left) };
            set.clear(Path::new(""), &mut moved)?;
        }
    }
    fs::remove_dir(stage).at(stage)?;
    Ok(moved)
}

/// The files that a run wrote into a folder, and the digests of those of which it is known.
fn written(set: &Path) -> BTreeMap<PathBuf, Option<String>> {
    let Ok(text) = fs::read_to_string(set.join(RESULTS)) else { return BTreeMap::new() };
    let shown = Results::from_ron(&text).map(|results| results.files()).unwrap_or_default();
    let shown = shown.into_iter().map(|(path, digest)| (path.into(), Some(digest)));
    BESIDE.iter().map(|name| ((*name).into(), None)).chain(shown).collect()
}

/// A set that another took the place of.
struct Replaced<'a> {
    set: &'a Path,
    folder: &'a Path,
    written: BTreeMap<PathBuf, Option<String>>,
}

impl Replaced<'_> {
    /// Clears one of its folders.
    fn clear(&self, inner: &Path, moved: &mut Vec<PathBuf>) -> Result<(), Trouble> {
        let own = self.set.join(inner);
        let mut entries: Vec<_> = fs::read_dir(&own).and_then(Iterator::collect).at(&own)?;
        // It says what a run wrote, also to who goes on after a kill.
        entries.sort_by_key(|entry| entry.file_name() == RESULTS);
        for entry in entries {
            let (inner, path) = (inner.join(entry.file_name()), entry.path());
            let kind = entry.file_type().at(&path)?;
            if kind.is_dir() && FOLDERS.iter().any(|folder| inner == Path::new(folder)) {
                self.clear(&inner, moved)?;
            } else if kind.is_file() && self.is_written(&inner) {
                fs::remove_file(&path).at(&path)?;
            } else {
                moved.extend(self.put_back(&inner)?);
            }
        }
        fs::remove_dir(&own).at(&own)
    }

    /// Whether a file is as a run wrote it.
    fn is_written(&self, inner: &Path) -> bool {
        let digest = |digest: &String| {
            let bytes = fs::read(self.set.join(inner)).unwrap_or_default();
            ivx_cache::Digest::of(&bytes).to_string() == *digest
        };
        self.written.get(inner).is_some_and(|known| known.as_ref().is_none_or(digest))
    }

    /// Moves what no run wrote to where it was, or beside that, which is returned.
    fn put_back(&self, inner: &Path) -> Result<Option<PathBuf>, Trouble> {
        let (from, to) = (self.set.join(inner), self.folder.join(inner));
        let around = parent(&to)?;
        fs::create_dir_all(around).at(around)?;
        if fs::symlink_metadata(&to).is_err() {
            return fs::rename(&from, &to).at(&to).map(|()| None);
        }
        let same = fs::read(&from).ok().zip(fs::read(&to).ok()).is_some_and(|(a, b)| a == b);
        if same {
            return fs::remove_file(&from).at(&from).map(|()| None);
        }
        let mut beside = to.into_os_string();
        beside.push("~");
        while fs::symlink_metadata(&beside).is_ok() {
            beside.push("~");
        }
        let beside = PathBuf::from(beside);
        fs::rename(&from, &beside).at(&beside)?;
        Ok(Some(beside))
    }
}

fn wrapped(name: &OsStr, after: &str) -> OsString {
    [OsStr::new(BEFORE), name, OsStr::new(after)].into_iter().collect()
}

fn parent(path: &Path) -> Result<&Path, Trouble> {
    path.parent().ok_or_else(|| io::Error::from(ErrorKind::InvalidInput)).at(path)
}

fn file_name(path: &Path) -> Result<&OsStr, Trouble> {
    path.file_name().ok_or_else(|| io::Error::from(ErrorKind::InvalidInput)).at(path)
}

/// Makes the names in a folder survive a loss of power, where the system can.
fn sync(folder: &Path) -> Result<(), Trouble> {
    if cfg!(unix) {
        File::open(folder).and_then(|folder| folder.sync_all()).at(folder)
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A set whose results name one figure that has this text.
    fn set(name: &str, text: &str) -> BTreeMap<String, String> {
        let digest = ivx_cache::Digest::of(text.as_bytes()).to_string();
        let mut results = Results::default();
        let figures = &mut results.experiments.entry("e".to_owned()).or_default().figures;
        figures.insert(name.to_owned(), [("svg".to_owned(), digest)].into());
        [(RESULTS.to_owned(), results.to_ron()), (format!("figures/{name}.svg"), text.to_owned())]
            .into()
    }

    /// The files below a folder, sorted.
    fn files(folder: &Path) -> Vec<String> {
        let mut found = Vec::new();
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if path.is_dir() {
                found.extend(files(&path).into_iter().map(|file| format!("{name}/{file}")));
            } else {
                found.push(name);
            }
        }
        found.sort();
        found
    }

    fn put(folder: &Path, set: &BTreeMap<String, String>) {
        for (name, text) in set {
            let path = folder.join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
    }

    /// What is in the folder, and in the one beside it.
    type Left<'a> = (Option<&'a BTreeMap<String, String>>, &'a [(&'a str, usize)]);

    #[test]
    fn whatever_a_killed_process_left_the_next_set_is_whole_and_alone() {
        let (before, killed, next) = (set("a", "1"), set("b", "2"), set("c", "3"));
        let cases: [Left<'_>; 6] = [
            (Some(&before), &[]),
            (Some(&before), &[(WRITING, 1)]),
            (Some(&before), &[(READY, 2)]),
            (None, &[(READY, 2)]),
            (None, &[(READY, 2), (OLD, 0)]),
            (Some(&killed), &[(OLD, 0)]),
        ];
        for (there, beside) in cases {
            let project = tempfile::tempdir().unwrap();
            let results = project.path().join("results");
            let folder = results.join("s");
            let stage = results.join(".s.ivx-new");
            fs::create_dir_all(&results).unwrap();
            if let Some(set) = there {
                put(&folder, set);
                fs::write(folder.join("mine.txt"), "mine").unwrap();
            }
            for (part, n_files) in beside {
                let all = if *part == OLD { &before } else { &killed };
                let n_files = if *n_files == 0 { all.len() } else { *n_files };
                let some = all.iter().take(n_files).map(|(k, v)| (k.clone(), v.clone()));
                put(&stage.join(part), &some.collect());
            }
            let moved = publish(&folder, &results, &next).unwrap();
            assert_eq!(moved, Vec::<PathBuf>::new(), "{beside:?}");
            let mut expected = vec!["figures/c.svg", "mine.txt", RESULTS];
            expected.retain(|name| there.is_some() || *name != "mine.txt");
            assert_eq!(files(&folder), expected, "{beside:?}");
            assert_eq!(fs::read_dir(&results).unwrap().count(), 1, "{beside:?}");
            assert_eq!(fs::read_to_string(folder.join(RESULTS)).unwrap(), next[RESULTS]);
        }
    }

    #[test]
    fn what_is_left_of_another_folder_and_cannot_be_cleared_stops_nobody() {
        let project = tempfile::tempdir().unwrap();
        let results = project.path().join("results");
        fs::create_dir_all(results.join(".y.ivx-new/mine")).unwrap();
        fs::write(results.join(".z.ivx-new"), "mine").unwrap();
        publish(&results.join("s"), &results, &set("a", "1")).unwrap();
        assert_eq!(files(&results.join("s")), ["figures/a.svg", RESULTS]);
        assert!(results.join(".y.ivx-new/mine").exists() && results.join(".z.ivx-new").exists());
    }

    #[test]
    fn what_no_run_wrote_stays_and_what_is_in_the_way_is_told() {
        let project = tempfile::tempdir().unwrap();
        let (results, folder) = (project.path().join("results"), project.path().join("results/s"));
        publish(&folder, &results, &set("a", "1")).unwrap();
        fs::write(folder.join("figures/a.svg"), "drawn over").unwrap();
        fs::write(folder.join("figures/b.svg"), "mine").unwrap();
        let moved = publish(&folder, &results, &set("b", "2")).unwrap();
        let mine = fs::canonicalize(&folder).unwrap().join("figures/b.svg~");
        assert_eq!(moved, [mine]);
        let expected = ["figures/a.svg", "figures/b.svg", "figures/b.svg~", RESULTS];
        assert_eq!(files(&folder), expected);
    }

    #[test]
    fn places_with_other_things_are_refused() {
        let project = tempfile::tempdir().unwrap();
        let (results, out) = (project.path().join("results"), project.path().join("out"));
        let refused = |folder: &Path| refusal(folder, &results).unwrap_or_default();
        assert_eq!(refused(&out), "");
        fs::create_dir(&out).unwrap();
        assert_eq!(refused(&out), "");
        fs::write(out.join("thesis.tex"), "").unwrap();
        assert!(refused(&out).contains("other things"));
        fs::write(out.join(RESULTS), "mine").unwrap();
        assert!(refused(&out).contains("that is none"));
        put(&out, &set("a", "1"));
        assert_eq!(refused(&out), "");
        assert!(refused(&results).contains("all specs"));
        fs::write(project.path().join("file"), "").unwrap();
        assert!(refused(&project.path().join("file")).contains("is a file"));
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("nowhere", project.path().join("link")).unwrap();
            assert!(refused(&project.path().join("link")).contains("leads nowhere"));
        }
    }
}
