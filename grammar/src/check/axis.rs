//! Axes: their coordinates, evaluated before anything runs.

use std::collections::BTreeSet;

use ivx_op::{Lit, Ty};

use super::value::{Fit, Val, coerce, fit, join};
use super::{Checker, MAX_NODES};
use crate::ast::{AxisExpr, Expr, Name};
use crate::ir::{Axis, AxisId, AxisRole, Coord, Desc};
use crate::{Code, Diagnostic, Span, Spanned};

/// The name of the axis whose value reaches every stochastic operation.
pub(super) const SEED: &str = "seed";
/// The name of the axis that the members of an ensemble make.
pub(super) const MEMBER: &str = "member";

impl<'a> Checker<'a> {
    /// The axis that an item declares; `None` if it is faulty.
    pub(super) fn axis(
        &mut self,
        scope: usize,
        name: &'a Name,
        values: &'a AxisExpr,
    ) -> Option<AxisId> {
        let declared = (scope, name.value.clone());
        if let Some(known) = self.axes.get(&declared) {
            return *known;
        }
        let coords = self.coords(scope, name, values);
        let id = coords.map(|coords| {
            let role = if name.value == SEED { AxisRole::Seed } else { AxisRole::Plain };
            self.push_axis(Axis { name: name.value.clone(), role, coords })
        });
        self.axes.insert(declared, id);
        id
    }

    fn push_axis(&mut self, axis: Axis) -> AxisId {
        self.spec.axes.push(axis);
        AxisId(u32::try_from(self.spec.axes.len() - 1).expect("axes are few"))
    }

    /// The axis of an ensemble with so many members; `None` if they are too many.
    pub(super) fn member_axis(&mut self, n: i64, span: Span) -> Option<AxisId> {
        if let Some(known) = self.members.get(&n) {
            return Some(*known);
        }
        if !self.bounds(0, n, span) {
            return None;
        }
        let coords = (0..n).map(|i| Coord { label: i.to_string(), value: Lit::Int(i) }).collect();
        let id = self.push_axis(Axis { name: MEMBER.to_owned(), role: AxisRole::Member, coords });
        self.members.insert(n, id);
        Some(id)
    }

    /// The axis that has only some coordinates of another.
    pub(super) fn restricted_axis(&mut self, axis: AxisId, places: &[usize]) -> AxisId {
        if let Some(known) = self.restricted.get(&(axis, places.to_vec())) {
            return *known;
        }
        let Axis { name, role, coords } = self.spec.axis(axis);
        let coords = places.iter().map(|&place| coords[place].clone()).collect();
        let (name, role) = (name.clone(), *role);
        let id = self.push_axis(Axis { name, role, coords });
        self.restricted.insert((axis, places.to_vec()), id);
        id
    }

    fn coords(&mut self, scope: usize, name: &'a Name, values: &'a AxisExpr) -> Option<Vec<Coord>> {
        let coords = match values {
            AxisExpr::Range(low, high) => self.range(scope, low, high)?,
            AxisExpr::Labelled(entries, _) => self.labelled(scope, entries)?,
            AxisExpr::List(list) => {
                let Val::Desc(Desc::Lit(lit), ty) = self.known_before(scope, list) else {
                    return None;
                };
                let Lit::List(items) = lit else {
                    let message = format!("axis `{}` needs a list, found {ty}", name.value);
                    let fault = Diagnostic::new(Code::Axis, list.span, message, "not a list");
                    self.fault(fault.help("write `[a, b]`, `a..b` or `{ \"label\": value, ... }`"));
                    return None;
                };
                let label = |lit: &Lit| {
                    if let Lit::Text(text) = lit { text.clone() } else { lit.to_string() }
                };
                items.into_iter().map(|value| Coord { label: label(&value), value }).collect()
            }
        };
        let mut labels = BTreeSet::new();
        if let Some(again) = coords.iter().find(|coord| !labels.insert(&coord.label)) {
            let message = format!("axis `{}` has `{}` twice", name.value, again.label);
            self.fault(Diagnostic::new(Code::Axis, name.span, message, "labels must differ"));
            return None;
        }
        if coords.is_empty() {
            let message = format!("axis `{}` has no coordinates", name.value);
            self.fault(Diagnostic::new(Code::Axis, name.span, message, "nothing to vary over"));
            return None;
        }
        if let (SEED, Some(odd)) =
            (name.value.as_str(), coords.iter().find(|c| !matches!(c.value, Lit::Int(_))))
        {
            let message = format!("seeds are whole numbers, found {}", odd.value);
            self.fault(Diagnostic::new(Code::Axis, name.span, message, "not a whole number"));
            return None;
        }
        Some(coords)
    }

    fn range(&mut self, scope: usize, low: &'a Expr, high: &'a Expr) -> Option<Vec<Coord>> {
        let mut bound = |expr: &'a Expr| -> Option<i64> {
            match self.known_before(scope, expr) {
                Val::Desc(Desc::Lit(Lit::Int(n)), _) => Some(n),
                Val::Poison => None,
                _ => {
                    let message = "the bounds of a range are whole numbers";
                    self.fault(Diagnostic::new(
                        Code::Axis,
                        expr.span,
                        message,
                        "not a whole number",
                    ));
                    None
                }
            }
        };
        let (low_n, high_n) = (bound(low)?, bound(high)?);
        if !self.bounds(low_n, high_n, low.span.to(high.span)) {
            return None;
        }
        Some((low_n..high_n).map(|i| Coord { label: i.to_string(), value: Lit::Int(i) }).collect())
    }

    /// Whether an axis can have the whole numbers from `low` to `high`; reports it if not.
    fn bounds(&mut self, low: i64, high: i64, span: Span) -> bool {
        let n = usize::try_from(high.saturating_sub(low).max(0)).unwrap_or(usize::MAX);
        if n > MAX_NODES {
            self.outgrown(format!("the axis has {n} coordinates"), span);
            return false;
        }
        self.room(n, span)
    }

    fn labelled(
        &mut self,
        scope: usize,
        entries: &'a [(Spanned<String>, Expr)],
    ) -> Option<Vec<Coord>> {
        let values: Vec<_> =
            entries.iter().map(|(_, expr)| (self.known_before(scope, expr), expr.span)).collect();
        let typed = values.iter().map(|(value, span)| match value {
            Val::Desc(Desc::Lit(lit), ty) => Some((lit.clone(), ty.clone(), *span)),
            _ => None,
        });
        let typed: Vec<(Lit, Ty, Span)> = typed.collect::<Option<_>>()?;
        let mut joined = typed.first()?.1.clone();
        for (_, ty, span) in &typed {
            let Some(both) = join(&joined, ty) else {
                let message =
                    format!("the values of an axis are of one type: {joined} before, {ty} here");
                self.fault(Diagnostic::new(
                    Code::Type,
                    *span,
                    message,
                    format!("expected {joined}"),
                ));
                return None;
            };
            joined = both;
        }
        let coords = entries.iter().zip(typed).map(|((label, _), (value, ty, _))| {
            let fits = fit(&joined, &ty);
            let Desc::Lit(value) =
                coerce(Desc::Lit(value), if fits == Fit::No { Fit::Same } else { fits })
            else {
                unreachable!("coercing a literal gives a literal")
            };
            Coord { label: label.value.clone(), value }
        });
        Some(coords.collect())
    }

    /// What stands for an axis in expressions: its value at each coordinate.
    pub(super) fn axis_value(&self, id: AxisId) -> Val {
        Val::Desc(Desc::Axis(id), self.type_of(&self.spec.axis(id).coords[0].value))
    }
}
