//! Projects to run `ivx` in.

use std::fs;
use std::path::Path;
use std::process::Command;

/// A project with these files, in which nothing has run yet.
pub(crate) fn project(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("temporary folders can be made");
    fs::create_dir(folder.path().join(".ivx")).expect("the folder is empty");
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("it lies in a folder"))
            .expect("folders can be made");
        fs::write(path, text).expect("files can be written");
    }
    folder
}

/// `ivx` in a folder, which has its cache there and no store.
pub(crate) fn ivx(folder: &Path, args: &[&str]) -> Command {
    let mut ivx = Command::new(env!("CARGO_BIN_EXE_ivx"));
    ivx.args(args).current_dir(folder).env_remove("IVX_CACHE").env_remove("IVX_STORE");
    ivx
}
