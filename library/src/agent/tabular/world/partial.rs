//! World models that predict values and policies.

use ivx_data::Rollouts;
use ivx_nn::WorldModel;
use ivx_nn::{Heads, Latent, Net, Optimiser, partial_losses};
use ivx_op::{Array, Ctx, One, Op, OpError, Part, declare};

use super::super::from_is_walked;
use super::{LATENT, Training, Windows, layout, table, trained, untrained};

declare! {
    /// A latent world model that predicts values, policies and rewards along its own steps (Eqn. 2.55, Example
    /// 2.7), and never rebuilds a state.
    ///
    /// It learns from all paths of `unroll` steps within the episodes. Values and rewards have squared errors,
    /// policies cross-entropies. Latent states lie between −1 and 1.
    pub struct PartialModel = "partial_model" @ 1, stochastic -> WorldModel {
        /// The episodes.
        from: One<Rollouts>;
        /// What each state is thought to be worth.
        value: One<Array>;
        /// The probability of each action in each state.
        policy: One<Array>;
        /// How many steps `K` it is unrolled.
        unroll: usize = 5, in 1.0..=1e3, unit "steps";
        /// How many numbers a latent state has.
        latent: usize = 8, in 1.0..=1e4;
        /// The layers of each network, up to its last linear map.
        net: Box<dyn Net> = Part::new("mlp").with("hidden", vec![32_i64]);
        /// Whether its own steps weigh `1/K` and halve the gradient that goes through them (Schrittwieser et al.,
        /// 2020).
        scaled: bool = false;
        /// How the loss is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("adam")
            .with("lr", Part::new("constant").with("value", 3e-3));
        /// How many paths an update looks at; 0 for all.
        batch: usize = 64, in 0.0..;
        /// How many updates.
        steps: u64 = 1000, in 0.0..;
    }
    rule from_is_walked;
}

impl Op for PartialModel {
    fn run(&self, ctx: &Ctx) -> Result<WorldModel, OpError> {
        let walks = self.from.walks()?;
        let targets = (table(&self.value, &walks, false)?, table(&self.policy, &walks, true)?);
        let names = [&LATENT[..], &["value", "policy"]].concat();
        let model = untrained((layout(&walks, self.latent), [].into()), &*self.net, &names, ctx)?;
        let windows = Windows::new(&walks, self.unroll)?;
        let (optimiser, batch, steps) = (&*self.optimiser, self.batch, self.steps);
        let how = Training { optimiser, batch, steps };
        trained(model, windows.starts.len(), &how, ctx, |live, places| {
            let graph = &live.graph;
            let paths = windows.paths(graph, places, targets);
            let heads = Heads { value: live.body("value"), policy: live.body("policy") };
            let losses = partial_losses(graph, &Latent::of(live), &heads, &paths, self.scaled);
            let each = losses.value.into_iter().chain(losses.policy).chain(losses.reward);
            each.reduce(|a, b| graph.add(a, b)).expect("a path has a state")
        })
    }
}
