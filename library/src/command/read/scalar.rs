//! A number of a JSON file.

use std::collections::BTreeMap;

use ivx_data::Outputs;
use ivx_op::{Array, Ctx, One, Op, OpError, declare, is_rounded, too_large, vanishes};
use serde_json::Value;
use serde_json::value::RawValue;

use super::{is_left_behind, output, wrong};

declare! {
    /// A number of a JSON file that a program wrote, to the bit. What JSON has no numbers for is read as Python writes
    /// it, `NaN`, `Infinity` and `-Infinity`, and in quotes, as `as_file` does. A whole number beyond 2^53 is refused, since it would be rounded.
    pub struct ReadScalar = "read_scalar" @ 2 -> Array {
        /// What `command` left behind.
        outputs: One<Outputs>;
        /// The file's name.
        name: String;
        /// Where the number is: names of fields and places in lists, with dots between, such as
        /// `test.mse` or `folds.0`. By default the file is the number.
        field: String = "";
    }
    rule is_left_behind;
}

impl Op for ReadScalar {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let bytes = &output(&self.outputs, &self.name)?.bytes[..];
        let about = |why: &str| wrong(&self.name, why);
        let (text, places) = quoted(bytes);
        let mut value: &RawValue = serde_json::from_slice(&text)
            .map_err(|error| about(&format!("it is not JSON: {}", told(&error, &text, &places))))?;
        let mut seen = String::new();
        for part in self.field.split('.').filter(|_| !self.field.is_empty()) {
            let place = if seen.is_empty() { "it".to_owned() } else { format!("`{seen}`") };
            value = inner(value, part).ok_or_else(|| {
                about(&format!("{place} is {} and has no `{part}`", described(value)))
            })?;
            seen = if seen.is_empty() { part.to_owned() } else { format!("{seen}.{part}") };
        }
        number(value).map(Array::scalar).map_err(|why| {
            let place = if seen.is_empty() { "it".to_owned() } else { format!("`{seen}`") };
            about(&format!("{place} {why}"))
        })
    }
}

/// What an object or a list has at a place.
fn inner<'a>(value: &'a RawValue, part: &str) -> Option<&'a RawValue> {
    let text = value.get();
    if let Ok(mut fields) = serde_json::from_str::<BTreeMap<String, &RawValue>>(text) {
        return fields.remove(part);
    }
    let items: Vec<&RawValue> = serde_json::from_str(text).ok()?;
    part.parse().ok().and_then(|i: usize| items.get(i).copied())
}

/// The file with quotes around what is not JSON and Python writes for numbers that JSON lacks, and where these are.
fn quoted(bytes: &[u8]) -> (Vec<u8>, Vec<usize>) {
    let mut out = Vec::with_capacity(bytes.len());
    let mut places = Vec::new();
    let mut rest = bytes;
    let mut in_text = false;
    while let [first, after @ ..] = rest {
        let names = [&b"NaN"[..], b"Infinity", b"-Infinity"];
        let name = names.into_iter().find(|name| !in_text && rest.starts_with(name));
        if let Some(name) = name {
            places.extend([out.len(), out.len() + name.len() + 1]);
            out.extend([b"\"", name, b"\""].concat());
            rest = &rest[name.len()..];
            continue;
        }
        out.push(*first);
        rest = after;
        match (first, rest) {
            (b'"', _) => in_text = !in_text,
            (b'\\', [escaped, after @ ..]) if in_text => {
                out.push(*escaped);
                rest = after;
            }
            _ => {}
        }
    }
    (out, places)
}

/// What is wrong and where in the file, which has no quotes at these places.
fn told(error: &serde_json::Error, text: &[u8], places: &[usize]) -> String {
    let (line, column) = (error.line(), error.column());
    let begin: usize = text.split(|byte| *byte == b'\n').take(line - 1).map(|l| l.len() + 1).sum();
    let added = places.iter().filter(|place| (begin..begin + column).contains(place)).count();
    let why = error.to_string();
    let why = why.split(" at line ").next().unwrap_or_default();
    format!("{why} at line {line}, column {}", column - added)
}

