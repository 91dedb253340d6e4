//! Soft Q imitation learning (Reddy et al., 2019).

use ivx_data::form::failed;
use ivx_data::{Columns, Demonstrations, Misfit};
use ivx_nn::{Real as _, Shape, SoftSteps};
use ivx_op::{Ctx, One, OpError, Part, State, declare};
use ivx_world::{Acts, Step};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::super::agent::{Agent, Choice, TEMPERATURE, softened};
use super::super::replay::{Batch, Replay};
use super::bc::shown_in;
use super::dqn::{self, Dqn};
use super::{Learning, Means, Method, Setting};

declare! {
    /// Soft Q imitation learning (Reddy et al., 2019): each update looks at as many steps of demonstrations, which pay 1,
    /// as of its own, which pay 0, and lowers the squares of their soft temporal-difference errors.
    ///
    /// What the world pays it never learns. The settings of deep Q-learning count as they do there, but that it acts by
    /// `softmax(q / α)` where that acts by the best action, and that what follows is worth `α ln Σ e^{q⁻ / α}`. Over
    /// `n_step` steps a target is what they pay and that worth then.
    ///
    /// Nothing follows an end, nor one that others sought: where they end an episode by what they reach, going on beside
    /// them pays more than ending it (Kostrikov et al., 2019).
    pub struct Sqil = "sqil" @ 1 {
        /// What others did.
        shown: One<Demonstrations>;
        /// The deep Q-learning, `dqn(..)`, by whose settings it learns. Its batch is of each of the two kinds.
        by: Box<dyn Method> = Part::new("dqn");
        /// The temperature `α`, in the unit of values, in which a step of demonstrations pays 1: an action that is worth `α`
        /// less is taken `e` times less often.
        temperature: f64 = 0.1, in 1e-6..;
        /// The weight `λ` of the loss of its own steps.
        weight: f64 = 1.0, in 0.0..;
        /// Whether it acts by the best action when it is measured and when it has learned, or as it does to learn.
        greedy: bool = false;
        /// An agent of such a network to go on from, instead of one that has learned nothing.
        from: Option<One<Agent>>;
    }
}

impl Sqil {
    /// The settings by which it learns.
    fn settings(&self) -> Result<&Dqn, Misfit> {
        let not = |what: &str, help: &str| Err(Misfit::new(what.to_owned(), help));
        let Some(by) = self.by.replayed() else {
            return not("it learns by the settings of deep Q-learning", "write `by: dqn(..)`");
        };
        if by.double {
            let help = "leave `double` of `dqn` out";
            return not("soft values have no best action that another network could choose", help);
        }
        if by.huber != 1.0 {
            return not("its errors are squared, however large", "leave `huber` of `dqn` out");
        }
        if by.from.is_some() && self.from.is_some() {
            return not("it cannot go on from two agents", "leave one `from` out");
        }
        Ok(by)
    }

    fn temperature(&self) -> f32 {
        f32::of(self.temperature)
    }

    fn from(&self) -> Option<&Agent> {
        self.from.as_deref().or_else(|| self.by.replayed()?.from.as_deref())
    }
}

impl Method for Sqil {
    fn fits(&self, setting: &Setting<'_>) -> Result<(), Misfit> {
        let by = self.settings()?;
        shown_in(&self.shown, setting.spec)?;
        by.fits(setting)?;
        self.from().map_or(Ok(()), |from| by.goes_on(from, setting.spec))
    }

    fn memory(&self, setting: &Setting<'_>) -> u64 {
        let Ok(by) = self.settings() else { return 0 };
        let seen = &self.shown.paths.seen;
        by.memory(setting) + by.outputs(setting) + Replay::bytes(seen.fields(), seen.len())
    }

    fn is_paid(&self) -> bool {
        false
    }

    fn begin<'a>(
        &'a self,
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Box<dyn Learning + 'a>, OpError> {
        let by = self.settings().map_err(failed)?;
        let paths = &self.shown.paths;
        if paths.n_steps() == 0 {
            return Err(OpError::Failed("there are no steps to learn from".to_owned()));
        }
        let mut of = by.open((self.from(), None), setting, ctx)?;
        of.losses = Means::new(&["loss", "shown", "own"]);
        Ok(Box::new(Learner {
            how: self,
            of,
            shown: Replay::of(paths, 1.0, (by.n_step, by.discount)),
            batch: Batch::default(),
            draws: ctx.rng("replay", &["shown"]),
            acts: ctx.rng("act", &[]),
        }))
    }
}

struct Learner<'a> {
    how: &'a Sqil,
    of: dqn::Learner<'a>,
    /// The steps of demonstrations, and those of them that an update looks at.
    shown: Replay,
    batch: Batch,
    draws: ChaCha8Rng,
    /// By which actions are drawn.
    acts: ChaCha8Rng,
}

impl Learning for Learner<'_> {
    fn act(&mut self, t: u64, seen: &Columns, acts: &mut Acts) {
        let (temperature, rng) = (self.how.temperature(), &mut self.acts);
        rng.set_stream(t);
        rng.set_word_pos(0);
        self.of.choose(t, seen, acts, |values| softened(values, temperature, rng.random()));
    }

    fn see(&mut self, step: &Step) {
        self.of.see(step);
    }

    fn learn(&mut self, t: u64) {
        while self.of.is_due(t) {
            self.update();
        }
    }

    fn updates(&self) -> u64 {
        self.of.updates()
    }

    fn agent(&self) -> Agent {
        let mut agent = self.of.agent();
        if !self.how.greedy {
            agent.acts = Choice::Softened;
            agent.nets.put((TEMPERATURE.to_owned(), vec![1], vec![self.how.temperature()]));
        }
        agent
    }

    fn losses(&mut self) -> &mut Means {
        self.of.losses()
    }

    fn state(&mut self, state: &mut State) {
        self.of.state(state);
    }
}

impl Learner<'_> {
    fn update(&mut self) {
        let Self { how, of, shown, batch, draws, .. } = self;
        draws.set_stream(of.descent.done());
        draws.set_word_pos(0);
        shown.draw(of.how.batch, draws, batch);
        of.draw();
        // What the world pays is not for it to know.
        of.batch.rewards.fill(0.0);
        let mut parts = [f64::NAN; 3];
        let dqn::Learner { live, replay, batch: own, .. } = of;
        of.descent.lower(live, |live| {
            let graph = &live.graph;
            let column = |values: &[f32]| graph.input(Shape::vectors(values.len(), 1), values);
            let steps = |of: &Replay, batch: &Batch| SoftSteps {
                values: live.pass("q", of.look(graph, &batch.rows)),
                acts: column(&batch.acts),
                rewards: column(&batch.rewards),
                next: graph.still(|| live.pass("target.q", of.look(graph, &batch.next))),
                discounts: column(&batch.discounts),
            };
            let (shown, own) = (steps(shown, batch), steps(replay, own));
            let found = graph.soft_imitation_loss(&shown, &own, how.temperature, how.weight);
            parts = found.map(|part| graph.scalar(part).into());
            found[0]
        });
        of.losses.add(&parts);
        of.live.follow(of.follow, of.descent.done());
    }
}
