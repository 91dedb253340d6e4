//! `ivx.lock`: what a run found, beside the spec.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use ivx_cache::Digest;
use ivx_engine::{Lock, Locks};

use crate::replace::replace;
use crate::{At as _, Trouble};

/// The name of the file.
pub(super) const FILE: &str = "ivx.lock";
/// The format of the file.
const FORMAT: u32 = 1;
/// How many differences are told.
const MOST: usize = 20;

/// The locks beside a spec; none if there is no file.
pub(super) fn read(spec: &Path) -> Result<Locks, Trouble> {
    let path = beside(spec);
    match fs::read_to_string(&path) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(Locks::default()),
        text => parse(&text.at(&path)?, &path.display().to_string()),
    }
}

/// The locks of a file.
pub(super) fn read_file(path: &Path) -> Result<Locks, Trouble> {
    parse(&fs::read_to_string(path).at(path)?, &path.display().to_string())
}

/// The locks that a text holds, which has its name for messages.
pub(super) fn parse(text: &str, name: &str) -> Result<Locks, Trouble> {
    let content = |why| Trouble::Content { path: name.to_owned(), why };
    let locks = Locks::from_ron(text).map_err(|why| content(why.to_string()))?;
    if locks.format != FORMAT {
        return Err(content(format!("format {} is not {FORMAT}", locks.format)));
    }
    Ok(locks)
}

/// The digests of all that the locks of a project name. Folders whose names begin with a dot are
/// not looked into.
pub(super) fn locked(project: &Path) -> Result<BTreeSet<Digest>, Trouble> {
    let mut locked = BTreeSet::new();
    let mut folders = vec![project.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).at(&folder)? {
            let entry = entry.at(&folder)?;
            let (name, path) = (entry.file_name(), entry.path());
            // A link is none of these.
            let kind = entry.file_type().at(&path)?;
            if kind.is_dir() && !name.to_string_lossy().starts_with('.') {
                folders.push(path);
            } else if kind.is_file() && name == FILE {
                for lock in read(&path)?.specs.values() {
                    for digest in lock.nodes.values() {
                        let content = |why: ivx_cache::NotADigest| Trouble::Content {
                            path: path.display().to_string(),
                            why: why.to_string(),
                        };
                        locked.insert(digest.parse().map_err(content)?);
                    }
                }
            }
        }
    }
    Ok(locked)
}

/// Writes the locks with that of one spec made new.
pub(super) fn write(
    spec: &Path,
    mut locks: Locks,
    name: String,
    mut lock: Lock,
) -> Result<(), Trouble> {
    locks.format = FORMAT;
    // A claim that is as it was keeps the date from which it is so.
    let earlier = locks.specs.get(&name).and_then(|lock| lock.registered.as_ref());
    lock.registered = lock.registered.map(|registered| match earlier {
        Some(earlier) => registered.after(earlier),
        None => registered,
    });
    locks.specs.insert(name, lock);
    replace(&beside(spec), &locks.to_ron())
}

/// Whether a run found something else than is locked; says what.
pub(super) fn moved(locked: &Lock, found: &Lock, out: &mut dyn Write) -> io::Result<bool> {
    let lines = locked.differences(found);
    if locked.platform != found.platform {
        let (there, here) = (&locked.platform, &found.platform);
        writeln!(out, "locked on {there}, run on {here}: measures are compared")?;
    }
    for line in lines.iter().take(MOST) {
        writeln!(out, "  {line}")?;
    }
    match lines.len() {
        0 => writeln!(out, "as locked in {FILE}")?,
        n if n > MOST => writeln!(out, "  ... and {} more", n - MOST)?,
        _ => {}
    }
    if !lines.is_empty() {
        writeln!(out, "not as locked in {FILE}: {} differences", lines.len())?;
    }
    Ok(!lines.is_empty())
}

fn beside(spec: &Path) -> PathBuf {
    spec.with_file_name(FILE)
}
