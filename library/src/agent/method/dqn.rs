//! Deep Q-learning (Mnih et al., 2015).

use std::collections::BTreeMap;

use ivx_data::form::failed;
use ivx_data::{Columns, Misfit};
use ivx_nn::optim::Pull;
use ivx_nn::{
    Descent, Follow, Graph, Live, Module, Net, Networks, Optimiser, Real, Rule, Schedule, Shape,
    Var,
};
use ivx_op::{Ctx, One, OpError, Part, State, declare};
use ivx_world::{Acts, Spec, Step};
use rand_chacha::ChaCha8Rng;

use super::super::agent::{Agent, Choice, best, look, sight};
use super::super::explore::Explore;
use super::super::replay::{Batch, Replay};
use super::beside::{CLONE, Cloning, Shares, join};
use super::target::Target;
use super::{Learning, Means, Method, Setting};

declare! {
    /// Deep Q-learning (Mnih et al., 2015): a network of action values lowers Huber's loss of its temporal-difference
    /// errors on steps drawn from a replay, with targets by a copy of it that follows.
    ///
    /// The target of a step is what is paid over `n_step` steps and what the best action is worth then (Eqn. 2.44);
    /// nothing follows an end, and what was cut off is worth what its last state is. It acts by the best action but for
    /// `epsilon`, and when it is measured always.
    pub struct Dqn = "dqn" @ 1 {
        /// The layers up to the last linear map.
        net: Box<dyn Net> = Part::new("mlp").with("hidden", vec![64_i64, 64]);
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
        /// How many steps a target looks ahead (Sutton, 1988).
        n_step: usize = 1, in 1.0..=1e3, unit "steps";
        /// Whether the network itself says which action is best, and the copy only what it is worth (van Hasselt et al.,
        /// 2016).
        double: bool = false;
        /// How many steps an update looks at.
        batch: usize = 32, in 1.0..=1e6;
        /// How many steps are kept.
        replay: usize = 100_000, in 1.0..=1e8;
        /// After how many steps learning begins; all actions are drawn until then.
        warm_up: u64 = 5_000, in 1.0.., unit "steps";
        /// How many steps there are to an update.
        every: u64 = 4, in 1.0.., unit "steps";
        /// How the copy follows.
        target: Box<dyn Target> = Part::new("copied").with("every", 250_i64);
        /// The probability of an action drawn evenly.
        epsilon: Box<dyn Schedule> = Part::new("linear").with("from", 1.0).with("to", 0.1);
        /// After how many steps it stays as it is.
        explore: u64 = 100_000, in 1.0.., unit "steps";
        /// How the loss is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("adam")
            .with("lr", Part::new("constant").with("value", 2.5e-4));
        /// Up to which error the loss is a square. Where returns are far above it, as 100 is above 1, errors of values
        /// that grow are no longer corrected as fast as they grow: give a larger one.
        huber: f64 = 1.0, in f64::MIN_POSITIVE..;
        /// An agent of such a network to go on from, instead of one that has learned nothing.
        from: Option<One<Agent>>;
    }
}

impl Dqn {
    fn module(&self, spec: &Spec) -> Result<Module, Misfit> {
        let n = spec.does.n_discrete()?;
        if n > 256 {
            return Err(Misfit::new(format!("there are {n} actions, above 256"), "use fewer"));
        }
        ivx_nn::headed(&*self.net, &sight(&spec.sees), &[n])
    }

    /// What it has seen, to be learned from again.
    pub(super) fn replay(&self, setting: &Setting<'_>) -> Replay {
        let (kept, ahead) = ((self.replay, setting.lanes), (self.n_step, self.discount));
        Replay::new(&setting.spec.sees, kept, ahead)
    }

    /// How it tries what does not look best.
    pub(super) fn exploring<'a>(&'a self, ctx: &Ctx<'a>) -> Explore<'a> {
        Explore {
            epsilon: &*self.epsilon,
            over: self.explore,
            warm_up: self.warm_up,
            rng: ctx.rng("explore", &[]),
        }
    }

    /// How many updates there are to be after `t` steps.
    pub(super) fn due(&self, t: u64) -> u64 {
        t.checked_sub(self.warm_up).map_or(0, |t| t / self.every + 1)
    }

    /// How many bytes there are of what comes of a batch, of its gradients, and of what follows it.
    pub(super) fn outputs(&self, setting: &Setting<'_>) -> u64 {
        let outputs = |module: Module| module.n_outputs(&sight(&setting.spec.sees));
        self.module(setting.spec).map_or(0, outputs) * self.batch as u64 * 3 * 4
    }

