//! Named arrays as numpy keeps them: `.npz`, a zip archive of `.npy` files.

use std::collections::BTreeMap;

use ivx_op::Data;
use miniz_oxide::inflate::decompress_to_vec_with_limit;

use crate::npy;
use crate::table::Column;

/// Most bytes of all arrays of an archive together: they are held in memory.
const MOST: usize = 256 << 20;

/// The first bytes of an entry, of an entry of the directory, and of the directory's end.
const ENTRY: u32 = 0x0403_4b50;
const LISTED: u32 = 0x0201_4b50;
const END: u32 = 0x0605_4b50;
/// What an archive says in the place of a size that does not fit.
const TOO_LARGE: u32 = u32::MAX;

/// Arrays under their names, with their shapes, not compressed.
#[must_use]
pub fn write(arrays: &[(&str, &[usize], &[f64])]) -> Vec<u8> {
    let files = arrays.iter().map(|(name, shape, values)| {
        (*name, npy::write("<f8", shape, values.iter().flat_map(|x| x.to_le_bytes())))
    });
    archived(files)
}

/// The arrays of an artifact as an archive of numpy.
#[must_use]
pub fn npz(arrays: &BTreeMap<String, Data>) -> Vec<u8> {
    let files = arrays.iter().map(|(name, data)| {
        let file = match data {
            Data::F64(shape, xs) => {
                npy::write("<f8", shape, xs.iter().flat_map(|x| x.to_le_bytes()))
            }
            Data::F32(shape, xs) => {
                npy::write("<f4", shape, xs.iter().flat_map(|x| x.to_le_bytes()))
            }
            Data::U8(shape, bytes) => npy::write("|u1", shape, bytes.iter().copied()),
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

/// The arrays of an archive, by name.
///
/// # Errors
/// What is wrong with it.
pub fn read(bytes: &[u8]) -> Result<Vec<Column>, String> {
    let mut arrays = BTreeMap::new();
    let mut room = MOST;
    for (name, file) in entries(bytes).ok_or("it is no zip archive, or a damaged one")? {
        let file = file.unpack(&mut room).map_err(|why| format!("`{name}` {why}"))?;
        let name = name.strip_suffix(".npy").unwrap_or(&name);
        let array = npy::read(name, &file).map_err(|why| format!("`{name}` {why}"))?;
        if arrays.insert(name.to_owned(), array).is_some() {
            return Err(format!("two arrays are called `{name}`"));
        }
    }
    Ok(arrays.into_values().collect())
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

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::table::Values;

    /// Numbers of random bits, and those that are special.
    pub(crate) fn random_numbers(n: usize) -> Vec<f64> {
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

    fn array(name: &str, shape: &[usize], numbers: &[f64]) -> Column {
        let (len, item) = (shape.first().copied(), shape.iter().skip(1).copied().collect());
        Column { name: name.to_owned(), len, item, values: Values::Numbers(numbers.to_vec()) }
    }

    #[test]
    fn every_number_comes_back() {
        let numbers = random_numbers(20_000);
        let arrays = read(&write(&[("x", &[numbers.len()], &numbers)])).unwrap();
        let Values::Numbers(back) = &arrays[0].values else { panic!("they are numbers") };
        assert!(numbers.iter().zip(back).all(|(a, b)| a.to_bits() == b.to_bits()));
    }

    #[test]
    fn what_is_written_is_read_to_the_bit() {
        let (x, y) = ([0.1, f64::MIN_POSITIVE, -1e300], [2.0]);
        let bytes = write(&[("x", &[3], &x), ("y", &[1, 1], &y)]);
        let arrays = read(&bytes).unwrap();
        assert_eq!(arrays, [array("x", &[3], &x), array("y", &[1, 1], &y)]);
        assert_eq!(npy::write("<f8", &[3], [0; 24].into_iter()).len() % 64, 24);
    }

    #[test]
    fn files_of_numpy_are_read() {
        // np.savez(f, x=np.array([[1, 2], [3, 4]], "<i8"), y=np.float32(0.5)) and savez_compressed.
        for bytes in [&include_bytes!("npz/saved.npz")[..], include_bytes!("npz/compressed.npz")] {
            let arrays = read(bytes).unwrap();
            assert_eq!(
                arrays,
                [array("x", &[2, 2], &[1.0, 2.0, 3.0, 4.0]), array("y", &[], &[0.5])]
            );
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
                Ok(read) => {
                    let known = |own: &Column| {
                        whole.iter().any(|w| w.values == own.values && w.shape() == own.shape())
                    };
                    assert!(read.iter().all(known));
                }
                Err(why) => assert!(!why.is_empty()),
            }
            assert!(read(&bytes[..i]).is_err(), "cut at {i}");
        }
    }
}
