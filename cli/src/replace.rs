//! Writes a file whole or not at all.

use std::fs::{self, OpenOptions};
use std::io::ErrorKind;
use std::path::Path;

use crate::ending::unfinished;
use crate::{At as _, Trouble};

/// Makes `text` the content of a file, which keeps its permissions and may be new.
///
/// # Errors
/// If the file may not be written or the disk fails; the file is then as before.
pub(crate) fn replace(path: &Path, text: &str) -> Result<(), Trouble> {
    // A link goes on pointing to where it did.
    let path = &fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let permissions = match OpenOptions::new().write(true).open(path) {
        Ok(file) => Some(file.metadata().at(path)?.permissions()),
        Err(error) if error.kind() == ErrorKind::NotFound => None,
        Err(error) => return Err(error).at(path),
    };
    let temporary = path.with_added_extension(format!("{}.tmp", std::process::id()));
    let written = unfinished(&temporary, || {
        fs::write(&temporary, text)
            .and_then(|()| permissions.map_or(Ok(()), |p| fs::set_permissions(&temporary, p)))
            .at(&temporary)
            .and_then(|()| fs::rename(&temporary, path).at(path))
    });
    if written.is_err() {
        // The first error is the one to tell.
        fs::remove_file(&temporary).ok();
    }
    written
}
