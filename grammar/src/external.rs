//! What a file names outside the spec, found before anything is checked.

use ivx_op::{ExternalKind, Registry};

use crate::Spanned;
use crate::ast::{Ast, AxisExpr, Expr, ExprKind, Item, ItemKind};

/// The names in quotes that calls of a file give to arguments which name something outside.
///
/// Only what stands inside the argument itself is found: where a name comes from a parameter or an
/// axis, the checker asks for it in place.
#[must_use]
pub fn externals(ast: &Ast, registry: &Registry) -> Vec<(ExternalKind, Spanned<String>)> {
    let mut found = Vec::new();
    let mut todo = Vec::new();
    items(&ast.items, &mut todo);
    while let Some(expr) = todo.pop() {
        if let ExprKind::Call { name, args } = &expr.kind
            && let Some(decl) = registry.decl(&name.value)
        {
            for (place, kind) in decl.externals() {
                let given = args.iter().enumerate().filter(|(i, (name, _))| match name {
                    Some(name) => name.value == decl.args[place].name,
                    None => *i == place,
                });
                let given = given.flat_map(|(_, (_, expr))| names(expr));
                found.extend(given.map(|name| (kind, name)));
            }
        }
        children(expr, &mut todo);
    }
    found
}

/// The expressions of items, in experiments too.
fn items<'a>(items_of: &'a [Item], todo: &mut Vec<&'a Expr>) {
    for item in items_of {
        match &item.kind {
            ItemKind::Experiment { items: inner, .. } => items(inner, todo),
            ItemKind::Param { value, .. }
            | ItemKind::Measure { value, .. }
            | ItemKind::Figure { value, .. }
            | ItemKind::Table { value, .. } => todo.push(value),
            ItemKind::Let { params, value, .. } => {
                let defaults = params.iter().flatten().filter_map(|param| param.default.as_ref());
                todo.extend(defaults.chain([value]));
            }
            ItemKind::Claim { asked, value, within, .. } => {
                let margin = within.as_ref().map(|within| &within.margin);
                todo.extend(asked.at.as_ref().into_iter().chain(margin).chain([value]));
            }
            ItemKind::Profile { sets, .. } => todo.extend(sets.iter().map(|(_, value)| value)),
            ItemKind::Axis { values, .. } => match values {
                AxisExpr::Range(low, high) => todo.extend([low, high]),
                AxisExpr::Labelled(values, _) => todo.extend(values.iter().map(|(_, v)| v)),
                AxisExpr::List(list) => todo.push(list),
            },
            ItemKind::Use { .. }
            | ItemKind::Include { .. }
            | ItemKind::Published { .. }
            | ItemKind::Junk { .. } => {}
        }
    }
}

/// The expressions directly inside one.
fn children<'a>(expr: &'a Expr, todo: &mut Vec<&'a Expr>) {
    match &expr.kind {
        ExprKind::List(items) => todo.extend(items),
        ExprKind::Record(fields) | ExprKind::Call { args: fields, .. } => {
            todo.extend(fields.iter().map(|(_, value)| value));
        }
        ExprKind::Match { axis, arms } => {
            todo.push(axis);
            todo.extend(arms.iter().map(|(_, arm)| arm));
        }
        ExprKind::Select { base, at } => {
            todo.push(base);
            todo.extend(at.iter().map(|(_, label)| label));
        }
        ExprKind::Range { from, to } => todo.extend(from.iter().chain(to).map(|end| &**end)),
        ExprKind::Field { base, .. } => todo.push(base),
        ExprKind::Negate(inner) => todo.push(inner),
        ExprKind::Binary { left, right, .. } => todo.extend([&**left, &**right]),
        ExprKind::Bool(_)
        | ExprKind::Int(_)
        | ExprKind::Float(_)
        | ExprKind::Str(_)
        | ExprKind::Name(_)
        | ExprKind::Junk => {}
    }
}

/// The names in quotes inside an argument. What another call names is its own.
pub(crate) fn names(expr: &Expr) -> Vec<Spanned<String>> {
    let mut found = Vec::new();
    let mut todo = vec![expr];
    while let Some(expr) = todo.pop() {
        match &expr.kind {
            ExprKind::Str(name) => found.push(Spanned { value: name.clone(), span: expr.span }),
            ExprKind::Call { .. } => {}
            _ => children(expr, &mut todo),
        }
    }
    found
}
