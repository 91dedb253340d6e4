//! A pass through the layers of a network.

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use std::collections::VecDeque;

use super::Module;
use crate::graph::{Graph, Shape, Var};
use crate::ops::{BatchNorm, Cell};
use crate::params::ParamId;
use crate::real::Real;

/// What a pass is for.
#[derive(Debug)]
pub enum Mode<'a> {
    /// Training: numbers are left out at random, and batches normalised by themselves.
    Train(&'a mut ChaCha8Rng),
    /// Prediction: all numbers are there, and batches normalised by what training has seen.
    Predict,
}

/// The share of a batch in the running statistics.
const MOMENTUM: f64 = 0.1;
/// How many steps are put side by side at once.
const AT_ONCE: usize = 32;
/// What is added to variances.
const EPS: f64 = 1e-5;

impl Module {
    /// What comes out for the items of `x`, whose shape is `input`.
    ///
    /// `params` are the places of its arrays, in the order of [`Module::arrays`].
    ///
    /// # Panics
    /// If the shapes do not fit, or arrays are missing.
    pub fn pass<F: Real>(
        &self,
        graph: &Graph<F>,
        params: &[ParamId],
        (x, input): (Var, &[usize]),
        mode: &mut Mode<'_>,
    ) -> Var {
        let mut pass = Pass { graph, params: params.iter(), mode, states: None };
        pass.layer(self, x, Sizes::of(input)).0
    }

    /// The same of sequences that go on from the states of the recurrent layers, which become those after the last step:
    /// of each layer in turn its output, and of `lstm` its cell behind that. Without any they are zeros.
    ///
    /// # Panics
    /// If the shapes do not fit, or arrays or states are missing.
    pub fn go_on<F: Real>(
        &self,
        graph: &Graph<F>,
        params: &[ParamId],
        (x, input): (Var, &[usize]),
        states: &mut Vec<Var>,
        mode: &mut Mode<'_>,
    ) -> Var {
        let before = (!states.is_empty()).then(|| VecDeque::from(std::mem::take(states)));
        let mut own = States { before, after: Vec::new() };
        let mut pass = Pass { graph, params: params.iter(), mode, states: Some(&mut own) };
        let y = pass.layer(self, x, Sizes::of(input)).0;
        assert!(own.before.is_none_or(|left| left.is_empty()), "there is a layer for every state");
        *states = own.after;
        y
    }
}

/// The states of recurrent layers that were not passed yet, and of those that were.
struct States {
    /// None where all begin at zeros.
    before: Option<VecDeque<Var>>,
    after: Vec<Var>,
}

/// The shape of a batch of `n` items of a shape.
#[must_use]
pub(crate) fn batch(n: usize, item: &[usize]) -> Shape {
    match item {
        [channels, rows, cols] => Shape { n, item: [*channels, *rows, *cols] },
        _ => Shape::vectors(n, item.iter().product()),
    }
}

/// The shape of an item, which is in no buffer, so that a pass asks for none.
#[derive(Clone, Copy)]
struct Sizes {
    len: usize,
    sizes: [usize; 3],
}

impl Sizes {
    fn of(shape: &[usize]) -> Self {
        let mut sizes = [0; 3];
        sizes[..shape.len()].copy_from_slice(shape);
        Self { len: shape.len(), sizes }
    }

    /// The shape of what comes out of a layer.
    fn after(self, layer: &Module) -> Self {
        match (layer, &self[..]) {
            (Module::Dense { outputs, .. }, [] | [_]) => Self::of(&[*outputs]),
            (Module::Dense { outputs, .. }, [steps, _]) => Self::of(&[*steps, *outputs]),
            (Module::Conv { outputs, window, .. }, [_, rows, cols]) => {
                Self::of(&[*outputs, window.places(*rows), window.places(*cols)])
            }
            (Module::Flatten, all) => Self::of(&[all.iter().product()]),
            (Module::Curve(_), _) => self,
            (other, shape) => match other.output(shape) {
                Ok(output) => Self::of(&output),
                Err(misfit) => panic!("{}", misfit.message),
            },
        }
    }
}

impl std::ops::Deref for Sizes {
    type Target = [usize];

    fn deref(&self) -> &[usize] {
        &self.sizes[..self.len]
    }
}

struct Pass<'a, 'm, F: Real> {
    graph: &'a Graph<F>,
    params: std::slice::Iter<'a, ParamId>,
    mode: &'a mut Mode<'m>,
    states: Option<&'a mut States>,
}

impl<F: Real> Pass<'_, '_, F> {
    fn next(&mut self) -> ParamId {
        *self.params.next().expect("there is an array for every layer")
    }

