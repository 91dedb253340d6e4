//! Networks on a graph.

use std::collections::BTreeMap;

use ivx_op::State;

use crate::graph::{Graph, Var};
use crate::module::{Mode, Module};
use crate::networks::{Networks, joined};
use crate::params::{ParamId, Params};
use crate::target::Follow;
use crate::world::Body;

/// What the names of targets begin with.
const TARGET: &str = "target.";

/// Networks on a graph: passed through, trained and followed.
#[derive(Debug)]
pub struct Live {
    /// The graph.
    pub graph: Graph<f32>,
    nets: BTreeMap<String, (Module, Vec<ParamId>)>,
    names: BTreeMap<String, ParamId>,
    /// What follows, and what each of it follows.
    targets: Vec<ParamId>,
    followed: Vec<ParamId>,
}

impl Live {
    /// All of some networks.
    ///
    /// # Panics
    /// If an array is missing.
    #[must_use]
    pub fn of(nets: &Networks) -> Self {
        Self::some(nets, |_| true)
    }

    /// Those whose names `wanted` says, and every array of no network.
    ///
    /// # Panics
    /// If an array is missing.
    #[must_use]
    pub fn some(nets: &Networks, wanted: impl Fn(&str) -> bool) -> Self {
        let mut live = Self {
            graph: Graph::new(Params::default()),
            nets: BTreeMap::new(),
            names: BTreeMap::new(),
            targets: Vec::new(),
            followed: Vec::new(),
        };
        let mut of_nets = std::collections::BTreeSet::new();
        for (net, module) in &nets.modules {
            let arrays = module.arrays().into_iter();
            let named = arrays.map(|array| (joined(net, &array.name), array.learns));
            let named: Vec<(String, bool)> = named.collect();
            if wanted(net) {
                let ids = named.iter().map(|(name, learns)| live.add(nets, name, *learns));
                let ids = ids.collect();
                live.nets.insert(net.clone(), (module.clone(), ids));
            }
            of_nets.extend(named.into_iter().map(|(name, _)| name));
        }
        for (name, ..) in nets.arrays.iter().filter(|(name, ..)| !of_nets.contains(name)) {
            live.add(nets, name, true);
        }
        live
    }

    fn add(&mut self, nets: &Networks, name: &str, learns: bool) -> ParamId {
        let (_, shape, values) = nets.array(name).expect("networks have an array for every layer");
        let (name, shape, values) = (name.to_owned(), shape.clone(), values.clone());
        let mut params = self.graph.params();
        let id = if learns {
            params.add(name.clone(), shape, values)
        } else {
            params.add_fixed(name.clone(), shape, values)
        };
        drop(params);
        self.names.insert(name, id);
        id
    }

    /// Adds copies of the networks and arrays whose names begin so, which follow them: they are called `target.` and
    /// the name.
    ///
    /// # Panics
    /// If there are none.
    pub fn target(&mut self, prefix: &str) {
        let of: Vec<(String, ParamId)> = self.begin_with(prefix);
        assert!(!of.is_empty(), "something is called {prefix}..");
        for (name, id) in &of {
            let mut params = self.graph.params();
            let (shape, values) = (params.shape(*id).to_vec(), params.value(*id).to_vec());
            let copy = format!("{TARGET}{name}");
            let target = params.add_fixed(copy.clone(), shape, values);
            drop(params);
            self.names.insert(copy, target);
            self.targets.push(target);
            self.followed.push(*id);
        }
        let nets = self.nets.iter().filter(|(net, _)| net.starts_with(prefix));
        let copies = nets.map(|(net, (module, ids))| {
            let follows = |id: &ParamId| {
                let place = self.followed.iter().position(|of| of == id);
                self.targets[place.expect("all arrays of a network begin with its name")]
            };
            let ids = ids.iter().map(follows).collect();
            (format!("{TARGET}{net}"), (module.clone(), ids))
        });
        let copies: Vec<_> = copies.collect();
        self.nets.extend(copies);
    }

    /// Moves the targets when `t` steps are done.
    pub fn follow(&mut self, rule: Follow, t: u64) {
        self.graph.params().follow(rule, t, &self.followed, &self.targets);
    }

    /// The arrays whose names begin so and do not follow others, in the order of the graph.
    fn begin_with(&self, prefix: &str) -> Vec<(String, ParamId)> {
        let params = self.graph.params();
        let own = params.ids().zip(params.arrays());
        own.filter(|(_, array)| array.name.starts_with(prefix) && !array.name.starts_with(TARGET))
            .map(|(id, array)| (array.name.clone(), id))
            .collect()
    }

    /// The places of the arrays whose names begin with one of these.
    #[must_use]
    pub fn group(&self, prefixes: &[&str]) -> Vec<ParamId> {
        prefixes.iter().flat_map(|prefix| self.begin_with(prefix)).map(|(_, id)| id).collect()
    }

