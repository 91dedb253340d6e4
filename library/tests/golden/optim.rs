//! Optimisers, in double precision (torch, optax).

use ivx_nn::optim::{
    self, Moments, Pull, RmsProp, clip_global_norm, clip_value, global_norm, target_update,
};
use ivx_nn::{Constant, Cosine, Linear, Schedule, WarmUp};
use serde_json::{Value, json};

use crate::harness::{Case, check, numbers, rows};

#[test]
fn golden_optimisers_agree() {
    for topic in ["optim_adam_adamw", "optim_schedules_clips"] {
        check(topic, |case, path| {
            let ours = run(case);
            path.iter().try_fold(&ours, |value, key| value.get(key)).cloned()
        });
    }
}

fn run(case: &Case) -> Value {
    let inputs = Inputs(case);
    match case.kind.as_str() {
        "adam" | "adamw" => adam(&inputs),
        "sgd" => sgd(&inputs),
        "rmsprop" => rmsprop(&inputs),
        "target_update" => polyak(&inputs),
        "schedule" => schedule(&inputs),
        "clipped" => clipped(&inputs),
        other => panic!("{}: no code for the kind `{other}`", case.name),
    }
}

/// The inputs of a case; all access goes through here so that none is overlooked.
struct Inputs<'a>(&'a Case);

impl Inputs<'_> {
    /// Fails if there is an input that the code for the case does not read.
    fn are(&self, known: &[&str]) {
        for key in self.0.inputs.as_object().expect("inputs have names").keys() {
            assert!(
                known.contains(&key.as_str()),
                "{}: no code for the input `{key}`",
                self.0.name
            );
        }
    }

    /// A number; none where it is left out or null.
    fn number(&self, name: &str) -> Option<f64> {
        let value = &self.0.inputs[name];
        assert!(value.is_number() || value.is_null(), "{}: `{name}` is {value}", self.0.name);
        value.as_f64()
    }

    fn required(&self, name: &str) -> f64 {
        self.number(name).unwrap_or_else(|| panic!("{}: needs `{name}`", self.0.name))
    }

    fn vector(&self, name: &str) -> Vec<f64> {
        numbers(&self.0.inputs[name])
    }

    fn matrix(&self, name: &str) -> Vec<Vec<f64>> {
        rows(&self.0.inputs[name])
    }
}

/// Order of an update: clip, decay, Adam.
fn adam(inputs: &Inputs<'_>) -> Value {
    inputs.are(&[
        "lr",
        "beta1",
        "beta2",
        "eps",
        "weight_decay",
        "linear_decay_steps",
        "clip_global_norm",
        "params",
        "grads",
    ]);
    let lr = inputs.required("lr");
    let decay_steps = inputs.0.inputs["linear_decay_steps"].as_u64();
    let schedule: Box<dyn Schedule> = match decay_steps {
        Some(_) => Box::new(Linear { from: lr, to: 0.0 }),
        None => Box::new(Constant { value: lr }),
    };
    let mut rule = optim::Adam {
        lr,
        beta1: inputs.required("beta1"),
        beta2: inputs.required("beta2"),
        eps: inputs.required("eps"),
        weight_decay: inputs.number("weight_decay").unwrap_or(0.0),
        pull: Pull::NONE,
    };
    let mut params = inputs.vector("params");
    let mut moments = Moments::zeros(params.len());
    let (mut rates, mut norms, mut path) = (Vec::new(), Vec::new(), Vec::new());
    for (t, mut grads) in (0..).zip(inputs.matrix("grads")) {
        rule.lr = schedule.at(t, decay_steps.unwrap_or(0));
        rates.push(rule.lr);
        let norm = global_norm([&grads[..]]);
        norms.push(norm);
        if let Some(max_norm) = inputs.number("clip_global_norm") {
            clip_global_norm([&mut grads[..]], norm, max_norm);
        }
        optim::adam(&rule, t, &mut params, &grads, &mut moments);
        path.push(params.clone());
    }
    json!({ "lr_per_step": rates, "grad_norm_before_clip": norms, "params_after_each_step": path })
}

