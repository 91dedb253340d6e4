//! Layers one after the other.

use ivx_data::Misfit;
use ivx_op::declare;

use super::Net;
use crate::module::Module;

declare! {
    /// Layers and networks one after the other.
    ///
    /// `sequence([conv(16, kernel: 3), activate(relu()), flatten(), dense(128)])`
    pub struct Sequence = "sequence" @ 1 {
        /// The layers, first to last.
        layers: Vec<Box<dyn Net>>;
    }
}

impl Net for Sequence {
    fn module(&self, input: &[usize]) -> Result<Module, Misfit> {
        listed(&self.layers, input).map(Module::Sequence)
    }
}

/// The layers for inputs of a shape, each for what comes out of the one before.
pub(super) fn listed(layers: &[Box<dyn Net>], input: &[usize]) -> Result<Vec<Module>, Misfit> {
    let mut shape = input.to_vec();
    let modules = layers.iter().map(|layer| {
        let module = layer.module(&shape)?;
        shape = module.output(&shape)?;
        Ok(module)
    });
    modules.collect()
}
