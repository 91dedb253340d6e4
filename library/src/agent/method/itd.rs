//! Inverse temporal-difference learning (Algorithm 2).

use ivx_data::form::failed;
use ivx_data::{Columns, Demonstrations, Misfit};
use ivx_nn::optim::Pull;
use ivx_nn::{Descent, Follow, Live, Net, Norm, Optimiser, Rule};
use ivx_op::{Ctx, One, OpError, Part, State, declare};
use ivx_world::{Acts, Spec, Step};

use super::super::agent::{Agent, Choice, TORSO};
use super::super::features::{Heads, Others, PHI, PSI, W, size};
use super::super::resample::Resample;
use super::super::shown::{Drawn, Shown};
use super::bc::shown_in;
use super::target::Target;
use super::{Learning, Means, Method, Setting};

declare! {
    /// Inverse temporal-difference learning (Algorithm 2): who did what is explained by cumulants that all share and
    /// preferences of each, without any reward.
    ///
    /// The successor features and preferences of each demonstrator come to explain what it did (Eqn. 4.17), with an L1
    /// penalty on preferences, and cumulants to be what features are consistent with (Eqn. 4.18), by copies that follow.
    /// Errors are squared lengths; both losses are lowered together.
    ///
    /// The penalty is less where preferences are shorter and cumulants longer, which explain the same: its loss is told
    /// as `preferences`, and the size of cumulants as `cumulants`. An optimiser that decays weights (`adamw`) bounds both.
    ///
    /// It never acts to learn: where steps of the world are counted it makes an update for each. The agent acts as its
    /// first demonstrator would; `imitated` acts as another.
    pub struct Itd = "itd" @ 3 {
        /// What others did, and who.
        shown: One<Demonstrations>;
        /// The layers that all share, up to a vector.
        net: Box<dyn Net> = Part::new("mlp").with("hidden", vec![64_i64]);
        /// The widths of the hidden layers of cumulants.
        cumulants: Vec<usize> = vec![64_i64], in 1.0..=1e5;
        /// The widths of the hidden layers of successor features.
        features: Vec<usize> = vec![64_i64], in 1.0..=1e5;
        /// How many numbers a cumulant has.
        width: usize = 4, in 1.0..=1e4;
        /// How many successor features each demonstrator has, which start apart and learn each from a resample of episodes.
        members: usize = 1, in 1.0..=1e3;
        /// What the size of a preference costs, over all cumulants and demonstrators together.
        sparsity: f64 = 0.05, in 0.0..;
        /// What a cumulant one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
        /// How many steps an update looks at.
        batch: usize = 64, in 1.0..=1e6;
        /// How copies follow.
        target: Box<dyn Target> = Part::new("copied").with("every", 100_i64);
        /// How the loss is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("adam")
            .with("lr", Part::new("constant").with("value", 1e-3));
    }
}

impl Itd {
    fn heads(&self) -> Heads<'_> {
        Heads {
            net: &*self.net,
            cumulants: &self.cumulants,
            features: &self.features,
            width: self.width,
            members: self.members,
        }
    }
}

impl Method for Itd {
    fn fits(&self, setting: &Setting<'_>) -> Result<(), Misfit> {
        shown_in(&self.shown, setting.spec)?;
        self.heads().fit(setting.spec)
    }

    fn memory(&self, setting: &Setting<'_>) -> u64 {
        self.heads().memory(setting.spec, self.shown.names.len().max(1), self.batch)
    }

    fn acts(&self) -> bool {
        false
    }

    fn begin<'a>(
        &'a self,
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Box<dyn Learning + 'a>, OpError> {
        let (spec, n) = (setting.spec, self.shown.names.len());
        let drawn = |name: &str| ctx.rng("init", &[name]);
        let nets = self.heads().draw(spec, &(1..=n), &drawn).map_err(failed)?;
        let mut live = Live::of(&nets);
        live.target(TORSO);
        live.target(PSI);
        let steps = setting.steps.or(setting.updates).unwrap_or(u64::MAX);
        let rule = Rule { optimiser: &*self.optimiser, pull: Pull::NONE, steps };
        Ok(Box::new(Learner {
            how: self,
            descent: Descent::new(&live, &[TORSO, PHI, PSI, W], rule),
            live,
            others: Others {
                shown: Shown::new(&self.shown)?,
                draws: ctx.rng("shown", &[]),
                width: self.width,
                discount: self.discount,
                drawn: Drawn::default(),
                resample: Resample::new(ctx.rng("resample", &["shown"]), self.members),
            },
            follow: self.target.rule(),
            spec: spec.clone(),
            losses: Means::new(&["loss", "acts", "inverse", "preferences", "cumulants"]),
        }))
    }
}

struct Learner<'a> {
    how: &'a Itd,
    live: Live,
    descent: Descent<'a>,
    others: Others<'a>,
    follow: Follow,
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
        Agent {
            acts: Choice::Imitated(1),
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
        state.within("losses", |state| self.losses.state(state));
    }
}

impl Learner<'_> {
    fn update(&mut self) {
        let Self { how, live, descent, others, .. } = self;
        others.draw(descent.done(), how.batch);
        let mut told = [0.0; 4];
        let loss = descent.lower(live, |live| {
            let graph = &live.graph;
            let (each, cumulants) = others.losses(live, Norm::Squares);
            let sum = |of: fn(&(_, _)) -> _| {
                each.iter().map(of).reduce(|sum, x| graph.add(sum, x)).expect("steps were drawn")
            };
            let (acts, inverse) = (sum(|(acts, _)| *acts), sum(|(_, inverse)| *inverse));
            let sparse = others.sparsity(live, how.sparsity);
            let of = |x| f64::from(graph.scalar(x));
            told = [of(acts), of(inverse), of(sparse), size(&graph.value(cumulants))];
            graph.add(graph.add(acts, inverse), sparse)
        });
        self.losses.add(&[loss, told[0], told[1], told[2], told[3]]);
        self.live.follow(self.follow, self.descent.done());
    }
}
