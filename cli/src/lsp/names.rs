//! Where names are declared and used, in all specs of a project, and how they are given others.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use gen_lsp_types as lsp;
use ivx_grammar::{Means, Mention, Sort, Span, is_name, names_at};
use ivx_op::Registry;

use super::seen::{Called, Seen, see};
use super::text::Units;
use super::uri;
use crate::load::Open;
use crate::source::is_spec;

/// Most specs of a project that are looked at, most folders, and the deepest of them: the project of a spec that lies
/// in none is all that is beside and below it.
const MOST_SPECS: usize = 5_000;
const MOST_FOLDERS: usize = 10_000;
const DEEPEST: usize = 16;

/// Where what is named at a byte is declared.
pub(super) fn definition(seen: &Seen, at: usize, units: Units) -> Option<lsp::Location> {
    match &seen.mention(at)?.means {
        Means::Declared(span, _) => place(seen, *span, units),
        Means::Label(axis, label) => place(seen, seen.label(*axis, label)?, units),
        Means::File(path) => {
            let path = fs::canonicalize(seen.paths[0].parent()?.join(path)).ok()?;
            let own = seen.paths.iter().position(|own| *own == path);
            let uri = own.map_or_else(|| uri(&path), |own| seen.uris[own].clone());
            Some(lsp::Location::new(uri, lsp::Range::default()))
        }
        Means::Library(_) | Means::Argument(..) => None,
    }
}

fn place(seen: &Seen, span: Span, units: Units) -> Option<lsp::Location> {
    let text = seen.texts.get(span.file as usize)?;
    Some(lsp::Location::new(seen.uris[span.file as usize].clone(), text.range(span, units)))
}

/// What is meant, wherever it is seen from.
#[derive(Clone, PartialEq)]
enum Target {
    /// What is declared at a byte of a file.
    Declared(PathBuf, u32),
    /// A label of such an axis.
    Label(PathBuf, u32, String),
    /// Something of the library.
    Library(Means),
}

fn target(seen: &Seen, means: &Means) -> Option<Target> {
    let path = |span: Span| seen.paths.get(span.file as usize).cloned();
    Some(match means {
        Means::Declared(span, _) => Target::Declared(path(*span)?, span.start),
        Means::Label(axis, label) => Target::Label(path(*axis)?, axis.start, label.clone()),
        Means::Library(_) | Means::Argument(..) => Target::Library(means.clone()),
        Means::File(_) => return None,
    })
}

