//! Shapes of values, as far as declarations know them before anything runs.

use std::sync::Arc;

use ivx_op::Shapes;

use super::{AxisId, Place};

/// What is known of the shapes of one value.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    /// The axes along which they differ, by id, and how many coordinates each has.
    axes: Vec<(AxisId, usize)>,
    /// Those at every place on these axes, last axis fastest.
    at: Vec<Option<Arc<Shapes>>>,
}

impl Known {
    /// What is known at every place on some axes; none if that is nothing.
    ///
    /// Axes along which nothing differs are left out, so that what follows costs no more than what there
    /// is to tell apart.
    pub(crate) fn new(
        mut axes: Vec<(AxisId, usize)>,
        mut at: Vec<Option<Arc<Shapes>>>,
    ) -> Option<Arc<Self>> {
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
        Some(Arc::new(Self { axes, at }))
    }

    /// The axes along which they differ.
    pub(crate) fn axes(&self) -> impl Iterator<Item = AxisId> {
        self.axes.iter().map(|(axis, _)| *axis)
    }

    /// The shapes at a place that names a coordinate for each of these axes.
    ///
    /// # Panics
    /// If it does not.
    #[must_use]
    pub fn at(&self, place: &Place) -> Option<&Arc<Shapes>> {
        let index = self.axes.iter().fold(0, |index, (axis, n)| index * n + place[axis]);
        self.at[index].as_ref()
    }
}
