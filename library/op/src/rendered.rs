//! Figures and tables: artifacts that are files to look at.

use std::collections::BTreeMap;

use crate::{Artifact, Data, Tensors};

macro_rules! rendered {
    ($($(#[doc = $doc:literal])+ $name:ident = $kind:literal;)+) => {$(
        $(#[doc = $doc])+
        #[derive(Clone, Debug, PartialEq, Eq)]
        pub struct $name {
            /// The text of each file by its extension, such as `svg`.
            pub files: BTreeMap<String, String>,
        }

        impl Artifact for $name {
            const KIND: &'static str = $kind;

            fn encode(&self) -> Vec<u8> {
                encode(Self::KIND, &self.files)
            }

            fn decode(bytes: &[u8]) -> Option<Self> {
                decode(Self::KIND, bytes).map(|files| Self { files })
            }
        }
    )+};
}

rendered! {
    /// A figure, as `svg`.
    Figure = "Figure";
    /// A table, as `md` and `csv`.
    Table = "Table";
}

fn encode(kind: &str, files: &BTreeMap<String, String>) -> Vec<u8> {
    let arrays =
        files.iter().map(|(name, text)| (name.clone(), Data::bytes(text.clone().into_bytes())));
    Tensors { arrays: arrays.collect() }.encode(kind, &())
}

fn decode(kind: &str, bytes: &[u8]) -> Option<BTreeMap<String, String>> {
    let (tensors, ()) = Tensors::decode(kind, bytes)?;
    let text =
        |data| if let Data::U8(_, bytes) = data { String::from_utf8(bytes).ok() } else { None };
    tensors.arrays.into_iter().map(|(name, data)| Some((name, text(data)?))).collect()
}
