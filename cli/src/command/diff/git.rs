//! Results at a git revision.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::found::Found;

/// What git knows of a revision.
pub(super) enum Revision {
    /// It is none, or there is no git.
    Unknown,
    /// The results folders tracked there, by name; and its commit.
    Known { commit: String, found: BTreeMap<String, Found> },
    /// A file of it does not read, and why.
    Broken(String),
}

/// The results tracked at a revision, below the project's root.
pub(super) fn at(root: &Path, revision: &str) -> Revision {
    // Whatever it is called, it is no option.
    let commit = format!("{revision}^{{commit}}");
    let resolve = ["rev-parse", "--verify", "--quiet", "--end-of-options", &commit];
    let Some(commit) = git(root, resolve).filter(|_| !revision.starts_with('-')) else {
        return Revision::Unknown;
    };
    let commit = commit.trim().to_owned();
    let list = ["ls-tree", "-r", "-z", "--name-only", &commit, "--", "results/"];
    let paths = git(root, list).unwrap_or_default();
    let names = paths
        .split('\0')
        .filter_map(|path| path.strip_prefix("results/")?.strip_suffix("/results.ron"));
    let mut found = BTreeMap::new();
    for name in names {
        let text = |file| {
            let blob = format!("{commit}:./results/{name}/{file}");
            git(root, ["cat-file", "blob", &blob])
        };
        let results = text("results.ron").ok_or("it can't be read".to_owned());
        match results.and_then(|results| Found::of(&results, text("run.ron").as_deref())) {
            Ok(results) => found.insert(name.to_owned(), results),
            Err(why) => return Revision::Broken(format!("results/{name}/results.ron: {why}")),
        };
    }
    Revision::Known { commit, found }
}

/// The text of a file as it is at a revision; none if either is not known.
pub(in super::super) fn file(root: &Path, revision: &str, path: &Path) -> Option<String> {
    if revision.starts_with('-') {
        return None;
    }
    let path = path.strip_prefix(root).ok()?.to_str()?;
    let blob = format!("{revision}:./{}", path.replace('\\', "/"));
    git(root, ["cat-file", "blob", &blob])
}

/// What git says; nothing if it fails or is not there.
fn git<S: AsRef<OsStr>>(root: &Path, args: impl IntoIterator<Item = S>) -> Option<String> {
    let mut git = Command::new("git");
    git.arg("-C").arg(root).args(args).stdin(Stdio::null()).env("GIT_OPTIONAL_LOCKS", "0");
    let output = git.output().ok()?;
    output.status.success().then(|| String::from_utf8(output.stdout).ok())?
}
