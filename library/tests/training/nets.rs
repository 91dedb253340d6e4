//! Small trainings of each kind of network: one of layers, one of images, one that unrolls.

use std::cell::RefCell;

use ivx_nn::optim::{Moments, Pull};
use ivx_nn::{
    AdamW, BatchNorm, Cell, ClipNorm, Cosine, Curve, Graph, Optimiser, ParamId, Params, Shape,
    Step, Var, WarmUp, Window,
};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

type Loss = Box<dyn Fn(&Graph<f32>, u64) -> Var>;
pub(crate) type Make = fn(u64) -> Task;

/// Parameters, and a loss of them at each step.
pub(crate) struct Task {
    pub(crate) params: Params<f32>,
    pub(crate) loss: Loss,
}

/// The tasks, by name; each is made of a seed.
pub(crate) const TASKS: [(&str, Make); 3] =
    [("perceptron", perceptron), ("conv_net", conv_net), ("recurrent", recurrent)];

/// How many steps a schedule is made for.
pub(crate) const STEPS: u64 = 40;

/// A training between two steps.
pub(crate) struct Training {
    pub(crate) graph: Graph<f32>,
    pub(crate) moments: Vec<Moments<f32>>,
    loss: Loss,
    optimiser: Box<dyn Optimiser>,
    pub(crate) t: u64,
}

impl Training {
    pub(crate) fn new(task: Task) -> Self {
        let moments = task.params.moments();
        let graph = Graph::new(task.params);
        Self { graph, moments, loss: task.loss, optimiser: optimiser(), t: 0 }
    }

    /// One step; the loss before it.
    pub(crate) fn step(&mut self) -> f32 {
        self.graph.begin();
        let loss = (self.loss)(&self.graph, self.t);
        self.graph.backward(loss);
        let loss = self.graph.scalar(loss);
        let pull = Pull { l2: 1e-3, l1: 1e-4, centre: 0.0 };
        let step = Step { t: self.t, total: STEPS, pull };
        self.optimiser.step(&step, &mut self.graph.params(), &mut self.moments);
        self.t += 1;
        loss
    }
}

/// What the trainings obey: `AdamW` at a rate that warms up and falls, on clipped gradients.
pub(crate) fn optimiser() -> Box<dyn Optimiser> {
    let lr = WarmUp { steps: 3, then: Box::new(Cosine { from: 3e-3, to: 0.0 }) };
    let adamw = AdamW { lr: Box::new(lr), beta1: 0.9, beta2: 0.999, eps: 1e-8, weight_decay: 1e-4 };
    Box::new(ClipNorm { optimiser: Box::new(adamw), limit: 1.0 })
}

struct Build {
    params: Params<f32>,
    rng: ChaCha8Rng,
}

impl Build {
    fn new(seed: u64) -> Self {
        Self { params: Params::default(), rng: ChaCha8Rng::seed_from_u64(seed) }
    }

    fn numbers(&mut self, n: usize) -> Vec<f32> {
        (0..n).map(|_| self.rng.random_range(-1.0..1.0)).collect()
    }

    fn array(&mut self, shape: &[usize], n_in: usize) -> ParamId {
        let values = self.numbers(shape.iter().product());
        let bound = 1.0 / f32::from(u16::try_from(n_in).expect("layers are narrow")).sqrt();
        let name = format!("{}", self.params.arrays().len());
        self.params.add(name, shape.to_vec(), values.into_iter().map(|x| x * bound).collect())
    }

    fn constant(&mut self, n: usize, value: f32, learns: bool) -> ParamId {
        let name = format!("{}", self.params.arrays().len());
        let add = if learns { Params::add } else { Params::add_fixed };
        add(&mut self.params, name, vec![n], vec![value; n])
    }

    fn dense(&mut self, n_in: usize, n_out: usize) -> (ParamId, ParamId) {
        (self.array(&[n_in, n_out], n_in), self.array(&[n_out], n_in))
    }
}

