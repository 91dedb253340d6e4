//! Measures as a Parquet file.

use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, RecordBatch, StringArray};
use ivx_engine::{Coordinate, Tidy};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;

/// A column for each of experiment, measure, the dimensions and value. A dimension is of numbers if all its labels
/// are; where a measure does not vary over it, it is null.
pub(super) fn parquet(tidy: &Tidy) -> Result<Vec<u8>, ParquetError> {
    let rows = &tidy.rows;
    let texts = |text: fn(&ivx_engine::Row) -> &str| -> ArrayRef {
        Arc::new(StringArray::from_iter_values(rows.iter().map(text)))
    };
    let mut columns = vec![
        ("experiment", texts(|row| &row.experiment), false),
        ("measure", texts(|row| &row.measure), false),
    ];
    for (i, dim) in tidy.dims.iter().enumerate() {
        columns.push((dim, dimension(rows.iter().map(|row| row.at[i].as_ref())), true));
    }
    let values = Float64Array::from_iter_values(rows.iter().map(|row| row.value));
    columns.push(("value", Arc::new(values), false));

    let batch = RecordBatch::try_from_iter_with_nullable(columns)?;
    let compression = Compression::ZSTD(ZstdLevel::default());
    let properties = WriterProperties::builder().set_compression(compression).build();
    let mut bytes = Vec::new();
    let mut writer = ArrowWriter::try_new(&mut bytes, batch.schema(), Some(properties))?;
    writer.write(&batch)?;
    writer.close()?;
    Ok(bytes)
}

fn dimension<'a>(at: impl Iterator<Item = Option<&'a Coordinate>> + Clone) -> ArrayRef {
    if at.clone().any(|coordinate| matches!(coordinate, Some(Coordinate::Name(_)))) {
        let names = at.map(|coordinate| match coordinate? {
            Coordinate::Number(x) => Some(x.to_string()),
            Coordinate::Name(name) => Some(name.clone()),
        });
        return Arc::new(names.collect::<StringArray>());
    }
    let numbers = at.map(|coordinate| match coordinate? {
        Coordinate::Number(x) => Some(*x),
        Coordinate::Name(_) => None,
    });
    Arc::new(numbers.collect::<Float64Array>())
}
