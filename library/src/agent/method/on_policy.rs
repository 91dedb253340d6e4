//! Learning from what the agent of the moment does, and from nothing older.

use std::collections::BTreeMap;

use ivx_data::form::failed;
use ivx_data::{Columns, Misfit};
use ivx_math::returns::{Path, advantages_cut};
use ivx_nn::optim::Pull;
use ivx_nn::{
    Curve, Descent, Live, Module, Net, Networks, Optimiser, Real as _, Rule, Shape, Steps, Var,
};
use ivx_op::{Ctx, OpError, State};
use ivx_world::{Acts, End, Spec, Step};
use rand::RngExt as _;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;

use super::super::agent::{Agent, Choice, TORSO, look, sampled, seen_shape, shared, sight};
use super::beside::{Cloning, Shares, join};
use super::{Learning, Means, Method, Setting};

/// A method that improves the policy of the moment.
pub(super) trait Improve: std::fmt::Debug + Send + Sync {
    /// Its settings.
    fn how(&self) -> How<'_>;

    /// What the loss of some steps is: all of it, that of the policy, that of the values, and the entropy.
    fn loss(&self, live: &Live, nets: (Var, Var), old: &Steps) -> [Var; 4];
}

impl<T: Improve> Method for T {
    fn fits(&self, setting: &Setting<'_>) -> Result<(), Misfit> {
        let how = self.how();
        let n = setting.lanes * how.n_steps;
        if !n.is_multiple_of(how.minibatches) {
            return Err(Misfit::new(
                format!(
                    "{n} steps of all worlds together do not make {} parts of one size",
                    how.minibatches
                ),
                "choose `minibatches` that divide `n_steps` times the lanes",
            ));
        }
        how.modules(setting.spec).map(drop)
    }

    fn memory(&self, setting: &Setting<'_>) -> u64 {
        self.how().memory(setting)
    }

    fn shares(&self) -> Option<&dyn Shares> {
        Some(self)
    }

    fn begin<'a>(
        &'a self,
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Box<dyn Learning + 'a>, OpError> {
        self.how().begin(None, setting, ctx)
    }
}

impl<T: Improve> Shares for T {
    fn net(&self) -> &dyn Net {
        self.how().net
    }

    fn begin_beside<'a>(
        &'a self,
        cloning: Option<Cloning<'a>>,
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Box<dyn Learning + 'a>, OpError> {
        self.how().begin(cloning, setting, ctx)
    }
}

/// What such methods have in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct How<'a> {
    pub(super) net: &'a dyn Net,
    /// Whether the policy and the values share their layers.
    pub(super) shared: bool,
    pub(super) discount: f64,
    pub(super) trace: f64,
    /// How many steps of each lane an agent learns from at once.
    pub(super) n_steps: usize,
    /// How often it goes through them, and in how many parts.
    pub(super) epochs: usize,
    pub(super) minibatches: usize,
    /// Whether advantages are brought to mean 0 and deviation 1 in each part.
    pub(super) normalises: bool,
    pub(super) optimiser: &'a dyn Optimiser,
    pub(super) improve: &'a dyn Improve,
}

