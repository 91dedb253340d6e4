//! What an imitative model is made of and stored as, and several of them opened.

use std::any::Any;
use std::collections::BTreeMap;
use std::sync::Arc;

use ivx_data::{Form, Misfit};
use ivx_op::{Data, Tensors};
use rand_chacha::ChaCha8Rng;

use super::member::Member;
use super::scorer::Scorer;
use super::{CELL, HEAD};
use crate::curve::Curve;
use crate::function::Function;
use crate::live::Live;
use crate::model::Model;
use crate::module::{Mode, Module};
use crate::net::Net;
use crate::network::singles;
use crate::networks::Networks;
use crate::seen::{MERGE, SEE, ends, is_dense, plan_sizes, relu, see, state, state_len};

pub(crate) const KIND: &str = "imitative";

/// The architecture of an imitative model: the widths of its layers.
#[derive(Clone, Copy, Debug)]
pub struct PlanNets<'a> {
    /// What sees an input, up to the last linear map.
    pub net: &'a dyn Net,
    /// How many numbers that map ends in.
    pub features: usize,
    /// The hidden layers that make a state of these and of the numbers beside an input.
    pub merge: &'a [usize],
    /// How many numbers a state has.
    pub units: usize,
    /// The hidden layers that say where the next place is.
    pub head: &'a [usize],
}

impl PlanNets<'_> {
    /// The layers for observations of a form, by name.
    ///
    /// # Errors
    /// Why they do not fit.
    pub fn modules(&self, form: &Form) -> Result<BTreeMap<String, Module>, Misfit> {
        let (_, dims) = steps_of(form)?;
        let see = see(self.net, form, self.features)?;
        let merge = relu(&[self.merge, &[self.units]].concat(), self.features + form.beside);
        let mut head = relu(self.head, self.units);
        let inputs = self.head.last().copied().unwrap_or(self.units);
        head.push(Module::Dense { inputs, outputs: 2 * dims, curve: Curve::Identity });
        let modules = [
            (SEE, see),
            (MERGE, Module::Sequence(merge)),
            (CELL, Module::Gru { inputs: dims, units: self.units }),
            (HEAD, Module::Sequence(head)),
        ];
        Ok(modules.map(|(name, module)| (name.to_owned(), module)).into())
    }
}

/// How many steps plans of a form have, and how many numbers a place is.
///
/// # Errors
/// If targets are no plans.
pub(super) fn steps_of(form: &Form) -> Result<(usize, usize), Misfit> {
    plan_sizes("an imitative model", form)
}

/// An imitative model (Eqns. 3.2 to 3.4): the density of plans `a_1 .. a_T` of places where something was seen,
///
/// ```text
/// q(a | s) = Π_t N(a_t; a_{t-1} + δ_t, diag σ_t²),  a_0 = 0
/// ```
///
/// where a gated recurrent unit, whose state begins with what is seen, reads the places before.
#[derive(Clone, Debug, PartialEq)]
pub struct Imitative {
    pub(super) nets: Networks,
}

impl Imitative {
    /// That of an architecture, with parameters drawn from `rng`.
    ///
    /// # Errors
    /// Why the architecture does not fit observations of the form.
    pub fn drawn(nets: &PlanNets<'_>, form: &Form, rng: &mut ChaCha8Rng) -> Result<Self, Misfit> {
        Ok(Self { nets: Networks::drawn(nets.modules(form)?, rng) })
    }

    /// Its layers and arrays.
    #[must_use]
    pub fn networks(&self) -> &Networks {
        &self.nets
    }

    /// The model that a learned function is; none if it is none of plans.
    #[must_use]
    pub fn within(model: &Model) -> Option<(&Self, &Form)> {
        let Model::Fitted(fitted) = model else { return None };
        let any: &dyn Any = &*fitted.function;
        any.downcast_ref().map(|own| (own, &fitted.form))
    }
}

