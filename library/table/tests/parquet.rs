//! Files of Apache Parquet as data sets.

use std::panic::{catch_unwind, set_hook, take_hook};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Once};

use arrow_array::{ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch, StringArray};
use ivx_data::Dataset;
use ivx_table::{Choice, Classes, Gaps, dataset};
use parquet::arrow::ArrowWriter;
use parquet::basic::Compression;
use parquet::file::properties::WriterProperties;

const WRITES: &str = "memory can be written";

fn written(columns: Vec<(&str, ArrayRef)>, compression: Compression) -> Vec<u8> {
    let columns = columns.into_iter().map(|(name, array)| (name, array, true));
    let batch = RecordBatch::try_from_iter_with_nullable(columns).expect("columns are even");
    let properties = WriterProperties::builder().set_compression(compression).build();
    let mut bytes = Vec::new();
    let mut writer =
        ArrowWriter::try_new(&mut bytes, batch.schema(), Some(properties)).expect(WRITES);
    writer.write(&batch).expect(WRITES);
    writer.close().expect(WRITES);
    bytes
}

fn toy(compression: Compression) -> Vec<u8> {
    let columns: Vec<(&str, ArrayRef)> = vec![
        ("x", Arc::new(Float64Array::from(vec![Some(0.1), None, Some(3.0)]))),
        ("n", Arc::new(Int64Array::from(vec![1, -2, 3]))),
        ("b", Arc::new(BooleanArray::from(vec![true, false, true]))),
        ("t", Arc::new(StringArray::from(vec![Some("u"), None, Some("v")]))),
    ];
    written(columns, compression)
}

/// How many panics were told.
static TOLD: AtomicUsize = AtomicUsize::new(0);

/// Counts panics that are told, from before the first file is read.
fn count() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let tell = take_hook();
        set_hook(Box::new(move |panic| {
            TOLD.fetch_add(1, Ordering::Relaxed);
            tell(panic);
        }));
    });
}

/// The data set with the target `n`.
fn read(bytes: &[u8], inputs: &[&str], gaps: Gaps) -> Result<Dataset, String> {
    count();
    let names = |names: &[&str]| names.iter().map(ToString::to_string).collect();
    let choice = Choice {
        inputs: names(inputs),
        except: Vec::new(),
        targets: names(&["n"]),
        one_hot: names(if inputs.contains(&"t") { &["t"] } else { &[] }),
        categories: std::collections::BTreeMap::new(),
        classes: Classes::None,
        gaps,
    };
    dataset("d.parquet", bytes, (b',', true), &choice)
}

#[test]
fn numbers_truths_and_texts_are_read() {
    for compression in [Compression::UNCOMPRESSED, Compression::SNAPPY] {
        let bytes = toy(compression);
        let found = read(&bytes, &["b"], Gaps::Refused).unwrap();
        assert_eq!(found, Dataset::pairs(vec![1.0, 0.0, 1.0], vec![1.0, -2.0, 3.0]));
        let found = read(&bytes, &["x", "b"], Gaps::Filled(7.0)).unwrap();
        assert_eq!(found.x, [0.1, 1.0, 7.0, 0.0, 3.0, 1.0]);
        let found = read(&bytes, &["x", "t"], Gaps::Dropped).unwrap();
        assert_eq!((found.x, found.y), (vec![0.1, 1.0, 0.0, 3.0, 0.0, 1.0], vec![1.0, 3.0]));
    }
}

#[test]
fn what_is_no_table_of_numbers_is_told() {
    let numbers = |n: Vec<i64>| -> ArrayRef { Arc::new(Int64Array::from(n)) };
    let columns = vec![("x", numbers(vec![i64::MAX])), ("n", numbers(vec![1]))];
    let why = read(&written(columns, Compression::UNCOMPRESSED), &["x"], Gaps::Refused);
    assert!(why.unwrap_err().contains("`x` holds 9223372036854775807"));
    let why = read(b"PAR1", &[], Gaps::Refused).unwrap_err();
    assert!(why.contains("no Parquet file"), "{why}");
}

#[test]
fn every_flipped_byte_and_every_cut_is_an_error_or_harmless_and_prints_nothing() {
    let bytes = toy(Compression::SNAPPY);
    let read = |bytes: &[u8]| read(bytes, &["x", "b", "t"], Gaps::Dropped);
    let mut n_panics = 0;
    for i in 0..bytes.len() {
        for flip in [0xff, 0x01, 0x80] {
            let mut flipped = bytes.clone();
            flipped[i] ^= flip;
            n_panics += usize::from(read(&flipped).is_err_and(|why| why.contains("damaged")));
        }
        assert!(read(&bytes[..i]).is_err(), "cut at {i}");
    }
    assert!(n_panics > 0, "none panics");
    assert_eq!(TOLD.load(Ordering::Relaxed), 0);
    assert!(catch_unwind(|| panic!("of something else")).is_err());
    assert_eq!(TOLD.load(Ordering::Relaxed), 1);
}
