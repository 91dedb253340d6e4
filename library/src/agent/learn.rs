//! Learning in worlds of any kind: the one loop.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_data::form::{failed, wrong};
use ivx_data::world_shapes;
use ivx_math::moments::{mean, real};
use ivx_op::{
    Args, Array, Ctx, Dim, Facts, Labels, Literal as _, Needs, Op, OpError, Parts, Shapes, State,
    Wrong, declare, family, record, shown,
};
use ivx_world::{Env, Lanes, pays_something};

use super::agent::Agent;
use super::evaluate::measure;
use super::method::{Learning, Method, Setting};

record! {
    /// What came of learning.
    pub struct Learned = "Learned" {
        /// The agent at the end.
        agent: Agent;
        /// The sum of the rewards of each episode by which it was measured, after so many steps of learning.
        returns: Array [step, trial];
        /// The parts of its loss, each the mean over the updates since it was measured last.
        losses: Array [step, part];
        /// The sum of the rewards of each episode of learning, exploring and all, as they ended.
        played: Array [episode];
    }
}

/// For how long an agent learns.
pub trait Span: Debug + Send + Sync {
    /// What is counted, and how many.
    fn count(&self) -> (Counted, u64);
}

/// What is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counted {
    /// Steps of all worlds together.
    Steps,
    /// Updates.
    Updates,
    /// Episodes that are over.
    Episodes,
}

