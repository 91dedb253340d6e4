//! A number of a JSON file.

use ivx_op::{Array, Ctx, One, Op, OpError, declare};
use serde_json::Value;

use super::{output, wrong};
use crate::artifact::Outputs;

declare! {
    /// A number of a JSON file that a program wrote.
    pub struct ReadScalar = "read_scalar" @ 1 -> Array {
        /// What `command` left behind.
        outputs: One<Outputs>;
        /// The file's name.
        name: String;
        /// Where the number is: names of fields and places in lists, with dots between, such as
        /// `test.mse` or `folds.0`. By default the file is the number.
        field: String = "";
    }
}

impl Op for ReadScalar {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let bytes = output(&self.outputs, &self.name)?;
        let about = |why: &str| wrong(&self.name, why);
        let whole: Value = serde_json::from_slice(bytes)
            .map_err(|error| about(&format!("it is not JSON: {error}")))?;
        let mut value = &whole;
        let mut seen = String::new();
        for part in self.field.split('.').filter(|_| !self.field.is_empty()) {
            let inner = match value {
                Value::Object(fields) => fields.get(part),
                Value::Array(items) => part.parse().ok().and_then(|i: usize| items.get(i)),
                _ => None,
            };
            let place = if seen.is_empty() { "it".to_owned() } else { format!("`{seen}`") };
            value = inner.ok_or_else(|| {
                about(&format!("{place} is {} and has no `{part}`", described(value)))
            })?;
            seen = if seen.is_empty() { part.to_owned() } else { format!("{seen}.{part}") };
        }
        let number = value.as_f64().filter(|x| x.is_finite());
        number.map(Array::scalar).ok_or_else(|| {
            let place = if seen.is_empty() { "it".to_owned() } else { format!("`{seen}`") };
            about(&format!("{place} is {} and no number", described(value)))
        })
    }
}

fn described(value: &Value) -> String {
    match value {
        Value::Null => "null".to_owned(),
        Value::Bool(_) => "true or false".to_owned(),
        Value::Number(_) => "a number".to_owned(),
        Value::String(_) => "text".to_owned(),
        Value::Array(items) => format!("a list of {}", items.len()),
        Value::Object(fields) => {
            let names: Vec<&str> = fields.keys().take(8).map(String::as_str).collect();
            format!("an object of {}", names.join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, field: &str) -> Result<f64, String> {
        let outputs = Outputs { files: [("s.json".to_owned(), text.into())].into() };
        let (outputs, name) = (One(outputs), "s.json".to_owned());
        let read = ReadScalar { outputs, name, field: field.to_owned() };
        let array = read.run(&Ctx::new("read_scalar", 0, None)).map_err(|e| e.to_string())?;
        Ok(array.values[0])
    }

    #[test]
    fn a_number_is_found_by_its_path() {
        assert_eq!(read(" 0.1\n", ""), Ok(0.1));
        assert_eq!(read(r#"{"test": {"mse": -3}, "folds": [1, 2.5]}"#, "test.mse"), Ok(-3.0));
        assert_eq!(read(r#"{"test": {"mse": -3}, "folds": [1, 2.5]}"#, "folds.1"), Ok(2.5));
    }

    #[test]
    fn what_is_there_instead_is_told() {
        let check = |text: &str, field: &str, expected: &str| {
            let why = read(text, field).unwrap_err();
            assert_eq!(why, format!("`s.json` is not as expected: {expected}"));
        };
        check(r#"{"a": 1, "b": 2}"#, "c", "it is an object of a, b and has no `c`");
        check(r#"{"a": [1]}"#, "a.1", "`a` is a list of 1 and has no `1`");
        check(r#"{"a": "1"}"#, "a", "`a` is text and no number");
        check("true", "", "it is true or false and no number");
        assert!(read("NaN", "").unwrap_err().contains("it is not JSON"));
        assert!(read("1 2", "").unwrap_err().contains("it is not JSON"));
        assert!(read("1e999", "").is_err());
    }
}