impl How<'_> {
    fn modules(&self, spec: &Spec) -> Result<BTreeMap<String, Module>, Misfit> {
        let (n, sight) = (spec.does.n_discrete()?, sight(&spec.sees));
        let named = |name: &str, module| (name.to_owned(), module);
        if !self.shared {
            let net = |n| ivx_nn::headed(self.net, &sight, &[n]);
            return Ok([named("policy", net(n)?), named("value", net(1)?)].into());
        }
        let torso = self.net.module(&sight)?;
        let [inputs] = torso.output(&sight)?[..] else {
            let message = "the network does not end in a vector".to_owned();
            return Err(Misfit::new(message, "end it in `flatten()`"));
        };
        let head = |outputs| Module::Dense { inputs, outputs, curve: Curve::Identity };
        Ok([named(TORSO, torso), named("policy", head(n)), named("value", head(1))].into())
    }

    fn memory(&self, setting: &Setting<'_>) -> u64 {
        let Ok(modules) = self.modules(setting.spec) else { return 0 };
        let sight = sight(&setting.spec.sees);
        // A parameter, its gradient, two averages, and two more while it is kept.
        let params: u64 = modules.values().map(|module| module.n_params() * 6 * 4).sum();
        // Steps of all lanes, and once more while they are kept; and what comes of a part of them, and its gradients.
        let n = (setting.lanes * self.n_steps) as u64;
        let seen: usize = setting.spec.sees.iter().map(|field| 4 * field.width()).sum();
        let torso = modules.get(TORSO);
        let outputs = modules.iter().map(|(name, module)| match (name.as_str(), torso) {
            ("policy" | "value", Some(_)) => 1,
            _ => module.n_outputs(&sight),
        });
        let outputs = outputs.sum::<u64>() * n.div_ceil(self.minibatches as u64) * 2 * 4;
        params + 2 * n * (seen as u64 + 24) + outputs
    }

    fn begin<'a>(
        self,
        cloning: Option<Cloning<'a>>,
        setting: &Setting<'_>,
        ctx: &Ctx<'a>,
    ) -> Result<Box<dyn Learning + 'a>, OpError>
    where
        Self: 'a,
    {
        let (spec, lanes) = (setting.spec, setting.lanes);
        let modules = self.modules(spec).map_err(failed)?;
        let n = lanes * self.n_steps;
        let mut nets = Networks::drawn(modules, &mut ctx.rng("init", &[]));
        if cloning.is_some() {
            join(&mut nets, self.net, spec, ctx)?;
        }
        let live = Live::of(&nets);
        let each = (self.epochs * self.minibatches) as u64;
        let steps = setting.steps.map_or(u64::MAX, |steps| steps / n as u64 * each);
        let rule = Rule { optimiser: self.optimiser, pull: Pull::NONE, steps };
        Ok(Box::new(OnPolicy {
            descent: Descent::new(&live, &[""], rule),
            live,
            paths: Paths::new(spec, lanes, self.n_steps),
            how: self,
            draws: ctx.rng("act", &[]),
            order: ctx.rng("batches", &[]),
            places: (0..n).collect(),
            losses: Means::new(match &cloning {
                None => &["policy", "value", "entropy"],
                Some(_) => &["policy", "value", "entropy", "cloning"],
            }),
            cloning,
            out: [const { Vec::new() }; 2],
        }))
    }
}

/// What each lane did in its last steps, step after step.
struct Paths {
    spec: Spec,
    lanes: usize,
    n_steps: usize,
    /// How many steps are there.
    filled: usize,
    seen: Columns,
    acts: Vec<f32>,
    log_probs: Vec<f32>,
    values: Vec<f32>,
    rewards: Vec<f32>,
    /// 0 where it goes on, 1 at an end, 2 where it is cut off.
    ends: Vec<f32>,
    /// What the state is worth in which a path was cut off.
    cuts: Vec<f32>,
    /// What is seen after the last step.
    last: Columns,
}

impl Paths {
    fn new(spec: &Spec, lanes: usize, n_steps: usize) -> Self {
        let n = lanes * n_steps;
        let rows = |n| Columns::zeros(spec.sees.clone(), n);
        let zeros = || vec![0.0; n];
        Self {
            lanes,
            n_steps,
            filled: 0,
            seen: rows(n),
            acts: zeros(),
            log_probs: zeros(),
            values: zeros(),
            rewards: zeros(),
            ends: zeros(),
            cuts: zeros(),
            last: rows(lanes),
            spec: spec.clone(),
        }
    }

