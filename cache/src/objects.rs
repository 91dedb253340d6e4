//! Content-addressed files: a name is the digest of the bytes.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::at_once::at_once;
use crate::error::At as _;
use crate::{CacheError, Digest, Disk, Output, Second, durable};

/// Outputs up to this many bytes lie inside their record.
pub const INLINE_MAX: usize = 4096;

/// The bytes of outputs; cheap to clone, for worker threads.
#[derive(Clone, Debug)]
pub struct Objects {
    root: Arc<Path>,
    disk: Disk,
    pub(crate) second: Option<Arc<Second>>,
}

/// What came of reading an output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fetched {
    /// Its bytes, which have its digest.
    Bytes(Arc<[u8]>),
    /// There is no such object any more: its action must run again.
    Missing,
    /// The object was damaged and is out of the way: its action must run again.
    Corrupt {
        /// Where the damaged bytes are kept until the next sweep.
        moved_to: PathBuf,
    },
}

impl Objects {
    pub(crate) fn new(root: &Path, disk: Disk) -> Self {
        Self { root: root.into(), disk, second: None }
    }

    /// The output of these bytes; when it returns, they are on the disk, or inside it.
    ///
    /// An object that is there and whole is left as it is.
    ///
    /// # Errors
    /// If the disk fails or is full; nothing is left behind then.
    pub fn put(&self, bytes: &[u8]) -> Result<Output, CacheError> {
        let (digest, size) = (Digest::of(bytes), bytes.len() as u64);
        if bytes.len() <= INLINE_MAX {
            return Ok(Output { digest, size, inline: Some(bytes.into()) });
        }
        self.keep(&digest, bytes)?;
        Ok(Output { digest, size, inline: None })
    }

    fn keep(&self, digest: &Digest, bytes: &[u8]) -> Result<(), CacheError> {
        let (folder, path) = self.place(digest);
        if !holds(&path, bytes) {
            if !folder.exists() {
                self.disk.create_folder(&folder).at(&folder)?;
                let objects = self.root.join("objects");
                self.disk.sync_folder(&objects).at(&objects)?;
            }
            let temporary = self.root.join("tmp").join(durable::unique_name());
            durable::publish(&self.disk, &temporary, &path, bytes)?;
        }
        Ok(())
    }

    /// The bytes of an output, checked against its digest; copied from the second store if
    /// only that has them.
    ///
    /// # Errors
    /// If the disk fails. A missing or damaged object is no error.
    ///
    /// # Panics
    /// If inline bytes were put together by hand and don't have the digest.
    pub fn read(&self, output: &Output) -> Result<Fetched, CacheError> {
        if let Some(bytes) = &output.inline {
            assert_eq!(Digest::of(bytes), output.digest, "an inline output has its digest");
            return Ok(Fetched::Bytes(Arc::clone(bytes)));
        }
        let here = self.read_here(output)?;
        if let (Fetched::Missing | Fetched::Corrupt { .. }, Some(second)) = (&here, &self.second)
            && let Some(bytes) = second.object(output)
        {
            self.keep(&output.digest, &bytes)?;
            return Ok(Fetched::Bytes(bytes.into()));
        }
        Ok(here)
    }

