//! What runs found out, whole: equal finds are one file, which summaries of runs name.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::{Cache, CacheError, Digest, History, Run};

pub(crate) const FOUND: &str = "found";
/// How hard it is compressed: a run waits for it.
const LEVEL: i32 = 1;
/// No find is larger: a damaged one could claim to be anything.
const MAX: u64 = 4 << 30;

impl Cache {
    /// Keeps what a run found out until no summary of a run has its digest in it any more.
    ///
    /// # Errors
    /// If the disk fails or is full.
    pub fn keep_found(&self, found: &[u8]) -> Result<Digest, CacheError> {
        let digest = Digest::of(found);
        let path = place(&self.root, &digest);
        if decode(&path, &digest)?.is_none() {
            let packed = zstd::bulk::compress(found, LEVEL);
            let packed = packed.map_err(|source| CacheError::Io { path: path.clone(), source })?;
            self.publish(&path, &packed)?;
        }
        Ok(digest)
    }
}

impl History {
    /// What a run found out; none if it is gone or damaged.
    ///
    /// # Errors
    /// If the disk fails.
    pub fn found(&self, digest: &Digest) -> Result<Option<Vec<u8>>, CacheError> {
        decode(&place(&self.root, digest), digest)
    }
}

/// Whether a file of this name is whole, of these packed bytes.
pub(crate) fn is_whole(name: &str, packed: &[u8]) -> bool {
    name.parse().is_ok_and(|digest| unpack(packed, &digest).is_some())
}

/// The names of what runs found out.
pub(crate) fn named<'a>(runs: impl IntoIterator<Item = &'a Run>) -> BTreeSet<&'a str> {
    let words = runs.into_iter().flat_map(|run| {
        run.summary.split(|c: char| !c.is_ascii_hexdigit()).filter(|word| word.len() == 64)
    });
    words.collect()
}

fn decode(path: &Path, digest: &Digest) -> Result<Option<Vec<u8>>, CacheError> {
    match fs::read(path) {
        Ok(packed) => Ok(unpack(&packed, digest)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(CacheError::Io { path: path.to_owned(), source }),
    }
}

fn unpack(packed: &[u8], digest: &Digest) -> Option<Vec<u8>> {
    let mut found = Vec::new();
    let reader = zstd::Decoder::new(packed).ok()?;
    io::Read::read_to_end(&mut io::Read::take(reader, MAX), &mut found).ok()?;
    (Digest::of(&found) == *digest).then_some(found)
}

fn place(root: &Path, digest: &Digest) -> PathBuf {
    root.join(FOUND).join(digest.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_finds_are_one_and_a_damaged_one_is_written_anew() {
        let root = tempfile::tempdir().unwrap();
        let cache = Cache::open(root.path(), "x").unwrap();
        let found = b"gap 1.0".repeat(100);
        let digest = cache.keep_found(&found).unwrap();
        assert_eq!(cache.keep_found(&found).unwrap(), digest);
        let path = place(root.path(), &digest);
        let history = || History::open(root.path()).unwrap();
        assert_eq!(history().found(&digest).unwrap(), Some(found.clone()));
        assert!(fs::metadata(&path).unwrap().len() < 100);
        for damaged in [&b""[..], b"gap", &fs::read(&path).unwrap()[1..]] {
            fs::remove_file(&path).unwrap();
            fs::write(&path, damaged).unwrap();
            assert_eq!(history().found(&digest).unwrap(), None);
            assert!(!is_whole(&digest.to_string(), damaged));
        }
        cache.keep_found(&found).unwrap();
        assert_eq!(history().found(&digest).unwrap(), Some(found));
        assert_eq!(history().found(&Digest::of(b"other")).unwrap(), None);
    }

    #[test]
    fn a_sweep_leaves_what_a_run_names() {
        let root = tempfile::tempdir().unwrap();
        let cache = Cache::open(root.path(), "x").unwrap();
        let [wanted, other] = [b"1", b"2"].map(|found| cache.keep_found(found).unwrap());
        cache.note_run(1, vec![], &format!("(found:\"{wanted}\")")).unwrap();
        cache.close().unwrap();
        crate::sweep(root.path(), crate::Sweep::Wet, |_| crate::Wanted::default()).unwrap();
        let history = History::open(root.path()).unwrap();
        assert_eq!(history.found(&wanted).unwrap().as_deref(), Some(&b"1"[..]));
        assert_eq!(history.found(&other).unwrap(), None);
    }
}
