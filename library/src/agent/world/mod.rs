//! World models: learned from what agents experienced (§2.3.2).

mod errors;
mod latent_states;
mod partial;
mod process;
mod reconstruction;

use ivx_op::{Array, Ctx, Dim, Labels, OpError, Registry};

pub use errors::{ModelErrors, UnrolledErrors};
pub use latent_states::LatentStates;
pub use partial::PartialModel;
pub use process::{ProcessModel, ProcessValues};
pub use reconstruction::ReconstructionModel;

use crate::artifact::{Layout, Rollouts, WorldModel};
use crate::math::moments::real;
use crate::nn::{self, Curve, Graph, Module, Net, Paths, Shape, Var};

/// Adds what this folder declares.
pub(super) fn register(registry: Registry) -> Registry {
    registry
        .op::<ReconstructionModel>()
        .op::<PartialModel>()
        .op::<ProcessModel>()
        .op::<ProcessValues>()
        .op::<LatentStates>()
        .op::<ModelErrors>()
        .op::<UnrolledErrors>()
}

/// A model with the networks that all have and those of `heads`, before training. Latent states lie between −1
/// and 1.
fn untrained(
    of: &Rollouts,
    (net, latent): (&dyn Net, usize),
    heads: &[&str],
    ctx: &Ctx,
) -> Result<WorldModel, OpError> {
    let mut layout =
        Layout { n_states: of.n_states, actions: of.actions.clone(), latent, nets: [].into() };
    for name in ["representation", "dynamics", "reward"].iter().chain(heads) {
        let (inputs, outputs) = layout.widths(name).expect("it is a network of world models");
        let module = nn::headed(net, &[inputs], &[outputs])
            .map_err(|misfit| OpError::Failed(misfit.message))?;
        let module = match (module, *name) {
            (Module::Sequence(mut layers), "representation" | "dynamics") => {
                layers.push(Module::Curve(Curve::Tanh));
                Module::Sequence(layers)
            }
            (module, _) => module,
        };
        layout.nets.insert((*name).to_owned(), module);
    }
    Ok(nn::drawn(layout, &mut ctx.rng("init", &[])))
}

/// The trained model, unless training diverged.
fn checked(model: WorldModel, steps: u64) -> Result<WorldModel, OpError> {
    if model.params.iter().any(|(.., values)| values.iter().any(|x| !x.is_finite())) {
        return Err(OpError::Failed(format!(
            "training diverged within {steps} steps: lower the learning rate"
        )));
    }
    Ok(model)
}

/// Whether episodes are of the environment that a model is of.
fn fits(model: &WorldModel, of: &Rollouts) -> Result<(), OpError> {
    let Layout { n_states, actions, .. } = &model.layout;
    if (*n_states, actions) == (of.n_states, &of.actions) {
        return Ok(());
    }
    Err(OpError::Failed(format!(
        "the model is of {n_states} states and {} actions, and the episodes of {} and {}",
        actions.len(),
        of.n_states,
        of.actions.len()
    )))
}

/// Paths of `steps` steps within episodes: where each begins.
struct Windows<'a> {
    of: &'a Rollouts,
    steps: usize,
    /// The episode, and the place in it.
    starts: Vec<(usize, usize)>,
}

impl<'a> Windows<'a> {
    fn new(of: &'a Rollouts, steps: usize) -> Result<Self, OpError> {
        let within = of.episodes.iter().enumerate().flat_map(|(e, episode)| {
            (0..(episode.actions.len() + 1).saturating_sub(steps)).map(move |t| (e, t))
        });
        let starts: Vec<(usize, usize)> = within.collect();
        if starts.is_empty() {
            return Err(OpError::Failed(format!("no episode has {steps} steps to learn from")));
        }
        Ok(Self { of, steps, starts })
    }

    /// What happened at those of these places. `values` are of states, `policy` of states and actions.
    fn paths(
        &self,
        graph: &Graph<f32>,
        places: &[usize],
        (values, policy): (&[f64], &[f64]),
    ) -> Paths {
        let width = self.of.actions.len();
        let after = |place: &usize, k: usize| {
            let (e, t) = self.starts[*place];
            (&self.of.episodes[e], t + k)
        };
        let column = |width: usize, k: usize, write: &dyn Fn(&usize, usize, &mut Vec<f32>)| {
            let mut all = Vec::with_capacity(places.len() * width);
            for place in places {
                write(place, k, &mut all);
            }
            graph.input(Shape::vectors(places.len(), width), &all)
        };
        let state = |place: &usize, k: usize| {
            let (episode, t) = after(place, k);
            episode.states[t]
        };
        Paths {
            states: column(self.of.n_states, 0, &|place, k, all| {
                hot(state(place, k), self.of.n_states, all);
            }),
            actions: self.each(0, |k| {
                column(width, k, &|place, k, all| {
                    let (episode, t) = after(place, k);
                    hot(episode.actions[t], width, all);
                })
            }),
            rewards: self.each(0, |k| {
                column(1, k, &|place, k, all| {
                    let (episode, t) = after(place, k);
                    all.push(single(episode.rewards[t]));
                })
            }),
            values: self.each(1, |k| {
                column(1, k, &|place, k, all| all.push(single(values[state(place, k)])))
            }),
            policies: self.each(1, |k| {
                column(width, k, &|place, k, all| {
                    let row = &policy[state(place, k) * width..][..width];
                    all.extend(row.iter().map(|p| single(*p)));
                })
            }),
        }
    }

    fn each(&self, more: usize, column: impl Fn(usize) -> Var) -> Vec<Var> {
        (0..self.steps + more).map(column).collect()
    }
}

/// Appends a vector with a 1 in one place.
fn hot(place: usize, width: usize, to: &mut Vec<f32>) {
    let start = to.len();
    to.resize(start + width, 0.0);
    to[start + place] = 1.0;
}

#[expect(clippy::cast_possible_truncation, reason = "networks are in single precision")]
fn single(x: f64) -> f32 {
    x as f32
}

/// The numbers of an array over the states that episodes are of, and over actions where `by_action`.
fn table<'a>(x: &'a Array, of: &Rollouts, by_action: bool) -> Result<&'a [f64], OpError> {
    let numbers = (0..of.n_states).map(real).collect();
    let mut wanted = vec![Dim::new("state", Labels::Numbers(numbers))];
    if by_action {
        wanted.push(Dim::new("action", Labels::Names(of.actions.clone())));
    }
    if x.dims == wanted {
        return Ok(&x.values);
    }
    let over = if by_action { "`state` and `action`" } else { "`state`" };
    Err(OpError::Failed(format!("expected numbers over {over} of the episodes' environment")))
}

#[cfg(test)]
mod tests;
