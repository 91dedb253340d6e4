//! How well agents do in worlds of any kind.

use ivx_data::form::wrong;
use ivx_op::{Array, Ctx, Dim, Facts, Labels, Op, OpError, Wrong, declare, record};
use ivx_world::{Env, Lanes};

use super::actor::Actor;
use super::agent::Acting;

record! {
    /// What became of an agent in some episodes.
    pub struct Evaluation = "Evaluation" {
        /// The sum of the rewards of each.
        returns: Array [trial];
        /// How many steps each had.
        lengths: Array [trial];
        /// The sums of what the world tells besides, by what it is.
        told: Array [trial, told];
    }
}

declare! {
    /// What becomes of an agent in some episodes, each in a world of its own. Its worlds are those of the seed, whoever
    /// acts in them.
    pub struct Evaluate = "evaluate" @ 1, stochastic -> Evaluation {
        /// Who acts.
        actor: Box<dyn Actor>;
        /// The world.
        r#in: Box<dyn Env>;
        /// How many episodes.
        trials: usize = 10, in 1.0..=1e6;
    }
    rule fits;
}

fn fits(facts: &Facts<'_>) -> Result<(), Wrong> {
    match (facts.arg::<Box<dyn Actor>>("actor"), facts.arg::<Box<dyn Env>>("in")) {
        (Some(actor), Some(env)) => {
            let spec = env.spec().map_err(wrong("in"))?;
            actor.fits(&spec).map_err(wrong("actor"))
        }
        _ => Ok(()),
    }
}

impl Op for Evaluate {
    fn run(&self, ctx: &Ctx) -> Result<Evaluation, OpError> {
        let spec = self.r#in.spec().map_err(|misfit| OpError::Failed(misfit.message))?;
        let mut actor = self.actor.open(&spec).map_err(|misfit| OpError::Failed(misfit.message))?;
        let trials = (self.trials, 0);
        let run = drive(&mut *actor, &*self.r#in, trials, ctx, || ctx.checkpoint(Vec::new))?;
        let trials = || Dim::new("trial", Labels::count(self.trials));
        let told = Dim::new("told", Labels::Names(spec.tells));
        Ok(Evaluation {
            returns: Array::series(trials(), run.returns),
            lengths: Array::series(trials(), run.lengths),
            told: Array { dims: vec![trials(), told], values: run.told },
        })
    }
}

/// What became of an agent, trial by trial.
pub(crate) struct Run {
    pub(crate) returns: Vec<f64>,
    lengths: Vec<f64>,
    told: Vec<f64>,
}

/// How many steps there are between looks whether it is to end.
const LOOKS: u64 = 64;

/// Lets an agent act in `trials` worlds, one episode in each. `first` tells apart worlds that must differ; `look` says
/// whether it is to end before it is done.
pub(crate) fn drive(
    actor: &mut dyn Acting,
    env: &dyn Env,
    (trials, first): (usize, u64),
    ctx: &Ctx<'_>,
    mut look: impl FnMut() -> Result<(), OpError>,
) -> Result<Run, OpError> {
    let mut lanes = Lanes::open(env, trials, ctx, ("evaluate", first))?;
    let mut rng = ctx.rng("act", &[&first.to_string()]);
    let width = lanes.spec().tells.len();
    let (returns, lengths) = (vec![0.0; trials], vec![0.0; trials]);
    let mut run = Run { returns, lengths, told: vec![0.0; trials * width] };
    let mut open = vec![true; trials];
    for t in 0_u64.. {
        if t % LOOKS == 0 {
            look()?;
        }
        rng.set_stream(t);
        rng.set_word_pos(0);
        let (seen, acts) = lanes.choose();
        actor.act(seen, &mut rng, acts);
        let step = lanes.step()?;
        for (i, (sum, told)) in run.told.iter_mut().zip(&step.told).enumerate() {
            *sum += if open[i / width] { f64::from(*told) } else { 0.0 };
        }
        let finished: Vec<_> = lanes.finished().collect();
        for episode in finished {
            let lane = episode.lane;
            (run.returns[lane], open[lane]) = (episode.payoff, false);
            #[expect(clippy::cast_precision_loss, reason = "episodes are far below 2^53 steps")]
            let length = episode.length as f64;
            run.lengths[lane] = length;
            lanes.rest(lane);
        }
        if !open.contains(&true) {
            break;
        }
    }
    Ok(run)
}
