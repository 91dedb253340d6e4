//! What linear models are linear in.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_op::{Parts, declare, family};

/// Features of a scalar. They are powers, since models and posteriors store their coefficients.
pub trait Features: Debug + Send + Sync {
    /// The highest power.
    fn degree(&self) -> usize;
}

family!(dyn Features, "Features", table);

pub(super) fn table() -> &'static Parts<dyn Features> {
    static TABLE: LazyLock<Parts<dyn Features>> =
        LazyLock::new(|| Parts::<dyn Features>::new().with(|part: Polynomial| Box::new(part)));
    &TABLE
}

declare! {
    /// The powers 1, a, …, a^degree (Eqn. 2.18b).
    pub struct Polynomial = "polynomial" @ 1 {
        /// The highest power.
        degree: usize, in 0.0..=100.0;
    }
}

impl Features for Polynomial {
    fn degree(&self) -> usize {
        self.degree
    }
}
