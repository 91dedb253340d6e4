//! Blocks around which what goes in is led.

use ivx_data::Misfit;
use ivx_op::declare;

use super::Net;
use super::list::listed;
use crate::Curve;
use crate::module::{Module, image};
use crate::ops::Window;

declare! {
    /// What goes in, and what layers make of it, added (He et al., 2016); they must keep the shape.
    pub struct Residual = "residual" @ 1 {
        /// The layers, first to last.
        layers: Vec<Box<dyn Net>>;
    }
}

declare! {
    /// An inverted residual block (Sandler et al., 2018): a convolution of 1 × 1 to more channels, one of
    /// 3 × 3 within each channel, and one of 1 × 1 without activation, each with batch normalisation.
    ///
    /// What goes in is added where the shape stays.
    pub struct InvertedResidual = "inverted_residual" @ 1 {
        /// Channels out.
        channels: usize, in 1.0..=1e5;
        /// How many times as many channels there are inside.
        expansion: usize = 6, in 1.0..=100.0;
        /// How far the kernel inside moves.
        stride: usize = 1, in 1.0..=1e3;
    }
}

impl Net for Residual {
    fn module(&self, input: &[usize]) -> Result<Module, Misfit> {
        let module = Module::Residual(listed(&self.layers, input)?);
        module.output(input)?;
        Ok(module)
    }
}

impl Net for InvertedResidual {
    fn module(&self, input: &[usize]) -> Result<Module, Misfit> {
        let [inputs, ..] = image("`inverted_residual`", input)?;
        Ok(inverted_residual(inputs, self.channels, self.expansion, self.stride))
    }
}

/// The layers of an inverted residual block.
pub(super) fn inverted_residual(
    inputs: usize,
    outputs: usize,
    expansion: usize,
    stride: usize,
) -> Module {
    let inside = inputs * expansion;
    let mut layers = Vec::new();
    if expansion > 1 {
        layers.extend(normalised(inputs, inside, (1, 1), 1, Curve::Relu6));
    }
    layers.extend(normalised(inside, inside, (3, stride), inside, Curve::Relu6));
    layers.extend(normalised(inside, outputs, (1, 1), 1, Curve::Identity));
    if stride == 1 && inputs == outputs {
        Module::Residual(layers)
    } else {
        Module::Sequence(layers)
    }
}

/// A convolution that keeps the size but for its stride, batch normalisation, and what follows.
pub(super) fn normalised(
    inputs: usize,
    outputs: usize,
    (kernel, stride): (usize, usize),
    groups: usize,
    curve: Curve,
) -> Vec<Module> {
    let window = Window { kernel, stride, padding: kernel / 2 };
    let (bias, none) = (false, Curve::Identity);
    let mut layers = vec![
        Module::Conv { inputs, outputs, window, groups, bias, curve: none },
        Module::BatchNorm { channels: outputs },
    ];
    if curve != Curve::Identity {
        layers.push(Module::Curve(curve));
    }
    layers
}
