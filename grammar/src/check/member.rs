//! What the descriptions of an operation ask for: members, and random numbers.

use std::collections::BTreeSet;

use ivx_op::{ArgKind, ByName, Lit};

use super::Checker;
use crate::ir::{AxisId, Desc};
use crate::{Code, Diagnostic, Span};

impl Checker<'_> {
    /// The member axis that descriptions ask for.
    ///
    /// - `own`: how many members the operation itself asks for.
    pub(super) fn members_of(
        &mut self,
        descs: &ByName<Desc>,
        own: Option<&Desc>,
        span: Span,
    ) -> Result<Option<AxisId>, ()> {
        let number = |desc: &Desc| if let Desc::Lit(Lit::Int(n)) = desc { Some(*n) } else { None };
        let mut counts: BTreeSet<Option<i64>> = own.map(number).into_iter().collect();
        let registry = self.library.registry();
        let asks = |name: &str| {
            let decl = registry.decl(name);
            decl.is_some_and(|decl| decl.args.iter().any(|arg| arg.kind == ArgKind::Members))
        };
        for desc in descs.values().filter(|desc| self.has_part(desc, &mut Vec::new(), &asks)) {
            let axes = desc.axes();
            let n = self.program.extent(&axes);
            if n > self.budget.max_nodes() {
                self.too_many(format!("there are {n} values of this"), span);
                return Err(());
            }
            let values = self
                .program
                .places(&axes)
                .filter_map(|place| desc.eval(self.program.axes(), &place).ok());
            let values: Vec<Lit> = values.collect();
            if values.iter().any(|value| nested(value, &asks)) {
                let message = "an ensemble of ensembles has members of two kinds";
                let fault = Diagnostic::new(Code::Dimensions, span, message, "one inside another");
                self.fault(fault.help("take one of the two away"));
                return Err(());
            }
            counts.extend(values.iter().map(|lit| registry.member_count(lit).map(|(_, n)| n)));
        }
        let counts: Vec<Option<i64>> = counts.into_iter().collect();
        let (label, help) = match counts[..] {
            [] => return Ok(None),
            [Some(n)] => return self.member_axis(n, span).map(Some).ok_or(()),
            [None, Some(_)] if own.is_none() => {
                ("an ensemble meets what has no members", "write a call for each of them")
            }
            _ => (
                "ensembles of several sizes meet",
                "train the largest ensemble and select members from it",
            ),
        };
        let message = "the number of members must be the same everywhere";
        self.fault(Diagnostic::new(Code::Dimensions, span, message, label).help(help));
        Err(())
    }

    /// Whether a part in a description draws random numbers.
    pub(super) fn draws(&self, desc: &Desc) -> bool {
        let stochastic =
            |name: &str| self.library.registry().decl(name).is_some_and(|decl| decl.stochastic);
        self.has_part(desc, &mut Vec::new(), &stochastic)
    }

    /// Whether a description has such a part at some coordinate.
    ///
    /// - `fields`: the fields that are read of it, the first of them last; the others do not count.
    fn has_part<'d>(
        &self,
        desc: &'d Desc,
        fields: &mut Vec<&'d str>,
        wanted: &impl Fn(&str) -> bool,
    ) -> bool {
        match desc {
            Desc::Lit(lit) => any_part(lit, fields, wanted),
            Desc::Axis(axis) => {
                let coords = &self.program.axis(*axis).coords;
                coords.iter().any(|coord| any_part(&coord.value, fields.as_slice(), wanted))
            }
            Desc::List(items) | Desc::Match(_, items) => {
                items.iter().any(|item| self.has_part(item, fields, wanted))
            }
            Desc::Part(name, args) => match fields.pop() {
                Some(field) => {
                    let has = self.has_part(&args[field], fields, wanted);
                    fields.push(field);
                    has
                }
                None => wanted(name) || args.values().any(|arg| self.has_part(arg, fields, wanted)),
            },
            Desc::Field(record, name) => {
                fields.push(name);
                let has = self.has_part(record, fields, wanted);
                fields.pop();
                has
            }
            Desc::Widen(inner, _) => self.has_part(inner, fields, wanted),
            Desc::Held(..)
            | Desc::Binary(..)
            | Desc::Maths(..)
            | Desc::Input(_)
            | Desc::Function(..) => false,
        }
    }
}

/// Whether such a part has another inside it.
fn nested(lit: &Lit, wanted: &impl Fn(&str) -> bool) -> bool {
    match lit {
        Lit::Part(part) if wanted(&part.name) => {
            part.args.values().any(|arg| any_part(arg, &[], wanted))
        }
        Lit::Part(part) => part.args.values().any(|arg| nested(arg, wanted)),
        Lit::List(items) => items.iter().any(|item| nested(item, wanted)),
        _ => false,
    }
}

/// Whether a value, or the field of it that `fields` lead to, has such a part.
fn any_part(lit: &Lit, fields: &[&str], wanted: &impl Fn(&str) -> bool) -> bool {
    match (lit, fields) {
        (record, [rest @ .., field]) => {
            record.field(field).is_some_and(|value| any_part(value, rest, wanted))
        }
        (Lit::Part(part), []) => {
            wanted(&part.name) || part.args.values().any(|arg| any_part(arg, &[], wanted))
        }
        (Lit::List(items), []) => items.iter().any(|item| any_part(item, &[], wanted)),
        _ => false,
    }
}
