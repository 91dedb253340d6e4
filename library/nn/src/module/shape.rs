//! Which shapes layers take, and what comes out.

use ivx_data::{Misfit, sizes_told};

use super::Module;
use crate::ops::Window;

impl Module {
    /// The shape that comes out where this goes in.
    ///
    /// # Errors
    /// Why it cannot go in.
    pub fn output(&self, input: &[usize]) -> Result<Vec<usize>, Misfit> {
        match self {
            Self::Dense { inputs, outputs, .. } => {
                let (steps, length) = vectors("`dense`", input)?;
                expect(length, *inputs, "numbers")?;
                Ok(steps.into_iter().chain([*outputs]).collect())
            }
            Self::Conv { inputs, outputs, window, groups, .. } => {
                let [channels, rows, cols] = image("`conv`", input)?;
                expect(channels, *inputs, "channels")?;
                whole_groups(*inputs, *outputs, *groups)?;
                placed([*outputs, rows, cols], *window, input)
            }
            Self::ConvTranspose { inputs, outputs, window, .. } => {
                let [channels, rows, cols] = image("`conv_transpose`", input)?;
                expect(channels, *inputs, "channels")?;
                grown([*outputs, rows, cols], *window, input)
            }
            Self::MaxPool(window) | Self::MeanPool(window) => {
                if 2 * window.padding > window.kernel {
                    let message = format!(
                        "a window of {} may lie wholly in a padding of {}",
                        window.kernel, window.padding
                    );
                    return Err(Misfit::new(message, "pad by half the window at most"));
                }
                placed(image("pooling", input)?, *window, input)
            }
            Self::GlobalPool => {
                let [channels, rows, cols] = image("`global_pool`", input)?;
                if rows != cols {
                    let message =
                        format!("`global_pool` takes square images, not {}", sizes_told(input));
                    return Err(Misfit::new(message, "use `flatten()`"));
                }
                Ok(vec![channels])
            }
            Self::BatchNorm { channels } => {
                if let [found] | [found, _, _] = input {
                    expect(*found, *channels, "channels")?;
                    return Ok(input.to_vec());
                }
                let message =
                    format!("`batch_norm` takes vectors and images, not {}", sizes_told(input));
                Err(Misfit::new(message, "use `layer_norm()`"))
            }
            Self::LayerNorm { shape } | Self::Dropout { shape, .. } | Self::Mask { shape } => {
                if shape != input {
                    let message =
                        format!("a layer for {} takes no {}", sizes_told(shape), sizes_told(input));
                    return Err(Misfit::new(message, "train on such data"));
                }
                Ok(input.to_vec())
            }
            Self::Gru { inputs, units } | Self::Lstm { inputs, units } => {
                let [steps, length] = input else {
                    let message = format!(
                        "a recurrent layer takes sequences of steps × length, not {}",
                        sizes_told(input)
                    );
                    return Err(Misfit::new(message, "use `dense` layers, or data with steps"));
                };
                expect(*length, *inputs, "numbers a step")?;
                Ok(vec![*steps, *units])
            }
            Self::Embedding { width, .. } => match input {
                [] => Ok(vec![*width]),
                [steps] => Ok(vec![*steps, *width]),
                _ => {
                    let message = format!(
                        "`embedding` takes an index or a list of indices, not {}",
                        sizes_told(input)
                    );
                    Err(Misfit::new(message, "put it first"))
                }
            },
            Self::Curve(_) => Ok(input.to_vec()),
            Self::Flatten => Ok(vec![input.iter().product()]),
            Self::Last => {
                if let [_, length] = input {
                    return Ok(vec![*length]);
                }
                let message = format!("`last` takes sequences, not {}", sizes_told(input));
                Err(Misfit::new(message, "leave it out"))
            }
            Self::Sequence(layers) => through(layers, input),
            Self::Residual(layers) => {
                let output = through(layers, input)?;
                if output != input {
                    let message = format!(
                        "a residual block adds {} to {}",
                        sizes_told(&output),
                        sizes_told(input)
                    );
                    let help = "let its layers keep the shape, by padding and as many channels";
                    return Err(Misfit::new(message, help));
                }
                Ok(output)
            }
        }
    }
}

/// What comes out of layers one after the other.
fn through(layers: &[Module], input: &[usize]) -> Result<Vec<usize>, Misfit> {
    layers.iter().try_fold(input.to_vec(), |shape, layer| layer.output(&shape))
}

/// The steps of a sequence, if it is one, and the length of its vectors.
pub(crate) fn vectors(what: &str, shape: &[usize]) -> Result<(Option<usize>, usize), Misfit> {
    match shape {
        [] => Ok((None, 1)),
        [length] => Ok((None, *length)),
        [steps, length] => Ok((Some(*steps), *length)),
        _ => {
            let message = format!("{what} takes vectors and sequences, not {}", sizes_told(shape));
            Err(Misfit::new(message, "put `flatten()` or `global_pool()` before it"))
        }
    }
}

/// Channels, rows and columns.
pub(crate) fn image(what: &str, shape: &[usize]) -> Result<[usize; 3], Misfit> {
    <[usize; 3]>::try_from(shape).map_err(|_| {
        let message =
            format!("{what} takes images of channels × rows × columns, not {}", sizes_told(shape));
        Misfit::new(message, "use `mlp` or `dense`, or data that are images")
    })
}

fn expect(found: usize, wanted: usize, what: &str) -> Result<(), Misfit> {
    if found == wanted {
        return Ok(());
    }
    let message = format!("a layer for {wanted} {what} takes no {found}");
    Err(Misfit::new(message, "train on such data"))
}

/// The shape of the places of a window on an image.
fn placed(
    [channels, rows, cols]: [usize; 3],
    window: Window,
    input: &[usize],
) -> Result<Vec<usize>, Misfit> {
    if window.stride == 0 || window.kernel == 0 {
        return Err(Misfit::new("a window has a size and moves".to_owned(), "use 1 or more"));
    }
    let (rows, cols) = (window.places(rows), window.places(cols));
    if rows == 0 || cols == 0 {
        let message = format!(
            "a window of {0} × {0} does not fit into {1}",
            window.kernel,
            sizes_told(input)
        );
        return Err(Misfit::new(
            message,
            "use a smaller kernel, a smaller stride before it, or padding",
        ));
    }
    Ok(vec![channels, rows, cols])
}

/// The shape that a window spreads an image over.
fn grown(
    [channels, rows, cols]: [usize; 3],
    window: Window,
    input: &[usize],
) -> Result<Vec<usize>, Misfit> {
    let grown = |len: usize| {
        let whole = len.checked_sub(1)? * window.stride + window.kernel;
        whole.checked_sub(2 * window.padding).filter(|len| *len > 0)
    };
    if let (Some(rows), Some(cols)) = (grown(rows), grown(cols)) {
        return Ok(vec![channels, rows, cols]);
    }
    let message = format!("nothing is left of {} inside the padding", sizes_told(input));
    Err(Misfit::new(message, "pad less"))
}

fn whole_groups(inputs: usize, outputs: usize, groups: usize) -> Result<(), Misfit> {
    if groups > 0 && inputs.is_multiple_of(groups) && outputs.is_multiple_of(groups) {
        return Ok(());
    }
    let message =
        format!("{inputs} channels in and {outputs} out do not make {groups} equal groups");
    Err(Misfit::new(message, "choose `groups` that divides both"))
}
