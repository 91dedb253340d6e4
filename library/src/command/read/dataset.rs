//! Pairs of numbers of a file.

use std::collections::BTreeMap;

use ivx_op::{Ctx, Data, One, Op, OpError, declare, read_tensors};

use super::super::{csv, npz};
use super::{Columns, output, wrong};
use crate::artifact::{Dataset, Outputs};

declare! {
    /// The data set that a program wrote: `x` and `y`, one number an observation each.
    ///
    /// The extension of the file says what it is: `.csv` with the columns `x,y` and their names in
    /// the first line, or `.npz` or `.safetensors` with the arrays `x` and `y`.
    pub struct ReadDataset = "read_dataset" @ 1 -> Dataset {
        /// What `command` left behind.
        outputs: One<Outputs>;
        /// The file's name.
        name: String;
    }
}

impl Op for ReadDataset {
    fn run(&self, _: &Ctx) -> Result<Dataset, OpError> {
        let bytes = output(&self.outputs, &self.name)?;
        let columns = match self.name.rsplit_once('.').map_or("", |(_, extension)| extension) {
            "csv" => csv::read(bytes),
            "npz" => npz::read(bytes),
            "safetensors" => tensors(bytes),
            _ => Err("its name ends in `.csv`, `.npz` or `.safetensors`".to_owned()),
        };
        columns.and_then(dataset).map_err(|why| wrong(&self.name, &why))
    }
}

fn dataset(mut columns: Columns) -> Result<Dataset, String> {
    if !columns.keys().eq(["x", "y"]) {
        let names: Vec<&str> = columns.keys().map(String::as_str).collect();
        return Err(format!("it has `x` and `y`, and not {}", names.join(", ")));
    }
    let mut column = |name: &str| match columns.remove(name) {
        Some((shape, values)) if matches!(shape[..], [_] | [_, 1]) => Ok(values),
        Some((shape, _)) => {
            Err(format!("`{name}` is one number an observation, and not {shape:?}"))
        }
        None => unreachable!("it is there"),
    };
    let (x, y) = (column("x")?, column("y")?);
    if x.len() != y.len() {
        return Err(format!("there are {} of `x` and {} of `y`", x.len(), y.len()));
    }
    if let Some(odd) = x.iter().chain(&y).find(|value| !value.is_finite()) {
        return Err(format!("it has finite numbers, and not {odd}"));
    }
    Ok(Dataset { x, y })
}

fn tensors(bytes: &[u8]) -> Result<Columns, String> {
    let (tensors, _) = read_tensors(bytes)?;
    let wide = tensors.arrays.into_iter().map(|(name, data)| match data {
        Data::F64(shape, values) => Ok((name, (shape, values))),
        Data::F32(shape, values) => {
            Ok((name, (shape, values.into_iter().map(f64::from).collect())))
        }
        Data::U8(_) => Err(format!("`{name}` holds bytes; numbers are F64 or F32")),
    });
    wide.collect::<Result<BTreeMap<_, _>, _>>()
}

#[cfg(test)]
mod tests {
    use ivx_op::Artifact as _;

    use super::*;

    fn read(name: &str, bytes: &[u8]) -> Result<Dataset, String> {
        let outputs = Outputs { files: [(name.to_owned(), bytes.to_vec())].into() };
        let read = ReadDataset { outputs: One(outputs), name: name.to_owned() };
        read.run(&Ctx::new("read_dataset", 0, None)).map_err(|error| error.to_string())
    }

    #[test]
    fn every_way_of_writing_it_is_read() {
        let data = Dataset { x: vec![0.1, -2.0], y: vec![1e-9, 3.0] };
        let columns = [("x", data.x.as_slice()), ("y", &data.y)];
        assert_eq!(read("d.csv", &csv::write(&columns)).as_ref(), Ok(&data));
        assert_eq!(read("d.npz", &npz::write(&columns)).as_ref(), Ok(&data));
        assert_eq!(read("d.safetensors", &data.encode()).as_ref(), Ok(&data));
    }

    #[test]
    fn what_is_there_instead_is_told() {
        let check = |name: &str, bytes: &[u8], expected: &str| {
            assert_eq!(read(name, bytes), Err(format!("`{name}` is not as expected: {expected}")));
        };
        check("d.txt", b"", "its name ends in `.csv`, `.npz` or `.safetensors`");
        check("d.csv", b"x,z\n1,2\n", "it has `x` and `y`, and not x, z");
        check("d.csv", b"x,y\n1,NaN\n", "it has finite numbers, and not NaN");
        check("d.npz", b"PK", "it is no zip archive, or a damaged one");
        let uneven = npz::write(&[("x", &[1.0]), ("y", &[1.0, 2.0])]);
        check("d.npz", &uneven, "there are 1 of `x` and 2 of `y`");
        assert!(read("d.safetensors", b"{}").is_err());
    }
}
