//! Artifacts: what operations compute, as bytes.
//!
//! Every artifact is a safetensors file whose metadata has one entry, `ivx`: the kind and
//! the small facts, as RON. One entry, because the crate writes metadata in hash order.

use std::collections::BTreeMap;

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::{FieldDecl, OpError, Shapes, exact, too_large};

/// A value that can travel along an edge of the graph and lie in the cache.
///
/// A fresh value and a cached one are the same bytes: results are encoded even when they
/// were just computed, and readers decode.
pub trait Artifact: Sized + Send + 'static {
    /// The name of the kind, as in `Dataset`.
    const KIND: &'static str;
    /// Its fields, if it is a record.
    const FIELDS: &'static [FieldDecl] = &[];
    /// The value as bytes. Equal values give equal bytes.
    fn encode(&self) -> Vec<u8>;
    /// Whether it can be kept.
    ///
    /// # Errors
    /// Why not.
    fn is_kept(&self) -> Result<(), OpError> {
        Ok(())
    }
    /// The value back; `None` if the bytes are not of this kind.
    fn decode(bytes: &[u8]) -> Option<Self>;

    /// What stands for a value of these shapes before it is computed, for the rules of what a part that holds it is used
    /// for; `None` if there is no such thing.
    #[must_use]
    fn later(_shapes: &Shapes) -> Option<Self> {
        None
    }
}

/// The content of an artifact file: named arrays and small facts.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Tensors {
    /// Named arrays.
    pub arrays: BTreeMap<String, Data>,
}

/// One array of an artifact file, with its shape.
#[derive(Clone, Debug, PartialEq)]
pub enum Data {
    /// Double precision.
    F64(Vec<usize>, Vec<f64>),
    /// Single precision.
    F32(Vec<usize>, Vec<f32>),
    /// Bytes.
    U8(Vec<usize>, Vec<u8>),
}

#[derive(Serialize, Deserialize)]
struct Header<F> {
    kind: String,
    facts: F,
}

impl Tensors {
    /// The bytes of an artifact of `kind` with `facts`.
    ///
    /// # Panics
    /// If an array does not fill its shape.
    #[must_use]
    pub fn encode<F: Serialize>(&self, kind: &str, facts: &F) -> Vec<u8> {
        let header = Header { kind: kind.to_owned(), facts };
        let header = ron::to_string(&header).expect("facts are plain data");
        let bytes: Vec<_> = self.arrays.iter().map(|(name, data)| (name, data.view())).collect();
        let views = bytes.iter().map(|(name, (dtype, shape, bytes))| {
            let view = TensorView::new(*dtype, shape.clone(), bytes).expect("shape fits the data");
            (name.as_str(), view)
        });
        let metadata = Some([("ivx".to_owned(), header)].into());
        safetensors::serialize(views, metadata).expect("named arrays serialise")
    }

    /// The arrays and facts of an artifact of `kind`; `None` if the bytes are something else.
    #[must_use]
    pub fn decode<F: DeserializeOwned>(kind: &str, bytes: &[u8]) -> Option<(Self, F)> {
        let (_, metadata) = SafeTensors::read_metadata(bytes).ok()?;
        let header = metadata.metadata().as_ref()?.get("ivx")?;
        let header: Header<F> = ron::from_str(header).ok()?;
        if header.kind != kind {
            return None;
        }
        let file = SafeTensors::deserialize(bytes).ok()?;
        let mut arrays = BTreeMap::new();
        for (name, view) in file.iter() {
            arrays.insert(name.to_owned(), Data::from_view(&view)?);
        }
        Some((Self { arrays }, header.facts))
    }

    /// Takes a double-precision array out.
    pub fn f64(&mut self, name: &str) -> Option<(Vec<usize>, Vec<f64>)> {
        match self.arrays.remove(name)? {
            Data::F64(shape, values) => Some((shape, values)),
            _ => None,
        }
    }

    /// Takes an array of bytes out.
    pub fn u8(&mut self, name: &str) -> Option<(Vec<usize>, Vec<u8>)> {
        match self.arrays.remove(name)? {
            Data::U8(shape, values) => Some((shape, values)),
            _ => None,
        }
    }

