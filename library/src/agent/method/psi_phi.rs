//! ΨΦ-learning (Algorithm 3).

use ivx_data::form::failed;
use ivx_data::{Columns, Demonstrations, Misfit};
use ivx_math::successor::Preferences;
use ivx_nn::optim::Pull;
use ivx_nn::{
    Descent, Follow, Graph, Live, Norm, PsiPhiLosses, Real as _, Rule, Shape, SuccessorSteps, Var,
    Weighting,
};
use ivx_op::{Ctx, One, OpError, Part, State, declare};
use ivx_world::{Acts, Spec, Step};
use rand_chacha::ChaCha8Rng;

use super::super::agent::{Agent, Choice, TORSO, look};
use super::super::explore::Explore;
use super::super::features::{
    Heads, Others, PHI, PSI, TASK, W, average, copy, policies, psi, size,
};
use super::super::improve::{best, worth};
use super::super::replay::{Batch, Replay};
use super::super::resample::Resample;
use super::super::shown::{Drawn, Shown, column};
use super::bc::shown_in;
use super::{Dqn, Learning, Means, Method, Setting, q_loss, q_target};

declare! {
    /// ΨΦ-learning (Algorithm 3): an agent that learns by acting, with cumulants that explain what it is paid and what
    /// others did without being told what they were paid.
    ///
    /// From demonstrations it learns as `itd` does. Of its own steps it learns which preferences explain what they paid
    /// (by least squares over the steps of the last some hundred updates, by the cumulants that were of that moment; Alg.
    /// 3, line 5), cumulants that do (Eqn. 4.21a), and features of its own, whose values are to be right (Eqn. 4.21b, as
    /// deep Q-learning has it) and which are to be consistent with cumulants (Eqn. 4.21c, weighing `1/d`), both over
    /// `n_step` steps. The next action of the latter is that which the former thinks best. Errors of features are squared
    /// lengths.
    ///
    /// It acts by the best of all policies, its own and those of others, where each is worth the lowest of what its
    /// members say (Eqn. 4.23), but for `epsilon`.
    pub struct PsiPhi = "psi_phi" @ 3 {
        /// What others did, and who.
        shown: One<Demonstrations>;
        /// How it learns from what it does: `dqn`, whose network up to the last linear map is what all share.
        by: Box<dyn Method> = Part::new("dqn");
        /// The widths of the hidden layers of cumulants.
        cumulants: Vec<usize> = vec![64_i64], in 1.0..=1e5;
        /// The widths of the hidden layers of successor features.
        features: Vec<usize> = vec![64_i64], in 1.0..=1e5;
        /// How many numbers a cumulant has.
        width: usize = 4, in 1.0..=1e4;
        /// How many successor features each policy has, which start apart and learn each from a resample of episodes, and
        /// of runs of 64 own steps.
        members: usize = 2, in 1.0..=1e3;
        /// How many of these are heard when it acts; 0 for all. One of several is no pessimism (Fig. 4.6).
        heard: usize = 0, in 0.0..=1e3;
        /// What the size of a preference of others costs, over all cumulants and demonstrators together.
        sparsity: f64 = 0.05, in 0.0..;
        /// What the square of a preference of its own costs, beside the mean squared error of what was paid.
        ridge: f64 = 1e-4, in f64::MIN_POSITIVE..;
        /// Whether its own steps are demonstrations, too (Alg. 3, line 7, which is optional): cloned, and explained by
        /// cumulants with its own preferences, as those of others are.
        appended: bool = false;
        /// An agent of such networks to go on from in a new task, instead of one that has learned nothing.
        from: Option<One<Agent>>;
    }
}

impl PsiPhi {
    fn by(&self) -> Result<&Dqn, Misfit> {
        let other = "it learns from steps that are kept, which this method does not";
        self.by.replayed().ok_or_else(|| Misfit::new(other.to_owned(), "write `by: dqn(..)`"))
    }

    fn heads<'a>(&'a self, by: &'a Dqn) -> Heads<'a> {
        Heads {
            net: &*by.net,
            cumulants: &self.cumulants,
            features: &self.features,
            width: self.width,
            members: self.members,
        }
    }

    /// How many members are heard.
    fn heard(&self) -> usize {
        if self.heard == 0 { self.members } else { self.heard }
    }
}

