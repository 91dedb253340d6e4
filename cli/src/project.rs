//! Where a spec's project lies.

use std::path::{Path, PathBuf};

/// The folder of the project: the nearest around the spec that has `.ivx` or `.git`, otherwise
/// the spec's own.
pub(crate) fn root(spec: &Path) -> PathBuf {
    let folder = spec.parent().unwrap_or(Path::new("/"));
    let marked = |folder: &&Path| [".ivx", ".git"].iter().any(|mark| folder.join(mark).exists());
    folder.ancestors().find(marked).unwrap_or(folder).to_owned()
}

/// The folder of the project that the command is called in: the nearest around it that has
/// `.ivx` or `.git`, otherwise the current one.
pub(crate) fn here() -> PathBuf {
    let folder = std::env::current_dir().unwrap_or_else(|_| PathBuf::from("."));
    root(&folder.join("spec"))
}

/// The cache of a project.
pub(crate) fn cache(root: &Path) -> PathBuf {
    let elsewhere = std::env::var_os("IVX_CACHE").filter(|path| !path.is_empty());
    elsewhere.map_or_else(|| root.join(".ivx/cache"), PathBuf::from)
}

/// The name of a spec: its file's, without the extension.
pub(crate) fn name(spec: &Path) -> String {
    spec.file_stem().map_or_else(|| "spec".to_owned(), |stem| stem.to_string_lossy().into_owned())
}
