//! World models: learned from what agents experienced (§2.3.2).

mod errors;
mod latent_states;
mod partial;
mod process;
mod reconstruction;

use std::collections::BTreeMap;

use ivx_op::{Array, Ctx, OpError, Registry};

pub use errors::{ModelErrors, UnrolledErrors};
pub use latent_states::LatentStates;
pub use partial::PartialModel;
pub use process::{ProcessModel, ProcessValues};
pub use reconstruction::ReconstructionModel;

use ivx_data::Walks;
use ivx_data::form::failed;
use ivx_nn::optim::Pull;
use ivx_nn::{
    Curve, Graph, Layout, Live, Module, Net, Networks, Optimiser, Paths, Real as _, Rule, Shape,
    Turns, Var, WorldModel,
};

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

/// The networks that all models of finite environments have.
const LATENT: [&str; 3] = ["representation", "dynamics", "reward"];

/// A layout for the environment of some episodes, without networks.
fn layout(of: &Walks, latent: usize) -> Layout {
    Layout { n_states: of.n_states, actions: of.actions.clone(), latent }
}

/// A model with these networks besides `modules`, before training. Latent states lie between −1 and 1.
fn untrained(
    (layout, mut modules): (Layout, BTreeMap<String, Module>),
    net: &dyn Net,
    names: &[&str],
    ctx: &Ctx,
) -> Result<WorldModel, OpError> {
    for &name in names {
        let (inputs, outputs) = layout.widths(name).expect("it is a network of world models");
        let module = ivx_nn::headed(net, &[inputs], &[outputs]).map_err(failed)?;
        let module = match (module, name) {
            (Module::Sequence(mut layers), "representation" | "dynamics") => {
                layers.push(Module::Curve(Curve::Tanh));
                Module::Sequence(layers)
            }
            (module, _) => module,
        };
        modules.insert(name.to_owned(), module);
    }
    let nets = Networks::drawn(modules, &mut ctx.rng("init", &[]));
    Ok(WorldModel { layout, nets })
}

/// How a model is trained.
struct Training<'a> {
    optimiser: &'a dyn Optimiser,
    batch: usize,
    steps: u64,
}

/// A model after updates that lower a loss of some of `n` items.
fn trained(
    mut model: WorldModel,
    n: usize,
    how: &Training<'_>,
    ctx: &Ctx,
    loss: impl Fn(&Live, &[usize]) -> Var,
) -> Result<WorldModel, OpError> {
    let mut live = Live::of(&model.nets);
    let mut turns = Turns::new(n, how.batch);
    let rule = Rule { optimiser: how.optimiser, pull: Pull::NONE, steps: how.steps };
    ivx_nn::descend(&mut live, &[""], rule, ctx, |live, t| loss(live, turns.turn(t, ctx)))?;
    live.put_into(&mut model.nets);
    if !model.nets.are_finite() {
        return Err(OpError::Failed(format!(
            "training diverged within {} steps: lower the learning rate",
            how.steps
        )));
    }
    Ok(model)
}

/// Whether episodes are of the environment that a model is of.
fn fits(model: &WorldModel, of: &Walks) -> Result<(), OpError> {
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
    of: &'a Walks,
    steps: usize,
    /// The episode, and the place in it.
    starts: Vec<(usize, usize)>,
}

impl<'a> Windows<'a> {
    fn new(of: &'a Walks, steps: usize) -> Result<Self, OpError> {
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
                    all.push(f32::of(episode.rewards[t]));
                })
            }),
            values: self.each(1, |k| {
                column(1, k, &|place, k, all| all.push(f32::of(values[state(place, k)])))
            }),
            policies: self.each(1, |k| {
                column(width, k, &|place, k, all| {
                    let row = &policy[state(place, k) * width..][..width];
                    all.extend(row.iter().map(|p| f32::of(*p)));
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

/// The numbers of an array over the states that episodes are of, and over actions where `by_action`.
fn table<'a>(x: &'a Array, of: &Walks, by_action: bool) -> Result<&'a [f64], OpError> {
    let (wanted, over) = if by_action {
        (of.pairs(), "`state` and `action`")
    } else {
        (vec![of.states()], "`state`")
    };
    if x.dims == wanted {
        return Ok(&x.values);
    }
    Err(OpError::Failed(format!("expected numbers over {over} of the episodes' environment")))
}

#[cfg(test)]
mod tests;
