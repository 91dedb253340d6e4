//! What a file names outside the spec, found before anything is checked.

use ivx_op::{Args, Decl, ExternalKind, Lit, Part, Registry};

use crate::Spanned;
use crate::ast::{AxisExpr, Expr, ExprKind, Item, ItemKind, Name};
use crate::check::{Project, Scopes};

/// Something that a call names outside the spec.
#[derive(Clone, Debug, PartialEq)]
pub struct Outside {
    /// What it is.
    pub kind: ExternalKind,
    /// Its name, as written.
    pub name: Spanned<String>,
    /// What is called.
    pub of: &'static str,
    /// The other arguments of the call, with defaults, as far as they are written there plainly.
    pub beside: Args,
    /// Those that are not.
    pub elsewhere: Vec<&'static str>,
}

/// What is looked up once: a world, which depends on what is written beside its name, at each place.
#[must_use]
pub fn known_as(kind: ExternalKind, name: &Spanned<String>) -> (ExternalKind, String) {
    match kind {
        ExternalKind::Foreign => (kind, format!("{} at {}", name.value, name.span.start)),
        _ => (kind, name.value.clone()),
    }
}

/// The names in quotes that calls give to arguments which name something outside, each with the place of the file that
/// it is written in.
///
/// What stands inside the argument itself is found, and what stands in the coordinates of an axis that it names; where a
/// name comes from a parameter, the checker asks for it in place.
#[must_use]
pub fn externals(project: &Project, registry: &Registry) -> Vec<(usize, Outside)> {
    // What is wrong with names is told by the check.
    let scopes = Scopes::of(project, &mut Vec::new());
    let mut found = Vec::new();
    for (scope, own) in scopes.all.iter().enumerate() {
        let file = scopes.file_of(scope);
        let mut todo = Vec::new();
        items(own.items, &mut todo);
        while let Some(expr) = todo.pop() {
            if let ExprKind::Call { name, args } = &expr.kind
                && let Some(decl) = registry.decl(&name.value)
            {
                for (place, kind) in decl.externals() {
                    let given = args.iter().enumerate().filter(|(i, (name, _))| match name {
                        Some(name) => name.value == decl.args[place].name,
                        None => *i == place,
                    });
                    let (beside, elsewhere) = beside(decl, place, args);
                    for (_, (_, expr)) in given {
                        let (of, beside, elsewhere) = (decl.name, &beside, &elsewhere);
                        let outside = |name| {
                            let (beside, elsewhere) = (beside.clone(), elsewhere.clone());
                            Outside { kind, name, of, beside, elsewhere }
                        };
                        found.extend(names(expr).into_iter().map(|name| (file, outside(name))));
                        if kind != ExternalKind::Foreign {
                            let along = in_axes(&scopes, scope, expr).into_iter();
                            found.extend(along.map(|(file, name)| (file, outside(name))));
                        }
                    }
                }
            }
            children(expr, &mut todo);
        }
    }
    found
}

/// The names in quotes in the coordinates of the axes that an argument names, each with its file. Of an axis with fields
/// they are those of the field that is read.
fn in_axes(scopes: &Scopes<'_>, scope: usize, expr: &Expr) -> Vec<(usize, Spanned<String>)> {
    let mut found = Vec::new();
    let mut todo = vec![expr];
    while let Some(expr) = todo.pop() {
        let (base, field) = match &expr.kind {
            ExprKind::Field { base, name } => (&**base, Some(name.value.as_str())),
            _ => (expr, None),
        };
        if let ExprKind::Name(name) = &base.kind
            && let Some((declared, item)) = scopes.find(scope, name)
            && let ItemKind::Axis { fields, values, .. } = &item.kind
        {
            let file = scopes.file_of(declared);
            let coords: Vec<&Expr> = match values {
                AxisExpr::Labelled(values, _) => values.iter().map(|(_, value)| value).collect(),
                AxisExpr::List(Expr { kind: ExprKind::List(items), .. }) => items.iter().collect(),
                AxisExpr::List(_) | AxisExpr::Range(..) => Vec::new(),
            };
            let place = fields.iter().position(|own| Some(own.value.as_str()) == field);
            for coord in coords {
                let value = match (&coord.kind, field) {
                    (ExprKind::Record(items), Some(field)) => {
                        items.iter().enumerate().find_map(|(i, (name, value))| {
                            let is_meant = match name {
                                Some(name) => name.value == field,
                                None => Some(i) == place,
                            };
                            is_meant.then_some(value)
                        })
                    }
                    _ => Some(coord),
                };
                let own = value.into_iter().flat_map(names);
                found.extend(own.map(|name| (file, name)));
            }
        }
        if !matches!(expr.kind, ExprKind::Call { .. }) {
            children(expr, &mut todo);
        }
    }
    found
}

/// The arguments of a call but for that at `place`, and the names of those that are not written there plainly.
fn beside(decl: &Decl, place: usize, args: &[(Option<Name>, Expr)]) -> (Args, Vec<&'static str>) {
    let (mut found, mut elsewhere) = (Args::new(), Vec::new());
    for (i, arg) in decl.args.iter().enumerate().filter(|(i, _)| *i != place) {
        let given = args.iter().enumerate().find(|(j, (name, _))| match name {
            Some(name) => name.value == arg.name,
            None => *j == i,
        });
        let value = given.map(|(_, (_, expr))| plain(expr));
        match value.unwrap_or_else(|| arg.default.clone()) {
            Some(value) => _ = found.insert(arg.name.to_owned(), value),
            None if given.is_some() => elsewhere.push(arg.name),
            None => {}
        }
    }
    (found, elsewhere)
}

/// The description that an expression is, if nothing needs to be known to read it.
fn plain(expr: &Expr) -> Option<Lit> {
    Some(match &expr.kind {
        ExprKind::Bool(b) => Lit::Bool(*b),
        ExprKind::Int(n) => Lit::Int(*n),
        ExprKind::Float(x) => Lit::Real(*x),
        ExprKind::Str(text) => Lit::Text(text.clone()),
        ExprKind::Negate(inner) => match plain(inner)? {
            Lit::Int(n) => Lit::Int(n.checked_neg()?),
            Lit::Real(x) => Lit::Real(-x),
            _ => return None,
        },
        ExprKind::List(items) => Lit::List(items.iter().map(plain).collect::<Option<_>>()?),
        ExprKind::Record(fields) => {
            let field = |(name, value): &(Option<Name>, Expr)| {
                Some((name.as_ref()?.value.clone(), plain(value)?))
            };
            let args = fields.iter().map(field).collect::<Option<Vec<_>>>()?;
            Lit::Part(Part { name: String::new(), args: args.into_iter().collect() })
        }
        _ => return None,
    })
}

/// The expressions of items. Experiments have items of their own.
fn items<'a>(items_of: &'a [Item], todo: &mut Vec<&'a Expr>) {
    for item in items_of {
        match &item.kind {
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
            ItemKind::Experiment { .. }
            | ItemKind::Use { .. }
            | ItemKind::Include { .. }
            | ItemKind::Published { .. }
            | ItemKind::Junk { .. } => {}
        }
    }
}

/// The expressions directly inside one.
pub(crate) fn children<'a>(expr: &'a Expr, todo: &mut Vec<&'a Expr>) {
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
