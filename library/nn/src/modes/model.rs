//! What a model of modes is made of and stored as, and what it foretells.

use std::any::Any;
use std::collections::BTreeMap;
use std::sync::Arc;

use ivx_data::{Dataset, Form, Misfit};
use ivx_op::{Data, Tensors};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::HEAD;
use super::loss::{displacement, nearest, squared_distance};
use crate::curve::Curve;
use crate::function::Function;
use crate::graph::Var;
use crate::live::Live;
use crate::model::Model;
use crate::module::{Mode, Module};
use crate::net::Net;
use crate::network::singles;
use crate::networks::Networks;
use crate::real::Real;
use crate::seen::{MERGE, SEE, ends, is_dense, plan_sizes, relu, see, state, state_len};

pub(crate) const KIND: &str = "modes";

/// The architecture of a model of modes, up to its last layer: the widths of its layers.
#[derive(Clone, Copy, Debug)]
pub struct ModeNets<'a> {
    /// What sees an input, up to a linear map.
    pub net: &'a dyn Net,
    /// How many numbers that map ends in.
    pub features: usize,
    /// The hidden layers upon these and the numbers beside an input.
    pub merge: &'a [usize],
}

/// What the modes of a model are.
#[derive(Clone, Debug, PartialEq)]
pub enum Modes {
    /// So many plans, made for what is seen.
    Made(usize),
    /// Fixed plans.
    Anchored(Anchored, Vec<f64>),
    /// One plan, made for which of so many commands is given: the greatest of the last numbers of an observation.
    Commanded(usize),
}

/// What becomes of plans that are the same wherever something is seen, one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Anchored {
    /// Each is moved and has a spread: a normal distribution about it.
    Moved,
    /// They are as they are.
    Chosen,
}

impl Modes {
    /// How many there are of plans of so many numbers.
    #[must_use]
    pub fn n(&self, len: usize) -> usize {
        match self {
            Self::Made(n) => *n,
            Self::Anchored(_, plans) => plans.len() / len,
            Self::Commanded(_) => 1,
        }
    }

    /// How many numbers the last layer puts out; none if they are too many to count.
    fn outputs(&self, len: usize) -> Option<usize> {
        let each = match self {
            Self::Commanded(n) => return n.checked_mul(len),
            Self::Made(_) => len,
            Self::Anchored(Anchored::Moved, _) => len.checked_mul(2)?,
            Self::Anchored(Anchored::Chosen, _) => 0,
        };
        self.n(len).checked_mul(each.checked_add(1)?)
    }

    /// Which anchor is nearest to the plan of each observation, or which command is given; none where there are neither.
    ///
    /// It is that of the least `‖y − a‖₂` where anchors are moved, and of the least mean distance of places where they
    /// are chosen, as the papers have it.
    pub(super) fn nearest(&self, data: &Dataset) -> Vec<usize> {
        let form = &data.form;
        let (_, dims) = plan_sizes("a model of modes", form).expect("data of plans");
        let plans = data.y.chunks_exact(form.target_len());
        match self {
            Self::Made(_) => Vec::new(),
            Self::Commanded(n) => {
                data.x.chunks_exact(form.input_len()).map(|x| commanded(x, *n)).collect()
            }
            Self::Anchored(Anchored::Moved, anchors) => {
                plans.map(|plan| nearest(anchors, plan, squared_distance)).collect()
            }
            Self::Anchored(Anchored::Chosen, anchors) => {
                plans.map(|plan| nearest(anchors, plan, |a, b| displacement(a, b, dims))).collect()
            }
        }
    }

    /// The plan of a mode, by what the last layer puts out.
    fn plan(&self, said: &[f32], mode: usize, len: usize) -> Vec<f64> {
        let behind = |n_modes: usize, width: usize| &said[n_modes + mode * width..][..len];
        match self {
            Self::Made(n) => behind(*n, len).iter().map(|x| f64::from(*x)).collect(),
            Self::Commanded(_) => behind(0, len).iter().map(|x| f64::from(*x)).collect(),
            Self::Anchored(how, anchors) => {
                let anchor = &anchors[mode * len..][..len];
                if *how == Anchored::Chosen {
                    return anchor.to_vec();
                }
                let moved = behind(anchors.len() / len, 2 * len);
                anchor.iter().zip(moved).map(|(a, by)| a + f64::from(*by)).collect()
            }
        }
    }
}

