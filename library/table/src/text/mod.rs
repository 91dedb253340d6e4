//! Columns as text (RFC 4180).

use std::collections::BTreeMap;

use csv::{ByteRecord, ReaderBuilder, Trim};

use crate::table::{Cells, Choose, Column, Style, Table, Values, Want};
use cell::{Cell, cell, refused};

mod cell;
mod lane;
mod place;
mod quotes;

/// Columns of numbers of equal length under their names.
#[must_use]
pub fn write(columns: &[(&str, &[f64])]) -> Vec<u8> {
    let names: Vec<String> = columns.iter().map(|(name, _)| ivx_op::escape::csv(name)).collect();
    let mut text = names.join(",") + "\n";
    for row in 0..columns.first().map_or(0, |(_, values)| values.len()) {
        let row: Vec<String> =
            columns.iter().map(|(_, values)| format!("{:?}", values[row])).collect();
        text += &row.join(",");
        text.push('\n');
    }
    text.into_bytes()
}

/// The columns of a file that are wanted.
///
/// Lines end as they do on any system, blank ones at the end are no rows, and where there are several columns
/// blank ones between are none either.
///
/// # Errors
/// What is wrong with it, with the line.
pub fn read(bytes: &[u8], style: Style, choose: &mut Choose<'_>) -> Result<Table, String> {
    read_by(bytes, style, choose, true)
}

/// - `lane`: whether plain rows are read on their own.
fn read_by(
    bytes: &[u8],
    style: Style,
    choose: &mut Choose<'_>,
    lane: bool,
) -> Result<Table, String> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    // As other programs than editors of text write, and UTF-16 has it.
    if bytes.iter().take(4096).any(|byte| *byte == 0) {
        return Err("it is no text in UTF-8: it has a byte 0".to_owned());
    }
    quotes::sound(bytes, style.separator)?;
    let reader_from = |at: usize| {
        let mut builder = ReaderBuilder::new();
        builder.has_headers(false).flexible(true).delimiter(style.separator).trim(Trim::None);
        builder.buffer_capacity(1 << 16).from_reader(bytes.get(at..).unwrap_or_default())
    };
    let mut reader = reader_from(0);
    let mut record = ByteRecord::new();
    let unread = |error: csv::Error| format!("it cannot be read: {error}");
    let nameless = || "its first line has no names of columns".to_owned();
    if style.header && bytes.first().is_some_and(|first| matches!(first, b'\n' | b'\r')) {
        return Err(nameless());
    }
    if !reader.read_byte_record(&mut record).map_err(unread)? {
        return Err(if style.header { nameless() } else { "it is empty".to_owned() });
    }
    let names = names(&record, style)?;
    let wants = choose(&names)?;
    let mut columns: Vec<Reading> = wants.iter().map(|want| Reading::new(*want)).collect();
    if !style.header {
        add(&mut columns, &names, &record, style.cells).map_err(|why| format!("line 1{why}"))?;
    }
    let place = |position: &csv::Position| usize::try_from(position.byte()).unwrap_or(usize::MAX);
    let mut begin = place(reader.position());
    // The second half of what ended the line.
    if begin > 0 && bytes[begin - 1] == b'\r' && bytes.get(begin) == Some(&b'\n') {
        begin += 1;
    }
    if lane {
        begin = lane::plain(bytes, begin, style.separator, &mut columns);
    }
    let mut reader = reader_from(begin);
    while reader.read_byte_record(&mut record).map_err(unread)? {
        let at = begin + record.position().map_or(0, place);
        if names.len() == 1
            && let Some(line) = place::blank_before(bytes, at)
        {
            return Err(format!("line {line} has no value: it is empty"));
        }
        add(&mut columns, &names, &record, style.cells)
            .map_err(|why| format!("line {}{why}", place::line_of(bytes, at)))?;
    }
    let mut table = Table::default();
    for (name, column) in names.into_iter().zip(columns) {
        let values = match column {
            Reading::Nothing => continue,
            Reading::Numbers(numbers) => Values::Numbers(numbers),
            Reading::Texts(known, at) => {
                let mut texts = vec![String::new(); known.len()];
                for (text, place) in known {
                    texts[place as usize] = String::from_utf8_lossy(&text).into_owned();
                }
                Values::Texts(texts, at)
            }
        };
        let len = Some(match &values {
            Values::Numbers(numbers) => numbers.len(),
            Values::Texts(_, at) => at.len(),
        });
        table.columns.push(Column { name, len, item: Vec::new(), values });
    }
    Ok(table)
}

