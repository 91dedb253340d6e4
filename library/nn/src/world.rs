//! The losses of latent world models (§2.3.2, Figure 2.9).

use super::graph::{Graph, Shape, Var};
use super::live::Live;
use super::module::{Mode, Module};
use super::params::ParamId;
use super::real::Real;

/// A network among those of a world model: its layers, which take vectors, and their arrays in the order of
/// [`Module::arrays`].
#[derive(Clone, Copy, Debug)]
pub struct Body<'a> {
    /// The layers.
    pub module: &'a Module,
    /// The arrays.
    pub params: &'a [ParamId],
}

impl Body<'_> {
    /// What comes out for vectors `x`. A recurrent network sees one step, from a state of zeros.
    pub fn of<F: Real>(&self, graph: &Graph<F>, x: Var) -> Var {
        let shape = [1, graph.shape(x).width()];
        let shape = if self.module.takes_steps() { &shape[..] } else { &shape[1..] };
        self.module.pass(graph, self.params, (x, shape), &mut Mode::Predict)
    }
}

/// The networks that every latent world model has.
#[derive(Clone, Copy, Debug)]
pub struct Latent<'a> {
    /// `h`, from states to latent states.
    pub representation: Body<'a>,
    /// `p`, from a latent state and an action to the mean of the next latent state.
    pub dynamics: Body<'a>,
    /// `r`, from the same to the mean of the reward.
    pub reward: Body<'a>,
}

impl<'a> Latent<'a> {
    /// Those of some networks.
    ///
    /// # Panics
    /// If one is missing.
    #[must_use]
    pub fn of(live: &'a Live) -> Self {
        Self {
            representation: live.body("representation"),
            dynamics: live.body("dynamics"),
            reward: live.body("reward"),
        }
    }
}

/// Transitions `(s, a, r', s')`, as vectors.
#[derive(Clone, Copy, Debug)]
pub struct Transitions {
    /// `[n, s]`
    pub states: Var,
    /// One-hot, `[n, a]`.
    pub actions: Var,
    /// `[n, 1]`
    pub rewards: Var,
    /// `[n, s]`
    pub next: Var,
}

/// The reconstruction loss, that of the latent dynamics and that of the reward (Eqns. 2.52a to c), each the mean
/// over the transitions; their sum is Eqn. 2.51. Norms are squared; rewards have variance 1.
///
/// - `reconstruction`: `f`, from latent states to states.
/// - `log_std`: the logarithms of the standard deviations of the latent dynamics, `[n, z]`.
/// - `stops`: whether the loss of the dynamics takes latent states as given (SG in Eqn. 2.52b).
pub fn reconstruction_losses<F: Real>(
    graph: &Graph<F>,
    nets: &Latent<'_>,
    reconstruction: Body<'_>,
    of: &Transitions,
    (log_std, stops): (Var, bool),
) -> [Var; 3] {
    let n = graph.shape(of.states).n;
    let latent = nets.representation.of(graph, of.states);
    let rebuilt = reconstruction.of(graph, latent);
    let seen = |latent: Var| if stops { graph.stop_gradient(latent) } else { latent };
    let next = if stops {
        graph.still(|| nets.representation.of(graph, of.next))
    } else {
        nets.representation.of(graph, of.next)
    };
    let moved = nets.dynamics.of(graph, graph.concat(&[seen(latent), of.actions]));
    let log_prob = graph.gaussian_log_prob(graph.sub(next, moved), log_std);

    let rewards = nets.reward.of(graph, graph.concat(&[latent, of.actions]));
    let unit = graph.input(Shape::vectors(n, 1), &vec![F::zero(); n]);
    let reward = graph.gaussian_log_prob(graph.sub(of.rewards, rewards), unit);
    [
        mean(graph, graph.square(graph.sub(rebuilt, of.states))),
        graph.affine(mean(graph, log_prob), -1.0, 0.0),
        graph.affine(mean(graph, reward), -1.0, 0.0),
    ]
}

/// The heads of a partial model that predicts values and policies.
#[derive(Clone, Copy, Debug)]
pub struct Heads<'a> {
    /// From latent states to values.
    pub value: Body<'a>,
    /// From latent states to the logits of actions.
    pub policy: Body<'a>,
}

