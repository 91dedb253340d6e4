//! What was learned, and how it acts.

use std::collections::BTreeMap;
use std::fmt::Debug;

use ivx_data::{Columns, Field};
use ivx_math::policy::pick;
use ivx_nn::{Live, Module, Networks, Shape, Var};
use ivx_op::{Artifact, Tensors};
use ivx_world::{Acts, Spec};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Networks that were learned in worlds of some kind, and how actions come of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Agent {
    /// How actions come of what the networks put out.
    pub acts: Choice,
    /// The networks.
    pub nets: Networks,
    /// What the worlds show and take.
    pub spec: Spec,
}

/// How an action comes of what a network puts out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Choice {
    /// The action of the highest value of the network `q`, the first of equals.
    Greedy,
    /// An action drawn by the logits of the network `policy`.
    Sampled,
}

/// Somebody who acts.
pub trait Acting {
    /// Chooses an action for each lane by what is seen there.
    fn act(&mut self, seen: &Columns, rng: &mut ChaCha8Rng, acts: &mut Acts);
}

impl Agent {
    /// Itself, ready to act.
    #[must_use]
    pub fn open(&self) -> Box<dyn Acting> {
        Box::new(Opened { live: Live::of(&self.nets), acts: self.acts, out: Vec::new() })
    }
}

struct Opened {
    live: Live,
    acts: Choice,
    out: Vec<f32>,
}

impl Acting for Opened {
    fn act(&mut self, seen: &Columns, rng: &mut ChaCha8Rng, acts: &mut Acts) {
        let Self { live, acts: choice, out } = self;
        live.graph.begin();
        let net = match choice {
            Choice::Greedy => "q",
            Choice::Sampled => "policy",
        };
        let put = live.graph.still(|| live.pass(net, look(live, seen)));
        live.graph.read(put, out);
        let rows = out.chunks_exact(out.len() / seen.len());
        for (place, row) in acts.places.iter_mut().zip(rows) {
            *place = match choice {
                Choice::Greedy => best(row),
                Choice::Sampled => sampled(row, rng),
            };
        }
    }
}

/// The place of the largest number, the first of equals.
pub(crate) fn best(row: &[f32]) -> usize {
    row.iter().enumerate().fold(0, |best, (i, x)| if *x > row[best] { i } else { best })
}

/// A place drawn by logits.
pub(crate) fn sampled(logits: &[f32], rng: &mut ChaCha8Rng) -> usize {
    let most = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let exps = logits.iter().map(|x| f64::from(x - most).exp());
    let total: f64 = exps.clone().sum();
    let weights: Vec<f64> = exps.map(|e| e / total).collect();
    pick(&weights, rng.random())
}

/// What a network sees of a row of these fields: an image where there is only one, else all numbers as a vector.
pub(crate) fn sight(sees: &[Field]) -> Vec<usize> {
    match sees {
        [Field { shape, .. }] if shape.len() == 3 => shape.clone(),
        _ => vec![sees.iter().map(Field::spread).sum()],
    }
}

/// Rows as a network sees them.
pub(crate) fn look(live: &Live, seen: &Columns) -> Var {
    live.graph.filled(seen_shape(seen.fields(), seen.len()), |out| seen.spread_all(out))
}

/// The shape of a batch of rows.
pub(crate) fn seen_shape(sees: &[Field], n: usize) -> Shape {
    match sight(sees)[..] {
        [channels, rows, cols] => Shape { n, item: [channels, rows, cols] },
        ref vector => Shape::vectors(n, vector[0]),
    }
}

#[derive(Serialize, Deserialize)]
struct Facts {
    acts: Choice,
    spec: Spec,
    nets: BTreeMap<String, Module>,
}

impl Artifact for Agent {
    const KIND: &'static str = "Agent";

    fn encode(&self) -> Vec<u8> {
        let facts =
            Facts { acts: self.acts, spec: self.spec.clone(), nets: self.nets.modules.clone() };
        self.nets.tensors().encode(Self::KIND, &facts)
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (tensors, Facts { acts, spec, nets }) = Tensors::decode::<Facts>(Self::KIND, bytes)?;
        let nets = Networks::of(nets, tensors)?;
        let name = match acts {
            Choice::Greedy => "q",
            Choice::Sampled => "policy",
        };
        let puts_out = nets.modules.get(name)?.output(&sight(&spec.sees)).ok()?;
        let sound = nets.are_whole() && puts_out == [spec.does.n_discrete().ok()?];
        sound.then_some(Self { acts, nets, spec })
    }
}
