//! The records nearest to nodes, and what differs from them.

use std::cell::OnceCell;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::time::SystemTime;

use ivx_cache::{Cache, CacheError, Digest, Objects, Record};
use ivx_op::Registry;
use petgraph::graph::NodeIndex;

use super::{Cause, Changed, Earlier, InputChange, Reason, Why};
use crate::address::{parts, stem};
use crate::difference::{Difference, Part, Replaced, compare, name};
use crate::explanation::{Explanation, Input};
use crate::foresee::{Foreseen, Known, known};
use crate::key::{number_digest, walk};
use crate::plan::{Plan, Source};
use crate::platform::platform;

/// So many comparisons are made for nodes of whose address there is no record, before those with
/// records of like names are compared with these only.
const MOST_COMPARISONS: usize = 2_000_000;

/// A record and what its explanation says.
struct Past<'c> {
    record: &'c Record,
    begun: Option<SystemTime>,
    read: OnceCell<Explanation>,
}

impl Past<'_> {
    fn explanation(&self) -> &Explanation {
        self.read.get_or_init(|| Explanation::of(&self.record.provenance.explanation))
    }
}

/// A node beside an earlier record, if there is one.
pub(super) type Pair = (NodeIndex, Option<usize>);

/// What differs between the two.
#[derive(Default)]
struct Compared {
    differences: Vec<Difference>,
    inputs: Vec<Link>,
}

/// An input that differs.
struct Link {
    port: String,
    node: Option<NodeIndex>,
    before: Option<String>,
    change: InputChange,
    /// What it is compared with in turn.
    pair: Option<Pair>,
    /// Whether what made it before is not known.
    is_lost: bool,
}

/// What is compared with what.
pub(super) struct Search<'a, 'c> {
    plan: &'a Plan,
    pub(super) known: Vec<Known<'c>>,
    platform: String,
    objects: Objects,
    past: Vec<Past<'c>>,
    by_op: BTreeMap<&'c str, Vec<usize>>,
    /// By operation and address, and by what is left of the address in [`names`].
    by_name: BTreeMap<(&'c str, &'c str), Vec<usize>>,
    by_output: BTreeMap<Digest, Vec<usize>>,
    /// The nodes whose outputs are known, by these.
    outputs: BTreeMap<Digest, NodeIndex>,
    here: Vec<OnceCell<Explanation>>,
    registry: &'a Registry,
    /// The nearest record of each node that was asked for.
    nearest: BTreeMap<NodeIndex, Option<usize>>,
    compared: BTreeMap<Pair, Compared>,
}

impl<'a, 'c> Search<'a, 'c> {
    pub(super) fn new(
        plan: &'a Plan,
        registry: &'a Registry,
        cache: &'c Cache,
    ) -> Result<Self, CacheError> {
        let written = cache.written()?;
        let known = known(plan, registry, cache);
        let output = |node: NodeIndex| Some((known[node.index()].record?.output.digest, node));
        let mut search = Self {
            plan,
            outputs: plan.graph.node_indices().filter_map(output).collect(),
            known,
            platform: platform(),
            objects: cache.objects(),
            past: Vec::new(),
            by_op: BTreeMap::new(),
            by_name: BTreeMap::new(),
            by_output: BTreeMap::new(),
            here: (0..plan.graph.node_count()).map(|_| OnceCell::new()).collect(),
            registry,
            nearest: BTreeMap::new(),
            compared: BTreeMap::new(),
        };
        for record in cache.records() {
            let i = search.past.len();
            let provenance = &record.provenance;
            let op = name(&provenance.op);
            search.by_op.entry(op).or_default().push(i);
            for own in names(&provenance.node) {
                search.by_name.entry((op, own)).or_default().push(i);
            }
            search.by_output.entry(record.output.digest).or_default().push(i);
            let begun = written.get(&(record.key, record.platform.clone())).copied();
            search.past.push(Past { record, begun, read: OnceCell::new() });
        }
        Ok(search)
    }