    /// Copies from the second store what only that has of some outputs, all at once, so that
    /// reading them does not ask for one after the other.
    ///
    /// # Errors
    /// If the disk fails.
    pub fn bring<'a>(
        &self,
        outputs: impl IntoIterator<Item = &'a Output>,
    ) -> Result<(), CacheError> {
        let Some(second) = self.second.as_ref().filter(|second| second.n_at_once() > 1) else {
            return Ok(());
        };
        let away: Vec<_> = outputs.into_iter().filter(|output| !self.has_here(output)).collect();
        let copy = |output: &&Output| match second.object(output) {
            Some(bytes) => self.keep(&output.digest, &bytes),
            None => Ok(()),
        };
        at_once(second.n_at_once(), &away, copy).into_iter().collect()
    }

    fn read_here(&self, output: &Output) -> Result<Fetched, CacheError> {
        let (_, path) = self.place(&output.digest);
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Fetched::Missing),
            Err(source) => return Err(CacheError::Io { path, source }),
        };
        if Digest::of(&bytes) == output.digest {
            return Ok(Fetched::Bytes(bytes.into()));
        }
        let name = format!("{}-{}", output.digest, durable::unique_name());
        let moved_to = self.root.join("corrupt").join(name);
        match self.disk.rename(&path, &moved_to) {
            Ok(()) => self.put_back(output, &path, moved_to),
            // Another reader was faster.
            Err(error) if error.kind() == io::ErrorKind::NotFound && !path.exists() => {
                Ok(Fetched::Missing)
            }
            Err(error) => Err(error).at(&path),
        }
    }

    /// Puts what was moved aside back if it is whole: another reader was faster, and the object
    /// had been made anew.
    fn put_back(
        &self,
        output: &Output,
        path: &Path,
        moved_to: PathBuf,
    ) -> Result<Fetched, CacheError> {
        match fs::read(&moved_to) {
            Ok(bytes) if Digest::of(&bytes) == output.digest => {
                self.disk.rename(&moved_to, path).at(path)?;
                Ok(Fetched::Bytes(bytes.into()))
            }
            _ => Ok(Fetched::Corrupt { moved_to }),
        }
    }

    /// Whether the bytes of an output are there, in this cache or the second store, as far as
    /// their number tells.
    #[must_use]
    pub fn has(&self, output: &Output) -> bool {
        self.has_here(output) || self.second.as_ref().is_some_and(|second| second.has(output))
    }

    /// Whether the bytes of an output are in this cache, as far as their number tells.
    pub(crate) fn has_here(&self, output: &Output) -> bool {
        let (_, path) = self.place(&output.digest);
        let whole = || fs::metadata(path).is_ok_and(|file| file.len() == output.size);
        output.inline.is_some() || whole()
    }

    /// The folder and file of an object.
    fn place(&self, digest: &Digest) -> (PathBuf, PathBuf) {
        let hex = digest.to_string();
        let folder = self.root.join("objects").join(&hex[..2]);
        let path = folder.join(hex);
        (folder, path)
    }
}

/// Whether the file holds these bytes. If it can't be read, it is written anew.
fn holds(path: &Path, bytes: &[u8]) -> bool {
    fs::metadata(path).is_ok_and(|file| file.len() == bytes.len() as u64)
        && fs::read(path).is_ok_and(|found| found == bytes)
}

#[cfg(test)]
mod tests {
    use tempfile::TempDir;

    use super::*;

    fn store() -> (TempDir, Objects) {
        let root = tempfile::tempdir().unwrap();
        for folder in ["objects", "tmp", "corrupt"] {
            fs::create_dir(root.path().join(folder)).unwrap();
        }
        let objects = Objects::new(root.path(), Disk::default());
        (root, objects)
    }

    fn n_files(root: &TempDir, folder: &str) -> usize {
        fs::read_dir(root.path().join(folder)).unwrap().count()
    }

    #[test]
    fn outputs_up_to_4096_bytes_are_inline_and_larger_ones_are_files() {
        let (root, objects) = store();
        for (len, is_inline) in [(0, true), (4096, true), (4097, false), (100_000, false)] {
            let bytes = vec![7; len];
            let output = objects.put(&bytes).unwrap();
            assert_eq!((output.inline.is_some(), output.size), (is_inline, len as u64));
            assert_eq!(objects.place(&output.digest).1.exists(), !is_inline);
            assert!(objects.has(&output));
            let lost = Output { inline: None, ..output.clone() };
            assert_eq!(objects.has(&lost), !is_inline);
            assert!(!objects.has(&Output { size: 1, ..lost }));
            assert_eq!(objects.read(&output).unwrap(), Fetched::Bytes(bytes.into()));
        }
        assert_eq!(n_files(&root, "tmp"), 0);
    }

    #[test]
    fn an_object_is_named_by_its_digest_and_read_only() {
        let (root, objects) = store();
        let output = objects.put(&[0; 5000]).unwrap();
        let hex = output.digest.to_string();
        let path = root.path().join("objects").join(&hex[..2]).join(&hex);
        assert_eq!(fs::read(&path).unwrap(), [0; 5000]);
        assert!(fs::metadata(&path).unwrap().permissions().readonly());
    }

