//! Every operation against central differences, over random shapes and numbers.

use ivx_math::moments::real;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::{BatchNorm, Cell, Curve, Graph, ParamId, Params, Shape, Var, Window};

/// How many random shapes each operation is tried on.
const ROUNDS: u64 = 12;

/// A random case of one operation.
pub(super) struct Draw {
    rng: ChaCha8Rng,
    params: Params<f64>,
    inputs: Vec<(Shape, Vec<f64>)>,
}

impl Draw {
    pub(super) fn size(&mut self, from: usize, to: usize) -> usize {
        self.rng.random_range(from..=to)
    }

    pub(super) fn numbers(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.rng.random_range(-1.5..1.5)).collect()
    }

    /// A parameter of random numbers.
    pub(super) fn param(&mut self, shape: &[usize]) -> ParamId {
        let values = self.numbers(shape.iter().product());
        let name = format!("p{}", self.params.arrays().len());
        self.params.add(name, shape.to_vec(), values)
    }

    /// An input of random numbers, by its place among inputs.
    pub(super) fn input(&mut self, n: usize, item: [usize; 3]) {
        let shape = Shape { n, item };
        let values = self.numbers(shape.len());
        self.inputs.push((shape, values));
    }
}

/// Compares the gradients of `Σ w y` with central differences, by every input and parameter.
///
/// `draw` makes a case and says what is done with its inputs.
pub(super) fn check(
    name: &str,
    draw: impl Fn(&mut Draw) -> Box<dyn Fn(&Graph<f64>, &[Var]) -> Var>,
) {
    for seed in 0..ROUNDS {
        let rng = ChaCha8Rng::seed_from_u64(seed);
        let mut case = Draw { rng, params: Params::default(), inputs: Vec::new() };
        let op = draw(&mut case);
        let mut weights = ChaCha8Rng::seed_from_u64(1000 + seed);
        let weights: Vec<f64> = (0..4096).map(|_| weights.random_range(-1.0..1.0)).collect();
        let pass = |params: &Params<f64>, inputs: &[(Shape, Vec<f64>)], is_backward: bool| {
            let graph = Graph::new(params.clone());
            let vars: Vec<Var> =
                inputs.iter().map(|(shape, values)| graph.variable(*shape, values)).collect();
            let y = op(&graph, &vars);
            let weights = graph.input(graph.shape(y), &weights[..graph.shape(y).len()]);
            let loss = graph.sum(graph.mul(y, weights));
            if is_backward {
                graph.backward(loss);
            }
            (graph.scalar(loss), graph, vars)
        };
        let (_, graph, vars) = pass(&case.params, &case.inputs, true);
        let h = 1e-5;
        let compare = |what: &str, i: usize, slope: f64, up: f64, down: f64| {
            let difference = (up - down) / (2.0 * h);
            let error = (slope - difference).abs() / difference.abs().max(1.0);
            assert!(error < 1e-6, "{name}, seed {seed}, {what}[{i}]: {slope} and {difference}");
        };
        for (k, var) in vars.iter().enumerate() {
            let grad = graph.grad(*var);
            for (i, slope) in grad.into_iter().enumerate() {
                let at = |h: f64| {
                    let mut inputs = case.inputs.clone();
                    inputs[k].1[i] += h;
                    pass(&case.params, &inputs, false).0
                };
                compare(&format!("input {k}"), i, slope, at(h), at(-h));
            }
        }
        for id in case.params.ids() {
            let Some(grad) = graph.params().grad(id).map(<[f64]>::to_vec) else { continue };
            for (i, slope) in grad.into_iter().enumerate() {
                let at = |h: f64| {
                    let mut params = case.params.clone();
                    params.value_mut(id)[i] += h;
                    pass(&params, &case.inputs, false).0
                };
                compare(&format!("parameter {id:?}"), i, slope, at(h), at(-h));
            }
        }
    }
}

