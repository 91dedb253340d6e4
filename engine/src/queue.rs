//! Which node starts next: the longest path first, of those that the machine has room for.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use ivx_op::Needs;
use petgraph::graph::NodeIndex;

/// So many nodes that come later start before one that there is no room for; then room is made
/// for it.
const PATIENCE: usize = 16;
/// So many nodes are looked at for one that there is room for.
const LOOK: usize = 64;

/// The nodes that could run, and the room that there is.
#[derive(Debug)]
pub(crate) struct Queue {
    /// What may be in use at once.
    limits: Needs,
    /// What is in use.
    used: Needs,
    running: usize,
    waiting: BinaryHeap<Waiting>,
    /// The first in turn that there was no room for, and how many have started before it since.
    large: Option<(Waiting, usize)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Waiting {
    priority: u64,
    node: Reverse<NodeIndex>,
    needs: Needs,
}

/// A node that may start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Start {
    /// Which.
    pub(crate) node: NodeIndex,
    /// What it takes until [`Queue::end`].
    pub(crate) needs: Needs,
    /// Whether that is more than there is, so that it runs alone.
    pub(crate) alone: bool,
}

impl Queue {
    /// An empty queue for so many threads and so much memory.
    pub(crate) fn new(limits: Needs) -> Self {
        let used = Needs { threads: 0, memory: 0 };
        Self { limits, used, running: 0, waiting: BinaryHeap::new(), large: None }
    }

    /// Adds a node; the highest priority starts first, and of equal ones the first node.
    pub(crate) fn push(&mut self, node: NodeIndex, priority: u64, needs: Needs) {
        self.waiting.push(Waiting { priority, node: Reverse(node), needs });
    }

    /// Changes what may be in use at once.
    pub(crate) fn limit(&mut self, limits: Needs) {
        self.limits = limits;
    }

    /// Takes all nodes that wait, in no order.
    pub(crate) fn drain(&mut self) -> Vec<NodeIndex> {
        let large = self.large.take().map(|(large, _)| large);
        self.waiting.drain().chain(large).map(|waiting| waiting.node.0).collect()
    }

    /// How many nodes wait.
    pub(crate) fn len(&self) -> usize {
        self.waiting.len() + usize::from(self.large.is_some())
    }

    /// How many starts have not ended.
    pub(crate) fn running(&self) -> usize {
        self.running
    }

    /// The node to start now. If nothing runs, there is one unless none waits.
    pub(crate) fn next(&mut self) -> Option<Start> {
        if self.used.threads >= self.limits.threads {
            return None;
        }
        if let Some((large, overtaken)) = self.large {
            if self.has_room(large.needs) {
                self.large = None;
                return Some(self.start(large));
            }
            if overtaken >= PATIENCE {
                return None;
            }
        }
        let (mut aside, mut found) = (Vec::new(), None);
        while found.is_none() && aside.len() < LOOK {
            let Some(waiting) = self.waiting.pop() else { break };
            if self.has_room(waiting.needs) {
                found = Some(waiting);
            } else if self.large.is_none() {
                self.large = Some((waiting, 0));
            } else {
                aside.push(waiting);
            }
        }
        self.waiting.extend(aside);
        let found = found?;
        if let Some((_, overtaken)) = &mut self.large {
            *overtaken += 1;
        }
        Some(self.start(found))
    }

    /// Another node for a start of one thread and no memory, if the next in turn is like that
    /// and `wanted`.
    pub(crate) fn another(&mut self, wanted: impl Fn(NodeIndex) -> bool) -> Option<NodeIndex> {
        let next = self.waiting.peek()?;
        let fits = next.needs == Needs::default() && wanted(next.node.0);
        if fits { self.waiting.pop().map(|next| next.node.0) } else { None }
    }

    /// Counts a start twice: what began together ends apart.
    pub(crate) fn also(&mut self, needs: Needs) {
        self.running += 1;
        self.used.threads += needs.threads;
        self.used.memory += needs.memory;
    }

    /// Gives back what a start took.
    pub(crate) fn end(&mut self, needs: Needs) {
        self.running -= 1;
        self.used.threads -= needs.threads;
        self.used.memory -= needs.memory;
    }

