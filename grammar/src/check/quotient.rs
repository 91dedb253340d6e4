//! Quotients of whole numbers where a whole number is asked for.

use ivx_op::Ty;

use super::Checker;
use super::expr::At;
use super::value::Val;
use crate::ast::{BinaryOp, Expr, ExprKind};
use crate::ir::{Desc, WHOLE};
use crate::{Code, Diagnostic};

impl<'a> Checker<'a> {
    /// The value of an expression where a type is asked for: a quotient of whole numbers is one itself where an Int is
    /// meant, if it divides.
    pub(super) fn quotient(&mut self, at: &At, ty: &Ty, value: Val, expr: &'a Expr) -> Val {
        match value {
            Val::Desc(desc, Ty::Float) if *ty == Ty::Int && self.divides_whole(at, expr) => {
                self.divided(desc, expr)
            }
            value => value,
        }
    }

    fn divided(&mut self, desc: Desc, expr: &Expr) -> Val {
        if !self.evaluates(&desc, expr.span) {
            return Val::Poison;
        }
        let bad = self.program.places(&desc.axes()).find_map(|place| {
            let lit = desc.eval(self.program.axes(), &place).expect("was seen to have a value");
            let is_whole = lit.as_f64().is_some_and(|x| x.fract() == 0.0 && x.abs() < WHOLE);
            (!is_whole).then(|| (lit, self.program.whereabouts(&place)))
        });
        let Some((lit, place)) = bad else {
            return Val::Desc(super::value::fold(Desc::Widen(Box::new(desc), Ty::Int)), Ty::Int);
        };
        let message = format!("a whole number is asked for here, and this is {lit}{place}");
        let fault = Diagnostic::new(Code::Number, expr.span, message, "does not divide");
        self.fault(fault.help("choose numbers of which one divides the other"))
    }

    /// Whether an expression is arithmetic of whole numbers in which one is divided.
    fn divides_whole(&mut self, at: &At, expr: &'a Expr) -> bool {
        let (mut divides, mut rest, mut leaves) = (false, vec![expr], Vec::new());
        while let Some(expr) = rest.pop() {
            match &expr.kind {
                ExprKind::Binary { op, left, right } => {
                    divides |= op.value == BinaryOp::Div;
                    rest.extend([&**left, &**right]);
                }
                ExprKind::Negate(inner) => rest.push(inner),
                _ => leaves.push(expr),
            }
        }
        // What it is made of was looked at before, and is without fault.
        divides
            && leaves.into_iter().all(|leaf| matches!(self.expr(at, leaf), Val::Desc(_, Ty::Int)))
    }
}
