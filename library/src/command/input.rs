//! What was computed before, as files.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_data::{Blob, Dataset};
use ivx_op::escape::json_name;
use ivx_op::{AnyArtifact, Array, Artifact, Labels, One, OpError, Parts, declare, family, kind_of};
use ivx_table::{npz, text};
use serde_json::{Value, json};

/// A file that a program is given.
pub trait Input: Debug + Send + Sync {
    /// Its name in the working folder, and it itself.
    ///
    /// # Errors
    /// If what it is made of cannot be written so.
    fn write(&self) -> Result<(String, Blob), OpError>;
}

declare! {
    /// Something computed as a file, written as the extension of its name says.
    ///
    /// - `.csv`: a `Dataset`, with the columns `x` and `y`; of vectors `x0`, `x1` and so on, last dimension fastest.
    /// - `.npz`: a `Dataset`, with the arrays `x` and `y`.
    /// - `.json`: a number, or an array as `dims` and `values`, last dimension fastest. What is not finite is
    ///   one of the texts `"NaN"`, `"Infinity"` and `"-Infinity"`.
    /// - `.safetensors`: a `Dataset`, a `Model` or anything else but a `File`.
    /// - Any: a `File`, as it is; one that may be executed still may.
    pub struct AsFile = "as_file" @ 3 {
        /// What was computed, or a number.
        value: One<AnyArtifact>;
        /// Its name in the working folder.
        name: String;
    }
}

impl Input for AsFile {
    fn write(&self) -> Result<(String, Blob), OpError> {
        let AnyArtifact(bytes) = &self.value.0;
        let kind = kind_of(bytes).unwrap_or_default();
        let extension = self.name.rsplit_once('.').map_or("", |(_, extension)| extension);
        let read = |what: &str| OpError::Failed(format!("the {what} does not decode"));
        if kind == Blob::KIND {
            let file = Blob::decode(bytes).ok_or_else(|| read(&kind))?;
            return Ok((self.name.clone(), file));
        }
        let bytes = match (kind.as_str(), extension) {
            (_, "safetensors") => bytes.clone(),
            (Dataset::KIND, "csv" | "npz") => {
                let data = Dataset::decode(bytes).ok_or_else(|| read(&kind))?;
                if extension == "csv" {
                    csv_of(&data)
                } else {
                    let of = |item: &[usize]| [&[data.len()], item].concat();
                    let (x, y) = (of(&columns_of(&data)), of(&data.form.target));
                    npz::write(&[("x", &x, &data.x), ("y", &y, &data.y)])
                }
            }
            (Array::KIND, "json") => json_of(&Array::decode(bytes).ok_or_else(|| read(&kind))?),
            _ => {
                let found = if kind == Array::KIND { "a number or an array" } else { &kind };
                let how = match kind.as_str() {
                    Array::KIND => "`.json` or `.safetensors`",
                    Dataset::KIND => "`.csv`, `.npz` or `.safetensors`",
                    _ => "`.safetensors`",
                };
                let why =
                    format!("{found} is not written as {:?}; end its name in {how}", self.name);
                return Err(OpError::Failed(why));
            }
        };
        Ok((self.name.clone(), Blob::plain(bytes)))
    }
}

/// The shape of an input as it is written: with numbers beside it, it is a vector of all.
fn columns_of(data: &Dataset) -> Vec<usize> {
    match data.form.beside {
        0 => data.form.input.clone(),
        _ => vec![data.form.input_len()],
    }
}

/// A column for each number of an input and target: `x`, or of vectors `x0`, `x1` and so on.
fn csv_of(data: &Dataset) -> Vec<u8> {
    let columns = |name: &str, item: &[usize], all: &[f64]| -> Vec<(String, Vec<f64>)> {
        if item.is_empty() {
            return vec![(name.to_owned(), all.to_vec())];
        }
        let width = item.iter().product();
        let column = |i: usize| all.iter().skip(i).step_by(width).copied().collect();
        (0..width).map(|i| (format!("{name}{i}"), column(i))).collect()
    };
    let mut all = columns("x", &columns_of(data), &data.x);
    all.extend(columns("y", &data.form.target, &data.y));
    let all: Vec<(&str, &[f64])> = all.iter().map(|(name, all)| (&**name, &**all)).collect();
    text::write(&all)
}

pub(super) fn json_of(array: &Array) -> Vec<u8> {
    let number = |x: &f64| json_name(*x).map_or_else(|| json!(x), |name| json!(name));
    let value = if array.dims.is_empty() {
        number(&array.values[0])
    } else {
        let dims = array.dims.iter().map(|dim| {
            let labels = match &dim.labels {
                Labels::Numbers(numbers) => json!(numbers),
                Labels::Names(names) => json!(names),
            };
            json!({ "name": dim.name, "labels": labels })
        });
        json!({ "dims": dims.collect::<Vec<Value>>(), "values": array.values.iter().map(number).collect::<Vec<Value>>() })
    };
    value.to_string().into_bytes()
}

/// The inputs, by name.
pub(super) fn inputs() -> &'static Parts<dyn Input> {
    static TABLE: LazyLock<Parts<dyn Input>> =
        LazyLock::new(|| Parts::<dyn Input>::new().with(|x: AsFile| Box::new(x)));
    &TABLE
}

family!(dyn Input, "Input", inputs);

#[cfg(test)]
mod tests {
    use ivx_data::Form;
    use ivx_op::Dim;

    use super::*;
    use ivx_nn::Model;

    fn written(value: &impl Artifact, name: &str) -> Result<Vec<u8>, String> {
        let file = AsFile { value: One(AnyArtifact(value.encode())), name: name.to_owned() };
        file.write().map(|(_, file)| file.bytes).map_err(|error| error.to_string())
    }

    #[test]
    fn the_extension_says_how() {
        let data = Dataset::pairs(vec![0.1, -2.0], vec![1e-9, 3.0]);
        assert_eq!(written(&data, "a.csv").unwrap(), b"x,y\n0.1,1e-9\n-2.0,3.0\n");
        assert_eq!(written(&data, "a.safetensors").unwrap(), data.encode());
        let form = Form { input: vec![2, 1], target: vec![1], classes: None, ..Form::default() };
        let vectors = Dataset { form, x: vec![1.0, 2.0, 3.0, 4.0], y: vec![5.0, 6.0] };
        let expected = b"x0,x1,y0\n1.0,2.0,5.0\n3.0,4.0,6.0\n";
        assert_eq!(written(&vectors, "a.csv").unwrap(), expected);
        assert_eq!(written(&Array::scalar(0.1), "a.json").unwrap(), b"0.1");
        let names = Labels::Names(vec!["u".to_owned(), "v".to_owned()]);
        let array = Array::series(Dim::new("k", names), vec![1.0, 2.5]);
        let expected = r#"{"dims":[{"labels":["u","v"],"name":"k"}],"values":[1.0,2.5]}"#;
        assert_eq!(String::from_utf8(written(&array, "a.json").unwrap()).unwrap(), expected);
        assert_eq!(written(&Blob::plain(b"b".to_vec()), "any.thing").unwrap(), b"b");
    }

    #[test]
    fn what_does_not_fit_is_told() {
        let why = written(&Model::Polynomial(vec![1.0]), "model.csv").unwrap_err();
        assert_eq!(why, "Model is not written as \"model.csv\"; end its name in `.safetensors`");
        assert!(written(&Array::scalar(1.0), "a").unwrap_err().contains("`.json`"));
        assert_eq!(written(&Array::scalar(-f64::INFINITY), "a.json").unwrap(), b"\"-Infinity\"");
    }
}
