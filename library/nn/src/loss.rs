//! Losses as a spec names them.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_data::Form;
use ivx_data::Misfit;
use ivx_data::form::several_classes;
use ivx_op::{Parts, declare, family};

use super::graph::{Graph, Shape, Var};
use super::real::{Real, sigmoid, softplus};
use crate::Head;

/// What a network's outputs are measured by.
pub trait Loss: Debug + Send + Sync {
    /// What the outputs are.
    fn head(&self) -> Head;

    /// The shape of the outputs for one observation.
    ///
    /// # Errors
    /// Why targets of this form are not measured so.
    fn outputs(&self, form: &Form) -> Result<Vec<usize>, Misfit>;

    /// The loss of observations of a form: summed over the numbers of each target, and averaged over
    /// targets.
    fn of(&self, graph: &Graph<f32>, form: &Form, outputs: Var, targets: Var) -> Var;

    /// The loss over the negative log-likelihood, up to a constant.
    fn scale(&self) -> f64 {
        1.0
    }
}

declare! {
    /// Half the squared error: the negative log-likelihood of Gaussian noise, times its variance.
    pub struct Squared = "squared" @ 1 {
        /// Standard deviation of the noise in the targets, by which a prior is weighed.
        noise: f64 = 0.1, in 0.0..;
    }
}

declare! {
    /// The absolute error: the negative log-likelihood of Laplace noise, times its scale.
    pub struct Absolute = "absolute" @ 1 {
        /// Scale of the noise in the targets, by which a prior is weighed.
        noise: f64 = 0.1, in 0.0..;
    }
}

declare! {
    /// The loss of Huber (1964): half the squared error up to `delta`, and `delta (|e| - delta / 2)` from
    /// there on.
    pub struct Huber = "huber" @ 1 {
        /// Where it goes on as a line.
        delta: f64 = 1.0, in f64::MIN_POSITIVE..;
    }
}

declare! {
    /// The cross-entropy of classes: their negative log-likelihood by a softmax of logits.
    pub struct CrossEntropy = "cross_entropy" @ 1 {}
}

declare! {
    /// The cross-entropy of two classes: their negative log-likelihood by a sigmoid of one logit.
    pub struct BinaryCrossEntropy = "binary_cross_entropy" @ 1 {}
}

declare! {
    /// The negative log-likelihood of independent Gaussians, whose means and standard deviations the
    /// network puts out: log σ, or what makes the variance as in Lakshminarayanan, Pritzel and Blundell (2017, §2.2.1).
    pub struct GaussianNll = "gaussian_nll" @ 1 {
        /// Whether `σ² = ln(1 + e^z) + 1e-6` of what the network puts out instead of `σ = e^z`.
        softplus: bool = false;
    }
}

impl Loss for Squared {
    fn head(&self) -> Head {
        Head::Mean
    }

    fn outputs(&self, form: &Form) -> Result<Vec<usize>, Misfit> {
        numbers("squared", form)
    }

    fn of(&self, graph: &Graph<f32>, _: &Form, outputs: Var, targets: Var) -> Var {
        each_target(graph, graph.squared(outputs, targets), 0.5)
    }

    fn scale(&self) -> f64 {
        self.noise * self.noise
    }
}

impl Loss for Absolute {
    fn head(&self) -> Head {
        Head::Mean
    }

    fn outputs(&self, form: &Form) -> Result<Vec<usize>, Misfit> {
        numbers("absolute", form)
    }

    fn of(&self, graph: &Graph<f32>, _: &Form, outputs: Var, targets: Var) -> Var {
        each_target(graph, graph.absolute(outputs, targets), 1.0)
    }

    fn scale(&self) -> f64 {
        self.noise
    }
}

impl Loss for Huber {
    fn head(&self) -> Head {
        Head::Mean
    }

    fn outputs(&self, form: &Form) -> Result<Vec<usize>, Misfit> {
        numbers("huber", form)
    }

    fn of(&self, graph: &Graph<f32>, _: &Form, outputs: Var, targets: Var) -> Var {
        each_target(graph, graph.huber(outputs, targets, self.delta), 1.0)
    }
}

impl Loss for CrossEntropy {
    fn head(&self) -> Head {
        Head::Logits
    }

    fn outputs(&self, form: &Form) -> Result<Vec<usize>, Misfit> {
        let classes = classes("cross_entropy", form)?;
        Ok(form.target.iter().copied().chain([classes]).collect())
    }

