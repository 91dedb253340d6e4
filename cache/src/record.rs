//! What was computed, by what and with which result; and its bytes in a journal.

use std::sync::Arc;

use crate::Digest;

/// What is known of one key on one platform.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// What made the result.
    pub key: Digest,
    /// Where it was made: bit-equality is a promise per platform.
    pub platform: String,
    /// The result.
    pub output: Output,
    /// How it was made.
    pub provenance: Provenance,
}

/// A result: its digest, and its bytes if they are few.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    /// The digest of the bytes.
    pub digest: Digest,
    /// The number of bytes.
    pub size: u64,
    /// The bytes, up to [`INLINE_MAX`](crate::INLINE_MAX) of them; otherwise they are an object.
    pub inline: Option<Arc<[u8]>>,
}

/// How a result was made; nothing here is part of the key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Provenance {
    /// The operation, `name@version`.
    pub op: String,
    /// The address of the node, for people.
    pub node: String,
    /// The digests of the inputs.
    pub inputs: Vec<Digest>,
    /// The text of the walk that made the key.
    pub explanation: String,
    /// The digest of the library's source.
    pub library: String,
    /// How long it took, in milliseconds.
    pub millis: u64,
}

/// The bytes of a record: the fields in order of declaration, integers little-endian, texts
/// and lists preceded by their length in 4 bytes, an option by 0 or 1 in one byte.
///
/// # Panics
/// If inline bytes are not as many as the output's size, or a text exceeds 4 GiB.
pub(crate) fn encode(record: &Record) -> Vec<u8> {
    let Record { key, platform, output, provenance } = record;
    let Provenance { op, node, inputs, explanation, library, millis } = provenance;
    let mut bytes = Vec::with_capacity(512);
    bytes.extend(key.0);
    put_bytes(&mut bytes, platform.as_bytes());
    bytes.extend(output.digest.0);
    bytes.extend(output.size.to_le_bytes());
    bytes.push(u8::from(output.inline.is_some()));
    if let Some(inline) = &output.inline {
        assert_eq!(inline.len() as u64, output.size, "an inline output is whole");
        put_bytes(&mut bytes, inline);
    }
    put_bytes(&mut bytes, op.as_bytes());
    put_bytes(&mut bytes, node.as_bytes());
    put_len(&mut bytes, inputs.len());
    for input in inputs {
        bytes.extend(input.0);
    }
    put_bytes(&mut bytes, explanation.as_bytes());
    put_bytes(&mut bytes, library.as_bytes());
    bytes.extend(millis.to_le_bytes());
    bytes
}

fn put_bytes(bytes: &mut Vec<u8>, more: &[u8]) {
    put_len(bytes, more.len());
    bytes.extend_from_slice(more);
}

fn put_len(bytes: &mut Vec<u8>, len: usize) {
    bytes.extend(u32::try_from(len).expect("a field is below 4 GiB").to_le_bytes());
}

/// The record of these bytes; `None` if they are not exactly one record.
pub(crate) fn decode(mut bytes: &[u8]) -> Option<Record> {
    let rest = &mut bytes;
    let record = Record {
        key: Digest(*take(rest)?),
        platform: take_text(rest)?,
        output: take_output(rest)?,
        provenance: Provenance {
            op: take_text(rest)?,
            node: take_text(rest)?,
            inputs: take_digests(rest)?,
            explanation: take_text(rest)?,
            library: take_text(rest)?,
            millis: u64::from_le_bytes(*take(rest)?),
        },
    };
    rest.is_empty().then_some(record)
}

fn take_output(rest: &mut &[u8]) -> Option<Output> {
    let digest = Digest(*take(rest)?);
    let size = u64::from_le_bytes(*take(rest)?);
    let inline: Option<Arc<[u8]>> = match take(rest)? {
        [0] => None,
        [1] => Some(take_bytes(rest)?.into()),
        _ => return None,
    };
    let is_whole = |bytes: &Arc<[u8]>| bytes.len() as u64 == size && Digest::of(bytes) == digest;
    inline.as_ref().is_none_or(is_whole).then_some(Output { digest, size, inline })
}

fn take_digests(rest: &mut &[u8]) -> Option<Vec<Digest>> {
    let len = take_len(rest)?.checked_mul(32)?;
    let digests = rest.split_off(..len)?;
    Some(digests.as_chunks().0.iter().map(|bytes| Digest(*bytes)).collect())
}

fn take_text(rest: &mut &[u8]) -> Option<String> {
    str::from_utf8(take_bytes(rest)?).ok().map(str::to_owned)
}

fn take_bytes<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let len = take_len(rest)?;
    rest.split_off(..len)
}

fn take_len(rest: &mut &[u8]) -> Option<usize> {
    usize::try_from(u32::from_le_bytes(*take(rest)?)).ok()
}

fn take<'a, const N: usize>(rest: &mut &'a [u8]) -> Option<&'a [u8; N]> {
    let (first, after) = rest.split_first_chunk()?;
    *rest = after;
    Some(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(inline: Option<&[u8]>) -> Record {
        Record {
            key: Digest([1; 32]),
            platform: "x".into(),
            output: Output { digest: Digest::of(b"abc"), size: 3, inline: inline.map(Arc::from) },
            provenance: Provenance {
                op: "f@1".into(),
                node: "é".into(),
                inputs: vec![Digest([3; 32]), Digest([4; 32])],
                explanation: String::new(),
                library: "l".into(),
                millis: 258,
            },
        }
    }

    #[test]
    fn the_bytes_are_the_fields_in_order() {
        let mut expected = vec![1; 32];
        expected.extend(b"\x01\0\0\0x");
        expected.extend(Digest::of(b"abc").0);
        expected.extend(b"\x03\0\0\0\0\0\0\0");
        expected.extend(b"\x01\x03\0\0\0abc");
        expected.extend(b"\x03\0\0\0f@1");
        expected.extend(b"\x02\0\0\0\xc3\xa9");
        expected.extend(b"\x02\0\0\0");
        expected.extend([3; 32]);
        expected.extend([4; 32]);
        expected.extend(b"\0\0\0\0");
        expected.extend(b"\x01\0\0\0l");
        expected.extend(b"\x02\x01\0\0\0\0\0\0");
        assert_eq!(encode(&record(Some(b"abc"))), expected);
    }

    #[test]
    fn decoding_inverts_encoding() {
        for record in [record(Some(b"abc")), record(None)] {
            assert_eq!(decode(&encode(&record)), Some(record));
        }
    }

    #[test]
    fn other_bytes_are_no_record() {
        let bytes = encode(&record(Some(b"abc")));
        for len in 0..bytes.len() {
            assert_eq!(decode(&bytes[..len]), None, "cut at {len}");
        }
        assert_eq!(decode(&[&bytes[..], &[0]].concat()), None);
        let mut short = bytes.clone();
        short[69] = 2;
        assert_eq!(decode(&short), None, "fewer inline bytes than the size says");
        let mut other = bytes.clone();
        other[82] = b'A';
        assert_eq!(decode(&other), None, "inline bytes of another digest");
        let mut option = bytes;
        option[77] = 2;
        assert_eq!(decode(&option), None, "an option is 0 or 1");
    }
}
