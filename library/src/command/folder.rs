//! The folder that a program works in.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{ErrorKind, Read as _};
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use ivx_data::Blob;
use tempfile::TempDir;

use super::outside;

/// Most bytes of all outputs together: they are held in memory.
pub(super) const MAX_OUTPUT: usize = 256 << 20;

/// The folders that there are.
static OPEN: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Removes every folder that there is: for a process that is about to end.
pub(super) fn remove_all() {
    let open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    open.iter().for_each(|path| drop(fs::remove_dir_all(path)));
}

/// A folder that is removed when it is dropped.
pub(super) struct Folder {
    temporary: Option<TempDir>,
    /// Where it lies, links resolved.
    pub(super) path: PathBuf,
    /// The names given away so far.
    taken: BTreeSet<PathBuf>,
    /// How many bytes of outputs there may still be.
    room: usize,
}

impl Folder {
    /// An empty folder.
    pub(super) fn new() -> Result<Self, String> {
        let made = || {
            let folder = tempfile::Builder::new().prefix("ivx-").tempdir()?;
            let path = fs::canonicalize(folder.path())?;
            Ok((folder, path))
        };
        let (folder, path) = made()
            .map_err(|error: std::io::Error| format!("no working folder can be made: {error}"))?;
        OPEN.lock().unwrap_or_else(PoisonError::into_inner).insert(path.clone());
        let (temporary, taken) = (Some(folder), BTreeSet::new());
        Ok(Self { temporary, path, taken, room: MAX_OUTPUT })
    }

    /// Gives a name away, once.
    pub(super) fn take(&mut self, name: &str) -> Result<PathBuf, String> {
        let path = relative(name)?;
        let fresh = self.taken.insert(path.clone());
        if fresh { Ok(path) } else { Err(format!("two files are called `{name}`")) }
    }

    /// Writes a file that the program finds.
    pub(super) fn put(
        &mut self,
        name: &str,
        bytes: &[u8],
        is_executable: bool,
    ) -> Result<(), String> {
        let path = self.take(name)?;
        let path = self.path.join(path);
        let written = path.parent().map_or(Ok(()), fs::create_dir_all);
        let written = written.and_then(|()| fs::write(&path, bytes));
        let mode = if is_executable { 0o755 } else { 0o644 };
        let written =
            written.and_then(|()| fs::set_permissions(&path, fs::Permissions::from_mode(mode)));
        written.map_err(|error| format!("`{name}` cannot be written: {error}"))
    }

    /// A file that the program wrote: a regular one, in the folder itself.
    pub(super) fn collect(&mut self, name: &Path) -> Result<Blob, String> {
        let shown = name.display();
        let about = |error: std::io::Error| match error.kind() {
            ErrorKind::NotFound | ErrorKind::NotADirectory => format!("`{shown}` was not written"),
            _ => format!("`{shown}` cannot be read: {error}"),
        };
        let path = self.path.join(name);
        let parent = path.parent().expect("it lies in the folder");
        if fs::canonicalize(parent).map_err(about)? != parent {
            return Err(format!("`{shown}` leads outside the working folder through a link"));
        }
        let found = fs::symlink_metadata(&path).map_err(about)?;
        if !found.is_file() {
            let what = if found.is_symlink() { "a link" } else { "no regular file" };
            return Err(format!("`{shown}` is {what}: outputs are regular files"));
        }
        let mut file = File::open(&path).map_err(about)?;
        let opened = file.metadata().map_err(about)?;
        if (opened.dev(), opened.ino()) != (found.dev(), found.ino()) {
            return Err(format!("`{shown}` was replaced while it was read"));
        }
        let length = usize::try_from(opened.len()).unwrap_or(usize::MAX);
        let mut bytes = Vec::new();
        if length <= self.room {
            (&mut file).take(self.room as u64 + 1).read_to_end(&mut bytes).map_err(about)?;
        }
        self.fits(length.max(bytes.len()))?;
        Ok(Blob { bytes, is_executable: outside::is_executable(&opened) })
    }

