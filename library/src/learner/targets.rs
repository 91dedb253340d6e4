//! What learners of vectors ask of data. Inputs of every shape are vectors of their numbers, in order.

use ivx_data::form::several_classes;
use ivx_data::{Dataset, Form, Misfit};
use ivx_op::OpError;

/// Whether targets are numbers, however many.
pub(super) fn are_numbers(learner: &str, form: &Form) -> Result<(), Misfit> {
    match form.classes {
        None => Ok(()),
        Some(n) => {
            let message =
                format!("`{learner}` learns numbers, and the targets are one of {n} classes");
            Err(Misfit::new(message, "use `logistic`, or another learner of classes"))
        }
    }
}

/// Whether each observation has one class.
pub(super) fn are_classes(learner: &str, form: &Form) -> Result<(), Misfit> {
    if form.classes.is_none() {
        let message = format!("`{learner}` tells classes apart, and the targets are numbers");
        return Err(Misfit::new(message, "use `ridge`, or another learner of numbers"));
    }
    are_numbers_or_classes(learner, form)
}

/// Whether targets are numbers, or each observation has one class.
pub(super) fn are_numbers_or_classes(learner: &str, form: &Form) -> Result<(), Misfit> {
    several_classes(form)?;
    if form.classes.is_none() || form.target.is_empty() {
        return Ok(());
    }
    let message =
        format!("`{learner}` learns one class an observation, and there are {}", form.target_len());
    Err(Misfit::new(message, "use `map_estimate` with a recurrent network for such data"))
}

/// Whether there are data, and all of them are numbers to reckon with.
pub(super) fn are_sound(data: &Dataset) -> Result<(), OpError> {
    if data.is_empty() {
        return Err(OpError::Failed("there are no data to train on".to_owned()));
    }
    for (what, values) in [("input", &data.x), ("target", &data.y)] {
        let width = values.len() / data.len();
        if let Some(i) = values.iter().position(|value| !value.is_finite()) {
            let (row, value) = (i / width.max(1), values[i]);
            let why = format!(
                "the {what} of observation {row} has {value}, which is no number to learn from"
            );
            return Err(OpError::Failed(why));
        }
    }
    Ok(())
}

/// The class of each observation.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "indices of classes")]
pub(super) fn classes(data: &Dataset) -> Vec<usize> {
    data.y.iter().map(|class| *class as usize).collect()
}

/// Targets as numbers, with how many there are: a class as 1 at its place, and 0 at those of the others.
pub(super) fn as_numbers(data: &Dataset) -> (Vec<f64>, usize) {
    let Some(n) = data.form.classes else { return (data.y.clone(), data.form.target_len()) };
    let mut all = vec![0.0; data.len() * n];
    for (row, class) in all.chunks_exact_mut(n).zip(classes(data)) {
        row[class] = 1.0;
    }
    (all, n)
}
