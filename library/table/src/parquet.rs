//! Columns of Apache Parquet.

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};

use arrow_array::cast::AsArray as _;
use arrow_array::{
    Array, ArrowPrimitiveType, BooleanArray, PrimitiveArray, RecordBatchReader as _,
};
use arrow_array::{LargeStringArray, StringArray, StringViewArray, types};
use bytes::Bytes;
use ivx_op::{exact, too_large};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use crate::table::{Choose, Column, Table, Values, Want};

/// Rows that are read at once.
const ROWS: usize = 8192;

/// The columns of a file that are wanted. What is missing is not a number, or an empty text.
///
/// # Errors
/// What is wrong with it.
pub(crate) fn read(bytes: &[u8], choose: &mut Choose<'_>) -> Result<Table, String> {
    // Of a damaged file the crate may panic. What it was reading is dropped then.
    let read = catch_unwind(AssertUnwindSafe(|| whole(bytes, choose)));
    read.unwrap_or_else(|_| Err("it is a damaged Parquet file".to_owned()))
}

fn whole(bytes: &[u8], choose: &mut Choose<'_>) -> Result<Table, String> {
    let unread = |error: &dyn std::fmt::Display| format!("it is no Parquet file: {error}");
    let builder = ParquetRecordBatchReaderBuilder::try_new(Bytes::copy_from_slice(bytes));
    let builder = builder.map_err(|error| unread(&error))?;
    let names: Vec<String> =
        builder.schema().fields().iter().map(|field| field.name().clone()).collect();
    let mut seen = BTreeSet::new();
    if let Some(again) = names.iter().find(|name| !seen.insert(name.as_str())) {
        return Err(format!("two columns are called `{again}`"));
    }
    let wants = choose(&names)?;
    let wanted = (0..names.len()).filter(|i| wants[*i] != Want::Nothing);
    let mask = ProjectionMask::roots(builder.parquet_schema(), wanted);
    let reader = builder.with_projection(mask).with_batch_size(ROWS).build();
    let reader = reader.map_err(|error| unread(&error))?;
    let found: Vec<String> =
        reader.schema().fields().iter().map(|field| field.name().clone()).collect();
    let mut columns: Vec<Reading> = found.iter().map(|_| Reading::Empty).collect();
    for batch in reader {
        let batch = batch.map_err(|error| unread(&error))?;
        for ((column, array), name) in columns.iter_mut().zip(batch.columns()).zip(&found) {
            column.add(array.as_ref()).map_err(|why| format!("`{name}` {why}"))?;
        }
    }
    let columns = found.into_iter().zip(columns).map(|(name, reading)| {
        let values = match reading {
            Reading::Empty => Values::Numbers(Vec::new()),
            Reading::Numbers(numbers) => Values::Numbers(numbers),
            Reading::Texts(known, at) => {
                let mut texts = vec![String::new(); known.len()];
                for (text, place) in known {
                    texts[place as usize] = text;
                }
                Values::Texts(texts, at)
            }
        };
        let len = match &values {
            Values::Numbers(numbers) => numbers.len(),
            Values::Texts(_, at) => at.len(),
        };
        Column { name, len: Some(len), item: Vec::new(), values }
    });
    Ok(Table { columns: columns.collect() })
}

enum Reading {
    Empty,
    Numbers(Vec<f64>),
    Texts(BTreeMap<String, u32>, Vec<u32>),
}

impl Reading {
    /// Adds some rows.
    fn add(&mut self, array: &dyn Array) -> Result<(), String> {
        if let Some(texts) = texts(array) {
            if let Self::Empty = self {
                *self = Self::Texts(BTreeMap::new(), Vec::new());
            }
            let Self::Texts(known, at) = self else { return Err("changes its kind".to_owned()) };
            for text in texts {
                let text = text.unwrap_or_default();
                let next = u32::try_from(known.len()).expect("a file has few texts");
                let place = known.get(text).copied();
                if place.is_none() {
                    known.insert(text.to_owned(), next);
                }
                at.push(place.unwrap_or(next));
            }
            return Ok(());
        }
        if let Self::Empty = self {
            *self = Self::Numbers(Vec::new());
        }
        let Self::Numbers(all) = self else { return Err("changes its kind".to_owned()) };
        all.extend(numbers(array)?);
        Ok(())
    }
}

/// The texts of a column that holds such.
fn texts(array: &dyn Array) -> Option<Vec<Option<&str>>> {
    if let Some(texts) = array.as_any().downcast_ref::<StringArray>() {
        return Some(texts.iter().collect());
    }
    if let Some(texts) = array.as_any().downcast_ref::<LargeStringArray>() {
        return Some(texts.iter().collect());
    }
    array.as_any().downcast_ref::<StringViewArray>().map(|texts| texts.iter().collect())
}

