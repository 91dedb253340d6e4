//! How long a step of training takes: `cargo bench -p ivx-library --bench steps -- W1 [SECONDS]`.
//!
//! The five are those of `benches/numerics.sh`, which runs JAX and `PyTorch` beside them. One line
//! a workload: the median of batches of steps, in milliseconds.

use std::time::{Duration, Instant};

use ivx_nn::optim::{self, Moments, Pull};
use ivx_nn::{Cell, Curve, Graph, ParamId, Params, Shape, Var, Window};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

#[expect(clippy::print_stdout, reason = "a bench tells what it measured")]
fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|arg| arg != "--bench").collect();
    let seconds = args.get(1).and_then(|arg| arg.parse().ok()).unwrap_or(2.0);
    for (name, make) in WORKLOADS {
        if args.first().is_some_and(|wanted| wanted != name) {
            continue;
        }
        let mut step = make();
        let mut batch = |n: u32| {
            let began = Instant::now();
            (0..n).for_each(|_| step());
            began.elapsed()
        };
        let one = batch(10) / 10;
        let n =
            u32::try_from((Duration::from_millis(50).as_nanos() / one.as_nanos().max(1)).max(1));
        let n = n.expect("steps take longer than a nanosecond");
        let began = Instant::now();
        let mut times = Vec::new();
        while times.len() < 5 || began.elapsed().as_secs_f64() < seconds {
            times.push(batch(n) / n);
        }
        times.sort();
        let ms = |time: Duration| time.as_secs_f64() * 1e3;
        let median = times[times.len() / 2];
        println!("{name} {:.4} ms a step (from {:.4})", ms(median), ms(times[0]));
    }
}

type Make = fn() -> Box<dyn FnMut()>;

const WORKLOADS: [(&str, Make); 5] =
    [("W1", ensemble_member), ("W2", policy), ("W3", conv_net), ("W4", recurrent), ("W5", tiny)];

struct Build {
    params: Params<f32>,
    rng: ChaCha8Rng,
}

impl Build {
    fn new() -> Self {
        Self { params: Params::default(), rng: ChaCha8Rng::seed_from_u64(0) }
    }

    fn numbers(&mut self, n: usize) -> Vec<f32> {
        (0..n).map(|_| self.rng.random_range(-1.0..1.0)).collect()
    }

    fn array(&mut self, shape: &[usize], n_in: usize) -> ParamId {
        let values = self.numbers(shape.iter().product());
        let bound = 1.0 / f32::from(u16::try_from(n_in).expect("layers are narrow")).sqrt();
        let values = values.into_iter().map(|x| x * bound).collect();
        self.params.add("p".into(), shape.to_vec(), values)
    }

    fn dense(&mut self, n_in: usize, n_out: usize) -> (ParamId, ParamId) {
        (self.array(&[n_in, n_out], n_in), self.array(&[n_out], n_in))
    }

    fn layers(&mut self, widths: &[usize]) -> Vec<(ParamId, ParamId)> {
        widths.windows(2).map(|pair| self.dense(pair[0], pair[1])).collect()
    }
}

fn forward(graph: &Graph<f32>, layers: &[(ParamId, ParamId)], x: Var, curve: Curve) -> Var {
    let last = layers.len() - 1;
    layers.iter().enumerate().fold(x, |x, (i, (weight, bias))| {
        graph.linear(x, *weight, *bias, if i < last { curve } else { Curve::Identity })
    })
}

/// A step of Adam down a loss.
fn trained(
    params: Params<f32>,
    (lr, weight_decay): (f64, f64),
    loss: impl Fn(&Graph<f32>) -> Var + 'static,
) -> Box<dyn FnMut()> {
    let mut moments: Vec<Moments<f32>> = params.moments();
    let graph = Graph::new(params);
    let mut t = 0;
    Box::new(move || {
        graph.begin();
        let loss = loss(&graph);
        graph.backward(loss);
        let pull = Pull::NONE;
        let rule = optim::Adam { lr, beta1: 0.9, beta2: 0.999, eps: 1e-8, weight_decay, pull };
        for (params, grads, moments) in graph.params().updates(&mut moments) {
            optim::adam(&rule, t, params, grads, moments);
        }
        t += 1;
    })
}

/// 1 → 1024 → 1024 → 1 with tanh on 32 pairs, `AdamW`.
fn ensemble_member() -> Box<dyn FnMut()> {
    let mut build = Build::new();
    let layers = build.layers(&[1, 1024, 1024, 1]);
    let x: Vec<f32> = (0..32_u8).map(|i| f32::from(i) / 15.5 - 1.0).collect();
    let y: Vec<f32> = x.iter().map(|x| (3.0 * x).sin()).collect();
    trained(build.params, (1e-3, 1e-4), move |graph| {
        let shape = Shape::vectors(32, 1);
        let f = forward(graph, &layers, graph.input(shape, &x), Curve::Tanh);
        graph.mean(graph.squared(f, graph.input(shape, &y)))
    })
}

