//! Descriptions: whether they are small enough, and what they are before anything runs.

use ivx_op::{Lit, Ty};

use super::value::{Val, fold};
use super::{Checker, MAX_NODES};
use crate::ir::{Desc, Place};
use crate::literal::inexact;
use crate::{Code, Diagnostic, Span};

impl Checker<'_> {
    /// A description, unless lists of lists made it too large.
    pub(super) fn bounded(&mut self, desc: Desc, ty: Ty, span: Span) -> Val {
        if desc.size() > MAX_NODES {
            self.outgrown(format!("this description has more than {MAX_NODES} values"), span);
            return Val::Poison;
        }
        Val::Desc(fold(desc), ty)
    }

    /// Whether a description has a value wherever it is used; reports it if not.
    pub(super) fn evaluates(&mut self, desc: &Desc, span: Span) -> bool {
        if !desc.computes() {
            return true;
        }
        let axes = desc.axes();
        if self.program.extent(&axes) > self.budget.max_nodes() {
            let n = self.program.extent(&axes);
            self.too_many(format!("there are {n} values of this"), span);
            return false;
        }
        let bad = self.program.places(&axes).find_map(|place| {
            let why = desc.eval(self.program.axes(), &place).err()?;
            Some(format!("{why}{}", self.program.whereabouts(&place)))
        });
        match bad {
            None => true,
            Some(message) => {
                self.fault(Diagnostic::new(Code::Number, span, message, "has no value"));
                false
            }
        }
    }

    /// Whether each whole number in a description is one of the reals that it is to become.
    pub(super) fn exact(&mut self, desc: &Desc, span: Span) -> bool {
        let mut bad = None;
        desc.visit(&mut |desc| match desc {
            Desc::Lit(lit) => bad = bad.or(inexact(lit)),
            Desc::Axis(axis) => {
                let coords = &self.program.axis(*axis).coords;
                bad = bad.or(coords.iter().find_map(|coord| inexact(&coord.value)));
            }
            _ => {}
        });
        self.none_of(bad, span)
    }

    /// As [`Self::exact`], for what a description that has a value everywhere amounts to.
    pub(super) fn is_exact(&mut self, desc: &Desc, span: Span) -> bool {
        let value = |place: Place| desc.eval(self.program.axes(), &place).ok();
        let bad = self.program.places(&desc.axes()).filter_map(value).find_map(|lit| inexact(&lit));
        self.none_of(bad, span)
    }

    /// Whether there is no whole number that would be rounded; says so if there is.
    fn none_of(&mut self, bad: Option<i64>, span: Span) -> bool {
        let Some(n) = bad else { return true };
        let message = format!("no Float is {n}");
        let fault = Diagnostic::new(Code::Number, span, message, "would be rounded");
        #[expect(clippy::cast_precision_loss, reason = "that is what is told")]
        let near = n as f64;
        self.fault(fault.help(format!("the nearest is `{near:?}`")));
        false
    }

    /// The value of a description that does not vary.
    pub(super) fn evaluate(&mut self, desc: &Desc, span: Span) -> Option<Lit> {
        match desc.eval(self.program.axes(), &Place::new()) {
            Ok(lit) => Some(lit),
            Err(why) => {
                self.fault(Diagnostic::new(Code::Number, span, why, "has no value"));
                None
            }
        }
    }
}
