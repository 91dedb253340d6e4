//! Which observations learners and models take, for the checker.

use ivx_op::{Facts, OpError, Shapes, Wrong};

use crate::{Form, Misfit, sizes_told};

/// Whether observations are pairs of numbers, which is all that `what` takes.
///
/// # Errors
/// If not; the misfit says why.
pub fn pairs(what: &str, form: &Form) -> Result<(), Misfit> {
    if form.is_pairs() {
        return Ok(());
    }
    let message = format!("{what} takes pairs of numbers, not {}", told(form));
    Err(Misfit::new(message, "use `map_estimate` with a network for such data"))
}

/// Whether an input is of one shape, with nothing beside it, which is all that one network takes.
///
/// # Errors
/// If not; the misfit says why.
pub fn of_one_shape(form: &Form) -> Result<(), Misfit> {
    if form.beside == 0 {
        return Ok(());
    }
    let message = format!("one network takes inputs of one shape, not {}", told(form));
    Err(Misfit::new(message, "use a learner that sees both, such as `imitative`"))
}

/// `images of 1 × 8 × 8 with 10 classes`.
#[must_use]
pub fn told(form: &Form) -> String {
    let beside = match form.beside {
        0 => String::new(),
        n => format!(" and {n} numbers beside"),
    };
    let input = sizes_told(&form.input) + &beside;
    match form.classes {
        Some(n) if form.target.is_empty() => format!("{input} with {n} classes"),
        Some(n) => {
            let sizes: Vec<String> = form.target.iter().map(usize::to_string).collect();
            format!("{input} with {} targets of {n} classes", sizes.join(" × "))
        }
        None => format!("{input} with {}", sizes_told(&form.target)),
    }
}

/// Whether a model takes data.
///
/// # Errors
/// If not; the misfit says why.
pub fn same(model: &Form, data: &Form) -> Result<(), Misfit> {
    let shapes = |form: &Form| (form.input.clone(), form.beside, form.target.clone(), form.classes);
    if shapes(model) != shapes(data) {
        let message = format!("the model is of {}, and the data are {}", told(model), told(data));
        return Err(Misfit::new(message, "measure it on data as it was trained on"));
    }
    named_alike("inputs", &model.names.inputs, &data.names.inputs)?;
    named_alike("classes", &model.names.classes, &data.names.classes)
}

/// Whether classes, where targets are such, are two at least.
///
/// # Errors
/// If not.
pub fn several_classes(form: &Form) -> Result<(), Misfit> {
    if form.classes.is_none_or(|n| n >= 2) {
        return Ok(());
    }
    let message = "the targets are all of one class, and there is nothing to tell apart";
    Err(Misfit::new(message.to_owned(), "give data of two classes at least"))
}

/// Whether names are the same in the same order, where both sides have some.
fn named_alike(what: &str, model: &[String], data: &[String]) -> Result<(), Misfit> {
    let Some((i, (own, other))) =
        model.iter().zip(data).enumerate().find(|(_, (own, other))| own != other)
    else {
        return Ok(());
    };
    let at = i + 1;
    let message =
        format!("number {at} of the {what} is `{own}` to the model and `{other}` in the data");
    let help = "name them in one order for both files (`inputs`, `classes`), or read both from one";
    Err(Misfit::new(message, help))
}

/// A misfit as the failure of an operation.
#[must_use]
pub fn failed(misfit: Misfit) -> OpError {
    OpError::Failed(misfit.message)
}

/// A misfit as the breach of a rule by an argument.
pub fn wrong(arg: &'static str) -> impl Fn(Misfit) -> Wrong {
    move |Misfit { message, help }| Wrong { arg, message, help }
}

/// What is observed in what a port takes; none if it is not known.
#[must_use]
pub fn form(facts: &Facts<'_>, port: &str) -> Option<Form> {
    Form::of(facts.shapes(port)?)
}

/// What a model is of: the form of the data `on`.
#[must_use]
pub fn form_of_data(facts: &Facts<'_>) -> Option<Shapes> {
    form(facts, "on").map(|form| form.shapes())
}

/// The rule that `model` is a function of one number.
///
/// # Errors
/// If not; the misfit says why.
pub fn model_of_pairs(facts: &Facts<'_>) -> Result<(), Wrong> {
    form(facts, "model").map_or(Ok(()), |form| of_numbers(&form).map_err(wrong("model")))
}

/// The rule that the data `on` are pairs of numbers.
///
/// # Errors
/// If not; the misfit says why.
pub fn data_of_pairs(facts: &Facts<'_>) -> Result<(), Wrong> {
    form(facts, "on").map_or(Ok(()), |form| pairs("this operation", &form).map_err(wrong("on")))
}

/// The rule that `model` was trained on data such as `on`.
///
/// # Errors
/// If not; the misfit says why.
pub fn model_of_data(facts: &Facts<'_>) -> Result<(), Wrong> {
    match (form(facts, "model"), form(facts, "on")) {
        (Some(model), Some(data)) => same(&model, &data).map_err(wrong("on")),
        _ => Ok(()),
    }
}

/// Whether a model is a function of one number.
///
/// # Errors
/// If not; the misfit says why.
pub fn of_numbers(form: &Form) -> Result<(), Misfit> {
    if form.is_pairs() {
        return Ok(());
    }
    let message =
        format!("this operation takes a model of numbers, and it is one of {}", told(form));
    Err(Misfit::new(message, "use `accuracy` or `rmse`, which take data of any shape"))
}
