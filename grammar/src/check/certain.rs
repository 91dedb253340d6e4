//! What is true of values whatever comes out.

use std::collections::{BTreeMap, BTreeSet};

use super::program::Program;
use crate::ast::BinaryOp;
use crate::ir::{Desc, ExprId, ExprKind};

/// The lowest and the highest number that a value can be.
type Bounds = (f64, f64);

/// Nothing is known of it.
const ANY: Bounds = (f64::NEG_INFINITY, f64::INFINITY);

impl Program {
    /// Whether a comparison is true whatever comes out: of constants, of a number with itself, of what is never below
    /// a bound.
    pub(super) fn cannot_fail(
        &self,
        (relation, margin): (BinaryOp, f64),
        left: ExprId,
        right: ExprId,
    ) -> bool {
        if self.made_alike(left, right) {
            return matches!(relation, BinaryOp::Equal | BinaryOp::AtMost | BinaryOp::AtLeast);
        }
        let ((low, high), (from, to)) = (self.bounds_of(left), self.bounds_of(right));
        match relation {
            BinaryOp::Less => high < from,
            BinaryOp::AtMost => high <= from + margin,
            BinaryOp::Greater => low > to,
            BinaryOp::AtLeast => low >= to - margin,
            BinaryOp::Equal => high - from <= margin && to - low <= margin,
            BinaryOp::Unequal => high < from || low > to,
            _ => false,
        }
    }

    /// Whether two values are made by the same operations of the same.
    fn made_alike(&self, left: ExprId, right: ExprId) -> bool {
        let (mut seen, mut todo) = (BTreeSet::new(), vec![(left, right)]);
        while let Some((left, right)) = todo.pop() {
            if left == right || !seen.insert((left, right)) {
                continue;
            }
            let (a, b) = (self.expr(left), self.expr(right));
            let same = match (&a.kind, &b.kind) {
                (ExprKind::Number(a), ExprKind::Number(b)) => a == b,
                (ExprKind::Op(a), ExprKind::Op(b)) => {
                    a.name == b.name && a.args == b.args && !a.args.values().any(Desc::holds)
                }
                (
                    ExprKind::Pick { axis, place, .. },
                    ExprKind::Pick { axis: other, place: there, .. },
                ) => axis == other && place == there,
                _ => false,
            };
            let (ours, theirs) = (self.inputs(a), self.inputs(b));
            if !same || ours.len() != theirs.len() {
                return false;
            }
            todo.extend(ours.into_iter().zip(theirs));
        }
        true
    }

    /// Between which numbers a value lies whatever comes out.
    fn bounds_of(&self, id: ExprId) -> Bounds {
        let (mut needed, mut todo) = (BTreeSet::new(), vec![id]);
        while let Some(id) = todo.pop() {
            let expr = self.expr(id);
            let through = match &expr.kind {
                ExprKind::Op(op) => {
                    bounds(&op.name, &vec![(0.0, 0.0); self.inputs(expr).len()]) != ANY
                }
                ExprKind::Pick { .. } | ExprKind::Restrict { .. } => true,
                ExprKind::Number(_) | ExprKind::Match { .. } => false,
            };
            if needed.insert(id) && through {
                todo.extend(self.inputs(expr));
            }
        }
        // Inputs come first.
        let mut known: BTreeMap<ExprId, Bounds> = BTreeMap::new();
        for id in needed {
            let expr = self.expr(id);
            let of_input = |id: &ExprId| known.get(id).copied().unwrap_or(ANY);
            let bounds = match &expr.kind {
                ExprKind::Number(Desc::Lit(lit)) => lit.as_f64().map_or(ANY, |x| (x, x)),
                ExprKind::Pick { base, .. } | ExprKind::Restrict { base, .. } => of_input(base),
                ExprKind::Op(op) => {
                    bounds(&op.name, &self.inputs(expr).iter().map(of_input).collect::<Vec<_>>())
                }
                _ => ANY,
            };
            known.insert(id, bounds);
        }
        known[&id]
    }
}

/// Between which numbers the result of an operation lies, if its inputs lie between these.
fn bounds(op: &str, inputs: &[Bounds]) -> Bounds {
    match (op, inputs) {
        ("share" | "less" | "at_most" | "greater" | "at_least" | "equal" | "unequal", _) => {
            (0.0, 1.0)
        }
        ("std" | "stderr", _) => (0.0, f64::INFINITY),
        (
            "mean" | "median" | "iqm" | "min" | "max" | "quantile" | "select" | "select_range"
            | "sort",
            [x, ..],
        ) => *x,
        ("neg", [(low, high)]) => (-high, -low),
        ("add", [a, b]) => (a.0 + b.0, a.1 + b.1),
        ("sub", [a, b]) => (a.0 - b.1, a.1 - b.0),
        _ => ANY,
    }
}
