//! A number of a JSON file.

use ivx_data::Outputs;
use ivx_op::{Array, Ctx, One, Op, OpError, declare};
use ivx_table::json;

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
        let number = json::number(bytes, &self.field).map_err(|why| wrong(&self.name, &why))?;
        Ok(Array::scalar(number))
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
    fn numbers_are_read_as_python_reads_them() {
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