/// What happened, and is thought, along paths of `K` steps.
#[derive(Clone, Debug)]
pub struct Paths {
    /// Where they start: `[n, s]`.
    pub states: Var,
    /// The action of each step, one-hot: `K` times `[n, a]`.
    pub actions: Vec<Var>,
    /// The reward of each step: `K` times `[n, 1]`.
    pub rewards: Vec<Var>,
    /// What each state is worth: `K + 1` times `[n, 1]`.
    pub values: Vec<Var>,
    /// What is done in each: `K + 1` times `[n, a]`.
    pub policies: Vec<Var>,
}

/// The losses of a multi-step partial model along its own steps (Eqn. 2.55), each the mean over the paths.
#[derive(Clone, Debug)]
pub struct Unrolled {
    /// `l_v^k`, squared: of `K + 1` states.
    pub value: Vec<Var>,
    /// `l_π^k`, cross-entropies: of `K + 1` states.
    pub policy: Vec<Var>,
    /// `l_r^k`, squared: of `K` steps.
    pub reward: Vec<Var>,
}

/// The losses of unrolling a model along the actions of `paths`.
///
/// - `scaled`: whether steps of the model weigh `1/K`, and halve the gradient that goes through them, as in
///   `MuZero` (Schrittwieser et al., 2020).
pub fn partial_losses<F: Real>(
    graph: &Graph<F>,
    nets: &Latent<'_>,
    heads: &Heads<'_>,
    paths: &Paths,
    scaled: bool,
) -> Unrolled {
    #[expect(clippy::cast_precision_loss, reason = "steps are few")]
    let share = if scaled { 1.0 / paths.actions.len().max(1) as f64 } else { 1.0 };
    let mut latent = nets.representation.of(graph, paths.states);
    let mut out = Unrolled { value: Vec::new(), policy: Vec::new(), reward: Vec::new() };
    for (k, (values, policies)) in paths.values.iter().zip(&paths.policies).enumerate() {
        let weight = if k == 0 { 1.0 } else { share };
        let apart = graph.sub(heads.value.of(graph, latent), *values);
        out.value.push(graph.affine(mean(graph, graph.square(apart)), weight, 0.0));
        let log_probs = graph.log_softmax(heads.policy.of(graph, latent));
        let agreed = mean(graph, graph.mul(*policies, log_probs));
        out.policy.push(graph.affine(agreed, -weight, 0.0));
        let Some((actions, rewards)) = paths.actions.get(k).zip(paths.rewards.get(k)) else {
            break;
        };
        let step = graph.concat(&[latent, *actions]);
        let apart = graph.sub(nets.reward.of(graph, step), *rewards);
        out.reward.push(graph.affine(mean(graph, graph.square(apart)), share, 0.0));
        latent = nets.dynamics.of(graph, step);
        if scaled {
            let still = graph.stop_gradient(latent);
            latent = graph.add(graph.affine(latent, 0.5, 0.0), graph.affine(still, 0.5, 0.0));
        }
    }
    out
}

/// The model-predicted values over 0 to `steps` steps of a Markov reward process (Eqns. 5.10a to d), which has no
/// actions: `steps + 1` times `[n, 1]`. The reward of a step is that of where it leads.
///
/// ```text
/// v^k = Σ_{j<k} γ^j r(z^{j+1}) + γ^k v(z^k),  z^0 = h(s),  z^{j+1} = p(z^j)
/// ```
pub fn predicted_values<F: Real>(
    graph: &Graph<F>,
    nets: &Latent<'_>,
    value: Body<'_>,
    states: Var,
    (steps, discount): (usize, f64),
) -> Vec<Var> {
    let mut latent = nets.representation.of(graph, states);
    let mut members = vec![value.of(graph, latent)];
    let (mut received, mut weight) = (None, 1.0);
    for _ in 0..steps {
        latent = nets.dynamics.of(graph, latent);
        let reward = graph.affine(nets.reward.of(graph, latent), weight, 0.0);
        let sum = received.map_or(reward, |before| graph.add(before, reward));
        received = Some(sum);
        weight *= discount;
        members.push(graph.add(sum, graph.affine(value.of(graph, latent), weight, 0.0)));
    }
    members
}

/// The mean over items of the sums of their numbers.
fn mean<F: Real>(graph: &Graph<F>, x: Var) -> Var {
    graph.mean(graph.sum_items(x))
}
