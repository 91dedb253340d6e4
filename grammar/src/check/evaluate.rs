//! Descriptions: whether they are small enough, and what they are before anything runs.

use std::collections::BTreeSet;

use ivx_op::{Lit, Ty};

use super::value::{Val, fold};
use super::{Checker, MAX_NODES};
use crate::ir::{AxisId, Desc, Place};
use crate::{Code, Diagnostic, Span};

/// Most coordinates at which one description is evaluated beforehand.
const MAX_CHECKED: usize = 100_000;

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
        let Some(places) = self.places(&desc.axes(), span) else { return false };
        for place in places {
            if let Err(why) = desc.eval(&self.spec.axes, &place) {
                let message = format!("{why}{}", self.whereabouts(&place));
                self.fault(Diagnostic::new(Code::Number, span, message, "has no value"));
                return false;
            }
        }
        true
    }

    /// Every place on some axes, unless there are too many to look at.
    pub(super) fn places(&mut self, axes: &BTreeSet<AxisId>, span: Span) -> Option<Vec<Place>> {
        if self.extent(axes) > MAX_CHECKED {
            self.outgrown(format!("this has more than {MAX_CHECKED} values"), span);
            return None;
        }
        let mut places = vec![Place::new()];
        for axis in axes {
            let n = self.spec.axis(*axis).coords.len();
            let along = |place: Place| {
                (0..n)
                    .map(move |i| place.iter().map(|(a, b)| (*a, *b)).chain([(*axis, i)]).collect())
            };
            places = places.into_iter().flat_map(along).collect();
        }
        Some(places)
    }

    /// ` at n = 0, ke = WCM`, for messages; nothing if there are no axes.
    pub(super) fn whereabouts(&self, place: &Place) -> String {
        let coords = place.iter().map(|(axis, i)| {
            let axis = self.spec.axis(*axis);
            format!("{} = {}", axis.name, axis.coords[*i].label)
        });
        let coords: Vec<_> = coords.collect();
        if coords.is_empty() { String::new() } else { format!(" at {}", coords.join(", ")) }
    }

    /// The value of a description that does not vary.
    pub(super) fn evaluate(&mut self, desc: &Desc, span: Span) -> Option<Lit> {
        match desc.eval(&self.spec.axes, &Place::new()) {
            Ok(lit) => Some(lit),
            Err(why) => {
                self.fault(Diagnostic::new(Code::Number, span, why, "has no value"));
                None
            }
        }
    }
}
