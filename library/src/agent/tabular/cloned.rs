//! Behaviour cloning (§2.2.4): a classifier of actions as a policy.

use ivx_data::Form;
use ivx_data::Misfit;
use ivx_data::form::{failed, told, wrong};
use ivx_math::policy::boltzmann;
use ivx_nn::Model;
use ivx_op::{Array, Ctx, Facts, One, Op, OpError, Wrong, declare};
use ivx_world::{Env, world_is_finite};

declare! {
    /// The policy that takes each action as probably as a classifier of demonstrations names it.
    pub struct ClonedPolicy = "cloned_policy" @ 1 -> Array [state, action] {
        /// The classifier, trained on what `labelled_actions` gives.
        model: One<Model>;
        /// The environment.
        r#in: Box<dyn Env>;
    }
    rule model_of_env;
}

fn model_of_env(facts: &Facts<'_>) -> Result<(), Wrong> {
    world_is_finite(facts)?;
    let env = facts.arg::<Box<dyn Env>>("in").and_then(|env| ivx_world::mdp(&*env).ok());
    match (env, facts.shapes("model").and_then(Form::of)) {
        (Some(mdp), Some(model)) => {
            fits(&model, &form(mdp.n_states(), mdp.n_actions())).map_err(wrong("model"))
        }
        _ => Ok(()),
    }
}

/// A state as a vector, and an action as a class.
fn form(n_states: usize, n_actions: usize) -> Form {
    Form { input: vec![n_states], target: Vec::new(), classes: Some(n_actions), ..Form::default() }
}

fn fits(model: &Form, env: &Form) -> Result<(), Misfit> {
    if model == env {
        return Ok(());
    }
    let message = format!("a policy here is of {}, and the model of {}", told(env), told(model));
    Err(Misfit::new(message, "train it on demonstrations in this environment"))
}

impl Op for ClonedPolicy {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let mdp = ivx_world::mdp(&*self.r#in)?;
        let (n_states, n_actions) = (mdp.n_states(), mdp.n_actions());
        fits(&self.model.form(), &form(n_states, n_actions)).map_err(failed)?;
        let mut states = vec![0.0; n_states * n_states];
        states.iter_mut().step_by(n_states + 1).for_each(|x| *x = 1.0);
        let logits = self.model.predict(&states);
        let rows = logits.chunks(logits.len() / n_states);
        let values = rows.flat_map(|row| match row {
            [second] => boltzmann(&[0.0, *second], 1.0),
            row => boltzmann(row, 1.0),
        });
        Ok(Array { dims: mdp.pairs(), values: values.collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivx_nn::{Curve, Module};
    use ivx_nn::{Head, NetModel};
    use ivx_world::Chain;

    fn cloned(weight: &[f32], outputs: usize, classes: usize) -> Result<Vec<f64>, String> {
        let module = Module::Dense { inputs: 2, outputs, curve: Curve::Identity };
        let arrays = vec![
            ("bias".into(), vec![outputs], vec![0.0; outputs]),
            ("weight".into(), vec![2, outputs], weight.to_vec()),
        ];
        let model = NetModel::new(module, form(2, classes), Head::Logits, 0.0, arrays);
        let r#in = Box::new(Chain { cells: 2, slip: 0.1, goal: true });
        let cloned = ClonedPolicy { model: One(Model::Net(model)), r#in };
        cloned.run(&Ctx::new("", 0, None)).map(|p| p.values).map_err(|error| error.to_string())
    }

    #[test]
    fn logits_of_each_state_become_probabilities() {
        let odds = 3.0_f32.ln();
        let close = |found: Result<Vec<f64>, String>| {
            let found = found.unwrap();
            assert!(found.iter().zip([0.25, 0.75, 0.5, 0.5]).all(|(a, b)| (a - b).abs() < 1e-6));
        };
        close(cloned(&[0.0, odds, 1.0, 1.0], 2, 2));
        // Two classes by one logit.
        close(cloned(&[odds, 0.0], 1, 2));
    }

    #[test]
    fn a_model_of_something_else_is_refused() {
        let why = cloned(&[0.0; 6], 3, 3).unwrap_err();
        assert!(why.ends_with("and the model of vectors of 2 with 3 classes"), "{why}");
    }
}