/// 24 → 512 → 256 → 9 with relu on 512 pairs, cross-entropy.
fn policy() -> Box<dyn FnMut()> {
    let mut build = Build::new();
    let layers = build.layers(&[24, 512, 256, 9]);
    let x = build.numbers(512 * 24);
    let class: Vec<f32> = (0..512_u16).map(|i| f32::from(i % 9)).collect();
    trained(build.params, (1e-3, 0.0), move |graph| {
        let x = graph.input(Shape::vectors(512, 24), &x);
        let class = graph.input(Shape::vectors(512, 1), &class);
        graph.mean(graph.cross_entropy(forward(graph, &layers, x, Curve::Relu), class))
    })
}

/// What a step of Q-learning sees: states, the next ones, actions, rewards and whether it goes
/// on.
struct Replay {
    item: [usize; 3],
    states: [Vec<f32>; 2],
    actions: Vec<f32>,
    rewards: Vec<f32>,
    going: Vec<f32>,
}

impl Replay {
    fn new(build: &mut Build, item: [usize; 3], n_actions: u8) -> Self {
        let n = 32 * item.iter().product::<usize>();
        Self {
            item,
            states: [build.numbers(n), build.numbers(n)],
            actions: (0..32_u8).map(|i| f32::from(i % n_actions)).collect(),
            rewards: build.numbers(32),
            going: (0..32_u8).map(|i| f32::from(u8::from(i % 10 != 0))).collect(),
        }
    }

    /// Huber's loss of `q(s, a)` and `r + γ max q⁻(s')`.
    fn loss(&self, graph: &Graph<f32>, q: impl Fn(Var, bool) -> Var) -> Var {
        let column = |values: &[f32]| graph.input(Shape::vectors(32, 1), values);
        let [now, next] = &self.states;
        let state = |values: &[f32]| graph.input(Shape { n: 32, item: self.item }, values);
        let target = graph.still(|| {
            let best = graph.max_items(q(state(next), true));
            let best = graph.affine(graph.mul(best, column(&self.going)), 0.99, 0.0);
            graph.add(best, column(&self.rewards))
        });
        let chosen = graph.pick(q(state(now), false), column(&self.actions));
        graph.mean(graph.huber(chosen, target, 1.0))
    }
}

/// 10 × 10 images of 4 channels, 16 kernels of 3 × 3, 128, 6; a target network.
fn conv_net() -> Box<dyn FnMut()> {
    let mut build = Build::new();
    let mut net = || {
        let kernels = (build.array(&[16, 4, 3, 3], 36), build.array(&[16], 36));
        (kernels, build.layers(&[1024, 128, 6]))
    };
    let nets = [net(), net()];
    let replay = Replay::new(&mut build, [4, 10, 10], 6);
    trained(build.params, (1e-4, 0.0), move |graph| {
        replay.loss(graph, |state, is_target| {
            let ((weight, bias), layers) = &nets[usize::from(is_target)];
            let window = Window { kernel: 3, stride: 1, padding: 0 };
            let features = graph.conv2d(state, *weight, Some(*bias), (window, 1), Curve::Relu);
            forward(graph, layers, features, Curve::Relu)
        })
    })
}

/// 200 → 128 → 64 into a GRU of 64 units that unrolls 20 steps of two numbers, each Gaussian.
fn recurrent() -> Box<dyn FnMut()> {
    let mut build = Build::new();
    let encoder = build.layers(&[200, 128, 64]);
    let (input_weight, input_bias) = build.dense(2, 192);
    let (state_weight, state_bias) = build.dense(64, 192);
    let cell = Cell { input_weight, input_bias, state_weight, state_bias };
    let head = build.dense(64, 4);
    let (x, y) = (build.numbers(64 * 200), build.numbers(20 * 64 * 2));
    trained(build.params, (1e-3, 0.0), move |graph| {
        let x = graph.input(Shape::vectors(64, 200), &x);
        let mut h = forward(graph, &encoder, x, Curve::Relu);
        let mut previous = graph.input(Shape::vectors(64, 2), &[0.0; 128]);
        let mut total = None;
        for y in y.chunks_exact(128) {
            h = graph.gru(previous, h, &cell);
            let out = graph.linear(h, head.0, head.1, Curve::Identity);
            let mean = graph.add(previous, graph.columns(out, 0, 2));
            let y = graph.input(Shape::vectors(64, 2), y);
            let log_std = graph.columns(out, 2, 2);
            let log_prob = graph.mean(graph.gaussian_log_prob(graph.sub(y, mean), log_std));
            total = Some(total.map_or(log_prob, |total| graph.add(total, log_prob)));
            previous = y;
        }
        graph.affine(total.expect("there are steps"), -2.0, 0.0)
    })
}

/// 4 → 64 → 64 → 2 with a target network.
fn tiny() -> Box<dyn FnMut()> {
    let mut build = Build::new();
    let nets = [build.layers(&[4, 64, 64, 2]), build.layers(&[4, 64, 64, 2])];
    let replay = Replay::new(&mut build, [4, 1, 1], 2);
    trained(build.params, (1e-3, 0.0), move |graph| {
        replay.loss(graph, |state, is_target| {
            forward(graph, &nets[usize::from(is_target)], state, Curve::Relu)
        })
    })
}