/// The number, to the bit; what JSON has no numbers for is a text. A whole number that would be rounded is none.
fn number(value: &RawValue) -> Result<f64, String> {
    let text = value.get();
    match text {
        "\"NaN\"" => return Ok(f64::NAN),
        "\"Infinity\"" | "\"inf\"" => return Ok(f64::INFINITY),
        "\"-Infinity\"" | "\"-inf\"" => return Ok(f64::NEG_INFINITY),
        _ => {}
    }
    let is_number = text.starts_with(|c: char| c == '-' || c.is_ascii_digit());
    match text.parse::<f64>() {
        Ok(_) if is_number && vanishes(text) => {
            Err(format!("holds {text}, which is so small that it would be 0"))
        }
        Ok(_) if is_rounded(text) => Err(too_large(text)),
        Ok(x) if is_number && x.is_finite() => Ok(x),
        Ok(_) if is_number => Err(format!("holds {text}, which is too large for a number")),
        _ => Err(format!("is {} and no number", described(value))),
    }
}

fn described(value: &RawValue) -> String {
    match serde_json::from_str(value.get()).unwrap_or_default() {
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
    use ivx_data::Blob;

    fn read(text: &str, field: &str) -> Result<f64, String> {
        let outputs = Outputs { files: [("s.json".to_owned(), Blob::plain(text.into()))].into() };
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
    fn every_number_comes_back() {
        use super::super::super::input::json_of;
        use super::super::super::npz::tests::random_numbers;
        for x in random_numbers(5_000) {
            let text = String::from_utf8(json_of(&Array::scalar(x))).unwrap();
            let back = read(&text, "").unwrap();
            assert!(back.to_bits() == x.to_bits() || back.is_nan() && x.is_nan(), "{x:e}: {text}");
        }
        // As Python reads them.
        assert_eq!(read("0.9452706955539223", ""), Ok(0.945_270_695_553_922_3));
        assert_eq!(read("2.2250738585072011e-308", ""), Ok(2.225_073_858_507_201e-308));
        assert_eq!(read("9007199254740992", ""), Ok(9_007_199_254_740_992.0));
        assert_eq!(read("9007199254740993.0", ""), Ok(9_007_199_254_740_992.0));
        for whole in ["9007199254740993", "-9007199254740993", "100000000000000000000000"] {
            let why = read(whole, "").unwrap_err();
            assert!(
                why.contains(&format!("it holds {whole}, which is too large to be exact")),
                "{why}"
            );
        }
    }

    #[test]
    fn what_python_writes_is_read() {
        let text = r#"{"NaN": [NaN, -Infinity], "a \"Infinity\\": Infinity, "t": "a NaN"}"#;
        assert!(read(text, "NaN.0").unwrap().is_nan());
        assert_eq!(read(text, "NaN.1"), Ok(f64::NEG_INFINITY));
        assert_eq!(read(text, "a \"Infinity\\"), Ok(f64::INFINITY));
        assert!(read(text, "t").unwrap_err().contains("`t` is text and no number"));
        assert!(read("NaNs", "").unwrap_err().contains("it is not JSON"));
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
        let why = read("{\"a\": 1,\n \"b\": nan}", "b").unwrap_err();
        assert!(why.contains("it is not JSON: expected ident at line 2, column 8"), "{why}");
        let why = read("{\"a\": 1,\n \"b\": [NaN, NaN, 0x1], \"c\": NaN}", "b.0").unwrap_err();
        assert!(why.contains("it is not JSON: expected `,` or `]` at line 2, column 19"), "{why}");
        assert!(read("1 2", "").unwrap_err().contains("it is not JSON"));
        check("1e999", "", "it holds 1e999, which is too large for a number");
        check("-1.5e-400", "", "it holds -1.5e-400, which is so small that it would be 0");
    }
}