macro_rules! spans {
    ($($(#[doc = $doc:literal])+ $ty:ident = $name:literal)+) => {
        $(
            declare! {
                $(#[doc = $doc])+
                pub struct $ty = $name @ 1 {
                    /// How many.
                    n: u64, in 0.0..;
                }
            }

            impl Span for $ty {
                fn count(&self) -> (Counted, u64) {
                    (Counted::$ty, self.n)
                }
            }
        )+

        pub(super) fn spans() -> &'static Parts<dyn Span> {
            static TABLE: LazyLock<Parts<dyn Span>> =
                LazyLock::new(|| Parts::<dyn Span>::new()$(.with(|x: $ty| Box::new(x)))+);
            &TABLE
        }
    };
}

spans! {
    /// For so many steps of all worlds together.
    Steps = "steps"
    /// For so many updates.
    Updates = "updates"
    /// For so many episodes.
    Episodes = "episodes"
}

family!(dyn Span, "Span", spans);

declare! {
    /// An agent that learns in a world, with how well it did on the way.
    ///
    /// Now and then the agent of that moment is let act in `trials` worlds of their own, one episode in each, without
    /// what it does to explore. On one seed all methods meet the same worlds, in learning and when they are measured.
    pub struct Learn = "learn" @ 1, stochastic -> Learned {
        /// How it learns.
        how: Box<dyn Method>;
        /// The world.
        r#in: Box<dyn Env>;
        /// For how long.
        r#for: Box<dyn Span>;
        /// After how much of that it is measured, again and again; 0 for once, at the end.
        every: u64 = 0, in 0.0..;
        /// In how many episodes it is measured.
        trials: usize = 10, in 1.0..=1e5;
        /// In how many worlds it acts side by side.
        lanes: usize = 1, in 1.0..=1e5;
    }
    rule learns;
    shapes of_learned;
}

fn learns(facts: &Facts<'_>) -> Result<(), Wrong> {
    let env = facts.arg::<Box<dyn Env>>("in");
    let spec = env.as_ref().map(|env| env.spec().map_err(wrong("in"))).transpose()?;
    let (how, span) = (facts.arg::<Box<dyn Method>>("how"), facts.arg::<Box<dyn Span>>("for"));
    if let (Some(env), Some(true)) = (&env, how.as_ref().map(|how| how.is_paid())) {
        pays_something(&**env)?;
    }
    if let (Some(spec), Some(how), Some(lanes)) = (spec, &how, facts.arg("lanes")) {
        how.fits(&Setting::of(&spec, lanes, span.as_deref())).map_err(wrong("how"))?;
    }
    let Some((counted, n)) = span.map(|span| span.count()) else { return Ok(()) };
    let watches = how.is_some_and(|how| !how.acts());
    let every: u64 = facts.arg("every").unwrap_or_default();
    let lanes: u64 = facts.arg("lanes").unwrap_or(1);
    let not = |arg, message: String, help: &str| Err(Wrong { arg, message, help: help.to_owned() });
    if watches && counted == Counted::Episodes {
        let message = "it learns from what others did, and comes to no episodes of its own";
        return not("for", message.to_owned(), "count `updates(..)`");
    }
    if every > 0 && !n.is_multiple_of(every) {
        let message = format!(
            "{every} does not divide {n}, so that the agent at the end would not be measured"
        );
        return not("every", message, "choose a number that divides it");
    }
    let turn = if every > 0 { every } else { n };
    if counted == Counted::Steps && !turn.is_multiple_of(lanes) {
        let message = format!("{lanes} worlds side by side make no {turn} steps together");
        return not("lanes", message, "choose a number that divides it");
    }
    Ok(())
}

/// What the agent of such a world is known by.
fn of_learned(facts: &Facts<'_>) -> Option<Shapes> {
    let spec = facts.arg::<Box<dyn Env>>("in")?.spec().ok()?;
    let named = world_shapes(&spec.sees, &spec.does).into_iter();
    Some(named.map(|(name, shape)| (format!("agent.{name}"), shape)).collect())
}

impl Op for Learn {
    fn run(&self, ctx: &Ctx) -> Result<Learned, OpError> {
        let spec = self.r#in.spec().map_err(failed)?;
        let setting = Setting::of(&spec, self.lanes, Some(&*self.r#for));
        self.how.fits(&setting).map_err(failed)?;
        let mut run = Run::begin(self, &setting, ctx)?;
        if ctx.resume().is_some_and(|bytes| State::restore(&bytes, |state| run.walk(state))) {
            run.lanes.catch_up()?;
        }
        run.finish(ctx)?;
        Ok(run.learned())
    }

    fn needs(args: &Args, _: Option<&Shapes>, input_bytes: u64) -> Needs {
        let how = args.get("how").and_then(|lit| Box::<dyn Method>::from_lit(lit).ok());
        let env = args.get("in").and_then(|lit| Box::<dyn Env>::from_lit(lit).ok());
        let lanes = args.get("lanes").and_then(|lit| usize::from_lit(lit).ok());
        let spec = env.and_then(|env| env.spec().ok());
        let memory = match (how, spec, lanes) {
            (Some(how), Some(spec), Some(lanes)) => how.memory(&Setting::of(&spec, lanes, None)),
            _ => 0,
        };
        Needs { memory: memory + input_bytes, ..Needs::default() }
    }
}

/// Over how many episodes it tells how it goes.
const RECENT: usize = 20;

/// A learning that is under way.
struct Run<'a> {
    op: &'a Learn,
    learning: Box<dyn Learning + 'a>,
    lanes: Lanes<'a>,
    counted: Counted,
    total: u64,
    /// Steps of all worlds together.
    steps: u64,
    /// The return of every episode that was finished.
    played: Vec<f64>,
    /// After how much it was measured, and what was found.
    measured: Vec<f64>,
    returns: Vec<f64>,
    losses: Vec<f64>,
}

impl<'a> Run<'a> {
    fn begin(op: &'a Learn, setting: &Setting<'_>, ctx: &Ctx<'a>) -> Result<Self, OpError> {
        let (counted, total) = op.r#for.count();
        Ok(Self {
            op,
            learning: op.how.begin(setting, ctx)?,
            lanes: Lanes::open(&*op.r#in, op.lanes, ctx, ("learn", 0))?,
            counted,
            total,
            steps: 0,
            played: Vec::new(),
            measured: Vec::new(),
            returns: Vec::new(),
            losses: Vec::new(),
        })
    }

    /// How much of what is counted is done.
    fn done(&self) -> u64 {
        match self.counted {
            Counted::Steps => self.steps,
            Counted::Updates => self.learning.updates(),
            Counted::Episodes => self.played.len() as u64,
        }
    }

    fn walk(&mut self, state: &mut State) {
        state.count("steps", &mut self.steps);
        state.reals("played", &mut self.played);
        state.reals("measured", &mut self.measured);
        state.reals("returns", &mut self.returns);
        state.reals("losses", &mut self.losses);
        state.within("lanes", |state| self.lanes.state(state));
        state.within("learning", |state| self.learning.state(state));
    }

    fn kept(&mut self) -> Vec<u8> {
        State::keep(|state| self.walk(state))
    }

    fn finish(&mut self, ctx: &Ctx<'a>) -> Result<(), OpError> {
        loop {
            self.measure_if_due(ctx)?;
            if self.done() >= self.total {
                break;
            }
            ctx.checkpoint(|| self.kept())?;
            self.turn()?;
            ctx.tell(self.done(), self.total, || {
                let last = self.learning.losses().last();
                let played = &self.played[self.played.len().saturating_sub(RECENT)..];
                format!("return {}, loss {}", shown(mean(played)), shown(last))
            });
        }
        if self.measured.is_empty() {
            self.measure(self.total, ctx)?;
        }
        Ok(())
    }

    /// A step of every world, and what is learned of it.
    fn turn(&mut self) -> Result<(), OpError> {
        if self.op.how.acts() {
            let (seen, acts) = self.lanes.choose();
            self.learning.act(self.steps, seen, acts);
            self.learning.see(self.lanes.step()?);
            self.played.extend(self.lanes.finished().map(|episode| episode.payoff));
        }
        self.steps += self.lanes.len() as u64;
        self.learning.learn(self.steps);
        Ok(())
    }

    fn measure_if_due(&mut self, ctx: &Ctx<'a>) -> Result<(), OpError> {
        if self.op.every == 0 {
            return Ok(());
        }
        let due = self.done().min(self.total) / self.op.every;
        while (self.measured.len() as u64) < due {
            self.measure((self.measured.len() as u64 + 1) * self.op.every, ctx)?;
        }
        Ok(())
    }

    fn measure(&mut self, after: u64, ctx: &Ctx<'a>) -> Result<(), OpError> {
        let agent = self.learning.agent();
        if !agent.nets.are_finite() || !self.learning.losses().are_finite() {
            return Err(OpError::Failed(format!(
                "learning diverged within {} steps: lower the learning rate",
                self.steps
            )));
        }
        let (op, mut actor) = (self.op, agent.open());
        let look = || ctx.checkpoint(|| self.kept());
        let run = measure(&mut *actor, &*op.r#in, (op.trials, after), ctx, look)?;
        #[expect(clippy::cast_precision_loss, reason = "steps are far below 2^53")]
        self.measured.push(after as f64);
        self.returns.extend(run.returns);
        let losses = self.learning.losses().take();
        self.losses.extend(losses);
        Ok(())
    }

    fn learned(mut self) -> Learned {
        let steps = || Dim::new("step", Labels::Numbers(self.measured.clone()));
        let count = |n: usize| Labels::Numbers((0..n).map(real).collect());
        let trials = Dim::new("trial", count(self.op.trials));
        let names = self.learning.losses().names().iter().map(|name| (*name).to_owned());
        let parts = Dim::new("part", Labels::Names(names.collect()));
        Learned {
            agent: self.learning.agent(),
            returns: Array { dims: vec![steps(), trials], values: self.returns.clone() },
            losses: Array { dims: vec![steps(), parts], values: self.losses.clone() },
            played: Array::series(Dim::new("episode", count(self.played.len())), self.played),
        }
    }
}
