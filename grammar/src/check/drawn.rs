//! What random numbers a value rests on.

use super::Checker;
use crate::ir::{AxisId, AxisRole, Desc, Expr, ExprId, ExprKind, Op};

/// The random numbers upstream of a value.
#[derive(Clone, Copy, Default)]
pub(super) struct Drawn {
    /// Whether they differ along the `seed` axis that the value has.
    varies: bool,
    /// The most seeds along `seed` axes that it has no more; 1 where it never had one, 0 where
    /// nothing draws.
    reduced: usize,
}

impl Checker<'_> {
    /// How many seeds a value rests on at most; 0 where nothing upstream of it draws.
    pub(super) fn n_seeds(&mut self, id: ExprId) -> usize {
        for place in self.drawn.len()..=id.0 as usize {
            let drawn = self.draws_upstream(&self.spec.exprs[place]);
            self.drawn.push(drawn);
        }
        let Drawn { varies, reduced } = self.drawn[id.0 as usize];
        let own = self.seed_of(id).filter(|_| varies);
        own.map_or(reduced, |seed| reduced.max(self.spec.axis(seed).coords.len()))
    }

    /// - `expr`: its inputs are known.
    fn draws_upstream(&self, expr: &Expr) -> Drawn {
        match &expr.kind {
            ExprKind::Number(_) => Drawn::default(),
            ExprKind::Op(_) | ExprKind::Match { .. } => {
                let has_seed = expr.axes.iter().any(|axis| self.is_seed(*axis));
                let draws = matches!(&expr.kind, ExprKind::Op(op) if self.draws_here(op));
                let mut drawn =
                    Drawn { varies: draws && has_seed, reduced: usize::from(draws && !has_seed) };
                for id in self.spec.inputs(expr) {
                    let input = self.drawn[id.0 as usize];
                    drawn.reduced = drawn.reduced.max(input.reduced);
                    let Some(seed) = self.seed_of(id).filter(|_| input.varies) else { continue };
                    if expr.axes.contains(&seed) {
                        drawn.varies = true;
                    } else {
                        drawn.reduced = drawn.reduced.max(self.spec.axis(seed).coords.len());
                    }
                }
                drawn
            }
            ExprKind::Pick { base, axis, .. } => match self.drawn[base.0 as usize] {
                Drawn { varies: true, reduced } if self.is_seed(*axis) => {
                    Drawn { varies: false, reduced: reduced.max(1) }
                }
                drawn => drawn,
            },
            ExprKind::Restrict { base, .. } => self.drawn[base.0 as usize],
        }
    }

    /// Whether an operation draws random numbers, or is given the seed to draw from.
    fn draws_here(&self, op: &Op) -> bool {
        let mut axes = op.args.values().flat_map(Desc::axes);
        op.stochastic || axes.any(|axis| self.is_seed(axis))
    }

    fn is_seed(&self, axis: AxisId) -> bool {
        self.spec.axis(axis).role == AxisRole::Seed
    }

    /// The `seed` axis that a value varies over.
    fn seed_of(&self, id: ExprId) -> Option<AxisId> {
        self.spec.expr(id).axes.iter().copied().find(|axis| self.is_seed(*axis))
    }
}
