//! Which axes there are: those declared, and those made of others.

use std::collections::BTreeMap;

use super::program::Program;
use crate::ir::{Axis, AxisId, Groups};

/// The axes of a program, by what they are made of.
#[derive(Default)]
pub(super) struct Axes {
    /// By declaration; `None` for a faulty one.
    declared: BTreeMap<(usize, String), Option<AxisId>>,
    /// Those of members, by their number.
    members: BTreeMap<i64, AxisId>,
    /// Restricted ones, by the axis and the places kept.
    restricted: BTreeMap<(AxisId, Vec<usize>), AxisId>,
    /// The axes that restricted ones are some coordinates of.
    wholes: BTreeMap<AxisId, AxisId>,
    /// Groups of coordinates, by the axis and its field.
    groups: BTreeMap<(AxisId, String), Groups>,
    /// The seeds of what no experiment uses: which there are is not known.
    any_seed: Option<AxisId>,
}

impl Axes {
    /// The axis that a scope declares by a name, if it was looked at and is sound.
    pub(super) fn declared(&self, scope: usize, name: &str) -> Option<AxisId> {
        self.declared.get(&(scope, name.to_owned())).copied().flatten()
    }

    /// Whether such an axis was looked at and is faulty, which was reported.
    pub(super) fn is_faulty(&self, scope: usize, name: &str) -> bool {
        self.declared.get(&(scope, name.to_owned())) == Some(&None)
    }

    /// The scope that declares an axis.
    pub(super) fn declared_in(&self, axis: AxisId) -> Option<usize> {
        let found = self.declared.iter().find(|(_, own)| **own == Some(axis));
        found.map(|((scope, _), _)| *scope)
    }

    pub(super) fn declare(&mut self, scope: usize, name: &str, axis: Option<AxisId>) {
        self.declared.insert((scope, name.to_owned()), axis);
    }

    /// The axis of an ensemble with so many members.
    pub(super) fn of_members(&self, n: i64) -> Option<AxisId> {
        self.members.get(&n).copied()
    }

    pub(super) fn set_of_members(&mut self, n: i64, axis: AxisId) {
        self.members.insert(n, axis);
    }

    /// The axis that has only some coordinates of another.
    pub(super) fn restricted(
        &mut self,
        program: &mut Program,
        axis: AxisId,
        places: &[usize],
    ) -> AxisId {
        if let Some(known) = self.restricted.get(&(axis, places.to_vec())) {
            return *known;
        }
        let Axis { name, role, coords } = program.axis(axis);
        let coords = places.iter().map(|&place| coords[place].clone()).collect();
        let (name, role) = (name.clone(), *role);
        let id = program.push_axis(Axis { name, role, coords });
        self.restricted.insert((axis, places.to_vec()), id);
        self.wholes.insert(id, self.whole(axis));
        id
    }

    /// The axis as it is declared that an axis is, or has some coordinates of.
    pub(super) fn whole(&self, axis: AxisId) -> AxisId {
        self.wholes.get(&axis).copied().unwrap_or(axis)
    }

    /// The groups that the values of a field make of the coordinates of an axis, where they were made.
    pub(super) fn groups(&self, axis: AxisId, field: &str) -> Option<&Groups> {
        self.groups.get(&(axis, field.to_owned()))
    }

    pub(super) fn set_groups(&mut self, field: &str, groups: Groups) {
        self.groups.insert((groups.axis, field.to_owned()), groups);
    }

    /// Whether an axis is that of seeds of which is not known which there are.
    pub(super) fn are_any(&self, axis: AxisId) -> bool {
        self.any_seed == Some(axis)
    }

    pub(super) fn set_any_seed(&mut self, axis: AxisId) {
        self.any_seed = Some(axis);
    }
}
