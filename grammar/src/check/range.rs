//! Ranges in selections: `x[step: ..1_000]`, along axes and along dimensions.

use ivx_op::{Array, Artifact, ByName, Labels, Lit};

use super::Checker;
use super::expr::At;
use super::value::Val;
use crate::ast;
use crate::ir::{AxisId, Desc, ExprId};
use crate::{Code, Diagnostic, Span};

/// What a selection asks for.
pub(super) enum Selected {
    /// A label, or those of a list.
    These(Lit),
    /// All within a range.
    Between(Ends),
}

/// The ends of a range of labels: from the first on, below the last.
#[derive(Clone, Copy)]
pub(super) struct Ends {
    pub(super) from: Option<f64>,
    pub(super) to: Option<f64>,
}

impl Ends {
    fn hold(self, x: f64) -> bool {
        self.from.is_none_or(|from| from <= x) && self.to.is_none_or(|to| x < to)
    }

    /// As it is written.
    fn told(self) -> String {
        let end = |end: Option<f64>| end.map_or_else(String::new, |end| end.to_string());
        format!("{}..{}", end(self.from), end(self.to))
    }
}

impl<'a> Checker<'a> {
    /// The labels that a selection asks for, which are known before anything runs.
    pub(super) fn selected(&mut self, at: &At, label: &'a ast::Expr) -> Option<Selected> {
        let ast::ExprKind::Range { from, to } = &label.kind else {
            let Val::Desc(Desc::Lit(labels), _) = self.known_before_at(at, label) else {
                return None;
            };
            return Some(Selected::These(labels));
        };
        let mut end = |end: &'a Option<Box<ast::Expr>>| match end {
            Some(end) => self.range_end(at, end).map(Some),
            None => Some(None),
        };
        let (from, to) = (end(from), end(to));
        Some(Selected::Between(Ends { from: from?, to: to? }))
    }

    fn range_end(&mut self, at: &At, end: &'a ast::Expr) -> Option<f64> {
        let Val::Desc(Desc::Lit(lit), ty) = self.known_before_at(at, end) else { return None };
        let number = match lit {
            Lit::Int(_) | Lit::Real(_) => lit.as_f64(),
            _ => None,
        };
        if number.is_none() {
            let message = format!("the ends of a range are numbers, found {ty}");
            let fault = Diagnostic::new(Code::Type, end.span, message, "not a number");
            self.fault(fault.help("list the labels that are meant: `[ke: [\"WCM\", \"MA\"]]`"));
        }
        number
    }

    /// The coordinates of an axis within a range.
    pub(super) fn restrict_to(&mut self, value: Val, axis: AxisId, ends: Ends, span: Span) -> Val {
        if self.axes.are_any(axis) {
            // Which seeds there are is not known, and several of them are again any.
            return value;
        }
        let own = self.program.axis(axis);
        let number = |lit: &Lit| match lit {
            Lit::Int(_) | Lit::Real(_) => lit.as_f64(),
            _ => None,
        };
        let labels: Option<Vec<f64>> =
            own.coords.iter().map(|coord| number(&coord.value)).collect();
        let Some(labels) = labels else {
            let message = format!("the labels of axis `{}` are not numbers", own.name);
            let fault = Diagnostic::new(Code::Type, span, message, "a range of numbers");
            return self.fault(fault.help("list the labels that are meant"));
        };
        let inside = labels.iter().enumerate().filter(|(_, x)| ends.hold(**x));
        let places: Vec<usize> = inside.map(|(place, _)| place).collect();
        if places.is_empty() {
            return self.none_within(&self.program.axis(axis).name.clone(), ends, span);
        }
        self.restrict(value, axis, places, span)
    }

    /// The coordinates of a dimension within a range; which there are may be known only when it is computed.
    pub(super) fn select_range(
        &mut self,
        at: &At,
        id: ExprId,
        dim: &str,
        ends: Ends,
        span: Span,
    ) -> Val {
        if self.program.expr(id).artifact != Array::KIND {
            let message = format!("`{dim}` lies inside a {}", self.program.expr(id).artifact);
            return self.fault(Diagnostic::new(Code::Kind, span, message, "cannot be selected"));
        }
        match self.labels.along(id, dim) {
            Some(Labels::Numbers(known)) => {
                let within = known.iter().copied().filter(|x| ends.hold(*x));
                let within: Vec<Lit> = within.map(Lit::Real).collect();
                if within.is_empty() {
                    return self.none_within(dim, ends, span);
                }
                self.select_dim(at, id, dim, &Lit::List(within), span)
            }
            Some(Labels::Names(_)) => {
                let message = format!("the labels of `{dim}` are not numbers");
                let fault = Diagnostic::new(Code::Type, span, message, "a range of numbers");
                self.fault(fault.help("list the labels that are meant"))
            }
            None => {
                let end = |end: Option<f64>| {
                    Desc::Lit(Lit::List(end.into_iter().map(Lit::Real).collect()))
                };
                let args = ByName::from([
                    ("dim".to_owned(), Desc::Lit(dim.into())),
                    ("from".to_owned(), end(ends.from)),
                    ("to".to_owned(), end(ends.to)),
                ]);
                self.builtin(at, "select_range", args, vec![("x", id)], span)
            }
        }
    }

    fn none_within(&mut self, name: &str, ends: Ends, span: Span) -> Val {
        let message = format!("no label of `{name}` lies in {}", ends.told());
        let fault = Diagnostic::new(Code::UnknownLabel, span, message, "an empty range");
        self.fault(fault.help("a range goes from its first label on, and ends below its last"))
    }
}
