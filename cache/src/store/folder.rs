//! A second store that is a folder: on a network file system, or kept by a CI service.

use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind, Read as _};
use std::path::{Path, PathBuf};

use super::{Store, StoreError, VERSION, checked};
use crate::{Disk, Mode, durable};

const TMP: &str = "tmp";

/// A folder that keeps bytes under names.
///
/// Others may write there, and mean harm: what is no plain file in plain folders is not read,
/// and nothing is written through a link.
#[derive(Debug)]
pub struct Folder {
    root: PathBuf,
    disk: Disk,
}

impl Folder {
    /// The store in a folder.
    ///
    /// # Errors
    /// If there is none, or one of another format, or it can't be read.
    pub fn open(root: &Path) -> Result<Self, StoreError> {
        Self::open_on(Disk::default(), root)
    }

    /// The store in a folder, made if it is not there.
    ///
    /// # Errors
    /// If it can't be made, or is of another format, or can't be read.
    pub fn create(root: &Path) -> Result<Self, StoreError> {
        Self::create_on(Disk::default(), root)
    }

    /// [`Self::create`] on a disk that may have faults.
    ///
    /// # Errors
    /// As [`Self::create`].
    #[doc(hidden)]
    pub fn create_on(disk: Disk, root: &Path) -> Result<Self, StoreError> {
        let folder = Self { root: root.to_owned(), disk };
        folder.disk.create_folder(root).map_err(|error| fault(VERSION, error))?;
        checked(folder, Mode::Write)
    }

    fn open_on(disk: Disk, root: &Path) -> Result<Self, StoreError> {
        checked(Self { root: root.to_owned(), disk }, Mode::Read)
    }

    /// What lies under a name, itself and not where it leads, in folders that are none either.
    fn look(&self, name: &str) -> Result<Option<(PathBuf, Metadata)>, StoreError> {
        let mut path = self.root.clone();
        let mut found = None;
        for word in name.split('/') {
            if found.is_some_and(|found: Metadata| !found.is_dir()) {
                return Err(StoreError::refused(name, "it lies in what is no folder"));
            }
            path.push(word);
            match fs::symlink_metadata(&path) {
                Ok(metadata) => found = Some(metadata),
                Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
                Err(error) => return Err(fault(name, error)),
            }
        }
        Ok(found.map(|found| (path, found)))
    }

    fn file(&self, name: &str) -> Result<Option<(PathBuf, Metadata)>, StoreError> {
        let found = self.look(name)?;
        if found.as_ref().is_some_and(|(_, found)| !found.is_file()) {
            return Err(StoreError::refused(name, "no plain file"));
        }
        Ok(found)
    }

    /// Sees that the folders around a name are some, and makes those that are not there.
    fn make_folders(&self, name: &str) -> Result<(), StoreError> {
        let around = name.rsplit_once('/').map_or("", |(around, _)| around);
        let is_folder =
            |folder: &str| Ok(self.look(folder)?.is_some_and(|(_, found)| found.is_dir()));
        if is_folder(around)? {
            return Ok(());
        }
        for (at, _) in name.match_indices('/') {
            let folder = &name[..at];
            self.disk.create_folder(&self.root.join(folder)).map_err(|error| fault(name, error))?;
            if !is_folder(folder)? {
                return Err(StoreError::refused(name, "it would lie in what is no folder"));
            }
        }
        Ok(())
    }

    fn write(&self, temporary: &Path, bytes: &[u8]) -> io::Result<()> {
        let mut file = self.disk.create(temporary)?;
        self.disk.append(&mut file, temporary, bytes)
    }

    /// Writes a file and has `publish` give it its name.
    fn written<T>(
        &self,
        name: &str,
        bytes: &[u8],
        publish: impl FnOnce(&Path, &Path) -> io::Result<T>,
    ) -> Result<T, StoreError> {
        let temporary = format!("{TMP}/{}", durable::unique_name());
        self.make_folders(&temporary)?;
        self.make_folders(name)?;
        let temporary = self.root.join(temporary);
        let written =
            self.write(&temporary, bytes).and_then(|()| publish(&temporary, &self.root.join(name)));
        if written.is_err() {
            // The first error is the one to tell.
            self.disk.remove(&temporary).ok();
        }
        written.map_err(|error| fault(name, error))
    }
}

impl Store for Folder {
    fn list(&self, folder: &str, max: usize) -> Result<Vec<String>, StoreError> {
        let Some((path, found)) = self.look(folder)? else { return Ok(Vec::new()) };
        if !found.is_dir() {
            return Err(StoreError::refused(folder, "no folder"));
        }
        let mut names = Vec::new();
        for entry in fs::read_dir(path).map_err(|error| fault(folder, error))? {
            let entry = entry.map_err(|error| fault(folder, error))?;
            // A name that is no text is none of ours.
            names.extend(entry.file_name().into_string().ok());
            if names.len() > max {
                return Err(StoreError::refused(folder, format!("more than {max} names")));
            }
        }
        names.sort_unstable();
        Ok(names)
    }

    fn size(&self, name: &str) -> Result<Option<u64>, StoreError> {
        Ok(self.file(name)?.map(|(_, found)| found.len()))
    }

    fn get(&self, name: &str, max: u64) -> Result<Option<Vec<u8>>, StoreError> {
        let Some((path, found)) = self.file(name)? else { return Ok(None) };
        if found.len() > max {
            let why = format!("{} bytes where at most {max} are expected", found.len());
            return Err(StoreError::refused(name, why));
        }
        let file = match File::open(path) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(fault(name, error)),
        };
        let opened = file.metadata().map_err(|error| fault(name, error))?;
        if !same(&opened, &found) {
            return Err(StoreError::refused(name, "it was exchanged while it was read"));
        }
        let mut bytes = Vec::new();
        // One byte more tells of a file that grows.
        file.take(max + 1).read_to_end(&mut bytes).map_err(|error| fault(name, error))?;
        if bytes.len() as u64 > max {
            return Err(StoreError::refused(name, format!("more than {max} bytes")));
        }
        Ok(Some(bytes))
    }

    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), StoreError> {
        self.written(name, bytes, |temporary, path| self.disk.rename(temporary, path))
    }

    fn create(&self, name: &str, bytes: &[u8]) -> Result<bool, StoreError> {
        // What is no plain file is replaced.
        match self.file(name) {
            Ok(Some(_)) => return Ok(false),
            Ok(None) => {}
            Err(_) => return self.put(name, bytes).map(|()| true),
        }
        self.written(name, bytes, |temporary, path| {
            let linked = match fs::hard_link(temporary, path) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(false),
                linked => linked.map(|()| true),
            };
            self.disk.remove(temporary).ok();
            linked
        })
    }

    fn remove(&self, name: &str) -> Result<(), StoreError> {
        let Some((path, _)) = self.file(name)? else { return Ok(()) };
        match self.disk.remove(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(fault(name, error)),
            _ => Ok(()),
        }
    }
}

/// Whether this is one file.
#[cfg(unix)]
fn same(a: &Metadata, b: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

#[cfg(not(unix))]
fn same(a: &Metadata, b: &Metadata) -> bool {
    a.is_file() && b.is_file()
}

/// What is wrong with one name, or with the store.
fn fault(name: &str, source: io::Error) -> StoreError {
    match source.kind() {
        ErrorKind::PermissionDenied
        | ErrorKind::NotADirectory
        | ErrorKind::IsADirectory
        | ErrorKind::DirectoryNotEmpty
        | ErrorKind::AlreadyExists => StoreError::refused(name, source.to_string()),
        _ => StoreError::Failed { name: name.to_owned(), source },
    }
}
