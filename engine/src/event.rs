//! What happens during a run, told to whoever listens.

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Event<'a> {
    /// The run has so many nodes.
    Planned {
        /// How many.
        nodes: usize,
    },
    /// A node's result was known.
    Hit {
        /// The node.
        address: &'a str,
    },
    /// A node began to run.
    Started {
        /// The node.
        address: &'a str,
        /// How long it is expected to take, where that is known.
        expected_millis: Option<u64>,
    },
    /// A node is under way.
    Told {
        /// The node.
        address: &'a str,
        /// How many of its steps are done.
        done: u64,
        /// How many there are.
        of: u64,
        /// How it goes, such as `loss 0.31`; may be empty.
        words: &'a str,
        /// How long what is left is expected to take on one core, where that is known.
        left_millis: Option<u64>,
    },
    /// A node has its result.
    Finished {
        /// The node.
        address: &'a str,
        /// How long it took.
        millis: u64,
        /// How long what is left is expected to take on one core, where that is known.
        left_millis: Option<u64>,
    },
    /// A node has no result.
    Failed {
        /// The node.
        address: &'a str,
        /// Why.
        why: &'a str,
    },
    /// A node was not run, because of another.
    Skipped {
        /// The node.
        address: &'a str,
        /// The node that failed.
        cause: &'a str,
    },
    /// Other machines run nodes, on so many threads by now.
    Room {
        /// How many.
        threads: usize,
    },
    /// Something was wrong and was mended.
    Noted {
        /// What.
        what: String,
    },
}

/// Listens to a run.
pub trait Listen {
    /// Something happened.
    fn event(&mut self, event: Event<'_>);
}

/// Listens to nothing.
pub struct Silence;

impl Listen for Silence {
    fn event(&mut self, _: Event<'_>) {}
}