impl Function for Imitative {
    fn kind(&self) -> &'static str {
        KIND
    }

    fn tensors(&self) -> Tensors {
        let mut tensors = self.nets.tensors();
        let layers = Tensors { arrays: BTreeMap::new() }.encode(LAYERS, &self.nets.modules);
        tensors.arrays.insert(LAYERS.to_owned(), Data::bytes(layers));
        tensors
    }

    /// The plan of the means: every step by the mean of its own.
    fn predict(&self, form: &Form, xs: &[f64]) -> Vec<f64> {
        let mut opened = Imitators::of(&[self], form);
        let xs = singles(xs);
        let mut plans = Vec::new();
        for xs in xs.chunks(AT_ONCE * form.input_len()) {
            opened.see(xs);
            let mut noise = vec![0.0; opened.scorer.rows() * form.target_len()];
            opened.scorer.plans(0, &mut noise, 1);
            plans.extend(noise.into_iter().map(f64::from));
        }
        plans
    }

    fn rewired(
        &self,
        change: &mut dyn FnMut(&Networks) -> Option<Networks>,
    ) -> Option<Arc<dyn Function>> {
        change(&self.nets).map(|nets| Arc::new(Self { nets }) as Arc<dyn Function>)
    }
}

/// What the layers are called in files.
const LAYERS: &str = "layers";

/// How many inputs go through the networks at once.
const AT_ONCE: usize = 256;

pub(crate) fn read(form: &Form, tensors: &mut Tensors) -> Option<Arc<dyn Function>> {
    let (_, layers) = tensors.u8(LAYERS)?;
    let (_, modules) = Tensors::decode::<BTreeMap<String, Module>>(LAYERS, &layers)?;
    let arrays = std::mem::take(&mut tensors.arrays);
    let nets = Networks::of(modules, Tensors { arrays })?;
    is_whole(&nets, form).then(|| Arc::new(Imitative { nets }) as Arc<dyn Function>)
}

/// Whether networks are those of a model of observations of a form.
fn is_whole(nets: &Networks, form: &Form) -> bool {
    let Ok((_, dims)) = steps_of(form) else { return false };
    let of = |name: &str| nets.modules.get(name);
    let (Some(Module::Gru { inputs, units }), Some(head)) = (of(CELL), of(HEAD)) else {
        return false;
    };
    nets.modules.len() == 4
        && is_dense(head)
        && state_len(nets, form) == Some(*units)
        && *inputs == dims
        && ends(head, &[*units]) == Some(2 * dims)
        && nets.are_exact()
}

/// Several imitative models of observations of one form, opened: they see, and their scorer scores.
#[derive(Debug)]
pub struct Imitators {
    eyes: Vec<Live>,
    form: Form,
    states: Vec<f32>,
    read: Vec<f32>,
    /// What scores plans where they see themselves.
    pub scorer: Scorer<f32>,
}

impl Imitators {
    /// Some models.
    ///
    /// # Panics
    /// If there are none, or they are not of this form.
    #[must_use]
    pub fn of(models: &[&Imitative], form: &Form) -> Self {
        let (steps, _) = steps_of(form).expect("models of plans");
        let eyes =
            models.iter().map(|model| Live::some(&model.nets, |name| name == SEE || name == MERGE));
        let members = models.iter().map(|model| Member::of(&model.nets)).collect();
        Self {
            eyes: eyes.collect(),
            form: form.clone(),
            states: Vec::new(),
            read: Vec::new(),
            scorer: Scorer::of(members, steps),
        }
    }

    /// Sees inputs, one after the other.
    ///
    /// # Panics
    /// If they are no whole number of inputs.
    pub fn see(&mut self, xs: &[f32]) {
        self.states.clear();
        for live in &self.eyes {
            live.graph.begin();
            let state = live.graph.still(|| state(live, &self.form, xs, &mut Mode::Predict));
            live.graph.read(state, &mut self.read);
            self.states.extend(&self.read);
        }
        self.scorer.see(&self.states);
    }
}
