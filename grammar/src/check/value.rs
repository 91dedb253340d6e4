//! What an expression amounts to while it is checked.

use std::collections::BTreeMap;

use ivx_op::{Lit, Ty};

use crate::ir::{Desc, ExprId, Place};

/// What an expression amounts to.
#[derive(Clone, Debug)]
pub(super) enum Val {
    /// Plain data.
    Desc(Desc, Ty),
    /// Something computed.
    Artifact(ExprId),
    /// Something faulty that was already reported.
    Poison,
}

/// Whether a value of one type serves where another is expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fit {
    /// As it is.
    Same,
    /// Once whole numbers are widened.
    Widened,
    /// Not at all.
    No,
}

impl Val {
    /// A value that is the same everywhere.
    pub(super) fn lit(lit: Lit, ty: Ty) -> Self {
        Self::Desc(Desc::Lit(lit), ty)
    }
}

/// The type of lists without items, which serve as lists of anything.
pub(super) fn nothing() -> Ty {
    Ty::Part("nothing".to_owned())
}

/// Whether `found` serves where `expected` is asked for.
pub(super) fn fit(expected: &Ty, found: &Ty) -> Fit {
    match (expected, found) {
        (Ty::Float, Ty::Int) => Fit::Widened,
        (Ty::Word, Ty::Str | Ty::Bool | Ty::Int | Ty::Float) | (Ty::External(_), Ty::Str) => {
            Fit::Same
        }
        (Ty::Fields, Ty::Record(_)) if is_plain(found) => Fit::Same,
        (Ty::List(_), Ty::List(item)) if **item == nothing() => Fit::Same,
        (Ty::List(expected), Ty::List(found)) => fit(expected, found),
        (Ty::Record(expected), Ty::Record(found)) if expected.keys().eq(found.keys()) => {
            let fields = expected.values().zip(found.values()).map(|(e, f)| fit(e, f));
            fields.fold(Fit::Same, |all, one| match (all, one) {
                (Fit::No, _) | (_, Fit::No) => Fit::No,
                (Fit::Same, Fit::Same) => Fit::Same,
                _ => Fit::Widened,
            })
        }
        (Ty::Function(expected), Ty::Function(found)) if expected != found => {
            let one = expected.len() == 1 && found.len() == 1;
            let known = found.iter().all(|name| expected.contains(name));
            if one || known { Fit::Widened } else { Fit::No }
        }
        _ if expected == found => Fit::Same,
        _ => Fit::No,
    }
}

/// Whether it is made of truths, numbers and texts alone.
fn is_plain(ty: &Ty) -> bool {
    match ty {
        Ty::Bool | Ty::Int | Ty::Float | Ty::Str => true,
        Ty::List(item) => **item == nothing() || is_plain(item),
        Ty::Record(fields) => fields.values().all(is_plain),
        _ => false,
    }
}

/// The description as the type asks for it.
///
/// - `fit`: how it serves there.
pub(super) fn coerce(desc: Desc, fit: Fit, ty: &Ty) -> Desc {
    match (desc, fit) {
        (Desc::Lit(lit), Fit::Widened) => Desc::Lit(crate::ir::widen(lit, ty)),
        (desc, Fit::Widened) => Desc::Widen(Box::new(desc), ty.clone()),
        (desc, _) => desc,
    }
}

/// The record of some fields that are descriptions.
pub(super) fn record(fields: impl Iterator<Item = (String, Val)>) -> Val {
    let (mut args, mut types) = (Vec::new(), BTreeMap::new());
    for (name, value) in fields {
        let Val::Desc(desc, ty) = value else { return Val::Poison };
        args.push((name.clone(), desc));
        types.insert(name, ty);
    }
    Val::Desc(fold(Desc::Part(String::new(), args.into_iter().collect())), Ty::Record(types))
}

/// Whether a value is a record of descriptions.
pub(super) fn is_record(value: &Val) -> bool {
    matches!(value, Val::Desc(_, Ty::Record(_)))
}

