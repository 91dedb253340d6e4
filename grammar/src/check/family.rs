//! `match`: a family of values over an axis, one expression for each of its labels.

use std::collections::{BTreeMap, BTreeSet};

use ivx_op::{Array, Artifact};

use super::Checker;
use super::expr::{At, is_number};
use super::value::{Fit, Val, coerce, fit, fold, join};
use crate::ast;
use crate::ir::{AxisId, AxisRole, Desc, Expr, ExprId, ExprKind};
use crate::{Code, Diagnostic, Span, Spanned, suggest};

type Arms<'a> = [(Spanned<String>, ast::Expr)];

impl<'a> Checker<'a> {
    /// What a match amounts to.
    pub(super) fn matching(
        &mut self,
        at: &At,
        axis: &'a ast::Expr,
        arms: &'a Arms<'a>,
        span: Span,
    ) -> Val {
        let id = match self.expr(at, axis) {
            Val::Poison => return Val::Poison,
            Val::Desc(Desc::Axis(id), _) => id,
            other => {
                let message =
                    format!("`match` needs an axis, found {}", self.program.describe(&other));
                let fault = Diagnostic::new(Code::UnknownAxis, axis.span, message, "not an axis");
                return self.fault(fault);
            }
        };
        let Some(arms) = self.arms(id, arms, span) else { return Val::Poison };
        let values: Vec<(Val, Span)> =
            arms.iter().map(|arm| (self.expr(at, arm), arm.span)).collect();
        if values.iter().any(|(value, _)| matches!(value, Val::Poison)) {
            return Val::Poison;
        }
        if values.iter().all(|(value, _)| matches!(value, Val::Desc(..))) {
            return self.family_of_descriptions(id, values, span);
        }
        self.family(at, id, values, span)
    }