    /// Whether learning can go on from an agent.
    pub(super) fn goes_on(&self, from: &Agent, spec: &Spec) -> Result<(), Misfit> {
        from.spec.same(spec)?;
        // Of an agent that has yet to be learned only its world is known.
        let is_later = from.nets.modules.is_empty();
        if is_later || from.nets.modules.get("q") == Some(&self.module(spec)?) {
            return Ok(());
        }
        Err(Misfit::new(
            "the agent to go on from has no such network of action values".to_owned(),
            "choose one that `dqn(..)` or `sqil(..)` learned with the same `net`",
        ))
    }

    /// A learner whose network is drawn, or begins as that of an agent, and which clones others beside or does not.
    pub(super) fn open<'a>(
        &'a self,
        (from, cloning): (Option<&Agent>, Option<Cloning<'a>>),
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Learner<'a>, OpError> {
        let spec = setting.spec;
        let modules = BTreeMap::from([("q".to_owned(), self.module(spec).map_err(failed)?)]);
        let mut nets = Networks::drawn(modules, &mut ctx.rng("init", &[]));
        if cloning.is_some() {
            join(&mut nets, &*self.net, spec, ctx)?;
        }
        for (name, _, values) in &mut nets.arrays {
            if let Some((.., learned)) = from.and_then(|from| from.nets.array(name)) {
                values.clone_from(learned);
            }
        }
        let mut live = Live::of(&nets);
        live.target("q");
        let steps = setting.steps.map_or(u64::MAX, |n| n.saturating_sub(self.warm_up) / self.every);
        let rule = Rule { optimiser: &*self.optimiser, pull: Pull::NONE, steps };
        Ok(Learner {
            how: self,
            descent: Descent::new(&live, &["q", CLONE], rule),
            live,
            replay: self.replay(setting),
            explore: self.exploring(ctx),
            spec: spec.clone(),
            draws: ctx.rng("replay", &[]),
            follow: self.target.rule(),
            batch: Batch::default(),
            losses: Means::new(match &cloning {
                None => &["loss", "value"],
                Some(_) => &["loss", "value", "cloning"],
            }),
            cloning,
            tried: Vec::new(),
            values: Vec::new(),
        })
    }
}

impl Method for Dqn {
    fn fits(&self, setting: &Setting<'_>) -> Result<(), Misfit> {
        self.module(setting.spec)?;
        self.from.as_deref().map_or(Ok(()), |from| self.goes_on(from, setting.spec))
    }

    fn replayed(&self) -> Option<&Dqn> {
        Some(self)
    }

    fn memory(&self, setting: &Setting<'_>) -> u64 {
        let spec = setting.spec;
        let Ok(module) = self.module(spec) else { return 0 };
        // A parameter, its gradient, two averages, the copy, and two more while it is kept.
        let params = module.n_params() * 7 * 4;
        // The replay, and once more while it is kept.
        params + self.outputs(setting) + 2 * Replay::bytes(&spec.sees, self.replay)
    }

    fn shares(&self) -> Option<&dyn Shares> {
        Some(self)
    }

    fn begin<'a>(
        &'a self,
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Box<dyn Learning + 'a>, OpError> {
        self.begin_beside(None, setting, ctx)
    }
}

impl Shares for Dqn {
    fn net(&self) -> &dyn Net {
        &*self.net
    }

    fn begin_beside<'a>(
        &'a self,
        cloning: Option<Cloning<'a>>,
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Box<dyn Learning + 'a>, OpError> {
        Ok(Box::new(self.open((self.from.as_deref(), cloning), setting, ctx)?))
    }
}

/// Deep Q-learning under way.
pub(super) struct Learner<'a> {
    pub(super) how: &'a Dqn,
    pub(super) live: Live,
    pub(super) descent: Descent<'a>,
    pub(super) replay: Replay,
    explore: Explore<'a>,
    pub(super) spec: Spec,
    pub(super) draws: ChaCha8Rng,
    pub(super) follow: Follow,
    pub(super) batch: Batch,
    pub(super) losses: Means,
    cloning: Option<Cloning<'a>>,
    tried: Vec<Option<usize>>,
    values: Vec<f32>,
}