fn sgd(inputs: &Inputs<'_>) -> Value {
    inputs.are(&["params", "grads", "lr", "momentum"]);
    let (lr, momentum) = (inputs.required("lr"), inputs.number("momentum").unwrap_or(0.0));
    let mut params = inputs.vector("params");
    let mut velocity = vec![0.0; params.len()];
    let path = inputs.matrix("grads").into_iter().map(|grads| {
        optim::sgd(lr, momentum, &mut params, &grads, &mut velocity);
        params.clone()
    });
    json!({ "params_after_each_step": path.collect::<Vec<_>>() })
}

fn rmsprop(inputs: &Inputs<'_>) -> Value {
    inputs.are(&["params", "grads", "lr", "alpha", "eps", "centered"]);
    let rule = RmsProp {
        lr: inputs.required("lr"),
        decay: inputs.required("alpha"),
        eps: inputs.required("eps"),
        centered: inputs.0.inputs["centered"].as_bool().unwrap_or(false),
    };
    let mut params = inputs.vector("params");
    let mut moments = Moments::zeros(params.len());
    let path = inputs.matrix("grads").into_iter().map(|grads| {
        optim::rmsprop(&rule, &mut params, &grads, &mut moments);
        params.clone()
    });
    json!({ "params_after_each_step": path.collect::<Vec<_>>() })
}

fn polyak(inputs: &Inputs<'_>) -> Value {
    inputs.are(&["online", "target", "tau"]);
    let mut target = inputs.vector("target");
    target_update(&mut target, &inputs.vector("online"), inputs.required("tau"));
    json!({ "target_new": target })
}

/// The rates of a whole training, and of steps after it.
fn schedule(inputs: &Inputs<'_>) -> Value {
    inputs.are(&["steps", "warm_up", "cosine", "linear"]);
    let count = |name: &str| inputs.0.inputs[name].as_u64().expect("steps are counted");
    let ends = |name: &str| match inputs.0.inputs[name].as_array() {
        Some(_) => <[f64; 2]>::try_from(inputs.vector(name)).ok(),
        None => None,
    };
    let then: Box<dyn Schedule> = match (ends("cosine"), ends("linear")) {
        (Some([from, to]), None) => Box::new(Cosine { from, to }),
        (None, Some([from, to])) => Box::new(Linear { from, to }),
        other => panic!("{}: one schedule, not {other:?}", inputs.0.name),
    };
    let (steps, warm_up) = (count("steps"), count("warm_up"));
    let schedule = if warm_up == 0 { then } else { Box::new(WarmUp { steps: warm_up, then }) };
    json!({ "values": (0..steps + 3).map(|t| schedule.at(t, steps)).collect::<Vec<_>>() })
}

/// Order of an update: clip, pull, momentum.
fn clipped(inputs: &Inputs<'_>) -> Value {
    inputs.are(&["params", "grads", "lr", "momentum", "l2", "clip_norm", "clip_value"]);
    let (lr, momentum) = (inputs.required("lr"), inputs.required("momentum"));
    let pull = Pull { l2: inputs.required("l2"), ..Pull::NONE };
    let mut params = inputs.matrix("params");
    let mut velocities: Vec<_> = params.iter().map(|array| vec![0.0; array.len()]).collect();
    let steps = inputs.0.inputs["grads"].as_array().expect("a list of steps");
    let path = steps.iter().map(rows).map(|mut grads| {
        if let Some(limit) = inputs.number("clip_value") {
            clip_value(grads.iter_mut().map(Vec::as_mut_slice), limit);
        }
        if let Some(limit) = inputs.number("clip_norm") {
            let norm = global_norm(grads.iter().map(Vec::as_slice));
            clip_global_norm(grads.iter_mut().map(Vec::as_mut_slice), norm, limit);
        }
        for ((params, grads), velocity) in params.iter_mut().zip(&mut grads).zip(&mut velocities) {
            optim::add_pull(pull, params, grads);
            optim::sgd(lr, momentum, params, grads, velocity);
        }
        params.concat()
    });
    json!({ "params_after_each_step": path.collect::<Vec<_>>() })
}