fn numbers(array: &dyn Array) -> Result<Vec<f64>, String> {
    fn of<T: ArrowPrimitiveType>(
        array: &dyn Array,
        number: fn(T::Native) -> Result<f64, String>,
    ) -> Option<Result<Vec<f64>, String>> {
        let array: &PrimitiveArray<T> = array.as_primitive_opt()?;
        Some(array.iter().map(|x| x.map_or(Ok(f64::NAN), number)).collect())
    }
    if let Some(truths) = array.as_any().downcast_ref::<BooleanArray>() {
        let number =
            |truth: Option<bool>| truth.map_or(f64::NAN, |truth| f64::from(u8::from(truth)));
        return Ok(truths.iter().map(number).collect());
    }
    of::<types::Float64Type>(array, Ok)
        .or_else(|| of::<types::Float32Type>(array, |x| Ok(f64::from(x))))
        .or_else(|| of::<types::Float16Type>(array, |x| Ok(ivx_op::half(x.to_bits()))))
        .or_else(|| of::<types::Int8Type>(array, |n| Ok(f64::from(n))))
        .or_else(|| of::<types::Int16Type>(array, |n| Ok(f64::from(n))))
        .or_else(|| of::<types::Int32Type>(array, |n| Ok(f64::from(n))))
        .or_else(|| of::<types::Int64Type>(array, |n| exact(n).ok_or_else(|| too_large(n))))
        .or_else(|| of::<types::UInt8Type>(array, |n| Ok(f64::from(n))))
        .or_else(|| of::<types::UInt16Type>(array, |n| Ok(f64::from(n))))
        .or_else(|| of::<types::UInt32Type>(array, |n| Ok(f64::from(n))))
        .or_else(|| {
            of::<types::UInt64Type>(array, |n| {
                i64::try_from(n).ok().and_then(exact).ok_or_else(|| too_large(n))
            })
        })
        .unwrap_or_else(|| {
            Err(format!("holds {}; numbers, truths and texts are read", array.data_type()))
        })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use arrow_array::{ArrayRef, Float64Array, Int64Array, RecordBatch};
    use parquet::arrow::ArrowWriter;
    use parquet::basic::Compression;
    use parquet::file::properties::WriterProperties;

    use super::*;

    fn written(columns: Vec<(&str, ArrayRef)>, compression: Compression) -> Vec<u8> {
        let columns = columns.into_iter().map(|(name, array)| (name, array, true));
        let batch = RecordBatch::try_from_iter_with_nullable(columns).unwrap();
        let properties = WriterProperties::builder().set_compression(compression).build();
        let mut bytes = Vec::new();
        let mut writer =
            ArrowWriter::try_new(&mut bytes, batch.schema(), Some(properties)).unwrap();
        writer.write(&batch).unwrap();
        writer.close().unwrap();
        bytes
    }

    #[expect(clippy::unnecessary_wraps, reason = "a choice may be refused")]
    fn all(names: &[String]) -> Result<Vec<Want>, String> {
        Ok(vec![Want::Numbers; names.len()])
    }

    fn toy(compression: Compression) -> Vec<u8> {
        let columns: Vec<(&str, ArrayRef)> = vec![
            ("x", Arc::new(Float64Array::from(vec![Some(0.1), None, Some(3.0)]))),
            ("n", Arc::new(Int64Array::from(vec![1, -2, 3]))),
            ("b", Arc::new(BooleanArray::from(vec![true, false, true]))),
            ("t", Arc::new(StringArray::from(vec![Some("u"), None, Some("u")]))),
        ];
        written(columns, compression)
    }

    #[test]
    fn numbers_truths_and_texts_are_read() {
        for compression in [Compression::UNCOMPRESSED, Compression::SNAPPY] {
            let table = read(&toy(compression), &mut all).unwrap();
            let names: Vec<&str> = table.columns.iter().map(|c| c.name.as_str()).collect();
            assert_eq!(names, ["x", "n", "b", "t"]);
            let Values::Numbers(x) = &table.columns[0].values else { panic!("numbers") };
            assert!(x[0] == 0.1 && x[1].is_nan() && x[2] == 3.0);
            assert_eq!(table.columns[1].values, Values::Numbers(vec![1.0, -2.0, 3.0]));
            assert_eq!(table.columns[2].values, Values::Numbers(vec![1.0, 0.0, 1.0]));
            let texts = ["u", ""].map(str::to_owned).to_vec();
            assert_eq!(table.columns[3].values, Values::Texts(texts, vec![0, 1, 0]));
        }
    }

    #[test]
    fn only_what_is_wanted_is_read() {
        let mut choose =
            |_: &[String]| Ok(vec![Want::Nothing, Want::Numbers, Want::Nothing, Want::Texts]);
        let table = read(&toy(Compression::SNAPPY), &mut choose).unwrap();
        let names: Vec<&str> = table.columns.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["n", "t"]);
    }

    #[test]
    fn what_is_no_table_of_numbers_is_told() {
        let large: ArrayRef = Arc::new(Int64Array::from(vec![i64::MAX]));
        let why = read(&written(vec![("n", large)], Compression::UNCOMPRESSED), &mut all);
        assert!(why.unwrap_err().contains("`n` holds 9223372036854775807"));
        assert!(read(b"PAR1", &mut all).unwrap_err().contains("no Parquet file"));
    }

    #[test]
    fn every_flipped_byte_and_every_cut_is_an_error_or_harmless() {
        let bytes = toy(Compression::SNAPPY);
        for i in 0..bytes.len() {
            for flip in [0xff, 0x01, 0x80] {
                let mut flipped = bytes.clone();
                flipped[i] ^= flip;
                drop(read(&flipped, &mut all));
            }
            assert!(read(&bytes[..i], &mut all).is_err(), "cut at {i}");
        }
    }
}
