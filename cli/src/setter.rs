//! Which parameter a description of a node is, and who set it.

use std::borrow::Cow;

use ivx_engine::address::{parts, stem};
use ivx_grammar::ast::{Expr, ExprKind, Item, ItemKind};
use ivx_grammar::check::Project;
use ivx_grammar::ir::{Param, Spec, titled};
use ivx_op::Registry;

/// The name of a parameter, as `--set` takes it, and who set it: `default`, a profile or `--set`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Setter {
    /// `experiment.name` or `file.name`.
    pub(crate) parameter: String,
    /// Who set it.
    pub(crate) by: String,
}

/// The parameter that a description is, where the text says so plainly: the call stands in the
/// binding of the node's name, and the argument is a parameter, or the name of one.
///
/// - `address`: the node's.
/// - `path`: the operation and the argument: `train.learner.steps`.
pub(crate) fn setter(
    project: &Project,
    spec: &Spec,
    registry: &Registry,
    address: &str,
    path: &str,
) -> Option<Setter> {
    let parts = parts(address);
    let (experiment, binding) = (*parts.first()?, stem(parts.get(1)?));
    let (place, items) = project.files.iter().enumerate().find_map(|(i, file)| {
        let inside = file.ast.items.iter().find_map(|item| match &item.kind {
            ItemKind::Experiment { name, items } if name.value == experiment => Some(items),
            _ => None,
        });
        Some((i, inside?.as_slice()))
    })?;
    let seen =
        Seen { project, registry, scopes: vec![(experiment, items), top(project, place)], place };
    let (op, path) = path.split_once('.')?;
    let (seen, value) = seen.find(binding).and_then(|(seen, item)| Some((seen, value(item)?)))?;
    let mut calls = Vec::new();
    calls_of(value, op, &mut calls);
    let &[call] = &calls[..] else { return None };
    let (owner, name) = seen.argument(call, path)?;
    let of_experiment = spec.experiments.iter().find(|known| known.name == owner);
    let param = of_experiment.and_then(|known| known.params.iter().find(|p| p.name == name));
    let parameter = format!("{owner}.{name}");
    let param: Option<&Param> = param.or_else(|| spec.params.iter().find(|p| p.name == parameter));
    param.map(|param| Setter { parameter, by: param.by.clone() })
}

/// The items of a file, with the name that its parameters are addressed by.
fn top(project: &Project, place: usize) -> (&str, &[Item]) {
    (&project.files[place].stem, &project.files[place].ast.items)
}

/// The names that can be used at a place.
struct Seen<'a> {
    project: &'a Project,
    registry: &'a Registry,
    /// Items by where they are declared, the innermost first.
    scopes: Vec<(&'a str, &'a [Item])>,
    /// The file.
    place: usize,
}

impl<'a> Seen<'a> {
    /// The item of a name, with the names that can be used there.
    fn find(&self, name: &str) -> Option<(Self, &'a Item)> {
        for (i, (_, items)) in self.scopes.iter().enumerate() {
            let own = items.iter().find(|item| name_of(item).is_some_and(|own| own == name));
            if let Some(item) = own {
                return Some((Self { scopes: self.scopes[i..].to_vec(), ..*self }, item));
            }
        }
        let file = &self.project.files[self.place];
        file.ast.items.iter().find_map(|item| {
            let ItemKind::Use { path, names } = &item.kind else { return None };
            let place = *file.links.get(&path.value)?;
            let there = match names {
                None => name,
                Some(names) => &names.iter().find(|(_, ours)| ours.value == name)?.0.value,
            };
            Self { scopes: vec![top(self.project, place)], place, ..*self }.find(there)
        })
    }

    /// Where the parameter is declared that an argument is, and its name.
    fn argument(&self, call: &'a Expr, path: &str) -> Option<(&'a str, &'a str)> {
        let ExprKind::Call { name, args } = &call.kind else { return None };
        let (arg, rest) = match path.find(['.', '[']) {
            Some(end) => path.split_at(end),
            None => (path, ""),
        };
        let decl = self.registry.decl(&name.value)?;
        let given = args.iter().enumerate().find(|(i, (name, _))| match name {
            Some(name) => name.value == arg,
            None => decl.args.get(*i).is_some_and(|decl| decl.name == arg),
        });
        self.value(&given?.1.1, rest)
    }

    /// The parameter that an expression is, or what the path leads to in it.
    fn value(&self, expr: &'a Expr, path: &str) -> Option<(&'a str, &'a str)> {
        match &expr.kind {
            ExprKind::Name(name) => {
                let (seen, item) = self.find(name)?;
                match &item.kind {
                    ItemKind::Param { name, .. } => Some((seen.scopes[0].0, &name.value)),
                    // What is defined by itself was found wrong before.
                    ItemKind::Let { value, params: None, .. } => seen.value(value, path),
                    _ => None,
                }
            }
            ExprKind::List(items) => {
                let (place, rest) = path.strip_prefix('[')?.split_once(']')?;
                self.value(items.get(place.parse::<usize>().ok()?)?, rest)
            }
            ExprKind::Call { .. } => self.argument(expr, path.strip_prefix('.')?),
            _ => None,
        }
    }
}

/// What addresses call an item.
fn name_of(item: &Item) -> Option<Cow<'_, str>> {
    Some(match &item.kind {
        ItemKind::Param { name, .. }
        | ItemKind::Let { name, .. }
        | ItemKind::Measure { name, .. } => name.value.as_str().into(),
        ItemKind::Figure { name, .. } => titled("figure", &name.value).into(),
        ItemKind::Table { name, .. } => titled("table", &name.value).into(),
        ItemKind::Claim { name, .. } => titled("claim", &name.value).into(),
        _ => return None,
    })
}

/// What an item computes.
fn value(item: &Item) -> Option<&Expr> {
    match &item.kind {
        ItemKind::Let { value, params: None, .. }
        | ItemKind::Measure { value, .. }
        | ItemKind::Figure { value, .. }
        | ItemKind::Table { value, .. }
        | ItemKind::Claim { value, .. } => Some(value),
        _ => None,
    }
}

/// The calls of an operation in an expression.
fn calls_of<'a>(expr: &'a Expr, op: &str, calls: &mut Vec<&'a Expr>) {
    match &expr.kind {
        ExprKind::Call { name, args } => {
            if name.value == op {
                calls.push(expr);
            }
            for (_, arg) in args {
                calls_of(arg, op, calls);
            }
        }
        ExprKind::List(items) => items.iter().for_each(|item| calls_of(item, op, calls)),
        ExprKind::Record(fields) => fields.iter().for_each(|(_, field)| calls_of(field, op, calls)),
        ExprKind::Match { arms, .. } => arms.iter().for_each(|(_, arm)| calls_of(arm, op, calls)),
        ExprKind::Select { base, .. } | ExprKind::Field { base, .. } => calls_of(base, op, calls),
        ExprKind::Negate(inner) => calls_of(inner, op, calls),
        ExprKind::Binary { left, right, .. } => {
            calls_of(left, op, calls);
            calls_of(right, op, calls);
        }
        ExprKind::Bool(_)
        | ExprKind::Int(_)
        | ExprKind::Float(_)
        | ExprKind::Str(_)
        | ExprKind::Name(_)
        | ExprKind::Range { .. }
        | ExprKind::Junk => {}
    }
}