/// What is read of a column so far.
enum Reading {
    Nothing,
    Numbers(Vec<f64>),
    Texts(BTreeMap<Vec<u8>, u32>, Vec<u32>),
}

impl Reading {
    fn new(want: Want) -> Self {
        match want {
            Want::Nothing => Self::Nothing,
            Want::Numbers => Self::Numbers(Vec::new()),
            Want::Texts => Self::Texts(BTreeMap::new(), Vec::new()),
        }
    }
}

/// The names of the columns.
fn names(record: &ByteRecord, style: Style) -> Result<Vec<String>, String> {
    if !style.header {
        return Ok((0..record.len()).map(|i| i.to_string()).collect());
    }
    let mut names = Vec::new();
    for field in record {
        let name = std::str::from_utf8(field);
        let name = name.map_err(|_| "line 1: it is not UTF-8 text".to_owned())?;
        names.push(cell::plain(name).to_owned());
    }
    if let [one] = &names[..] {
        if one.is_empty() {
            return Err("its first line has no names of columns".to_owned());
        }
        separated_otherwise(one, style.separator)?;
    }
    let mut seen = std::collections::BTreeSet::new();
    if let Some(again) = names.iter().find(|name| !seen.insert(name.as_str())) {
        return Err(format!("two columns are called `{again}`"));
    }
    Ok(names)
}

/// One name that holds what else stands between columns is no name.
fn separated_otherwise(name: &str, separator: u8) -> Result<(), String> {
    let told = |c: char| if c == '\t' { "tabs".to_owned() } else { format!("`{c}`") };
    let own = told(char::from(separator));
    let found = [',', ';', '\t', '|'].into_iter().find(|c| name.contains(*c));
    let Some(other) = found.filter(|c| u32::from(*c) != u32::from(separator)) else {
        return Ok(());
    };
    Err(format!(
        "its columns are separated by {}, and not by {own}: write {own} between them, or say `separator: {:?}`",
        told(other),
        other.to_string()
    ))
}

/// Adds a row; what is wrong with it begins with what follows the line.
fn add(
    columns: &mut [Reading],
    names: &[String],
    record: &ByteRecord,
    cells: Cells,
) -> Result<(), String> {
    if record.len() != columns.len() {
        let (n, columns) = (record.len(), columns.len());
        let why = format!(" has {n} values for {columns} columns");
        let is_blank = n == 1 && record[0].iter().all(u8::is_ascii_whitespace);
        return Err(if is_blank { format!("{why}: it is empty") } else { why });
    }
    for (i, (column, field)) in columns.iter_mut().zip(record).enumerate() {
        match column {
            Reading::Nothing => {}
            Reading::Numbers(numbers) => {
                let number = match cell(field) {
                    Cell::Number(x) if x.is_finite() || cells == Cells::Any => x,
                    Cell::Number(x) if x.is_nan() && cells == Cells::Gaps => x,
                    Cell::Gap if cells == Cells::Gaps => f64::NAN,
                    cell => {
                        return Err(format!(", column `{}`: {}", names[i], refused(field, cell)));
                    }
                };
                numbers.push(number);
            }
            Reading::Texts(known, at) => {
                let text = std::str::from_utf8(field);
                let text =
                    text.map_err(|_| format!(", column `{}`: it is not UTF-8 text", names[i]))?;
                let text = cell::plain(text).as_bytes();
                let next = u32::try_from(known.len()).expect("a file has few texts");
                let place = known.get(text).copied();
                if place.is_none() {
                    known.insert(text.to_vec(), next);
                }
                at.push(place.unwrap_or(next));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
