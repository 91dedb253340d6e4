use ivx_op::Part;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::graph::Shape;
use crate::net::nets;
use crate::registry;
use crate::{Graph, ParamId, Params};

fn built(part: &Part, input: &[usize]) -> Module {
    nets().build(&registry().complete(part)).unwrap().module(input).unwrap()
}

fn layers(of: &str, parts: Vec<Part>) -> Part {
    let parts: Vec<ivx_op::Lit> = parts.into_iter().map(Into::into).collect();
    Part::new(of).with("layers", ivx_op::Lit::List(parts))
}

/// The network in double precision, its arrays moved away from where they start.
fn network(module: &Module, seed: u64) -> (Graph<f64>, Vec<ParamId>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut params = Params::default();
    for array in module.arrays() {
        let n = array.shape.iter().product();
        let start = array.start.draw(n, &mut rng).into_iter().map(f64::from);
        let values = start.map(|x| x + 0.1 * rng.random::<f64>()).collect();
        if array.learns {
            params.add(array.name, array.shape, values);
        } else {
            params.add_fixed(array.name, array.shape, values);
        }
    }
    let ids = params.ids().collect();
    (Graph::new(params), ids)
}

/// The sum of what comes out, each number weighed by a number of its own, and how it changes with every
/// learned number and every input: by the tape, and by central differences.
fn check_gradients(name: &str, module: &Module, input: &[usize], n: usize, dropout: bool) {
    let (graph, ids) = network(module, 3);
    let width: usize = input.iter().product();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let inputs: Vec<f64> = (0..n * width).map(|_| rng.random_range(-1.0..1.0)).collect();
    let output: usize = module.output(input).unwrap().iter().product();
    let weights: Vec<f64> = (0..n * output).map(|_| rng.random_range(-1.0..1.0)).collect();
    let start = graph.params().clone();
    let pass = |inputs: &[f64]| {
        graph.begin();
        let x = graph.variable(batch(n, input), inputs);
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut mode = if dropout { Mode::Train(&mut rng) } else { Mode::Predict };
        let y = module.pass(&graph, &ids, (x, input), &mut mode);
        assert_eq!(graph.shape(y).len(), n * output, "{name}");
        let weighed = graph.mul(y, graph.input(graph.shape(y), &weights));
        (x, graph.sum(weighed))
    };
    let (x, loss) = pass(&inputs);
    graph.backward(loss);
    let of_input = graph.grad(x);
    let of_params: Vec<Option<Vec<f64>>> =
        ids.iter().map(|id| graph.params().grad(*id).map(<[f64]>::to_vec)).collect();
    let value = |inputs: &[f64]| {
        let (_, loss) = pass(inputs);
        graph.scalar(loss)
    };
    // Training moves the running statistics, so that every pass begins with the same.
    let reset = || *graph.params() = start.clone();
    let h = 1e-5;
    let near = |what: &str, slope: f64, ahead: f64, behind: f64| {
        let difference = (ahead - behind) / (2.0 * h);
        let close = (slope - difference).abs() < 1e-6 * slope.abs().max(1.0);
        assert!(close, "{name} {what}: {slope} and {difference}");
    };
    for i in (0..inputs.len()).step_by(inputs.len().div_ceil(12)) {
        let at = |h: f64| {
            reset();
            let mut inputs = inputs.clone();
            inputs[i] += h;
            value(&inputs)
        };
        near("x", of_input[i], at(h), at(-h));
    }
    for (id, slopes) in ids.iter().zip(of_params) {
        let Some(slopes) = slopes else { continue };
        for i in (0..slopes.len()).step_by(slopes.len().div_ceil(6)) {
            let at = |h: f64| {
                reset();
                graph.params().value_mut(*id)[i] += h;
                value(&inputs)
            };
            near("parameter", slopes[i], at(h), at(-h));
        }
    }
}

fn with(part: &str, args: &[(&str, i64)]) -> Part {
    args.iter().fold(Part::new(part), |part, (name, value)| part.with(name, *value))
}

fn dense(units: i64) -> Part {
    with("dense", &[("units", units)]).with("activation", Part::new("silu"))
}