    /// What the walk of a node shows, as far as its inputs are known.
    fn here(&self, node: NodeIndex) -> &Explanation {
        self.here[node.index()].get_or_init(|| {
            let digest = |source: &Source| match source {
                Source::Number(x) => number_digest(*x).0.to_vec(),
                Source::Node(node) => {
                    let record = self.known[node.index()].record;
                    record.map_or_else(Vec::new, |record| record.output.digest.0.to_vec())
                }
            };
            let mut shown = Explanation::default();
            walk(&self.plan.graph[node], self.registry, digest, &mut shown);
            shown
        })
    }

    /// Finds the nearest record of some nodes, and of all that they wait for.
    pub(super) fn find_nearest(&mut self, nodes: &[NodeIndex]) {
        let mut wanted = BTreeSet::new();
        let mut todo = nodes.to_vec();
        while let Some(node) = todo.pop() {
            if self.known[node.index()].record.is_none() && wanted.insert(node) {
                todo.extend(self.plan.graph[node].sources().filter_map(|source| source.node()));
            }
        }
        let most = MOST_COMPARISONS / wanted.len().max(1);
        // Inputs have smaller indices, so that theirs are known first.
        for node in wanted {
            let step = &self.plan.graph[node];
            let of_op = self.by_op.get(step.op.as_str()).map(Vec::as_slice).unwrap_or_default();
            let of_name = |own| self.by_name.get(&(step.op.as_str(), own)).map(Vec::as_slice);
            let [address, inside, stem] = names(&step.address);
            let mut candidates = of_name(address).unwrap_or(of_op);
            if candidates.len() > most {
                candidates = of_name(inside).or_else(|| of_name(stem)).unwrap_or(of_op);
                candidates = &candidates[..candidates.len().min(most)];
            }
            let nearest = self.best(node, candidates);
            self.nearest.insert(node, nearest);
        }
    }

    /// The record nearest to a node.
    fn best(&self, node: NodeIndex, candidates: &[usize]) -> Option<usize> {
        candidates.iter().copied().min_by_key(|i| {
            let record = self.past[*i].record;
            let elsewhere = record.provenance.node != self.plan.graph[node].address;
            let foreign = record.platform != self.platform;
            let begun = Reverse((self.past[*i].begun, &record.provenance.node));
            (elsewhere, self.distance(node, *i), foreign, begun, *i)
        })
    }