    /// Counts bytes of outputs.
    pub(super) fn fits(&mut self, n: usize) -> Result<(), String> {
        let rest = self.room.checked_sub(n);
        self.room = rest.ok_or_else(|| {
            format!("the outputs are larger than {} MiB together", MAX_OUTPUT >> 20)
        })?;
        Ok(())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let Some(folder) = self.temporary.take() else { return };
        if folder.close().is_err() {
            unlock(&self.path);
            // What still cannot be removed is left to whoever cleans temporary files.
            drop(fs::remove_dir_all(&self.path));
        }
        OPEN.lock().unwrap_or_else(PoisonError::into_inner).remove(&self.path);
    }
}

/// Lets the folders below be written to, so that they can be emptied.
fn unlock(folder: &Path) {
    drop(fs::set_permissions(folder, fs::Permissions::from_mode(0o700)));
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            unlock(&entry.path());
        }
    }
}

/// The path of a name in the folder.
pub(super) fn relative(name: &str) -> Result<PathBuf, String> {
    let path = Path::new(name);
    let plain = path.components().all(|part| matches!(part, Component::Normal(_)));
    let sound = plain && !name.is_empty() && !name.ends_with('/') && !name.contains('\0');
    let refused = || format!("{name:?} is no name of a file in the working folder");
    if sound { Ok(path.to_owned()) } else { Err(refused()) }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn names_stay_inside_and_are_given_once() {
        let mut folder = Folder::new().unwrap();
        for wrong in ["", "/etc/passwd", "../x", "a/../b", "./a", "a/", "a\0b"] {
            assert!(folder.put(wrong, b"", false).is_err(), "{wrong}");
        }
        folder.put("a/b", b"x", false).unwrap();
        assert!(folder.put("a/b", b"x", false).unwrap_err().contains("two files"));
        assert!(folder.put("a", b"x", false).unwrap_err().contains("cannot be written"));
    }

    #[test]
    fn only_regular_files_inside_are_collected() {
        let elsewhere = tempfile::tempdir().unwrap();
        fs::write(elsewhere.path().join("secret"), "s").unwrap();
        let mut folder = Folder::new().unwrap();
        let path = folder.path.clone();
        fs::write(path.join("own"), "o").unwrap();
        symlink(elsewhere.path().join("secret"), path.join("link")).unwrap();
        symlink(elsewhere.path(), path.join("there")).unwrap();
        fs::create_dir(path.join("folder")).unwrap();
        assert_eq!(folder.collect(Path::new("own")), Ok(Blob::plain(b"o".to_vec())));
        let mut why = |name: &str| folder.collect(Path::new(name)).unwrap_err();
        assert!(why("link").contains("is a link"));
        assert!(why("there/secret").contains("outside the working folder"));
        assert!(why("folder").contains("no regular file"));
        assert!(why("missing").contains("was not written"));
        assert!(why("missing/inside").contains("was not written"));
        assert!(why("own/inside").contains("was not written"));
    }

    #[test]
    fn a_folder_is_removed_whatever_is_in_it() {
        let folder = Folder::new().unwrap();
        let path = folder.path.clone();
        fs::create_dir(path.join("locked")).unwrap();
        fs::write(path.join("locked/file"), "x").unwrap();
        fs::set_permissions(path.join("locked"), fs::Permissions::from_mode(0o500)).unwrap();
        drop(folder);
        assert!(!path.exists());
    }

    #[test]
    fn outputs_have_a_limit_together() {
        let mut folder = Folder::new().unwrap();
        File::create(folder.path.join("large")).unwrap().set_len(1 << 40).unwrap();
        assert!(folder.collect(Path::new("large")).unwrap_err().contains("larger than"));
        folder.room = 10;
        fs::write(folder.path.join("small"), "123456").unwrap();
        assert!(folder.collect(Path::new("small")).is_ok());
        assert!(folder.collect(Path::new("small")).is_err());
    }
}