impl Method for PsiPhi {
    fn fits(&self, setting: &Setting<'_>) -> Result<(), Misfit> {
        let by = self.by()?;
        if self.heard > self.members {
            let message = format!("{} members are heard of {}", self.heard, self.members);
            return Err(Misfit::new(message, "hear fewer"));
        }
        if by.from.is_some() {
            let message = "it goes on from an agent of its own kind, and not of `dqn`'s".to_owned();
            return Err(Misfit::new(message, "write `from` beside `by`"));
        }
        shown_in(&self.shown, setting.spec)?;
        by.fits(setting)?;
        if let Some(from) = &self.from {
            from.spec.same(setting.spec)?;
        }
        self.heads(by).fit(setting.spec)
    }

    fn memory(&self, setting: &Setting<'_>) -> u64 {
        let Ok(by) = self.by() else { return 0 };
        let n_policies = self.shown.names.len().max(1) + 1;
        // Cumulants are reckoned at every step that a target looks at.
        let heads = self.heads(by);
        heads.memory(setting.spec, n_policies, by.batch * (1 + by.n_step))
            + 2 * Replay::bytes(&setting.spec.sees, by.replay)
    }

    fn begin<'a>(
        &'a self,
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Box<dyn Learning + 'a>, OpError> {
        let by = self.by().map_err(failed)?;
        let (spec, n) = (setting.spec, self.shown.names.len());
        let drawn = |name: &str| ctx.rng("init", &[name]);
        let mut nets = self.heads(by).draw(spec, &(0..=n), &drawn).map_err(failed)?;
        if let Some(from) = &self.from {
            if from.nets.modules != nets.modules || from.knows != self.shown.names {
                let message = "the agent to go on from has other networks, or knows others";
                return Err(OpError::Failed(message.to_owned()));
            }
            nets.arrays.clone_from(&from.nets.arrays);
        }
        let mut live = Live::of(&nets);
        live.target(TORSO);
        live.target(PSI);
        let steps = setting.steps.map_or(u64::MAX, |n| n.saturating_sub(by.warm_up) / by.every);
        let rule = Rule { optimiser: &*by.optimiser, pull: Pull::NONE, steps };
        Ok(Box::new(Learner {
            how: self,
            by,
            descent: Descent::new(&live, &[TORSO, PHI, PSI, W], rule),
            policies: policies(&nets),
            live,
            task: Task::new(self.width, self.ridge),
            others: Others {
                shown: Shown::new(&self.shown)?,
                draws: ctx.rng("shown", &[]),
                width: self.width,
                discount: by.discount,
                drawn: Drawn::default(),
                resample: Resample::new(ctx.rng("resample", &["shown"]), self.members),
            },
            replay: by.replay(setting),
            resample: Resample::new(ctx.rng("resample", &["own"]), self.members),
            explore: by.exploring(ctx),
            spec: spec.clone(),
            draws: ctx.rng("replay", &[]),
            follow: by.target.rule(),
            batch: Batch::default(),
            along: Vec::new(),
            losses: Means::new(&[
                "loss",
                "acts",
                "inverse",
                "reward",
                "value",
                "features",
                "preferences",
                "cumulants",
            ]),
            tried: Vec::new(),
            values: Vec::new(),
        }))
    }
}

/// What the agent's own task is, by the steps that were looked at lately.
struct Task {
    seen: Preferences,
    /// How many steps that are.
    n: f64,
    ridge: f64,
}

/// How much of what was seen is kept from one update to the next: about a hundred updates, over which cumulants change
/// little.
const KEPT: f64 = 0.99;

/// How many own steps in a row members learn from together.
const RUN: u64 = 64;

impl Task {
    fn new(width: usize, ridge: f64) -> Self {
        Self { seen: Preferences::new(width), n: 0.0, ridge }
    }

    /// Sees the cumulants and rewards of some steps, and says which preferences explain them.
    fn see(&mut self, cumulants: &[f32], paid: &[f32]) -> Vec<f64> {
        self.seen.fade(KEPT);
        self.n *= KEPT;
        for (phi, paid) in cumulants.chunks_exact(self.seen.paid.len()).zip(paid) {
            let phi: Vec<f64> = phi.iter().map(|x| f64::from(*x)).collect();
            self.seen.see(&phi, f64::from(*paid));
            self.n += 1.0;
        }
        self.seen.infer(self.ridge * self.n)
    }
}

/// The losses of a member over own steps: of values, of features, and of both as demonstrations.
struct Own {
    value: Var,
    features: Var,
    shown: Option<(Var, Var)>,
}

