//! Shapes of values, as far as declarations know them before anything runs.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use ivx_op::Shapes;

use super::Checker;
use crate::ir::{AxisId, ExprId, ExprKind, Feed, Place};

/// Most values that rules and shapes look at in one program; what lies beyond is not known.
const MOST_VALUES: usize = 50_000_000;

/// The shapes that are known in a program.
#[derive(Default)]
pub(super) struct Table {
    /// Of each expression of which something is known.
    of: BTreeMap<ExprId, Rc<Known>>,
    /// Each once, for many places have the same.
    distinct: BTreeSet<Rc<Shapes>>,
    /// Values looked at so far.
    n_values: usize,
}

impl Table {
    /// The one copy of shapes.
    pub(super) fn one(&mut self, shapes: Shapes) -> Rc<Shapes> {
        if let Some(known) = self.distinct.get(&shapes) {
            return Rc::clone(known);
        }
        let shapes = Rc::new(shapes);
        self.distinct.insert(Rc::clone(&shapes));
        shapes
    }

    /// Notes what is known of an expression.
    pub(super) fn note(&mut self, id: ExprId, known: Option<Rc<Known>>) {
        self.of.extend(known.map(|known| (id, known)));
    }

    /// Gives a value the shapes of the one that it is.
    pub(super) fn same(&mut self, id: ExprId, other: ExprId) {
        self.note(id, self.of.get(&other).cloned());
    }

    /// Whether there is room to look at so many values at each of `n` places.
    pub(super) fn room(&mut self, n: usize, each: usize) -> bool {
        self.n_values = self.n_values.saturating_add(n.saturating_mul(each));
        self.n_values <= MOST_VALUES
    }
}

/// What is known of the shapes of one value.
#[derive(Debug, PartialEq)]
pub(super) struct Known {
    /// The axes along which they differ, by id, and how many coordinates each has.
    axes: Vec<(AxisId, usize)>,
    /// Those at every place on these axes, last axis fastest.
    at: Vec<Option<Rc<Shapes>>>,
}

impl Known {
    /// What is known at every place on some axes; none if that is nothing.
    ///
    /// Axes along which nothing differs are left out, so that what follows costs no more than what there
    /// is to tell apart.
    pub(super) fn new(
        mut axes: Vec<(AxisId, usize)>,
        mut at: Vec<Option<Rc<Shapes>>>,
    ) -> Option<Rc<Self>> {
        if at.iter().all(Option::is_none) {
            return None;
        }
        let mut row = 1;
        for i in (0..axes.len()).rev() {
            let block = row * axes[i].1;
            let alike = |block: &[_]| block.chunks(row).all(|other| *other == block[..row]);
            if at.chunks(block).all(alike) {
                at = at.chunks(block).flat_map(|block| &block[..row]).cloned().collect();
                axes.remove(i);
            } else {
                row = block;
            }
        }
        Some(Rc::new(Self { axes, at }))
    }

    /// The axes along which they differ.
    pub(super) fn axes(&self) -> impl Iterator<Item = AxisId> {
        self.axes.iter().map(|(axis, _)| *axis)
    }

    /// The shapes at a place that names a coordinate for each of these axes.
    pub(super) fn at(&self, place: &Place) -> Option<&Rc<Shapes>> {
        let index = self.axes.iter().fold(0, |index, (axis, n)| index * n + place[axis]);
        self.at[index].as_ref()
    }
}

impl Checker<'_> {
    /// Gives a selection or a match the shapes of what it is made of. Operations have their own.
    pub(super) fn pass_shapes(&mut self, id: ExprId) {
        if self.shapes.of.is_empty() {
            return;
        }
        let of = |id: &ExprId| self.shapes.of.get(id).cloned();
        let known = match &self.spec.expr(id).kind {
            ExprKind::Number(_) | ExprKind::Op(_) => None,
            ExprKind::Pick { base, axis, place } => {
                let (axis, coordinate) = (*axis, *place);
                of(base).and_then(|base| {
                    self.moved(base, axis, None, |place| {
                        place.insert(axis, coordinate);
                    })
                })
            }
            ExprKind::Restrict { base, axis, restricted, places } => {
                let (axis, restricted, places) = (*axis, *restricted, places.clone());
                of(base).and_then(|base| {
                    self.moved(base, axis, Some(restricted), |place| {
                        place.insert(axis, places[place[&restricted]]);
                    })
                })
            }
            // Which seeds there are is not known.
            ExprKind::Match { axis, .. } if self.any_seed == Some(*axis) => None,
            ExprKind::Match { axis, arms } => {
                let axis = *axis;
                let arms: Vec<Option<Rc<Known>>> = arms.iter().map(of).collect();
                self.arms_shapes(axis, &arms)
            }
        };
        self.shapes.note(id, known);
    }

    /// What is known of a value along other axes.
    ///
    /// - `axis`: the axis of it that goes.
    /// - `other`: the one that takes its place.
    /// - `back`: gives a place on the new axes its coordinate on the old one.
    fn moved(
        &mut self,
        known: Rc<Known>,
        axis: AxisId,
        other: Option<AxisId>,
        back: impl Fn(&mut Place),
    ) -> Option<Rc<Known>> {
        if !known.axes().any(|own| own == axis) {
            return Some(known);
        }
        let axes = known.axes().filter(|own| *own != axis).chain(other).collect();
        self.known_over(&axes, |mut place| {
            back(&mut place);
            known.at(&place).cloned()
        })
    }

    fn arms_shapes(&mut self, axis: AxisId, arms: &[Option<Rc<Known>>]) -> Option<Rc<Known>> {
        if arms.iter().all(Option::is_none) {
            return None;
        }
        let own = arms.iter().flatten().flat_map(|arm| arm.axes());
        let axes = own.chain([axis]).collect();
        self.known_over(&axes, |place| arms[place[&axis]].as_ref()?.at(&place).cloned())
    }

    /// The shapes that all have of which one run sees, at every place of the operation.
    pub(super) fn fed_shapes(&mut self, feed: &Feed) -> Option<Rc<Known>> {
        let known = self.shapes.of.get(&feed.expr).cloned()?;
        let seen = |axis: &AxisId| feed.gathered.contains(axis);
        let (seen, axes): (BTreeSet<_>, BTreeSet<_>) = known.axes().partition(seen);
        if seen.is_empty() {
            return Some(known);
        }
        let inside: Vec<Place> = self.places(&seen).collect();
        if !self.shapes.room(self.extent(&axes), inside.len()) {
            return None;
        }
        self.known_over(&axes, |place| {
            let mut all = inside.iter().map(|inside| {
                let mut place = place.clone();
                place.extend(inside);
                known.at(&place)
            });
            let first = all.next()??;
            all.all(|other| other == Some(first)).then(|| Rc::clone(first))
        })
    }

    /// What `at` says at every place on some axes.
    fn known_over(
        &mut self,
        axes: &BTreeSet<AxisId>,
        at: impl FnMut(Place) -> Option<Rc<Shapes>>,
    ) -> Option<Rc<Known>> {
        if !self.shapes.room(self.extent(axes), 1 + axes.len()) {
            return None;
        }
        Known::new(self.sized(axes), self.places(axes).map(at).collect())
    }

    /// Axes, and how many coordinates each has.
    pub(super) fn sized(&self, axes: &BTreeSet<AxisId>) -> Vec<(AxisId, usize)> {
        axes.iter().map(|axis| (*axis, self.spec.axis(*axis).coords.len())).collect()
    }
}

#[cfg(test)]
mod tests;
