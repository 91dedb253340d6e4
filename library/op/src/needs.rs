//! What running a node takes of the machine.

/// What running a node takes of the machine: it decides when the node runs, never what comes out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Needs {
    /// How many threads it keeps busy.
    pub threads: usize,
    /// How many bytes it has in memory at its peak, as far as they are worth counting.
    pub memory: u64,
}

impl Default for Needs {
    /// One thread, and no memory worth counting.
    fn default() -> Self {
        Self { threads: 1, memory: 0 }
    }
}
