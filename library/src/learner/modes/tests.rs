use ivx_data::Names;
use ivx_op::{Artifact as _, Gathered, Held, Labels, Lit, One, Op as _, Part};

use super::*;
use crate::learner::{Learner, learners};
use crate::metric::MinAde;
use crate::planner::Modes as MostProbable;

const CTX: Ctx = Ctx::new("train", 0, Some(1));

/// Plans of two places, straight on or to the left, by the first of two numbers, and about 0.1 off.
fn data() -> Dataset {
    let form = Form { input: vec![2], target: vec![2, 2], ..Form::default() };
    let x: Vec<f64> = (0..16).flat_map(|i| [f64::from(i % 2), f64::from(i) / 16.0]).collect();
    let plan = |x: &[f64]| [1.0, x[0], 2.0, 4.0 * x[0]];
    let y = x.chunks_exact(2).flat_map(plan).enumerate();
    let y = y.map(|(i, y)| y + 0.1 * (1.7 * ivx_math::moments::real(i)).sin()).collect();
    Dataset { form, x, y }
}

fn anchors(sizes: [usize; 3], values: Vec<f64>) -> Array {
    let dims = ["plan", "step", "dim"].into_iter().zip(sizes);
    Array { dims: dims.map(|(name, n)| Dim::new(name, Labels::count(n))).collect(), values }
}

fn ways() -> Array {
    anchors([3, 2, 2], vec![1.0, 0.0, 2.0, 0.0, 1.0, 1.0, 2.0, 4.0, 0.0, 0.0, 0.0, 0.0])
}

fn part(name: &str, anchors: &Array, lr: f64) -> Part {
    let rate = Part::new("constant").with("value", lr);
    let part = Part::new(name)
        .with("net", Part::new("mlp").with("hidden", vec![8_i64]))
        .with("features", 4_i64)
        .with("merge", vec![8_i64])
        .with("prior", Part::new("flat"))
        .with("optimiser", Part::new("adam").with("lr", rate));
    if name == "mtp" {
        return part;
    }
    let values = vec![anchors.encode().into()];
    let held = Gathered { dims: Vec::new(), values, name: String::new() };
    part.with("anchors", Lit::Held(Held::Value(held)))
}

fn built(part: &Part) -> Box<dyn Learner> {
    learners().build(&crate::registry().complete(part)).unwrap()
}

fn learner(name: &str) -> Box<dyn Learner> {
    built(&part(name, &ways(), 0.01))
}

const NAMES: [&str; 3] = ["mtp", "multipath", "covernet"];

#[test]
fn the_most_probable_come_first_and_are_measured() {
    for name in NAMES {
        let model = learner(name).train(&data(), 400, &CTX).unwrap();
        assert_eq!(Model::decode(&model.encode()).as_ref(), Some(&model));
        let (on, first) = (|| One(data()), model.predict(&data().x));
        let ask = |modes| MostProbable { model: One(model.clone()), on: on(), modes };
        let found = ask(3).run(&CTX).unwrap();
        let dims: Vec<_> = found.plans.dims.iter().map(|dim| (&dim.name[..], dim.len())).collect();
        assert_eq!(dims, [("row", 16), ("mode", 3), ("step", 2), ("dim", 2)]);
        for (row, worth) in found.worth.values.chunks_exact(3).enumerate() {
            assert!(worth.is_sorted_by(|a, b| a >= b), "{name}: {worth:?}");
            let sum: f64 = worth.iter().map(|x| x.exp()).sum();
            assert!((sum - 1.0).abs() < 1e-6, "{name}: {sum}");
            assert_eq!(found.plans.values[row * 12..][..4], first[row * 4..][..4]);
        }
        let ade = |k| {
            let (plans, worth) = (One(found.plans.clone()), One(found.worth.clone()));
            let each = MinAde { plans, worth, to: on(), k }.run(&CTX).unwrap().values;
            ivx_math::moments::mean(&each)
        };
        // What came is about one of the anchors, and depends on what is seen: the other is 2.5 off.
        assert!(ade(1) < 0.2 && ade(3) <= ade(1), "{name}: {} {}", ade(1), ade(3));
        let why = ask(4).run(&CTX).map(drop).unwrap_err().to_string();
        assert_eq!(why, "the model has 3 modes, and 4 are asked for");
    }
}

