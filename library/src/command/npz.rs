//! Named arrays as numpy keeps them: `.npz`, a zip archive of `.npy` files.

use std::collections::BTreeMap;

use ivx_op::{Data, exact, too_large};
use miniz_oxide::inflate::decompress_to_vec_with_limit;

use super::folder::MAX_OUTPUT;
use super::read::Columns;

/// The first bytes of an entry, of an entry of the directory, and of the directory's end.
const ENTRY: u32 = 0x0403_4b50;
const LISTED: u32 = 0x0201_4b50;
const END: u32 = 0x0605_4b50;
/// What an archive says in the place of a size that does not fit.
const TOO_LARGE: u32 = u32::MAX;

/// Arrays under their names, with their shapes, not compressed.
pub(super) fn write(arrays: &[(&str, &[usize], &[f64])]) -> Vec<u8> {
    let files = arrays.iter().map(|(name, shape, values)| {
        (*name, npy("<f8", shape, values.iter().flat_map(|x| x.to_le_bytes())))
    });
    archived(files)
}

/// The arrays of an artifact as an archive of numpy.
#[must_use]
pub fn npz(arrays: &BTreeMap<String, Data>) -> Vec<u8> {
    let files = arrays.iter().map(|(name, data)| {
        let file = match data {
            Data::F64(shape, xs) => npy("<f8", shape, xs.iter().flat_map(|x| x.to_le_bytes())),
            Data::F32(shape, xs) => npy("<f4", shape, xs.iter().flat_map(|x| x.to_le_bytes())),
            Data::U8(shape, bytes) => npy("|u1", shape, bytes.iter().copied()),
        };
        (name.as_str(), file)
    });
    archived(files)
}

fn archived<'a>(files: impl ExactSizeIterator<Item = (&'a str, Vec<u8>)>) -> Vec<u8> {
    let mut archive = Vec::new();
    let mut directory = Vec::new();
    let n_files = files.len();
    for (name, file) in files {
        let name = format!("{name}.npy");
        let start = size(archive.len());
        // Version 2.0, no flags, stored, at the beginning of 1980.
        let about: Vec<u8> = [
            &[20, 0, 0, 0, 0, 0, 0, 0, 0x21, 0][..],
            &crc32fast::hash(&file).to_le_bytes(),
            &size(file.len()).to_le_bytes(),
            &size(file.len()).to_le_bytes(),
            &short(name.len()).to_le_bytes(),
            &[0, 0],
        ]
        .concat();
        archive.extend([&ENTRY.to_le_bytes(), &about[..], name.as_bytes(), &file].concat());
        let place = [&[0; 10][..], &start.to_le_bytes()].concat();
        let listed = [&LISTED.to_le_bytes(), &[20, 0][..], &about, &place, name.as_bytes()];
        directory.extend(listed.concat());
    }
    let n = short(n_files).to_le_bytes();
    let (length, start) = (size(directory.len()).to_le_bytes(), size(archive.len()).to_le_bytes());
    let end = [&END.to_le_bytes(), &[0; 4][..], &n, &n, &length, &start, &[0, 0]].concat();
    [archive, directory, end].concat()
}

fn size(n: usize) -> u32 {
    u32::try_from(n).expect("data sets are far below 4 GiB")
}

fn short(n: usize) -> u16 {
    u16::try_from(n).expect("names and their number are small")
}

fn npy(kind: &str, shape: &[usize], bytes: impl Iterator<Item = u8>) -> Vec<u8> {
    let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
    let shape = shape.join(", ") + if shape.len() == 1 { "," } else { "" };
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
    // Numbers begin at a multiple of 64.
    let header =
        format!("{header:<width$}\n", width = (header.len() + 11).next_multiple_of(64) - 11);
    let length = short(header.len()).to_le_bytes();
    let mut file = [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes()].concat();
    file.extend(bytes);
    file
}

/// The arrays of an archive, under their names.
///
/// # Errors
/// What is wrong with it.
pub(super) fn read(bytes: &[u8]) -> Result<Columns, String> {
    let mut arrays = BTreeMap::new();
    let mut room = MAX_OUTPUT;
    for (name, file) in entries(bytes).ok_or("it is no zip archive, or a damaged one")? {
        let file = file.unpack(&mut room).map_err(|why| format!("`{name}` {why}"))?;
        let array = parse(&file).map_err(|why| format!("`{name}` {why}"))?;
        let name = name.strip_suffix(".npy").unwrap_or(&name).to_owned();
        if arrays.insert(name.clone(), array).is_some() {
            return Err(format!("two arrays are called `{name}`"));
        }
    }
    Ok(arrays)
}

/// One entry of an archive.
struct Entry<'a> {
    flags: u16,
    method: u16,
    checksum: u32,
    length: u32,
    packed: &'a [u8],
}

