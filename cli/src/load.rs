//! Reads a spec and the files that it names.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use ivx_cache::Digest;
use ivx_grammar::ast::{Ast, Item, ItemKind};
use ivx_grammar::check::{File, Project};
use ivx_grammar::{
    Code, Diagnostic, Outside, Spanned, externals, known_as, parse, parse_again, suggest,
};
use ivx_library::command;
use ivx_op::{Content, External, ExternalKind, Fields, Lit, Literal as _, Registry};

use crate::changes::{Read, look};
use crate::source::{self, no_spec, plain};
use crate::{Trouble, project};

/// A spec's files, and what is wrong with them so far.
pub(crate) struct Loaded {
    /// The files, the spec first.
    pub(crate) project: Project,
    /// Faults of reading and parsing.
    pub(crate) diagnostics: Vec<Diagnostic>,
    /// The folder of the project.
    pub(crate) root: PathBuf,
    /// Where the spec lies, links resolved: below that folder.
    pub(crate) spec: PathBuf,
    /// The files that were read or looked for, by each path that leads to one, and what was found.
    pub(crate) read: Read,
}

/// Reads a spec, the files that it and they name by `use` and `include`, and what their calls name
/// outside of them.
///
/// # Errors
/// If the spec itself cannot be read. Other files that cannot are diagnostics.
pub(crate) fn load(spec: &Path, registry: &Registry) -> Result<Loaded, Trouble> {
    load_open(spec, registry, &Open { texts: BTreeMap::new(), parsed: &Parsed::new() })
}

/// What an editor has of files, by the path with its links resolved.
pub(crate) struct Open<'a> {
    /// Texts that count instead of those on the disk.
    pub(crate) texts: BTreeMap<&'a Path, &'a str>,
    /// Earlier texts, of which most stays as it was.
    pub(crate) parsed: &'a Parsed,
}

/// Texts that parsed without a fault, and their trees.
pub(crate) type Parsed = BTreeMap<PathBuf, (String, Arc<Ast>)>;

/// The same, where some files are open in an editor.
pub(crate) fn load_open(
    spec: &Path,
    registry: &Registry,
    open: &Open<'_>,
) -> Result<Loaded, Trouble> {
    let unread = |error: std::io::Error| {
        let (path, why) = (spec.display().to_string(), no_spec(spec, &error));
        Trouble::Spec { path, why }
    };
    let path = match open.texts.get(spec) {
        Some(_) => spec.to_owned(),
        None => fs::canonicalize(spec).map_err(unread)?,
    };
    let root = project::root(&path);
    let mut loader = Loader {
        loaded: Loaded {
            project: Project::default(),
            diagnostics: Vec::new(),
            root,
            spec: path.clone(),
            read: Read::new(),
        },
        registry,
        from: open,
        search: std::env::var_os("PATH").unwrap_or_default(),
        known: BTreeMap::new(),
        open: Vec::new(),
        links: Vec::new(),
    };
    let text = loader.read(&path).map_err(unread)?;
    loader.saw(&path, Some(Digest::of(text.as_bytes())));
    loader.links.extend(std::path::absolute(spec).map(|spec| (spec, path.clone())));
    loader.file(&path, text);
    loader.outside();
    for (link, path) in std::mem::take(&mut loader.links) {
        let found = loader.loaded.read.get(&path).copied().flatten();
        loader.loaded.read.entry(link).or_insert(found);
    }
    Ok(loader.loaded)
}

struct Loader<'a> {
    loaded: Loaded,
    registry: &'a Registry,
    from: &'a Open<'a>,
    /// Where programs are looked for.
    search: OsString,
    known: BTreeMap<PathBuf, usize>,
    /// The files between the spec and the one being read.
    open: Vec<PathBuf>,
    /// Paths as they are written, and where they lead.
    links: Vec<(PathBuf, PathBuf)>,
}