/// The type of a list that holds values of both types.
pub(super) fn join(a: &Ty, b: &Ty) -> Option<Ty> {
    match (a, b) {
        (Ty::Record(a), Ty::Record(b)) if a.keys().eq(b.keys()) => {
            let joined =
                a.iter().zip(b.values()).map(|((name, a), b)| Some((name.clone(), join(a, b)?)));
            return joined.collect::<Option<_>>().map(Ty::Record);
        }
        (Ty::List(a), Ty::List(b)) if **a != nothing() && **b != nothing() => {
            return join(a, b).map(|item| Ty::List(Box::new(item)));
        }
        _ => {}
    }
    match (fit(a, b), fit(b, a)) {
        (Fit::No, Fit::No) => None,
        (Fit::No, _) => Some(b.clone()),
        _ => Some(a.clone()),
    }
}

/// The description with one value in the place of whatever in it neither varies nor is computed.
pub(super) fn fold(desc: Desc) -> Desc {
    let desc = match desc {
        Desc::List(items) => Desc::List(items.into_iter().map(fold).collect()),
        Desc::Match(axis, arms) => Desc::Match(axis, arms.into_iter().map(fold).collect()),
        Desc::Part(name, args) => {
            Desc::Part(name, args.into_iter().map(|(arg, value)| (arg, fold(value))).collect())
        }
        Desc::Binary(op, left, right) => {
            Desc::Binary(op, Box::new(fold(*left)), Box::new(fold(*right)))
        }
        Desc::Maths(maths, of) => Desc::Maths(maths, of.into_iter().map(fold).collect()),
        Desc::Function(inputs, body) => Desc::Function(inputs, Box::new(fold(*body))),
        Desc::Widen(inner, ty) => Desc::Widen(Box::new(fold(*inner)), ty),
        Desc::Field(record, name) => match fold(*record) {
            Desc::Part(part, mut args) if part.is_empty() => {
                args.remove(&name).expect("checked to have the field")
            }
            Desc::Match(axis, arms) => {
                let field = |arm| fold(Desc::Field(Box::new(arm), name.clone()));
                Desc::Match(axis, arms.into_iter().map(field).collect())
            }
            record => Desc::Field(Box::new(record), name),
        },
        plain @ (Desc::Lit(_) | Desc::Axis(_) | Desc::Held(..) | Desc::Input(_)) => plain,
    };
    let constant = |desc: &Desc| matches!(desc, Desc::Lit(_));
    let whole = match &desc {
        Desc::List(items) | Desc::Maths(_, items) => items.iter().all(constant),
        Desc::Function(_, body) => body.axes().is_empty(),
        Desc::Part(_, args) => args.values().all(constant),
        Desc::Binary(_, left, right) => constant(left) && constant(right),
        Desc::Widen(inner, _) | Desc::Field(inner, _) => constant(inner),
        Desc::Lit(_) | Desc::Axis(_) | Desc::Held(..) | Desc::Match(..) | Desc::Input(_) => false,
    };
    match whole.then(|| desc.eval(&[], &Place::new())) {
        Some(Ok(lit)) => Desc::Lit(lit),
        // Arithmetic without a result is reported where it is used.
        Some(Err(_)) | None => desc,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_widen_and_nothing_else_does() {
        let list = |ty| Ty::List(Box::new(ty));
        assert_eq!(fit(&Ty::Float, &Ty::Int), Fit::Widened);
        assert_eq!(fit(&Ty::Int, &Ty::Float), Fit::No);
        assert_eq!(fit(&list(Ty::Float), &list(Ty::Int)), Fit::Widened);
        assert_eq!(fit(&list(Ty::Str), &list(nothing())), Fit::Same);
        let record = |ty| Ty::Record([("a".to_owned(), list(ty))].into());
        assert_eq!(fit(&Ty::Fields, &record(Ty::Str)), Fit::Same);
        assert_eq!(fit(&Ty::Fields, &record(Ty::Part("Ke".to_owned()))), Fit::No);
        assert_eq!(fit(&Ty::Fields, &Ty::Str), Fit::No);
        assert_eq!(join(&Ty::Int, &Ty::Float), Some(Ty::Float));
        assert_eq!(join(&Ty::Int, &Ty::Str), None);
    }
}
