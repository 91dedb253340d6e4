//! What was learned, and how it acts.

use std::collections::BTreeMap;
use std::fmt::Debug;

use ivx_data::{Columns, Field, shown_by};
use ivx_math::moments::mean;
use ivx_nn::{Live, Module, Networks, Shape, Var};
use ivx_op::{Artifact, OpError, Shapes, Tensors};
use ivx_world::{Acts, Spec};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::features::are_features;
use super::improve::{Improving, Reduce, Values};

/// Networks that were learned in worlds of some kind, and how actions come of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Agent {
    /// How actions come of what the networks put out.
    pub acts: Choice,
    /// The networks.
    pub nets: Networks,
    /// What the worlds show and take.
    pub spec: Spec,
    /// What those are called whose successor features it knows, in their order.
    pub knows: Vec<String>,
}

/// How an action comes of what a network puts out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Choice {
    /// The action of the highest value of the network `q`, the first of equals.
    Greedy,
    /// An action drawn by the logits of the network `policy`.
    Sampled,
    /// The action of the highest of those logits, the first of equals.
    Likeliest,
    /// The best by generalised policy improvement over all successor features, where what so many members of each say
    /// of the agent's own task is reduced to the lowest (Eqn. 4.23).
    Improved(usize),
    /// The best by the successor features and preferences of one demonstrator, counted from 1 (Eqn. 4.19), on average
    /// over members; the first of equals.
    Imitated(usize),
    /// An action drawn as probably as `softmax(q / α)` says of the values of the network `q`, where `α` is the array
    /// `temperature`.
    Softened,
}

/// What the array is called by which values are softened: one number above 0.
pub(crate) const TEMPERATURE: &str = "temperature";

/// What the layers that come before others are called, where several share them.
pub(crate) const TORSO: &str = "torso";

impl Choice {
    /// The network whose outputs are of one action each, if there is such a one.
    fn net(self) -> Option<&'static str> {
        match self {
            Self::Greedy | Self::Softened => Some("q"),
            Self::Sampled | Self::Likeliest => Some("policy"),
            Self::Improved(_) | Self::Imitated(_) => None,
        }
    }
}

/// Somebody who acts.
pub trait Acting {
    /// Is told that episodes begin in all lanes: what was done before has nothing to do with what comes.
    fn begin(&mut self) {}

    /// Is told that these lanes have come to their end: what is chosen there from now on does not matter.
    fn rest(&mut self, _lanes: &[usize]) {}

    /// Appends what it tells of the step that it chose for a lane last, as many numbers as [`Actor::tells`] has names.
    ///
    /// [`Actor::tells`]: super::actor::Actor::tells
    fn tell(&self, _lane: usize, _told: &mut Vec<f32>) {}

    /// Chooses an action for each lane by what is seen there.
    ///
    /// # Errors
    /// If there is none to choose.
    fn act(&mut self, seen: &Columns, rng: &mut ChaCha8Rng, acts: &mut Acts)
    -> Result<(), OpError>;
}

impl Agent {
    /// Itself, ready to act.
    #[must_use]
    pub fn open(&self) -> Box<dyn Acting> {
        let (one, reduce): (Values, Reduce<'_>) = match self.acts {
            Choice::Improved(heard) => {
                (Values::of(self), Box::new(move |said| ivx_math::order::min(&said[..heard])))
            }
            Choice::Imitated(k) => (Values::imitated(self, k), Box::new(mean)),
            acts => {
                let temperature = temperature(&self.nets).unwrap_or(1.0);
                let live = Live::of(&self.nets);
                return Box::new(Opened { live, acts, temperature, out: Vec::new() });
            }
        };
        Box::new(Improving::new(vec![vec![one]], reduce))
    }
}

/// By what values are softened, where it is given.
fn temperature(nets: &Networks) -> Option<f32> {
    let (.., values) = nets.array(TEMPERATURE)?;
    values.first().copied().filter(|temperature| *temperature > 0.0)
}

struct Opened {
    live: Live,
    acts: Choice,
    temperature: f32,
    out: Vec<f32>,
}