/// Every place of the project that names what is named at a byte, each once, in order of file and place.
///
/// - `open`: what the editor has of files, and how it calls them.
pub(super) fn references(
    seen: &Seen,
    at: usize,
    open: (&Open<'_>, &Called),
    registry: &Rc<Registry>,
    units: Units,
) -> Vec<lsp::Location> {
    let mut found = Vec::new();
    everywhere(seen, at, open, registry, |seen, mention| {
        found.extend(place(seen, mention.span, units));
    });
    found
}

/// Shows every mention of what is named at a byte to `see`, each place once.
fn everywhere(
    seen: &Seen,
    at: usize,
    open: (&Open<'_>, &Called),
    registry: &Rc<Registry>,
    mut show: impl FnMut(&Seen, &Mention),
) {
    let Some(wanted) = seen.mention(at).and_then(|mention| target(seen, &mention.means)) else {
        return;
    };
    let mut shown: BTreeSet<(PathBuf, u32)> = BTreeSet::new();
    let mut within = |seen: &Seen| {
        for mention in seen.mentions() {
            let path = &seen.paths[mention.span.file as usize];
            if target(seen, &mention.means).as_ref() == Some(&wanted)
                && shown.insert((path.clone(), mention.span.start))
            {
                show(seen, mention);
            }
        }
    };
    within(seen);
    let open_too = open.0.texts.keys().filter(|path| path.starts_with(&seen.loaded.root));
    let mut specs = specs(&seen.loaded.root);
    specs.extend(open_too.map(|path| path.to_path_buf()));
    specs.sort();
    specs.dedup();
    for path in specs {
        if path != seen.paths[0]
            && let Ok(other) = see(&path, open, registry)
        {
            within(&other);
        }
    }
}

/// The specs of a project; where it has too many folders, those that lie less deep.
fn specs(root: &Path) -> Vec<PathBuf> {
    let mut specs = Vec::new();
    let mut todo = VecDeque::from([(root.to_owned(), 0)]);
    let mut n_folders = 0;
    while let Some((folder, depth)) = todo.pop_front().filter(|_| n_folders < MOST_FOLDERS) {
        n_folders += 1;
        let entries = fs::read_dir(&folder).into_iter().flatten().flatten();
        for entry in entries {
            let path = entry.path();
            let hidden = entry.file_name().to_string_lossy().starts_with('.');
            let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            if is_folder && !hidden && depth < DEEPEST && !made(&path) {
                todo.push_back((path, depth + 1));
            } else if is_spec(&path) && specs.len() < MOST_SPECS {
                specs.push(path);
            }
        }
    }
    specs
}

/// Whether a folder is one that programs fill, and nobody writes in.
fn made(folder: &Path) -> bool {
    ["target", "node_modules", "results"].iter().any(|name| folder.ends_with(name))
}

/// The word at a byte, if what it names can be given another name.
pub(super) fn renamed(seen: &Seen, at: usize, units: Units) -> Result<lsp::Range, String> {
    let mention = seen.mention(at).ok_or("there is no name here")?;
    let Means::Declared(declared, sort) = mention.means else {
        return Err(match &mention.means {
            Means::Library(name) => format!("`{name}` is of the library, and called so everywhere"),
            Means::Argument(of, name) => format!("`{name}` is an argument of `{of}`"),
            _ => "only names that the spec declares are renamed".to_owned(),
        });
    };
    if sort == Sort::Axis && seen.texts[declared.file as usize].of(declared) == "seed" {
        return Err("random numbers follow the axis called `seed`: it has no other name".to_owned());
    }
    if sort == Sort::Profile {
        return Err("a profile is one thing in all experiments: rename it by hand".to_owned());
    }
    Ok(seen.text().range(mention.span, units))
}

/// What to write where, for what is named at a byte to be called `name`.
///
/// # Errors
/// If it cannot be called so; the message says why.
pub(super) fn rename(
    seen: &Seen,
    at: usize,
    name: &str,
    (open, registry, units): ((&Open<'_>, &Called), &Rc<Registry>, Units),
) -> Result<lsp::WorkspaceEdit, String> {
    renamed(seen, at, units)?;
    let mention = seen.mention(at).ok_or("there is no name here")?;
    let Means::Declared(declared, _) = mention.means else { return Err(String::new()) };
    if !is_name(name) {
        return Err(format!(
            "`{name}` is no name: letters, digits and `_`, and no word of the language"
        ));
    }
    // What has a name of its own in one file, by `as`, keeps it.
    let old = seen.texts[mention.span.file as usize].of(mention.span);
    let taken = names_at(&seen.loaded.project, declared.file, declared.start);
    if taken.iter().any(|(known, span, _)| known == name && *span != declared) {
        return Err(format!("`{name}` is declared already"));
    }
    let mut changes: BTreeMap<PathBuf, (lsp::Uri, Vec<lsp::TextEdit>)> = BTreeMap::new();
    everywhere(seen, at, open, registry, |seen, mention| {
        let (file, span) = (mention.span.file as usize, mention.span);
        if seen.texts[file].of(span) == old {
            let edit = lsp::TextEdit::new(seen.texts[file].range(span, units), name.to_owned());
            let none = || (seen.uris[file].clone(), Vec::new());
            changes.entry(seen.paths[file].clone()).or_insert_with(none).1.push(edit);
        }
    });
    Ok(lsp::WorkspaceEdit::new(Some(changes.into_values().collect()), None, None))
}