impl ModeNets<'_> {
    /// The layers for observations of a form, by name.
    ///
    /// # Errors
    /// Why they do not fit.
    pub fn modules(&self, form: &Form, modes: &Modes) -> Result<BTreeMap<String, Module>, Misfit> {
        plan_sizes("a model of modes", form)?;
        if let Modes::Commanded(n) = modes
            && form.input_len() <= *n
        {
            let all = form.input_len();
            let message = format!("of {all} numbers that are seen the last {n} cannot be commands");
            return Err(Misfit::new(
                message,
                "let what is seen end in commands, 1 for what is given",
            ));
        }
        let see = see(self.net, form, self.features)?;
        let merge = relu(self.merge, self.features + form.beside);
        let inputs = self.merge.last().copied().unwrap_or(self.features + form.beside);
        let outputs = modes.outputs(form.target_len()).ok_or_else(|| {
            Misfit::new("the modes have too many numbers".to_owned(), "ask for fewer modes")
        })?;
        let head = Module::Dense { inputs, outputs, curve: Curve::Identity };
        let modules =
            [(SEE, see), (MERGE, Module::Sequence(merge)), (HEAD, Module::Sequence(vec![head]))];
        Ok(modules.map(|(name, module)| (name.to_owned(), module)).into())
    }
}

/// A forecast of a few plans and how probable each is: a categorical distribution over modes,
///
/// ```text
/// π = softmax of the logits
/// ```
///
/// The last layer puts out a logit for each mode and behind them, mode by mode, its plan where plans are made, and how far
/// an anchor is moved and what makes its spread where these are moved.
#[derive(Clone, Debug, PartialEq)]
pub struct Multimodal {
    pub(super) nets: Networks,
    pub(super) modes: Modes,
}

impl Multimodal {
    /// That of an architecture, with parameters drawn from `rng`.
    ///
    /// # Errors
    /// Why the architecture does not fit observations of the form.
    pub fn drawn(
        nets: &ModeNets<'_>,
        modes: Modes,
        form: &Form,
        rng: &mut ChaCha8Rng,
    ) -> Result<Self, Misfit> {
        Ok(Self { nets: Networks::drawn(nets.modules(form, &modes)?, rng), modes })
    }

    /// Its layers and arrays.
    #[must_use]
    pub fn networks(&self) -> &Networks {
        &self.nets
    }

    /// What its modes are.
    #[must_use]
    pub fn modes(&self) -> &Modes {
        &self.modes
    }

    /// The model that a learned function is; none if it has no modes.
    #[must_use]
    pub fn within(model: &Model) -> Option<(&Self, &Form)> {
        let Model::Fitted(fitted) = model else { return None };
        let any: &dyn Any = &*fitted.function;
        any.downcast_ref().map(|own| (own, &fitted.form))
    }

    /// The `n` most probable modes where `xs` are seen, the first of equals first: their plans `[rows, n, steps, dims]`,
    /// and the logarithms of their probabilities `[rows, n]`.
    ///
    /// # Panics
    /// If there are not so many modes, or `xs` are no inputs of the form.
    #[must_use]
    pub fn best(&self, form: &Form, xs: &[f64], n: usize) -> (Vec<f64>, Vec<f64>) {
        let live = Live::of(&self.nets);
        let (len, mut said) = (form.target_len(), Vec::new());
        let modes = self.modes.n(len);
        assert!(n <= modes, "there are as many modes");
        let (mut plans, mut log_shares) = (Vec::new(), Vec::new());
        for xs in singles(xs).chunks(AT_ONCE * form.input_len()) {
            live.graph.begin();
            let out = live.graph.still(|| outputs(&live, form, xs, &mut Mode::Predict));
            live.graph.read(out, &mut said);
            let width = said.len() * form.input_len() / xs.len();
            for (said, x) in said.chunks_exact(width).zip(xs.chunks_exact(form.input_len())) {
                if let Modes::Commanded(commands) = self.modes {
                    plans.extend(self.modes.plan(said, commanded(x, commands), len));
                    log_shares.push(0.0);
                    continue;
                }
                let own = log_softmax(&said[..modes]);
                let mut order: Vec<usize> = (0..modes).collect();
                order.sort_by(|i, j| own[*j].total_cmp(&own[*i]));
                for mode in order.into_iter().take(n) {
                    plans.extend(self.modes.plan(said, mode, len));
                    log_shares.push(own[mode]);
                }
            }
        }
        (plans, log_shares)
    }
}

/// Which of `n` commands is given: the greatest of the last numbers, the first of equals.
fn commanded<F: Real>(x: &[F], n: usize) -> usize {
    let told = &x[x.len() - n..];
    (0..n).reduce(|best, i| if told[i] > told[best] { i } else { best }).unwrap_or_default()
}

