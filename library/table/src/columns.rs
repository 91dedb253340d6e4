//! Columns of data as arrays.

use ivx_data::{Dataset, Form, Misfit, form};
use ivx_op::{Array, Ctx, Dim, Facts, Labels, One, Op, OpError, Wrong, declare};

declare! {
    /// One target of each observation: a number, or the index of a class.
    pub struct Targets = "targets" @ 1 -> Array [row] {
        /// The data.
        data: One<Dataset>;
        /// Which of several targets, from 0.
        column: usize = 0, in 0.0..;
    }
    rule is_a_target;
}

declare! {
    /// One number of the input of each observation.
    pub struct Inputs = "inputs" @ 1 -> Array [row] {
        /// The data.
        data: One<Dataset>;
        /// Which of several numbers, from 0.
        column: usize = 0, in 0.0..;
    }
    rule is_an_input;
}

/// Whether data have a column.
fn has(what: &str, width: usize, column: usize) -> Result<(), Misfit> {
    if column < width {
        return Ok(());
    }
    let message = format!("`column` is {column}, and {what} {width}, from 0 on");
    Err(Misfit::new(message, "choose one that there is"))
}

fn target(form: &Form, column: usize) -> Result<(), Misfit> {
    has("the targets of an observation are", form.target_len(), column)
}

fn input(form: &Form, column: usize) -> Result<(), Misfit> {
    has("the numbers of an input are", form.input_len(), column)
}

fn is_a_target(facts: &Facts<'_>) -> Result<(), Wrong> {
    fits(facts, target, Form::target_len)
}

fn is_an_input(facts: &Facts<'_>) -> Result<(), Wrong> {
    fits(facts, input, Form::input_len)
}

fn fits(
    facts: &Facts<'_>,
    has: impl Fn(&Form, usize) -> Result<(), Misfit>,
    width: impl Fn(&Form) -> usize,
) -> Result<(), Wrong> {
    let Some(form) = form::form(facts, "data") else { return Ok(()) };
    if width(&form) > 1 && !facts.is_given("column") {
        let message = format!("there are {} for each observation", width(&form));
        let help = "say which: `column: 0`".to_owned();
        return Err(Wrong { arg: "data", message, help });
    }
    let column = facts.arg("column").unwrap_or_default();
    has(&form, column).map_err(form::wrong("column"))
}

fn column(data: &Dataset, values: &[f64], (width, column): (usize, usize)) -> Array {
    let values = values.iter().skip(column).step_by(width).copied().collect();
    Array::series(Dim::new("row", Labels::count(data.len())), values)
}

impl Op for Targets {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        target(&self.data.form, self.column).map_err(form::failed)?;
        Ok(column(&self.data, &self.data.y, (self.data.form.target_len(), self.column)))
    }
}

impl Op for Inputs {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        input(&self.data.form, self.column).map_err(form::failed)?;
        Ok(column(&self.data, &self.data.x, (self.data.form.input_len(), self.column)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_by_hand() {
        let form = Form { input: vec![2], ..Form::default() };
        let data =
            || One(Dataset { form: form.clone(), x: vec![1.0, 2.0, 3.0, 4.0], y: vec![5.0, 6.0] });
        let ctx = Ctx::new("inputs", 0, None);
        assert_eq!(Inputs { data: data(), column: 1 }.run(&ctx).unwrap().values, [2.0, 4.0]);
        assert_eq!(Targets { data: data(), column: 0 }.run(&ctx).unwrap().values, [5.0, 6.0]);
        let why = Inputs { data: data(), column: 2 }.run(&ctx).unwrap_err().to_string();
        assert_eq!(why, "`column` is 2, and the numbers of an input are 2, from 0 on");
        assert!(Targets { data: data(), column: 1 }.run(&ctx).is_err());
    }
}
