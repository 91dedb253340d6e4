//! One array as numpy keeps it.

use ivx_op::{exact, half, too_large};

use crate::table::{Column, Values};

/// The most numbers that the shape of an empty array may speak of.
const MOST: usize = 1 << 20;

/// The file of an array.
///
/// - `kind`: what numpy calls its numbers, such as `<f8`.
/// - `bytes`: the numbers, last dimension fastest.
pub(crate) fn write(kind: &str, shape: &[usize], bytes: impl Iterator<Item = u8>) -> Vec<u8> {
    let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
    let shape = shape.join(", ") + if shape.len() == 1 { "," } else { "" };
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
    // Numbers begin at a multiple of 64.
    let header =
        format!("{header:<width$}\n", width = (header.len() + 11).next_multiple_of(64) - 11);
    let length = u16::try_from(header.len()).expect("a header is short").to_le_bytes();
    let mut file = [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes()].concat();
    file.extend(bytes);
    file
}

/// The array of a file: numbers of any size and order of bytes, truths as 1 and 0, or texts.
///
/// # Errors
/// What is wrong with it, to stand behind its name.
pub(crate) fn read(name: &str, file: &[u8]) -> Result<Column, String> {
    let (header, data) = split(file).ok_or("is no array of NumPy")?;
    let field = |name: &str| {
        let rest = header.split_once(&format!("'{name}':"))?.1.trim_start();
        Some(match name {
            "shape" => rest.split_once(')')?.0.strip_prefix('(')?,
            "descr" if rest.starts_with('[') => "records",
            _ => rest.split_once(',')?.0.trim_matches('\''),
        })
    };
    let missing = |name: &str| format!("has no `{name}`");
    let kind = field("descr").ok_or_else(|| missing("descr"))?;
    let shape = field("shape").ok_or_else(|| missing("shape"))?;
    let sizes = shape.split(',').map(str::trim).filter(|size| !size.is_empty());
    let sizes = sizes.map(|size| size.trim_end_matches('L').parse().ok());
    let shape = sizes.collect::<Option<Vec<usize>>>().ok_or("has no shape of numbers")?;
    let fortran = match field("fortran_order") {
        Some("True") => true,
        Some("False") => false,
        _ => return Err(missing("fortran_order")),
    };
    let uneven = || "does not have the numbers that its shape says".to_owned();
    let n = product(&shape, 0).ok_or_else(uneven)?;
    if is_vast(&shape) {
        return Err(uneven());
    }
    let values = match kind.get(1..2) {
        Some("U") => texts(kind, data, n)?,
        _ => Values::Numbers(numbers(kind, data, n)?),
    };
    let values = if fortran { turned(values, &shape) } else { values };
    let (len, item) = match shape.split_first() {
        Some((n, item)) => (Some(*n), item.to_vec()),
        None => (None, Vec::new()),
    };
    Ok(Column { name: name.to_owned(), len, item, values })
}

fn product(shape: &[usize], least: usize) -> Option<usize> {
    shape.iter().try_fold(1_usize, |n, size| n.checked_mul((*size).max(least)))
}

/// Whether an array without numbers speaks of more than there could be.
pub(crate) fn is_vast(shape: &[usize]) -> bool {
    product(shape, 0) == Some(0) && product(shape, 1).is_none_or(|n| n > MOST)
}

fn split(file: &[u8]) -> Option<(&str, &[u8])> {
    let rest = file.strip_prefix(b"\x93NUMPY")?;
    let (length, rest) = match rest.first()? {
        1 => (usize::from(u16::from_le_bytes(*rest.get(2..)?.first_chunk()?)), rest.get(4..)?),
        2 | 3 => {
            let length = u32::from_le_bytes(*rest.get(2..)?.first_chunk()?);
            (usize::try_from(length).ok()?, rest.get(6..)?)
        }
        _ => return None,
    };
    let (header, data) = rest.split_at_checked(length)?;
    Some((std::str::from_utf8(header).ok()?, data))
}

