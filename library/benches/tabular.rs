//! How long an update of a table takes: `cargo bench -p ivx-library --bench tabular`.
//!
//! Those of §C.2.1: 25 states, 4 actions, batches of 128. Beside each, how long the arithmetic takes that it cannot
//! do without, alone and in cache: Adam over the table, and the softmax of the rows of a batch.
//! `benches/tabular.sh` runs `NumPy` and JAX beside it.

use std::hint::black_box;
use std::time::Instant;

use ivx_library::agent::tabular::{TabularModel, TabularValues, UniformPolicy};
use ivx_library::agent::{Act, Tabular};
use ivx_nn::optim::{self, Moments, Pull};
use ivx_nn::{Adam, Constant, Graph, Optimiser, Params, Shape};
use ivx_op::{Ctx, One, Op as _};
use ivx_world::{Env, Gridworld};

const EPOCHS: u64 = 4_000;
/// Of 500 steps there are three batches of 128.
const UPDATES: f64 = 3.0 * 4_000.0;
const ROUNDS: usize = 7;

fn world() -> Box<dyn Env> {
    Box::new(Gridworld { size: 5, wind: 0.1 })
}

fn adam() -> Box<dyn Optimiser> {
    let lr = Box::new(Constant { value: 5e-3 });
    Box::new(Adam { lr, beta1: 0.9, beta2: 0.999, eps: 1e-8 })
}

/// The median of several rounds, in microseconds for each of `n`.
fn each(n: f64, mut run: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let began = Instant::now();
            run();
            began.elapsed().as_secs_f64() * 1e6 / n
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[ROUNDS / 2]
}

/// Adam over a table of this size.
fn adam_alone(size: usize) -> f64 {
    let (mut params, grads) = (vec![0.5_f32; size], vec![1e-3_f32; size]);
    let mut moments = Moments::zeros(size);
    let (beta1, beta2, eps, weight_decay, pull) = (0.9, 0.999, 1e-8, 0.0, Pull::NONE);
    let rule = optim::Adam { lr: 1e-3, beta1, beta2, eps, weight_decay, pull };
    each(20_000.0, || {
        for t in 0..20_000 {
            optim::adam(&rule, t, &mut params, black_box(&grads), &mut moments);
        }
    })
}

/// The softmax of as many rows as a batch has.
fn softmax_alone() -> f64 {
    let (graph, shape) = (Graph::new(Params::<f32>::default()), Shape::vectors(128, 25));
    let logits = vec![0.5_f32; shape.len()];
    each(2_000.0, || {
        for _ in 0..2_000 {
            graph.begin();
            let x = graph.input(shape, black_box(&logits));
            black_box(graph.still(|| graph.log_softmax(x)));
        }
    })
}

#[expect(clippy::print_stdout, reason = "a bench tells what it measured")]
fn main() {
    let ctx = Ctx::new("bench", 0, None);
    let policy = || One(UniformPolicy { r#in: world() }.run(&ctx).expect("it is a world"));
    let act = || {
        let (policy, stream) = (policy(), "main".to_owned());
        One(Act {
            actor: Box::new(Tabular { policy }),
            r#in: world(),
            episodes: 25,
            limit: 20,
            stream,
            keeps: Vec::new(),
        }
        .run(&ctx)
        .expect("it acts"))
    };
    let (batch, member, bootstrap) = (128, 0, false);
    let op = TabularValues {
        from: act(),
        policy: policy(),
        discount: 0.9,
        optimiser: adam(),
        epochs: EPOCHS,
        batch,
        member,
        bootstrap,
    };
    let values = each(UPDATES, || drop(black_box(op.run(&ctx))));
    let op =
        TabularModel { from: act(), optimiser: adam(), epochs: EPOCHS, batch, member, bootstrap };
    let model = each(UPDATES, || drop(black_box(op.run(&ctx))));
    println!("values {values:.2} us an update; Adam alone {:.2}", adam_alone(100));
    let (adam, softmax) = (adam_alone(2_500), softmax_alone());
    println!("model  {model:.2} us an update; Adam alone {adam:.2}, softmax alone {softmax:.2}");
}