    /// What comes out of one layer, and its shape.
    fn layer(&mut self, module: &Module, x: Var, shape: Sizes) -> (Var, Sizes) {
        let graph = self.graph;
        match module {
            Module::Sequence(layers) => return self.layers(layers, x, shape),
            Module::Residual(layers) => {
                let (y, shape) = self.layers(layers, x, shape);
                return (graph.add(x, y), shape);
            }
            _ => {}
        }
        let output = shape.after(module);
        let y = match module {
            Module::Dense { outputs, curve, .. } => {
                let (weight, bias) = (self.next(), self.next());
                let n = graph.shape(x).n;
                let rows = match shape[..] {
                    [steps, length] => graph.reshape(x, Shape::vectors(n * steps, length)),
                    _ => x,
                };
                let y = graph.linear(rows, weight, bias, *curve);
                match shape[..] {
                    [steps, _] => graph.reshape(y, Shape::vectors(n, steps * outputs)),
                    _ => y,
                }
            }
            Module::Conv { window, groups, bias, curve, .. } => {
                let weight = self.next();
                let bias = bias.then(|| self.next());
                graph.conv2d(x, weight, bias, (*window, *groups), *curve)
            }
            Module::ConvTranspose { window, curve, .. } => {
                let (weight, bias) = (self.next(), self.next());
                graph.curve(graph.conv_transpose2d(x, weight, bias, *window), *curve)
            }
            Module::MaxPool(window) => graph.max_pool(x, *window),
            Module::MeanPool(window) => graph.mean_pool(x, *window),
            Module::GlobalPool => {
                let pooled = graph.global_mean_pool(x);
                graph.reshape(pooled, batch(graph.shape(x).n, &output))
            }
            Module::BatchNorm { .. } => {
                let (scale, shift) = (self.next(), self.next());
                let (mean, variance) = (self.next(), self.next());
                let norm = BatchNorm { scale, shift, mean, variance, momentum: MOMENTUM, eps: EPS };
                match self.mode {
                    Mode::Train(_) => graph.batch_norm(x, &norm),
                    Mode::Predict => graph.batch_norm_fixed(x, &norm),
                }
            }
            Module::LayerNorm { .. } => {
                let (scale, shift) = (self.next(), self.next());
                graph.layer_norm(x, scale, shift, EPS)
            }
            Module::Gru { .. } | Module::Lstm { .. } => self.unroll(module, x, &output, &shape),
            Module::Embedding { .. } => {
                let table = self.next();
                let n = graph.shape(x).n;
                graph.reshape(graph.embedding(x, table), batch(n, &output))
            }
            Module::Dropout { rate, .. } => match self.mode {
                Mode::Train(rng) => {
                    let of = graph.shape(x);
                    let keep = graph.filled(of, |keep| keep.fill_with(|| draw(*rate, rng)));
                    graph.dropout(x, keep, *rate)
                }
                Mode::Predict => x,
            },
            Module::Mask { .. } => {
                let mask = self.next();
                let mask = graph.params().value(mask).to_vec();
                graph.mul(x, graph.input(batch(1, &shape), &mask))
            }
            Module::Curve(curve) => graph.curve(x, *curve),
            Module::Flatten => graph.reshape(x, batch(graph.shape(x).n, &output)),
            Module::Last => graph.columns(x, (shape[0] - 1) * shape[1], shape[1]),
            Module::Sequence(_) | Module::Residual(_) => unreachable!("done above"),
        };
        (y, output)
    }

    fn layers(&mut self, layers: &[Module], x: Var, shape: Sizes) -> (Var, Sizes) {
        let mut at = (x, shape);
        for (i, layer) in layers.iter().enumerate() {
            at = match (layer, layers.get(i + 1)) {
                // A linear map takes the numbers of an item as they lie.
                (Module::Flatten, Some(Module::Dense { inputs, .. }))
                    if *inputs == at.1.iter().product::<usize>() =>
                {
                    (at.0, Sizes::of(&[*inputs]))
                }
                _ => self.layer(layer, at.0, at.1),
            };
        }
        at
    }

    /// The outputs of a recurrent layer at every step.
    fn unroll(&mut self, module: &Module, x: Var, output: &[usize], input: &[usize]) -> Var {
        let graph = self.graph;
        let (steps, units, length) = (output[0], output[1], input[1]);
        let cell = Cell {
            input_weight: self.next(),
            input_bias: self.next(),
            state_weight: self.next(),
            state_bias: self.next(),
        };
        let zeros = || {
            let shape = Shape::vectors(graph.shape(x).n, units);
            graph.filled(shape, |zeros| zeros.fill(F::zero()))
        };
        let is_gru = matches!(module, Module::Gru { .. });
        let mut state = || match self.states.as_mut().and_then(|states| states.before.as_mut()) {
            Some(before) => before.pop_front().expect("there is a state for every layer"),
            None => zeros(),
        };
        let mut h = state();
        let mut c = if is_gru { h } else { state() };
        // A few steps at once, so that no list is long.
        let (mut outputs, mut rows) = (Vec::with_capacity(AT_ONCE), Vec::new());
        for t in 0..steps {
            let x = graph.columns(x, t * length, length);
            if is_gru {
                h = graph.gru(x, h, &cell);
            } else {
                (h, c) = graph.lstm(x, (h, c), &cell);
            }
            outputs.push(h);
            if outputs.len() == AT_ONCE || t + 1 == steps {
                rows.push(graph.concat(&outputs));
                outputs.clear();
            }
        }
        if let Some(states) = &mut self.states {
            states.after.push(h);
            states.after.extend((!is_gru).then_some(c));
        }
        graph.concat(&rows)
    }
}

/// 1 with probability `1 - rate`, else 0.
fn draw<F: Real>(rate: f64, rng: &mut ChaCha8Rng) -> F {
    if rng.random::<f64>() < rate { F::zero() } else { F::one() }
}
