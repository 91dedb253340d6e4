//! From a checked program to its graph.

use std::collections::BTreeMap;

use ivx_cache::Digest;
use ivx_grammar::ir::{
    AxisId, AxisRole, Coord, Desc, Expr, ExprId, ExprKind, Feed, Known, Op, Place, Spec,
};
use ivx_op::{ArgKind, Args, Dim, Held, Labels, Lit, Registry};
use petgraph::Direction::Incoming;
use petgraph::graph::{DiGraph, NodeIndex};

use crate::plan::{Draw, Family, Fed, Plan, Source, Step};
use crate::{address, key};

/// The graph of everything that the spec's outputs need. Equal computations are one node, and
/// an ensemble is one node a member.
///
/// # Panics
/// If the spec was not checked.
#[must_use]
pub fn expand(spec: &Spec, registry: &Registry) -> Plan {
    let orders: Vec<Vec<usize>> = spec.axes.iter().map(|axis| by_value(&axis.coords)).collect();
    let mut expansion = Expansion {
        spec,
        registry,
        plan: Plan::default(),
        addresses: BTreeMap::new(),
        known: BTreeMap::new(),
        identity: Vec::new(),
        ranks: orders.iter().map(|order| ranks(order)).collect(),
        orders,
    };
    let mut values: Vec<Option<Values>> = vec![None; spec.exprs.len()];
    let needed = needed(spec);
    for (i, id) in (0..).map(ExprId).take(spec.exprs.len()).enumerate().filter(|(i, _)| needed[*i])
    {
        values[i] = Some(expansion.values(id, &values));
    }
    for id in outputs(spec) {
        let values = values[id.0 as usize].as_ref().expect("outputs are needed");
        let family = expansion.family(values);
        expansion.plan.outputs.insert(id, family);
    }
    reached(expansion.plan)
}

fn outputs(spec: &Spec) -> impl Iterator<Item = ExprId> {
    spec.experiments.iter().flat_map(|experiment| {
        let groups = [&experiment.measures, &experiment.figures, &experiment.tables];
        let claims = experiment.claims.iter().map(|claim| &claim.output);
        groups.into_iter().flatten().chain(claims).map(|output| output.expr)
    })
}

/// Which expressions the outputs need.
fn needed(spec: &Spec) -> Vec<bool> {
    let mut needed = vec![false; spec.exprs.len()];
    let mut todo: Vec<ExprId> = outputs(spec).collect();
    while let Some(id) = todo.pop() {
        if !std::mem::replace(&mut needed[id.0 as usize], true) {
            todo.extend(spec.inputs(spec.expr(id)));
        }
    }
    needed
}

/// The plan without nodes that no output needs: those at coordinates that nothing selects.
fn reached(plan: Plan) -> Plan {
    let Plan { graph, mut outputs, mut aliases } = plan;
    let mut reached = vec![false; graph.node_count()];
    let wanted = outputs.values().flat_map(|family| &family.sources);
    let mut todo: Vec<NodeIndex> = wanted.filter_map(Source::node).collect();
    while let Some(node) = todo.pop() {
        if !std::mem::replace(&mut reached[node.index()], true) {
            todo.extend(graph.neighbors_directed(node, Incoming));
        }
    }
    if reached.iter().all(|reached| *reached) {
        return Plan { graph, outputs, aliases };
    }
    let mut moved: Vec<Option<NodeIndex>> = vec![None; reached.len()];
    let mut kept = DiGraph::new();
    let (nodes, _) = graph.into_nodes_edges();
    for (i, node) in nodes.into_iter().enumerate().filter(|(i, _)| reached[*i]) {
        let mut step = node.weight;
        for source in step.sources_mut() {
            if let Source::Node(node) = source {
                *node = moved[node.index()].expect("inputs come first");
            }
        }
        moved[i] = Some(add(&mut kept, step));
    }
    for source in outputs.values_mut().flat_map(|family| &mut family.sources) {
        if let Source::Node(node) = source {
            *node = moved[node.index()].expect("outputs are reached");
        }
    }
    aliases.retain(|_, node| {
        let moved = moved[node.index()];
        *node = moved.unwrap_or(*node);
        moved.is_some()
    });
    Plan { graph: kept, outputs, aliases }
}

