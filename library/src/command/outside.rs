//! Looks up what specs name outside of themselves.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs::{self, File, Metadata};
use std::io::Read as _;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use ivx_op::{Content, External};
use sha2::{Digest as _, Sha256};

use super::setting::is_name;

/// The largest file that a spec may name, in bytes: it is held in memory.
const MAX_FILE: u64 = 256 << 20;

/// The file that lies at `path`, under the name it has in a working folder: the name as written
/// without the `..` it begins with.
///
/// # Errors
/// Why it cannot be used.
pub fn file(name: &str, path: &Path) -> Result<External, String> {
    let about = |error: std::io::Error| format!("cannot be read: {error}");
    let found = fs::metadata(path).map_err(about)?;
    if found.is_dir() {
        return Err("is a folder: name the files in it".to_owned());
    }
    if !found.is_file() {
        return Err("is no regular file".to_owned());
    }
    let large = || format!("is larger than {} MiB", MAX_FILE >> 20);
    if found.len() > MAX_FILE {
        return Err(large());
    }
    let mut bytes = Vec::new();
    File::open(path).map_err(about)?.take(MAX_FILE + 1).read_to_end(&mut bytes).map_err(about)?;
    if bytes.len() as u64 > MAX_FILE {
        return Err(large());
    }
    let name = place(name).ok_or("has no name")?;
    Ok(External::file(name, bytes, is_executable(&found)))
}

/// Where a file appears in a working folder.
fn place(name: &str) -> Option<String> {
    let mut parts: Vec<&str> = Vec::new();
    for part in Path::new(name).components() {
        match part {
            Component::Normal(part) => parts.push(part.to_str()?),
            Component::ParentDir => drop(parts.pop()),
            Component::CurDir | Component::RootDir | Component::Prefix(_) => {}
        }
    }
    (!parts.is_empty()).then(|| parts.join("/"))
}

/// Where the program of this name lies: an absolute path, or what lies first in the folders of `search`.
///
/// # Errors
/// Why it cannot be used.
pub fn find(name: &str, search: &OsStr) -> Result<PathBuf, String> {
    let path = if Path::new(name).is_absolute() {
        PathBuf::from(name)
    } else if name.is_empty() || name.contains('/') {
        return Err("is neither the name of a program nor an absolute path".to_owned());
    } else {
        let folders = std::env::split_paths(search).filter(|folder| folder.is_absolute());
        let mut places = folders.map(|folder| folder.join(name));
        places.find(|path| is_program(path)).ok_or("is in no folder of PATH")?
    };
    if !is_program(&path) {
        return Err("is no file that can be executed".to_owned());
    }
    Ok(path)
}

/// The program of this name, where it is found.
///
/// # Errors
/// Why it cannot be used.
pub fn program(name: &str, search: &OsStr) -> Result<External, String> {
    let path = find(name, search)?;
    let digest = digest(&path).map_err(|error| format!("cannot be read: {error}"))?;
    Ok(External { name: name.to_owned(), digest, content: Content::Program(path) })
}

fn is_program(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| found.is_file() && is_executable(&found))
}

/// Whether somebody may execute a file.
pub(super) fn is_executable(found: &Metadata) -> bool {
    found.mode() & 0o111 != 0
}

/// The variable of this name.
///
/// # Errors
/// If no variable can be called so.
pub fn variable(name: &str) -> Result<External, String> {
    let value = is_name(name).then(|| std::env::var_os(name));
    value.map(|value| External::variable(name.to_owned(), value)).ok_or_else(|| {
        "is no name of a variable: letters, digits and `_`, beginning with no digit".to_owned()
    })
}

/// What tells that a file was not written to: device, number, size and times in nanoseconds.
type Stamp = (u64, u64, u64, i64, i64, i64, i64);

/// The digest of a program's bytes, read again only when the file has changed.
pub(super) fn digest(path: &Path) -> std::io::Result<[u8; 32]> {
    static KNOWN: Mutex<BTreeMap<PathBuf, (Stamp, [u8; 32])>> = Mutex::new(BTreeMap::new());
    let stamp = stamp(&fs::metadata(path)?);
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, digest)) = known.get(path).filter(|(before, _)| *before == stamp) {
        return Ok(*digest);
    }
    let mut file = File::open(path)?;
    let mut hash = Sha256::new();
    let mut chunk = vec![0; 1 << 16];
    loop {
        let n = file.read(&mut chunk)?;
        if n == 0 {
            break;
        }
        hash.update(&chunk[..n]);
    }
    let digest = hash.finalize().into();
    known.insert(path.to_owned(), (stamp, digest));
    Ok(digest)
}

fn stamp(found: &Metadata) -> Stamp {
    let (modified, changed) =
        ((found.mtime(), found.mtime_nsec()), (found.ctime(), found.ctime_nsec()));
    (found.dev(), found.ino(), found.len(), modified.0, modified.1, changed.0, changed.1)
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    #[test]
    fn a_file_appears_below_the_folder_whatever_its_path() {
        let check = |name: &str, expected: Option<&str>| {
            assert_eq!(place(name).as_deref(), expected, "{name}");
        };
        check("train.py", Some("train.py"));
        check("./lib/net.py", Some("lib/net.py"));
        check("../common/data.csv", Some("common/data.csv"));
        check("lib/../train.py", Some("train.py"));
        check("..", None);
    }

    #[test]
    fn what_is_no_file_of_bearable_size_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        fs::write(&path, "abc").unwrap();
        assert_eq!(file("x", &path).unwrap(), External::file("x".into(), b"abc".to_vec(), false));
        assert!(file("x", folder.path()).unwrap_err().contains("folder"));
        // As large as it claims to be, and empty on the disk.
        File::create(&path).unwrap().set_len(MAX_FILE + 1).unwrap();
        assert!(file("x", &path).unwrap_err().contains("larger than 256 MiB"));
    }

    #[test]
    fn programs_are_found_in_the_folders_given_and_known_by_their_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tool");
        fs::write(&path, "#!/bin/sh\n").unwrap();
        let search = folder.path().as_os_str();
        assert!(program("tool", search).unwrap_err().contains("PATH"));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
        let first = program("tool", search).unwrap();
        assert_eq!(first.content, Content::Program(path.clone()));
        fs::write(&path, "#!/bin/sh\nexit 1\n").unwrap();
        assert_ne!(program("tool", search).unwrap().digest, first.digest);
        for wrong in ["", "./tool", "/nowhere/tool", "/"] {
            assert!(program(wrong, search).is_err(), "{wrong}");
        }
        assert!(program("tool", OsStr::new("relative:")).is_err());
    }

    #[test]
    fn variables_have_plain_names() {
        assert!(variable("PATH").is_ok());
        for wrong in ["", "A=B", "1A", "A B"] {
            assert!(variable(wrong).is_err(), "{wrong}");
        }
    }
}
