//! The networks of agents that explain what is done by cumulants, preferences and successor features (Fig. 4.3).
//!
//! `torso` sees; `phi` makes cumulants of what it says, and `psi.k.m` the successor features of policy `k` by member `m` of
//! an ensemble, `[A d]` each. The preferences of demonstrators are the arrays `w.1`, `w.2` and so on, and those of the
//! agent's own task `task`. Policy 0 is the agent's own.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use ivx_data::{Columns, Misfit};
use ivx_nn::{Curve, Graph, Live, Module, Net, Networks, Shape, Start, SuccessorSteps, Var};
use ivx_world::Spec;
use rand_chacha::ChaCha8Rng;

use super::agent::{Choice, TORSO, look, sight};
use super::resample::Resample;
use super::shown::{Drawn, Shown, column};

pub(super) const PHI: &str = "phi";
/// The preferences of the agent's own task.
pub(super) const TASK: &str = "task";
/// What the names of successor features and of the preferences of demonstrators begin with.
pub(super) const PSI: &str = "psi.";
pub(super) const W: &str = "w.";

pub(super) fn psi(k: usize, m: usize) -> String {
    format!("{PSI}{k}.{m}")
}

/// What the preferences of policy `k` are called.
pub(super) fn preferences(k: usize) -> String {
    if k == 0 { TASK.to_owned() } else { format!("{W}{k}") }
}

/// What the networks are made of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heads<'a> {
    pub(super) net: &'a dyn Net,
    /// The widths of the hidden layers of cumulants and of successor features.
    pub(super) cumulants: &'a [usize],
    pub(super) features: &'a [usize],
    /// How many numbers a cumulant has.
    pub(super) width: usize,
    pub(super) members: usize,
}

impl Heads<'_> {
    fn modules(
        &self,
        spec: &Spec,
        policies: &RangeInclusive<usize>,
    ) -> Result<BTreeMap<String, Module>, Misfit> {
        let (n, sight) = (spec.does.n_discrete()?, sight(&spec.sees));
        let torso = self.net.module(&sight)?;
        let [inputs] = torso.output(&sight)?[..] else {
            let message = "the network does not end in a vector".to_owned();
            return Err(Misfit::new(message, "end it in `flatten()`"));
        };
        let phi = perceptron(inputs, self.cumulants, n * self.width);
        let psis = policies.clone().flat_map(|k| (0..self.members).map(move |m| psi(k, m)));
        let head = perceptron(inputs, self.features, n * self.width);
        let mut modules: BTreeMap<String, Module> = psis.map(|name| (name, head.clone())).collect();
        modules.extend([(TORSO.to_owned(), torso), (PHI.to_owned(), phi)]);
        Ok(modules)
    }

    /// Whether there can be such networks.
    pub(super) fn fit(&self, spec: &Spec) -> Result<(), Misfit> {
        self.modules(spec, &(0..=0)).map(drop)
    }

    /// Networks for these policies that have learned nothing. Each is drawn by itself, so that it is the same beside others.
    /// Preferences of a task are 0, and those of demonstrators drawn evenly within `±1/√d`.
    pub(super) fn draw(
        &self,
        spec: &Spec,
        policies: &RangeInclusive<usize>,
        rng: &dyn Fn(&str) -> ChaCha8Rng,
    ) -> Result<Networks, Misfit> {
        let mut nets = Networks::default();
        for (name, module) in self.modules(spec, policies)? {
            let own = [(String::new(), module)].into();
            nets.add(&name, Networks::drawn(own, &mut rng(&name)));
        }
        for k in policies.clone() {
            let start = if k == 0 { Start::Constant(0.0) } else { Start::Uniform(self.width) };
            let name = preferences(k);
            nets = nets.with(&name, vec![self.width], start, &mut rng(&name));
        }
        Ok(nets)
    }

    /// How many bytes an update of `batch` steps takes for so many policies, about: each number with its gradient, two
    /// averages, the copy, and two more while it is kept.
    pub(super) fn memory(&self, spec: &Spec, n_policies: usize, batch: usize) -> u64 {
        let Ok(modules) = self.modules(spec, &(1..=n_policies)) else { return 0 };
        let sight = sight(&spec.sees);
        let params: u64 = modules.values().map(Module::n_params).sum();
        let torso = modules[TORSO].n_outputs(&sight);
        let wide = self.cumulants.iter().chain(self.features).sum::<usize>();
        let heads = (modules.len() * wide) as u64;
        params * 7 * 4 + (2 * torso + heads) * batch as u64 * 2 * 4
    }
}

