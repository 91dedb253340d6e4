//! Two folders that change places at once.

use std::io;
use std::path::Path;

/// Makes each of two paths what the other was, in one step that whoever looks sees done or not begun.
///
/// # Errors
/// If one is not there, or the system or the file system cannot.
#[cfg(target_os = "linux")]
pub fn exchange(a: &Path, b: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    // Asked of the kernel: the C library has this since 2018 only, and wheels are for older ones.
    renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE).map_err(io::Error::from)
}

/// As on systems that can, which this is none of.
///
/// # Errors
/// Always.
#[cfg(not(target_os = "linux"))]
pub fn exchange(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}