    /// How many parts of a node's key differ from a record's. What an input that is not known
    /// was before is held against the record too.
    fn distance(&self, node: NodeIndex, past: usize) -> usize {
        let (own, replaced) = self.compare(node, past);
        let expected = |input: &Input| {
            let nearest = input.source?.node().and_then(|node| *self.nearest.get(&node)?)?;
            Some(self.past[nearest].record.output.digest)
        };
        let moved = |replaced: &Replaced<'_>| match (replaced.before, replaced.after) {
            (Some(before), Some(after)) if after.digest.is_none() => {
                1 + usize::from(expected(after) != before.digest)
            }
            _ => 2,
        };
        2 * own.len() + replaced.iter().map(moved).sum::<usize>()
    }

    fn compare(&self, node: NodeIndex, past: usize) -> (Vec<Difference>, Vec<Replaced<'_>>) {
        let made_at = |input: &Input| {
            let records = input.digest.and_then(|digest| self.by_output.get(&digest));
            records.into_iter().flatten().map(|i| self.past[*i].record.provenance.node.as_str())
        };
        let same = |before: &Input, after: &Input| match after.source {
            Some(Source::Node(node)) => {
                made_at(before).any(|address| address == self.plan.graph[node].address)
            }
            _ => before.number.is_some() && before.number == after.number,
        };
        compare(self.past[past].explanation(), self.here(node), &same)
    }

    /// Compares some nodes with their nearest records, and what differs there in turn.
    pub(super) fn compare_from(&mut self, nodes: &[NodeIndex]) {
        let mut todo: Vec<Pair> = nodes.iter().map(|node| (*node, self.nearest[node])).collect();
        while let Some(pair) = todo.pop() {
            if !self.compared.contains_key(&pair) {
                let compared = self.differences(pair);
                todo.extend(compared.inputs.iter().filter_map(|link| link.pair));
                self.compared.insert(pair, compared);
            }
        }
    }

    fn differences(&self, (node, past): Pair) -> Compared {
        let Some(past) = past else { return self.unrecorded(node) };
        let (mut differences, replaced) = self.compare(node, past);
        let mut inputs = Vec::new();
        for Replaced { port, before, after } in replaced {
            let after_node = after.and_then(|input| input.source?.node());
            if let (Some(before), Some(after)) = (before, after)
                && let Some(other) = self.other(before, after)
            {
                let part = Part::Input(format!("{}.{port}", self.plan.graph[node].op));
                let made = after_node.map(|node| self.plan.graph[node].address.clone());
                let after = made.or_else(|| after.number.clone());
                differences.push(Difference { part, before: Some(other), after });
                continue;
            }
            inputs.push(self.link(port, before, after_node));
        }
        if differences.is_empty() && inputs.is_empty() {
            let before = self.past[past].record.platform.clone();
            let after = self.known[node.index()].record.map(|record| record.platform.clone());
            differences.push(Difference { part: Part::Platform, before: Some(before), after });
        }
        Compared { differences, inputs }
    }

    /// What an input was, if it is none of the same that was made otherwise: a number was or is
    /// in its place, or a node that is in the plan as it was.
    fn other(&self, before: &Input, after: &Input) -> Option<String> {
        if let Some(number) = &before.number {
            return Some(number.clone());
        }
        let Some(node) = after.source.and_then(|source| source.node()) else {
            return Some(self.maker(before));
        };
        let digest = before.digest.filter(|_| self.known[node.index()].record.is_some())?;
        let own = &self.plan.graph[node].address;
        let made = self.by_output.get(&digest).into_iter().flatten();
        if made.clone().any(|i| self.past[*i].record.provenance.node == *own) {
            return None;
        }
        self.outputs.get(&digest).map(|node| self.plan.graph[*node].address.clone())
    }

    /// What a node of which there is no record waits for.
    fn unrecorded(&self, node: NodeIndex) -> Compared {
        let waits = |feed: &'_ (String, NodeIndex)| self.known[feed.1.index()].record.is_none();
        let inputs = self.here(node).feeds.iter().flat_map(|(port, feeds)| {
            let inputs = feeds.iter().flat_map(|feed| &feed.inputs);
            inputs.filter_map(move |input| Some((port.clone(), input.source?.node()?)))
        });
        let inputs = inputs.filter(waits).map(|(port, node)| self.link(&port, None, Some(node)));
        Compared { differences: Vec::new(), inputs: inputs.collect() }
    }

    fn link(&self, port: &str, before: Option<&Input>, after: Option<NodeIndex>) -> Link {
        let is_known = |node: NodeIndex| self.known[node.index()].record.is_some();
        let change = match (before, after) {
            (_, None) => InputChange::Removed,
            (_, Some(node)) if !is_known(node) => InputChange::Unknown,
            (None, _) => InputChange::Added,
            (Some(_), _) => InputChange::Changed,
        };
        let producer = |node| self.producer(before?.digest?, node);
        let pair = match (change, after) {
            (InputChange::Unknown, Some(node)) => Some((node, self.nearest[&node])),
            (InputChange::Changed, Some(node)) => producer(node).map(|past| (node, Some(past))),
            _ => None,
        };
        let is_lost = change == InputChange::Changed && pair.is_none();
        let before = before.map(|input| self.maker(input));
        Link { port: port.to_owned(), node: after, before, change, pair, is_lost }
    }

    /// Where an input was made, for people.
    fn maker(&self, input: &Input) -> String {
        let made = input.digest.and_then(|digest| self.by_output.get(&digest)?.first());
        let made = made.map(|i| self.past[*i].record.provenance.node.clone());
        made.unwrap_or_else(|| "something that is not known any more".to_owned())
    }

    /// The record nearest to a node among those that made some bytes.
    fn producer(&self, output: Digest, node: NodeIndex) -> Option<usize> {
        let all = self.by_output.get(&output)?;
        let of_op =
            |i: &&usize| name(&self.past[**i].record.provenance.op) == self.plan.graph[node].op;
        let own: Vec<usize> = all.iter().filter(of_op).copied().collect();
        self.best(node, if own.is_empty() { all } else { &own })
    }

    /// Where the changes of each pair began, by what is different there.
    pub(super) fn causes(&self) -> BTreeMap<Pair, BTreeMap<String, Cause>> {
        let mut causes: BTreeMap<Pair, BTreeMap<String, Cause>> = BTreeMap::new();
        // In the order of indices, so that inputs come first.
        for (pair, compared) in &self.compared {
            let (node, past) = *pair;
            let mut own: BTreeMap<String, Cause> = BTreeMap::new();
            let mut note = |text: String, reason| {
                own.entry(text).or_insert(Cause { path: vec![node], reason });
            };
            let op = &self.plan.graph[node].op;
            if past.is_none() && compared.inputs.is_empty() {
                note(format!("new {op}"), Reason::New);
            }
            for difference in &compared.differences {
                note(difference.to_string(), Reason::Differs(difference.clone()));
            }
            if compared.inputs.iter().any(|link| link.is_lost) {
                note(format!("lost {op}"), Reason::Lost);
            }
            for pair in compared.inputs.iter().filter_map(|link| link.pair) {
                for (text, cause) in &causes[&pair] {
                    let path = || cause.path.iter().copied().chain([node]).collect();
                    let through = || Cause { path: path(), reason: cause.reason.clone() };
                    own.entry(text.clone()).or_insert_with(through);
                }
            }
            causes.insert(*pair, own);
        }
        causes
    }

    pub(super) fn why(
        &self,
        node: NodeIndex,
        causes: &BTreeMap<Pair, BTreeMap<String, Cause>>,
    ) -> Why<'c> {
        let Known { key, record } = self.known[node.index()];
        let foreseen = Foreseen::of(self.known[node.index()]);
        let nearest = self.nearest.get(&node).copied().flatten();
        let pair = (node, nearest);
        let own = record.and_then(|own| {
            let alike = &self.by_output[&own.output.digest];
            alike.iter().copied().find(|i| std::ptr::eq(self.past[*i].record, own))
        });
        let record = own.or(nearest).map(|i| {
            let Past { record, begun, .. } = self.past[i];
            Earlier { record, begun, gone: !self.objects.has(&record.output) }
        });
        let compared = self.compared.get(&pair);
        let inputs = compared.into_iter().flat_map(|compared| &compared.inputs).map(|link| {
            let all = link.pair.into_iter().flat_map(|pair| causes[&pair].values());
            let forward = |cause: &Cause| Cause {
                path: cause.path.iter().rev().copied().collect(),
                reason: cause.reason.clone(),
            };
            let mut causes: Vec<Cause> = all.map(forward).collect();
            if link.is_lost {
                causes.push(Cause { path: link.node.into_iter().collect(), reason: Reason::Lost });
            }
            let (port, before) = (link.port.clone(), link.before.clone());
            Changed { port, node: link.node, before, change: link.change, causes }
        });
        let inputs = inputs.collect();
        let differences = compared.map_or_else(Vec::new, |compared| compared.differences.clone());
        Why { node, foreseen, key, record, differences, inputs }
    }
}

/// An address, the same without its experiment, and that without coordinates.
fn names(address: &str) -> [&str; 3] {
    let inside = address.split_once('/').map_or(address, |(_, inside)| inside);
    let stem = parts(inside).first().map_or(inside, |part| stem(part));
    [address, inside, stem]
}
