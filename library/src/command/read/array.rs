//! Numbers over dimensions of a file.

use ivx_data::Outputs;
use ivx_op::{Array, Ctx, DimNames, Facts, Fields, One, Op, OpError, Part, Wrong, declare};
use ivx_table::{array, asked_well, separator};

use super::{is_left_behind, output, wrong};

declare! {
    /// The numbers that a program wrote, over dimensions that are named here: learning curves, a confusion matrix, a value
    /// for each state.
    ///
    /// The extension of the file says what it is. Of `.json`, each list and object is a dimension. A table as `.csv` or
    /// `.tsv` is a matrix, or one of its columns; the column that is called as the first dimension labels it. `.npy`,
    /// and `.npz` and `.safetensors`, which may have arrays that are called as dimensions and label them. What is not
    /// finite is read as such. Dimensions have a size once the program has run: what is drawn or selected along them is known then.
    pub struct ReadArray = "read_array" @ 1 -> Array [named dims] {
        /// What `command` left behind.
        outputs: One<Outputs>;
        /// The file's name.
        name: String;
        /// The names of the dimensions, outermost first.
        dims: DimNames;
        /// Which numbers: a place in JSON such as `test.curve`, a column of a table or an array of an archive; by default
        /// all, or the only one.
        field: String = "";
        /// The labels of dimensions, such as `(epoch: [1, 5, 10])`; by default those that the file has, or 0, 1 and so on.
        labels: Fields = Part::default();
        /// What stands between cells of text; by default a comma, in `.tsv` a tab.
        separator: String = "";
        /// Whether the first line of text has names; without, rows and columns are labelled by their places from 0.
        header: bool = true;
    }
    rule is_readable;
}

impl Op for ReadArray {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let bytes = &output(&self.outputs, &self.name)?.bytes[..];
        let DimNames(dims) = &self.dims;
        separator(&self.name, &self.separator)
            .and_then(|separator| {
                let text = (separator, self.header);
                array(&self.name, bytes, text, &self.field, dims, &self.labels.0)
            })
            .map_err(|why| wrong(&self.name, &why))
    }
}

fn is_readable(facts: &Facts<'_>) -> Result<(), Wrong> {
    is_left_behind(facts)?;
    match facts.arg::<String>("name") {
        Some(name) => asked_well(facts, "name", &name),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use ivx_data::Blob;
    use ivx_op::{Dim, Labels};

    use super::*;

    #[test]
    fn a_curve_of_a_program_is_an_array() {
        let text = br#"{"test": {"loss": [0.5, NaN, 0.25]}}"#.to_vec();
        let outputs = Outputs { files: [("o.json".to_owned(), Blob::plain(text))].into() };
        let read = |field: &str| {
            let read = ReadArray {
                outputs: One(outputs.clone()),
                name: "o.json".to_owned(),
                dims: DimNames(vec!["epoch".to_owned()]),
                field: field.to_owned(),
                labels: Fields::default(),
                separator: String::new(),
                header: true,
            };
            read.run(&Ctx::new("read_array", 0, None)).map_err(|error| error.to_string())
        };
        let found = read("test.loss").unwrap();
        assert_eq!(found.dims, [Dim::new("epoch", Labels::count(3))]);
        assert!(found.values[1].is_nan() && found.values[2] == 0.25);
        let why = read("test").unwrap_err();
        assert!(why.starts_with("`o.json` is not as expected: `test.loss` is a list"), "{why}");
    }
}
