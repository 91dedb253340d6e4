//! Reads a spec and the files that it names.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

use ivx_grammar::ast::ItemKind;
use ivx_grammar::check::{File, Project};
use ivx_grammar::{Code, Diagnostic, Spanned, parse, suggest};

use crate::{Trouble, project};

/// A spec's files, and what is wrong with them so far.
pub(crate) struct Loaded {
    /// The files, the spec first.
    pub(crate) project: Project,
    /// Faults of reading and parsing.
    pub(crate) diagnostics: Vec<Diagnostic>,
    /// The folder of the project.
    pub(crate) root: PathBuf,
}

/// Reads a spec, and the files that it and they name by `use` and `include`.
///
/// # Errors
/// If the spec itself cannot be read. Other files that cannot are diagnostics.
pub(crate) fn load(spec: &Path) -> Result<Loaded, Trouble> {
    let unread = |source| Trouble::Spec { path: spec.display().to_string(), source };
    let path = fs::canonicalize(spec).map_err(unread)?;
    let root = project::root(&path);
    let mut loader = Loader {
        loaded: Loaded { project: Project::default(), diagnostics: Vec::new(), root },
        known: BTreeMap::new(),
        open: Vec::new(),
    };
    let text = fs::read_to_string(&path).map_err(unread)?;
    loader.file(&path, text);
    Ok(loader.loaded)
}

struct Loader {
    loaded: Loaded,
    known: BTreeMap<PathBuf, usize>,
    /// The files between the spec and the one being read.
    open: Vec<PathBuf>,
}

impl Loader {
    fn file(&mut self, path: &Path, text: String) -> usize {
        let index = self.loaded.project.files.len();
        let (ast, faults) = parse(&text, u32::try_from(index).expect("files are few"));
        self.loaded.diagnostics.extend(faults);
        let shown = self.shown(path);
        let named: Vec<Spanned<String>> = ast
            .items
            .iter()
            .filter_map(|item| match &item.kind {
                ItemKind::Use { path, .. } | ItemKind::Include { path } => Some(path.clone()),
                _ => None,
            })
            .collect();
        let stem = project::name(path);
        self.loaded.project.files.push(File {
            path: shown,
            stem,
            text,
            ast,
            links: BTreeMap::new(),
        });
        self.known.insert(path.to_owned(), index);
        self.open.push(path.to_owned());
        for name in named {
            if let Some(linked) = self.link(path, &name) {
                self.loaded.project.files[index].links.insert(name.value, linked);
            }
        }
        self.open.pop();
        index
    }

    /// The file that `name` means in the file at `from`.
    fn link(&mut self, from: &Path, name: &Spanned<String>) -> Option<usize> {
        let folder = from.parent().expect("a file lies in a folder");
        let wanted = lexical(&folder.join(&name.value));
        let fault =
            |code, message: String, label: &str| Diagnostic::new(code, name.span, message, label);
        let outside = || {
            let message = format!("`{}` lies outside the project", name.value);
            fault(Code::Outside, message, "not in the project")
                .help("specs name files of their own project only")
        };
        if !wanted.starts_with(&self.loaded.root) {
            self.loaded.diagnostics.push(outside());
            return None;
        }
        let path = match fs::canonicalize(&wanted) {
            Ok(path) if path.starts_with(&self.loaded.root) => path,
            Ok(_) => {
                self.loaded.diagnostics.push(outside());
                return None;
            }
            Err(error) => {
                let message = format!("`{}` cannot be read: {}", name.value, plain(&error));
                self.loaded.diagnostics.push(
                    fault(Code::File, message, "not read").maybe_help(near(&wanted, &name.value)),
                );
                return None;
            }
        };
        if let Some(start) = self.open.iter().position(|open| *open == path) {
            let circle = self.open[start..].iter().chain([&path]);
            let circle: Vec<_> = circle.map(|path| self.shown(path)).collect();
            let message = format!("files name each other in a circle: {}", circle.join(" -> "));
            let help = "move what both need to a file of its own";
            self.loaded
                .diagnostics
                .push(fault(Code::Cycle, message, "closes the circle").help(help));
            return None;
        }
        if let Some(known) = self.known.get(&path) {
            return Some(*known);
        }
        match fs::read_to_string(&path) {
            Ok(text) => Some(self.file(&path, text)),
            Err(error) => {
                let message = format!("`{}` cannot be read: {}", name.value, plain(&error));
                self.loaded.diagnostics.push(fault(Code::File, message, "not read"));
                None
            }
        }
    }

    /// A path as shown: below the project's folder.
    fn shown(&self, path: &Path) -> String {
        path.strip_prefix(&self.loaded.root).unwrap_or(path).display().to_string()
    }
}

/// The path without `.` and `..`, not asking the disk.
fn lexical(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                plain.pop();
            }
            Component::CurDir => {}
            other => plain.push(other),
        }
    }
    plain
}

fn plain(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
        std::io::ErrorKind::InvalidData => "it is not UTF-8 text".to_owned(),
        _ => error.to_string(),
    }
}

/// The specs beside a file that is not there, as advice.
fn near(wanted: &Path, name: &str) -> Option<String> {
    let folder = wanted.parent()?;
    let specs = fs::read_dir(folder)
        .ok()?
        .flatten()
        .map(|entry| entry.file_name().to_string_lossy().into_owned());
    let prefix = name.rsplit_once('/').map_or("", |(prefix, _)| prefix);
    let join = |spec: String| if prefix.is_empty() { spec } else { format!("{prefix}/{spec}") };
    let is_spec =
        |spec: &String| Path::new(spec).extension().is_some_and(|extension| extension == "ivx");
    let known: Vec<String> = specs.filter(is_spec).map(join).collect();
    suggest(name, known.iter().map(String::as_str))
}
