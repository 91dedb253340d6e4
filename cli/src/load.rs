//! Reads a spec and the files that it names.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

use ivx_grammar::ast::{Item, ItemKind};
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
        let mut named_texts = Vec::new();
        published(&ast.items, &mut named_texts);
        let stem = project::name(path);
        self.loaded.project.files.push(File {
            path: shown,
            stem,
            text,
            ast,
            links: BTreeMap::new(),
            texts: BTreeMap::new(),
            externals: BTreeMap::new(),
        });
        self.known.insert(path.to_owned(), index);
        self.open.push(path.to_owned());
        for name in named {
            if let Some(linked) = self.link(path, &name) {
                self.loaded.project.files[index].links.insert(name.value, linked);
            }
        }
        self.open.pop();
        for name in named_texts {
            let text = self.place(path, &name).and_then(|place| self.text(&place, &name));
            let texts = &mut self.loaded.project.files[index].texts;
            texts.extend(text.map(|text| (name.value, text)));
        }
        index
    }

    /// The file that `name` means in the file at `from`.
    fn link(&mut self, from: &Path, name: &Spanned<String>) -> Option<usize> {
        let path = self.place(from, name)?;
        if let Some(start) = self.open.iter().position(|open| *open == path) {
            let circle = self.open[start..].iter().chain([&path]);
            let circle: Vec<_> = circle.map(|path| self.shown(path)).collect();
            let message = format!("files name each other in a circle: {}", circle.join(" -> "));
            let fault = Diagnostic::new(Code::Cycle, name.span, message, "closes the circle");
            let help = "move what both need to a file of its own";
            self.loaded.diagnostics.push(fault.help(help));
            return None;
        }
        if let Some(known) = self.known.get(&path) {
            return Some(*known);
        }
        let text = self.text(&path, name)?;
        Some(self.file(&path, text))
    }

    /// Where the file lies that `name` means in the file at `from`.
    fn place(&mut self, from: &Path, name: &Spanned<String>) -> Option<PathBuf> {
        let folder = from.parent().expect("a file lies in a folder");
        let wanted = lexical(&folder.join(&name.value));
        let found = wanted.starts_with(&self.loaded.root).then(|| fs::canonicalize(&wanted));
        match found {
            Some(Ok(path)) if path.starts_with(&self.loaded.root) => Some(path),
            Some(Err(error)) => {
                self.unread(name, &error, near(&wanted, &name.value));
                None
            }
            _ => {
                let message = format!("`{}` lies outside the project", name.value);
                let fault =
                    Diagnostic::new(Code::Outside, name.span, message, "not in the project");
                let help = "specs name files of their own project only";
                self.loaded.diagnostics.push(fault.help(help));
                None
            }
        }
    }

    /// The text of the file at `path`.
    fn text(&mut self, path: &Path, name: &Spanned<String>) -> Option<String> {
        fs::read_to_string(path).map_err(|error| self.unread(name, &error, None)).ok()
    }

    fn unread(&mut self, name: &Spanned<String>, error: &std::io::Error, help: Option<String>) {
        let message = format!("`{}` cannot be read: {}", name.value, plain(error));
        let fault = Diagnostic::new(Code::File, name.span, message, "not read");
        self.loaded.diagnostics.push(fault.maybe_help(help));
    }

    /// A path as shown: below the project's folder.
    fn shown(&self, path: &Path) -> String {
        path.strip_prefix(&self.loaded.root).unwrap_or(path).display().to_string()
    }
}

/// The files of published numbers that items name, in experiments too.
fn published(items: &[Item], paths: &mut Vec<Spanned<String>>) {
    for item in items {
        match &item.kind {
            ItemKind::Published { path, .. } => paths.push(path.clone()),
            ItemKind::Experiment { items, .. } => published(items, paths),
            _ => {}
        }
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

/// The files of its kind beside a file that is not there, as advice.
fn near(wanted: &Path, name: &str) -> Option<String> {
    let folder = wanted.parent()?;
    let files = fs::read_dir(folder)
        .ok()?
        .flatten()
        .map(|entry| entry.file_name().to_string_lossy().into_owned());
    let prefix = name.rsplit_once('/').map_or("", |(prefix, _)| prefix);
    let join = |file: String| if prefix.is_empty() { file } else { format!("{prefix}/{file}") };
    let kind = wanted.extension().unwrap_or("ivx".as_ref());
    let is_alike = |file: &String| Path::new(file).extension().is_some_and(|own| own == kind);
    let known: Vec<String> = files.filter(is_alike).map(join).collect();
    suggest(name, known.iter().map(String::as_str))
}
