//! What only claims have: how they ask to be judged, `on par with`, and margins.

use super::Rule;
use super::build::Build;
use super::parts::{Pair, Parts};
use crate::Spanned;
use crate::ast::{Asked, BinaryOp, Expr, ExprKind, Within};

impl Build<'_> {
    /// What stands behind the first expression of a claim: the comparison in words, and the margin.
    pub(super) fn claimed(
        &mut self,
        mut value: Expr,
        parts: &mut Parts<'_>,
    ) -> (Expr, bool, Option<Box<Within>>) {
        let (mut on_par, mut within) = (false, None);
        while let Some(pair) = parts.next() {
            if pair.as_rule() == Rule::on_par {
                let op = Spanned { value: BinaryOp::Equal, span: self.span(&pair) };
                let (left, right) = (Box::new(value), Box::new(self.expr(parts.part(), 0)));
                let span = left.span.to(right.span);
                value = Expr { kind: ExprKind::Binary { op, left, right }, span };
                on_par = true;
            } else {
                let mut parts = Parts::of(pair);
                let margin = self.expr(parts.part(), 0);
                let why = parts.next().map(|why| self.string(&why));
                within = Some(Box::new(Within { margin, why }));
            }
        }
        (value, on_par, within)
    }

    /// What stands between the words of a claim and its colon.
    pub(super) fn asked(&mut self, parts: Parts<'_>) -> Asked {
        let mut asked = Asked::default();
        for part in parts {
            let rule = part.as_rule();
            let given = Parts::of(part).part();
            match rule {
                Rule::claim_at => asked.at = Some(self.confidence(&given)),
                Rule::claim_by => asked.by = Some(self.string(&given)),
                _ => asked.family = Some(self.string(&given)),
            }
        }
        asked
    }

    fn confidence(&mut self, pair: &Pair<'_>) -> Expr {
        if pair.as_rule() == Rule::number {
            return self.number(pair, None);
        }
        let name = self.name(pair);
        Expr { span: name.span, kind: ExprKind::Name(name.value) }
    }
}