#[test]
fn a_model_without_modes_has_none() {
    let ask = |model, on| MostProbable { model: One(model), on: One(on), modes: 1 };
    let why = |model, on| ask(model, on).run(&CTX).map(drop).unwrap_err().to_string();
    let ridge = built(&Part::new("ridge")).train(&data(), 0, &CTX).unwrap();
    let expected = "the model has no modes: use one that `mtp`, `multipath` or `covernet` learned";
    assert_eq!(why(ridge.clone(), data()), expected);
    let flat = Dataset { form: Form { target: vec![4], ..data().form }, ..data() };
    assert!(why(ridge, flat.clone()).starts_with("the model is of"));
    let of_flat = built(&Part::new("ridge")).train(&flat, 0, &CTX).unwrap();
    assert!(why(of_flat, flat).starts_with("`modes` is of plans, and the data are"));
}

#[test]
fn what_cannot_be_learned_is_told() {
    let form = data().form;
    let other = Form { target: vec![4], names: Names::default(), ..form.clone() };
    let misfit = |learner: &dyn Learner, form: &Form| learner.fits(form).unwrap_err().message;
    for name in NAMES {
        assert!(learner(name).fits(&form).is_ok());
        let why = misfit(&*learner(name), &other);
        assert!(why.starts_with("a model of modes is of plans, and the data are"), "{why}");
        let wild = built(&part(name, &ways(), 1e30)).train(&data(), 20, &CTX).map(drop);
        let why = wild.unwrap_err().to_string();
        assert_eq!(why, "training diverged within 20 steps: lower the learning rate", "{name}");
        let nothing = Dataset { x: vec![], y: vec![], ..data() };
        let why = learner(name).train(&nothing, 1, &CTX).map(drop).unwrap_err().to_string();
        assert_eq!(why, "there are no data to train on");
    }
    for name in &NAMES[1..] {
        let scaled = Part::new("scaled").with("learner", part(name, &ways(), 0.01));
        let why = misfit(&*built(&scaled), &form);
        assert_eq!(why, "modes are in the units of the data, and these targets are scaled");
        assert!(built(&scaled.with("targets", false)).fits(&form).is_ok());
        let of = |anchors: Array| built(&part(name, &anchors, 0.01));
        let why = misfit(&*of(anchors([2, 3, 2], vec![0.0; 12])), &form);
        assert_eq!(why, "the anchors are an array of 2 × 3 × 2, and plans of the data of 2 × 2");
        assert!(of(anchors([0, 2, 2], vec![])).fits(&form).is_err());
        let mut values = vec![0.0; 8];
        values[6] = f64::INFINITY;
        let why = misfit(&*of(anchors([2, 2, 2], values)), &form);
        assert_eq!(why, "number 2 of anchor 1 is inf");
        // What is still to be computed may fit, and has no number of modes yet.
        let later = of(Array::scalar(f64::NAN));
        assert!(later.fits(&form).is_ok() && later.modes() == Some(vec![]));
        let why = later.train(&data(), 1, &CTX).map(drop).unwrap_err().to_string();
        assert!(why.starts_with("the anchors are a number"), "{why}");
        assert_eq!(learner(name).modes(), Some(vec![3]));
    }
}

/// Layers of `2 → 8 → 4`, `4 → 8` and `8 →` a logit for each of three modes and what stands behind it.
#[test]
fn memory_and_passes_by_hand() {
    let before = (3 * 8 + 9 * 4 + 5 * 8, 8 + 4 + 8);
    for (name, out) in NAMES.into_iter().zip([3 * 5, 3 * 9, 3]) {
        let (params, outputs) = (before.0 + 9 * out, before.1 + out);
        let expected = params * 24 + outputs * 16 * 12 + 16 * 4 * 6;
        assert_eq!(learner(name).memory(&data().form, 16), expected, "{name}");
        let some = built(&part(name, &ways(), 0.01).with("batch", 3_i64));
        let passes = [0, 2, 7].map(|n| some.updates_in_a_pass(n));
        assert!(passes == [1, 1, 2] && some.makes_networks(), "{passes:?}");
        assert_eq!(some.train(&data(), 5, &CTX), some.train(&data(), 5, &CTX));
        let other = Ctx::new("train", 0, Some(2));
        assert_ne!(some.train(&data(), 5, &CTX), some.train(&data(), 5, &other));
    }
}
