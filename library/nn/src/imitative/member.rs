//! One model of plans as its equations have it: a step forward, and back.

use crate::curve::Curve;
use crate::module::Module;
use crate::networks::Networks;
use crate::ops::gate;
use crate::real::{Real, sigmoid, softplus};
use crate::seen::FLOOR;

use super::product::{Weights, padded};
use super::{CELL, HEAD};

/// What steps from place to place, as arrays: matrices are `[in, out]`, row after row.
#[derive(Clone, Debug)]
pub struct PlanWeights<F> {
    /// How many numbers a place is.
    pub dims: usize,
    /// How many a state has.
    pub units: usize,
    /// The weight and the bias of the cell's input, and those of its state, with the gates `r`, `z` and `n`.
    pub cell: [Vec<F>; 4],
    /// Weight, bias and activation of each layer of the head, whose last puts out `δ` and what makes `σ`.
    pub head: Vec<(Vec<F>, Vec<F>, Curve)>,
}

/// The weights of `h_t = GRU(y_{t-1}, h_{t-1})` and of the head that makes `(δ_t, σ_t)` of it, laid out for products.
#[derive(Clone, Debug)]
pub(super) struct Member<F> {
    input: Weights<F>,
    state: Weights<F>,
    head: Vec<(Weights<F>, Curve)>,
    state_back: Weights<F>,
    head_back: Vec<Weights<F>>,
    units: usize,
    dims: usize,
}

/// What one step computed, of some items; what is `wide` has rows that are filled up.
#[derive(Clone, Debug)]
pub(super) struct Step<F> {
    /// `y W + b` and `h W + b` of the three gates, wide.
    of_input: Vec<F>,
    pub(super) of_state: Vec<F>,
    /// `r`, `z` and `n`, wide.
    gates: Vec<F>,
    /// `h_{t-1}` and `h_t`, `[items, units]`.
    pub(super) before: Vec<F>,
    pub(super) after: Vec<F>,
    /// What each layer of the head puts out, wide; the last `(δ, what makes σ)`.
    layers: Vec<Vec<F>>,
    /// Where gradients are passed through.
    grads: Vec<Vec<F>>,
    grad_gates: [Vec<F>; 2],
}

impl<F: Real> Step<F> {
    pub(super) fn new(member: &Member<F>, items: usize) -> Self {
        let zeros = |width: usize| vec![F::zero(); items * width];
        let (gates, units) = (member.state.width(), member.units);
        let layers: Vec<_> = member.head.iter().map(|(layer, _)| zeros(layer.width())).collect();
        Self {
            of_input: zeros(gates),
            of_state: zeros(gates),
            gates: zeros(gates),
            before: zeros(units),
            after: zeros(units),
            grads: layers.clone(),
            layers,
            grad_gates: [zeros(gates), zeros(gates)],
        }
    }

    /// `δ_t` and what makes `σ_t` of an item.
    pub(super) fn said(&self, item: usize, dims: usize) -> (&[F], &[F]) {
        let width = padded(2 * dims);
        let row = &self.layers.last().expect("a head has layers")[item * width..][..2 * dims];
        row.split_at(dims)
    }

    /// Where the gradients of `δ_t` and of what makes `σ_t` go.
    pub(super) fn said_back(&mut self, item: usize, dims: usize) -> (&mut [F], &mut [F]) {
        let width = padded(2 * dims);
        let last = self.grads.last_mut().expect("a head has layers");
        last[item * width..][..2 * dims].split_at_mut(dims)
    }
}

/// `σ = ln(1 + e^raw) + 10⁻³`, and its slope.
pub(super) fn std<F: Real>(raw: F) -> (F, F) {
    (softplus(raw) + F::of(FLOOR), sigmoid(raw))
}