impl Loader<'_> {
    fn file(&mut self, path: &Path, text: String) -> usize {
        let index = self.loaded.project.files.len();
        let number = u32::try_from(index).expect("files are few");
        let (ast, faults) = match self.from.parsed.get(path) {
            Some((before, ast)) => parse_again(&text, number, (before, ast)),
            None => parse(&text, number),
        };
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
        let stem = project::stem(path);
        self.loaded.project.files.push(File {
            path: shown,
            stem,
            text,
            ast: ast.into(),
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
            let place =
                self.place(path, &name).map_err(|fault| self.loaded.diagnostics.push(fault));
            let text = place.ok().and_then(|place| self.text(&place, &name));
            let texts = &mut self.loaded.project.files[index].texts;
            texts.extend(text.map(|text| (name.value, text)));
        }
        index
    }

    /// Looks up what the files name outside of them, each relative to the one that it is written in.
    fn outside(&mut self) {
        let paths: BTreeMap<usize, PathBuf> =
            self.known.iter().map(|(path, index)| (*index, path.clone())).collect();
        for (index, outside) in externals(&self.loaded.project, self.registry) {
            let id = known_as(outside.kind, &outside.name);
            if !self.loaded.project.files[index].externals.contains_key(&id) {
                let found = self.external(&paths[&index], &outside).map(Arc::new);
                self.loaded.project.files[index].externals.insert(id, found);
            }
        }
    }

    /// The file that `name` means in the file at `from`.
    fn link(&mut self, from: &Path, name: &Spanned<String>) -> Option<usize> {
        let place = self.place(from, name);
        let path = place.map_err(|fault| self.loaded.diagnostics.push(fault)).ok()?;
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
    fn place(&mut self, from: &Path, name: &Spanned<String>) -> Result<PathBuf, Diagnostic> {
        let folder = from.parent().expect("a file lies in a folder");
        let wanted = lexical(&folder.join(&name.value));
        let is_open = self.from.texts.contains_key(&*wanted);
        let found =
            wanted.starts_with(&self.loaded.root).then(|| match fs::canonicalize(&wanted) {
                // What an editor has not saved yet is nowhere else.
                Err(_) if is_open => Ok(wanted.clone()),
                found => found,
            });
        match found {
            Some(Ok(path)) if path.starts_with(&self.loaded.root) => {
                self.links.push((wanted, path.clone()));
                Ok(path)
            }
            Some(Err(error)) => {
                let fault = unread(name, &error, near(&wanted, &name.value));
                self.saw(&wanted, None);
                Err(fault)
            }
            _ => {
                let message = format!("`{}` lies outside the project", name.value);
                let fault =
                    Diagnostic::new(Code::Outside, name.span, message, "not in the project");
                Err(fault.help("specs name files of their own project only"))
            }
        }
    }

    /// What the file at `path` says.
    fn read(&self, path: &Path) -> std::io::Result<String> {
        self.from.texts.get(path).map_or_else(|| source::text(path), |text| Ok((*text).to_owned()))
    }

    /// The text of the file at `path`, which the spec calls so.
    fn text(&mut self, path: &Path, name: &Spanned<String>) -> Option<String> {
        let text = self.read(path);
        self.saw(path, text.as_ref().ok().map(|text| Digest::of(text.as_bytes())));
        let text = text.map_err(|error| unread(name, &error, None));
        text.map_err(|fault| self.loaded.diagnostics.push(fault)).ok()
    }

    /// Notes what was found at a path; what cannot be used is looked at for what it is.
    fn saw(&mut self, path: &Path, found: Option<Digest>) {
        self.loaded.read.insert(path.to_owned(), found.or_else(|| look(path)));
    }

    /// What is named outside the file at `from`.
    fn external(&mut self, from: &Path, outside: &Outside) -> Result<External, Diagnostic> {
        let Outside { kind, name, of, .. } = outside;
        let found = match kind {
            ExternalKind::File if Path::new(&name.value).is_absolute() => {
                Err("is an absolute path; files are named relative to the spec".to_owned())
            }
            ExternalKind::File => {
                let path = self.place(from, name)?;
                let found = command::file(&name.value, &path);
                self.saw(&path, found.as_ref().ok().map(|found| Digest(found.digest)));
                found
            }
            ExternalKind::Program => {
                let found = command::program(&name.value, &self.search);
                if let Ok(External { digest, content: Content::Program(path), .. }) = &found {
                    self.saw(path, Some(Digest(*digest)));
                    self.links.extend(fs::canonicalize(path).map(|real| (real, path.clone())));
                }
                found
            }
            ExternalKind::Variable => command::variable(&name.value),
            ExternalKind::Foreign if *of == "procgen" => return procgen(from, outside),
            ExternalKind::Foreign => return self.world(outside),
        };
        found.map_err(|why| {
            let message = format!("`{}` {why}", name.value);
            Diagnostic::new(Code::File, name.span, message, "cannot be used")
        })
    }

    /// The world of another program that is called so, with what is given to it.
    fn world(&self, outside: &Outside) -> Result<External, Diagnostic> {
        let Outside { name, beside, elsewhere, .. } = outside;
        let fault = |code, message: String, label: &str, help: &str| {
            Err(Diagnostic::new(code, name.span, message, label).help(help))
        };
        if !elsewhere.is_empty() {
            let message = format!(
                "what `{}` is given is not written beside it, where it is looked up",
                name.value
            );
            let help =
                "write all arguments here, without names; `match` chooses among several worlds";
            return fault(Code::NotLiteral, message, "depends on what is named elsewhere", help);
        }
        let kwargs = beside.get("kwargs").and_then(|lit| Fields::from_lit(lit).ok());
        let python = beside.get("python").and_then(|lit| String::from_lit(lit).ok());
        let time_limit = beside.get("time_limit").and_then(Lit::as_f64).unwrap_or(f64::INFINITY);
        let python = python.unwrap_or_default();
        let program = match command::find(&python, &self.search) {
            Ok(program) => program,
            Err(why) => {
                let message = format!("`{}` needs Python, and `{python}` {why}", name.value);
                let help = "install Python and gymnasium, or name the interpreter that has it: \
                            `python: \"/path/to/venv/bin/python\"`";
                return fault(Code::File, message, "no interpreter", help);
            }
        };
        let found =
            command::world(&program, &name.value, &kwargs.unwrap_or_default().0, time_limit);
        found.or_else(|why| {
            let message = format!("`{}` cannot be used with `{python}`: {why}", name.value);
            let help = "`python: ..` names the interpreter; it must have gymnasium and what the world needs";
            fault(Code::File, message, "no such world", help)
        })
    }

    /// A path as shown: below the project's folder.
    fn shown(&self, path: &Path) -> String {
        path.strip_prefix(&self.loaded.root).unwrap_or(path).display().to_string()
    }
}

/// The game of Procgen that is called so, in a call of the file at `from`.
fn procgen(from: &Path, outside: &Outside) -> Result<External, Diagnostic> {
    let Outside { name, beside, elsewhere, .. } = outside;
    let fault = |code, message: String, label: &str, help: &str| {
        Err(Diagnostic::new(code, name.span, message, label).help(help))
    };
    if elsewhere.contains(&"path") {
        let message = "`procgen.path` is not written in the call, where the game is looked up";
        let help = "write it here, or leave it out and let `PROCGEN_DIR` name the folder";
        return fault(
            Code::NotLiteral,
            message.to_owned(),
            "depends on what is named elsewhere",
            help,
        );
    }
    let written = beside.get("path").and_then(|lit| String::from_lit(lit).ok());
    let written = written.filter(|path| !path.is_empty());
    let folder = match (written, std::env::var_os("PROCGEN_DIR")) {
        (Some(path), _) => from.parent().expect("a file lies in a folder").join(path),
        (None, Some(path)) => path.into(),
        (None, None) => PathBuf::new(),
    };
    command::procgen(&folder, &name.value).or_else(|why| {
        let message = format!("`{}` cannot be played: {why}", name.value);
        fault(Code::File, message, "cannot be played", "`docs/agents.md` says how Procgen is had")
    })
}

fn unread(name: &Spanned<String>, error: &std::io::Error, help: Option<String>) -> Diagnostic {
    let message = format!("`{}` cannot be read: {}", name.value, plain(error));
    Diagnostic::new(Code::File, name.span, message, "not read").maybe_help(help)
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
    // One that is there and cannot be read is not meant otherwise.
    let known = files.filter(is_alike).map(join).filter(|known| known != name);
    let known: Vec<String> = known.collect();
    suggest(name, known.iter().map(String::as_str)).map(String::from)
}
