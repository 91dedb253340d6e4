//! Behaviour cloning (Pomerleau, 1989).

use std::collections::BTreeMap;

use ivx_data::form::failed;
use ivx_data::{Columns, Demonstrations, Misfit, Values, same_world};
use ivx_nn::optim::Pull;
use ivx_nn::{Descent, Graph, Live, Module, Net, Networks, Optimiser, Rule, Shape, Turns, Var};
use ivx_op::{Ctx, One, OpError, Part, State, declare};
use ivx_world::{Acts, Spec, Step};

use super::super::agent::{Agent, Choice, seen_shape, sight};
use super::super::demonstrate::seen_before;
use super::{Learning, Means, Method, Setting};

declare! {
    /// Behaviour cloning (Pomerleau, 1989): a classifier of actions by what was seen, `-ln softmax f(s)[a]` on average
    /// over steps of demonstrations (Eqn. 2.23; Eqn. 4.17 has it of successor features).
    ///
    /// It never acts to learn: where steps of the world are counted it makes an update for each.
    pub struct Bc = "bc" @ 1 {
        /// What others did.
        shown: One<Demonstrations>;
        /// The layers up to the last linear map.
        net: Box<dyn Net> = Part::new("mlp").with("hidden", vec![64_i64, 64]);
        /// How many steps an update looks at.
        batch: usize = 64, in 1.0..=1e6;
        /// How the loss is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("adam")
            .with("lr", Part::new("constant").with("value", 1e-3));
        /// Whether it acts by the likeliest action, or by one drawn as probably as it thinks others take it.
        greedy: bool = true;
    }
}

/// Whether demonstrations are of such a world.
pub(super) fn shown_in(shown: &Demonstrations, spec: &Spec) -> Result<(), Misfit> {
    let own = (shown.paths.seen.fields(), &shown.paths.does);
    same_world("the demonstrations show", own, (&spec.sees, &spec.does))
}

impl Bc {
    fn module(&self, spec: &Spec) -> Result<Module, Misfit> {
        let n = spec.does.n_discrete()?;
        ivx_nn::headed(&*self.net, &sight(&spec.sees), &[n])
    }
}

impl Method for Bc {
    fn fits(&self, setting: &Setting<'_>) -> Result<(), Misfit> {
        shown_in(&self.shown, setting.spec)?;
        self.module(setting.spec).map(drop)
    }

    fn memory(&self, setting: &Setting<'_>) -> u64 {
        let spec = setting.spec;
        let Ok(module) = self.module(spec) else { return 0 };
        // A parameter, its gradient, two averages, and two more while it is kept.
        let params = module.n_params() * 6 * 4;
        params + module.n_outputs(&sight(&spec.sees)) * self.batch as u64 * 2 * 4
    }

    fn acts(&self) -> bool {
        false
    }

    fn cloned(&self) -> Option<&Bc> {
        Some(self)
    }

    fn begin<'a>(
        &'a self,
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Box<dyn Learning + 'a>, OpError> {
        let spec = setting.spec;
        let module = self.module(spec).map_err(failed)?;
        let modules = BTreeMap::from([("policy".to_owned(), module)]);
        let live = Live::of(&Networks::drawn(modules, &mut ctx.rng("init", &[])));
        let steps = setting.steps.or(setting.updates).unwrap_or(u64::MAX);
        let rule = Rule { optimiser: &*self.optimiser, pull: Pull::NONE, steps };
        Ok(Box::new(Learner {
            how: self,
            descent: Descent::new(&live, &["policy"], rule),
            live,
            examples: Examples::new(&self.shown, self.batch, ctx)?,
            spec: spec.clone(),
            losses: Means::new(&["loss"]),
        }))
    }
}

struct Learner<'a> {
    how: &'a Bc,
    live: Live,
    descent: Descent<'a>,
    examples: Examples<'a>,
    spec: Spec,
    losses: Means,
}

impl Learning for Learner<'_> {
    fn act(&mut self, _: u64, _: &Columns, _: &mut Acts) {
        unreachable!("it learns from what others did")
    }

    fn see(&mut self, _: &Step) {}

    fn learn(&mut self, t: u64) {
        while self.descent.done() < t {
            self.update();
        }
    }

    fn updates(&self) -> u64 {
        self.descent.done()
    }

    fn agent(&self) -> Agent {
        let acts = if self.how.greedy { Choice::Likeliest } else { Choice::Sampled };
        let (nets, spec) = (self.live.networks(), self.spec.clone());
        Agent { acts, nets, spec, knows: Vec::new() }
    }

    fn losses(&mut self) -> &mut Means {
        &mut self.losses
    }

    fn state(&mut self, state: &mut State) {
        state.within("live", |state| self.live.state(state));
        state.within("descent", |state| self.descent.state(state));
        state.within("losses", |state| self.losses.state(state));
    }
}

impl Learner<'_> {
    fn update(&mut self) {
        let t = self.descent.done();
        let loss = self.descent.lower(&self.live, |live| {
            let (x, acts) = self.examples.draw(t, &live.graph);
            live.graph.mean(live.graph.cross_entropy(live.pass("policy", x), acts))
        });
        self.losses.add(&[loss]);
    }
}

/// Steps of demonstrations, batch after batch and pass after pass.
#[derive(Debug)]
pub(super) struct Examples<'a> {
    of: &'a Demonstrations,
    ctx: Ctx<'a>,
    turns: Turns,
    /// The row of what was seen before each step.
    rows: Vec<usize>,
}

impl<'a> Examples<'a> {
    /// All steps, so many in a batch.
    pub(super) fn new(
        of: &'a Demonstrations,
        batch: usize,
        ctx: &Ctx<'a>,
    ) -> Result<Self, OpError> {
        let rows = seen_before(of);
        if rows.is_empty() {
            return Err(OpError::Failed("there are no steps to learn from".to_owned()));
        }
        Ok(Self { of, ctx: *ctx, turns: Turns::new(rows.len(), batch), rows })
    }

    /// What was seen before those that update `t` looks at, and what was done then.
    pub(super) fn draw(&mut self, t: u64, graph: &Graph<f32>) -> (Var, Var) {
        let seen = &self.of.paths.seen;
        let Values::Index(acts) = self.of.paths.acts.values(0) else {
            unreachable!("they are discrete")
        };
        let places = self.turns.turn(t, &self.ctx);
        let rows: Vec<usize> = places.iter().map(|place| self.rows[*place]).collect();
        let x = graph.filled(seen_shape(seen.fields(), rows.len()), |out| {
            seen.spread_rows(&rows, out);
        });
        let acts = graph.filled(Shape::vectors(rows.len(), 1), |out| {
            #[expect(clippy::cast_precision_loss, reason = "actions are few")]
            out.iter_mut().zip(places).for_each(|(x, place)| *x = acts[*place] as f32);
        });
        (x, acts)
    }
}
