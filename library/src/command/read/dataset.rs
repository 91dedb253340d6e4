//! The data set of a file.

use ivx_data::{Dataset, Form, Outputs};
use ivx_op::{Ctx, Facts, One, Op, OpError, Part, Shapes, Wrong, declare};
use ivx_table::{Choice, Classes, Format, Missing, TABLES, dataset, separator};

use super::{is_left_behind, output, wrong};

declare! {
    /// The data set that a program wrote: inputs and targets.
    ///
    /// The extension of the file says what it is: `.csv` with the names of columns in the first line, `.tsv`, or `.npz` or
    /// `.safetensors` with arrays whose first dimension counts the observations. Inputs are numbers, vectors, sequences
    /// of `[steps, length]` or images of `[channels, rows, columns]`; targets are numbers, vectors or sequences. Several
    /// columns are a vector.
    pub struct ReadDataset = "read_dataset" @ 5 -> Dataset {
        /// What `command` left behind.
        outputs: One<Outputs>;
        /// The file's name.
        name: String;
        /// How many classes there are, where targets are indices of classes from 0 up; 0 where they are
        /// numbers.
        classes: usize = 0, in 0.0..=1e6;
        /// The column or array that is a target.
        target: String = "y";
        /// Several such, side by side, in the place of `target`.
        targets: Vec<String> = Vec::<i64>::new();
        /// Those that are inputs; by default all that are no targets.
        inputs: Vec<String> = Vec::<i64>::new();
        /// What becomes of rows in which something is missing.
        missing: Box<dyn Missing> = Part::new("refused");
        /// What stands between cells of text; by default a comma, in `.tsv` a tab.
        separator: String = "";
    }
    rule is_readable;
    shapes observations;
}

impl Op for ReadDataset {
    fn run(&self, _: &Ctx) -> Result<Dataset, OpError> {
        let bytes = &output(&self.outputs, &self.name)?.bytes[..];
        let choice = Choice {
            except: Vec::new(),
            inputs: self.inputs.clone(),
            targets: match &self.targets[..] {
                [] => vec![self.target.clone()],
                several => several.to_vec(),
            },
            one_hot: Vec::new(),
            categories: std::collections::BTreeMap::new(),
            classes: match self.classes {
                0 => Classes::None,
                n => Classes::Indices(n),
            },
            gaps: self.missing.gaps(),
        };
        separator(&self.name, &self.separator)
            .and_then(|separator| dataset(&self.name, bytes, (separator, true), &choice))
            .map_err(|why| wrong(&self.name, &why))
    }
}

fn is_readable(facts: &Facts<'_>) -> Result<(), Wrong> {
    is_left_behind(facts)?;
    let own = facts.arg::<String>("separator").zip(facts.arg::<String>("name"));
    if let Some(Err(message)) = own.map(|(own, name)| separator(&name, &own)) {
        let help = "write one character, such as `\";\"` or `\"\\t\"`".to_owned();
        return Err(Wrong { arg: "separator", message, help });
    }
    match facts.arg::<String>("name") {
        Some(name) if Format::of(&name).is_none() => {
            let message = format!("`{name}` does not say how it is written");
            let help = format!("a data set's name ends in {TABLES}");
            Err(Wrong { arg: "name", message, help })
        }
        _ => Ok(()),
    }
}

/// Of text, what is named is a number each; arrays have shapes of their own.
fn observations(facts: &Facts<'_>) -> Option<Shapes> {
    let (inputs, targets) =
        (facts.arg::<Vec<String>>("inputs")?, facts.arg::<Vec<String>>("targets")?);
    let is_text = Format::of(&facts.arg::<String>("name")?) == Some(Format::Text);
    let side = |n: usize| if n <= 1 { Vec::new() } else { vec![n] };
    let classes = facts.arg::<usize>("classes").filter(|n| *n > 0);
    let form =
        Form { input: side(inputs.len()), target: side(targets.len()), classes, ..Form::default() };
    (is_text && !inputs.is_empty()).then(|| form.shapes())
}

