//! Whether a model says how far off it may be.

use ivx_data::Misfit;
use ivx_op::Shapes;

/// What the checker calls the standard deviation that a model says.
const STD: &str = "std";

/// The shapes of a model, and that it says a standard deviation, if it does.
pub(crate) fn with_std(mut shapes: Shapes, says: bool) -> Shapes {
    if says && !shapes.contains_key("classes") {
        shapes.insert(STD.to_owned(), Vec::new());
    }
    shapes
}

/// Whether a model of these shapes says a standard deviation.
///
/// # Errors
/// If not.
pub(crate) fn says_std(model: &Shapes) -> Result<(), Misfit> {
    if model.contains_key(STD) { Ok(()) } else { Err(silent()) }
}

/// The standard deviations of a model.
///
/// # Errors
/// If it says none.
pub(crate) fn stds(model: &ivx_nn::Model, xs: &[f64]) -> Result<Vec<f64>, Misfit> {
    model.stds(xs).ok_or_else(silent)
}

fn silent() -> Misfit {
    let message = "the model says no standard deviation".to_owned();
    let help = "train a network under `loss: gaussian_nll()`, or take the `mixture` of an ensemble, \
                whose members differ";
    Misfit::new(message, help)
}