    fn state(&mut self, state: &mut State) {
        state.place("filled", &mut self.filled);
        state.within("seen", |state| self.seen.state(state));
        state.within("last", |state| self.last.state(state));
        let Self { acts, log_probs, values, rewards, ends, cuts, .. } = self;
        let columns = [acts, log_probs, values, rewards, ends, cuts];
        let names = ["acts", "log_probs", "values", "rewards", "ends", "cuts"];
        for (name, column) in names.into_iter().zip(columns) {
            state.numbers(name, column);
        }
    }

    /// The advantages of all steps, and the returns that values should be, when each lane is worth `after` at its end.
    fn targets(&self, after: &[f32], discount: f64, trace: f64) -> [Vec<f32>; 2] {
        let mut out = [0; 2].map(|_| vec![0.0; self.acts.len()]);
        let [gains, returns] = &mut out;
        for (lane, &after) in after.iter().enumerate() {
            let column = |of: &[f32]| -> Vec<f64> {
                of.iter().skip(lane).step_by(self.lanes).map(|x| f64::from(*x)).collect()
            };
            let (rewards, cuts) = (column(&self.rewards), column(&self.cuts));
            let mut values = column(&self.values);
            values.push(f64::from(after));
            let how = column(&self.ends);
            let ends: Vec<bool> = how.iter().map(|end| *end == 1.0).collect();
            let cut: Vec<_> =
                how.iter().zip(cuts).map(|(end, v)| (*end == 2.0).then_some(v)).collect();
            let path = Path { rewards: &rewards, values: &values, ends: &ends };
            let found = advantages_cut(&path, &cut, discount, trace);
            for (t, gain) in found.into_iter().enumerate() {
                let place = t * self.lanes + lane;
                gains[place] = f32::of(gain);
                returns[place] = f32::of(gain + values[t]);
            }
        }
        out
    }
}

struct OnPolicy<'a> {
    how: How<'a>,
    live: Live,
    descent: Descent<'a>,
    paths: Paths,
    /// By which actions are drawn, and the order of steps.
    draws: ChaCha8Rng,
    order: ChaCha8Rng,
    places: Vec<usize>,
    losses: Means,
    cloning: Option<Cloning<'a>>,
    out: [Vec<f32>; 2],
}

/// The logits of the policy and the values of what is seen.
fn heads(live: &Live, x: Var) -> (Var, Var) {
    let x = shared(live, x);
    (live.pass("policy", x), live.pass("value", x))
}

impl OnPolicy<'_> {
    /// What some rows are worth.
    fn worth(live: &Live, seen: &Columns, out: &mut Vec<f32>) {
        live.graph.begin();
        let value = live.graph.still(|| heads(live, look(live, seen)).1);
        live.graph.read(value, out);
    }

    fn improve(&mut self) {
        let Self { how, live, descent, paths, order, places, losses, cloning, out, .. } = self;
        Self::worth(live, &paths.last, &mut out[1]);
        let [gains, returns] = paths.targets(&out[1], how.discount, how.trace);
        let size = places.len() / how.minibatches;
        for _ in 0..how.epochs {
            places.iter_mut().enumerate().for_each(|(i, place)| *place = i);
            if how.minibatches > 1 {
                order.set_stream(descent.done());
                order.set_word_pos(0);
                places.shuffle(order);
            }
            for places in places.chunks_exact(size) {
                let (mut parts, mut cloned) = ([Var::default(); 4], f64::NAN);
                let t = descent.done();
                descent.lower(live, |live| {
                    let graph = &live.graph;
                    let x = graph.filled(seen_shape(&paths.spec.sees, size), |out| {
                        paths.seen.spread_rows(places, out);
                    });
                    let column = |of: &[f32]| {
                        graph.filled(Shape::vectors(size, 1), |out| {
                            out.iter_mut().zip(places).for_each(|(x, i)| *x = of[*i]);
                        })
                    };
                    let gains = graph.filled(Shape::vectors(size, 1), |out| {
                        out.iter_mut().zip(places).for_each(|(x, i)| *x = gains[*i]);
                        if how.normalises {
                            normalise(out);
                        }
                    });
                    let old = Steps {
                        actions: column(&paths.acts),
                        log_probs: column(&paths.log_probs),
                        advantages: gains,
                        values: column(&paths.values),
                        returns: column(&returns),
                    };
                    parts = how.improve.loss(live, heads(live, x), &old);
                    let Some(cloning) = cloning else { return parts[0] };
                    let [loss, apart] = cloning.beside(t, live, "policy", parts[0]);
                    cloned = graph.scalar(apart).into();
                    loss
                });
                let told = |i: usize| f64::from(live.graph.scalar(parts[i]));
                // As many as there are names.
                losses.add(&[told(1), told(2), told(3), cloned]);
            }
        }
        paths.filled = 0;
    }
}

