//! Records: results with fields, each of which is an artifact of its own.

use std::collections::BTreeMap;

use crate::{Artifact, Data, Tensors};

/// Declares a record that an operation results in.
///
/// A spec reads its fields by name, `run.success`. A node reads only those that it uses, so that
/// what depends on one field does not run again when another changes.
///
/// ```
/// use ivx_op::{Array, record};
///
/// record! {
///     /// What became of an agent.
///     pub struct Run = "Run" {
///         /// Whether it arrived, trial by trial.
///         success: Array [trial];
///         /// How far it came.
///         distance: Array;
///     }
/// }
/// ```
#[macro_export]
macro_rules! record {
    (
        $(#[doc = $doc:literal])+
        $vis:vis struct $ty:ident = $kind:literal {
            $( $(#[doc = $field_doc:literal])+ $field:ident: $field_ty:ty $([$($dim:ident),+])?; )+
        }
    ) => {
        $(#[doc = $doc])+
        #[derive(Clone, Debug, PartialEq)]
        $vis struct $ty { $( $(#[doc = $field_doc])+ pub $field: $field_ty, )+ }

        impl $crate::Artifact for $ty {
            const KIND: &'static str = $kind;
            const FIELDS: &'static [$crate::FieldDecl] = &[$( $crate::FieldDecl {
                name: stringify!($field),
                docs: concat!($($field_doc, "\n"),+),
                artifact: <$field_ty as $crate::Artifact>::KIND,
                dims: &[$($(stringify!($dim)),+)?],
            } ),+];

            fn encode(&self) -> Vec<u8> {
                let fields = [$( (stringify!($field), self.$field.encode()) ),+];
                $crate::AnyRecord(fields.map(|(name, bytes)| (name.to_owned(), bytes)).into())
                    .encode_as($kind)
            }

            fn decode(bytes: &[u8]) -> Option<Self> {
                let record = $crate::AnyRecord::decode_as($kind, bytes)?;
                Some(Self {
                    $( $field: $crate::Artifact::decode(record.0.get(stringify!($field))?)?, )+
                })
            }
        }
    };
}

/// The fields of a record of any kind, encoded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AnyRecord(pub BTreeMap<String, Vec<u8>>);

impl AnyRecord {
    /// The record as bytes.
    #[must_use]
    pub fn encode_as(&self, kind: &str) -> Vec<u8> {
        let arrays = self.0.iter().map(|(name, bytes)| (name.clone(), Data::bytes(bytes.clone())));
        Tensors { arrays: arrays.collect() }.encode(kind, &())
    }

    /// The fields of a record of this kind; `None` if the bytes are something else.
    #[must_use]
    pub fn decode_as(kind: &str, bytes: &[u8]) -> Option<Self> {
        let (tensors, ()) = Tensors::decode(kind, bytes)?;
        let fields = tensors.arrays.into_iter().map(|(name, data)| match data {
            Data::U8(_, bytes) => Some((name, bytes)),
            _ => None,
        });
        fields.collect::<Option<_>>().map(Self)
    }
}

/// The bytes of an artifact of any kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AnyArtifact(pub Vec<u8>);

impl Artifact for AnyArtifact {
    const KIND: &'static str = "Any";

    fn encode(&self) -> Vec<u8> {
        self.0.clone()
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        Some(Self(bytes.to_vec()))
    }
}

/// For the operation that reads one field of any record.
impl Artifact for AnyRecord {
    const KIND: &'static str = "Record";

    fn encode(&self) -> Vec<u8> {
        self.encode_as(Self::KIND)
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        Self::decode_as(&crate::kind_of(bytes)?, bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Array, Dim, Labels};

    record! {
        /// A toy.
        struct Toy = "Toy" {
            /// One number a trial.
            each: Array [trial];
            /// One number.
            all: Array;
        }
    }

    #[test]
    fn a_record_survives_the_round_trip_field_by_field() {
        let trial = Dim::new("trial", Labels::Numbers(vec![0.0, 1.0]));
        let toy = Toy { each: Array::series(trial, vec![0.5, 1.5]), all: Array::scalar(2.0) };
        let bytes = toy.encode();
        assert_eq!(Toy::decode(&bytes).as_ref(), Some(&toy));
        let AnyRecord(fields) = AnyRecord::decode(&bytes).unwrap();
        assert_eq!(fields.keys().collect::<Vec<_>>(), ["all", "each"]);
        assert_eq!(Array::decode(&fields["all"]), Some(Array::scalar(2.0)));
        assert_eq!(AnyRecord::decode_as("Other", &bytes), None);
        assert_eq!((Toy::FIELDS[0].dims, Toy::FIELDS[1].dims), (&["trial"][..], &[][..]));
    }
}
