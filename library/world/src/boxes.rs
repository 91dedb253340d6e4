//! Two boxes of marbles.

use ivx_op::declare;

use super::{Belief, Problem};

declare! {
    /// A choice between two boxes of marbles (Example 2.1).
    pub struct Boxes = "boxes" @ 1 {
        /// The belief about what the left box pays.
        left: Box<dyn Belief>;
        /// The belief about what the right box pays.
        right: Box<dyn Belief>;
    }
}

impl Problem for Boxes {
    fn actions(&self) -> Vec<(&'static str, &dyn Belief)> {
        vec![("LEFT", self.left.as_ref()), ("RIGHT", self.right.as_ref())]
    }
}
