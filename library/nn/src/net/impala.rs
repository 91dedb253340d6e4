//! The network of IMPALA.

use ivx_data::Misfit;
use ivx_op::declare;

use super::Net;
use crate::Curve;
use crate::module::{Module, image};
use crate::ops::Window;

declare! {
    /// The deep residual network of IMPALA (Espeholt et al., 2018), without its recurrent layer.
    ///
    /// Each section is a convolution, a pooling that halves the image, and two residual blocks. The shallow
    /// network of that paper is `cnn(channels: [16, 32], kernels: [8, 4], strides: [4, 2], hidden:
    /// [256])`.
    pub struct Impala = "impala" @ 1 {
        /// Channels of each section.
        channels: Vec<usize> = vec![16_i64, 32, 32], in 1.0..=1e5;
        /// Width of the layer behind.
        hidden: usize = 256, in 1.0..=1e6;
    }
}

impl Net for Impala {
    fn module(&self, input: &[usize]) -> Result<Module, Misfit> {
        image("`impala`", input)?;
        let same = |inputs, outputs| Module::Conv {
            inputs,
            outputs,
            window: Window { kernel: 3, stride: 1, padding: 1 },
            groups: 1,
            bias: true,
            curve: Curve::Identity,
        };
        let mut layers = Vec::new();
        let mut shape = input.to_vec();
        for &channels in &self.channels {
            let block = || {
                let half = || [Module::Curve(Curve::Relu), same(channels, channels)];
                Module::Residual(half().into_iter().chain(half()).collect())
            };
            let pool = Module::MaxPool(Window { kernel: 3, stride: 2, padding: 1 });
            let section = [same(shape[0], channels), pool, block(), block()];
            shape = Module::Sequence(section.to_vec()).output(&shape)?;
            layers.extend(section);
        }
        let inputs = shape.iter().product();
        layers.extend([Module::Curve(Curve::Relu), Module::Flatten]);
        layers.push(Module::Dense { inputs, outputs: self.hidden, curve: Curve::Relu });
        Ok(Module::Sequence(layers))
    }
}
