//! Claims: comparisons of two sides that vary over the same.

use std::collections::BTreeSet;

use ivx_op::Ty;

use super::Checker;
use super::expr::At;
use super::value::Val;
use crate::ast::{self, BinaryOp, ExprKind};
use crate::ir::{Desc, ExprId, Judged, Mark};
use crate::{Code, Diagnostic, Span, Spanned};

/// The methods by which a claim may ask to be judged.
const METHODS: [&str; 3] = ["t", "bootstrap", "wilcoxon"];

impl<'a> Checker<'a> {
    /// The verdict on a claim, and how it is reached.
    pub(super) fn claim(
        &mut self,
        at: &At,
        (title, asked): (&'a Spanned<String>, &'a ast::Asked),
        (value, on_par): (&'a ast::Expr, bool),
        within: Option<&'a ast::Within>,
    ) -> Option<(ExprId, Judged)> {
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
        let margin = self.margin(at, op, on_par, within);
        let confidence = asked.at.as_ref().map_or(Some(0.95), |given| self.confidence(at, given));
        let by = asked.by.as_ref().map_or(Some(String::new()), |by| self.method(by));
        let (left, right) = (self.side(at, left), self.side(at, right));
        let ((margin, why), confidence, by) = (margin?, confidence?, by?);
        let (left, right) = (left?, right?);
        if !self.comparable(&left, &right) {
            return None;
        }
        let all = self.program.expr(left.id).axes.union(&self.program.expr(right.id).axes).copied();
        if !self.distinct(&all.collect(), title.span) {
            return None;
        }
        let (a, b) = ((left.id, left.span), (right.id, right.span));
        if !left.over.intersection(&right.over).all(|name| self.same_labels(name, a, b)) {
            return None;
        }
        let family = asked.family.as_ref();
        if let Some(family) = family.filter(|family| family.value.trim().is_empty()) {
            let message = "a family of claims has a name";
            let fault = Diagnostic::new(Code::Kind, family.span, message, "no name");
            self.fault(fault.help("write `family \"H1\"`, or leave it out"));
            return None;
        }
        let family = family.map(|family| family.value.clone());
        let mut judged = Judged { confidence, by, margin, why, family, ..Judged::default() };
        if self.program.cannot_fail((op.value, margin), left.id, right.id) {
            judged.marks.insert(Mark::CannotFail);
        }
        let by = asked.by.as_ref().map(|by| by.span);
        let sides = (op.value, [left.id, right.id]);
        let expr = self.verdict(at, sides, (value.span, by), &mut judged)?;
        let is_stochastic = !judged.marks.contains(&Mark::Deterministic);
        if is_stochastic && margin > 0.0 && judged.why.is_empty() {
            judged.marks.insert(Mark::MarginUnsaid);
        }
        Some((expr, judged))
    }

    /// How often intervals such as that of a claim hold the truth.
    fn confidence(&mut self, at: &At, written: &'a ast::Expr) -> Option<f64> {
        let known = self.known_before(at.scope, written);
        let Val::Desc(Desc::Lit(lit), ty) = known else {
            return None;
        };
        let message = match lit.as_f64() {
            Some(confidence) if (0.5..1.0).contains(&confidence) => return Some(confidence),
            Some(_) => {
                format!("the confidence of a claim is at least 0.5 and below 1, found {lit}")
            }
            None => format!("the confidence of a claim is a Float, found {ty}"),
        };
        let code = if lit.as_f64().is_some() { Code::Range } else { Code::Type };
        let fault = Diagnostic::new(code, written.span, message, "no such confidence");
        self.fault(fault.help("write `claim \"..\" at 0.99 : ..`; without it, 0.95 is meant"));
        None
    }

    /// The method that a claim asks for.
    fn method(&mut self, by: &Spanned<String>) -> Option<String> {
        if METHODS.contains(&by.value.as_str()) {
            return Some(by.value.clone());
        }
        let message = format!("no method of judging a claim is called {:?}", by.value);
        let fault = Diagnostic::new(Code::Kind, by.span, message, "no such method");
        let help = "say `by \"t\"`, `by \"bootstrap\"` or `by \"wilcoxon\"`; without it, intervals are Student's, \
                    stretched where differences have a tail";
        self.fault(fault.help(help));
        None
    }

    /// By how much the sides of a claim may differ, or one be worse, and why so much; 0 where nothing is said.
    fn margin(
        &mut self,
        at: &At,
        op: &Spanned<BinaryOp>,
        on_par: bool,
        within: Option<&'a ast::Within>,
    ) -> Option<(f64, String)> {
        let worded = || "write `within(0.05, \"why so much\")`";
        let Some(within) = within else {
            if on_par {
                let message = "what is on par is so within a margin";
                let fault = Diagnostic::new(Code::Kind, op.span, message, "within what?");
                self.fault(fault.help(worded()));
            }
            return (!on_par).then(|| (0.0, String::new()));
        };
        if matches!(op.value, BinaryOp::Less | BinaryOp::Greater | BinaryOp::Unequal) {
            let symbol = op.value.symbol();
            let message = format!("`within` goes with `==`, `<=` and `>=`, not with `{symbol}`");
            let fault = Diagnostic::new(Code::Kind, op.span, message, "has no use for a margin")
                .also(within.margin.span, "the margin");
            let help = match op.value {
                BinaryOp::Unequal => "write `left == right within(0.05)`, or leave `within` out",
                BinaryOp::Less => {
                    "write `left <= right within(0.05, \"why so much\")` for not worse by more"
                }
                _ => "write `left >= right within(0.05, \"why so much\")` for not worse by more",
            };
            self.fault(fault.help(help));
            return None;
        }
        let margin = self.tolerance(at, &within.margin);
        let why = within.why.as_ref().map_or("", |why| why.value.trim());
        if why.is_empty() && (on_par || op.value != BinaryOp::Equal) {
            let message = "a margin is justified in words";
            let span = within.why.as_ref().map_or(within.margin.span, |why| why.span);
            self.fault(Diagnostic::new(Code::Kind, span, message, "why so much?").help(worded()));
            return None;
        }
        Some((margin?, why.to_owned()))
    }

    /// By how much the sides of a claim may differ.
    fn tolerance(&mut self, at: &At, written: &'a ast::Expr) -> Option<f64> {
        let Val::Desc(Desc::Lit(lit), ty) = self.known_before(at.scope, written) else {
            return None;
        };
        let Some(tolerance) = lit.as_f64() else {
            let message = format!("the tolerance of a claim is a Float, found {ty}");
            let fault = Diagnostic::new(Code::Type, written.span, message, "expected Float");
            self.fault(fault.maybe_help(self.library.of_type(&Ty::Float)));
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
        let expr = self.program.expr(id);
        let mut over: BTreeSet<String> =
            self.program.names(&expr.axes).into_iter().chain(expr.dims.clone()).collect();
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
        let over = lacking.join(", ");
        let help = format!(
            "select or reduce on the other side: `mean(x, over: {over})`, or `min` or `max` for the worst"
        );
        self.fault(fault.also(more.span, "varies over it").help(help));
        false
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