    fn has_room(&self, needs: Needs) -> bool {
        let memory = self.used.memory.saturating_add(needs.memory);
        let threads = self.used.threads.saturating_add(needs.threads);
        self.running == 0 || (threads <= self.limits.threads && memory <= self.limits.memory)
    }

    fn start(&mut self, Waiting { node, needs, .. }: Waiting) -> Start {
        self.also(needs);
        let alone = needs.threads > self.limits.threads || needs.memory > self.limits.memory;
        Start { node: node.0, needs, alone }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Needs = Needs { threads: 4, memory: 100 };
    const NOBODY: [usize; 0] = [];

    /// A queue of nodes 0, 1, .. with priorities that fall.
    fn queue(needs: &[(usize, u64)]) -> Queue {
        let mut queue = Queue::new(LIMITS);
        for (i, &(threads, memory)) in needs.iter().enumerate() {
            queue.push(NodeIndex::new(i), 1000 - i as u64, Needs { threads, memory });
        }
        queue
    }

    fn started(queue: &mut Queue) -> Vec<usize> {
        std::iter::from_fn(|| queue.next()).map(|start| start.node.index()).collect()
    }

    fn end(queue: &mut Queue, threads: usize, memory: u64) -> Vec<usize> {
        queue.end(Needs { threads, memory });
        started(queue)
    }

    #[test]
    fn the_highest_priority_starts_first_and_of_equal_ones_the_first_node() {
        let mut queue = Queue::new(LIMITS);
        for (node, priority) in [(0, 1), (1, 5), (2, 5), (3, 9)] {
            queue.push(NodeIndex::new(node), priority, Needs::default());
        }
        assert_eq!(started(&mut queue), [3, 1, 2, 0]);
    }

    #[test]
    fn what_is_in_use_never_exceeds_what_there_is() {
        let mut queue = queue(&[(2, 60), (1, 50), (1, 40), (1, 0), (1, 0)]);
        // Node 1 lacks memory; after nodes 2 and 3 all threads are taken.
        assert_eq!(started(&mut queue), [0, 2, 3]);
        assert_eq!(end(&mut queue, 1, 40), [4]);
        assert_eq!(end(&mut queue, 2, 60), [1]);
        assert_eq!((queue.len(), queue.running()), (0, 3));
    }

    #[test]
    fn more_than_there_is_runs_alone() {
        let mut queue = queue(&[(1, 10), (9, 0), (1, 101), (1, 0)]);
        assert_eq!(started(&mut queue), [0, 3]);
        assert_eq!(end(&mut queue, 1, 10), NOBODY);
        queue.end(Needs::default());
        let start = queue.next();
        assert_eq!(start.map(|start| (start.node.index(), start.alone)), Some((1, true)));
        assert_eq!(started(&mut queue), NOBODY);
        assert_eq!(end(&mut queue, 9, 0), [2]);
        queue.push(NodeIndex::new(4), 0, Needs::default());
        assert_eq!(started(&mut queue), NOBODY, "not even what needs next to nothing");
        assert_eq!(end(&mut queue, 1, 101), [4]);
    }

    #[test]
    fn small_nodes_do_not_hold_a_large_one_up_for_ever() {
        let mut needs = vec![(1, 0), (4, 0)];
        needs.extend([(1, 0); 100]);
        let mut queue = queue(&needs);
        let (mut order, mut running) = (started(&mut queue), 4);
        while !order.contains(&1) {
            running -= 1;
            let next = end(&mut queue, 1, 0);
            running += next.len();
            order.extend(next);
        }
        assert_eq!((order.len(), running), (1 + PATIENCE + 1, 1));
    }

    #[test]
    fn only_light_nodes_that_are_next_in_turn_go_along() {
        let mut queue = queue(&[(1, 0), (1, 0), (2, 0), (1, 0)]);
        assert_eq!(queue.next().map(|start| start.node.index()), Some(0));
        assert_eq!(queue.another(|_| false), None);
        assert_eq!(queue.another(|_| true), Some(NodeIndex::new(1)));
        assert_eq!(queue.another(|_| true), None);
        assert_eq!((queue.len(), queue.running()), (2, 1));
    }
}
