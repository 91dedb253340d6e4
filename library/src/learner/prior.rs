//! What is believed of parameters before any data.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_op::{Parts, declare, family};

/// A distribution over each parameter.
pub trait Prior: Debug + Send + Sync {
    /// Its mean.
    fn mean(&self) -> f64;
    /// Its standard deviation.
    fn std(&self) -> f64;
}

declare! {
    /// Independent normal parameters.
    pub struct Normal = "normal" @ 1 {
        /// The mean of each.
        mean: f64 = 0.0;
        /// The standard deviation of each.
        std: f64 = 1.0, in f64::MIN_POSITIVE..;
    }
}

impl Prior for Normal {
    fn mean(&self) -> f64 {
        self.mean
    }

    fn std(&self) -> f64 {
        self.std
    }
}

/// The priors, by name.
pub(crate) fn priors() -> &'static Parts<dyn Prior> {
    static TABLE: LazyLock<Parts<dyn Prior>> =
        LazyLock::new(|| Parts::<dyn Prior>::new().with(|x: Normal| Box::new(x)));
    &TABLE
}

family!(dyn Prior, "Prior", priors);
