//! Where a spec's project lies.

use std::path::{Component, Path, PathBuf};

/// What marks the folder of a project.
const MARKS: [&str; 2] = [".ivx", ".git"];

/// The folder of the project: the nearest around the spec that has `.ivx` or `.git`, otherwise
/// the spec's own.
pub(crate) fn root(spec: &Path) -> PathBuf {
    let folder = spec.parent().unwrap_or(Path::new("/"));
    folder.ancestors().find(|folder| is_marked(folder)).unwrap_or(folder).to_owned()
}

/// Whether a folder says itself that it is one of a project.
pub(crate) fn is_marked(folder: &Path) -> bool {
    MARKS.iter().any(|mark| folder.join(mark).exists())
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

/// Where the results of a project lie.
pub(crate) fn results(root: &Path) -> PathBuf {
    root.join("results")
}

/// The name of a file without its extension, by which its parameters are addressed.
pub(crate) fn stem(spec: &Path) -> String {
    spec.file_stem().map_or_else(|| "spec".to_owned(), |stem| stem.to_string_lossy().into_owned())
}

/// A path with its links resolved, as far as it is there.
pub(crate) fn real(path: &Path) -> PathBuf {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let found =
        path.ancestors().find_map(|above| Some((above, std::fs::canonicalize(above).ok()?)));
    match found {
        Some((above, real)) => match path.strip_prefix(above) {
            Ok(rest) if rest.as_os_str().is_empty() => real,
            Ok(rest) => real.join(rest),
            Err(_) => path.clone(),
        },
        None => path.clone(),
    }
}

/// A path as one writes it who stands in the current folder.
pub(crate) fn shown(path: &Path) -> String {
    let here = std::env::current_dir().unwrap_or_default();
    seen_from(&here, path).display().to_string()
}

/// A path, seen from a folder: upwards only as far as both have more than the root above them.
pub(crate) fn seen_from(here: &Path, path: &Path) -> PathBuf {
    let shared = here.components().zip(path.components()).take_while(|(a, b)| a == b).count();
    let above = here.components().take(shared).filter(|part| matches!(part, Component::Normal(_)));
    if above.count() == 0 {
        return path.to_owned();
    }
    let up = here.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(path.components().skip(shared)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_seen_from_where_one_stands() {
        let check = |here: &str, path: &str, expected: &str| {
            assert_eq!(seen_from(Path::new(here), Path::new(path)), Path::new(expected));
        };
        check("/home/a/p", "/home/a/p/results/s/report.html", "results/s/report.html");
        check("/home/a/p/x/y", "/home/a/p/results/s", "../../results/s");
        check("/home/a/p/results/s", "/home/a/p/results/s/report.html", "report.html");
        check("/home/a", "/srv/p/results/s", "/srv/p/results/s");
        check("/", "/srv/p", "/srv/p");
    }
}
