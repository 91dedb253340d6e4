//! Learned functions that are neither networks nor polynomials: each is a file here, and a line in [`KINDS`].

mod boosted;
mod forest;
mod linear;
mod mixture;
mod neighbours;
mod scaled;
mod trees;

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;

use ivx_data::Form;
use ivx_op::Tensors;

use crate::{Model, Networks, imitative, modes};

pub use forest::Forest;
pub use mixture::Mixture;
pub use neighbours::Neighbours;
pub use scaled::Scaled;

/// A learned function of observations of a form.
pub trait Function: Any + Debug + Send + Sync {
    /// What it is called in files.
    fn kind(&self) -> &'static str;

    /// Its numbers, by name: what is read back by the function of [`KINDS`].
    fn tensors(&self) -> Tensors;

    /// Its values at inputs one after the other: for every target its mean, or a logit for each class.
    fn predict(&self, form: &Form, xs: &[f64]) -> Vec<f64>;

    /// The standard deviation of every target, if it says one.
    fn stds(&self, _form: &Form, _xs: &[f64]) -> Option<Vec<f64>> {
        None
    }

    /// The same of other networks, where it is one of such; none if it is not, or `change` makes none.
    fn rewired(
        &self,
        _change: &mut dyn FnMut(&Networks) -> Option<Networks>,
    ) -> Option<Arc<dyn Function>> {
        None
    }

    /// The same around another model, where it is a way to look at one; none if it is not, or `change` makes none.
    fn around(
        &self,
        _change: &mut dyn FnMut(&Model) -> Option<Model>,
    ) -> Option<Arc<dyn Function>> {
        None
    }
}

/// A learned function and what it is of.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// What it was trained on.
    pub form: Form,
    /// It itself.
    pub function: Arc<dyn Function>,
}

impl PartialEq for Fitted {
    fn eq(&self, other: &Self) -> bool {
        let (own, other_function) = (&self.function, &other.function);
        self.form == other.form
            && own.kind() == other_function.kind()
            && own.tensors() == other_function.tensors()
    }
}

/// Reads a function of a form; none if it is none that can be evaluated.
type Read = fn(&Form, &mut Tensors) -> Option<Arc<dyn Function>>;

/// Every kind, by name.
const KINDS: &[(&str, Read)] = &[
    (linear::KIND, linear::read),
    (neighbours::KIND, neighbours::read),
    (forest::KIND, forest::read),
    (boosted::KIND, boosted::read),
    (mixture::KIND, mixture::read),
    (scaled::KIND, scaled::read),
    (imitative::KIND, imitative::read),
    (modes::KIND, modes::read),
];

/// The function of a kind and its numbers; none if they are of no such.
pub(crate) fn read(kind: &str, form: Form, mut tensors: Tensors) -> Option<Fitted> {
    let (_, read) = KINDS.iter().find(|(name, _)| *name == kind)?;
    let function = read(&form, &mut tensors)?;
    tensors.arrays.is_empty().then_some(Fitted { form, function })
}

/// How many numbers a function puts out for one observation, where classes have a logit each.
fn n_outputs(form: &Form) -> usize {
    form.target_len() * form.classes.unwrap_or(1)
}

/// The logits of classes by their probabilities: −∞ of what is impossible.
fn log_shares(shares: &[f64]) -> Vec<f64> {
    shares.iter().map(|share| share.ln()).collect()
}

#[cfg(test)]
mod tests {
    use ivx_math::affine::Affine;
    use ivx_math::boost::Boosted;
    use ivx_math::standard::Scale;
    use ivx_math::tree::{Split, Tree};
    use ivx_op::{Artifact as _, Data};
    use rand::SeedableRng as _;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::{Anchored, Imitative, Mlp, ModeNets, Modes, Multimodal, PlanNets, Tanh};

    fn tree(values: &[f64]) -> Tree {
        let split = Split { input: 1, at: 0.5, below: 1, above: 2 };
        Tree { splits: vec![Some(split), None, None], values: values.to_vec() }
    }

    fn on_scale(model: &Model) -> Scaled {
        let (x, y) = (Scale::of(&[1.0, 5.0, 3.0, 9.0], 2), Scale::of(&[10.0, 14.0], 1));
        Scaled { model: model.clone(), x, y }
    }

