//! What random numbers a value rests on, and which of its seeds vanish.

use std::collections::BTreeSet;

use super::Checker;
use super::axis::SEED;
use crate::ir::{AxisId, AxisRole, Desc, Expr, ExprId, ExprKind, Op};

/// The random numbers upstream of a value.
#[derive(Clone, Copy, Default)]
pub(super) struct Drawn {
    /// Whether they differ along the `seed` axis that the value has.
    varies: bool,
    /// The most seeds along `seed` axes that it has no more; 1 where it never had one, 0 where
    /// nothing draws.
    reduced: usize,
    /// Whether seeds vanish somewhere in what it is made of, its own aside.
    loses: bool,
    /// Whether some of the seeds are chosen by their labels, somewhere in what it is made of.
    chosen: bool,
}

impl Checker<'_> {
    /// How many seeds a value rests on at most; 0 where nothing upstream of it draws.
    pub(super) fn n_seeds(&mut self, id: ExprId) -> usize {
        for place in self.drawn.len()..=id.0 as usize {
            let expr = &self.spec.exprs[place];
            let inputs = self.spec.inputs(expr);
            let loses =
                self.loses_here(expr) || inputs.iter().any(|id| self.drawn[id.0 as usize].loses);
            let chosen =
                self.chooses_here(expr) || inputs.iter().any(|id| self.drawn[id.0 as usize].chosen);
            let drawn = Drawn { loses, chosen, ..self.draws_upstream(expr) };
            self.drawn.push(drawn);
        }
        let Drawn { varies, reduced, .. } = self.drawn[id.0 as usize];
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
                let mut drawn = Drawn {
                    varies: draws && has_seed,
                    reduced: usize::from(draws && !has_seed),
                    ..Drawn::default()
                };
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
                drawn @ Drawn { varies: true, reduced, .. } if self.is_seed(*axis) => {
                    Drawn { varies: false, reduced: reduced.max(1), ..drawn }
                }
                drawn => drawn,
            },
            ExprKind::Restrict { base, .. } => self.drawn[base.0 as usize],
        }
    }

    /// Whether an expression is that of some seeds, named by their labels.
    fn chooses_here(&self, expr: &Expr) -> bool {
        let some = match &expr.kind {
            ExprKind::Pick { base, axis, .. } => self.is_seed(*axis).then_some(*base),
            ExprKind::Restrict { base, axis, places, .. } => {
                let is_part = places.len() < self.spec.axis(*axis).coords.len();
                (self.is_seed(*axis) && is_part).then_some(*base)
            }
            _ => None,
        };
        some.is_some_and(|base| self.drawn[base.0 as usize].varies)
    }

    /// Whether a value rests on seeds that are chosen by their labels. As [`Self::loses_seeds`].
    pub(super) fn chooses_seeds(&self, id: ExprId) -> bool {
        self.drawn[id.0 as usize].chosen
    }

    /// Whether an operation draws random numbers, or is given the seed to draw from.
    fn draws_here(&self, op: &Op) -> bool {
        let mut axes = op.args.values().flat_map(Desc::axes);
        op.stochastic || axes.any(|axis| self.is_seed(axis))
    }

    /// Whether seeds vanish somewhere in what a value is made of, its own aside. It was asked for its seeds before, or
    /// what is made of it was.
    pub(super) fn loses_seeds(&self, id: ExprId) -> bool {
        self.drawn[id.0 as usize].loses
    }

    /// Whether seeds vanish in an expression itself.
    pub(super) fn loses_here(&self, expr: &Expr) -> bool {
        // One seed that is picked says nothing of the others, which is told otherwise.
        let picks = matches!(&expr.kind, ExprKind::Pick { .. })
            || matches!(&expr.kind, ExprKind::Op(op) if op.name == "select");
        let inputs = || self.spec.inputs(expr).into_iter();
        !picks && !self.has_seeds(expr) && inputs().any(|id| self.over_seeds(id))
    }

    /// Whether an expression has seeds, along an axis or inside.
    pub(super) fn has_seeds(&self, expr: &Expr) -> bool {
        expr.dims.iter().any(|dim| dim == SEED) || self.seed_in(&expr.axes).is_some()
    }

    /// Whether a value varies over seeds.
    pub(super) fn over_seeds(&self, id: ExprId) -> bool {
        self.has_seeds(self.spec.expr(id))
    }

    pub(super) fn is_seed(&self, axis: AxisId) -> bool {
        self.spec.axis(axis).role == AxisRole::Seed
    }

    /// The `seed` axis that a value varies over.
    pub(super) fn seed_of(&self, id: ExprId) -> Option<AxisId> {
        self.seed_in(&self.spec.expr(id).axes)
    }

    /// The `seed` axis among others.
    pub(super) fn seed_in(&self, axes: &BTreeSet<AxisId>) -> Option<AxisId> {
        axes.iter().copied().find(|axis| self.is_seed(*axis))
    }
}