    /// The expressions in the order of the axis.
    fn arms(&mut self, axis: AxisId, arms: &'a Arms<'a>, span: Span) -> Option<Vec<&'a ast::Expr>> {
        let name = self.program.axis(axis).name.clone();
        // Which seeds there are is not known where no experiment is at hand: those of the arms.
        let labels: Vec<String> = match arms {
            [_, ..] if self.axes.are_any(axis) => {
                let labels: BTreeSet<&String> = arms.iter().map(|arm| &arm.0.value).collect();
                labels.into_iter().cloned().collect()
            }
            _ => self.program.axis(axis).coords.iter().map(|coord| coord.label.clone()).collect(),
        };
        let places: BTreeMap<&str, usize> =
            labels.iter().enumerate().map(|(i, label)| (label.as_str(), i)).collect();
        let mut found: Vec<Option<&'a (Spanned<String>, ast::Expr)>> = vec![None; labels.len()];
        let mut sound = true;
        for arm in arms {
            let Spanned { value: label, span } = &arm.0;
            let fault = match places.get(label.as_str()).map(|place| &mut found[*place]) {
                None => {
                    let message = format!("axis `{name}` has no label {label:?}");
                    Diagnostic::new(Code::UnknownLabel, *span, message, "no such label")
                        .maybe_help(suggest(label, places.keys().copied()))
                }
                Some(Some(first)) => {
                    let message = format!("label {label:?} has two arms");
                    Diagnostic::new(Code::TwiceGiven, *span, message, "given again")
                        .also(first.0.span, "first given here")
                }
                Some(place) => {
                    *place = Some(arm);
                    continue;
                }
            };
            self.fault(fault);
            sound = false;
        }
        let missing: Vec<String> = labels
            .iter()
            .zip(&found)
            .filter(|(_, arm)| arm.is_none())
            .map(|(label, _)| format!("{label:?}"))
            .take(5)
            .collect();
        if sound && !missing.is_empty() {
            let message = format!("this match over `{name}` has no arm for {}", missing.join(", "));
            let fault = Diagnostic::new(Code::MissingArm, span, message, "not complete");
            self.fault(fault.help(format!("write `{}: ...`", missing[0])));
        }
        found.into_iter().map(|arm| arm.map(|(_, expr)| expr)).collect::<Option<_>>()
    }

    fn family_of_descriptions(
        &mut self,
        axis: AxisId,
        values: Vec<(Val, Span)>,
        span: Span,
    ) -> Val {
        let typed = values.into_iter().map(|(value, span)| match value {
            Val::Desc(desc, ty) => (desc, ty, span),
            Val::Artifact(_) | Val::Poison => unreachable!("all are descriptions"),
        });
        let typed: Vec<_> = typed.collect();
        let mut joined = typed[0].1.clone();
        for (_, ty, span) in &typed {
            let Some(both) = join(&joined, ty) else {
                let message =
                    format!("the arms of a match are of one type: {joined} before, {ty} here");
                let label = format!("expected {joined}");
                return self.fault(Diagnostic::new(Code::Type, *span, message, label));
            };
            joined = both;
        }
        let arms = typed.into_iter().map(|(desc, ty, _)| match fit(&joined, &ty) {
            Fit::No => desc,
            fits => coerce(desc, fits, &joined),
        });
        let desc = Desc::Match(axis, arms.collect());
        let axes = desc.axes();
        if !self.distinct(&axes, span) {
            return Val::Poison;
        }
        self.bounded(fold(desc), joined, span)
    }

    fn family(&mut self, at: &At, axis: AxisId, values: Vec<(Val, Span)>, span: Span) -> Val {
        let first = values.iter().find_map(|(value, span)| match value {
            Val::Artifact(id) => Some((*id, *span)),
            _ => None,
        });
        let (first, first_span) = first.expect("not all are descriptions");
        let Expr { artifact, .. } = self.program.expr(first).clone();
        let mut arms: Vec<(ExprId, Span)> = Vec::new();
        for (value, span) in values {
            let number = matches!(&value, Val::Desc(_, ty) if is_number(ty));
            match value {
                Val::Artifact(id) if self.program.expr(id).artifact == artifact => {
                    arms.push((id, span));
                }
                value if number && artifact == Array::KIND => match self.array(at, value, span) {
                    Some(id) => arms.push((id, span)),
                    None => return Val::Poison,
                },
                other => {
                    let found = self.program.describe(&other);
                    let message =
                        format!("the arms of a match are of one type: {artifact} and {found}");
                    let fault = Diagnostic::new(Code::Type, span, message, "of another type");
                    return self.fault(fault.also(first_span, "of this type"));
                }
            }
        }
        let shape = |checker: &Self, id: ExprId| {
            let expr = checker.program.expr(id);
            let member = |axis: &&AxisId| checker.program.axis(**axis).role == AxisRole::Member;
            let dims: BTreeSet<String> = expr.dims.iter().cloned().collect();
            (dims, expr.axes.iter().find(member).copied(), expr.collected.clone())
        };
        let own = shape(self, first);
        if let Some((odd, odd_span)) = arms.iter().find(|(id, _)| shape(self, *id) != own) {
            let found = [first, *odd].map(|id| self.program.describe(&Val::Artifact(id)));
            let message =
                format!("the arms of a match are of one shape: {} and {}", found[0], found[1]);
            let fault = Diagnostic::new(Code::Dimensions, *odd_span, message, "of another shape")
                .also(first_span, "of this shape");
            return self.fault(fault.help("reduce or select until they agree"));
        }
        let mut axes = BTreeSet::from([axis]);
        for (id, _) in &arms {
            axes.extend(&self.program.expr(*id).axes);
        }
        let Expr { dims, collected, .. } = self.program.expr(first).clone();
        if !self.distinct(&axes, span) || !self.apart(&axes, &dims, span) {
            return Val::Poison;
        }
        let alike = dims.iter().all(|dim| {
            let known = |id| self.labels_along(id, dim);
            arms.iter().all(|(id, _)| known(*id) == known(first))
        });
        let arms = arms.into_iter().map(|(id, _)| id).collect();
        let id = self.push(
            Expr {
                address: at.address.clone(),
                axes,
                collected,
                artifact,
                dims,
                kind: ExprKind::Match { axis, arms },
            },
            span,
        );
        self.inherit_labels(id, alike.then_some(first));
        Val::Artifact(id)
    }
}
