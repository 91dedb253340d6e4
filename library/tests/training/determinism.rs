//! One training has one result, bit for bit.

use ivx_nn::Shape;
use ivx_nn::optim::Moments;
use ivx_op::{Data, Tensors};
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

use crate::nets::{Make, STEPS, TASKS, Training};

/// Everything that a training has learned and keeps, as bytes.
fn bytes(training: &Training) -> Vec<u8> {
    let mut tensors = Tensors::default();
    let mut put = |name: String, values: &[f32]| {
        tensors.arrays.insert(name, Data::F32(vec![values.len()], values.to_vec()));
    };
    let params = training.graph.params();
    for (param, moments) in params.arrays().iter().zip(&training.moments) {
        put(format!("{}.value", param.name), &param.value);
        put(format!("{}.first", param.name), &moments.first);
        put(format!("{}.second", param.name), &moments.second);
    }
    tensors.encode("Training", &training.t)
}

/// Puts back what [`bytes`] kept.
fn restore(training: &mut Training, bytes: &[u8]) {
    let (mut tensors, t) = Tensors::decode("Training", bytes).expect("the bytes are of a training");
    let mut take = |name: String| tensors.f32(&name).expect("every array is kept").1;
    let mut params = training.graph.params();
    let names: Vec<_> = params.arrays().iter().map(|param| param.name.clone()).collect();
    for ((name, value), moments) in names.iter().zip(params.values_mut()).zip(&mut training.moments)
    {
        value.copy_from_slice(&take(format!("{name}.value")));
        let (first, second) = (take(format!("{name}.first")), take(format!("{name}.second")));
        *moments = Moments { first, second };
    }
    training.t = t;
}

fn trained(task: Make, seed: u64) -> Vec<u8> {
    let mut training = Training::new(task(seed));
    finish(&mut training);
    bytes(&training)
}

fn finish(training: &mut Training) {
    while training.t < STEPS {
        training.step();
    }
}

#[test]
fn a_training_ends_in_the_same_bits_and_another_seed_in_others() {
    for (name, task) in TASKS {
        let one = trained(task, 0);
        assert_eq!(trained(task, 0), one, "{name}");
        assert_ne!(trained(task, 1), one, "{name}");
    }
}

#[test]
fn members_are_the_same_alone_and_beside_others() {
    for (name, task) in TASKS {
        let alone: Vec<_> = (0..4).map(|seed| trained(task, seed)).collect();
        for threads in [1, 2] {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            let together: Vec<_> =
                pool.install(|| (0..4).into_par_iter().map(|seed| trained(task, seed)).collect());
            assert!(together == alone, "{name} on {threads} threads");
        }
    }
}

#[test]
fn a_training_that_was_kept_goes_on_to_the_same_bits() {
    for (name, task) in TASKS {
        let mut first = Training::new(task(0));
        for _ in 0..STEPS / 2 {
            first.step();
        }
        let kept = bytes(&first);
        let mut second = Training::new(task(0));
        restore(&mut second, &kept);
        assert!(bytes(&second) == kept, "{name} is kept whole");
        finish(&mut second);
        assert!(bytes(&second) == trained(task, 0), "{name}");
    }
}

/// A graph that has made other passes before holds nothing of them.
#[test]
fn other_passes_between_steps_change_nothing() {
    for (name, task) in TASKS {
        let mut training = Training::new(task(0));
        for _ in 0..STEPS {
            training.graph.begin();
            let x = training.graph.variable(Shape::vectors(3, 50), &[0.5; 150]);
            training.graph.backward(training.graph.mean(training.graph.square(x)));
            training.step();
        }
        assert!(bytes(&training) == trained(task, 0), "{name}");
    }
}
