//! Generative adversarial imitation learning (Ho and Ermon, 2016).

use ivx_data::form::failed;
use ivx_data::{Columns, Demonstrations, Field, Misfit};
use ivx_nn::optim::Pull;
use ivx_nn::{
    Descent, Graph, Live, Module, Net, Networks, Optimiser, Payment, Rule, Shape, Var, headed,
};
use ivx_op::{Ctx, One, OpError, Part, State, declare};
use ivx_world::{Acts, Spec, Step};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::super::agent::{Agent, look};
use super::super::replay::{Batch, Replay};
use super::bc::shown_in;
use super::{Learning, Means, Method, Setting};

declare! {
    /// Generative adversarial imitation learning (Ho and Ermon, 2016): a network tells steps of demonstrations from those
    /// of the agent, which learns by what that pays for being taken for others.
    ///
    /// The network sees what was seen, as a vector, and what was done, as a 1 in the place of one of so many. It lowers
    /// `-ln D` of steps of demonstrations and `-ln(1 - D)` of as many of the agent's last, and its slope between the two is
    /// held near 1 (Gulrajani et al., 2017). A step is paid for as it is taken, by the network of that moment; what the
    /// world pays the agent never learns.
    pub struct Gail = "gail" @ 1 {
        /// What others did.
        shown: One<Demonstrations>;
        /// How it learns by acting, from what it is paid: such as `ppo(..)`.
        by: Box<dyn Method>;
        /// The layers of the network that tells steps apart, up to the last linear map: a perceptron.
        net: Box<dyn Net> = Part::new("mlp").with("hidden", vec![64_i64, 64]).with("activation", Part::new("tanh"));
        /// What that pays of the probability `D` that others took a step: `"positive"`, `-ln(1 - D)`, which pays to go on;
        /// `"negative"`, `ln D`, which pays to end; or `"logit"`, `ln D - ln(1 - D)` (Fu et al., 2018).
        pays: String = "positive";
        /// The weight of `(‖∂x/∂(s, a)‖ - 1)²`, where `x` is the logit of `D`.
        penalty: f64 = 10.0, in 0.0..;
        /// How many steps of demonstrations, and of its own, an update of that network looks at.
        batch: usize = 64, in 1.0..=1e6;
        /// How many of its own last steps are looked at.
        recent: usize = 2_048, in 1.0..=1e8;
        /// How many steps there are to such an update. The first comes when there is a batch of own steps.
        every: u64 = 4, in 1.0.., unit "steps";
        /// How its loss is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("adam")
            .with("lr", Part::new("constant").with("value", 1e-3));
    }
}

/// How many numbers the network sees of a step.
fn width(spec: &Spec) -> Result<usize, Misfit> {
    Ok(spec.sees.iter().map(Field::spread).sum::<usize>() + spec.does.n_discrete()?)
}

/// What the network is called that tells steps apart.
const TELLS: &str = "discriminator";

impl Gail {
    fn module(&self, spec: &Spec) -> Result<Module, Misfit> {
        let n = spec.does.n_discrete()?;
        if n > 256 {
            return Err(Misfit::new(format!("there are {n} actions, above 256"), "use fewer"));
        }
        let module = headed(&*self.net, &[width(spec)?], &[1])?;
        if module.is_perceptron() {
            return Ok(module);
        }
        let message = "what tells steps apart is no perceptron whose slopes are known";
        Err(Misfit::new(message.to_owned(), "use `mlp(..)`, with another curve than `silu()`"))
    }

    fn payment(&self) -> Result<Payment, Misfit> {
        match self.pays.as_str() {
            "positive" => Ok(Payment::Positive),
            "negative" => Ok(Payment::Negative),
            "logit" => Ok(Payment::Logit),
            other => {
                let message = format!("nothing is paid as `\"{other}\"`");
                Err(Misfit::new(message, "write `\"positive\"`, `\"negative\"` or `\"logit\"`"))
            }
        }
    }
}

impl Method for Gail {
    fn fits(&self, setting: &Setting<'_>) -> Result<(), Misfit> {
        if !self.by.is_paid() {
            let message = "what it learns by learns from nothing that is paid".to_owned();
            return Err(Misfit::new(message, "use one that does, such as `by: ppo(..)`"));
        }
        shown_in(&self.shown, setting.spec)?;
        self.module(setting.spec)?;
        self.payment()?;
        self.by.fits(setting)
    }

    fn memory(&self, setting: &Setting<'_>) -> u64 {
        let spec = setting.spec;
        let (Ok(module), Ok(width)) = (self.module(spec), width(spec)) else { return 0 };
        let (sees, seen) = (&spec.sees, &self.shown.paths.seen);
        // A parameter, its gradient, two averages, and two more while it is kept.
        let params = module.n_params() * 6 * 4;
        // Of both batches and what lies between, with the slopes and the gradients of all.
        let outputs = module.n_outputs(&[width]) * self.batch as u64 * 8 * 4;
        let steps = 2 * Replay::bytes(sees, self.recent) + Replay::bytes(sees, seen.len());
        self.by.memory(setting) + params + outputs + steps
    }

    fn is_paid(&self) -> bool {
        false
    }

