//! What long computations have done so far: one file each, replaced whole.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use crate::{CacheError, Digest, Disk, durable};

/// The checkpoints of a store; cheap to clone, for worker threads.
#[derive(Clone, Debug)]
pub struct Checkpoints {
    root: Arc<Path>,
    disk: Disk,
}

impl Checkpoints {
    pub(crate) fn new(root: &Path, disk: Disk) -> Self {
        Self { root: root.into(), disk }
    }

    /// What was kept under a name; `None` if nothing was, or it is damaged.
    #[must_use]
    pub fn load(&self, name: &Digest) -> Option<Vec<u8>> {
        let bytes = fs::read(self.place(name)).ok()?;
        let (digest, state) = bytes.split_first_chunk::<32>()?;
        (Digest::of(state).0 == *digest).then(|| state.to_vec())
    }

    /// Keeps a state under a name, in the place of the one before.
    ///
    /// # Errors
    /// If the disk fails or is full; what was kept before is still there then.
    pub fn save(&self, name: &Digest, state: &[u8]) -> Result<(), CacheError> {
        let temporary = self.root.join("tmp").join(durable::unique_name());
        let bytes = [&Digest::of(state).0[..], state].concat();
        durable::publish(&self.disk, &temporary, &self.place(name), &bytes)
    }

    /// Forgets what was kept; what stays costs room only.
    pub fn remove(&self, name: &Digest) {
        self.disk.remove(&self.place(name)).ok();
    }

    fn place(&self, name: &Digest) -> std::path::PathBuf {
        self.root.join("checkpoints").join(name.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_checkpoint_is_whole_or_none() {
        let root = tempfile::tempdir().unwrap();
        for folder in ["checkpoints", "tmp"] {
            fs::create_dir(root.path().join(folder)).unwrap();
        }
        let (checkpoints, name) =
            (Checkpoints::new(root.path(), Disk::default()), Digest::of(b"a"));
        assert_eq!(checkpoints.load(&name), None);
        for state in [&b"one"[..], b"", b"longer than before"] {
            checkpoints.save(&name, state).unwrap();
            assert_eq!(checkpoints.load(&name).as_deref(), Some(state));
        }
        assert_eq!(checkpoints.load(&Digest::of(b"b")), None);
        let path = checkpoints.place(&name);
        let mut bytes = fs::read(&path).unwrap();
        bytes[40] ^= 1;
        fs::remove_file(&path).unwrap();
        fs::write(&path, &bytes).unwrap();
        assert_eq!(checkpoints.load(&name), None);
        fs::write(&path, &bytes[..20]).unwrap();
        assert_eq!(checkpoints.load(&name), None);
        checkpoints.remove(&name);
        assert!(!path.exists());
    }
}