/// What the last layer puts out where `xs` are seen.
pub(super) fn outputs(live: &Live, form: &Form, xs: &[f32], mode: &mut Mode<'_>) -> Var {
    let (graph, head) = (&live.graph, live.body(HEAD));
    let state = state(live, form, xs, mode);
    let width = [graph.shape(state).width()];
    head.module.pass(graph, head.params, (state, &width), mode)
}

/// `x − ln Σ e^x` of some logits.
fn log_softmax(logits: &[f32]) -> Vec<f64> {
    let most = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let sum: f64 = logits.iter().map(|x| f64::from(x - most).exp()).sum();
    logits.iter().map(|x| f64::from(x - most) - sum.ln()).collect()
}

impl Function for Multimodal {
    fn kind(&self) -> &'static str {
        KIND
    }

    fn tensors(&self) -> Tensors {
        let mut tensors = self.nets.tensors();
        let (how, anchors) = match &self.modes {
            Modes::Made(n) => (Kept::Made(*n), None),
            Modes::Commanded(n) => (Kept::Commanded(*n), None),
            Modes::Anchored(how, plans) => (Kept::Anchored(*how), Some(plans)),
        };
        let layers = Layers { modes: how, modules: self.nets.modules.clone() };
        let layers = Tensors::default().encode(LAYERS, &layers);
        tensors.arrays.insert(LAYERS.to_owned(), Data::bytes(layers));
        let anchors = anchors.map(|plans| Data::F64(vec![plans.len()], plans.clone()));
        tensors.arrays.extend(anchors.map(|plans| (ANCHORS.to_owned(), plans)));
        tensors
    }

    /// The plan of the most probable mode.
    fn predict(&self, form: &Form, xs: &[f64]) -> Vec<f64> {
        self.best(form, xs, 1).0
    }

    fn rewired(
        &self,
        change: &mut dyn FnMut(&Networks) -> Option<Networks>,
    ) -> Option<Arc<dyn Function>> {
        let nets = change(&self.nets)?;
        Some(Arc::new(Self { nets, modes: self.modes.clone() }))
    }
}

/// What the layers and the anchors are called in files.
const LAYERS: &str = "layers";
const ANCHORS: &str = "anchors";

/// How many inputs go through the networks at once.
const AT_ONCE: usize = 256;

/// What is stored of a model beside its arrays.
#[derive(Serialize, Deserialize)]
struct Layers {
    modes: Kept,
    modules: BTreeMap<String, Module>,
}

#[derive(Serialize, Deserialize)]
enum Kept {
    Made(usize),
    Commanded(usize),
    Anchored(Anchored),
}

pub(crate) fn read(form: &Form, tensors: &mut Tensors) -> Option<Arc<dyn Function>> {
    let (_, layers) = tensors.u8(LAYERS)?;
    let (_, Layers { modes, modules }) = Tensors::decode(LAYERS, &layers)?;
    let modes = match modes {
        Kept::Made(n) => Modes::Made(n),
        Kept::Commanded(n) => Modes::Commanded(n),
        Kept::Anchored(how) => Modes::Anchored(how, tensors.f64(ANCHORS)?.1),
    };
    let arrays = std::mem::take(&mut tensors.arrays);
    let nets = Networks::of(modules, Tensors { arrays })?;
    let whole = is_whole(&nets, &modes, form);
    whole.then(|| Arc::new(Multimodal { nets, modes }) as Arc<dyn Function>)
}

/// Whether networks and anchors are those of a model of observations of a form.
fn is_whole(nets: &Networks, modes: &Modes, form: &Form) -> bool {
    if plan_sizes("a model of modes", form).is_err() {
        return false;
    }
    let count = |sizes: &[usize]| sizes.iter().try_fold(1_usize, |len, n| len.checked_mul(*n));
    let (Some(len), Some(1..)) = (count(&form.target), count(&form.input)) else { return false };
    let anchored = match modes {
        Modes::Made(_) => true,
        Modes::Commanded(n) => *n > 0 && *n < form.input_len(),
        Modes::Anchored(_, plans) => {
            plans.len().is_multiple_of(len) && plans.iter().all(|x| x.is_finite())
        }
    };
    let Some(head) = nets.modules.get(HEAD) else { return false };
    let said = state_len(nets, form).and_then(|len| ends(head, &[len]));
    nets.modules.len() == 3
        && anchored
        && modes.n(len) > 0
        && is_dense(head)
        && said.is_some()
        && said == modes.outputs(len)
        && nets.are_exact()
}