fn perceptron(inputs: usize, hidden: &[usize], outputs: usize) -> Module {
    let widths: Vec<usize> = [inputs].into_iter().chain(hidden.iter().copied()).collect();
    let mut layers: Vec<Module> = widths
        .windows(2)
        .map(|pair| Module::Dense { inputs: pair[0], outputs: pair[1], curve: Curve::Relu })
        .collect();
    let inputs = widths[hidden.len()];
    layers.push(Module::Dense { inputs, outputs, curve: Curve::Identity });
    Module::Sequence(layers)
}

/// The losses of what others did, and what they need.
#[derive(Debug)]
pub(super) struct Others<'a> {
    pub(super) shown: Shown<'a>,
    pub(super) draws: ChaCha8Rng,
    pub(super) width: usize,
    pub(super) discount: f64,
    pub(super) drawn: Drawn,
    pub(super) resample: Resample,
}

impl Others<'_> {
    /// What the preferences of all demonstrators cost (Alg. 2, line 6).
    pub(super) fn sparsity(&self, live: &Live, weight: f64) -> Var {
        let cost = |k| live.graph.sparsity_loss(live.array(&preferences(k)), weight);
        let all = (1..=self.shown.n_whose()).map(cost);
        all.reduce(|sum, x| live.graph.add(sum, x)).expect("somebody was shown")
    }

    /// Draws the steps of update `t`.
    pub(super) fn draw(&mut self, t: u64, n: usize) {
        self.draws.set_stream(t);
        self.draws.set_word_pos(0);
        self.shown.draw(n, &mut self.draws, &mut self.drawn);
        self.resample.keep(&self.drawn.episodes.iter().map(|episode| *episode as u64));
    }

    /// The losses of the actions and of the features of each demonstrator (Eqns. 4.17, 4.18), means over members; those
    /// are left out of whom no step was drawn. And the cumulants of all steps.
    pub(super) fn losses(&self, live: &Live, norm: ivx_nn::Norm) -> (Vec<(Var, Var)>, Var) {
        let Self { shown, drawn, width, resample, .. } = self;
        let graph = &live.graph;
        let seen = live.pass(TORSO, shown.look(graph, &drawn.rows));
        let then = graph.still(|| live.pass(&copy(TORSO), shown.look(graph, &drawn.next)));
        let acts = column(graph, &drawn.acts);
        let cumulants = graph.gather(live.pass(PHI, seen), acts, *width);
        let mut losses = Vec::new();
        let mut first = 0;
        for (k, count) in (1..).zip(&drawn.counts) {
            let range = first..first + count;
            first += count;
            if range.is_empty() {
                continue;
            }
            let w = live.array(&preferences(k));
            let each: Vec<(Var, Var)> = (0..resample.members())
                .map(|m| {
                    let places = resample.within(m, &range);
                    let own = |x: Var| graph.items(x, &places);
                    let (seen, then) = (own(seen), graph.still(|| own(then)));
                    let (acts, cumulants) = (own(acts), own(cumulants));
                    let next_acts = graph.still(|| own(column(graph, &drawn.next_acts)));
                    let goes_on = graph.still(|| own(column(graph, &drawn.goes_on)));
                    let discounts = graph.still(|| graph.affine(goes_on, self.discount, 0.0));
                    let all = live.pass(&psi(k, m), seen);
                    let next = graph.still(|| {
                        graph.gather(live.pass(&copy(&psi(k, m)), then), next_acts, *width)
                    });
                    let features = graph.gather(all, acts, *width);
                    let steps = SuccessorSteps { features, cumulants, next, discounts };
                    (graph.demonstrator_loss(all, w, acts), graph.inverse_loss(&steps, norm))
                })
                .collect();
            let of = |part: fn(&(Var, Var)) -> Var| average(graph, each.iter().map(part));
            losses.push((of(|(acts, _)| *acts), of(|(_, inverse)| *inverse)));
        }
        (losses, cumulants)
    }
}

