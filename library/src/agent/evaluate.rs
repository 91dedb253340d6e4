//! How well agents do in worlds of any kind.

use ivx_data::form::failed;
use ivx_op::{Array, Ctx, Dim, Labels, Op, OpError, declare, record};
use ivx_world::Env;

use super::act::acts;
use super::actor::Actor;
use super::agent::Acting;
use super::drive::Drive;

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
    rule acts;
}

impl Op for Evaluate {
    fn run(&self, ctx: &Ctx) -> Result<Evaluation, OpError> {
        let spec = self.r#in.spec().map_err(failed)?;
        let mut actor = self.actor.open(&spec).map_err(failed)?;
        let trials = (self.trials, 0);
        let run = measure(&mut *actor, &*self.r#in, trials, ctx, || ctx.checkpoint(Vec::new))?;
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

/// Lets an agent act in `trials` worlds, one episode in each. `first` tells apart worlds that must differ; `look` says
/// whether it is to end before it is done.
pub(crate) fn measure<'a>(
    actor: &mut dyn Acting,
    env: &'a dyn Env,
    (trials, first): (usize, u64),
    ctx: &Ctx<'a>,
    look: impl FnMut() -> Result<(), OpError>,
) -> Result<Run, OpError> {
    let mut run = Run { returns: vec![0.0; trials], lengths: vec![0.0; trials], told: Vec::new() };
    let drive = Drive { env, worlds: trials, luck: ("evaluate", first), limit: None };
    let mut rng = ctx.rng("act", &[&first.to_string()]);
    drive.run((actor, &mut rng), ctx, look, |lane, step, _| {
        let width = step.told.len() / trials;
        run.told.resize(trials * width, 0.0);
        run.returns[lane] += step.rewards[lane];
        run.lengths[lane] += 1.0;
        let told = run.told[lane * width..].iter_mut().zip(&step.told[lane * width..][..width]);
        told.for_each(|(sum, told)| *sum += f64::from(*told));
    })?;
    Ok(run)
}
