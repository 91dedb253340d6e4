//! The nodes of an experiment by what the spec calls them: who feeds whom, and what became of them.

use std::collections::{BTreeMap, BTreeSet};

use petgraph::Direction;

use crate::address::{parts, stem};
use crate::outcome::{Fate, Outcome};
use crate::plan::Plan;

/// All nodes of one name.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Group {
    /// What the spec calls it; with its experiment where that is another.
    pub(super) name: String,
    /// Its operation, or several.
    pub(super) ops: BTreeSet<String>,
    pub(super) n_nodes: usize,
    pub(super) n_hit: usize,
    pub(super) n_ran: usize,
    pub(super) n_failed: usize,
    /// How long those that ran took together.
    pub(super) millis: u64,
    /// The places of the groups that feed it.
    pub(super) fed_by: BTreeSet<usize>,
    /// How many groups lie before it on the longest way to it.
    pub(super) layer: usize,
}

/// The groups of an experiment, and those of others that feed them, by layer.
pub(super) fn groups(experiment: &str, plan: &Plan, outcome: &Outcome) -> Vec<Group> {
    let own = format!("{experiment}/");
    let is_own = |address: &str| address.starts_with(&own);
    let mut shown = BTreeSet::new();
    for node in plan.graph.node_indices().filter(|n| is_own(&plan.graph[*n].address)) {
        shown.insert(node);
        shown.extend(plan.graph.neighbors_directed(node, Direction::Incoming));
    }
    let mut places: BTreeMap<String, usize> = BTreeMap::new();
    let mut groups: Vec<Group> = Vec::new();
    let mut depths = BTreeMap::new();
    // Every input of a node has a smaller index.
    for &node in &shown {
        let step = &plan.graph[node];
        let name = name(&step.address, experiment);
        let place = *places.entry(name.clone()).or_insert(groups.len());
        if place == groups.len() {
            groups.push(Group { name, ..Group::default() });
        }
        let mut depth = 0;
        if is_own(&step.address) {
            for input in plan.graph.neighbors_directed(node, Direction::Incoming) {
                let (from, below): (usize, usize) = depths[&input];
                let is_other = from != place;
                if is_other {
                    groups[place].fed_by.insert(from);
                }
                depth = depth.max(below + usize::from(is_other));
            }
        }
        depths.insert(node, (place, depth));
        let group = &mut groups[place];
        group.layer = group.layer.max(depth);
        group.ops.insert(step.op.clone());
        group.n_nodes += 1;
        match outcome.nodes.get(node.index()).map(|n| &n.fate) {
            Some(Fate::Hit) => group.n_hit += 1,
            Some(Fate::Ran { millis }) => {
                group.n_ran += 1;
                group.millis += millis;
            }
            Some(Fate::Failed { .. } | Fate::Skipped { .. }) => group.n_failed += 1,
            Some(Fate::Waiting) | None => {}
        }
    }
    groups
}

/// What the nodes of an address are called together: the name in the spec; claims go by that alone.
fn name(address: &str, experiment: &str) -> String {
    let parts = parts(address);
    let (of, name) = (parts[0], stem(parts.get(1).copied().unwrap_or_default()));
    if of != experiment {
        return format!("{of}.{name}");
    }
    if name.starts_with("claim ") { "claims".to_owned() } else { name.to_owned() }
}

#[cfg(test)]
mod tests {
    use ivx_op::Args;
    use petgraph::graph::NodeIndex;

    use super::*;
    use crate::outcome::Node;
    use crate::plan::Step;

    #[test]
    fn nodes_of_one_name_are_told_together() {
        let mut plan = Plan::default();
        let addresses = [
            "d/data[seed=0]",
            "d/data[seed=1]",
            "e/model[seed=0]/member[0]",
            "e/model[seed=1]/member[0]",
            "e/gap",
            "e/figure \"1.2\"/plot/curve",
            "e/figure \"1.2\"",
            "e/claim \"a/b less\"/sub",
        ];
        let ids: Vec<NodeIndex> = addresses
            .iter()
            .map(|address| {
                plan.graph.add_node(Step {
                    address: (*address).into(),
                    op: "op".into(),
                    args: Args::new(),
                    held: vec![],
                    ports: vec![],
                    draw: None,
                    shapes: None,
                })
            })
            .collect();
        for (a, b) in [(0, 2), (1, 3), (2, 4), (3, 4), (4, 5), (5, 6), (4, 7), (0, 7)] {
            plan.graph.add_edge(ids[a], ids[b], ());
        }
        let fates = [
            Fate::Hit,
            Fate::Hit,
            Fate::Ran { millis: 3 },
            Fate::Ran { millis: 4 },
            Fate::Failed { why: String::new() },
            Fate::Hit,
            Fate::Hit,
            Fate::Hit,
        ];
        let nodes = fates.into_iter().map(|fate| Node { fate, ..Node::default() }).collect();
        let found = groups("e", &plan, &Outcome { nodes, ..Outcome::default() });
        let told: Vec<(&str, usize, Vec<usize>)> = found
            .iter()
            .map(|g| (g.name.as_str(), g.layer, g.fed_by.iter().copied().collect()))
            .collect();
        assert_eq!(
            told,
            [
                ("d.data", 0, vec![]),
                ("model", 1, vec![0]),
                ("gap", 2, vec![1]),
                ("figure \"1.2\"", 3, vec![2]),
                ("claims", 3, vec![0, 2]),
            ]
        );
        assert_eq!(
            (found[1].n_ran, found[1].millis, found[0].n_hit, found[2].n_failed),
            (2, 7, 2, 1)
        );
    }
}
