//! The program as far as it is made, and what can be asked of it.

use std::collections::BTreeSet;

use ivx_op::{Array, Artifact};

use super::value::{Val, nothing};
use crate::Span;
use crate::ir::{
    Axis, AxisId, AxisRole, Definition, Desc, Experiment, Expr, ExprId, Feed, Param, Place, Spec,
};

/// The program so far: it grows, and what is in it stays as it is.
#[derive(Default)]
pub(super) struct Program {
    spec: Spec,
    /// Where each expression stands.
    spans: Vec<Span>,
}

impl Program {
    pub(super) fn axis(&self, id: AxisId) -> &Axis {
        self.spec.axis(id)
    }

    pub(super) fn axes(&self) -> &[Axis] {
        &self.spec.axes
    }

    pub(super) fn expr(&self, id: ExprId) -> &Expr {
        self.spec.expr(id)
    }

    pub(super) fn exprs(&self) -> &[Expr] {
        &self.spec.exprs
    }

    /// The expressions that one is computed from.
    pub(super) fn inputs(&self, expr: &Expr) -> Vec<ExprId> {
        self.spec.inputs(expr)
    }

    /// Where an expression stands.
    pub(super) fn span(&self, id: ExprId) -> Span {
        self.spans[id.0 as usize]
    }

    /// What a part holds.
    pub(super) fn held(&self, slot: usize) -> &Feed {
        &self.spec.held[slot]
    }

    pub(super) fn push_axis(&mut self, axis: Axis) -> AxisId {
        self.spec.axes.push(axis);
        AxisId(u32::try_from(self.spec.axes.len() - 1).expect("axes are few"))
    }

    pub(super) fn push(&mut self, expr: Expr, span: Span) -> ExprId {
        self.spec.exprs.push(expr);
        self.spans.push(span);
        ExprId(u32::try_from(self.spec.exprs.len() - 1).expect("expressions are counted"))
    }

    /// Gives an expression the dimensions that are known once it is there.
    pub(super) fn set_dims(&mut self, id: ExprId, dims: Vec<String>) {
        self.spec.exprs[id.0 as usize].dims = dims;
    }

    /// Takes away all expressions but the first.
    pub(super) fn truncate(&mut self, n_exprs: usize) {
        self.spec.exprs.truncate(n_exprs);
        self.spans.truncate(n_exprs);
    }

    /// A description of something computed.
    pub(super) fn hold(&mut self, feed: Feed, axes: BTreeSet<AxisId>) -> Desc {
        self.spec.held.push(feed);
        Desc::Held(self.spec.held.len() - 1, axes)
    }

    pub(super) fn push_experiment(&mut self, experiment: Experiment) {
        self.spec.experiments.push(experiment);
    }

    /// - `params`: those of files.
    pub(super) fn set_params(&mut self, mut params: Vec<Param>) {
        params.sort_by(|a, b| a.name.cmp(&b.name));
        self.spec.params = params;
    }

    pub(super) fn set_definitions(&mut self, definitions: Vec<Definition>) {
        self.spec.definitions = definitions;
    }

    pub(super) fn set_profile(&mut self, profile: Option<&str>) {
        self.spec.profile = profile.map(str::to_owned);
    }

    /// The program, complete but for what is known of shapes.
    pub(super) fn done(self) -> Spec {
        self.spec
    }

    /// How many coordinates some axes have together.
    pub(super) fn extent(&self, axes: &BTreeSet<AxisId>) -> usize {
        let sizes = axes.iter().map(|axis| self.axis(*axis).coords.len());
        sizes.fold(1, usize::saturating_mul)
    }

    /// Axes, and how many coordinates each has.
    pub(super) fn sized(&self, axes: &BTreeSet<AxisId>) -> Vec<(AxisId, usize)> {
        axes.iter().map(|axis| (*axis, self.axis(*axis).coords.len())).collect()
    }

    /// Every place on some axes, last axis fastest.
    pub(super) fn places(&self, axes: &BTreeSet<AxisId>) -> impl Iterator<Item = Place> + use<> {
        let sizes = self.sized(axes);
        let n: usize = sizes.iter().map(|(_, size)| size).product();
        (0..n).map(move |mut i| {
            let coordinate = |(axis, size): &(AxisId, usize)| {
                let coordinate = i % size;
                i /= size;
                (*axis, coordinate)
            };
            sizes.iter().rev().map(coordinate).collect()
        })
    }

    /// The names of axes, for messages.
    pub(super) fn names(&self, axes: &BTreeSet<AxisId>) -> Vec<String> {
        axes.iter().map(|axis| self.axis(*axis).name.clone()).collect()
    }

    /// ` at n = 0, ke = WCM`, for messages; nothing if there are no axes.
    pub(super) fn whereabouts(&self, place: &Place) -> String {
        let coords = place.iter().map(|(axis, i)| {
            let axis = self.axis(*axis);
            format!("{} = {}", axis.name, axis.coords[*i].label)
        });
        let coords: Vec<_> = coords.collect();
        if coords.is_empty() { String::new() } else { format!(" at {}", coords.join(", ")) }
    }

    /// What a value is, for messages.
    pub(super) fn describe(&self, value: &Val) -> String {
        match value {
            Val::Desc(_, ty) if *ty == nothing() => "nothing".to_owned(),
            Val::Desc(_, ty) => ty.to_string(),
            Val::Artifact(id) => {
                let expr = self.expr(*id);
                let members =
                    expr.axes.iter().any(|axis| self.axis(*axis).role == AxisRole::Member);
                if !expr.collected.is_empty() {
                    let over = self.names(&expr.collected).join(", ");
                    return format!("Collection<{}> over {over}", expr.artifact);
                }
                match (expr.artifact.as_str(), &expr.dims[..]) {
                    (artifact, _) if members && artifact != Array::KIND => {
                        format!("Ensemble<{artifact}>")
                    }
                    (Array::KIND, []) => "Scalar".to_owned(),
                    (artifact, []) => artifact.to_owned(),
                    (artifact, dims) => format!("{artifact}[{}]", dims.join(", ")),
                }
            }
            Val::Poison => "something faulty".to_owned(),
        }
    }

    /// A value with everything that it varies over, for what takes labels.
    pub(super) fn everything(&self, id: ExprId) -> Feed {
        let mut gathered: Vec<_> = self.expr(id).axes.iter().copied().collect();
        gathered.sort_by_key(|axis| self.axis(*axis).name.clone());
        Feed { gathered, labelled: true, ..Feed::one(id) }
    }
}