impl Acting for Opened {
    fn act(
        &mut self,
        seen: &Columns,
        rng: &mut ChaCha8Rng,
        acts: &mut Acts,
    ) -> Result<(), OpError> {
        let Self { live, acts: choice, temperature, out } = self;
        live.graph.begin();
        let Some(net) = choice.net() else { unreachable!("it has one") };
        let put = live.graph.still(|| live.pass(net, shared(live, look(live, seen))));
        live.graph.read(put, out);
        let n = out.len() / seen.len();
        let rows = out.chunks_exact_mut(n);
        for (place, row) in acts.places.iter_mut().zip(rows) {
            *place = match choice {
                Choice::Sampled => sampled(row, rng.random()).0,
                Choice::Softened => softened(row, *temperature, rng.random()),
                _ => best(row),
            };
        }
        Ok(())
    }
}

/// The place of the largest number, the first of equals.
#[must_use]
pub fn best(row: &[f32]) -> usize {
    row.iter().enumerate().fold(0, |best, (i, x)| if *x > row[best] { i } else { best })
}

/// The place that a number of `[0, 1)` draws by logits, and the logarithm of its probability.
pub(crate) fn sampled(logits: &[f32], u: f32) -> (usize, f32) {
    let most = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let total: f32 = logits.iter().map(|x| (x - most).exp()).sum();
    let mut left = u * total;
    let drawn = logits.iter().position(|x| {
        left -= (x - most).exp();
        left < 0.0
    });
    // Rounding can leave something over.
    let place = drawn.unwrap_or_else(|| best(logits));
    (place, logits[place] - most - total.ln())
}

/// The action that a number of `[0, 1)` draws by `softmax(q / α)`; the values `q` become logits.
pub(crate) fn softened(values: &mut [f32], temperature: f32, u: f32) -> usize {
    for q in values.iter_mut() {
        *q /= temperature;
    }
    sampled(values, u).0
}

/// What a network sees of a row of these fields: an image where there is only one, else all numbers as a vector.
#[must_use]
pub fn sight(sees: &[Field]) -> Vec<usize> {
    match sees {
        [Field { shape, .. }] if shape.len() == 3 => shape.clone(),
        _ => vec![sees.iter().map(Field::spread).sum()],
    }
}

/// Rows as a network sees them.
#[must_use]
pub fn look(live: &Live, seen: &Columns) -> Var {
    live.graph.filled(seen_shape(seen.fields(), seen.len()), |out| seen.spread_all(out))
}

/// What comes out of the layers that networks share, where they share any.
pub(crate) fn shared(live: &Live, x: Var) -> Var {
    if live.get(TORSO).is_some() { live.pass(TORSO, x) } else { x }
}

/// The shape of a batch of rows.
pub(crate) fn seen_shape(sees: &[Field], n: usize) -> Shape {
    match sees {
        [Field { shape, .. }] if shape.len() == 3 => {
            Shape { n, item: [shape[0], shape[1], shape[2]] }
        }
        _ => Shape::vectors(n, sees.iter().map(Field::spread).sum()),
    }
}

#[derive(Serialize, Deserialize)]
struct Facts {
    acts: Choice,
    spec: Spec,
    nets: BTreeMap<String, Module>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    knows: Vec<String>,
}

impl Artifact for Agent {
    const KIND: &'static str = "Agent";

    fn encode(&self) -> Vec<u8> {
        let Self { acts, nets, spec, knows } = self.clone();
        let facts = Facts { acts, spec, nets: nets.modules, knows };
        self.nets.tensors().encode(Self::KIND, &facts)
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (tensors, Facts { acts, spec, nets, knows }) =
            Tensors::decode::<Facts>(Self::KIND, bytes)?;
        let nets = Networks::of(nets, tensors)?;
        let mut shape = sight(&spec.sees);
        if let Some(torso) = nets.modules.get(TORSO) {
            shape = torso.output(&shape).ok()?;
        }
        let n = spec.does.n_discrete().ok()?;
        let fits = match acts.net() {
            Some(net) => {
                let is_softened = acts != Choice::Softened || temperature(&nets).is_some();
                nets.modules.get(net)?.output(&shape).ok()? == [n] && is_softened
            }
            None => are_features(acts, &nets, &shape, n, knows.len()),
        };
        (nets.are_whole() && fits).then_some(Self { acts, nets, spec, knows })
    }

    fn later(shapes: &Shapes) -> Option<Self> {
        let nets = Networks::default();
        let (sees, does) = shown_by(shapes)?;
        let spec = Spec { sees, does, tells: Vec::new(), limit: None };
        Some(Self { acts: Choice::Greedy, nets, spec, knows: Vec::new() })
    }
}
