//! Convolutional networks.

use ivx_data::Misfit;
use ivx_op::{Facts, Part, Wrong, declare};

use super::Net;
use crate::activation::Activation;
use crate::module::{Module, image};
use crate::ops::Window;

declare! {
    /// A convolutional network for images: convolutions, then layers as those of `mlp`.
    ///
    /// That of Mnih et al. (2015) is `cnn(channels: [32, 64, 64], kernels: [8, 4, 3], strides: [4,
    /// 2, 1], hidden: [512])`, and that of `MinAtar` (Young and Tian, 2019) is `cnn()`.
    pub struct Cnn = "cnn" @ 1 {
        /// Channels of each convolution.
        channels: Vec<usize> = vec![16_i64], in 1.0..=1e5;
        /// Rows and columns of each kernel; one for all, or one each.
        kernels: Vec<usize> = vec![3_i64], in 1.0..=1e3;
        /// How far each kernel moves; one for all, or one each.
        strides: Vec<usize> = vec![1_i64], in 1.0..=1e3;
        /// How many rows and columns of zeros surround each image.
        padding: usize = 0, in 0.0..=1e3;
        /// Widths of the layers behind.
        hidden: Vec<usize> = vec![128_i64], in 1.0..=1e6;
        /// What follows each layer.
        activation: Box<dyn Activation> = Part::new("relu");
    }
    rule one_or_one_each;
}

impl Net for Cnn {
    fn module(&self, input: &[usize]) -> Result<Module, Misfit> {
        image("`cnn`", input)?;
        let curve = self.activation.curve();
        let each = |sizes: &[usize], i: usize| match sizes {
            [size] => Ok(*size),
            sizes => sizes.get(i).copied().ok_or_else(|| {
                Misfit::new("there are fewer kernels or strides than channels".to_owned(), HELP)
            }),
        };
        let mut layers = Vec::new();
        let mut shape = input.to_vec();
        for (i, &outputs) in self.channels.iter().enumerate() {
            let (kernel, stride) = (each(&self.kernels, i)?, each(&self.strides, i)?);
            let window = Window { kernel, stride, padding: self.padding };
            let (inputs, groups, bias) = (shape[0], 1, true);
            let conv = Module::Conv { inputs, outputs, window, groups, bias, curve };
            shape = conv.output(&shape)?;
            layers.push(conv);
        }
        layers.push(Module::Flatten);
        let mut inputs = shape.iter().product();
        for &outputs in &self.hidden {
            layers.push(Module::Dense { inputs, outputs, curve });
            inputs = outputs;
        }
        Ok(Module::Sequence(layers))
    }
}

const HELP: &str = "give one for all convolutions, or one for each";

fn one_or_one_each(facts: &Facts<'_>) -> Result<(), Wrong> {
    let Some(channels) = facts.arg::<Vec<usize>>("channels") else { return Ok(()) };
    for arg in ["kernels", "strides"] {
        let n = facts.arg::<Vec<usize>>(arg).map_or(1, |sizes| sizes.len());
        if n != 1 && n != channels.len() {
            let message = format!("there are {n} {arg} for {} convolutions", channels.len());
            return Err(Wrong { arg, message, help: HELP.to_owned() });
        }
    }
    Ok(())
}
