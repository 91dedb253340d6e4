//! The labels along dimensions that are known before anything runs: those of published numbers.

use std::collections::BTreeMap;

use ivx_op::{Dim, Labels, Lit};

use super::Checker;
use crate::ir::ExprId;
use crate::{Code, Diagnostic, Span, suggest};

/// Labels along dimensions, where they are known.
#[derive(Default)]
pub(super) struct Table(BTreeMap<(ExprId, String), Labels>);

impl Table {
    /// Notes the labels of a value along each of its dimensions.
    pub(super) fn note(&mut self, id: ExprId, dims: Vec<Dim>) {
        self.0.extend(dims.into_iter().map(|dim| ((id, dim.name), dim.labels)));
    }

    /// Those of a value along a dimension.
    pub(super) fn along(&self, id: ExprId, dim: &str) -> Option<&Labels> {
        self.0.get(&(id, dim.to_owned()))
    }

    /// Takes away those of a dimension that is no more.
    pub(super) fn forget(&mut self, id: ExprId, dim: &str) {
        self.0.remove(&(id, dim.to_owned()));
    }
}

impl Checker<'_> {
    /// Gives a value the labels of what it is computed from, along its own dimensions.
    pub(super) fn inherit_labels(&mut self, id: ExprId, from: impl IntoIterator<Item = ExprId>) {
        if self.labels.0.is_empty() {
            return;
        }
        for from in from {
            for dim in self.program.expr(id).dims.clone() {
                let known = self.labels.along(from, &dim).cloned();
                if let Some(known) = known {
                    self.labels.0.entry((id, dim)).or_insert(known);
                }
            }
        }
    }

    /// The labels of a value along an axis or dimension, where they are known.
    pub(super) fn labels_along(&self, id: ExprId, name: &str) -> Option<Labels> {
        let mut axes = self.program.expr(id).axes.iter().map(|axis| self.program.axis(*axis));
        let axis = axes.find(|axis| axis.name == name).map(crate::ir::Axis::labels);
        axis.or_else(|| self.labels.along(id, name).cloned())
    }

    /// Whether two values have the same labels along an axis or dimension, as far as is known;
    /// reports it if not.
    pub(super) fn same_labels(
        &mut self,
        name: &str,
        (left, left_span): (ExprId, Span),
        (right, right_span): (ExprId, Span),
    ) -> bool {
        let axis = |id| {
            let mut axes = self.program.expr(id).axes.iter();
            axes.find(|axis| self.program.axis(**axis).name == name)
        };
        if axis(left).is_some() && axis(left) == axis(right) {
            return true;
        }
        let known = (self.labels_along(left, name), self.labels_along(right, name));
        let (Some(left), Some(right)) = known else { return true };
        if left == right {
            return true;
        }
        let message =
            format!("the labels along `{name}` differ: {} and {}", shown(&left), shown(&right));
        let fault = Diagnostic::new(Code::Dimensions, right_span, message, "other labels")
            .also(left_span, "these labels");
        self.fault(fault.help(format!("select the same of both, in one order: `[{name}: [..]]`")));
        false
    }

    /// Whether labels are among those known along a dimension, which are narrowed to them; reports
    /// it if not.
    ///
    /// - `selected`: what keeps them.
    pub(super) fn known_labels(
        &mut self,
        (base, selected): (ExprId, ExprId),
        dim: &str,
        labels: &[Lit],
        span: Span,
    ) -> bool {
        let Some(known) = self.labels.along(base, dim).cloned() else { return true };
        let texts: Vec<String> = (0..known.len()).map(|i| known.text(i)).collect();
        let found: BTreeMap<&str, usize> =
            texts.iter().enumerate().rev().map(|(i, text)| (text.as_str(), i)).collect();
        let mut places = Vec::new();
        for label in labels {
            let text = if let Lit::Text(text) = label { text.clone() } else { label.to_string() };
            let Some(place) = found.get(text.as_str()).copied() else {
                let message = format!("`{dim}` has no label {text:?}");
                let fault = Diagnostic::new(Code::UnknownLabel, span, message, "no such label");
                self.fault(fault.maybe_help(suggest(&text, texts.iter().map(String::as_str))));
                return false;
            };
            places.push(place);
        }
        self.labels.0.insert((selected, dim.to_owned()), known.pick(&places));
        true
    }
}

/// A few labels, for messages.
fn shown(labels: &Labels) -> String {
    let texts: Vec<String> = (0..labels.len().min(4)).map(|i| labels.text(i)).collect();
    format!("[{}{}]", texts.join(", "), if labels.len() > 4 { ", .." } else { "" })
}