    /// Takes a single-precision array out.
    pub fn f32(&mut self, name: &str) -> Option<(Vec<usize>, Vec<f32>)> {
        match self.arrays.remove(name)? {
            Data::F32(shape, values) => Some((shape, values)),
            _ => None,
        }
    }
}

impl Data {
    /// Bytes in a row.
    #[must_use]
    pub fn bytes(bytes: Vec<u8>) -> Self {
        Self::U8(vec![bytes.len()], bytes)
    }

    fn view(&self) -> (Dtype, Vec<usize>, Vec<u8>) {
        match self {
            Self::F64(shape, values) => {
                (Dtype::F64, shape.clone(), values.iter().flat_map(|x| x.to_le_bytes()).collect())
            }
            Self::F32(shape, values) => {
                (Dtype::F32, shape.clone(), values.iter().flat_map(|x| x.to_le_bytes()).collect())
            }
            Self::U8(shape, values) => (Dtype::U8, shape.clone(), values.clone()),
        }
    }

    fn from_view(view: &TensorView<'_>) -> Option<Self> {
        let (shape, bytes) = (view.shape().to_vec(), view.data());
        match view.dtype() {
            Dtype::F64 => {
                let (words, _) = bytes.as_chunks();
                Some(Self::F64(shape, words.iter().map(|w| f64::from_le_bytes(*w)).collect()))
            }
            Dtype::F32 => {
                let (words, _) = bytes.as_chunks();
                Some(Self::F32(shape, words.iter().map(|w| f32::from_le_bytes(*w)).collect()))
            }
            Dtype::U8 => Some(Self::U8(shape, bytes.to_vec())),
            _ => None,
        }
    }
}

/// The arrays of any safetensors file, and its metadata.
///
/// # Errors
/// What is wrong with it, for the author of a spec.
pub fn read_tensors(bytes: &[u8]) -> Result<(Tensors, BTreeMap<String, String>), String> {
    let unread = |error| format!("it is no safetensors file: {error}");
    let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(unread)?;
    let metadata = metadata.metadata().iter().flatten();
    let metadata = metadata.map(|(key, value)| (key.clone(), value.clone())).collect();
    let file = SafeTensors::deserialize(bytes).map_err(unread)?;
    let arrays = file.iter().map(|(name, view)| match Data::from_view(&view) {
        Some(data) => Ok((name.to_owned(), data)),
        None => Err(format!("`{name}` is of {:?}; F64, F32 and U8 are read", view.dtype())),
    });
    let arrays = arrays.collect::<Result<_, _>>()?;
    Ok((Tensors { arrays }, metadata))
}

/// The shape of an array and its numbers, last dimension fastest.
pub type Numbers = (Vec<usize>, Vec<f64>);

/// The arrays of any safetensors file as numbers, by name.
///
/// # Errors
/// What is wrong with it, for the author of a spec.
pub fn read_numbers(bytes: &[u8]) -> Result<BTreeMap<String, Numbers>, String> {
    let unread = |error| format!("it is no safetensors file: {error}");
    let file = SafeTensors::deserialize(bytes).map_err(unread)?;
    let arrays = file.iter().map(|(name, view)| {
        let numbers = numbers(&view).map_err(|why| format!("`{name}` {why}"))?;
        Ok((name.to_owned(), (view.shape().to_vec(), numbers)))
    });
    arrays.collect()
}