/// The numbers, as many as the shape says and no more.
fn numbers(kind: &str, data: &[u8], n: usize) -> Result<Vec<f64>, String> {
    let other = || {
        format!(
            "holds `{kind}`; floating-point numbers of 2, 4 and 8 bytes, whole ones, truths and texts (`U`) are read"
        )
    };
    let (order, of) = kind.split_at_checked(1).ok_or_else(other)?;
    let big = match order {
        ">" => true,
        "<" | "|" | "=" => false,
        _ => return Err(other()),
    };
    macro_rules! each {
        ($ty:ty, $number:expr) => {{
            let (chunks, rest) = data.as_chunks();
            if !rest.is_empty() || chunks.len() != n {
                return Err("does not have the numbers that its shape says".to_owned());
            }
            let read = if big { <$ty>::from_be_bytes } else { <$ty>::from_le_bytes };
            let number: fn($ty) -> Result<f64, String> = $number;
            chunks.iter().map(|bytes| number(read(*bytes))).collect()
        }};
    }
    match of {
        "f8" => each!(f64, Ok),
        "f4" => each!(f32, |x| Ok(f64::from(x))),
        "f2" => each!(u16, |bits| Ok(half(bits))),
        "i1" => each!(i8, |n| Ok(f64::from(n))),
        "i2" => each!(i16, |n| Ok(f64::from(n))),
        "i4" => each!(i32, |n| Ok(f64::from(n))),
        "i8" => each!(i64, |n| exact(n).ok_or_else(|| too_large(n))),
        "u1" => each!(u8, |n| Ok(f64::from(n))),
        "b1" => each!(u8, |n| match n {
            0 | 1 => Ok(f64::from(n)),
            _ => Err(format!("holds the truth {n}, which is neither 0 nor 1")),
        }),
        "u2" => each!(u16, |n| Ok(f64::from(n))),
        "u4" => each!(u32, |n| Ok(f64::from(n))),
        "u8" => each!(u64, |n| {
            let number = i64::try_from(n).ok().and_then(exact);
            number.ok_or_else(|| too_large(n))
        }),
        _ => Err(other()),
    }
}

/// Texts of a fixed number of characters, each of four bytes.
fn texts(kind: &str, data: &[u8], n: usize) -> Result<Values, String> {
    let length: Option<usize> = kind.get(2..).and_then(|length| length.parse().ok());
    let size = length.and_then(|length| length.checked_mul(4));
    let size = size.filter(|size| *size > 0);
    let size = size.ok_or_else(|| format!("holds `{kind}`, which is no text"))?;
    if size.checked_mul(n) != Some(data.len()) {
        return Err("does not have the texts that its shape says".to_owned());
    }
    let read = if kind.starts_with('>') { u32::from_be_bytes } else { u32::from_le_bytes };
    let (mut known, mut texts) = (std::collections::BTreeMap::new(), Vec::new());
    let mut at = Vec::new();
    for i in 0..n {
        let (chars, _) = data[i * size..(i + 1) * size].as_chunks();
        let chars = chars.iter().map(|bytes| char::from_u32(read(*bytes)));
        let text: Option<String> = chars.collect();
        let text = text.ok_or("holds what is no text")?.trim_end_matches('\0').to_owned();
        at.push(*known.entry(text).or_insert_with_key(|text| {
            texts.push(text.clone());
            u32::try_from(texts.len() - 1).expect("a file has few texts")
        }));
    }
    Ok(Values::Texts(texts, at))
}