/// Every network of the language, with an input that it takes.
fn every() -> Vec<(Part, Vec<usize>)> {
    let tanh = || Part::new("tanh");
    let conv = |channels, kernel, stride, padding, groups| {
        with(
            "conv",
            &[
                ("channels", channels),
                ("kernel", kernel),
                ("stride", stride),
                ("padding", padding),
                ("groups", groups),
            ],
        )
        .with("activation", tanh())
    };
    let small = |part: Part| layers("sequence", vec![part, Part::new("flatten"), dense(2)]);
    vec![
        (with("mlp", &[]).with("hidden", vec![5_i64, 4]), vec![]),
        (with("mlp", &[]).with("hidden", vec![3_i64]), vec![4]),
        (with("mlp", &[]).with("hidden", vec![3_i64]), vec![2, 4]),
        (
            with("cnn", &[])
                .with("channels", vec![2_i64, 3])
                .with("kernels", vec![3_i64, 2])
                .with("strides", vec![2_i64, 1])
                .with("hidden", vec![4_i64])
                .with("activation", tanh()),
            vec![2, 7, 6],
        ),
        (with("gru", &[("units", 3), ("layers", 2)]), vec![4, 2]),
        (with("lstm", &[("units", 3)]), vec![5, 2]),
        (layers("sequence", vec![with("gru", &[("units", 3)]), Part::new("last")]), vec![3, 2]),
        (small(conv(4, 3, 1, 1, 2)), vec![2, 4, 4]),
        // One channel, and a kernel as large as the image.
        (small(conv(3, 4, 1, 0, 1)), vec![1, 4, 4]),
        (small(with("conv_transpose", &[("channels", 2), ("stride", 2)])), vec![3, 3, 2]),
        (small(with("mean_pool", &[])), vec![2, 4, 5]),
        (small(with("max_pool", &[("size", 3), ("padding", 1)])), vec![2, 5, 5]),
        (small(Part::new("global_pool")), vec![3, 4, 4]),
        (small(layers("residual", vec![conv(2, 3, 1, 1, 1)])), vec![2, 3, 3]),
        (small(Part::new("batch_norm")), vec![2, 3, 3]),
        (layers("sequence", vec![dense(4), Part::new("batch_norm")]), vec![3]),
        (layers("sequence", vec![Part::new("layer_norm"), dense(3)]), vec![2, 3]),
        (layers("sequence", vec![dense(6), Part::new("dropout"), dense(3)]), vec![2]),
        (
            layers(
                "sequence",
                vec![with("inverted_residual", &[("channels", 2), ("expansion", 2)]), dense_flat()],
            ),
            vec![2, 4, 4],
        ),
    ]
}

fn dense_flat() -> Part {
    layers("sequence", vec![Part::new("flatten"), with("dense", &[("units", 2)])])
}

#[test]
fn gradients_of_every_network_agree_with_central_differences() {
    for (part, input) in every() {
        let module = built(&part, &input);
        for n in [2, 3] {
            check_gradients(&part.to_string(), &module, &input, n, true);
        }
        for n in [1, 2] {
            check_gradients(&part.to_string(), &module, &input, n, false);
        }
    }
}

#[test]
fn dropout_leaves_out_its_share_and_keeps_the_mean() {
    let module = Module::Dropout { rate: 0.25, shape: vec![4000] };
    let graph = Graph::<f64>::new(Params::default());
    let x = graph.input(Shape::vectors(1, 4000), &vec![1.0; 4000]);
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let y = module.pass(&graph, &[], (x, &[4000]), &mut Mode::Train(&mut rng));
    let values = graph.value(y);
    let out = values.iter().filter(|y| **y == 0.0).count();
    // A binomial of mean 1000 and deviation 27.
    assert!((900..1100).contains(&out), "{out}");
    assert!(values.iter().all(|y| *y == 0.0 || (*y - 4.0 / 3.0).abs() < 1e-12));
    let whole = module.pass(&graph, &[], (x, &[4000]), &mut Mode::Predict);
    assert!(graph.value(whole).iter().all(|y| *y == 1.0));
}