fn numbers(view: &TensorView<'_>) -> Result<Vec<f64>, String> {
    macro_rules! each {
        ($ty:ty, $number:expr) => {{
            let (chunks, _) = view.data().as_chunks();
            let number: fn($ty) -> Result<f64, String> = $number;
            chunks.iter().map(|bytes| number(<$ty>::from_le_bytes(*bytes))).collect()
        }};
    }
    match view.dtype() {
        Dtype::F64 => each!(f64, Ok),
        Dtype::F32 => each!(f32, |x| Ok(f64::from(x))),
        Dtype::F16 => each!(u16, |bits| Ok(half(bits))),
        // The upper half of a number in single precision.
        Dtype::BF16 => each!(u16, |bits| Ok(f64::from(f32::from_bits(u32::from(bits) << 16)))),
        Dtype::BOOL | Dtype::U8 => each!(u8, |n| Ok(f64::from(n))),
        Dtype::I8 => each!(i8, |n| Ok(f64::from(n))),
        Dtype::I16 => each!(i16, |n| Ok(f64::from(n))),
        Dtype::U16 => each!(u16, |n| Ok(f64::from(n))),
        Dtype::I32 => each!(i32, |n| Ok(f64::from(n))),
        Dtype::U32 => each!(u32, |n| Ok(f64::from(n))),
        Dtype::I64 => each!(i64, |n| exact(n).ok_or_else(|| too_large(n))),
        Dtype::U64 => each!(u64, |n| {
            let number = i64::try_from(n).ok().and_then(exact);
            number.ok_or_else(|| too_large(n))
        }),
        other => Err(format!("is of {other:?}, which is not read")),
    }
}

/// The number of IEEE 754 in half precision that some bits are.
#[must_use]
pub fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (bits >> 10 & 0x1f, f64::from(bits & 0x3ff));
    let size = match exponent {
        0 => fraction * (-24.0_f64).exp2(),
        0x1f if fraction == 0.0 => f64::INFINITY,
        0x1f => f64::NAN,
        _ => (fraction + 1024.0) * (f64::from(exponent) - 25.0).exp2(),
    };
    if bits >> 15 == 1 { -size } else { size }
}

/// The kind of an artifact file; `None` if it is none.
#[must_use]
pub fn kind_of(bytes: &[u8]) -> Option<String> {
    let (_, metadata) = SafeTensors::read_metadata(bytes).ok()?;
    let header = metadata.metadata().as_ref()?.get("ivx")?;
    ron::from_str::<Header<ron::Value>>(header).ok().map(|header| header.kind)
}

/// The largest relative difference between the numbers of two artifacts; `None` if they differ in
/// anything else.
///
/// Relative is to the larger of the two and of 1. Equal not-a-numbers do not differ.
#[must_use]
pub fn distance(a: &[u8], b: &[u8]) -> Option<f64> {
    let read = |bytes| {
        let (_, metadata) = SafeTensors::read_metadata(bytes).ok()?;
        let header = metadata.metadata().as_ref()?.get("ivx")?.clone();
        let file = SafeTensors::deserialize(bytes).ok()?;
        let arrays =
            file.iter().map(|(name, view)| Some((name.to_owned(), Data::from_view(&view)?)));
        Some((header, arrays.collect::<Option<BTreeMap<_, _>>>()?))
    };
    let ((header, first), (other, second)) = (read(a)?, read(b)?);
    if header != other || !first.keys().eq(second.keys()) {
        return None;
    }
    first.iter().zip(second.values()).try_fold(0.0, |most: f64, ((_, a), b)| {
        let by = match (a, b) {
            (Data::F64(shape, a), Data::F64(other, b)) if shape == other => {
                a.iter().zip(b).map(|(a, b)| relative(*a, *b)).fold(0.0, f64::max)
            }
            (Data::F32(shape, a), Data::F32(other, b)) if shape == other => {
                let pairs = a.iter().zip(b);
                pairs.map(|(a, b)| relative(f64::from(*a), f64::from(*b))).fold(0.0, f64::max)
            }
            (Data::U8(shape, a), Data::U8(other, b)) if (shape, a) == (other, b) => 0.0,
            // The fields of a record are artifacts themselves.
            (Data::U8(_, a), Data::U8(_, b)) => distance(a, b)?,
            _ => return None,
        };
        Some(most.max(by))
    })
}

