//! Which names mean what where.

use std::collections::BTreeMap;

use super::Project;
use super::axis::SEED;
use crate::ast::{Expr, Item, ItemKind, LetParam, Name};
use crate::{Code, Diagnostic, declares, suggest};

/// Names of other files: the file's scope, the name there, and where it was taken.
type Imports<'a> = BTreeMap<&'a str, (usize, &'a str, Option<crate::Span>)>;

/// The scopes of a project: first one a file, then one an experiment.
pub(crate) struct Scopes<'a> {
    pub(crate) all: Vec<Scope<'a>>,
    /// The scopes of the experiments to run, in the order of inclusion.
    pub(super) experiments: Vec<usize>,
    /// The scopes of all experiments, by the file and the name.
    inner: BTreeMap<(usize, &'a str), usize>,
    /// The items that declare them, by name.
    named: BTreeMap<&'a str, &'a Item>,
}

/// The names of a file or an experiment.
pub(crate) struct Scope<'a> {
    /// What addresses begin with: the file's stem or the experiment's name.
    pub(super) name: String,
    /// The item that declares an experiment.
    pub(crate) item: Option<&'a Item>,
    /// The scope around this one.
    pub(super) parent: Option<usize>,
    /// What is declared here, by name.
    pub(super) names: BTreeMap<&'a str, &'a Item>,
    /// All items, in order.
    pub(crate) items: &'a [Item],
    /// What profiles set, by parameter: the profile and the value.
    pub(super) sets: BTreeMap<&'a str, Vec<(&'a str, &'a Expr)>>,
    /// Names of other files: the file's scope and the name there.
    pub(super) imports: BTreeMap<&'a str, (usize, &'a str)>,
    /// Names that a faulty item should have declared or brought; `None` if there may be any. The
    /// fault was reported.
    lost: Vec<Option<&'a str>>,
}

impl<'a> Scopes<'a> {
    /// The scopes of a project. Names declared twice are reported.
    pub(crate) fn of(project: &'a Project, diagnostics: &mut Vec<Diagnostic>) -> Self {
        let mut scopes = Self {
            all: Vec::new(),
            experiments: Vec::new(),
            inner: BTreeMap::new(),
            named: BTreeMap::new(),
        };
        for file in &project.files {
            scopes.all.push(Scope::new(
                file.stem.clone(),
                None,
                None,
                &file.ast.items,
                diagnostics,
            ));
        }
        for file in 0..project.files.len() {
            scopes.import(project, file, diagnostics);
        }
        for file in 0..project.files.len() {
            scopes.inside(project, file, diagnostics);
        }
        let mut seen = vec![false; project.files.len()];
        scopes.include(project, 0, &mut seen, diagnostics);
        for scope in 0..scopes.all.len() {
            scopes.parameters(scope, diagnostics);
        }
        scopes
    }

    /// The file that a scope is or lies in.
    pub(crate) fn file_of(&self, scope: usize) -> usize {
        self.all[scope].parent.unwrap_or(scope)
    }

    /// The scope of an experiment that is declared in a file.
    pub(super) fn experiment(&self, file: usize, item: &Item) -> Option<usize> {
        let ItemKind::Experiment { name, .. } = &item.kind else { return None };
        self.inner.get(&(file, name.value.as_str())).copied()
    }