    #[cfg(unix)]
    #[test]
    fn an_object_that_is_there_is_left_alone() {
        use std::os::unix::fs::MetadataExt as _;
        let (_root, objects) = store();
        let path = objects.place(&objects.put(&[1; 5000]).unwrap().digest).1;
        let inode = fs::metadata(&path).unwrap().ino();
        objects.put(&[1; 5000]).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().ino(), inode);
    }

    #[test]
    fn a_flipped_bit_is_never_served() {
        let (_root, objects) = store();
        // Shorter than an object ever is, so that each of its bits has its turn.
        let mut damaged: Vec<u8> = (0..100).collect();
        let output = Output { digest: Digest::of(&damaged), size: 100, inline: None };
        let (folder, path) = objects.place(&output.digest);
        fs::create_dir(folder).unwrap();
        fs::write(&path, &damaged).unwrap();
        let bytes = Fetched::Bytes(damaged.as_slice().into());
        assert_eq!(objects.read(&output).unwrap(), bytes);
        for bit in 0..damaged.len() * 8 {
            damaged[bit / 8] ^= 1 << (bit % 8);
            fs::write(&path, &damaged).unwrap();
            let Fetched::Corrupt { moved_to } = objects.read(&output).unwrap() else {
                panic!("bit {bit} was served");
            };
            assert!(moved_to.exists() && !path.exists());
            fs::remove_file(moved_to).unwrap();
            damaged[bit / 8] ^= 1 << (bit % 8);
        }
        assert_eq!(objects.read(&output).unwrap(), Fetched::Missing);
    }

    #[test]
    fn put_heals_an_object_whether_or_not_its_damage_was_read() {
        let (root, objects) = store();
        let output = objects.put(&[1; 5000]).unwrap();
        let (_, path) = objects.place(&output.digest);
        for (damage, is_read) in [(5000, true), (5000, false), (4999, true), (4999, false)] {
            fs::remove_file(&path).unwrap();
            fs::write(&path, vec![2; damage]).unwrap();
            if is_read {
                let Fetched::Corrupt { moved_to } = objects.read(&output).unwrap() else {
                    panic!("damage was served");
                };
                assert_eq!(fs::read(moved_to).unwrap(), vec![2; damage]);
            }
            assert_eq!(objects.put(&[1; 5000]).unwrap(), output);
            assert_eq!(objects.read(&output).unwrap(), Fetched::Bytes([1; 5000].into()));
        }
        assert_eq!((n_files(&root, "tmp"), n_files(&root, "corrupt")), (0, 2));
    }

    #[test]
    fn readers_of_one_damaged_object_put_only_damage_aside() {
        let (root, objects) = store();
        let output = objects.put(&[1; 5000]).unwrap();
        let (_, path) = objects.place(&output.digest);
        for _ in 0..200 {
            fs::remove_file(&path).unwrap();
            fs::write(&path, [2; 5000]).unwrap();
            std::thread::scope(|scope| {
                for _ in 0..3 {
                    scope.spawn(|| {
                        if !matches!(objects.read(&output).unwrap(), Fetched::Bytes(_)) {
                            objects.put(&[1; 5000]).unwrap();
                        }
                    });
                }
            });
            assert_eq!(objects.read(&output).unwrap(), Fetched::Bytes([1; 5000].into()));
        }
        for file in fs::read_dir(root.path().join("corrupt")).unwrap() {
            assert_eq!(fs::read(file.unwrap().path()).unwrap(), [2; 5000]);
        }
    }

    #[test]
    fn threads_that_put_the_same_bytes_share_one_file() {
        let (root, objects) = store();
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for n in 0..20 {
                        let bytes = vec![n; 9000];
                        let output = objects.put(&bytes).unwrap();
                        assert_eq!(objects.read(&output).unwrap(), Fetched::Bytes(bytes.into()));
                    }
                });
            }
        });
        let folders = fs::read_dir(root.path().join("objects")).unwrap();
        let n_objects: usize =
            folders.map(|f| fs::read_dir(f.unwrap().path()).unwrap().count()).sum();
        assert_eq!((n_objects, n_files(&root, "tmp")), (20, 0));
    }
}
