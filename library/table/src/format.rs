//! Which reader a file is for.

use ivx_op::read_numbers;

use crate::table::{Choose, Column, Style, Table, Values, Want};
use crate::{npy, npz, text};

/// How a file is written, by what its name ends in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Text with a separator between cells.
    Text,
    /// One array of numpy.
    Npy,
    /// Several.
    Npz,
    /// Arrays by name.
    Safetensors,
    /// Columns of Apache Parquet.
    Parquet,
}

/// What tables are read from, for messages.
pub const TABLES: &str = "`.csv`, `.tsv`, `.npy`, `.npz`, `.safetensors` or `.parquet`";

impl Format {
    /// The format of a file of this name; none if it says none.
    #[must_use]
    pub fn of(name: &str) -> Option<Self> {
        Some(match extension(name) {
            "csv" | "tsv" => Self::Text,
            "npy" => Self::Npy,
            "npz" => Self::Npz,
            "safetensors" => Self::Safetensors,
            "parquet" => Self::Parquet,
            _ => return None,
        })
    }
}

/// The largest file that is read whole while a spec is checked, in bytes.
pub(crate) const SMALL: usize = 1 << 20;

/// What to do about a file that is not as expected.
pub(crate) const MEND: &str =
    "mend the file, or say otherwise how it is to be read: `docs/data.md`";

/// What stands behind the last point of a name.
#[must_use]
pub(crate) fn extension(name: &str) -> &str {
    name.rsplit_once('.').map_or("", |(_, extension)| extension)
}

/// What stands between cells of a file of this name, unless something else is asked for.
///
/// # Errors
/// If that is more than one byte, or what stands in numbers and texts.
pub fn separator(name: &str, asked: &str) -> Result<u8, String> {
    match asked.as_bytes() {
        [] => Ok(if extension(name) == "tsv" { b'\t' } else { b',' }),
        [b'"' | b'\n' | b'\r' | b'.' | b'-' | b'+' | b'0'..=b'9' | b'a'..=b'z' | b'A'..=b'Z'] => {
            Err(format!("{asked:?} cannot stand between numbers"))
        }
        [one] if one.is_ascii() => Ok(*one),
        _ => Err(format!("a separator is one character such as `;` or a tab, and not {asked:?}")),
    }
}

/// The columns of a table that are wanted.
///
/// # Errors
/// What is wrong with it.
pub(crate) fn table(
    name: &str,
    bytes: &[u8],
    style: Style,
    choose: &mut Choose<'_>,
) -> Result<Table, String> {
    match Format::of(name) {
        Some(Format::Text) => text::read(bytes, style, choose),
        Some(Format::Parquet) => parquet(bytes, choose),
        Some(Format::Npy) => chosen(across(&npy::read("it", bytes).map_err(unquoted)?)?, choose),
        Some(Format::Npz | Format::Safetensors) => chosen(arrays(name, bytes)?, choose),
        None => Err(format!("its name ends in {TABLES}")),
    }
}

/// The arrays of a file, by name.
///
/// # Errors
/// What is wrong with it.
pub(crate) fn arrays(name: &str, bytes: &[u8]) -> Result<Vec<Column>, String> {
    match Format::of(name) {
        Some(Format::Npy) => Ok(vec![npy::read("", bytes).map_err(unquoted)?]),
        Some(Format::Npz) => npz::read(bytes),
        _ => {
            let arrays = read_numbers(bytes)?.into_iter().map(|(name, (shape, numbers))| {
                if npy::is_vast(&shape) {
                    return Err(format!("`{name}` does not have the numbers that its shape says"));
                }
                let (len, item) = (shape.first().copied(), shape.iter().skip(1).copied());
                Ok(Column { name, len, item: item.collect(), values: Values::Numbers(numbers) })
            });
            arrays.collect()
        }
    }
}

/// What is wrong with the only array of a file.
fn unquoted(why: impl std::fmt::Display) -> String {
    format!("it {why}")
}

fn chosen(columns: Vec<Column>, choose: &mut Choose<'_>) -> Result<Table, String> {
    let names: Vec<String> = columns.iter().map(|column| column.name.clone()).collect();
    let wants = choose(&names)?;
    let wanted = columns.into_iter().zip(wants).filter(|(_, want)| *want != Want::Nothing);
    Ok(Table { columns: wanted.map(|(column, _)| column).collect() })
}

/// The columns of a matrix, called by their places.
fn across(matrix: &Column) -> Result<Vec<Column>, String> {
    let (Some(n), width) = (
        matrix.len,
        match matrix.item[..] {
            [] => 1,
            [width] => width,
            _ => {
                return Err(format!(
                    "it is an array of the shape {:?}, and no table",
                    matrix.shape()
                ));
            }
        },
    ) else {
        return Err("it is a single number, and no table".to_owned());
    };
    let places = |from: usize| (0..n).map(move |row| row * width + from);
    let columns = (0..width).map(|i| {
        let values = match &matrix.values {
            Values::Numbers(numbers) => Values::Numbers(places(i).map(|at| numbers[at]).collect()),
            Values::Texts(texts, at) => {
                Values::Texts(texts.clone(), places(i).map(|place| at[place]).collect())
            }
        };
        Column { name: i.to_string(), len: Some(n), item: Vec::new(), values }
    });
    Ok(columns.collect())
}

#[cfg(feature = "parquet")]
fn parquet(bytes: &[u8], choose: &mut Choose<'_>) -> Result<Table, String> {
    crate::parquet::read(bytes, choose)
}

#[cfg(not(feature = "parquet"))]
fn parquet(_: &[u8], _: &mut Choose<'_>) -> Result<Table, String> {
    Err("this ivx is built without Parquet: `cargo install --path cli --features parquet` builds one that has it".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Cells;

    const STYLE: Style = Style { separator: b',', header: true, cells: Cells::Any };

    #[test]
    fn a_matrix_is_columns_called_by_their_places() {
        let bytes = npy::write("|u1", &[2, 3], [1, 2, 3, 4, 5, 6].into_iter());
        let mut choose = |names: &[String]| {
            Ok(names
                .iter()
                .map(|name| match name.as_str() {
                    "1" => Want::Nothing,
                    _ => Want::Numbers,
                })
                .collect())
        };
        let table = table("a.npy", &bytes, STYLE, &mut choose).unwrap();
        let found: Vec<_> = table.columns.iter().map(|c| (c.name.as_str(), &c.values)).collect();
        let (first, last) = (Values::Numbers(vec![1.0, 4.0]), Values::Numbers(vec![3.0, 6.0]));
        assert_eq!(found, [("0", &first), ("2", &last)]);
    }

    #[test]
    fn the_name_says_how_it_is_written() {
        assert_eq!(Format::of("a.b.csv"), Some(Format::Text));
        assert_eq!(Format::of("csv"), None);
        assert_eq!((separator("a.tsv", ""), separator("a.csv", "")), (Ok(b'\t'), Ok(b',')));
        assert_eq!(separator("a.csv", ";"), Ok(b';'));
        for wrong in ["ab", "é", "1", ".", "\"", "x"] {
            assert!(separator("a.csv", wrong).is_err(), "{wrong}");
        }
        let mut choose = |names: &[String]| Ok(vec![Want::Numbers; names.len()]);
        let why = table("a.txt", b"", STYLE, &mut choose).unwrap_err();
        assert!(why.contains("`.csv`"), "{why}");
    }
}