    /// What a new name inside of `scope` would hide. Experiments may be hidden: what one declares
    /// is often called as it is.
    fn hidden(&self, scope: usize, name: &str) -> Option<&'a Item> {
        let (_, outer) = self.find(scope, name)?;
        Some(outer).filter(|outer| !matches!(outer.kind, ItemKind::Experiment { .. }))
    }

    /// Where a name seen from `scope` is declared.
    pub(crate) fn find(&self, scope: usize, name: &str) -> Option<(usize, &'a Item)> {
        let here = &self.all[scope];
        if let Some(item) = here.names.get(name) {
            return Some((scope, item));
        }
        if let Some((file, original)) = here.imports.get(name) {
            return self.all[*file].names.get(original).map(|item| (*file, *item));
        }
        here.parent.and_then(|parent| self.find(parent, name))
    }

    /// Whether a name is unknown in `scope` only because of a fault that was reported.
    pub(super) fn lost(&self, scope: usize, name: &str) -> bool {
        let here = &self.all[scope];
        here.lost.iter().any(|lost| lost.is_none_or(|lost| lost == name))
            || here.parent.is_some_and(|parent| self.lost(parent, name))
    }

    /// Every name that can be used in `scope`.
    pub(crate) fn known(&self, scope: usize) -> Vec<&'a str> {
        let here = &self.all[scope];
        let values = |(name, item): (&&'a str, &&Item)| {
            (!matches!(item.kind, ItemKind::Experiment { .. })).then_some(*name)
        };
        let mut known: Vec<_> = here.names.iter().filter_map(values).collect();
        known.extend(here.imports.keys().copied());
        known.extend(here.parent.map(|parent| self.known(parent)).unwrap_or_default());
        known
    }

    fn import(&mut self, project: &'a Project, file: usize, diagnostics: &mut Vec<Diagnostic>) {
        let mut imports: Imports<'_> = BTreeMap::new();
        let mut lost = Vec::new();
        for item in &project.files[file].ast.items {
            let (path, names) = match &item.kind {
                ItemKind::Use { path, names } => (path, names),
                ItemKind::Include { path } => {
                    self.included(project, file, &path.value, &mut imports);
                    continue;
                }
                _ => continue,
            };
            let Some(&from) = project.files[file].links.get(&path.value) else {
                match names {
                    None => lost.push(None),
                    Some(names) => {
                        lost.extend(names.iter().map(|(_, new)| Some(new.value.as_str())));
                    }
                }
                continue;
            };
            let theirs = &self.all[from].names;
            let all: Vec<(&str, &str, _)> = match names {
                None => {
                    lost.extend(&self.all[from].lost);
                    theirs.keys().map(|name| (*name, *name, path.span)).collect()
                }
                Some(names) => names
                    .iter()
                    .map(|(n, new)| (n.value.as_str(), new.value.as_str(), n.span))
                    .collect(),
            };
            for (original, new, span) in all {
                if !theirs.contains_key(original) && self.lost(from, original) {
                    lost.push(Some(new));
                } else if !theirs.contains_key(original) {
                    let message = format!("`{}` declares no `{original}`", path.value);
                    let fault =
                        Diagnostic::new(Code::UnknownName, span, message, "not declared there");
                    diagnostics.push(fault.maybe_help(suggest(original, theirs.keys().copied())));
                    lost.push(Some(new));
                } else if let Some(fault) = seed_renamed(theirs[original], new, span) {
                    diagnostics.push(fault);
                    lost.push(Some(new));
                } else if let Some(own) = self.all[file].names.get(new) {
                    diagnostics.push(twice(new, span, own.span));
                } else if let Some((_, _, first)) = imports
                    .insert(new, (from, original, Some(span)))
                    .filter(|(other, name, first)| {
                        first.is_some() && (*other, *name) != (from, original)
                    })
                {
                    diagnostics.push(twice(new, span, first.unwrap_or(span)));
                }
            }
        }
        let imports = imports.into_iter().map(|(new, (from, original, _))| (new, (from, original)));
        self.all[file].imports = imports.collect();
        self.all[file].lost.extend(lost);
    }

    /// Brings the names of the experiments that a file includes.
    fn included(&self, project: &'a Project, file: usize, path: &str, imports: &mut Imports<'a>) {
        let Some(&from) = project.files[file].links.get(path) else { return };
        for (name, item) in &self.all[from].names {
            let experiment = matches!(item.kind, ItemKind::Experiment { .. });
            if experiment && !self.all[file].names.contains_key(name) {
                imports.entry(name).or_insert((from, name, None));
            }
        }
    }

    /// The scopes of the experiments in a file. Names that hide others are reported.
    fn inside(&mut self, project: &'a Project, file: usize, diagnostics: &mut Vec<Diagnostic>) {
        for item in &project.files[file].ast.items {
            let ItemKind::Experiment { name, items } = &item.kind else { continue };
            if self.inner.contains_key(&(file, name.value.as_str())) {
                continue; // declared twice, which was reported
            }
            let scope = Scope::new(name.value.clone(), Some(item), Some(file), items, diagnostics);
            for (name, item) in &scope.names {
                if let Some(outer) = self.hidden(file, name) {
                    let span = name_of(item).map_or(item.span, |name| name.span);
                    diagnostics.push(twice(name, span, outer.span));
                }
            }
            self.inner.insert((file, &name.value), self.all.len());
            self.all.push(scope);
        }
    }

    /// Reports parameters of functions that hide other names.
    fn parameters(&self, scope: usize, diagnostics: &mut Vec<Diagnostic>) {
        for item in self.all[scope].items {
            let ItemKind::Let { params: Some(params), .. } = &item.kind else { continue };
            let mut seen: BTreeMap<&str, crate::Span> = BTreeMap::new();
            for LetParam { name, .. } in params {
                let outer = self.hidden(scope, &name.value).map(|outer| outer.span);
                if let Some(first) = seen.insert(&name.value, name.span).or(outer) {
                    diagnostics.push(twice(&name.value, name.span, first));
                }
            }
        }
    }

    fn include(
        &mut self,
        project: &'a Project,
        file: usize,
        seen: &mut [bool],
        diagnostics: &mut Vec<Diagnostic>,
    ) {
        if std::mem::replace(&mut seen[file], true) {
            return;
        }
        for item in &project.files[file].ast.items {
            match &item.kind {
                ItemKind::Include { path } => {
                    if let Some(&next) = project.files[file].links.get(&path.value) {
                        self.include(project, next, seen, diagnostics);
                    }
                }
                ItemKind::Experiment { name, .. } => {
                    if let Some(first) = self.named.get(name.value.as_str()) {
                        diagnostics.push(twice(&name.value, name.span, first.span));
                        continue;
                    }
                    self.named.insert(&name.value, item);
                    if let Some(&scope) = self.inner.get(&(file, name.value.as_str())) {
                        self.experiments.push(scope);
                    }
                }
                _ => {}
            }
        }
    }
}

