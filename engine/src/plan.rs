//! The graph to run: plain data, one node a computation.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use ivx_grammar::ir::ExprId;
use ivx_op::{ArgKind, Args, Dim, Needs, Registry, Shapes};
use petgraph::graph::{DiGraph, NodeIndex};
use serde::{Deserialize, Serialize};

/// A program as a graph, from inputs to users; the weight of an edge is nothing.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// The nodes. Every input of a node has a smaller index.
    pub graph: DiGraph<Step, ()>,
    /// The nodes of each output of the spec.
    pub outputs: BTreeMap<ExprId, Family>,
    /// The other addresses of nodes that equal ones were merged with.
    pub aliases: BTreeMap<String, NodeIndex>,
}

/// One computation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// What it is called, for people: `overoptimisation/model[seed=0]/member[3]`.
    pub address: String,
    /// The operation.
    pub op: String,
    /// Its descriptions, complete, without numbers of members.
    pub args: Args,
    /// What the parts in its descriptions hold, by slot.
    pub held: Vec<Fed>,
    /// Its artifacts, in the order of declaration.
    pub ports: Vec<(String, Vec<Fed>)>,
    /// What makes its random numbers, where it draws any.
    pub draw: Option<Draw>,
    /// The shapes of its result, where they are known.
    #[serde(skip)]
    pub shapes: Option<Arc<Shapes>>,
}

/// What makes the random numbers of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Draw {
    /// The value of the `seed` axis; 0 without one.
    pub seed: i64,
    /// Which member of an ensemble the step belongs to.
    pub member: Option<u64>,
}

/// What one port takes: values over the axes it gathers, last axis fastest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fed {
    /// The axes.
    pub dims: Vec<Dim>,
    /// The values.
    pub sources: Vec<Source>,
    /// Whether names and labels travel, and so belong to the key.
    pub labelled: bool,
    /// What the spec calls the value; empty where labels do not travel.
    pub name: String,
}

/// Where a value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Source {
    /// A node.
    Node(NodeIndex),
    /// A number written in the spec.
    Number(f64),
}

/// The values of an expression over the axes it varies over, last axis fastest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Family {
    /// The axes, by name, with their labels in the order declared.
    pub dims: Vec<Dim>,
    /// The values.
    pub sources: Vec<Source>,
}

impl Source {
    /// The node, if it is one.
    #[must_use]
    pub fn node(&self) -> Option<NodeIndex> {
        match self {
            Self::Node(node) => Some(*node),
            Self::Number(_) => None,
        }
    }
}

impl Step {
    /// What running it takes, of inputs of so many bytes; `plan` is what it is a step of.
    #[must_use]
    pub fn needs(&self, plan: &Plan, registry: &Registry, input_bytes: u64) -> Needs {
        let held = |slot: usize| {
            let node = self.held.get(slot)?.sources.first()?.node()?;
            plan.graph[node].shapes.clone()
        };
        let mut args = Cow::Borrowed(&self.args);
        if !self.held.is_empty() {
            args.to_mut().values_mut().for_each(|arg| arg.foresee(&held));
        }
        let needs = registry.needs(&self.op, &args, self.shapes.as_deref(), input_bytes);
        Needs { threads: needs.threads.max(1), ..needs }
    }

    /// Whether it can run without the result of `node`: all that it takes of it are numbers, which may be missing there.
    #[must_use]
    pub fn spares(&self, registry: &Registry, node: NodeIndex) -> bool {
        let decl = registry.decl(&self.op);
        let takes = |feds: &[Fed]| {
            feds.iter().any(|fed| fed.sources.iter().any(|source| source.node() == Some(node)))
        };
        let spares = |port: &str| {
            let arg = decl.and_then(|decl| decl.arg(port));
            matches!(arg.map(|arg| &arg.kind), Some(ArgKind::Port(port)) if port.takes_missing(&self.args))
        };
        !takes(&self.held) && self.ports.iter().all(|(port, feds)| !takes(feds) || spares(port))
    }

    /// The sources of what is held and of all ports, in order.
    pub fn sources(&self) -> impl Iterator<Item = Source> {
        let feds = self.held.iter().chain(self.ports.iter().flat_map(|(_, feds)| feds));
        feds.flat_map(|fed| fed.sources.iter().copied())
    }

    /// The same, to be changed.
    pub(crate) fn sources_mut(&mut self) -> impl Iterator<Item = &mut Source> {
        let feds = self.held.iter_mut().chain(self.ports.iter_mut().flat_map(|(_, feds)| feds));
        feds.flat_map(|fed| &mut fed.sources)
    }
}