/// 8 → 64 → 64 → 3 with tanh on 48 pairs, the mean squared error.
fn perceptron(seed: u64) -> Task {
    let mut build = Build::new(seed);
    let layers = [(8, 64), (64, 64), (64, 3)].map(|(n_in, n_out)| build.dense(n_in, n_out));
    let (x, y) = (build.numbers(48 * 8), build.numbers(48 * 3));
    let loss = move |graph: &Graph<f32>, _| {
        let x = graph.input(Shape::vectors(48, 8), &x);
        let curves = [Curve::Tanh, Curve::Tanh, Curve::Identity];
        let f = layers
            .iter()
            .zip(curves)
            .fold(x, |x, (&(weight, bias), curve)| graph.linear(x, weight, bias, curve));
        graph.mean(graph.squared(f, graph.input(Shape::vectors(48, 3), &y)))
    };
    Task { params: build.params, loss: Box::new(loss) }
}

/// Images of 3 × 10 × 10: convolution, batch norm, relu, pool, dropout, and a class of 4.
fn conv_net(seed: u64) -> Task {
    const N: usize = 12;
    let mut build = Build::new(seed);
    let (weight, bias) = (build.array(&[16, 3, 3, 3], 27), build.array(&[16], 27));
    let norm = BatchNorm {
        scale: build.constant(16, 1.0, true),
        shift: build.constant(16, 0.0, true),
        mean: build.constant(16, 0.0, false),
        variance: build.constant(16, 1.0, false),
        momentum: 0.1,
        eps: 1e-5,
    };
    let head = build.dense(16 * 16, 4);
    let x = build.numbers(N * 300);
    let class: Vec<f32> = (0..12_u8).map(|i| f32::from(i % 4)).collect();
    let mask = RefCell::new(vec![0.0_f32; N * 256]);
    let loss = move |graph: &Graph<f32>, t| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(t);
        let mut mask = mask.borrow_mut();
        mask.iter_mut().for_each(|keep| *keep = f32::from(u8::from(rng.random::<f32>() > 0.2)));
        let x = graph.input(Shape { n: N, item: [3, 10, 10] }, &x);
        let same = Window { kernel: 3, stride: 1, padding: 0 };
        let halves = Window { kernel: 2, stride: 2, padding: 0 };
        let features = graph
            .batch_norm(graph.conv2d(x, weight, Some(bias), (same, 1), Curve::Identity), &norm);
        let pooled = graph.max_pool(graph.curve(features, Curve::Relu), halves);
        let pooled = graph.reshape(pooled, Shape::vectors(N, 256));
        let kept = graph.dropout(pooled, graph.input(Shape::vectors(N, 256), &mask), 0.2);
        let logits = graph.linear(kept, head.0, head.1, Curve::Identity);
        graph.mean(graph.cross_entropy(logits, graph.input(Shape::vectors(N, 1), &class)))
    };
    Task { params: build.params, loss: Box::new(loss) }
}

/// A recurrent unit that unrolls 20 steps of two numbers, each Gaussian: the mean negative log
/// density.
fn recurrent(seed: u64) -> Task {
    const N: usize = 16;
    let mut build = Build::new(seed);
    let (input_weight, input_bias) = build.dense(2, 96);
    let (state_weight, state_bias) = build.dense(32, 96);
    let cell = Cell { input_weight, input_bias, state_weight, state_bias };
    let start = build.dense(6, 32);
    let head = build.dense(32, 4);
    let (x, y) = (build.numbers(N * 6), build.numbers(20 * N * 2));
    let loss = move |graph: &Graph<f32>, _| {
        let x = graph.input(Shape::vectors(N, 6), &x);
        let mut h = graph.linear(x, start.0, start.1, Curve::Tanh);
        let mut previous = graph.input(Shape::vectors(N, 2), &[0.0; N * 2]);
        let mut total = None;
        for y in y.chunks_exact(N * 2) {
            h = graph.gru(previous, h, &cell);
            let out = graph.linear(h, head.0, head.1, Curve::Identity);
            let mean = graph.add(previous, graph.columns(out, 0, 2));
            let y = graph.input(Shape::vectors(N, 2), y);
            let log_std = graph.columns(out, 2, 2);
            let log_prob = graph.mean(graph.gaussian_log_prob(graph.sub(y, mean), log_std));
            total = Some(total.map_or(log_prob, |total| graph.add(total, log_prob)));
            previous = y;
        }
        graph.affine(total.expect("there are steps"), -1.0 / 20.0, 0.0)
    };
    Task { params: build.params, loss: Box::new(loss) }
}