struct Learner<'a> {
    how: &'a PsiPhi,
    by: &'a Dqn,
    live: Live,
    descent: Descent<'a>,
    policies: Vec<Vec<String>>,
    task: Task,
    others: Others<'a>,
    replay: Replay,
    resample: Resample,
    explore: Explore<'a>,
    spec: Spec,
    draws: ChaCha8Rng,
    follow: Follow,
    batch: Batch,
    along: Vec<(usize, usize)>,
    losses: Means,
    tried: Vec<Option<usize>>,
    values: Vec<f64>,
}

impl Learning for Learner<'_> {
    fn act(&mut self, t: u64, seen: &Columns, acts: &mut Acts) {
        let Ok(n) = self.spec.does.n_discrete() else { unreachable!("it fits") };
        self.explore.tried(t, n, seen.len(), &mut self.tried);
        let sizes = (self.policies.len(), self.how.members);
        let width = sizes.0 * sizes.1 * n;
        self.values.resize(width * seen.len(), 0.0);
        if self.tried.iter().any(Option::is_none) {
            self.live.graph.begin();
            let z = self.live.graph.still(|| self.live.pass(TORSO, look(&self.live, seen)));
            worth(&self.live, &self.policies, Some(TASK), z, &mut self.values);
        }
        let heard = self.how.heard();
        let lowest = |said: &[f64]| ivx_math::order::min(&said[..heard]);
        let rows = self.tried.iter().zip(self.values.chunks_exact(width));
        for (act, (tried, values)) in acts.places.iter_mut().zip(rows) {
            *act = tried.unwrap_or_else(|| best(values, sizes, &lowest));
        }
    }

    fn see(&mut self, step: &Step) {
        self.replay.push(step);
    }

    fn learn(&mut self, t: u64) {
        let due = self.by.due(t);
        while self.descent.done() < due && self.replay.has_targets() {
            self.update();
        }
    }

    fn updates(&self) -> u64 {
        self.descent.done()
    }

    fn agent(&self) -> Agent {
        Agent {
            acts: Choice::Improved(self.how.heard()),
            nets: self.live.networks(),
            spec: self.spec.clone(),
            knows: self.how.shown.names.clone(),
        }
    }

    fn losses(&mut self) -> &mut Means {
        &mut self.losses
    }

    fn state(&mut self, state: &mut State) {
        state.within("live", |state| self.live.state(state));
        state.within("descent", |state| self.descent.state(state));
        state.within("replay", |state| self.replay.state(state));
        state.within("losses", |state| self.losses.state(state));
        state.reals("products", &mut self.task.seen.products);
        state.reals("paid", &mut self.task.seen.paid);
        state.real("n", &mut self.task.n);
    }
}