impl<'a> Scope<'a> {
    fn new(
        name: String,
        item: Option<&'a Item>,
        parent: Option<usize>,
        items: &'a [Item],
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Self {
        let mut names: BTreeMap<&str, &Item> = BTreeMap::new();
        let mut sets: BTreeMap<&str, Vec<(&str, &Expr)>> = BTreeMap::new();
        for item in items {
            if let ItemKind::Profile { name: profile, sets: own, .. } = &item.kind {
                for (name, value) in own {
                    sets.entry(&name.value).or_default().push((&profile.value, value));
                }
            }
            let Some(name) = name_of(item) else { continue };
            if let Some(first) = names.get(name.value.as_str()) {
                diagnostics.push(twice(&name.value, name.span, first.span));
            } else {
                names.insert(&name.value, item);
            }
        }
        let mut lost = Vec::new();
        for item in items {
            match &item.kind {
                ItemKind::Junk { names: None } => lost.push(None),
                // It stands where it may not.
                ItemKind::Use { names, .. } if parent.is_some() => match names {
                    None => lost.push(None),
                    Some(names) => {
                        lost.extend(names.iter().map(|(_, new)| Some(new.value.as_str())));
                    }
                },
                ItemKind::Junk { names: Some(names) } => {
                    lost.extend(names.iter().map(|name| Some(name.value.as_str())));
                }
                _ => {}
            }
        }
        Self { name, item, parent, names, items, sets, imports: BTreeMap::new(), lost }
    }
}

/// What is wrong with another name for an axis where one of both is `seed`: only the axis that is
/// declared by this name reaches what draws random numbers.
fn seed_renamed(item: &Item, new: &str, span: crate::Span) -> Option<Diagnostic> {
    let ItemKind::Axis { name, .. } = &item.kind else { return None };
    if name.value == new || name.value != SEED && new != SEED {
        return None;
    }
    let (message, help) = if new == SEED {
        let message = format!("`{}` is not the axis whose values are seeds", name.value);
        (message, "declare `axis seed` there, or here: `axis seed = 0..5`")
    } else {
        ("the axis `seed` has one name everywhere".to_owned(), "take it as `seed`")
    };
    let fault = Diagnostic::new(Code::Axis, span, message, format!("called `{new}` here"));
    Some(fault.also(name.span, "declared here").help(help))
}

/// The name that expressions can use for what an item declares.
pub(super) fn name_of(item: &Item) -> Option<&Name> {
    declares(item).map(|(name, _)| name)
}

/// A name declared twice.
pub(super) fn twice(name: &str, span: crate::Span, first: crate::Span) -> Diagnostic {
    let message = format!("`{name}` is declared twice");
    Diagnostic::new(Code::Shadowing, span, message, "declared again")
        .also(first, "first declared here")
        .help("give one of them another name")
}
