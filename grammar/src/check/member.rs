//! What the descriptions of an operation ask for: members, and random numbers.

use std::collections::{BTreeMap, BTreeSet};

use ivx_op::{ArgKind, Lit};

use super::Checker;
use crate::ir::{AxisId, Desc};
use crate::{Code, Diagnostic, Span};

impl Checker<'_> {
    /// The member axis that descriptions ask for.
    ///
    /// - `own`: how many members the operation itself asks for.
    pub(super) fn members_of(
        &mut self,
        descs: &BTreeMap<String, Desc>,
        own: Option<&Desc>,
        span: Span,
    ) -> Result<Option<AxisId>, ()> {
        let number = |desc: &Desc| if let Desc::Lit(Lit::Int(n)) = desc { Some(*n) } else { None };
        let mut counts: Vec<Option<i64>> = own.map(number).into_iter().collect();
        for desc in descs.values() {
            let mut lits: Vec<Lit> = Vec::new();
            let mut axes = BTreeSet::new();
            desc.visit(&mut |desc| match desc {
                Desc::Lit(lit) => lits.push(lit.clone()),
                Desc::Axis(axis) => {
                    axes.insert(*axis);
                }
                Desc::Part(name, args) => {
                    let decl = self.registry.decl(name);
                    let own = decl
                        .and_then(|decl| decl.args.iter().find(|arg| arg.kind == ArgKind::Members));
                    if let Some(desc) = own.and_then(|arg| args.get(arg.name)) {
                        counts.push(number(desc));
                    }
                }
                _ => {}
            });
            counts.extend(
                lits.iter().filter_map(|lit| self.registry.member_count(lit)).map(|(_, n)| Some(n)),
            );
            for axis in axes {
                let coords = &self.spec.axis(axis).coords;
                let each: Vec<_> = coords
                    .iter()
                    .map(|c| self.registry.member_count(&c.value).map(|(_, n)| n))
                    .collect();
                if each.iter().any(Option::is_some) {
                    counts.extend(each);
                }
            }
        }
        counts.dedup();
        match counts[..] {
            [] => Ok(None),
            [Some(n)] => self.member_axis(n, span).map(Some).ok_or(()),
            _ => {
                let message = "the number of members must be the same everywhere";
                let fault = Diagnostic::new(
                    Code::Dimensions,
                    span,
                    message,
                    "ensembles of several sizes meet",
                );
                self.fault(fault.help("train the largest ensemble and select members from it"));
                Err(())
            }
        }
    }

    /// Whether a part in a description draws random numbers.
    pub(super) fn draws(&self, desc: &Desc) -> bool {
        let stochastic = |name: &str| self.registry.decl(name).is_some_and(|decl| decl.stochastic);
        let mut draws = false;
        desc.visit(&mut |desc| {
            draws |= match desc {
                Desc::Lit(lit) => any_part(lit, &stochastic),
                Desc::Part(name, _) => stochastic(name),
                Desc::Axis(axis) => {
                    self.spec.axis(*axis).coords.iter().any(|c| any_part(&c.value, &stochastic))
                }
                _ => false,
            }
        });
        draws
    }
}

fn any_part(lit: &Lit, wanted: &impl Fn(&str) -> bool) -> bool {
    match lit {
        Lit::Part(part) => {
            wanted(&part.name) || part.args.values().any(|arg| any_part(arg, wanted))
        }
        Lit::List(items) => items.iter().any(|item| any_part(item, wanted)),
        _ => false,
    }
}