impl Learner<'_> {
    fn update(&mut self) {
        let Self { how, by, live, others, replay, batch, along, draws, task, resample, .. } = self;
        others.draw(self.descent.done(), by.batch);
        draws.set_stream(self.descent.done());
        draws.set_word_pos(0);
        replay.draw(by.batch, draws, batch);
        replay.along(batch, along);
        let run = |(lane, place): &(usize, usize)| ((*lane as u64) << 32) | (*place as u64 / RUN);
        resample.keep(&batch.rows.iter().map(run));
        let all = 0..batch.rows.len();
        let own = live.group(&[TASK])[0];
        let mut told = [0.0; 7];
        let loss = self.descent.lower(live, |live| {
            let graph = &live.graph;
            let (z, acts) =
                (live.pass(TORSO, replay.look(graph, &batch.rows)), column(graph, &batch.acts));
            let cumulants = graph.gather(live.pass(PHI, z), acts, how.width);
            let seen = graph.value(cumulants);
            let w = task.see(&seen, &batch.paid);
            {
                let mut params = graph.params();
                params.value_mut(own).iter_mut().zip(w).for_each(|(x, w)| *x = f32::of(w));
            }
            let w = graph.stop_gradient(live.array(TASK));
            let reward = graph.reward_loss(cumulants, w, column(graph, &batch.paid), Norm::Squares);
            let sums = if along.is_empty() {
                cumulants
            } else {
                sums(live, replay, (&seen, along, &batch.spans), (how.width, by.discount))
            };
            let (paid, discounts) =
                (column(graph, &batch.rewards), column(graph, &batch.discounts));
            let then = graph.still(|| live.pass(&copy(TORSO), replay.look(graph, &batch.next)));
            let then_own = by
                .double
                .then(|| graph.still(|| live.pass(TORSO, replay.look(graph, &batch.next))));
            // As a demonstration each is explained by the cumulants of its first step, which learn, and of those after it.
            let explaining = how.appended.then(|| {
                let after = graph.stop_gradient(graph.sub(sums, cumulants));
                graph.add(cumulants, after)
            });
            let each: Vec<Own> = (0..how.members)
                .map(|m| {
                    let net = psi(0, m);
                    let places = resample.within(m, &all);
                    let own = |x: Var| graph.items(x, &places);
                    let still = |x: Var| graph.still(|| own(x));
                    let (z, acts, sums) = (own(z), own(acts), own(sums));
                    let (paid, discounts) = (still(paid), still(discounts));
                    let (then, then_own) = (still(then), then_own.map(still));
                    let all = live.pass(&net, z);
                    let (next, target, best) = graph.still(|| {
                        let next = live.pass(&copy(&net), then);
                        let worth = graph.contract(next, w);
                        let said = then_own.map(|then| graph.contract(live.pass(&net, then), w));
                        let best = graph.argmax_items(said.unwrap_or(worth));
                        (next, q_target(graph, (worth, said), paid, discounts), best)
                    });
                    let next = graph.still(|| graph.gather(next, best, how.width));
                    let features = graph.gather(all, acts, how.width);
                    let steps = SuccessorSteps { features, cumulants: sums, next, discounts };
                    let value = q_loss(graph, graph.contract(all, w), acts, target, by.huber);
                    let shown = explaining.map(|cumulants| {
                        let steps = SuccessorSteps { cumulants: own(cumulants), ..steps };
                        let inverse = graph.inverse_loss(&steps, Norm::Squares);
                        (graph.demonstrator_loss(all, w, acts), inverse)
                    });
                    Own { value, features: graph.successor_loss(&steps, Norm::Squares), shown }
                })
                .collect();
            let mut shown = others.losses(live, Norm::Squares).0;
            if how.appended {
                let all: Vec<(Var, Var)> = each.iter().filter_map(|own| own.shown).collect();
                let of = |part: fn(&(Var, Var)) -> Var| average(graph, all.iter().map(part));
                shown.push((of(|(acts, _)| *acts), of(|(_, inverse)| *inverse)));
            }
            let losses = PsiPhiLosses {
                others: shown,
                reward,
                value: average(graph, each.iter().map(|own| own.value)),
                features: average(graph, each.iter().map(|own| own.features)),
            };
            let sparse = others.sparsity(live, how.sparsity);
            let of = |x: Var| f64::from(graph.scalar(x));
            let all = |of: &dyn Fn(&(Var, Var)) -> f64| losses.others.iter().map(of).sum::<f64>();
            told = [
                all(&|(acts, _)| of(*acts)),
                all(&|(_, inverse)| of(*inverse)),
                of(losses.reward),
                of(losses.value),
                of(losses.features),
                of(sparse),
                size(&seen),
            ];
            graph.add(graph.psi_phi_loss(&losses, how.width, Weighting::ByFeature), sparse)
        });
        let parts: Vec<f64> = [loss].into_iter().chain(told).collect();
        self.losses.add(&parts);
        self.live.follow(self.follow, self.descent.done());
    }
}

/// `Σ_i γ^i Φ(s_i, a_i)` over the steps that each target looks at: `[N, d]`. They have no gradient.
///
/// - `first`: the cumulants of the first step of each.
/// - `along`: the rows of those after it.
fn sums(
    live: &Live,
    replay: &Replay,
    (first, along, spans): (&[f32], &[(usize, usize)], &[usize]),
    (width, discount): (usize, f64),
) -> Var {
    let graph: &Graph<f32> = &live.graph;
    let acts: Vec<f32> = replay.acts(along).collect();
    let each = graph.still(|| {
        let z = live.pass(TORSO, replay.look(graph, along));
        graph.gather(live.pass(PHI, z), column(graph, &acts), width)
    });
    let each = graph.value(each);
    let mut steps = each.chunks_exact(width);
    graph.filled(Shape::vectors(spans.len(), width), |out| {
        out.copy_from_slice(first);
        for (out, span) in out.chunks_exact_mut(width).zip(spans) {
            let mut weight = discount;
            for phi in steps.by_ref().take(span - 1) {
                out.iter_mut().zip(phi).for_each(|(sum, x)| *sum += f32::of(weight) * x);
                weight *= discount;
            }
        }
    })
}