#[test]
fn linear_maps() {
    for curve in [Curve::Identity, Curve::Tanh, Curve::Elu, Curve::Sigmoid, Curve::Softplus] {
        check("linear", move |case| {
            let (n, n_in, n_out) = (case.size(1, 5), case.size(1, 9), case.size(1, 9));
            let (weight, bias) = (case.param(&[n_in, n_out]), case.param(&[n_out]));
            case.input(n, [n_in, 1, 1]);
            Box::new(move |graph, x| graph.linear(x[0], weight, bias, curve))
        });
    }
}

/// Also one channel, one item, and a kernel as large as the image.
#[test]
fn convolutions() {
    check("conv2d", |case| {
        let (groups, kernel) = (case.size(1, 3), case.size(1, 3));
        let (n, stride, padding) = (case.size(1, 2), case.size(1, 2), case.size(0, kernel - 1));
        let (inside, outside) = (case.size(1, 2), case.size(1, 2));
        let (rows, cols) = (kernel + case.size(0, 3), kernel + case.size(0, 3));
        let weight = case.param(&[outside * groups, inside, kernel, kernel]);
        let bias = (case.size(0, 1) == 1).then(|| case.param(&[outside * groups]));
        case.input(n, [inside * groups, rows, cols]);
        let window = Window { kernel, stride, padding };
        Box::new(move |graph, x| {
            graph.conv2d(x[0], weight, bias, (window, groups), Curve::Identity)
        })
    });
    check("conv_transpose2d", |case| {
        let (n, kernel, stride) = (case.size(1, 2), case.size(2, 4), case.size(1, 2));
        let (n_in, n_out) = (case.size(1, 3), case.size(1, 3));
        let weight = case.param(&[n_in, n_out, kernel, kernel]);
        let bias = case.param(&[n_out]);
        let item = [n_in, case.size(2, 4), case.size(2, 4)];
        case.input(n, item);
        let window = Window { kernel, stride, padding: case.size(0, 1) };
        Box::new(move |graph, x| graph.conv_transpose2d(x[0], weight, bias, window))
    });
}

/// Where a batch is too large for its patches to be kept, they are made anew.
#[test]
fn convolutions_of_large_batches_have_the_gradients_of_their_parts() {
    let (shape, window) = ([4, 10, 10], Window { kernel: 3, stride: 1, padding: 0 });
    let images: Vec<f64> = (0..64 * 400).map(|i| (real(i) * 0.37).sin()).collect();
    let gradient = |parts: usize| {
        let mut params = Params::default();
        let weight = (0..16 * 36).map(|i| (real(i) * 0.11).cos()).collect();
        let weight = params.add("w".into(), vec![16, 4, 3, 3], weight);
        let graph = Graph::new(params);
        let sums = images.chunks_exact(images.len() / parts).map(|images| {
            let x = graph.input(Shape { n: 64 / parts, item: shape }, images);
            graph.sum(graph.square(graph.conv2d(x, weight, None, (window, 1), Curve::Tanh)))
        });
        graph.backward(sums.reduce(|sum, part| graph.add(sum, part)).unwrap());
        let params = graph.params();
        params.grad(weight).unwrap().to_vec()
    };
    for (whole, parts) in gradient(1).into_iter().zip(gradient(2)) {
        assert!((whole - parts).abs() < 1e-9 * whole.abs().max(1.0), "{whole} and {parts}");
    }
}

#[test]
fn pools() {
    type Pool = fn(&Graph<f64>, Var, Window) -> Var;
    for (name, pool) in [("max", Graph::max_pool as Pool), ("mean", Graph::mean_pool as Pool)] {
        check(name, move |case| {
            let (n, channels, kernel) = (case.size(1, 2), case.size(1, 2), case.size(1, 3));
            let (rows, cols) = (kernel + case.size(0, 3), kernel + case.size(0, 3));
            let window =
                Window { kernel, stride: case.size(1, 3), padding: case.size(0, kernel / 2) };
            case.input(n, [channels, rows, cols]);
            Box::new(move |graph, x| pool(graph, x[0], window))
        });
    }
}

