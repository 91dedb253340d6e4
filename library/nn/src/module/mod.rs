//! Networks as plain data: what layers there are, of what sizes, and which shapes they take.

mod arrays;
mod pass;
mod shape;

use serde::{Deserialize, Serialize};

pub use arrays::{ArrayOf, Start};
pub use pass::Mode;
pub(super) use pass::batch;
pub(super) use shape::{image, vectors};

use super::curve::Curve;
use super::ops::Window;

/// Layers of known sizes.
///
/// What goes in and comes out has a shape: none for a number, `[length]` for a vector, `[steps,
/// length]` for a sequence, `[channels, rows, columns]` for an image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Module {
    /// A linear map and what follows it; of every step of a sequence.
    Dense {
        /// Numbers in.
        inputs: usize,
        /// Numbers out.
        outputs: usize,
        /// What follows.
        curve: Curve,
    },
    /// A convolution and what follows it.
    Conv {
        /// Channels in.
        inputs: usize,
        /// Channels out.
        outputs: usize,
        /// How the kernel moves.
        window: Window,
        /// How many groups of channels do not see each other.
        groups: usize,
        /// Whether a number is added to each channel.
        bias: bool,
        /// What follows.
        curve: Curve,
    },
    /// A transposed convolution and what follows it.
    ConvTranspose {
        /// Channels in.
        inputs: usize,
        /// Channels out.
        outputs: usize,
        /// How the kernel moves.
        window: Window,
        /// What follows.
        curve: Curve,
    },
    /// The largest number under a window.
    MaxPool(Window),
    /// The mean of the numbers under a window.
    MeanPool(Window),
    /// The mean of each channel.
    GlobalPool,
    /// Channels brought to mean 0 and variance 1 over the batch.
    BatchNorm {
        /// How many.
        channels: usize,
    },
    /// Items brought to mean 0 and variance 1.
    LayerNorm {
        /// Their shape.
        shape: Vec<usize>,
    },
    /// A gated recurrent unit, unrolled from a state of zeros.
    Gru {
        /// Numbers in at every step.
        inputs: usize,
        /// Numbers in the state.
        units: usize,
    },
    /// Long short-term memory, unrolled from a state of zeros.
    Lstm {
        /// Numbers in at every step.
        inputs: usize,
        /// Numbers in the output.
        units: usize,
    },
    /// A vector for each number, which is an index.
    Embedding {
        /// How many there are.
        entries: usize,
        /// How long they are.
        width: usize,
    },
    /// Numbers left out at random while training.
    Dropout {
        /// The probability of each.
        rate: f64,
        /// The shape of what goes in.
        shape: Vec<usize>,
    },
    /// Numbers left out that were drawn once.
    Mask {
        /// The shape of what goes in.
        shape: Vec<usize>,
    },
    /// A function of every number.
    Curve(Curve),
    /// All numbers of an item as one vector.
    Flatten,
    /// The last step of a sequence.
    Last,
    /// One after the other.
    Sequence(Vec<Module>),
    /// What goes in and what layers make of it, added.
    Residual(Vec<Module>),
}

impl Module {
    /// How many numbers its layers put out for one input of a shape, or
    /// 0 if it does not take it.
    #[must_use]
    pub fn n_outputs(&self, input: &[usize]) -> u64 {
        match self {
            Self::Sequence(layers) | Self::Residual(layers) => {
                let mut shape = input.to_vec();
                let each = layers.iter().map(|layer| {
                    let n = layer.n_outputs(&shape);
                    shape = layer.output(&shape).unwrap_or_default();
                    n
                });
                each.sum()
            }
            layer => layer.output(input).map_or(0, |shape| shape.iter().product::<usize>() as u64),
        }
    }

    /// Whether inputs one after the other are what the first layer takes.
    ///
    /// # Errors
    /// Why not.
    pub fn accepts(&self, xs: &[f64]) -> Result<(), String> {
        match self {
            Self::Embedding { entries, .. } => {
                #[expect(clippy::cast_precision_loss, reason = "entries are few")]
                let whole = |x: &&f64| x.fract() != 0.0 || **x < 0.0 || **x >= *entries as f64;
                match xs.iter().find(whole) {
                    Some(x) => Err(format!("{x} is no index of the {entries} entries")),
                    None => Ok(()),
                }
            }
            Self::Sequence(layers) | Self::Residual(layers) => {
                layers.first().map_or(Ok(()), |layer| layer.accepts(xs))
            }
            _ => Ok(()),
        }
    }

    /// Whether it begins with a recurrent layer, so that it takes sequences.
    #[must_use]
    pub fn takes_steps(&self) -> bool {
        match self {
            Self::Gru { .. } | Self::Lstm { .. } => true,
            Self::Sequence(layers) => layers.first().is_some_and(Self::takes_steps),
            _ => false,
        }
    }

    /// Whether it begins with a layer that takes images only.
    #[must_use]
    pub fn takes_images(&self) -> bool {
        match self {
            Self::Conv { .. }
            | Self::ConvTranspose { .. }
            | Self::MaxPool(_)
            | Self::MeanPool(_)
            | Self::GlobalPool => true,
            Self::Sequence(layers) | Self::Residual(layers) => {
                layers.first().is_some_and(Self::takes_images)
            }
            _ => false,
        }
    }

    /// The largest of its sizes.
    #[must_use]
    pub fn largest(&self) -> usize {
        let of = |window: &Window| window.kernel.max(window.stride).max(window.padding);
        match self {
            Self::Dense { inputs, outputs, .. } => *inputs.max(outputs),
            Self::Conv { inputs, outputs, window, groups, .. } => {
                of(window).max(*inputs).max(*outputs).max(*groups)
            }
            Self::ConvTranspose { inputs, outputs, window, .. } => {
                of(window).max(*inputs).max(*outputs)
            }
            Self::MaxPool(window) | Self::MeanPool(window) => of(window),
            Self::BatchNorm { channels } => *channels,
            Self::LayerNorm { shape } | Self::Dropout { shape, .. } | Self::Mask { shape } => {
                shape.iter().copied().max().unwrap_or(0)
            }
            Self::Gru { inputs, units } | Self::Lstm { inputs, units } => *inputs.max(units),
            Self::Embedding { entries, width } => *entries.max(width),
            Self::Sequence(layers) | Self::Residual(layers) => {
                layers.iter().map(Self::largest).max().unwrap_or(0)
            }
            Self::GlobalPool | Self::Curve(_) | Self::Flatten | Self::Last => 0,
        }
    }

    /// The same network with numbers drawn once in the place of dropout.
    #[must_use]
    pub fn masked(&self) -> Self {
        let all = |layers: &[Self]| layers.iter().map(Self::masked).collect();
        match self {
            Self::Dropout { shape, .. } => Self::Mask { shape: shape.clone() },
            Self::Sequence(layers) => Self::Sequence(all(layers)),
            Self::Residual(layers) => Self::Residual(all(layers)),
            other => other.clone(),
        }
    }

    /// The probabilities of its dropout layers, in order.
    #[must_use]
    pub fn dropout_rates(&self) -> Vec<f64> {
        match self {
            Self::Dropout { rate, .. } => vec![*rate],
            Self::Sequence(layers) | Self::Residual(layers) => {
                layers.iter().flat_map(Self::dropout_rates).collect()
            }
            _ => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests;
