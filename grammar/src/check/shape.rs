//! Shapes of values, as far as declarations know them before anything runs.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use ivx_op::Shapes;

use super::Checker;
use crate::ir::{AxisId, ExprId, ExprKind, Feed, Known, Place};

/// Most values that rules and shapes look at in one program; what lies beyond is not known.
const MOST_VALUES: usize = 50_000_000;

/// The shapes that are known in a program.
#[derive(Default)]
pub(super) struct Table {
    /// Of each expression of which something is known.
    of: BTreeMap<ExprId, Arc<Known>>,
    /// Each once, for many places have the same.
    distinct: BTreeSet<Arc<Shapes>>,
    /// Values looked at so far.
    n_values: usize,
}

impl Table {
    /// The one copy of shapes.
    pub(super) fn one(&mut self, shapes: Shapes) -> Arc<Shapes> {
        if let Some(known) = self.distinct.get(&shapes) {
            return Arc::clone(known);
        }
        let shapes = Arc::new(shapes);
        self.distinct.insert(Arc::clone(&shapes));
        shapes
    }

    /// Notes what is known of an expression.
    pub(super) fn note(&mut self, id: ExprId, known: Option<Arc<Known>>) {
        self.of.extend(known.map(|known| (id, known)));
    }

    /// Gives a value the shapes of the one that it is.
    pub(super) fn same(&mut self, id: ExprId, other: ExprId) {
        self.note(id, self.of.get(&other).cloned());
    }

    /// What is known of expressions that `of` holds for.
    pub(super) fn known(self, of: impl Fn(ExprId) -> bool) -> BTreeMap<ExprId, Arc<Known>> {
        self.of.into_iter().filter(|(id, _)| of(*id)).collect()
    }

    /// Whether there is room to look at so many values at each of `n` places.
    pub(super) fn room(&mut self, n: usize, each: usize) -> bool {
        self.n_values = self.n_values.saturating_add(n.saturating_mul(each));
        self.n_values <= MOST_VALUES
    }
}

impl Checker<'_> {
    /// Gives a selection or a match the shapes of what it is made of. Operations have their own.
    pub(super) fn pass_shapes(&mut self, id: ExprId) {
        if self.shapes.of.is_empty() {
            return;
        }
        let of = |id: &ExprId| self.shapes.of.get(id).cloned();
        let known = match &self.program.expr(id).kind {
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
            ExprKind::Match { axis, .. } if self.axes.are_any(*axis) => None,
            ExprKind::Match { axis, arms } => {
                let axis = *axis;
                let arms: Vec<Option<Arc<Known>>> = arms.iter().map(of).collect();
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
        known: Arc<Known>,
        axis: AxisId,
        other: Option<AxisId>,
        back: impl Fn(&mut Place),
    ) -> Option<Arc<Known>> {
        if !known.axes().any(|own| own == axis) {
            return Some(known);
        }
        let axes = known.axes().filter(|own| *own != axis).chain(other).collect();
        self.known_over(&axes, |mut place| {
            back(&mut place);
            known.at(&place).cloned()
        })
    }

    fn arms_shapes(&mut self, axis: AxisId, arms: &[Option<Arc<Known>>]) -> Option<Arc<Known>> {
        if arms.iter().all(Option::is_none) {
            return None;
        }
        let own = arms.iter().flatten().flat_map(|arm| arm.axes());
        let axes = own.chain([axis]).collect();
        self.known_over(&axes, |place| arms[place[&axis]].as_ref()?.at(&place).cloned())
    }

    /// Gives the field of a record what is known of it: shapes that are called by its name and theirs, `agent.sees`.
    pub(super) fn field_shapes(&mut self, id: ExprId, record: ExprId, field: &str) {
        let Some(known) = self.shapes.of.get(&record).cloned() else { return };
        let axes = known.axes().collect();
        let of_field = self.known_over(&axes, |place| {
            let own = known.at(&place)?.iter().filter_map(|(name, shape)| {
                let (owner, name) = name.split_once('.')?;
                (owner == field).then(|| (name.to_owned(), shape.clone()))
            });
            let own: Shapes = own.collect();
            (!own.is_empty()).then(|| Arc::new(own))
        });
        self.shapes.note(id, of_field);
    }

    /// The shapes that all have of which one run sees, at every place of the operation.
    pub(super) fn fed_shapes(&mut self, feed: &Feed) -> Option<Arc<Known>> {
        let known = self.shapes.of.get(&feed.expr).cloned()?;
        let seen = |axis: &AxisId| feed.gathered.contains(axis);
        let (seen, axes): (BTreeSet<_>, BTreeSet<_>) = known.axes().partition(seen);
        if seen.is_empty() {
            return Some(known);
        }
        let inside: Vec<Place> = self.program.places(&seen).collect();
        if !self.shapes.room(self.program.extent(&axes), inside.len()) {
            return None;
        }
        self.known_over(&axes, |place| {
            let mut all = inside.iter().map(|inside| {
                let mut place = place.clone();
                place.extend(inside);
                known.at(&place)
            });
            let first = all.next()??;
            all.all(|other| other == Some(first)).then(|| Arc::clone(first))
        })
    }

    /// What `at` says at every place on some axes.
    fn known_over(
        &mut self,
        axes: &BTreeSet<AxisId>,
        at: impl FnMut(Place) -> Option<Arc<Shapes>>,
    ) -> Option<Arc<Known>> {
        if !self.shapes.room(self.program.extent(axes), 1 + axes.len()) {
            return None;
        }
        Known::new(self.program.sized(axes), self.program.places(axes).map(at).collect())
    }
}

#[cfg(test)]
mod tests;
