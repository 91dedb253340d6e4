//! Plans that climb, as an optimiser of others does.

use ivx_library::planner::{GradientPlan, Objective, Planner as _, Space};
use ivx_world::Luck;
use serde_json::{Value, json};

use crate::harness::{Case, check_where, numbers, rows};

#[test]
fn golden_plans_climb_by_the_steps_of_adam() {
    check_where("optim_adam_adamw", is_of_a_plan, climbed);
}

/// The other cases have moments or clips that no plan has.
fn is_of_a_plan(case: &Case) -> bool {
    let inputs = &case.inputs;
    case.kind == "adam"
        && inputs["beta1"] == 0.9
        && inputs["beta2"] == 0.999
        && inputs["eps"] == 1e-8
        && inputs["clip_global_norm"].is_null()
}

/// What goes down slopes of a loss climbs those of its negative.
fn climbed(case: &Case, path: &[&str]) -> Option<Value> {
    let inputs = &case.inputs;
    let (start, slopes) = (numbers(&inputs["params"]), rows(&inputs["grads"]));
    let rate = inputs["lr"].as_f64()?;
    let after = |steps: usize| {
        let (low, high) = (vec![f64::NEG_INFINITY; start.len()], vec![f64::INFINITY; start.len()]);
        let mut hill = Hill { space: Space::Continuous { low, high }, slopes: &slopes, asked: 0 };
        let (mut plan, mut worth) = (start.clone(), [0.0]);
        let mut climbing = GradientPlan { steps, rate }.open();
        climbing.plan(&mut hill, &mut plan, &mut worth, &mut Luck::numpy(0)).expect("a plan");
        plan
    };
    let norm = |slope: &Vec<f64>| slope.iter().map(|x| x * x).sum::<f64>().sqrt();
    match path {
        ["params_after_each_step"] => {
            Some(json!((1..=slopes.len()).map(after).collect::<Vec<_>>()))
        }
        ["lr_per_step"] => Some(json!(vec![rate; slopes.len()])),
        ["grad_norm_before_clip"] => Some(json!(slopes.iter().map(norm).collect::<Vec<_>>())),
        _ => None,
    }
}

/// Slopes one after the other, of a hill on which every place is higher than the one before.
struct Hill<'a> {
    space: Space,
    slopes: &'a [Vec<f64>],
    asked: usize,
}

impl Objective for Hill<'_> {
    fn rows(&self) -> usize {
        1
    }

    fn len(&self) -> usize {
        self.slopes[0].len()
    }

    fn space(&self) -> &Space {
        &self.space
    }

    fn worth(&mut self, _: &[f64], _: usize, worth: &mut [f64]) {
        #[expect(clippy::cast_precision_loss, reason = "there are a few")]
        worth.fill(self.asked as f64);
    }

    fn slope(&mut self, plans: &[f64], worth: &mut [f64], slope: &mut [f64]) -> bool {
        self.worth(plans, 1, worth);
        slope.iter_mut().zip(&self.slopes[self.asked]).for_each(|(up, down)| *up = -down);
        self.asked += 1;
        true
    }
}