impl Learning for Learner<'_> {
    fn act(&mut self, t: u64, seen: &Columns, acts: &mut Acts) {
        self.choose(t, seen, acts, |values| best(values));
    }

    fn see(&mut self, step: &Step) {
        self.replay.push(step);
    }

    fn learn(&mut self, t: u64) {
        while self.is_due(t) {
            self.update();
        }
    }

    fn updates(&self) -> u64 {
        self.descent.done()
    }

    fn agent(&self) -> Agent {
        let (nets, spec) = (self.live.networks(), self.spec.clone());
        Agent { acts: Choice::Greedy, nets, spec, knows: Vec::new() }
    }

    fn losses(&mut self) -> &mut Means {
        &mut self.losses
    }

    fn state(&mut self, state: &mut State) {
        state.within("live", |state| self.live.state(state));
        state.within("descent", |state| self.descent.state(state));
        state.within("replay", |state| self.replay.state(state));
        state.within("losses", |state| self.losses.state(state));
    }
}

impl Learner<'_> {
    /// Chooses an action for each lane: one drawn evenly, as often as it explores, and else one by the values.
    pub(super) fn choose(
        &mut self,
        t: u64,
        seen: &Columns,
        acts: &mut Acts,
        mut by: impl FnMut(&mut [f32]) -> usize,
    ) {
        let Ok(n) = self.spec.does.n_discrete() else { unreachable!("it fits") };
        self.explore.tried(t, n, seen.len(), &mut self.tried);
        if self.tried.iter().any(Option::is_none) {
            self.live.graph.begin();
            let q = self.live.graph.still(|| self.live.pass("q", look(&self.live, seen)));
            self.live.graph.read(q, &mut self.values);
        } else {
            self.values.resize(n * seen.len(), 0.0);
        }
        let rows = self.tried.iter().zip(self.values.chunks_exact_mut(n));
        for (act, (tried, values)) in acts.places.iter_mut().zip(rows) {
            *act = tried.unwrap_or_else(|| by(values));
        }
    }

    /// Whether an update is to be made now that `t` steps are done.
    pub(super) fn is_due(&self, t: u64) -> bool {
        self.descent.done() < self.how.due(t) && self.replay.has_targets()
    }

    /// Draws the steps that an update looks at.
    pub(super) fn draw(&mut self) {
        let Self { how, replay, batch, draws, .. } = self;
        draws.set_stream(self.descent.done());
        draws.set_word_pos(0);
        replay.draw(how.batch, draws, batch);
    }

    fn update(&mut self) {
        self.draw();
        let Self { how, live, replay, batch, cloning, .. } = self;
        let t = self.descent.done();
        let (mut value, mut cloned) = (f64::NAN, f64::NAN);
        let loss = self.descent.lower(live, |live| {
            let graph = &live.graph;
            let column = |values: &[f32]| graph.input(Shape::vectors(values.len(), 1), values);
            let target = graph.still(|| {
                let next = replay.look(graph, &batch.next);
                let own = how.double.then(|| live.pass("q", next));
                let (pays, weighs) = (column(&batch.rewards), column(&batch.discounts));
                q_target(graph, (live.pass("target.q", next), own), pays, weighs)
            });
            let q = live.pass("q", replay.look(graph, &batch.rows));
            value = graph.scalar(graph.still(|| graph.mean(q))).into();
            let loss = q_loss(graph, q, column(&batch.acts), target, how.huber);
            let Some(cloning) = cloning else { return loss };
            let [loss, apart] = cloning.beside(t, live, "q", loss);
            cloned = graph.scalar(apart).into();
            loss
        });
        // As many as there are names.
        self.losses.add(&[loss, value, cloned]);
        self.live.follow(self.follow, self.descent.done());
    }
}

/// `r + γ max_a q⁻(s', a)`; where `own` values say which action is best, `r + γ q⁻(s', argmax_a q(s', a))`.
///
/// - `next`: the values of the copy, and of the network itself, of the actions in each state that follows.
/// - `rewards`: what is paid up to there, one number an item.
/// - `discounts`: what the rest weighs, 0 where nothing follows.
pub fn q_target<F: Real>(
    graph: &Graph<F>,
    (next, own): (Var, Option<Var>),
    rewards: Var,
    discounts: Var,
) -> Var {
    let best = graph.pick(next, graph.argmax_items(own.unwrap_or(next)));
    graph.add(graph.mul(best, discounts), rewards)
}

/// The mean of Huber's losses of `q(s, a)` and its target.
///
/// - `acts`: what was done, counted from 0, one number an item.
pub fn q_loss<F: Real>(graph: &Graph<F>, q: Var, acts: Var, target: Var, delta: f64) -> Var {
    graph.mean(graph.huber(graph.pick(q, acts), target, delta))
}
