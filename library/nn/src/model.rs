//! Learned functions.

use std::borrow::Cow;
use std::collections::BTreeMap;

use ivx_data::{Form, form};
use ivx_math::policy::boltzmann;
use ivx_math::polynomial::polynomial;
use ivx_op::{Artifact, Data, OpError, Shapes, Tensors};
use serde::{Deserialize, Serialize};

use crate::function::{Fitted, read};
use crate::{Module, Named, Networks};

/// A learned function.
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// `θ_0 + θ_1 a + … + θ_d a^d` of a number (Eqn. 2.18b).
    Polynomial(Vec<f64>),
    /// A neural network.
    Net(NetModel),
    /// Anything else.
    Fitted(Fitted),
}

/// A neural network as plain named arrays, with what is needed to run it.
#[derive(Clone, Debug, PartialEq)]
pub struct NetModel {
    /// Its layers and arrays, under no name; and those of the fixed prior network, if it has one, as [`PRIOR`].
    pub nets: Networks,
    /// What it was trained on.
    pub form: Form,
    /// What it puts out.
    pub head: Head,
    /// How much the fixed prior network adds; 0 without one.
    pub prior_scale: f64,
}

/// What a prior network is called.
pub const PRIOR: &str = "prior";

impl NetModel {
    /// A network as others wrote it, whose arrays are called `0.weight` (`[in, out]`), `0.bias` and so on, those of its
    /// prior network `prior.0.weight`.
    #[must_use]
    pub fn new(
        module: Module,
        form: Form,
        head: Head,
        prior_scale: f64,
        arrays: Vec<Named>,
    ) -> Self {
        let mut nets = Networks::default();
        for array in arrays {
            nets.put(array);
        }
        if prior_scale != 0.0 {
            nets.modules.insert(PRIOR.to_owned(), module.clone());
        }
        nets.modules.insert(String::new(), module);
        Self { nets, form, head, prior_scale }
    }

    /// Its layers.
    ///
    /// # Panics
    /// If it has none.
    #[must_use]
    pub fn module(&self) -> &Module {
        &self.nets.modules[""]
    }
}

/// What the numbers that a network puts out for one target are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Head {
    /// The target.
    Mean,
    /// The means of a Gaussian, and the logarithms of its standard deviations behind them.
    Gaussian,
    /// The means of a Gaussian, and behind them numbers `z` of its variances `ln(1 + e^z) + 1e-6`.
    GaussianVariance,
    /// The logit of each class; of the second of two, where it is one.
    Logits,
}

impl Head {
    /// Whether there is a standard deviation.
    #[must_use]
    pub fn says_std(self) -> bool {
        matches!(self, Self::Gaussian | Self::GaussianVariance)
    }
}

#[derive(Serialize, Deserialize)]
enum Facts {
    Polynomial,
    Net { module: Module, form: Form, head: Head, prior_scale: f64 },
    Fitted { kind: String, form: Form },
}

