//! What random numbers a value rests on, and which of its seeds vanish.

use std::collections::BTreeSet;

use super::axis::SEED;
use super::program::Program;
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

/// The random numbers upstream of the first expressions, as far as they were asked for.
#[derive(Default)]
pub(super) struct Table(Vec<Drawn>);

impl Table {
    /// How many seeds a value rests on at most; 0 where nothing upstream of it draws.
    pub(super) fn n_seeds(&mut self, program: &Program, id: ExprId) -> usize {
        for expr in program.exprs().iter().take(id.0 as usize + 1).skip(self.0.len()) {
            let inputs = program.inputs(expr);
            let loses = program.loses_here(expr) || inputs.iter().any(|id| self.of(*id).loses);
            let chosen =
                self.chooses_here(program, expr) || inputs.iter().any(|id| self.of(*id).chosen);
            let drawn = Drawn { loses, chosen, ..self.draws_upstream(program, expr) };
            self.0.push(drawn);
        }
        let Drawn { varies, reduced, .. } = self.of(id);
        let own = program.seed_of(id).filter(|_| varies);
        own.map_or(reduced, |seed| reduced.max(program.axis(seed).coords.len()))
    }

    /// What is known of an expression that was asked for its seeds, or what is made of it.
    fn of(&self, id: ExprId) -> Drawn {
        self.0[id.0 as usize]
    }

    /// - `expr`: its inputs are known.
    fn draws_upstream(&self, program: &Program, expr: &Expr) -> Drawn {
        match &expr.kind {
            ExprKind::Number(_) => Drawn::default(),
            ExprKind::Op(_) | ExprKind::Match { .. } => {
                let has_seed = expr.axes.iter().any(|axis| program.is_seed(*axis));
                let draws = matches!(&expr.kind, ExprKind::Op(op) if program.draws_here(op));
                let mut drawn = Drawn {
                    varies: draws && has_seed,
                    reduced: usize::from(draws && !has_seed),
                    ..Drawn::default()
                };
                for id in program.inputs(expr) {
                    let input = self.of(id);
                    drawn.reduced = drawn.reduced.max(input.reduced);
                    let Some(seed) = program.seed_of(id).filter(|_| input.varies) else { continue };
                    if expr.axes.contains(&seed) {
                        drawn.varies = true;
                    } else {
                        drawn.reduced = drawn.reduced.max(program.axis(seed).coords.len());
                    }
                }
                drawn
            }
            ExprKind::Pick { base, axis, .. } => match self.of(*base) {
                drawn @ Drawn { varies: true, reduced, .. } if program.is_seed(*axis) => {
                    Drawn { varies: false, reduced: reduced.max(1), ..drawn }
                }
                drawn => drawn,
            },
            ExprKind::Restrict { base, .. } => self.of(*base),
        }
    }

    /// Whether an expression is that of some seeds, named by their labels.
    fn chooses_here(&self, program: &Program, expr: &Expr) -> bool {
        let some = match &expr.kind {
            ExprKind::Pick { base, axis, .. } => program.is_seed(*axis).then_some(*base),
            ExprKind::Restrict { base, axis, places, .. } => {
                let is_part = places.len() < program.axis(*axis).coords.len();
                (program.is_seed(*axis) && is_part).then_some(*base)
            }
            _ => None,
        };
        some.is_some_and(|base| self.of(base).varies)
    }

    /// Whether a value rests on seeds that are chosen by their labels. As [`Self::loses_seeds`].
    pub(super) fn chooses_seeds(&self, id: ExprId) -> bool {
        self.of(id).chosen
    }

    /// Whether seeds vanish somewhere in what a value is made of, its own aside. It was asked for its seeds before, or
    /// what is made of it was.
    pub(super) fn loses_seeds(&self, id: ExprId) -> bool {
        self.of(id).loses
    }
}

impl Program {
    /// Whether an operation draws random numbers, or is given the seed to draw from.
    fn draws_here(&self, op: &Op) -> bool {
        let mut axes = op.args.values().flat_map(Desc::axes);
        op.stochastic || axes.any(|axis| self.is_seed(axis))
    }

    /// Whether seeds vanish in an expression itself.
    pub(super) fn loses_here(&self, expr: &Expr) -> bool {
        // One seed that is picked says nothing of the others, which is told otherwise.
        let picks = matches!(&expr.kind, ExprKind::Pick { .. })
            || matches!(&expr.kind, ExprKind::Op(op) if op.name == "select");
        let inputs = || self.inputs(expr).into_iter();
        !picks && !self.has_seeds(expr) && inputs().any(|id| self.over_seeds(id))
    }

    /// Whether an expression has seeds, along an axis or inside.
    pub(super) fn has_seeds(&self, expr: &Expr) -> bool {
        expr.dims.iter().any(|dim| dim == SEED) || self.seed_in(&expr.axes).is_some()
    }

    /// Whether a value varies over seeds.
    pub(super) fn over_seeds(&self, id: ExprId) -> bool {
        self.has_seeds(self.expr(id))
    }

    pub(super) fn is_seed(&self, axis: AxisId) -> bool {
        self.axis(axis).role == AxisRole::Seed
    }

    /// The `seed` axis that a value varies over.
    pub(super) fn seed_of(&self, id: ExprId) -> Option<AxisId> {
        self.seed_in(&self.expr(id).axes)
    }

    /// How many seeds there are along the axis of a value.
    pub(super) fn n_axis_seeds(&self, id: ExprId) -> Option<usize> {
        self.seed_of(id).map(|seed| self.axis(seed).coords.len())
    }

    /// The `seed` axis among others.
    pub(super) fn seed_in(&self, axes: &BTreeSet<AxisId>) -> Option<AxisId> {
        axes.iter().copied().find(|axis| self.is_seed(*axis))
    }
}