impl<F: Real> Member<F> {
    /// That of networks.
    ///
    /// # Panics
    /// If they are no model of plans.
    pub(super) fn of(nets: &Networks) -> Self {
        let array = |name: &str| -> Vec<F> {
            let (.., values) = nets.array(name).expect("every layer has its arrays");
            values.iter().map(|x| F::of(f64::from(*x))).collect()
        };
        let Module::Gru { inputs, units } = nets.modules[CELL] else { panic!("a cell is a GRU") };
        let Module::Sequence(layers) = &nets.modules[HEAD] else { panic!("a head has layers") };
        let head = layers.iter().enumerate().map(|(i, layer)| {
            let Module::Dense { curve, .. } = layer else { panic!("layers of a head are dense") };
            let of = |name: &str| array(&format!("{HEAD}.{i}.{name}"));
            (of("weight"), of("bias"), *curve)
        });
        let of = |name: &str| array(&format!("{CELL}.{name}"));
        let cell = [of("input_weight"), of("input_bias"), of("state_weight"), of("state_bias")];
        Self::new(&PlanWeights { dims: inputs, units, cell, head: head.collect() })
    }

    /// That of some weights.
    pub(super) fn new(weights: &PlanWeights<F>) -> Self {
        let PlanWeights { dims, units, cell: [input, input_bias, state, state_bias], head } =
            weights;
        let input = Weights::new(input, input_bias);
        let state = Weights::new(state, state_bias);
        let layers = head.iter().map(|(weight, bias, curve)| {
            let layer = Weights::new(weight, bias);
            (layer.back(bias.len()), (layer, *curve))
        });
        let (head_back, head) = layers.unzip();
        let state_back = state.back(3 * units);
        let (units, dims) = (*units, *dims);
        Self { input, state, head, state_back, head_back, units, dims }
    }

    pub(super) fn units(&self) -> usize {
        self.units
    }

    /// Computes `h W + b` of states `[items, units]`.
    pub(super) fn remember(&self, states: &[F], of_state: &mut [F]) {
        self.state.times(states, of_state);
    }

    /// Computes a step of `of_state` and `before` from the places before it, `[items, dims]`.
    pub(super) fn forward(&self, places: &[F], step: &mut Step<F>) {
        self.input.times(places, &mut step.of_input);
        let gates = (&step.of_input[..], &step.of_state[..], &mut step.gates[..]);
        gate::forward(self.units, gates, &step.before, &mut step.after);
        let mut x: &[F] = &step.after;
        for ((layer, curve), out) in self.head.iter().zip(&mut step.layers) {
            layer.times(x, out);
            curve.apply(out);
            x = out;
        }
    }

    /// Passes gradients of what was said back to `h_t`, whose own gradient is in `state`, and from there to
    /// `h_{t-1}`, unless that stays, and `y_{t-1}`.
    ///
    /// - `state`: `[items, width]`, wide
    /// - `places`: `[items, dims]`, replaced
    pub(super) fn backward(
        &self,
        step: &mut Step<F>,
        state: &mut [F],
        spare: &mut [F],
        places: &mut [F],
        goes_on: bool,
    ) {
        for i in (0..self.head.len()).rev() {
            let (before, own) = step.grads.split_at_mut(i);
            self.head[i].1.backward(&step.layers[i], &mut own[0]);
            match before.last_mut() {
                Some(before) => self.head_back[i].times(&own[0], before),
                None => self.head_back[i].times(&own[0], spare),
            }
        }
        state.iter_mut().zip(&*spare).for_each(|(all, new)| *all += *new);
        let Step { of_state, gates, before, grad_gates: [by_input, by_state], .. } = step;
        gate::backward(self.units, (gates, of_state), before, state, (by_input, by_state));
        self.input.dots(by_input, places);
        if goes_on {
            // `h_t` has `z h_{t-1}` in it, too.
            self.state_back.times(by_state, spare);
            gate::carry(self.units, gates, state, before.len() / self.units);
            state.iter_mut().zip(&*spare).for_each(|(all, new)| *all += *new);
        }
    }

    /// How many numbers a row of gradients of states has.
    pub(super) fn wide(&self) -> usize {
        self.state_back.width()
    }

    pub(super) fn dims(&self) -> usize {
        self.dims
    }
}
