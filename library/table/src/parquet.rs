//! Columns of Apache Parquet.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

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
    quietly(|| whole(bytes, choose))
        .unwrap_or_else(|| Err("it is a damaged Parquet file".to_owned()))
}

/// What a function returns; none if it panics, of which nothing is printed.
fn quietly<T>(of: impl FnOnce() -> T) -> Option<T> {
    thread_local! {
        static QUIET: Cell<bool> = const { Cell::new(false) };
    }
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let tell = take_hook();
        set_hook(Box::new(move |panic| {
            if !QUIET.get() {
                tell(panic);
            }
        }));
    });
    QUIET.set(true);
    let done = catch_unwind(AssertUnwindSafe(of));
    QUIET.set(false);
    done.ok()
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