impl Entry<'_> {
    fn unpack(&self, room: &mut usize) -> Result<Vec<u8>, String> {
        let length = usize::try_from(self.length).unwrap_or(usize::MAX);
        *room = room.checked_sub(length).ok_or("is too large")?;
        if self.flags & 1 != 0 {
            return Err("is encrypted".to_owned());
        }
        let bytes = match self.method {
            0 => self.packed.to_vec(),
            8 => decompress_to_vec_with_limit(self.packed, length)
                .map_err(|_| "does not decompress to what it says")?,
            other => return Err(format!("is compressed by method {other}; 0 and 8 are read")),
        };
        if bytes.len() != length || crc32fast::hash(&bytes) != self.checksum {
            return Err("is damaged".to_owned());
        }
        Ok(bytes)
    }
}

/// The entries that the directory at the end lists; `None` if it does not read as one.
fn entries(bytes: &[u8]) -> Option<Vec<(String, Entry<'_>)>> {
    // The end is followed by a comment of at most 65535 bytes.
    let latest = bytes.len().checked_sub(22)?;
    let mut ends = (latest.saturating_sub(usize::from(u16::MAX))..=latest).rev();
    let end = ends.find(|at| u32_at(bytes, *at) == Some(END))?;
    let n = u16_at(bytes, end + 10)?;
    let mut at = usize::try_from(u32_at(bytes, end + 16)?).ok()?;
    let mut entries = Vec::new();
    for _ in 0..n {
        if u32_at(bytes, at)? != LISTED {
            return None;
        }
        let length = |from: usize| u16_at(bytes, at + from).map(usize::from);
        let (name, extra, comment) = (length(28)?, length(30)?, length(32)?);
        let (packed, unpacked) = (u32_at(bytes, at + 20)?, u32_at(bytes, at + 24)?);
        let start = u32_at(bytes, at + 42)?;
        if [packed, unpacked, start].contains(&TOO_LARGE) {
            return None;
        }
        let start = usize::try_from(start).ok()?;
        if u32_at(bytes, start)? != ENTRY {
            return None;
        }
        let before =
            usize::from(u16_at(bytes, start + 26)?) + usize::from(u16_at(bytes, start + 28)?);
        let data = bytes.get(start + 30 + before..)?;
        let entry = Entry {
            flags: u16_at(bytes, at + 8)?,
            method: u16_at(bytes, at + 10)?,
            checksum: u32_at(bytes, at + 16)?,
            length: unpacked,
            packed: data.get(..usize::try_from(packed).ok()?)?,
        };
        let name = std::str::from_utf8(bytes.get(at + 46..at + 46 + name)?).ok()?;
        entries.push((name.to_owned(), entry));
        at += 46 + name.len() + extra + comment;
    }
    Some(entries)
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    bytes.get(at..)?.first_chunk().map(|bytes| u16::from_le_bytes(*bytes))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|bytes| u32::from_le_bytes(*bytes))
}

/// The shape and the numbers of an `.npy` file.
fn parse(file: &[u8]) -> Result<(Vec<usize>, Vec<f64>), String> {
    let (header, data) = split(file).ok_or("is no array of NumPy")?;
    let field = |name: &str| {
        let rest = header.split_once(&format!("'{name}':"))?.1.trim_start();
        Some(match name {
            "shape" => rest.split_once(')')?.0.trim_start_matches('('),
            _ => rest.split_once(',')?.0,
        })
    };
    let missing = |name: &str| format!("has no `{name}`");
    let kind = field("descr").ok_or_else(|| missing("descr"))?.trim_matches('\'');
    let shape = field("shape").ok_or_else(|| missing("shape"))?;
    let sizes = shape.split(',').map(str::trim).filter(|size| !size.is_empty());
    let shape = sizes.map(|size| size.parse().ok()).collect::<Option<Vec<usize>>>();
    let shape = shape.ok_or("has no shape of numbers")?;
    if shape.len() > 1 && field("fortran_order") != Some("False") {
        return Err("is in Fortran order; save `np.ascontiguousarray` of it".to_owned());
    }
    let values = match kind {
        "<f8" => numbers(data, f64::from_le_bytes),
        "<f4" => numbers(data, |bytes| f64::from(f32::from_le_bytes(bytes))),
        "<i4" => numbers(data, |bytes| f64::from(i32::from_le_bytes(bytes))),
        "<i8" => whole(data)?,
        other => return Err(format!("holds `{other}`; `<f8`, `<f4`, `<i8` and `<i4` are read")),
    };
    let n = shape.iter().try_fold(1_usize, |n, size| n.checked_mul(*size));
    match values {
        Some(values) if n == Some(values.len()) => Ok((shape, values)),
        _ => Err("does not have the numbers that its shape says".to_owned()),
    }
}

fn split(file: &[u8]) -> Option<(&str, &[u8])> {
    let rest = file.strip_prefix(b"\x93NUMPY")?;
    let (length, rest) = match rest.first()? {
        1 => (usize::from(u16_at(rest, 2)?), rest.get(4..)?),
        2 | 3 => (usize::try_from(u32_at(rest, 2)?).ok()?, rest.get(6..)?),
        _ => return None,
    };
    let (header, data) = rest.split_at_checked(length)?;
    Some((std::str::from_utf8(header).ok()?, data))
}