#[test]
fn norms() {
    for is_fixed in [false, true] {
        check("batch_norm", move |case| {
            let (n, item) = (case.size(2, 4), [case.size(1, 3), case.size(1, 3), case.size(1, 3)]);
            case.input(n, item);
            let [channels, ..] = item;
            let (scale, shift) = (case.param(&[channels]), case.param(&[channels]));
            let mean = case.params.add_fixed("m".into(), vec![channels], vec![0.3; channels]);
            let variance = case.params.add_fixed("v".into(), vec![channels], vec![1.7; channels]);
            let norm = BatchNorm { scale, shift, mean, variance, momentum: 0.1, eps: 1e-3 };
            Box::new(move |graph, x| {
                if is_fixed {
                    graph.batch_norm_fixed(x[0], &norm)
                } else {
                    graph.batch_norm(x[0], &norm)
                }
            })
        });
    }
    check("layer_norm", |case| {
        let (n, width) = (case.size(1, 3), case.size(2, 6));
        case.input(n, [width, 1, 1]);
        let (scale, shift) = (case.param(&[width]), case.param(&[width]));
        Box::new(move |graph, x| graph.layer_norm(x[0], scale, shift, 1e-3))
    });
}

fn cell(case: &mut Draw, n_in: usize, units: usize, gates: usize) -> Cell {
    Cell {
        input_weight: case.param(&[n_in, gates * units]),
        input_bias: case.param(&[gates * units]),
        state_weight: case.param(&[units, gates * units]),
        state_bias: case.param(&[gates * units]),
    }
}

/// Two steps, so that gradients of one parameter meet.
#[test]
fn cells() {
    check("gru", |case| {
        let (n, n_in, units) = (case.size(1, 3), case.size(1, 3), case.size(1, 4));
        let cell = cell(case, n_in, units, 3);
        for width in [n_in, n_in, units] {
            case.input(n, [width, 1, 1]);
        }
        Box::new(move |graph, x| graph.gru(x[1], graph.gru(x[0], x[2], &cell), &cell))
    });
    check("lstm", |case| {
        let (n, n_in, units) = (case.size(1, 3), case.size(1, 3), case.size(1, 4));
        let cell = cell(case, n_in, units, 4);
        for width in [n_in, n_in, units, units] {
            case.input(n, [width, 1, 1]);
        }
        Box::new(move |graph, x| {
            let state = graph.lstm(x[0], (x[2], x[3]), &cell);
            let (h, c) = graph.lstm(x[1], state, &cell);
            graph.add(h, c)
        })
    });
}

type Unary = fn(&Graph<f64>, Var) -> Var;
type Binary = fn(&Graph<f64>, Var, Var) -> Var;

