//! What is believed of parameters before any data.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_op::{Parts, declare, family};

/// A belief about every parameter, independently.
pub trait Prior: Debug + Send + Sync {
    /// The mean.
    fn mean(&self) -> f64;
    /// The standard deviation; positive.
    fn std(&self) -> f64;
}

family!(dyn Prior, "Prior", table);

pub(super) fn table() -> &'static Parts<dyn Prior> {
    static TABLE: LazyLock<Parts<dyn Prior>> =
        LazyLock::new(|| Parts::<dyn Prior>::new().with(|part: Normal| Box::new(part)));
    &TABLE
}

declare! {
    /// Independent normal parameters of one mean and standard deviation.
    pub struct Normal = "normal" @ 1 {
        /// The mean.
        mean: f64 = 0.0;
        /// The standard deviation.
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