    fn all() -> Vec<(Form, Arc<dyn Function>)> {
        let form = |classes| Form { input: vec![2], target: vec![], classes, ..Form::default() };
        let affine = Affine { weights: vec![1.0, 2.0], intercepts: vec![f64::NEG_INFINITY] };
        let near = Neighbours { x: vec![0.0, 1.0, 2.0, 3.0], y: vec![2.0, 0.0], k: 2 };
        let forest = Forest(vec![tree(&[0.5, 0.5, 1.0, 0.0, 0.0, 1.0]); 2]);
        let boosted = Boosted { base: vec![0.1], trees: vec![tree(&[0.0, -1.0, 1.0])] };
        let members =
            vec![
                Model::Fitted(Fitted { form: form(None), function: Arc::new(boosted.clone()) });
                2
            ];
        vec![
            (form(Some(2)), Arc::new(affine)),
            (form(Some(3)), Arc::new(near)),
            (form(Some(2)), Arc::new(forest)),
            (form(None), Arc::new(boosted)),
            (form(None), Arc::new(Mixture { members: members.clone(), noise: 0.25 })),
            (form(None), Arc::new(on_scale(&members[0]))),
            imitating(),
            foretelling(),
        ]
    }

    fn imitating() -> (Form, Arc<dyn Function>) {
        let form = Form { input: vec![2], target: vec![2, 2], ..Form::default() };
        let net = Mlp { hidden: vec![2], activation: Box::new(Tanh {}) };
        let nets = PlanNets { net: &net, features: 2, merge: &[], units: 2, head: &[] };
        let drawn = Imitative::drawn(&nets, &form, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
        (form, Arc::new(drawn))
    }

    fn foretelling() -> (Form, Arc<dyn Function>) {
        let form = Form { input: vec![2], target: vec![2, 2], ..Form::default() };
        let net = Mlp { hidden: vec![2], activation: Box::new(Tanh {}) };
        let nets = ModeNets { net: &net, features: 2, merge: &[] };
        let modes = Modes::Anchored(Anchored::Moved, vec![0.5; 12]);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        (form.clone(), Arc::new(Multimodal::drawn(&nets, modes, &form, &mut rng).unwrap()))
    }

    #[test]
    fn every_kind_survives_the_round_trip() {
        let mut kinds: Vec<&str> = Vec::new();
        for (form, function) in all() {
            kinds.push(function.kind());
            let model = Model::Fitted(Fitted { form, function });
            assert_eq!(Model::decode(&model.encode()).as_ref(), Some(&model));
        }
        assert_eq!(kinds, KINDS.iter().map(|(name, _)| *name).collect::<Vec<_>>());
    }

    #[test]
    fn what_cannot_be_evaluated_is_not_read() {
        for (form, function) in all() {
            let of = |form: &Form, tensors: Tensors| read(function.kind(), form.clone(), tensors);
            let whole = function.tensors();
            assert!(of(&form, whole.clone()).is_some());
            // Without its last member a mixture is one of fewer.
            for name in whole.arrays.keys().filter(|name| *name != "1") {
                let mut less = whole.clone();
                less.arrays.remove(name);
                assert_eq!(of(&form, less), None, "{} without {name}", function.kind());
            }
            let mut more = whole.clone();
            more.arrays.insert("other".to_owned(), Data::bytes(vec![0]));
            assert_eq!(of(&form, more), None);
            let wider = Form { input: vec![1], target: vec![3], ..form.clone() };
            assert_eq!(of(&wider, whole), None, "{}", function.kind());
        }
        let (form, forest) = all().remove(2);
        for (name, value) in [("children", 0.0), ("children", 3.0), ("inputs", 2.0), ("sizes", 2.0)]
        {
            let mut tensors = forest.tensors();
            let Some(Data::F64(_, values)) = tensors.arrays.get_mut(name) else {
                panic!("numbers")
            };
            values[0] = value;
            assert_eq!(read("forest", form.clone(), tensors), None, "{name} of {value}");
        }
    }

    #[test]
    fn trees_are_asked_from_the_root() {
        let of = |i: usize| {
            let (form, function) = all().remove(i);
            function.predict(&form, &[9.0, 0.5, 9.0, 0.6])
        };
        assert_eq!(of(2), [0.0, f64::NEG_INFINITY, f64::NEG_INFINITY, 0.0]);
        assert_eq!(of(3), [0.1 - 1.0, 0.1 + 1.0]);
    }
}