/// What the copy of a network is called that follows it.
pub(super) fn copy(net: &str) -> String {
    format!("target.{net}")
}

/// The root of the mean square of some numbers.
pub(super) fn size(of: &[f32]) -> f64 {
    let sum: f64 = of.iter().map(|x| f64::from(*x).powi(2)).sum();
    (sum / ivx_math::moments::real(of.len())).sqrt()
}

/// The mean of some scalars.
pub(super) fn average(graph: &Graph<f32>, of: impl ExactSizeIterator<Item = Var>) -> Var {
    let n = ivx_math::moments::real(of.len());
    let sum = of.reduce(|sum, x| graph.add(sum, x)).expect("there is one");
    graph.affine(sum, 1.0 / n, 0.0)
}

/// The cumulants of some steps: `[N, d]`, without a gradient.
///
/// - `seen`: what was seen before each.
/// - `acts`: what was done.
pub(super) fn cumulants(live: &Live, seen: &Columns, acts: &[usize]) -> Var {
    let graph = &live.graph;
    graph.still(|| {
        let of = live.pass(PHI, live.pass(TORSO, look(live, seen)));
        let done = graph.filled(Shape::vectors(acts.len(), 1), |out| {
            #[expect(clippy::cast_precision_loss, reason = "actions are few")]
            out.iter_mut().zip(acts).for_each(|(x, act)| *x = *act as f32);
        });
        let width = graph.shape(live.array(&preferences(1))).width();
        graph.gather(of, done, width)
    })
}

/// The names of the networks of each policy that some networks have successor features of, member by member.
pub(super) fn policies(nets: &Networks) -> Vec<Vec<String>> {
    let has = |name: &String| nets.modules.contains_key(name);
    let n = nets.modules.len();
    let members = |k| (0..n).map(move |m| psi(k, m)).take_while(has).collect::<Vec<_>>();
    (0..n).map(members).filter(|members| !members.is_empty()).collect()
}

/// Whether networks are those by which somebody acts so: successor features of as many demonstrators as it knows, and
/// preferences for them.
///
/// - `shape`: what the torso puts out.
pub(super) fn are_features(
    acts: Choice,
    nets: &Networks,
    shape: &[usize],
    n_actions: usize,
    n_known: usize,
) -> bool {
    let policies = policies(nets);
    let own = usize::from(nets.modules.contains_key(&psi(0, 0)));
    let Some((_, width, _)) = nets.array(&preferences(1 - own)) else { return false };
    let [width] = width[..] else { return false };
    let puts_out = |name: &str| {
        let module = nets.modules.get(name);
        module.is_some_and(|m| m.output(shape).is_ok_and(|out| out == [n_actions * width]))
    };
    let weighs = |k: usize| nets.array(&preferences(k)).is_some_and(|(_, of, _)| *of == [width]);
    let members = policies.first().map_or(0, Vec::len);
    policies.len() == n_known + own
        && (1 - own..=n_known).all(weighs)
        && policies.iter().all(|names| names.len() == members && names.iter().all(|n| puts_out(n)))
        && puts_out(PHI)
        && match acts {
            Choice::Improved(heard) => own == 1 && (1..=members).contains(&heard),
            Choice::Imitated(k) => (1..=n_known).contains(&k),
            _ => false,
        }
}
