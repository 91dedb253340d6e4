//! Linear maps find the answers that algebra has for them.

use ivx_nn::optim::Pull;
use ivx_nn::{
    Adam, AdamW, Cosine, Curve, Graph, Optimiser, Params, RmsProp, Schedule, Sgd, Shape, Step,
};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

const N: usize = 64;
const N_IN: usize = 6;

/// A random design, and targets of which `n_out` numbers a row: a linear map of the first
/// `relevant` inputs, and noise.
struct Regression {
    x: Vec<f32>,
    y: Vec<f32>,
    n_out: usize,
}

impl Regression {
    fn new(seed: u64, n_out: usize, relevant: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut numbers =
            |n: usize| -> Vec<f32> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
        let (x, map, noise) = (numbers(N * N_IN), numbers(N_IN * n_out), numbers(N * n_out));
        let target = |i: usize, k: usize| {
            let terms = (0..relevant).map(|j| x[i * N_IN + j] * (map[j * n_out + k] + 2.0));
            terms.sum::<f32>() + 0.5 + 0.3 * noise[i * n_out + k]
        };
        let y = (0..N * n_out).map(|i| target(i / n_out, i % n_out)).collect();
        Self { x, y, n_out }
    }

    /// Row `i` of the design with a 1 for the bias.
    fn row(&self, i: usize) -> impl Iterator<Item = f64> + Clone {
        self.x[i * N_IN..(i + 1) * N_IN].iter().map(|&x| f64::from(x)).chain([1.0])
    }

    /// Weight and bias after so many steps down `1/(2N) Σ ‖y - f(x)‖²`, as one map of inputs
    /// and 1.
    fn descend(&self, optimiser: &dyn Optimiser, pull: Pull, steps: u64) -> Vec<f64> {
        let mut params = Params::default();
        let weight = params.add("w".into(), vec![N_IN, self.n_out], vec![0.0; N_IN * self.n_out]);
        let bias = params.add("b".into(), vec![self.n_out], vec![0.0; self.n_out]);
        let mut moments = params.moments();
        let graph = Graph::new(params);
        for t in 0..steps {
            graph.begin();
            let x = graph.input(Shape::vectors(N, N_IN), &self.x);
            let f = graph.linear(x, weight, bias, Curve::Identity);
            let y = graph.input(Shape::vectors(N, self.n_out), &self.y);
            let outputs = f64::from(u8::try_from(self.n_out).expect("there are few"));
            let loss = graph.affine(graph.mean(graph.squared(f, y)), 0.5 * outputs, 0.0);
            graph.backward(loss);
            optimiser.step(&Step { t, total: steps, pull }, &mut graph.params(), &mut moments);
        }
        let params = graph.params();
        let map = params.value(weight).iter().chain(params.value(bias));
        map.map(|&x| f64::from(x)).collect()
    }

    /// `1/N X'(y - X map)`: for each input and the bias, by output.
    fn correlations(&self, map: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; (N_IN + 1) * self.n_out];
        for i in 0..N {
            for k in 0..self.n_out {
                let f: f64 =
                    self.row(i).enumerate().map(|(j, x)| x * map[j * self.n_out + k]).sum();
                let error = f64::from(self.y[i * self.n_out + k]) - f;
                for (j, x) in self.row(i).enumerate() {
                    sums[j * self.n_out + k] += error * x / f64::from(u8::try_from(N).expect("N"));
                }
            }
        }
        sums
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |max, x| max.max(x.abs()))
}

fn falling(from: f64) -> Box<dyn Schedule> {
    Box::new(Cosine { from, to: 0.0 })
}

fn optimisers() -> [(&'static str, Box<dyn Optimiser>); 5] {
    let (beta1, beta2, eps) = (0.9, 0.999, 1e-8);
    [
        ("sgd", Box::new(Sgd { lr: falling(0.5), momentum: 0.0 })),
        ("momentum", Box::new(Sgd { lr: falling(0.1), momentum: 0.9 })),
        (
            "rmsprop",
            Box::new(RmsProp { lr: falling(0.05), decay: 0.95, eps: 0.01, centered: false }),
        ),
        ("adam", Box::new(Adam { lr: falling(0.05), beta1, beta2, eps })),
        ("adamw", Box::new(AdamW { lr: falling(0.05), beta1, beta2, eps, weight_decay: 0.0 })),
    ]
}

/// Within 1e-5 of the normal equations, which nothing learned leaves unfulfilled by 1.
#[test]
fn a_linear_layer_finds_least_squares() {
    let problem = Regression::new(0, 3, N_IN);
    assert!(largest(&problem.correlations(&[0.0; (N_IN + 1) * 3])) > 1.0);
    for (name, optimiser) in optimisers() {
        let map = problem.descend(&*optimiser, Pull::NONE, 1500);
        let left = largest(&problem.correlations(&map));
        assert!(left < 1e-5, "{name}: {left} is left of the normal equations");
    }
}

/// Where the penalty is part of the gradient, the correlation of an input with the errors is `λ`
/// times its weight's sign if it has a weight, and no more than `λ` if it has none: the three inputs
/// without a say have none, of which least squares gives one 50 times what is none here.
#[test]
fn an_l1_pull_leaves_irrelevant_weights_at_nothing() {
    let lambda = 0.08;
    let problem = Regression::new(1, 1, 3);
    for (name, optimiser) in optimisers().into_iter().filter(|(name, _)| *name != "adamw") {
        let free = problem.descend(&*optimiser, Pull::NONE, 3000);
        assert!(largest(&free[3..6]) > 5e-3, "{name}: {free:?}");
        let pull = Pull { l2: 0.0, l1: lambda, centre: 0.0 };
        let map = problem.descend(&*optimiser, pull, 3000);
        for (j, rest) in problem.correlations(&map).into_iter().enumerate() {
            if (3..6).contains(&j) {
                assert!(map[j].abs() < 1e-4 && rest.abs() < lambda, "{name}, weight {j}: {map:?}");
            } else {
                assert!((rest - lambda).abs() < 1e-4 && map[j] > 0.1, "{name}, weight {j}: {rest}");
            }
        }
    }
}

/// Under an L2 pull the answer is that of ridge regression: `1/N X'(y - X map) = l2 map`.
#[test]
fn an_l2_pull_gives_ridge_regression() {
    let problem = Regression::new(2, 2, N_IN);
    for (name, optimiser) in optimisers().into_iter().filter(|(name, _)| *name != "adamw") {
        let map = problem.descend(&*optimiser, Pull { l2: 0.2, l1: 0.0, centre: 0.0 }, 1500);
        let rest = problem.correlations(&map).into_iter().zip(&map).map(|(c, w)| c - 0.2 * w);
        let left = largest(&rest.collect::<Vec<_>>());
        assert!(left < 1e-5, "{name}: {left} is left of the ridge equations");
    }
}
