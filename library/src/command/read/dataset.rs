//! Pairs of numbers of a file.

use std::collections::BTreeMap;

use ivx_data::{Dataset, Form, Outputs};
use ivx_op::{Ctx, Data, Facts, One, Op, OpError, Wrong, declare, read_tensors};

use super::super::{csv, npz};
use super::{Columns, is_left_behind, output, wrong};

declare! {
    /// The data set that a program wrote: inputs `x` and targets `y`.
    ///
    /// The extension of the file says what it is: `.csv` with the columns `x,y` and their names in
    /// the first line, or `.npz` or `.safetensors` with the arrays `x` and `y`, whose first dimension
    /// counts the observations. Inputs are numbers, vectors, sequences of `[steps, length]` or images of
    /// `[channels, rows, columns]`; targets are numbers, vectors or sequences.
    pub struct ReadDataset = "read_dataset" @ 3 -> Dataset {
        /// What `command` left behind.
        outputs: One<Outputs>;
        /// The file's name.
        name: String;
        /// How many classes there are, where targets are indices of classes from 0 up; 0 where they are
        /// numbers.
        classes: usize = 0, in 0.0..=1e6;
    }
    rule is_readable;
}

impl Op for ReadDataset {
    fn run(&self, _: &Ctx) -> Result<Dataset, OpError> {
        let bytes = &output(&self.outputs, &self.name)?.bytes[..];
        let columns = match extension(&self.name) {
            "csv" => csv::read(bytes),
            "npz" => npz::read(bytes),
            "safetensors" => tensors(bytes),
            _ => Err(FORMATS.to_owned()),
        };
        columns
            .and_then(|columns| dataset(columns, self.classes))
            .map_err(|why| wrong(&self.name, &why))
    }
}

/// What this reads.
const FORMATS: &str = "its name ends in `.csv`, `.npz` or `.safetensors`";

fn extension(name: &str) -> &str {
    name.rsplit_once('.').map_or("", |(_, extension)| extension)
}

fn is_readable(facts: &Facts<'_>) -> Result<(), Wrong> {
    is_left_behind(facts)?;
    match facts.arg::<String>("name") {
        Some(name) if !["csv", "npz", "safetensors"].contains(&extension(&name)) => {
            let message = format!("`{name}` does not say how it is written");
            let help = "a data set's name ends in `.csv`, `.npz` or `.safetensors`".to_owned();
            Err(Wrong { arg: "name", message, help })
        }
        _ => Ok(()),
    }
}

fn dataset(mut columns: Columns, classes: usize) -> Result<Dataset, String> {
    if !columns.keys().eq(["x", "y"]) {
        let names: Vec<String> = columns.keys().map(|name| format!("`{name}`")).collect();
        let found = format!("it has {}, and a data set has `x` and `y` alone", names.join(", "));
        return Err(match names.len() {
            0..=2 => format!("{found}: call them so"),
            _ => format!(
                "{found}: several inputs or targets are one array `x` or `y` of an `.npz`, with a row an observation"
            ),
        });
    }
    let mut column = |name: &str, most: usize| {
        let (shape, values) = columns.remove(name).expect("it is there");
        match shape.split_first() {
            // A column of a matrix is one number an observation.
            Some((&n, [1])) => Ok((n, Vec::new(), values)),
            Some((&n, item)) if item.len() <= most && !item.contains(&0) => {
                Ok((n, item.to_vec(), values))
            }
            _ => Err(format!("`{name}` is an array a data set has, and not {shape:?}")),
        }
    };
    let ((n, input, x), (m, target, y)) = (column("x", 3)?, column("y", 2)?);
    if n != m {
        return Err(format!("there are {n} of `x` and {m} of `y`"));
    }
    for (name, values) in [("x", &x), ("y", &y)] {
        if let Some(i) = values.iter().position(|value| !value.is_finite()) {
            let row = 1 + i / (values.len() / n);
            return Err(format!(
                "observation {row} has {} in `{name}`: a data set has finite numbers",
                values[i]
            ));
        }
    }
    let classes = (classes > 0).then_some(classes);
    if let Some(classes) = classes {
        #[expect(clippy::cast_precision_loss, reason = "classes are few")]
        let foreign = |y: &&f64| y.fract() != 0.0 || **y < 0.0 || **y >= classes as f64;
        if let Some(y) = y.iter().find(foreign) {
            return Err(format!("{y} is no index of {classes} classes"));
        }
    }
    Ok(Dataset { form: Form { input, target, classes }, x, y })
}

fn tensors(bytes: &[u8]) -> Result<Columns, String> {
    let (tensors, _) = read_tensors(bytes)?;
    let wide = tensors.arrays.into_iter().map(|(name, data)| match data {
        Data::F64(shape, values) => Ok((name, (shape, values))),
        Data::F32(shape, values) => {
            Ok((name, (shape, values.into_iter().map(f64::from).collect())))
        }
        Data::U8(..) => Err(format!("`{name}` holds bytes; numbers are F64 or F32")),
    });
    wide.collect::<Result<BTreeMap<_, _>, _>>()
}

#[cfg(test)]
mod tests {
    use ivx_op::Artifact as _;

    use super::*;
    use ivx_data::Blob;

    fn read(name: &str, bytes: &[u8]) -> Result<Dataset, String> {
        read_as(name, bytes, 0)
    }

    fn read_as(name: &str, bytes: &[u8], classes: usize) -> Result<Dataset, String> {
        let outputs = Outputs { files: [(name.to_owned(), Blob::plain(bytes.to_vec()))].into() };
        let read = ReadDataset { outputs: One(outputs), name: name.to_owned(), classes };
        read.run(&Ctx::new("read_dataset", 0, None)).map_err(|error| error.to_string())
    }

    #[test]
    fn every_way_of_writing_it_is_read() {
        let data = Dataset::pairs(vec![0.1, -2.0], vec![1e-9, 3.0]);
        let columns = [("x", data.x.as_slice()), ("y", &data.y)];
        assert_eq!(read("d.csv", &csv::write(&columns)).as_ref(), Ok(&data));
        let arrays = columns.map(|(name, values)| (name, &[2][..], values));
        assert_eq!(read("d.npz", &npz::write(&arrays)).as_ref(), Ok(&data));
        let arrays = columns.map(|(name, values)| (name, &[2, 1][..], values));
        assert_eq!(read("d.npz", &npz::write(&arrays)).as_ref(), Ok(&data));
        assert_eq!(read("d.safetensors", &data.encode()).as_ref(), Ok(&data));
    }

    #[test]
    fn images_of_classes_keep_their_shape() {
        let form = Form { input: vec![1, 2, 3], target: vec![], classes: Some(3) };
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
        check("d.txt", b"", "its name ends in `.csv`, `.npz` or `.safetensors`");
        check(
            "d.csv",
            b"x,z\n1,2\n",
            "it has `x`, `z`, and a data set has `x` and `y` alone: call them so",
        );
        check(
            "d.csv",
            b"x,y\n1,NaN\n",
            "observation 1 has NaN in `y`: a data set has finite numbers",
        );
        check("d.npz", b"PK", "it is no zip archive, or a damaged one");
        let uneven = npz::write(&[("x", &[1], &[1.0]), ("y", &[2], &[1.0, 2.0])]);
        check("d.npz", &uneven, "there are 1 of `x` and 2 of `y`");
        assert!(read("d.safetensors", b"{}").is_err());
    }
}
