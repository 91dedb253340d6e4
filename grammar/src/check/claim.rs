//! Claims: comparisons of two sides that vary over the same.

use std::collections::BTreeSet;

use ivx_op::{Artifact, ByName, Lit, Ty, Verdict};

use super::Checker;
use super::expr::At;
use super::value::Val;
use crate::ast::{self, BinaryOp, ExprKind};
use crate::ir::{Desc, Expr, ExprId, Feed, Op};
use crate::{Code, Diagnostic, Span, Spanned};

/// The confidences that a claim may ask for.
const CONFIDENCES: std::ops::RangeInclusive<f64> = 0.5..=0.999;

impl<'a> Checker<'a> {
    /// The verdict on a claim.
    pub(super) fn claim(
        &mut self,
        at: &At,
        (title, confidence): (&'a Spanned<String>, Option<&'a ast::Expr>),
        value: &'a ast::Expr,
        within: Option<&'a ast::Expr>,
    ) -> Option<ExprId> {
        let (op, left, right) = match &value.kind {
            ExprKind::Binary { op, left, right } if op.value.compares() => (op, left, right),
            ExprKind::Junk => return None,
            _ => {
                let message = "a claim compares two values";
                let fault = Diagnostic::new(Code::Kind, value.span, message, "not a comparison");
                self.fault(fault.help("write `left < right`"));
                return None;
            }
        };
        let within = match within {
            Some(tolerance) if op.value == BinaryOp::Equal => self.tolerance(at, tolerance),
            Some(tolerance) => {
                let message = format!("`within` goes with `==`, not with `{}`", op.value.symbol());
                let fault =
                    Diagnostic::new(Code::Kind, op.span, message, "has no use for a tolerance")
                        .also(tolerance.span, "the tolerance")
                        .help("write `left == right within(0.05)`, or leave `within` out");
                self.fault(fault);
                None
            }
            None => Some(0.0),
        };
        let confidence = confidence.map_or(Some(0.95), |written| self.confidence(at, written));
        let (left, right) = (self.side(at, left), self.side(at, right));
        let (within, confidence, left, right) = (within?, confidence?, left?, right?);
        if !self.comparable(&left, &right) {
            return None;
        }
        let all = self.spec.expr(left.id).axes.union(&self.spec.expr(right.id).axes).copied();
        if !self.distinct(&all.collect(), title.span) {
            return None;
        }
        let (a, b) = ((left.id, left.span), (right.id, right.span));
        if !left.over.intersection(&right.over).all(|name| self.same_labels(name, a, b)) {
            return None;
        }
        // A side that rests on too few seeds decides nothing, whatever the other rests on.
        let seeds = [left.id, right.id].map(|side| self.n_seeds(side));
        let seeds = seeds.into_iter().filter(|n| *n > 0).min().unwrap_or(0);
        let seeds = i64::try_from(seeds).expect("axes are bounded");
        let args = ByName::from([
            ("relation".to_owned(), Desc::Lit(op.value.symbol().into())),
            ("confidence".to_owned(), Desc::Lit(Lit::Real(confidence))),
            ("within".to_owned(), Desc::Lit(Lit::Real(within))),
            ("seeds".to_owned(), Desc::Lit(Lit::Int(seeds))),
        ]);
        let ports = [("left", left), ("right", right)];
        let ports = ports.map(|(port, side)| (port.to_owned(), vec![self.everything(side.id)]));
        let op = Op { name: "claim".to_owned(), args, ports: ports.into(), stochastic: false };
        let expr = Expr {
            address: at.address.clone(),
            axes: BTreeSet::new(),
            collected: BTreeSet::new(),
            artifact: Verdict::KIND.to_owned(),
            dims: Vec::new(),
            kind: crate::ir::ExprKind::Op(op),
        };
        Some(self.push(expr, value.span))
    }

    /// How often intervals such as that of a claim hold the true mean.
    fn confidence(&mut self, at: &At, written: &'a ast::Expr) -> Option<f64> {
        let known = self.known_before(at.scope, written);
        let Val::Desc(Desc::Lit(lit), ty) = known else {
            return None;
        };
        let message = match lit.as_f64() {
            Some(confidence) if CONFIDENCES.contains(&confidence) => return Some(confidence),
            Some(_) => format!("the confidence of a claim is from 0.5 to 0.999, found {lit}"),
            None => format!("the confidence of a claim is a Float, found {ty}"),
        };
        let code = if lit.as_f64().is_some() { Code::Range } else { Code::Type };
        let fault = Diagnostic::new(code, written.span, message, "no such confidence");
        self.fault(fault.help("write `claim \"..\" at 0.99 : ..`; without it, 0.95 is meant"));
        None
    }

    /// By how much the sides of a claim of equality may differ.
    fn tolerance(&mut self, at: &At, written: &'a ast::Expr) -> Option<f64> {
        let Val::Desc(Desc::Lit(lit), ty) = self.known_before(at.scope, written) else {
            return None;
        };
        let Some(tolerance) = lit.as_f64() else {
            let message = format!("the tolerance of a claim is a Float, found {ty}");
            let fault = Diagnostic::new(Code::Type, written.span, message, "expected Float");
            self.fault(fault.maybe_help(self.of_type(&Ty::Float)));
            return None;
        };
        if tolerance <= 0.0 {
            let message = format!("the tolerance of a claim must be above 0, found {lit}");
            let fault = Diagnostic::new(Code::Range, written.span, message, "out of range");
            self.fault(fault.help("without `within`, `==` asks for equality"));
            return None;
        }
        Some(tolerance)
    }

    fn side(&mut self, at: &At, side: &'a ast::Expr) -> Option<Side> {
        let value = self.expr(at, side);
        let constant = matches!(&value, Val::Desc(desc, _) if desc.axes().is_empty());
        let id = self.array(at, value, side.span)?;
        let expr = self.spec.expr(id);
        let mut over: BTreeSet<String> =
            self.names(&expr.axes).into_iter().chain(expr.dims.clone()).collect();
        over.remove(super::axis::SEED);
        Some(Side { id, span: side.span, constant, over })
    }

    /// Whether two sides of a claim vary over the same, seeds aside; reports it if not.
    fn comparable(&mut self, left: &Side, right: &Side) -> bool {
        if left.constant || right.constant || left.over == right.over {
            return true;
        }
        let (more, less) =
            if left.over.is_subset(&right.over) { (right, left) } else { (left, right) };
        let lacking: Vec<_> = more.over.difference(&less.over).map(String::as_str).collect();
        let message = format!(
            "one side of the claim varies over `{}`, the other does not",
            lacking.join("`, `")
        );
        let fault = Diagnostic::new(Code::ClaimAxes, less.span, message, "does not vary over it");
        let help =
            format!("select or reduce on the other side: `mean(x, over: {})`", lacking.join(", "));
        self.fault(fault.also(more.span, "varies over it").help(help));
        false
    }

    /// A value with everything that it varies over, for what takes labels.
    fn everything(&self, id: ExprId) -> Feed {
        let mut gathered: Vec<_> = self.spec.expr(id).axes.iter().copied().collect();
        gathered.sort_by_key(|axis| self.spec.axis(*axis).name.clone());
        Feed { gathered, labelled: true, ..Feed::one(id) }
    }
}

/// One side of a claim.
struct Side {
    id: ExprId,
    span: Span,
    /// Whether it is a number written down.
    constant: bool,
    /// What it varies over, seeds aside.
    over: BTreeSet<String>,
}