#[test]
fn functions_of_numbers_and_rows() {
    let unary: [(&str, Unary); 10] = [
        ("silu", |g, x| g.silu(x)),
        ("gelu", |g, x| g.gelu(x)),
        ("exp", |g, x| g.exp(x)),
        ("square", |g, x| g.square(x)),
        ("affine", |g, x| g.affine(x, -1.5, 0.5)),
        ("mean", |g, x| g.mean(x)),
        ("sum_items", |g, x| g.sum_items(x)),
        ("log_softmax", |g, x| g.log_softmax(x)),
        ("max_items", |g, x| g.max_items(x)),
        // One value in several places: gradients add up.
        ("concat", |g, x| {
            let part = g.columns(x, 1, 1);
            g.mul(g.concat(&[x, part, x]), g.concat(&[part, x, x]))
        }),
    ];
    for (name, f) in unary {
        check(name, move |case| {
            let (n, width) = (case.size(1, 4), case.size(2, 5));
            case.input(n, [width, 1, 1]);
            Box::new(move |graph, x| f(graph, x[0]))
        });
    }
    let binary: [(&str, Binary); 7] = [
        ("sub", |g, a, b| g.sub(a, b)),
        ("mul", |g, a, b| g.mul(a, b)),
        ("squared", |g, a, b| g.squared(a, b)),
        ("absolute", |g, a, b| g.absolute(a, b)),
        ("huber", |g, a, b| g.huber(a, b, 0.7)),
        ("binary_cross_entropy", |g, a, b| g.binary_cross_entropy(a, b)),
        ("gaussian_log_prob", |g, a, b| g.gaussian_log_prob(a, b)),
    ];
    for (name, f) in binary {
        check(name, move |case| {
            let (n, width) = (case.size(1, 4), case.size(1, 5));
            case.input(n, [width, 1, 1]);
            // Of the same shape, one number an item, one item for all, one number for all.
            let (n, width) = [(n, width), (n, 1), (1, width), (1, 1)][case.size(0, 3)];
            case.input(n, [width, 1, 1]);
            Box::new(move |graph, x| f(graph, x[0], x[1]))
        });
    }
    check("full_gaussian_log_prob", |case| {
        let (n, d) = (case.size(1, 3), case.size(1, 4));
        case.input(n, [d, 1, 1]);
        // A positive diagonal; what is above it does not count.
        let mut factors = case.numbers(n * d * d);
        (0..n * d).for_each(|i| factors[i / d * d * d + i % d * (d + 1)] = 1.0 + 0.1 * real(i));
        case.inputs.push((Shape::vectors(n, d * d), factors));
        Box::new(|graph, x| graph.full_gaussian_log_prob(x[0], x[1]))
    });
    check("embedding", |case| {
        let (symbols, width) = (case.size(1, 4), case.size(1, 4));
        let table = case.param(&[symbols, width]);
        let index: Vec<f64> = (0..5).map(|i| real((i * 3) % symbols)).collect();
        Box::new(move |graph, _| graph.embedding(graph.input(Shape::vectors(5, 1), &index), table))
    });
}

#[test]
fn gradients_stop_where_they_should() {
    let mut params = Params::<f64>::default();
    let weight = params.add("w".into(), vec![1, 1], vec![3.0]);
    let bias = params.add("b".into(), vec![1], vec![0.0]);
    let graph = Graph::new(params);
    let x = graph.variable(Shape::vectors(1, 1), &[2.0]);
    let line = |x| graph.linear(x, weight, bias, Curve::Identity);

    // Planning: the input has a gradient, the parameters have none.
    graph.backward(graph.frozen(|| line(x)));
    assert_eq!((graph.grad(x), graph.params().grad(weight)), (vec![3.0], None));

    // A target network: neither.
    graph.begin();
    let x = graph.variable(Shape::vectors(1, 1), &[2.0]);
    let target = graph.still(|| line(x));
    let loss = graph.squared(line(graph.stop_gradient(x)), graph.affine(target, 2.0, 0.0));
    graph.backward(loss);
    // d/dw (w x - 12)² = 2 (6 - 12) 2.
    assert_eq!((graph.grad(x), graph.params().grad(weight)), (vec![0.0], Some(&[-24.0][..])));
}

/// No pass after the first asks for a buffer: each has the same place in memory.
#[test]
fn buffers_are_used_again() {
    let mut params = Params::<f32>::default();
    let weight = params.add("w".into(), vec![64, 64], vec![0.01; 64 * 64]);
    let bias = params.add("b".into(), vec![64], vec![0.0; 64]);
    let graph = Graph::new(params);
    let places = || {
        graph.begin();
        let x = graph.input(Shape::vectors(32, 64), &[0.5; 32 * 64]);
        let y = graph.linear(graph.linear(x, weight, bias, Curve::Tanh), weight, bias, Curve::Relu);
        graph.backward(graph.mean(graph.square(y)));
        graph.places()
    };
    let first = places();
    assert!(first.len() > 4);
    assert_eq!(places(), first);
    assert_eq!(places(), first);
}