    fn of(&self, graph: &Graph<f32>, _: &Form, outputs: Var, targets: Var) -> Var {
        let (of, each) = (graph.shape(outputs), graph.shape(targets));
        let rows = Shape::vectors(each.len(), of.len() / each.len());
        let loss = graph.cross_entropy(graph.reshape(outputs, rows), targets);
        each_target(graph, graph.reshape(loss, each), 1.0)
    }
}

impl Loss for BinaryCrossEntropy {
    fn head(&self) -> Head {
        Head::Logits
    }

    fn outputs(&self, form: &Form) -> Result<Vec<usize>, Misfit> {
        match classes("binary_cross_entropy", form)? {
            2 => Ok(form.target.clone()),
            n => {
                let message =
                    format!("`binary_cross_entropy` tells two classes apart, and not {n}");
                Err(Misfit::new(message, "use `cross_entropy()`"))
            }
        }
    }

    fn of(&self, graph: &Graph<f32>, _: &Form, outputs: Var, targets: Var) -> Var {
        each_target(graph, graph.binary_cross_entropy(outputs, targets), 1.0)
    }
}

impl Loss for GaussianNll {
    fn head(&self) -> Head {
        if self.softplus { Head::GaussianVariance } else { Head::Gaussian }
    }

    fn outputs(&self, form: &Form) -> Result<Vec<usize>, Misfit> {
        let mut shape = numbers("gaussian_nll", form)?;
        match shape.last_mut() {
            Some(last) => *last *= 2,
            None => shape.push(2),
        }
        Ok(shape)
    }

    fn of(&self, graph: &Graph<f32>, form: &Form, outputs: Var, targets: Var) -> Var {
        let shape = graph.shape(targets);
        let width = form.target.last().copied().unwrap_or(1);
        let rows = |width| Shape::vectors(shape.len() / width, width);
        let (outputs, targets) = (
            graph.reshape(outputs, Shape::vectors(rows(width).n, 2 * width)),
            graph.reshape(targets, rows(width)),
        );
        let (means, stds) =
            (graph.columns(outputs, 0, width), graph.columns(outputs, width, width));
        let stds = if self.softplus { graph.map(stds, log_std, log_std_slope) } else { stds };
        let losses = graph.gaussian_log_prob(graph.sub(targets, means), stds);
        each_target(graph, graph.reshape(losses, shape), -1.0)
    }
}

/// The variance by [`Head::GaussianVariance`].
pub(super) fn variance<F: Real>(z: F) -> F {
    softplus(z) + F::of(1e-6)
}

/// `log σ` by [`Head::GaussianVariance`].
fn log_std<F: Real>(z: F) -> F {
    F::of(0.5) * variance(z).ln()
}

fn log_std_slope<F: Real>(z: F, _: F) -> F {
    F::of(0.5) * sigmoid(z) / variance(z)
}

/// The mean over targets of `scale` times the sum over the numbers of each.
fn each_target(graph: &Graph<f32>, losses: Var, scale: f64) -> Var {
    let width = u32::try_from(graph.shape(losses).width()).expect("targets are small");
    graph.affine(graph.mean(losses), scale * f64::from(width), 0.0)
}

fn numbers(loss: &str, form: &Form) -> Result<Vec<usize>, Misfit> {
    match form.classes {
        None => Ok(form.target.clone()),
        Some(n) => {
            let message = format!("`{loss}` is of numbers, and the targets are one of {n} classes");
            Err(Misfit::new(message, "say `loss: cross_entropy()`"))
        }
    }
}

fn classes(loss: &str, form: &Form) -> Result<usize, Misfit> {
    several_classes(form)?;
    form.classes.ok_or_else(|| {
        let message = format!("`{loss}` is of classes, and the targets are numbers");
        Misfit::new(message, "say `loss: squared()`, or another of numbers")
    })
}

/// The losses, by name.
pub(crate) fn losses() -> &'static Parts<dyn Loss> {
    static TABLE: LazyLock<Parts<dyn Loss>> = LazyLock::new(|| {
        Parts::<dyn Loss>::new()
            .with(|x: Squared| Box::new(x))
            .with(|x: Absolute| Box::new(x))
            .with(|x: Huber| Box::new(x))
            .with(|x: CrossEntropy| Box::new(x))
            .with(|x: BinaryCrossEntropy| Box::new(x))
            .with(|x: GaussianNll| Box::new(x))
    });
    &TABLE
}

family!(dyn Loss, "Loss", losses);
