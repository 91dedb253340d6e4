//! What becomes of nodes that fail, of those that need them, and of those whose bytes are gone.

use petgraph::graph::NodeIndex;

use super::Run;
use crate::event::Event;
use crate::key::explain;
use crate::outcome::Fate;

impl Run<'_> {
    /// Runs a known node again, since its bytes are gone.
    pub(super) fn force(&mut self, node: NodeIndex, waiter: Option<NodeIndex>) {
        if !self.forced.contains_key(&node) {
            let what = format!("the bytes of {} are gone: it runs again", self.step(node).address);
            self.listen.event(Event::Noted { what });
            self.queue.push(node, u64::MAX, self.needs(node));
        }
        self.forced.entry(node).or_default().extend(waiter);
    }

    /// Notes how a node ended.
    pub(super) fn end(&mut self, node: NodeIndex, fate: Fate) {
        if self.nodes[node.index()].fate == Fate::Waiting {
            self.durations.ended(node);
        }
        self.nodes[node.index()].fate = fate;
    }

    /// The node that failed, if this one has no bytes because of it.
    pub(super) fn lost(&self, node: NodeIndex) -> Option<NodeIndex> {
        match self.nodes[node.index()].fate {
            Fate::Failed { .. } => Some(node),
            Fate::Skipped { cause } => Some(cause),
            Fate::Waiting | Fate::Hit | Fate::Ran { .. } => None,
        }
    }

    /// Notes a failure, and skips what depends on it.
    pub(super) fn fail(&mut self, node: NodeIndex, why: &str) {
        self.listen.event(Event::Failed { address: &self.step(node).address, why });
        self.end(node, Fate::Failed { why: why.to_owned() });
        let explanation = explain(self.step(node), self.registry, |source| self.digest(source));
        self.nodes[node.index()].explanation = Some(explanation);
        self.stopped |= self.options.fail_fast;
        let stranded = self.stranded(node);
        self.skip(stranded, node);
    }

    /// Skips some nodes, and what needs them.
    pub(super) fn skip(&mut self, mut todo: Vec<NodeIndex>, cause: NodeIndex) {
        while let Some(node) = todo.pop() {
            // A known node whose bytes are gone is as good as one that never ran.
            let known = matches!(self.nodes[node.index()].fate, Fate::Hit | Fate::Ran { .. });
            if self.lost(node).is_none() && (!known || self.forced.contains_key(&node)) {
                self.end(node, Fate::Skipped { cause });
                let (address, cause) = (&self.step(node).address, &self.step(cause).address);
                self.listen.event(Event::Skipped { address, cause });
                todo.extend(self.stranded(node));
            }
        }
    }

    /// Those that wait for a node which will not end.
    pub(super) fn stranded(&mut self, node: NodeIndex) -> Vec<NodeIndex> {
        let waiters = self.forced.remove(&node).unwrap_or_default();
        self.plan.graph.neighbors(node).chain(waiters).collect()
    }
}