/// Adds a step and the edges from its inputs.
fn add(graph: &mut DiGraph<Step, ()>, step: Step) -> NodeIndex {
    let mut inputs: Vec<NodeIndex> = step.sources().filter_map(|source| source.node()).collect();
    inputs.sort_unstable();
    inputs.dedup();
    let node = graph.add_node(step);
    for input in inputs {
        graph.add_edge(input, node, ());
    }
    node
}

/// The values of an expression, by place: last axis fastest.
#[derive(Clone, Debug)]
struct Values {
    axes: Vec<AxisId>,
    strides: Vec<usize>,
    sources: Vec<Source>,
}

impl Values {
    fn at(&self, place: &Place) -> Source {
        self.gathered(&[], &[], place)[0]
    }

    /// The values at a place, at all coordinates of the axes gathered, in their orders.
    fn gathered(&self, axes: &[AxisId], orders: &[Vec<usize>], place: &Place) -> Vec<Source> {
        let own = self.axes.iter().zip(&self.strides).filter(|(axis, _)| !axes.contains(axis));
        let mut indices: Vec<usize> = vec![own.map(|(axis, stride)| place[axis] * stride).sum()];
        for (axis, order) in axes.iter().zip(orders) {
            let own = self.axes.iter().position(|own| own == axis);
            // What does not vary over an axis is the same along it.
            let stride = own.map_or(0, |own| self.strides[own]);
            let along = |index: usize| order.iter().map(move |i| index + i * stride);
            indices = indices.into_iter().flat_map(along).collect();
        }
        indices.into_iter().map(|index| self.sources[index]).collect()
    }
}

struct Expansion<'a> {
    spec: &'a Spec,
    registry: &'a Registry,
    plan: Plan,
    /// How many nodes there are of each address.
    addresses: BTreeMap<String, usize>,
    /// Nodes by what they compute.
    known: BTreeMap<Digest, NodeIndex>,
    /// What the step at hand computes, in bytes.
    identity: Vec<u8>,
    /// The coordinates of each axis by value.
    orders: Vec<Vec<usize>>,
    /// The place of each coordinate in that order.
    ranks: Vec<Vec<usize>>,
}

