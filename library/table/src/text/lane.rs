//! Rows that are nothing but plain numbers, which almost all are: read without looking for quotes, blanks and gaps.

use super::Reading;
use super::cell::LARGE;

/// Reads rows up to the first that holds anything else, and says where that one begins.
///
/// What is read so is what the other reader makes of it.
///
/// - `at`: where the first row begins.
pub(super) fn plain(bytes: &[u8], mut at: usize, separator: u8, columns: &mut [Reading]) -> usize {
    if columns.iter().any(|column| matches!(column, Reading::Texts(..))) {
        return at;
    }
    while at < bytes.len() {
        match row(bytes, at, separator, columns) {
            Ok(end) => at = end,
            Err(n_read) => {
                // Those numbers of it that were read are taken back.
                for column in &mut columns[..n_read] {
                    if let Reading::Numbers(numbers) = column {
                        numbers.pop();
                    }
                }
                return at;
            }
        }
    }
    at
}

/// Reads a row, and says where the next begins; if it is not plain, how many of its cells were read.
fn row(
    bytes: &[u8],
    mut at: usize,
    separator: u8,
    columns: &mut [Reading],
) -> Result<usize, usize> {
    let last = columns.len() - 1;
    for (i, column) in columns.iter_mut().enumerate() {
        let rest = &bytes[at..];
        let length = match column {
            Reading::Numbers(numbers) => {
                let (x, length) = fast_float2::parse_partial::<f64, _>(rest).map_err(|_| i)?;
                if x.is_nan() || x.abs() >= LARGE {
                    return Err(i);
                }
                let ends = match rest.get(length) {
                    None | Some(b'\n' | b'\r') => i == last,
                    Some(byte) => *byte == separator && i < last,
                };
                if !ends {
                    return Err(i);
                }
                numbers.push(x);
                length
            }
            Reading::Nothing => {
                let ends = |byte: &u8| *byte == separator || matches!(byte, b'\n' | b'\r' | b'"');
                let length = rest.iter().position(ends).unwrap_or(rest.len());
                let goes_on = rest.get(length) == Some(&separator);
                if goes_on == (i == last) || rest.get(length) == Some(&b'"') {
                    return Err(i);
                }
                length
            }
            Reading::Texts(..) => return Err(i),
        };
        at += length + usize::from(i < last);
    }
    match &bytes[at..] {
        [] => Ok(at),
        [b'\n', ..] => Ok(at + 1),
        [b'\r', b'\n', ..] => Ok(at + 2),
        // Lines that end otherwise are left to the other reader.
        _ => Err(columns.len()),
    }
}