/// The numbers; `None` if something is left over.
fn numbers<const N: usize>(data: &[u8], number: fn([u8; N]) -> f64) -> Option<Vec<f64>> {
    let (chunks, rest) = data.as_chunks();
    rest.is_empty().then(|| chunks.iter().map(|bytes| number(*bytes)).collect())
}

fn whole(data: &[u8]) -> Result<Option<Vec<f64>>, String> {
    let (chunks, rest) = data.as_chunks();
    let number = |bytes: &[u8; 8]| {
        let n = i64::from_le_bytes(*bytes);
        exact(n).ok_or_else(|| too_large(n))
    };
    let values = chunks.iter().map(number).collect::<Result<_, _>>()?;
    Ok(rest.is_empty().then_some(values))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Numbers of random bits, and those that are special.
    pub(in crate::command) fn random_numbers(n: usize) -> Vec<f64> {
        let special = [0.0, f64::MIN_POSITIVE, 5e-324, f64::MAX, f64::INFINITY, f64::EPSILON];
        let mut bits = 1_u64;
        let random = std::iter::repeat_with(move || {
            bits = bits
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            // The low bits of such a generator are not random.
            f64::from_bits(bits ^ (bits >> 33))
        });
        let subnormal = (1..200_u64).map(|i| f64::from_bits(i * 22_517_998_136_853));
        let negative = special.iter().map(|x| -x);
        special
            .into_iter()
            .chain(negative)
            .chain([f64::NAN])
            .chain(subnormal)
            .chain(random)
            .take(n)
            .collect()
    }

    #[test]
    fn every_number_comes_back() {
        let numbers = random_numbers(20_000);
        let arrays = read(&write(&[("x", &[numbers.len()], &numbers)])).unwrap();
        assert!(numbers.iter().zip(&arrays["x"].1).all(|(a, b)| a.to_bits() == b.to_bits()));
    }

    #[test]
    fn what_is_written_is_read_to_the_bit() {
        let (x, y) = ([0.1, f64::MIN_POSITIVE, -1e300], [2.0]);
        let bytes = write(&[("x", &[3], &x), ("y", &[1, 1], &y)]);
        let arrays = read(&bytes).unwrap();
        assert_eq!(arrays["x"], (vec![3], x.to_vec()));
        assert_eq!(arrays["y"], (vec![1, 1], y.to_vec()));
        assert_eq!(npy("<f8", &[3], [0; 24].into_iter()).len() % 64, 24);
    }

    #[test]
    fn files_of_numpy_are_read() {
        // np.savez(f, x=np.array([[1, 2], [3, 4]], "<i8"), y=np.float32(0.5)) and savez_compressed.
        for bytes in [&include_bytes!("npz/saved.npz")[..], include_bytes!("npz/compressed.npz")] {
            let arrays = read(bytes).unwrap();
            assert_eq!(arrays["x"], (vec![2, 2], vec![1.0, 2.0, 3.0, 4.0]));
            assert_eq!(arrays["y"], (vec![], vec![0.5]));
        }
    }

    #[test]
    fn every_flipped_byte_and_every_cut_is_an_error_or_harmless() {
        let bytes = include_bytes!("npz/compressed.npz");
        let whole = read(bytes).unwrap();
        for i in 0..bytes.len() {
            let mut flipped = bytes.to_vec();
            flipped[i] ^= 0xff;
            match read(&flipped) {
                // A name, a time or a comment; the checksum guards the numbers.
                Ok(read) => assert!(read.values().all(|array| whole.values().any(|w| w == array))),
                Err(why) => assert!(!why.is_empty()),
            }
            assert!(read(&bytes[..i]).is_err(), "cut at {i}");
        }
    }

    #[test]
    fn other_arrays_are_refused() {
        let check = |header: &str, data: &[u8], expected: &str| {
            let length = u16::try_from(header.len()).unwrap().to_le_bytes();
            let file = [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data].concat();
            let why = parse(&file).unwrap_err();
            assert!(why.contains(expected), "{why}");
        };
        let header = |kind: &str, order: &str, shape: &str| {
            format!("{{'descr': '{kind}', 'fortran_order': {order}, 'shape': {shape}, }}")
        };
        check(&header("|O", "False", "(1,)"), &[0; 8], "holds `|O`");
        check(&header("<f8", "True", "(1, 1)"), &[0; 8], "Fortran");
        check(&header("<f8", "False", "(2,)"), &[0; 8], "shape says");
        check(&header("<f8", "False", "(1,)"), &[0; 9], "shape says");
        check(&header("<i8", "False", "(1,)"), &i64::MAX.to_le_bytes(), "too large to be exact");
        check("{}", &[], "has no `descr`");
        let huge = format!("({0}, {0})", usize::MAX);
        check(&header("<f8", "False", &huge), &[0; 8], "shape says");
    }
}
