//! `MobileNetV2`.

use ivx_data::Misfit;
use ivx_op::declare;

use super::Net;
use super::block::{inverted_residual, normalised};
use crate::Curve;
use crate::module::{Module, image};

declare! {
    /// `MobileNetV2` (Sandler et al., 2018) for square images, up to the mean of its last channels.
    ///
    /// At width 1, as many as 1280 numbers come out.
    pub struct MobileNetV2 = "mobilenet_v2" @ 1 {
        /// What the numbers of channels are multiplied by; they are rounded to multiples of 8.
        width: f64 = 1.0, in 0.01..=10.0;
    }
}

/// Expansion, channels, blocks and stride of the first block: Table 2 of the paper.
const STAGES: [(usize, usize, usize, usize); 7] = [
    (1, 16, 1, 1),
    (6, 24, 2, 2),
    (6, 32, 3, 2),
    (6, 64, 4, 2),
    (6, 96, 3, 1),
    (6, 160, 3, 2),
    (6, 320, 1, 1),
];

impl Net for MobileNetV2 {
    fn module(&self, input: &[usize]) -> Result<Module, Misfit> {
        let [inputs, ..] = image("`mobilenet_v2`", input)?;
        let mut channels = self.channels(32);
        let mut layers = normalised(inputs, channels, (3, 2), 1, Curve::Relu6);
        for (expansion, outputs, blocks, stride) in STAGES {
            let outputs = self.channels(outputs);
            for i in 0..blocks {
                let stride = if i == 0 { stride } else { 1 };
                layers.push(inverted_residual(channels, outputs, expansion, stride));
                channels = outputs;
            }
        }
        // Narrow networks keep the width of the last layer.
        let last = self.channels(1280).max(1280);
        layers.extend(normalised(channels, last, (1, 1), 1, Curve::Relu6));
        layers.push(Module::GlobalPool);
        let module = Module::Sequence(layers);
        module.output(input)?;
        Ok(module)
    }
}

impl MobileNetV2 {
    /// So many channels times the width, to the nearest multiple of 8 that is no tenth less.
    fn channels(&self, n: usize) -> usize {
        #[expect(clippy::cast_precision_loss, reason = "channels are few")]
        let wanted = self.width * n as f64;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "widths are positive and below 10"
        )]
        let eighths = ((wanted + 4.0) / 8.0) as usize;
        let rounded = eighths.max(1) * 8;
        #[expect(clippy::cast_precision_loss, reason = "channels are few")]
        let less = (rounded as f64) < 0.9 * wanted;
        if less { rounded + 8 } else { rounded }
    }
}