impl Expansion<'_> {
    fn values(&mut self, id: ExprId, known: &[Option<Values>]) -> Values {
        let expr = self.spec.expr(id);
        let shapes = self.spec.shapes.get(&id).map(|known| &**known);
        let axes: Vec<AxisId> = expr.axes.iter().copied().collect();
        let sizes: Vec<usize> =
            axes.iter().map(|axis| self.spec.axis(*axis).coords.len()).collect();
        let mut sources = Vec::new();
        for place in places(&axes, &sizes) {
            let base = |id: &ExprId| known[id.0 as usize].as_ref().expect("inputs come first");
            sources.push(match &expr.kind {
                ExprKind::Number(desc) => Source::Number(
                    self.eval(desc, &place).as_f64().expect("checked to be a number"),
                ),
                ExprKind::Match { axis, arms } => base(&arms[place[axis]]).at(&place),
                ExprKind::Pick { base: id, axis, place: coordinate } => {
                    let mut place = place.clone();
                    place.insert(*axis, *coordinate);
                    base(id).at(&place)
                }
                ExprKind::Restrict { base: id, axis, restricted, places } => {
                    let mut place = place.clone();
                    let coordinate = places[place[restricted]];
                    place.insert(*axis, coordinate);
                    base(id).at(&place)
                }
                ExprKind::Op(op) => Source::Node(self.node((expr, shapes), op, &place, known)),
            });
        }
        Values { strides: strides(&sizes), axes, sources }
    }

    fn eval(&self, desc: &Desc, place: &Place) -> Lit {
        desc.eval(&self.spec.axes, place).expect("checked to have a value")
    }

    /// The node of one call at one place; an equal one if there is.
    fn node(
        &mut self,
        (expr, shapes): (&Expr, Option<&Known>),
        op: &Op,
        place: &Place,
        known: &[Option<Values>],
    ) -> NodeIndex {
        let mut args = Args::new();
        let mut held = Vec::new();
        for (name, desc) in &op.args {
            let mut lit = self.eval(desc, place);
            self.drop_members(&mut lit);
            each_held(&mut lit, &mut |slot| {
                let feed = &self.spec.held[*slot];
                let values = known[feed.expr.0 as usize].as_ref().expect("inputs come first");
                held.push(self.fed(feed, values, place));
                *slot = held.len() - 1;
            });
            args.insert(name.clone(), lit);
        }
        let mut ports = Vec::new();
        for (name, feeds) in &op.ports {
            let feds = feeds.iter().map(|feed| {
                let values = known[feed.expr.0 as usize].as_ref().expect("inputs come first");
                self.fed(feed, values, place)
            });
            ports.push((name.clone(), feds.collect()));
        }
        let draw = op.stochastic.then(|| self.draw(place));
        let address = self.address(expr, place);
        let shapes = shapes.and_then(|shapes| shapes.at(place)).cloned();
        let mut step = Step { address, op: op.name.clone(), args, held, ports, draw, shapes };
        let input = |source: &Source| {
            let (kind, bits) = match source {
                Source::Node(node) => (0_u8, node.index() as u64),
                Source::Number(x) => (1, x.to_bits()),
            };
            let mut bytes = [kind; 9];
            bytes[1..].copy_from_slice(&bits.to_le_bytes());
            bytes
        };
        self.identity.clear();
        key::walk(&step, self.registry, input, &mut self.identity);
        let identity = Digest::of(&self.identity);
        if let Some(&node) = self.known.get(&identity) {
            let own = &self.plan.graph[node].address;
            let number = own.strip_prefix(&step.address);
            if !number.is_some_and(|rest| rest.is_empty() || rest.starts_with('#')) {
                let alias = self.unique(step.address);
                self.plan.aliases.insert(alias, node);
            }
            return node;
        }
        step.address = self.unique(step.address);
        let node = add(&mut self.plan.graph, step);
        self.known.insert(identity, node);
        node
    }

    /// An address that nothing else has: parts of one expression without names of their own are told
    /// apart by number.
    fn unique(&mut self, address: String) -> String {
        let alike = self.addresses.entry(address.clone()).or_default();
        *alike += 1;
        if *alike > 1 { format!("{address}#{alike}") } else { address }
    }

    fn draw(&self, place: &Place) -> Draw {
        let role = |role: AxisRole| {
            let found = place.iter().find(move |(axis, _)| self.spec.axis(**axis).role == role);
            found.map(|(axis, i)| &self.spec.axis(*axis).coords[*i].value)
        };
        let whole = |lit: &Lit| {
            if let Lit::Int(n) = lit { *n } else { unreachable!("checked to be whole") }
        };
        let member = role(AxisRole::Member).map(|lit| whole(lit).unsigned_abs());
        Draw { seed: role(AxisRole::Seed).map_or(0, whole), member }
    }

    fn fed(&self, feed: &Feed, values: &Values, place: &Place) -> Fed {
        let orders = feed.gathered.iter().map(|axis| {
            let Some(groups) = feed.groups.as_ref().filter(|groups| groups.axis == *axis) else {
                return self.order(*axis, feed.labelled);
            };
            let mut group = groups.places[place[&groups.by]].clone();
            if !feed.labelled {
                group.sort_by_key(|place| self.ranks[axis.0 as usize][*place]);
            }
            group
        });
        let orders: Vec<Vec<usize>> = orders.collect();
        let sizes: Vec<usize> = orders.iter().map(Vec::len).collect();
        let sources = values.gathered(&feed.gathered, &orders, place);
        let dims = feed.gathered.iter().enumerate().map(|(i, axis)| {
            if feed.labelled {
                return self.labelled(*axis);
            }
            let places = (0..sizes[i]).map(|j| j.to_string()).collect();
            Dim::new(&format!("#{i}"), Labels::Names(places))
        });
        Fed { dims: dims.collect(), sources, labelled: feed.labelled, name: feed.name.clone() }
    }

    /// The coordinates of an axis: as declared where labels travel, else by value.
    fn order(&self, axis: AxisId, labelled: bool) -> Vec<usize> {
        let by_value = &self.orders[axis.0 as usize];
        if labelled { (0..by_value.len()).collect() } else { by_value.clone() }
    }

    fn labelled(&self, axis: AxisId) -> Dim {
        let axis = self.spec.axis(axis);
        Dim::new(&axis.name, axis.labels())
    }

    /// The values over axes in the order of their names.
    fn family(&self, values: &Values) -> Family {
        let mut axes = values.axes.clone();
        axes.sort_by_key(|axis| &self.spec.axis(*axis).name);
        let sizes: Vec<usize> =
            axes.iter().map(|axis| self.spec.axis(*axis).coords.len()).collect();
        let sources = places(&axes, &sizes).map(|place| values.at(&place)).collect();
        Family { dims: axes.iter().map(|axis| self.labelled(*axis)).collect(), sources }
    }

    /// `overoptimisation/model[seed=0]/member[3]`.
    fn address(&self, expr: &Expr, place: &Place) -> String {
        if expr.axes.is_empty() {
            return expr.address.clone();
        }
        let mut coords = Vec::new();
        let mut member = String::new();
        for axis in &expr.axes {
            let (axis, coordinate) = (self.spec.axis(*axis), place[axis]);
            let label = address::label(&axis.coords[coordinate].label);
            match axis.role {
                AxisRole::Member => member = format!("/member[{label}]"),
                _ => coords.push(format!("{}={label}", axis.name)),
            }
        }
        let coords =
            if coords.is_empty() { String::new() } else { format!("[{}]", coords.join(",")) };
        format!("{}{coords}{member}", expr.address)
    }

    /// Takes the numbers of members away, which no node knows.
    fn drop_members(&self, lit: &mut Lit) {
        match lit {
            Lit::List(items) => items.iter_mut().for_each(|item| self.drop_members(item)),
            Lit::Part(part) => {
                if let Some(decl) = self.registry.decl(&part.name) {
                    let members = |name: &str| decl.arg(name).map(|arg| &arg.kind);
                    part.args.retain(|name, _| members(name) != Some(&ArgKind::Members));
                }
                part.args.values_mut().for_each(|arg| self.drop_members(arg));
            }
            _ => {}
        }
    }
}

