//! A project of its own for one test, and the command run in it.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

/// A folder with specs, a cache and results.
pub(crate) struct Project {
    folder: TempDir,
}

/// What a run of the command said.
pub(crate) struct Said {
    /// The exit code.
    pub(crate) code: u8,
    /// Standard output.
    pub(crate) out: String,
    /// Standard error.
    pub(crate) err: String,
}

impl Project {
    /// A project with these files: path and text.
    pub(crate) fn with(files: &[(&str, &str)]) -> Self {
        Self::at(tempfile::tempdir().expect("temporary folders can be made"), files)
    }

    /// As [`Self::with`], in memory where the system has such a folder.
    pub(crate) fn in_memory(files: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir());
        Self::at(folder.expect("temporary folders can be made"), files)
    }

    fn at(folder: TempDir, files: &[(&str, &str)]) -> Self {
        fs::create_dir(folder.path().join(".ivx")).expect("the folder is empty");
        let project = Self { folder };
        for (path, text) in files {
            project.write(path, text);
        }
        project
    }

    /// Writes a file.
    pub(crate) fn write(&self, path: &str, text: &str) {
        let path = self.path(path);
        fs::create_dir_all(path.parent().expect("files lie in folders"))
            .expect("folders can be made");
        fs::write(path, text).expect("files can be written");
    }

    /// Where a file lies.
    pub(crate) fn path(&self, path: &str) -> PathBuf {
        self.folder.path().join(path)
    }

    /// The text of a file.
    pub(crate) fn read(&self, path: &str) -> String {
        fs::read_to_string(self.path(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
    }

    /// Runs a subcommand on a spec of the project.
    pub(crate) fn run(&self, command: &str, spec: &str, rest: &[&str]) -> Said {
        let mut args: Vec<OsString> = vec!["ivx".into(), command.into(), self.path(spec).into()];
        args.extend(rest.iter().map(OsString::from));
        run(args)
    }

    /// How many nodes a run of the spec executes.
    ///
    /// # Panics
    /// If the run fails.
    #[track_caller]
    pub(crate) fn executed(&self, spec: &str, rest: &[&str]) -> usize {
        let said = self.run("exec", spec, rest);
        assert_eq!(said.code, 0, "{}{}", said.out, said.err);
        let line = said
            .out
            .lines()
            .find(|line| line.contains("nodes executed"))
            .expect("exec says what it executed");
        let first = line.split_whitespace().next().expect("the line begins with the number");
        first.parse().expect("the line begins with the number")
    }

    /// Every file of a folder, by its path there.
    pub(crate) fn files(&self, folder: &str) -> Vec<(String, Vec<u8>)> {
        let mut files = Vec::new();
        collect(&self.path(folder), &self.path(folder), &mut files);
        files.sort();
        files
    }
}

/// Runs the command.
pub(crate) fn run(args: Vec<OsString>) -> Said {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let code = ivx_cli::run(args, &mut out, &mut err);
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("the command speaks UTF-8");
    Said { code, out: text(out), err: text(err) }
}

fn collect(root: &Path, folder: &Path, files: &mut Vec<(String, Vec<u8>)>) {
    for entry in fs::read_dir(folder).expect("the folder is there").flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(root, &path, files);
        } else {
            let name = path.strip_prefix(root).expect("the file lies below").display().to_string();
            files.push((name, fs::read(&path).expect("files can be read")));
        }
    }
}
