//! What an expression amounts to while it is checked.

use ivx_op::{Lit, Ty};

use crate::ir::{Desc, ExprId};

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
        (Ty::List(_), Ty::List(item)) if **item == nothing() => Fit::Same,
        (Ty::List(expected), Ty::List(found)) => fit(expected, found),
        _ if expected == found => Fit::Same,
        _ => Fit::No,
    }
}

/// The description as the type asks for it.
pub(super) fn coerce(desc: Desc, fit: Fit) -> Desc {
    match (desc, fit) {
        (Desc::Lit(lit), Fit::Widened) => Desc::Lit(crate::ir::widen(lit)),
        (desc, Fit::Widened) => Desc::Widen(Box::new(desc)),
        (desc, _) => desc,
    }
}

/// The type of a list that holds values of both types.
pub(super) fn join(a: &Ty, b: &Ty) -> Option<Ty> {
    match (fit(a, b), fit(b, a)) {
        (Fit::No, Fit::No) => None,
        (Fit::No, _) => Some(b.clone()),
        _ => Some(a.clone()),
    }
}

/// The description as one value where nothing in it varies.
pub(super) fn fold(desc: Desc) -> Desc {
    match desc {
        Desc::List(items) if items.iter().all(|item| matches!(item, Desc::Lit(_))) => {
            let lits = items
                .into_iter()
                .map(|i| if let Desc::Lit(lit) = i { lit } else { unreachable!() });
            Desc::Lit(Lit::List(lits.collect()))
        }
        Desc::Part(name, args) if args.values().all(|arg| matches!(arg, Desc::Lit(_))) => {
            let args = args.into_iter();
            let args =
                args.map(|(k, v)| if let Desc::Lit(lit) = v { (k, lit) } else { unreachable!() });
            Desc::Lit(Lit::Part(ivx_op::Part { name, args: args.collect() }))
        }
        other => other,
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
        assert_eq!(join(&Ty::Int, &Ty::Float), Some(Ty::Float));
        assert_eq!(join(&Ty::Int, &Ty::Str), None);
    }
}
