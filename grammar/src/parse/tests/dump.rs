//! The tree as text.

use crate::ast::{AxisExpr, Expr, ExprKind, Item, ItemKind, Name, TyExpr};

pub(crate) fn item(item: &Item) -> String {
    let docs = if item.docs.is_empty() { String::new() } else { format!("{:?} ", item.docs) };
    let inner = match &item.kind {
        ItemKind::Use { path, names } => {
            let names = names.iter().flatten();
            let names = joined(names.map(|(a, b)| format!(" {} as {}", a.value, b.value)));
            format!("use {:?}{names}", path.value)
        }
        ItemKind::Include { path } => format!("include {:?}", path.value),
        ItemKind::Param { name, ty, value } => {
            format!("param {} {} {}", name.value, type_of(ty), expr(value))
        }
        ItemKind::Profile { name, base, sets } => {
            let base = base.as_ref().map(|base| format!(" of {}", base.value));
            format!("profile {}{}{}", name.value, base.unwrap_or_default(), named(sets))
        }
        ItemKind::Axis { name, fields, values } => {
            let fields = joined(fields.iter().map(|field| format!(".{}", field.value)));
            format!("axis {}{fields} {}", name.value, axis(values))
        }
        ItemKind::Let { name, params: None, value } => {
            format!("let {} {}", name.value, expr(value))
        }
        ItemKind::Let { name, params: Some(params), value } => {
            let params = params.iter().map(|param| {
                let default = param.default.as_ref().map(|value| format!(" {}", expr(value)));
                let default = default.unwrap_or_default();
                format!("({} {}{default})", param.name.value, type_of(&param.ty))
            });
            let params: Vec<_> = params.collect();
            format!("let {} ({}) {}", name.value, params.join(" "), expr(value))
        }
        ItemKind::Experiment { name, items } => {
            let items = joined(items.iter().map(|inner| format!(" {}", self::item(inner))));
            format!("experiment {}{items}", name.value)
        }
        ItemKind::Measure { name, value } => format!("measure {} {}", name.value, expr(value)),
        ItemKind::Figure { name, value } => format!("figure {:?} {}", name.value, expr(value)),
        ItemKind::Table { name, value } => format!("table {:?} {}", name.value, expr(value)),
        ItemKind::Claim { name, asked, value, on_par, within } => {
            let at = asked.at.as_ref().map(|at| format!(" at {}", expr(at)));
            let by = asked.by.as_ref().map(|by| format!(" by {:?}", by.value));
            let family = asked.family.as_ref().map(|family| format!(" family {:?}", family.value));
            let par = on_par.then(|| " on par".to_owned());
            let within = within.as_ref().map(|within| {
                let why = within.why.as_ref().map(|why| format!(" {:?}", why.value));
                format!(" within {}{}", expr(&within.margin), why.unwrap_or_default())
            });
            let [at, by, family, par, within] =
                [at, by, family, par, within].map(Option::unwrap_or_default);
            format!("claim {:?}{at}{by}{family} {}{par}{within}", name.value, expr(value))
        }
        ItemKind::Published { name, path } => {
            format!("published {} {:?}", name.value, path.value)
        }
        ItemKind::Junk { .. } => "junk".to_owned(),
    };
    format!("({docs}{inner})")
}

fn type_of(ty: &TyExpr) -> String {
    let args: Vec<_> = ty.args.iter().map(type_of).collect();
    if args.is_empty() {
        ty.name.value.clone()
    } else {
        format!("{}<{}>", ty.name.value, args.join(" "))
    }
}

fn axis(values: &AxisExpr) -> String {
    match values {
        AxisExpr::Range(start, end) => format!("{}..{}", expr(start), expr(end)),
        AxisExpr::Labelled(labels, _) => {
            let labels: Vec<_> = labels
                .iter()
                .map(|(label, value)| format!("{:?}: {}", label.value, expr(value)))
                .collect();
            format!("{{{}}}", labels.join(" "))
        }
        AxisExpr::List(list) => expr(list),
    }
}

fn named(values: &[(Name, Expr)]) -> String {
    joined(values.iter().map(|(name, value)| format!(" {}: {}", name.value, expr(value))))
}

fn expr(e: &Expr) -> String {
    match &e.kind {
        ExprKind::Bool(value) => value.to_string(),
        ExprKind::Int(value) => value.to_string(),
        ExprKind::Float(value) => format!("{value:?}"),
        ExprKind::Str(value) => format!("{value:?}"),
        ExprKind::List(values) => {
            format!("[{}]", values.iter().map(expr).collect::<Vec<_>>().join(" "))
        }
        ExprKind::Name(name) => name.clone(),
        ExprKind::Call { name, args } => {
            format!("({}{})", name.value, given(args))
        }
        ExprKind::Record(fields) => format!("(record{})", given(fields)),
        ExprKind::Match { axis, arms } => {
            let arms = arms.iter().map(|(label, e)| format!(" {:?}: {}", label.value, expr(e)));
            format!("(match {}{})", expr(axis), joined(arms))
        }
        ExprKind::Select { base, at } => format!("(at {}{})", expr(base), named(at)),
        ExprKind::Range { from, to } => {
            let end = |end: &Option<Box<Expr>>| end.as_deref().map_or_else(String::new, expr);
            format!("{}..{}", end(from), end(to))
        }
        ExprKind::Field { base, name } => format!("{}.{}", expr(base), name.value),
        ExprKind::Negate(inner) => format!("(- {})", expr(inner)),
        ExprKind::Binary { op, left, right } => {
            format!("({} {} {})", op.value.symbol(), expr(left), expr(right))
        }
        ExprKind::Junk => "junk".to_owned(),
    }
}

fn given(args: &[(Option<Name>, Expr)]) -> String {
    joined(args.iter().map(|(name, value)| match name {
        Some(name) => format!(" {}: {}", name.value, expr(value)),
        None => format!(" {}", expr(value)),
    }))
}

fn joined(parts: impl Iterator<Item = String>) -> String {
    parts.collect()
}