fn relative(a: f64, b: f64) -> f64 {
    if a == b || a.is_nan() && b.is_nan() {
        return 0.0;
    }
    let by = (a - b).abs() / a.abs().max(b.abs()).max(1.0);
    if by.is_nan() { f64::INFINITY } else { by }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_every_size_are_read() {
        let check = |dtype: Dtype, data: &[u8], expected: Result<f64, &str>| {
            let view = TensorView::new(dtype, vec![1], data).unwrap();
            let bytes = safetensors::serialize([("a", view)], None).unwrap();
            let expected = expected.map(|x| [("a".to_owned(), (vec![1], vec![x]))].into());
            match expected {
                Ok(arrays) => assert_eq!(read_numbers(&bytes), Ok(arrays)),
                Err(why) => assert!(read_numbers(&bytes).unwrap_err().contains(why)),
            }
        };
        check(Dtype::F64, &0.1_f64.to_le_bytes(), Ok(0.1));
        check(Dtype::F32, &0.5_f32.to_le_bytes(), Ok(0.5));
        // As NumPy and PyTorch read them: a third, minus two, the largest.
        check(Dtype::F16, &0x3555_u16.to_le_bytes(), Ok(0.333_251_953_125));
        check(Dtype::F16, &0xc000_u16.to_le_bytes(), Ok(-2.0));
        check(Dtype::F16, &0x7bff_u16.to_le_bytes(), Ok(65504.0));
        check(Dtype::F16, &1_u16.to_le_bytes(), Ok(5.960_464_477_539_063e-8));
        check(Dtype::BF16, &0xc000_u16.to_le_bytes(), Ok(-2.0));
        check(Dtype::BOOL, &[1], Ok(1.0));
        check(Dtype::I8, &[255], Ok(-1.0));
        check(Dtype::U16, &[1, 1], Ok(257.0));
        check(Dtype::I64, &(-7_i64).to_le_bytes(), Ok(-7.0));
        check(Dtype::I64, &i64::MAX.to_le_bytes(), Err("`a` holds 9223372036854775807"));
        check(Dtype::U64, &u64::MAX.to_le_bytes(), Err("too large to be exact"));
        assert!(read_numbers(b"{}").unwrap_err().contains("no safetensors file"));
    }

    #[test]
    fn numbers_may_be_close_and_nothing_else() {
        let artifact = |values: Vec<f64>, fact: u8| {
            let arrays = [("x".to_owned(), Data::F64(vec![values.len()], values))];
            Tensors { arrays: arrays.into() }.encode("Toy", &fact)
        };
        let a = artifact(vec![1.0, 200.0, f64::NAN], 1);
        let close = distance(&a, &artifact(vec![1.0, 201.0, f64::NAN], 1)).unwrap();
        assert!((close - 1.0 / 201.0).abs() < 1e-15, "{close}");
        assert_eq!(distance(&a, &a), Some(0.0));
        assert_eq!(distance(&a, &artifact(vec![1.0, 200.0, 3.0], 1)), Some(f64::INFINITY));
        assert_eq!(distance(&a, &artifact(vec![1.0, 200.0], 1)), None);
        assert_eq!(distance(&a, &artifact(vec![1.0, 200.0, f64::NAN], 2)), None);
        let nested = |inner: Vec<u8>| {
            Tensors { arrays: [("field".to_owned(), Data::bytes(inner))].into() }.encode("Rec", &())
        };
        let by = distance(&nested(a), &nested(artifact(vec![1.5, 200.0, f64::NAN], 1)));
        assert!((by.unwrap() - 1.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn arrays_and_facts_survive_the_round_trip() {
        let arrays = BTreeMap::from([
            ("w".to_owned(), Data::F32(vec![2, 1], vec![1.5, -0.25])),
            ("a".to_owned(), Data::F64(vec![1], vec![f64::NAN])),
            ("text".to_owned(), Data::U8(vec![3, 1], b"abc".to_vec())),
        ]);
        let bytes = Tensors { arrays }.encode("Toy", &(7_u8, "x"));
        assert_eq!(bytes, {
            let (back, facts) = Tensors::decode::<(u8, String)>("Toy", &bytes).expect("decodes");
            back.encode("Toy", &facts)
        });
        assert_eq!(kind_of(&bytes).as_deref(), Some("Toy"));
        assert_eq!(Tensors::decode::<(u8, String)>("Other", &bytes), None);
        assert_eq!(Tensors::decode::<(u8, String)>("Toy", &bytes[..20]), None);
    }
}