impl Model {
    /// What it was trained on.
    #[must_use]
    pub fn form(&self) -> Cow<'_, Form> {
        match self {
            Self::Polynomial(_) => Cow::Owned(Form::default()),
            Self::Net(net) => Cow::Borrowed(&net.form),
            Self::Fitted(fitted) => Cow::Borrowed(&fitted.form),
        }
    }

    /// The values of a function of one number.
    ///
    /// # Errors
    /// If it is a function of something else.
    pub fn rewards(&self, actions: &[f64]) -> Result<Vec<f64>, OpError> {
        form::of_numbers(&self.form()).map_err(form::failed)?;
        Ok(self.predict(actions))
    }

    /// The function's values at `xs`: for every target its mean, or a logit for each class.
    ///
    /// # Panics
    /// If `xs` are not inputs as it was trained on, one after the other.
    #[must_use]
    pub fn predict(&self, xs: &[f64]) -> Vec<f64> {
        match self {
            Self::Polynomial(theta) => polynomial(theta, xs),
            Self::Net(net) => crate::predict(net, xs),
            Self::Fitted(Fitted { form, function }) => function.predict(form, xs),
        }
    }

    /// The standard deviation of every target at `xs`; none of a model that says nothing of it.
    ///
    /// # Panics
    /// As [`Model::predict`].
    #[must_use]
    pub fn stds(&self, xs: &[f64]) -> Option<Vec<f64>> {
        match self {
            Self::Polynomial(_) => None,
            Self::Net(net) => crate::stds(net, xs),
            Self::Fitted(Fitted { form, function }) => function.stds(form, xs),
        }
    }

    /// The probability of each class at `xs`: `[targets, classes]`, row by row.
    ///
    /// # Panics
    /// As [`Model::predict`]; or if it is a model of numbers.
    #[must_use]
    pub fn class_shares(&self, xs: &[f64]) -> Vec<f64> {
        let form = self.form();
        let n_classes = form.classes.expect("a model of classes");
        let n_targets = xs.len() / form.input_len() * form.target_len();
        let logits = self.predict(xs);
        let rows = logits.chunks_exact((logits.len() / n_targets.max(1)).max(1));
        let shares: Vec<f64> = rows
            .flat_map(|row| match row {
                [second] => boltzmann(&[0.0, *second], 1.0),
                row => boltzmann(row, 1.0),
            })
            .collect();
        assert_eq!(shares.len(), n_targets * n_classes, "a probability a class");
        shares
    }
}

impl Artifact for Model {
    const KIND: &'static str = "Model";

    fn encode(&self) -> Vec<u8> {
        match self {
            Self::Polynomial(theta) => {
                let theta = Data::F64(vec![theta.len()], theta.clone());
                Tensors { arrays: [("theta".to_owned(), theta)].into() }
                    .encode(Self::KIND, &Facts::Polynomial)
            }
            Self::Net(net) => {
                let facts = Facts::Net {
                    module: net.module().clone(),
                    form: net.form.clone(),
                    head: net.head,
                    prior_scale: net.prior_scale,
                };
                net.nets.tensors().encode(Self::KIND, &facts)
            }
            Self::Fitted(Fitted { form, function }) => {
                let facts = Facts::Fitted { kind: function.kind().to_owned(), form: form.clone() };
                function.tensors().encode(Self::KIND, &facts)
            }
        }
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, facts) = Tensors::decode::<Facts>(Self::KIND, bytes)?;
        match facts {
            Facts::Polynomial => tensors.f64("theta").map(|(_, theta)| Self::Polynomial(theta)),
            Facts::Net { module, form, head, prior_scale } => {
                let arrays = Networks::of(BTreeMap::new(), tensors)?.arrays;
                Some(Self::Net(NetModel::new(module, form, head, prior_scale, arrays)))
            }
            Facts::Fitted { kind, form } => read(&kind, form, tensors).map(Self::Fitted),
        }
    }

    /// A network without layers, which is of something and says nothing.
    fn later(shapes: &Shapes) -> Option<Self> {
        let (form, nets) = (Form::of(shapes)?, Networks::default());
        Some(Self::Net(NetModel { nets, form, head: Head::Mean, prior_scale: 0.0 }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Curve;

    #[test]
    fn models_survive_the_round_trip() {
        let dense = Module::Dense { inputs: 1, outputs: 2, curve: Curve::Tanh };
        let module = Module::Sequence(vec![Module::Flatten, Module::Residual(vec![dense])]);
        let form = Form { input: vec![2], target: vec![], classes: Some(3), ..Form::default() };
        let arrays = vec![("1.0.weight".into(), vec![1, 2], vec![0.25, -1.0])];
        let net = NetModel::new(module, form, Head::Logits, 0.5, arrays);
        for model in [Model::Polynomial(vec![1.0, -2.0]), Model::Net(net)] {
            assert_eq!(Model::decode(&model.encode()), Some(model));
        }
    }

    #[test]
    fn a_polynomial_is_evaluated_from_its_highest_power() {
        // 1 − 2·3 + 0.5·9 = −0.5
        assert_eq!(Model::Polynomial(vec![1.0, -2.0, 0.5]).predict(&[3.0]), [-0.5]);
    }
}
