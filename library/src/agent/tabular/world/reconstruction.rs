//! World models that rebuild what they see.

use ivx_data::Rollouts;
use ivx_nn::WorldModel;
use ivx_nn::{Graph, Latent, Net, Optimiser, Real as _, Shape, Transitions, reconstruction_losses};
use ivx_op::{Ctx, One, Op, OpError, Part, declare};

use super::super::from_is_walked;
use super::{LATENT, Training, Windows, hot, layout, trained, untrained};

declare! {
    /// A latent world model that reconstructs states (Eqns. 2.51 and 2.52): it embeds a state, rebuilds it from
    /// that, and predicts the next embedding and the reward.
    ///
    /// States and actions go in with a 1 in their place. The embeddings, between −1 and 1, are Gaussian around
    /// what the dynamics predict.
    pub struct ReconstructionModel = "reconstruction_model" @ 1, stochastic -> WorldModel {
        /// The episodes.
        from: One<Rollouts>;
        /// How many numbers a latent state has.
        latent: usize = 8, in 1.0..=1e4;
        /// The layers of each network, up to its last linear map.
        net: Box<dyn Net> = Part::new("mlp").with("hidden", vec![32_i64]);
        /// Standard deviation of the next latent state.
        noise: f64 = 0.1, in 1e-6..;
        /// Whether the loss of the dynamics leaves the embedding alone (SG in Eqn. 2.52b). Without, the embedding
        /// becomes what is easy to predict.
        stop_gradient: bool = true;
        /// How the loss is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("adam")
            .with("lr", Part::new("constant").with("value", 3e-3));
        /// How many transitions an update looks at; 0 for all.
        batch: usize = 64, in 0.0..;
        /// How many updates.
        steps: u64 = 1000, in 0.0..;
    }
    rule from_is_walked;
}

impl Op for ReconstructionModel {
    fn run(&self, ctx: &Ctx) -> Result<WorldModel, OpError> {
        let walks = self.from.walks()?;
        let names = [&LATENT[..], &["reconstruction"]].concat();
        let model = untrained((layout(&walks, self.latent), [].into()), &*self.net, &names, ctx)?;
        let windows = Windows::new(&walks, 1)?;
        let (optimiser, batch, steps) = (&*self.optimiser, self.batch, self.steps);
        let how = Training { optimiser, batch, steps };
        trained(model, windows.starts.len(), &how, ctx, |live, places| {
            let graph = &live.graph;
            let of = transitions(graph, &windows, places);
            let shape = Shape::vectors(places.len(), self.latent);
            let log_std = graph.input(shape, &vec![f32::of(self.noise.ln()); shape.len()]);
            let [rebuilt, moved, reward] = reconstruction_losses(
                graph,
                &Latent::of(live),
                live.body("reconstruction"),
                &of,
                (log_std, self.stop_gradient),
            );
            graph.add(graph.add(rebuilt, moved), reward)
        })
    }
}

/// What happened at these places.
pub(super) fn transitions(
    graph: &Graph<f32>,
    windows: &Windows<'_>,
    places: &[usize],
) -> Transitions {
    let (n_states, n_actions) = (windows.of.n_states, windows.of.actions.len());
    let [mut states, mut actions, mut rewards, mut next] = [const { Vec::new() }; 4];
    for &place in places {
        let (e, t) = windows.starts[place];
        let episode = &windows.of.episodes[e];
        hot(episode.states[t], n_states, &mut states);
        hot(episode.actions[t], n_actions, &mut actions);
        rewards.push(f32::of(episode.rewards[t]));
        hot(episode.states[t + 1], n_states, &mut next);
    }
    let vectors = |width, values: &[f32]| graph.input(Shape::vectors(places.len(), width), values);
    Transitions {
        states: vectors(n_states, &states),
        actions: vectors(n_actions, &actions),
        rewards: vectors(1, &rewards),
        next: vectors(n_states, &next),
    }
}