    fn begin<'a>(
        &'a self,
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Box<dyn Learning + 'a>, OpError> {
        let (spec, paths) = (setting.spec, &self.shown.paths);
        if paths.n_steps() == 0 {
            return Err(OpError::Failed("there are no steps to learn from".to_owned()));
        }
        let modules = [(TELLS.to_owned(), self.module(spec).map_err(failed)?)].into();
        let live = Live::of(&Networks::drawn(modules, &mut ctx.rng("init", &[TELLS])));
        let mut by = self.by.begin(setting, ctx)?;
        let names = [&["discriminator", "penalty"], by.losses().names()].concat();
        let first = (self.batch as u64).max(2 * setting.lanes as u64);
        let steps = setting.steps.map_or(u64::MAX, |n| n.saturating_sub(first) / self.every);
        let rule = Rule { optimiser: &*self.optimiser, pull: Pull::NONE, steps };
        Ok(Box::new(Learner {
            how: self,
            payment: self.payment().map_err(failed)?,
            first,
            descent: Descent::new(&live, &[TELLS], rule),
            live,
            n: spec.does.n_discrete().map_err(failed)?,
            shown: Replay::of(paths, 0.0, (1, 0.0)),
            own: Replay::new(&spec.sees, (self.recent, setting.lanes), (1, 0.0)),
            batches: [Batch::default(), Batch::default()],
            draws: ctx.rng("replay", &[TELLS]),
            losses: Means::new(&names),
            by,
        }))
    }
}

struct Learner<'a> {
    how: &'a Gail,
    payment: Payment,
    /// After how many steps the first update is made.
    first: u64,
    live: Live,
    descent: Descent<'a>,
    /// How many actions there are.
    n: usize,
    /// Steps of demonstrations and its own, and those that an update looks at.
    shown: Replay,
    own: Replay,
    batches: [Batch; 2],
    draws: ChaCha8Rng,
    losses: Means,
    by: Box<dyn Learning + 'a>,
}

/// What was seen, and what was done of `n` actions, as the network sees them.
fn told(
    graph: &Graph<f32>,
    seen: Var,
    acts: impl ExactSizeIterator<Item = usize>,
    n: usize,
) -> Var {
    let done = graph.filled(Shape::vectors(acts.len(), n), |out| {
        out.fill(0.0);
        out.chunks_exact_mut(n).zip(acts).for_each(|(row, act)| row[act] = 1.0);
    });
    graph.concat(&[seen, done])
}

impl Learning for Learner<'_> {
    fn act(&mut self, t: u64, seen: &Columns, acts: &mut Acts) {
        self.by.act(t, seen, acts);
    }

    fn see(&mut self, step: &Step) {
        let Self { live, payment, n, .. } = self;
        live.graph.begin();
        let logits = live.graph.still(|| {
            let acts = step.acts.places.iter().copied();
            live.pass(TELLS, told(&live.graph, look(live, &step.before), acts, *n))
        });
        let paid = live.graph.value(logits).into_iter().map(|logit| payment.of(logit).into());
        let step = Step { rewards: paid.collect(), ..step.clone() };
        self.own.push(&step);
        self.by.see(&step);
    }

    fn learn(&mut self, t: u64) {
        if let Some(after) = t.checked_sub(self.first) {
            while self.descent.done() < after / self.how.every + 1 {
                self.update();
            }
        }
        self.by.learn(t);
        self.losses.gather(self.by.losses());
    }

    fn updates(&self) -> u64 {
        self.by.updates()
    }

    fn agent(&self) -> Agent {
        self.by.agent()
    }

    fn losses(&mut self) -> &mut Means {
        &mut self.losses
    }

    fn state(&mut self, state: &mut State) {
        state.within("live", |state| self.live.state(state));
        state.within("descent", |state| self.descent.state(state));
        state.within("own", |state| self.own.state(state));
        state.within("losses", |state| self.losses.state(state));
        state.within("by", |state| self.by.state(state));
    }
}

impl Learner<'_> {
    fn update(&mut self) {
        let Self { how, live, n, shown, own, batches, draws, .. } = self;
        draws.set_stream(self.descent.done());
        draws.set_word_pos(0);
        let size = how.batch;
        let [theirs, mine] = batches;
        shown.draw(size, draws, theirs);
        own.draw(size, draws, mine);
        let mut parts = [f64::NAN; 2];
        self.descent.lower(live, |live| {
            let graph = &live.graph;
            let steps = |of: &Replay, batch: &Batch| {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "places"
                )]
                let acts = batch.acts.iter().map(|act| *act as usize);
                told(graph, of.look(graph, &batch.rows), acts, *n)
            };
            let (theirs, mine) = (steps(shown, theirs), steps(own, mine));
            let logits = [theirs, mine].map(|steps| live.pass(TELLS, steps));
            let shares =
                graph.filled(Shape::vectors(size, 1), |out| out.fill_with(|| draws.random()));
            let between = graph.between(theirs, mine, shares);
            let body = live.body(TELLS);
            let layers = body.module.perceptron(body.params).expect("it is one");
            let loss = graph.discriminator_loss(logits[0], logits[1]);
            let penalty = graph.gradient_penalty(&layers, between);
            parts = [loss, penalty].map(|part| graph.scalar(part).into());
            graph.add(loss, graph.affine(penalty, how.penalty, 0.0))
        });
        self.losses.add(&parts);
    }
}
