//! How far world models are from what happened.

use ivx_data::Rollouts;
use ivx_nn::WorldModel;
use ivx_nn::{Graph, Heads, Latent, Live, Var, partial_losses};
use ivx_op::{Array, Ctx, Dim, Labels, One, Op, OpError, declare};

use super::super::on_is_walked;
use super::reconstruction::transitions;
use super::{Windows, fits, table};

declare! {
    /// The mean squared errors of a `reconstruction_model` over the steps of episodes: of the state that it
    /// rebuilds, of the next latent state and of the reward.
    pub struct ModelErrors = "model_errors" @ 1 -> Array [part] {
        /// The model.
        of: One<WorldModel>;
        /// The episodes.
        on: One<Rollouts>;
    }
    rule on_is_walked;
}

impl Op for ModelErrors {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let walks = self.on.walks()?;
        fits(&self.of, &walks)?;
        let live = Live::of(&self.of.nets);
        let graph = &live.graph;
        let reconstruction = live.get("reconstruction").ok_or_else(|| {
            OpError::Failed("the model rebuilds no states: use `unrolled_errors`".to_owned())
        })?;
        let windows = Windows::new(&walks, 1)?;
        let places: Vec<usize> = (0..windows.starts.len()).collect();
        let squares = |a: Var, b: Var| {
            scalar(graph, graph.mean(graph.sum_items(graph.square(graph.sub(a, b)))))
        };
        let values = graph.still(|| {
            let of = transitions(graph, &windows, &places);
            let latent = Latent::of(&live);
            let z = latent.representation.of(graph, of.states);
            let step = graph.concat(&[z, of.actions]);
            vec![
                squares(reconstruction.of(graph, z), of.states),
                squares(latent.dynamics.of(graph, step), latent.representation.of(graph, of.next)),
                squares(latent.reward.of(graph, step), of.rewards),
            ]
        });
        Ok(Array::series(parts(&["state", "latent", "reward"]), values))
    }
}

fn parts(names: &[&str]) -> Dim {
    Dim::new("part", Labels::Names(names.iter().map(|name| (*name).to_owned()).collect()))
}

declare! {
    /// How far a `partial_model` is, after each number of its own steps along what agents did, from values,
    /// policies and rewards: the losses of Eqn. 2.55 over all paths of so many steps.
    pub struct UnrolledErrors = "unrolled_errors" @ 1 -> Array [k, part] {
        /// The model.
        of: One<WorldModel>;
        /// The episodes.
        on: One<Rollouts>;
        /// What each state is worth.
        value: One<Array>;
        /// The probability of each action in each state.
        policy: One<Array>;
        /// The most steps.
        unroll: usize = 5, in 0.0..=1e3, unit "steps";
    }
    rule on_is_walked;
}

impl Op for UnrolledErrors {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let walks = self.on.walks()?;
        fits(&self.of, &walks)?;
        let live = Live::of(&self.of.nets);
        let graph = &live.graph;
        let (Some(value), Some(policy)) = (live.get("value"), live.get("policy")) else {
            let why = "the model predicts no values: use `model_errors`";
            return Err(OpError::Failed(why.to_owned()));
        };
        let targets = (table(&self.value, &walks, false)?, table(&self.policy, &walks, true)?);
        // One more, for the reward after the last.
        let windows = Windows::new(&walks, self.unroll + 1)?;
        let places: Vec<usize> = (0..windows.starts.len()).collect();
        let losses = graph.still(|| {
            let paths = windows.paths(graph, &places, targets);
            partial_losses(graph, &Latent::of(&live), &Heads { value, policy }, &paths, false)
        });
        let values = (0..=self.unroll).flat_map(|k| {
            [losses.value[k], losses.policy[k], losses.reward[k]].map(|loss| scalar(graph, loss))
        });
        let steps = Dim::new("k", Labels::count(self.unroll + 1));
        Ok(Array {
            values: values.collect(),
            dims: vec![steps, parts(&["value", "policy", "reward"])],
        })
    }
}

fn scalar(graph: &Graph<f32>, loss: Var) -> f64 {
    f64::from(graph.scalar(loss))
}