    /// The network of a name.
    #[must_use]
    pub fn get(&self, net: &str) -> Option<Body<'_>> {
        self.nets.get(net).map(|(module, params)| Body { module, params })
    }

    /// The network of a name that there must be.
    ///
    /// # Panics
    /// If there is none.
    #[must_use]
    pub fn body(&self, net: &str) -> Body<'_> {
        self.get(net).unwrap_or_else(|| panic!("there is a network `{net}`"))
    }

    /// What comes out of a network for the items of `x`, vectors or images.
    ///
    /// # Panics
    /// If there is no such network, or it does not take them.
    #[must_use]
    pub fn pass(&self, net: &str, x: Var) -> Var {
        self.through(self.body(net), x)
    }

    /// What comes out of all layers of a network but the last.
    ///
    /// # Panics
    /// As [`Live::pass`], or if it has no layers.
    #[must_use]
    pub fn pass_to_last(&self, net: &str, x: Var) -> Var {
        let Body { module, params } = self.body(net);
        let Module::Sequence(layers) = module else { panic!("`{net}` has layers") };
        let (last, before) = layers.split_last().expect("a network has a layer");
        let module = Module::Sequence(before.to_vec());
        let params = &params[..params.len() - last.arrays().len()];
        self.through(Body { module: &module, params }, x)
    }

    fn through(&self, Body { module, params }: Body<'_>, x: Var) -> Var {
        let item = self.graph.shape(x).item;
        let is_vector = item[1..] == [1, 1] && !module.takes_images();
        let shape = if is_vector { &item[..1] } else { &item[..] };
        module.pass(&self.graph, params, (x, shape), &mut Mode::Predict)
    }

    /// What comes out of a network with recurrent layers for one more step of sequences, whose items are the vectors of
    /// `x`. The states of its layers go in, and become those after it; none are zeros.
    ///
    /// # Panics
    /// If there is no such network, it does not take them, or it has other layers.
    pub fn step(&self, net: &str, x: Var, states: &mut Vec<Var>) -> Var {
        let Body { module, params } = self.body(net);
        let shape = [1, self.graph.shape(x).width()];
        module.go_on(&self.graph, params, (x, &shape), states, &mut Mode::Predict)
    }

    /// An array as a value of the pass at hand: one item of all its numbers.
    ///
    /// # Panics
    /// If there is none of this name.
    #[must_use]
    pub fn array(&self, name: &str) -> Var {
        self.graph.parameter(self.names[name])
    }

    /// The networks as they are now, without what follows.
    #[must_use]
    pub fn networks(&self) -> Networks {
        let own = |name: &str| !name.starts_with(TARGET);
        let modules = self.nets.iter().filter(|(net, _)| own(net));
        let modules = modules.map(|(net, (module, _))| (net.clone(), module.clone()));
        let params = self.graph.params();
        let arrays = params.arrays().iter().filter(|array| own(&array.name));
        let arrays =
            arrays.map(|array| (array.name.clone(), array.shape.clone(), array.value.clone()));
        let mut arrays: Vec<_> = arrays.collect();
        arrays.sort_by(|(a, ..), (b, ..)| a.cmp(b));
        Networks { modules: modules.collect(), arrays }
    }

    /// Puts the arrays of the graph into the networks that it is of.
    ///
    /// # Panics
    /// If it is of others.
    pub fn put_into(&self, nets: &mut Networks) {
        for param in self.graph.params().arrays() {
            let found = nets.arrays.iter_mut().find(|(name, ..)| *name == param.name);
            let (.., values) = found.expect("the graph was made of these networks");
            values.clone_from(&param.value);
        }
    }

    /// Walks over all arrays.
    pub fn state(&mut self, state: &mut State) {
        let mut params = self.graph.params();
        let ids: Vec<ParamId> = params.ids().collect();
        for id in ids {
            let name = params.arrays()[id.place()].name.clone();
            state.numbers(&name, params.value_mut(id));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Shape;
    use crate::{Curve, Start};
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;

    /// `q(x) = w x + b`, and an array `v` of no network.
    fn live() -> Live {
        let module = Module::Dense { inputs: 2, outputs: 1, curve: Curve::Identity };
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let nets = Networks::drawn([("q".to_owned(), module)].into(), &mut rng);
        Live::of(&nets.with("v", vec![2], Start::Constant(0.5), &mut rng))
    }

    #[test]
    fn targets_follow_and_are_no_networks_of_their_own() {
        let mut live = live();
        let before = live.networks();
        live.target("q");
        let x = live.graph.input(Shape::vectors(1, 2), &[1.0, -1.0]);
        let ask = |live: &Live, net| live.graph.scalar(live.pass(net, x));
        assert_eq!(ask(&live, "q"), ask(&live, "target.q"));
        for id in live.group(&["q"]) {
            live.graph.params().value_mut(id).fill(2.0);
        }
        assert_eq!(ask(&live, "q"), 2.0);
        assert_ne!(ask(&live, "target.q"), 2.0);
        live.follow(Follow::Copy(10), 10);
        assert_eq!(ask(&live, "target.q"), 2.0);
        assert_eq!(live.networks().modules, before.modules);
        assert_eq!(live.networks().arrays.len(), 3);
        assert_eq!((live.group(&["q"]).len(), live.group(&["v", "q"]).len()), (2, 3));
    }

    #[test]
    fn the_last_layer_is_a_network_upon_the_others() {
        let dense = |inputs, outputs, curve| Module::Dense { inputs, outputs, curve };
        let head = dense(3, 1, Curve::Identity);
        let two = Module::Sequence(vec![dense(2, 3, Curve::Tanh), head.clone()]);
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut nets = Networks::drawn([("q".to_owned(), two)].into(), &mut rng);
        let of = |name: &str| nets.array(&format!("q.1.{name}")).unwrap().clone();
        let arrays = ["weight", "bias"].map(|name| (name.to_owned(), of(name).1, of(name).2));
        let alone = Networks { modules: [(String::new(), head)].into(), arrays: arrays.into() };
        nets.add("head", alone);
        let live = Live::of(&nets);
        let x = live.graph.input(Shape::vectors(1, 2), &[1.0, -1.0]);
        let before = live.pass_to_last("q", x);
        assert_eq!(live.graph.shape(before).width(), 3);
        let ask = |of: Var| live.graph.scalar(of);
        assert_eq!(ask(live.pass("head", before)), ask(live.pass("q", x)));
    }

    #[test]
    fn an_array_is_a_value_with_a_gradient() {
        let live = live();
        let x = live.graph.input(Shape::vectors(2, 2), &[1.0, 2.0, 3.0, 4.0]);
        let loss = live.graph.sum(live.graph.mul(x, live.array("v")));
        assert_eq!(live.graph.scalar(loss), 5.0);
        live.graph.backward(loss);
        let id = live.group(&["v"])[0];
        assert_eq!(live.graph.params().grad(id), Some(&[4.0, 6.0][..]));
    }

    #[test]
    fn steps_from_a_given_state_are_those_of_the_whole_sequence() {
        for name in ["gru", "lstm"] {
            let cell = |inputs, units| match name {
                "gru" => Module::Gru { inputs, units },
                _ => Module::Lstm { inputs, units },
            };
            let curve = Curve::Identity;
            let head = Module::Dense { inputs: 2, outputs: 1, curve };
            let layers = vec![cell(2, 3), cell(3, 2), Module::Last, head];
            let (nets, mut rng) =
                (("r".to_owned(), Module::Sequence(layers)), ChaCha8Rng::seed_from_u64(4));
            let live = Live::of(&Networks::drawn([nets].into(), &mut rng));
            let graph = &live.graph;
            let xs = [0.5, -1.0, 2.0, 0.25, -0.75, 1.0];
            let whole = |n: usize| {
                let x = graph.input(Shape::vectors(1, 2 * n), &xs[..2 * n]);
                let Body { module, params } = live.body("r");
                graph.scalar(module.pass(graph, params, (x, &[n, 2]), &mut Mode::Predict))
            };
            let mut states = Vec::new();
            for t in 0..3 {
                let x = graph.input(Shape::vectors(1, 2), &xs[2 * t..2 * t + 2]);
                let y = live.step("r", x, &mut states);
                assert_eq!(graph.scalar(y), whole(t + 1), "{name} at {t}");
                assert_eq!(states.len(), if name == "gru" { 2 } else { 4 });
            }
            // From a state of its own it is another, and the loss has a gradient in it.
            let x = graph.input(Shape::vectors(1, 2), &xs[4..]);
            let own = graph.variable(Shape::vectors(1, 3), &[0.9, -0.9, 0.1]);
            states[0] = own;
            let y = live.step("r", x, &mut states);
            assert_ne!(graph.scalar(y), whole(3));
            graph.backward(y);
            assert!(graph.grad(own).iter().all(|slope| *slope != 0.0));
        }
    }

    #[test]
    fn a_walk_restores_the_arrays_and_their_targets() {
        let mut one = live();
        one.target("q");
        let id = one.group(&["q"])[0];
        one.graph.params().value_mut(id).fill(7.0);
        let bytes = State::keep(|state| one.state(state));
        let mut other = live();
        assert!(!State::restore(&bytes[..bytes.len() - 1], |state| other.state(state)));
        other.target("q");
        assert!(State::restore(&bytes, |state| other.state(state)));
        assert_eq!(one.graph.params().arrays(), other.graph.params().arrays());
    }
}
