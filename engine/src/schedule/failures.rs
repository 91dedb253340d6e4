//! What becomes of nodes that fail, of those that need them, and of those whose bytes are gone.

use ivx_op::{Artifact as _, Verdict};
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

    /// Runs again what a node takes and has no bytes any more, and then the node.
    pub(super) fn lacks(&mut self, node: NodeIndex, inputs: Vec<NodeIndex>) {
        if let Some(cause) = inputs.iter().find_map(|input| self.lost(*input)) {
            self.skip(vec![node], cause);
            return;
        }
        self.waiting[node.index()] += inputs.len();
        for input in inputs {
            self.force(input, Some(node));
        }
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
        let mut ready = Vec::new();
        let stranded = self.stranded(node, &mut ready);
        self.skip_all(stranded, node, &mut ready);
        self.go_on(ready);
    }

    /// Skips some nodes, and what needs them.
    pub(super) fn skip(&mut self, todo: Vec<NodeIndex>, cause: NodeIndex) {
        let mut ready = Vec::new();
        self.skip_all(todo, cause, &mut ready);
        self.go_on(ready);
    }

    fn skip_all(&mut self, mut todo: Vec<NodeIndex>, cause: NodeIndex, ready: &mut Vec<NodeIndex>) {
        while let Some(node) = todo.pop() {
            // A known node whose bytes are gone is as good as one that never ran.
            let known = matches!(self.nodes[node.index()].fate, Fate::Hit | Fate::Ran { .. });
            if self.lost(node).is_none() && (!known || self.forced.contains_key(&node)) {
                self.end(node, Fate::Skipped { cause });
                let (address, cause) = (&self.step(node).address, &self.step(cause).address);
                self.listen.event(Event::Skipped { address, cause });
                let stranded = self.stranded(node, ready);
                todo.extend(stranded);
            }
        }
    }

    /// Those that wait for a node which will not end, and cannot do without it. Of those that can, the ones that
    /// wait for nothing else are `ready`.
    fn stranded(&mut self, node: NodeIndex, ready: &mut Vec<NodeIndex>) -> Vec<NodeIndex> {
        let mut stranded = self.forced.remove(&node).unwrap_or_default();
        let (plan, registry) = (self.plan, self.registry);
        // What was known once counts as known, and its bytes are waited for.
        let never_known = self.nodes[node.index()].output.is_none();
        for next in plan.graph.neighbors(node) {
            if never_known && plan.graph[next].spares(registry, node) {
                self.waiting[next.index()] -= 1;
                if self.waiting[next.index()] == 0 {
                    ready.push(next);
                }
            } else {
                stranded.push(next);
            }
        }
        stranded
    }

    /// Looks nodes up that wait for nothing any more, and lack some of what they take. One that lacks all of it is
    /// skipped, unless it is to judge that.
    fn go_on(&mut self, mut ready: Vec<NodeIndex>) {
        while let Some(node) = ready.pop() {
            let inputs = || self.step(node).sources().filter_map(|source| source.node());
            let there = |node: NodeIndex| self.nodes[node.index()].output.is_some();
            let judges = self.registry.results_in(&self.step(node).op, Verdict::KIND);
            match inputs().find_map(|input| self.lost(input)) {
                Some(cause) if !judges && !inputs().any(there) => {
                    self.skip_all(vec![node], cause, &mut ready);
                }
                _ if self.lost(node).is_none() => self.resolve(vec![node]),
                _ => {}
            }
        }
    }
}
