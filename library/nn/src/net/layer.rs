//! Single layers.

use ivx_data::Misfit;
use ivx_op::{Part, declare};

use super::Net;
use crate::activation::Activation;
use crate::module::{Module, image, vectors};
use crate::ops::Window;

declare! {
    /// A linear map with its bias, and what follows; of every step of a sequence.
    pub struct Dense = "dense" @ 1 {
        /// Numbers out.
        units: usize, in 1.0..=1e6;
        /// What follows.
        activation: Box<dyn Activation> = Part::new("identity");
    }
}

declare! {
    /// A convolution of an image with its bias, and what follows.
    pub struct Conv = "conv" @ 1 {
        /// Channels out.
        channels: usize, in 1.0..=1e5;
        /// Rows and columns of the kernel.
        kernel: usize = 3, in 1.0..=1e3;
        /// How far it moves.
        stride: usize = 1, in 1.0..=1e3;
        /// How many rows and columns of zeros surround the image.
        padding: usize = 0, in 0.0..=1e3;
        /// How many groups of channels do not see each other; as many as channels go in for a depthwise
        /// convolution.
        groups: usize = 1, in 1.0..=1e5;
        /// What follows.
        activation: Box<dyn Activation> = Part::new("identity");
    }
}

declare! {
    /// A transposed convolution of an image with its bias, and what follows: images grow by its stride.
    pub struct ConvTranspose = "conv_transpose" @ 1 {
        /// Channels out.
        channels: usize, in 1.0..=1e5;
        /// Rows and columns of the kernel.
        kernel: usize = 3, in 1.0..=1e3;
        /// How far it moves.
        stride: usize = 1, in 1.0..=1e3;
        /// How many rows and columns are taken away around the result.
        padding: usize = 0, in 0.0..=1e3;
        /// What follows.
        activation: Box<dyn Activation> = Part::new("identity");
    }
}

declare! {
    /// The largest number under a window that moves over each channel of an image.
    pub struct MaxPool = "max_pool" @ 1 {
        /// Rows and columns of the window.
        size: usize = 2, in 1.0..=1e3;
        /// How far it moves.
        stride: usize = 2, in 1.0..=1e3;
        /// How many rows and columns surround the image.
        padding: usize = 0, in 0.0..=1e3;
    }
}

declare! {
    /// The mean of the numbers under a window that moves over each channel of an image.
    pub struct MeanPool = "mean_pool" @ 1 {
        /// Rows and columns of the window.
        size: usize = 2, in 1.0..=1e3;
        /// How far it moves.
        stride: usize = 2, in 1.0..=1e3;
        /// How many rows and columns of zeros surround the image.
        padding: usize = 0, in 0.0..=1e3;
    }
}

declare! {
    /// The mean of each channel of a square image.
    pub struct GlobalPool = "global_pool" @ 1 {}
}

declare! {
    /// Channels brought to mean 0 and variance 1 over the batch, then scaled and shifted (Ioffe and
    /// Szegedy, 2015). Predictions use the running statistics, of which a batch has a tenth.
    pub struct BatchNorm = "batch_norm" @ 1 {}
}

declare! {
    /// Items brought to mean 0 and variance 1, then scaled and shifted number by number (Ba et al., 2016).
    pub struct LayerNorm = "layer_norm" @ 1 {}
}

declare! {
    /// A learned vector for each index: data are the indices 0, 1, ... of entries.
    ///
    /// They start standard normal.
    pub struct Embedding = "embedding" @ 1 {
        /// How many indices there are.
        entries: usize, in 1.0..=1e7;
        /// How long the vectors are.
        width: usize, in 1.0..=1e5;
    }
}

declare! {
    /// Numbers left out at random while training, and the others scaled up (Srivastava et al., 2014).
    ///
    /// `mc_dropout` leaves them out in predictions too.
    pub struct Dropout = "dropout" @ 1 {
        /// The probability of each.
        rate: f64 = 0.5, in 0.0..=0.99;
    }
}

declare! {
    /// A function of every number.
    pub struct Activate = "activate" @ 1 {
        /// The function.
        activation: Box<dyn Activation>;
    }
}

declare! {
    /// All numbers of an image or a sequence as one vector.
    pub struct Flatten = "flatten" @ 1 {}
}

declare! {
    /// The last step of a sequence.
    pub struct Last = "last" @ 1 {}
}

impl Net for Dense {
    fn module(&self, input: &[usize]) -> Result<Module, Misfit> {
        let (_, inputs) = vectors("`dense`", input)?;
        Ok(Module::Dense { inputs, outputs: self.units, curve: self.activation.curve() })
    }
}

impl Net for Conv {
    fn module(&self, input: &[usize]) -> Result<Module, Misfit> {
        let [inputs, ..] = image("`conv`", input)?;
        let window = Window { kernel: self.kernel, stride: self.stride, padding: self.padding };
        let (outputs, groups, bias) = (self.channels, self.groups, true);
        let curve = self.activation.curve();
        Ok(Module::Conv { inputs, outputs, window, groups, bias, curve })
    }
}

impl Net for ConvTranspose {
    fn module(&self, input: &[usize]) -> Result<Module, Misfit> {
        let [inputs, ..] = image("`conv_transpose`", input)?;
        let window = Window { kernel: self.kernel, stride: self.stride, padding: self.padding };
        let curve = self.activation.curve();
        Ok(Module::ConvTranspose { inputs, outputs: self.channels, window, curve })
    }
}

impl Net for MaxPool {
    fn module(&self, _: &[usize]) -> Result<Module, Misfit> {
        let Self { size: kernel, stride, padding } = *self;
        Ok(Module::MaxPool(Window { kernel, stride, padding }))
    }
}

impl Net for MeanPool {
    fn module(&self, _: &[usize]) -> Result<Module, Misfit> {
        let Self { size: kernel, stride, padding } = *self;
        Ok(Module::MeanPool(Window { kernel, stride, padding }))
    }
}

impl Net for GlobalPool {
    fn module(&self, _: &[usize]) -> Result<Module, Misfit> {
        Ok(Module::GlobalPool)
    }
}

impl Net for BatchNorm {
    fn module(&self, input: &[usize]) -> Result<Module, Misfit> {
        Ok(Module::BatchNorm { channels: input.first().copied().unwrap_or(1) })
    }
}

impl Net for LayerNorm {
    fn module(&self, input: &[usize]) -> Result<Module, Misfit> {
        Ok(Module::LayerNorm { shape: input.to_vec() })
    }
}

impl Net for Embedding {
    fn module(&self, _: &[usize]) -> Result<Module, Misfit> {
        Ok(Module::Embedding { entries: self.entries, width: self.width })
    }
}

impl Net for Dropout {
    fn module(&self, input: &[usize]) -> Result<Module, Misfit> {
        Ok(Module::Dropout { rate: self.rate, shape: input.to_vec() })
    }
}

impl Net for Activate {
    fn module(&self, _: &[usize]) -> Result<Module, Misfit> {
        Ok(Module::Curve(self.activation.curve()))
    }
}

impl Net for Flatten {
    fn module(&self, _: &[usize]) -> Result<Module, Misfit> {
        Ok(Module::Flatten)
    }
}

impl Net for Last {
    fn module(&self, _: &[usize]) -> Result<Module, Misfit> {
        Ok(Module::Last)
    }
}