#[cfg(test)]
mod tests {
    use ivx_data::Blob;
    use ivx_op::Artifact as _;
    use ivx_table::{npz, text};

    use super::*;

    fn read(name: &str, bytes: &[u8]) -> Result<Dataset, String> {
        read_as(name, bytes, 0)
    }

    fn read_as(name: &str, bytes: &[u8], classes: usize) -> Result<Dataset, String> {
        let outputs = Outputs { files: [(name.to_owned(), Blob::plain(bytes.to_vec()))].into() };
        let read = ReadDataset {
            outputs: One(outputs),
            name: name.to_owned(),
            classes,
            target: "y".to_owned(),
            targets: Vec::new(),
            inputs: Vec::new(),
            missing: Box::new(ivx_table::Refused {}),
            separator: String::new(),
        };
        read.run(&Ctx::new("read_dataset", 0, None)).map_err(|error| error.to_string())
    }

    #[test]
    fn every_way_of_writing_it_is_read() {
        let data = Dataset::pairs(vec![0.1, -2.0], vec![1e-9, 3.0]);
        let columns = [("x", data.x.as_slice()), ("y", &data.y)];
        assert_eq!(read("d.csv", &text::write(&columns)).as_ref(), Ok(&data));
        let arrays = columns.map(|(name, values)| (name, &[2][..], values));
        assert_eq!(read("d.npz", &npz::write(&arrays)).as_ref(), Ok(&data));
        let arrays = columns.map(|(name, values)| (name, &[2, 1][..], values));
        assert_eq!(read("d.npz", &npz::write(&arrays)).as_ref(), Ok(&data));
        assert_eq!(read("d.safetensors", &data.encode()).as_ref(), Ok(&data));
    }

    #[test]
    fn several_columns_are_a_vector() {
        let data = read("d.csv", b"x0,x1,y\n1,2,3\n2,3,4\n3,4,9\n").unwrap();
        let form = Form { input: vec![2], ..Form::default() };
        assert!(ivx_data::form::same(&form, &data.form).is_ok());
        assert_eq!((&data.x[..2], data.y), (&[1.0, 2.0][..], vec![3.0, 4.0, 9.0]));
    }

    #[test]
    fn images_of_classes_keep_their_shape() {
        let form =
            Form { input: vec![1, 2, 3], target: vec![], classes: Some(3), ..Form::default() };
        let x = (0..12).map(f64::from).collect();
        let data = Dataset { form, x, y: vec![2.0, 0.0] };
        let file = npz::write(&[("x", &[2, 1, 2, 3], &data.x), ("y", &[2], &data.y)]);
        assert_eq!(read_as("d.npz", &file, 3).as_ref(), Ok(&data));
        assert_eq!(read_as("d.safetensors", &data.encode(), 3).as_ref(), Ok(&data));
        let why = read_as("d.npz", &file, 2).unwrap_err();
        assert!(why.contains("2 is no index of 2 classes"), "{why}");
    }

    #[test]
    fn what_is_there_instead_is_told() {
        let check = |name: &str, bytes: &[u8], expected: &str| {
            assert_eq!(read(name, bytes), Err(format!("`{name}` is not as expected: {expected}")));
        };
        check("d.txt", b"", &format!("its name ends in {TABLES}"));
        check("d.csv", b"x,z\n1,2\n", "it has no column `y`; it has `x`, `z`");
        check(
            "d.csv",
            b"x,y\n1,NaN\n",
            "line 2, column `y`: `NaN` is not a number: leave such rows out, or say what is done with them by `missing:`",
        );
        check("d.npz", b"PK", "it is no zip archive, or a damaged one");
        let uneven = npz::write(&[("x", &[1], &[1.0]), ("y", &[2], &[1.0, 2.0])]);
        check("d.npz", &uneven, "there are 1 of `x` and 2 of `y`");
        assert!(read("d.safetensors", b"{}").is_err());
    }
}