/// Brings numbers to mean 0 and deviation 1.
fn normalise(xs: &mut [f32]) {
    let of: Vec<f64> = xs.iter().map(|x| f64::from(*x)).collect();
    let n = ivx_math::moments::real(of.len());
    let mean = of.iter().sum::<f64>() / n;
    let variance = of.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    let scale = 1.0 / (variance.sqrt() + 1e-8);
    xs.iter_mut().zip(of).for_each(|(x, of)| *x = f32::of((of - mean) * scale));
}

impl Learning for OnPolicy<'_> {
    fn act(&mut self, t: u64, seen: &Columns, acts: &mut Acts) {
        let Self { live, paths, draws, out: [logits, values], .. } = self;
        live.graph.begin();
        let (policy, value) = live.graph.still(|| heads(live, look(live, seen)));
        live.graph.read(policy, logits);
        live.graph.read(value, values);
        draws.set_stream(t);
        draws.set_word_pos(0);
        let first = paths.filled * paths.lanes;
        let rows = logits.chunks_exact(logits.len() / paths.lanes);
        for (lane, (act, row)) in acts.places.iter_mut().zip(rows).enumerate() {
            let (place, log_prob) = sampled(row, draws.random());
            *act = place;
            #[expect(clippy::cast_precision_loss, reason = "actions are few")]
            let number = place as f32;
            paths.acts[first + lane] = number;
            paths.log_probs[first + lane] = log_prob;
            paths.values[first + lane] = values[lane];
        }
    }

    fn see(&mut self, step: &Step) {
        let Self { live, paths, out, .. } = self;
        let first = paths.filled * paths.lanes;
        let after = &mut out[1];
        if step.ends.contains(&End::Limit) {
            Self::worth(live, &step.after, after);
        }
        for (lane, (end, reward)) in step.ends.iter().zip(&step.rewards).enumerate() {
            let place = first + lane;
            paths.seen.set(place, &step.before, lane);
            paths.rewards[place] = f32::of(*reward);
            (paths.ends[place], paths.cuts[place]) = match end {
                End::No => (0.0, 0.0),
                End::Terminal => (1.0, 0.0),
                End::Limit => (2.0, after[lane]),
            };
        }
        paths.filled += 1;
        if paths.filled == paths.n_steps {
            for lane in 0..paths.lanes {
                paths.last.set(lane, &step.after, lane);
            }
        }
    }

    fn learn(&mut self, _: u64) {
        if self.paths.filled == self.paths.n_steps {
            self.improve();
        }
    }

    fn updates(&self) -> u64 {
        self.descent.done()
    }

    fn agent(&self) -> Agent {
        let spec = self.paths.spec.clone();
        Agent { acts: Choice::Sampled, nets: self.live.networks(), spec, knows: Vec::new() }
    }

    fn losses(&mut self) -> &mut Means {
        &mut self.losses
    }

    fn state(&mut self, state: &mut State) {
        state.within("live", |state| self.live.state(state));
        state.within("descent", |state| self.descent.state(state));
        state.within("paths", |state| self.paths.state(state));
        state.within("losses", |state| self.losses.state(state));
    }
}