#[test]
fn batch_normalisation_predicts_by_what_it_has_seen() {
    // Ten equal batches of 1 and 3: mean 2, unbiased variance 2; the running ones have come
    // 1 − 0.9¹⁰ of the way from 0 and 1.
    let module = Module::BatchNorm { channels: 1 };
    let mut params = Params::<f64>::default();
    for array in module.arrays() {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let values = array.start.draw(1, &mut rng).into_iter().map(f64::from).collect();
        params.add(array.name, array.shape, values);
    }
    let ids: Vec<ParamId> = params.ids().collect();
    let graph = Graph::new(params);
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let pass = |mode: &mut Mode<'_>| {
        graph.begin();
        let x = graph.input(Shape::vectors(2, 1), &[1.0, 3.0]);
        graph.value(module.pass(&graph, &ids, (x, &[1]), mode))
    };
    for _ in 0..10 {
        let y = pass(&mut Mode::Train(&mut rng));
        assert!((y[0] + 1.0).abs() < 1e-4 && (y[1] - 1.0).abs() < 1e-4);
    }
    let way = 1.0 - 0.9_f64.powi(10);
    let (mean, variance) = (2.0 * way, 1.0 + way);
    let y = pass(&mut Mode::Predict);
    for (y, x) in y.iter().zip([1.0, 3.0]) {
        assert!((y - (x - mean) / (variance + 1e-5).sqrt()).abs() < 1e-12);
    }
}

#[test]
fn an_unrolled_layer_is_its_cell_step_by_step() {
    // The second step sees the first only through the state.
    let module = Module::Gru { inputs: 2, units: 3 };
    let (graph, ids) = network(&module, 1);
    let run = |xs: &[f64], steps: usize| {
        graph.begin();
        let x = graph.input(Shape::vectors(1, xs.len()), xs);
        graph.value(module.pass(&graph, &ids, (x, &[steps, 2]), &mut Mode::Predict))
    };
    let (short, long) = (run(&[0.5, -1.0], 1), run(&[0.5, -1.0, 2.0, 0.0], 2));
    assert_eq!(short, long[..3]);
    assert_ne!(run(&[0.1, -1.0, 2.0, 0.0], 2)[3..], long[3..]);
}

#[test]
fn what_does_not_fit_is_told() {
    let check = |module: Module, input: &[usize], expected: &str| {
        let misfit = module.output(input).unwrap_err();
        assert!(misfit.message.contains(expected), "{}", misfit.message);
        assert!(!misfit.help.is_empty());
    };
    let conv = |inputs, kernel, groups| Module::Conv {
        inputs,
        outputs: 4,
        window: Window { kernel, stride: 1, padding: 0 },
        groups,
        bias: true,
        curve: Curve::Identity,
    };
    let dense = Module::Dense { inputs: 3, outputs: 1, curve: Curve::Identity };
    check(dense.clone(), &[4], "a layer for 3 numbers takes no 4");
    check(dense, &[1, 3, 1], "takes vectors and sequences, not images of 1 × 3 × 1");
    check(conv(1, 3, 1), &[], "images of channels × rows × columns, not numbers");
    check(conv(1, 3, 1), &[1, 2, 5], "a window of 3 × 3 does not fit into images of 1 × 2 × 5");
    check(conv(3, 1, 2), &[3, 5, 5], "do not make 2 equal groups");
    check(
        Module::Gru { inputs: 1, units: 2 },
        &[7],
        "sequences of steps × length, not vectors of 7",
    );
    check(Module::Last, &[7], "takes sequences, not vectors of 7");
    check(Module::GlobalPool, &[1, 2, 3], "takes square images");
    let halves = Module::MaxPool(Window { kernel: 2, stride: 2, padding: 0 });
    check(
        Module::Residual(vec![halves]),
        &[1, 4, 4],
        "adds images of 1 × 2 × 2 to images of 1 × 4 × 4",
    );
    check(
        Module::MaxPool(Window { kernel: 2, stride: 1, padding: 2 }),
        &[1, 4, 4],
        "wholly in a padding",
    );
}

#[test]
fn indices_without_an_entry_are_refused() {
    let embedding =
        Module::Sequence(vec![Module::Embedding { entries: 3, width: 2 }, Module::Last]);
    assert_eq!(embedding.accepts(&[0.0, 2.0]), Ok(()));
    for odd in [3.0, -1.0, 0.5] {
        assert!(embedding.accepts(&[0.0, odd]).unwrap_err().contains("no index of the 3 entries"));
    }
    let module = Module::Sequence(vec![Module::Flatten]);
    assert_eq!(module.accepts(&[0.5]), Ok(()));
}