/// What lies first dimension fastest, last dimension fastest.
fn turned(values: Values, shape: &[usize]) -> Values {
    let n: usize = shape.iter().product();
    // How far apart neighbours along each dimension lie in the file.
    let steps: Vec<usize> = shape
        .iter()
        .scan(1, |step, size| {
            let own = *step;
            *step *= size;
            Some(own)
        })
        .collect();
    let from = |mut i: usize| {
        let mut at = 0;
        for (size, step) in shape.iter().zip(&steps).rev() {
            at += i % size * step;
            i /= size;
        }
        at
    };
    match values {
        Values::Numbers(numbers) => Values::Numbers((0..n).map(|i| numbers[from(i)]).collect()),
        Values::Texts(texts, at) => Values::Texts(texts, (0..n).map(|i| at[from(i)]).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(kind: &str, order: &str, shape: &str) -> String {
        format!("{{'descr': '{kind}', 'fortran_order': {order}, 'shape': ({shape}), }}")
    }

    fn file(header: &str, data: &[u8]) -> Vec<u8> {
        let length = u16::try_from(header.len()).unwrap().to_le_bytes();
        [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data].concat()
    }

    fn numbers_of(header: &str, data: &[u8]) -> Result<Vec<f64>, String> {
        match read("a", &file(header, data))?.values {
            Values::Numbers(numbers) => Ok(numbers),
            Values::Texts(..) => Err("texts".to_owned()),
        }
    }

    #[test]
    fn every_kind_of_number_is_read_in_both_orders() {
        let check = |kind: &str, little: &[u8], expected: f64| {
            let of = &kind[1..];
            let big: Vec<u8> = little.iter().rev().copied().collect();
            for (order, data) in [("<", little), (">", &big)] {
                let found = numbers_of(&header(&format!("{order}{of}"), "False", "1,"), data);
                assert_eq!(found, Ok(vec![expected]), "{order}{of}");
            }
        };
        check("<f8", &0.1_f64.to_le_bytes(), 0.1);
        check("<f4", &0.1_f32.to_le_bytes(), f64::from(0.1_f32));
        check("<i1", &(-3_i8).to_le_bytes(), -3.0);
        check("<i2", &(-300_i16).to_le_bytes(), -300.0);
        check("<i4", &(-70_000_i32).to_le_bytes(), -70_000.0);
        check("<i8", &(-5_000_000_000_i64).to_le_bytes(), -5e9);
        check("<u1", &[200], 200.0);
        check("<u2", &60_000_u16.to_le_bytes(), 60_000.0);
        check("<u4", &4_000_000_000_u32.to_le_bytes(), 4e9);
        check("<u8", &(1_u64 << 53).to_le_bytes(), 9_007_199_254_740_992.0);
        assert_eq!(numbers_of(&header("|b1", "False", "2,"), &[1, 0]), Ok(vec![1.0, 0.0]));
        // As NumPy reads them: the largest, the smallest, a third, minus two.
        for (bits, expected) in [
            (0x7bff, 65504.0),
            (0x0001, 5.960_464_477_539_063e-8),
            (0x3555, 0.333_251_953_125),
            (0xc000, -2.0),
            (0xfc00, f64::NEG_INFINITY),
        ] {
            check("<f2", &u16::to_le_bytes(bits), expected);
        }
        assert!(half(0x7e00).is_nan());
    }

    #[test]
    fn order_and_emptiness_are_understood() {
        // np.array([[1, 2, 3], [4, 5, 6]], order="F") lies as 1 4 2 5 3 6.
        let read = numbers_of(&header("|u1", "True", "2, 3"), &[1, 4, 2, 5, 3, 6]);
        assert_eq!(read, Ok(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
        let read = numbers_of(&header("|u1", "True", "2, 1, 2"), &[1, 2, 3, 4]);
        assert_eq!(read, Ok(vec![1.0, 3.0, 2.0, 4.0]));
        for order in ["True", "False"] {
            assert_eq!(numbers_of(&header("<f8", order, "0, 3"), &[]), Ok(vec![]));
        }
        assert_eq!(numbers_of(&header("<f8", "False", ""), &[0; 8]), Ok(vec![0.0]));
        let empty = read_shape("0, 3");
        assert_eq!((empty.len, empty.item), (Some(0), vec![3]));
    }

    fn read_shape(shape: &str) -> Column {
        read("a", &file(&header("<f8", "False", shape), &[])).unwrap()
    }

    #[test]
    fn texts_are_read() {
        let data: Vec<u8> = "abc\0\0\0abc".chars().flat_map(|c| (c as u32).to_le_bytes()).collect();
        let read = read("a", &file(&header("<U3", "False", "3,"), &data)).unwrap();
        let texts = ["abc", ""].map(str::to_owned).to_vec();
        assert_eq!(read.values, Values::Texts(texts, vec![0, 1, 0]));
    }

    #[test]
    fn other_arrays_are_refused() {
        let check = |header: &str, data: &[u8], expected: &str| {
            let why = read("a", &file(header, data)).unwrap_err();
            assert!(why.contains(expected), "{why}");
        };
        check(&header("|O", "False", "1,"), &[0; 8], "holds `|O`");
        check(&header("<c16", "False", "1,"), &[0; 16], "holds `<c16`");
        check(&header("", "False", "1,"), &[0; 16], "holds ``");
        check(&header("é8", "False", "1,"), &[0; 16], "holds `é8`");
        check(&header("<f8", "False", "2,"), &[0; 8], "shape says");
        check(&header("<f8", "False", "1,"), &[0; 9], "shape says");
        check(&header("<i8", "False", "1,"), &i64::MAX.to_le_bytes(), "too large to be exact");
        check(&header("<u8", "False", "1,"), &u64::MAX.to_le_bytes(), "too large to be exact");
        check(&header("|b1", "False", "1,"), &[2], "neither 0 nor 1");
        check("{}", &[], "has no `descr`");
        check("{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (1,), }", &[], "records");
        for sizes in ["{0}, {0}", "0, {0}", "1000000000000, 1"] {
            let sizes = sizes.replace("{0}", &usize::MAX.to_string());
            check(&header("<f8", "False", &sizes), &[0; 8], "shape says");
            check(&header("<U9999999999", "False", &sizes), &[0; 8], "shape says");
        }
    }

    #[test]
    fn what_holds_nothing_is_not_vast() {
        let file = |kind: &str, shape: &[usize]| read("a", &write(kind, shape, std::iter::empty()));
        for (kind, shape) in
            [("<f8", [0, 2_147_483_647]), ("<f8", [200_000_000, 0]), ("<U0", [1 << 40, 1])]
        {
            assert!(file(kind, &shape).is_err(), "{kind} {shape:?}");
        }
        assert!(file("<f8", &[0, 3]).is_ok());
    }
}