/// Shows the slots of what the parts in a description hold to `see`.
fn each_held(lit: &mut Lit, see: &mut impl FnMut(&mut usize)) {
    match lit {
        Lit::Held(Held::Slot(slot)) => see(slot),
        Lit::List(items) => items.iter_mut().for_each(|item| each_held(item, see)),
        Lit::Part(part) => part.args.values_mut().for_each(|arg| each_held(arg, see)),
        _ => {}
    }
}

/// Places of coordinates, in the order of their values.
fn by_value(coords: &[Coord]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..coords.len()).collect();
    if coords.iter().all(|coord| coord.value.as_f64().is_some()) {
        let number = |i: &usize| coords[*i].value.as_f64().unwrap_or_default();
        order.sort_by(|a, b| number(a).total_cmp(&number(b)));
    } else {
        order.sort_by_cached_key(|i| coords[*i].value.to_string());
    }
    order
}

/// The place of each in an order.
fn ranks(order: &[usize]) -> Vec<usize> {
    let mut ranks = vec![0; order.len()];
    for (rank, place) in order.iter().enumerate() {
        ranks[*place] = rank;
    }
    ranks
}

fn strides(sizes: &[usize]) -> Vec<usize> {
    let mut strides = vec![1; sizes.len()];
    for i in (0..sizes.len().saturating_sub(1)).rev() {
        strides[i] = strides[i + 1] * sizes[i + 1];
    }
    strides
}

/// Every place on some axes, last axis fastest.
fn places(axes: &[AxisId], sizes: &[usize]) -> impl Iterator<Item = Place> {
    let strides = strides(sizes);
    (0..sizes.iter().product()).map(move |i| {
        let coordinate = |j: usize| (axes[j], i / strides[j] % sizes[j]);
        (0..axes.len()).map(coordinate).collect()
    })
}
