//! Networks as a spec describes them.

mod block;
mod cnn;
mod impala;
mod layer;
mod list;
mod mlp;
mod mobilenet;
mod recurrent;

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_data::{Misfit, sizes_told};
use ivx_op::{Parts, family};

pub use mlp::Mlp;

use super::module::Module;
use crate::Curve;

/// The architecture of a network, for inputs of any shape that it takes.
///
/// Who trains it adds a linear map to as many numbers as are asked for.
pub trait Net: Debug + Send + Sync {
    /// The layers for inputs of a shape.
    ///
    /// # Errors
    /// Why it does not take them.
    fn module(&self, input: &[usize]) -> Result<Module, Misfit>;
}

/// The layers of a network for inputs of a shape, and the linear map that ends in so many numbers.
///
/// After a recurrent layer, and where the outputs have as many steps, it is one map for each step.
///
/// # Errors
/// Why the shapes do not fit.
pub fn headed(net: &dyn Net, input: &[usize], outputs: &[usize]) -> Result<Module, Misfit> {
    let module = net.module(input)?;
    let shape = module.output(input)?;
    let (inputs, outputs) = match shape[..] {
        [steps, length] if outputs.first() == Some(&steps) => {
            (length, outputs[1..].iter().product())
        }
        [_, _] => {
            let message = format!(
                "the network ends in {} and the data have {} as targets",
                sizes_told(&shape),
                sizes_told(outputs)
            );
            return Err(Misfit::new(message, "end it in `last()`, for the last step alone"));
        }
        [_, _, _] => {
            let message = format!("the network ends in {}", sizes_told(&shape));
            return Err(Misfit::new(message, "end it in `flatten()` or `global_pool()`"));
        }
        _ => (shape.iter().product(), outputs.iter().product()),
    };
    let head = Module::Dense { inputs, outputs, curve: Curve::Identity };
    let mut layers = match module {
        Module::Sequence(layers) => layers,
        other => vec![other],
    };
    layers.push(head);
    Ok(Module::Sequence(layers))
}

/// The networks, by name.
pub(crate) fn nets() -> &'static Parts<dyn Net> {
    static TABLE: LazyLock<Parts<dyn Net>> = LazyLock::new(|| {
        Parts::<dyn Net>::new()
            .with(|x: Mlp| Box::new(x))
            .with(|x: cnn::Cnn| Box::new(x))
            .with(|x: recurrent::Gru| Box::new(x))
            .with(|x: recurrent::Lstm| Box::new(x))
            .with(|x: impala::Impala| Box::new(x))
            .with(|x: mobilenet::MobileNetV2| Box::new(x))
            .with(|x: list::Sequence| Box::new(x))
            .with(|x: block::Residual| Box::new(x))
            .with(|x: block::InvertedResidual| Box::new(x))
            .with(|x: layer::Dense| Box::new(x))
            .with(|x: layer::Conv| Box::new(x))
            .with(|x: layer::ConvTranspose| Box::new(x))
            .with(|x: layer::MaxPool| Box::new(x))
            .with(|x: layer::MeanPool| Box::new(x))
            .with(|x: layer::GlobalPool| Box::new(x))
            .with(|x: layer::BatchNorm| Box::new(x))
            .with(|x: layer::LayerNorm| Box::new(x))
            .with(|x: layer::Embedding| Box::new(x))
            .with(|x: layer::Dropout| Box::new(x))
            .with(|x: layer::Activate| Box::new(x))
            .with(|x: layer::Flatten| Box::new(x))
            .with(|x: layer::Last| Box::new(x))
    });
    &TABLE
}

family!(dyn Net, "Net", nets);

#[cfg(test)]
mod tests;
