//! What programs leave behind.

use std::collections::BTreeMap;

use ivx_op::{Artifact, Data, Tensors};

/// The files that a program wrote and that were asked for.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Outputs {
    /// Their bytes by name.
    pub files: BTreeMap<String, Vec<u8>>,
}

/// One file, whatever is in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Blob(pub Vec<u8>);

impl Artifact for Outputs {
    const KIND: &'static str = "Outputs";

    fn encode(&self) -> Vec<u8> {
        // An array may not bear every name, so that the names are facts.
        let arrays = self.files.values().enumerate();
        let arrays = arrays.map(|(i, bytes)| (i.to_string(), Data::U8(bytes.clone())));
        let names: Vec<&String> = self.files.keys().collect();
        Tensors { arrays: arrays.collect() }.encode(Self::KIND, &names)
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, names) = Tensors::decode::<Vec<String>>(Self::KIND, bytes)?;
        let files = names.into_iter().enumerate().map(|(i, name)| {
            match tensors.arrays.remove(&i.to_string())? {
                Data::U8(bytes) => Some((name, bytes)),
                _ => None,
            }
        });
        files.collect::<Option<_>>().map(|files| Self { files })
    }
}

impl Artifact for Blob {
    const KIND: &'static str = "File";

    fn encode(&self) -> Vec<u8> {
        let arrays = [("bytes".to_owned(), Data::U8(self.0.clone()))];
        Tensors { arrays: arrays.into() }.encode(Self::KIND, &())
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, ()) = Tensors::decode(Self::KIND, bytes)?;
        match tensors.arrays.remove("bytes")? {
            Data::U8(bytes) => Some(Self(bytes)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_survive_the_round_trip_whatever_they_are_called() {
        let files = ["a/b.json", "__metadata__", "ü"].map(|name| (name.to_owned(), name.into()));
        let outputs = Outputs { files: files.into() };
        assert_eq!(Outputs::decode(&outputs.encode()), Some(outputs));
        let blob = Blob(vec![0, 255]);
        assert_eq!(Blob::decode(&blob.encode()), Some(blob));
        assert_eq!(Outputs::decode(&Blob(Vec::new()).encode()), None);
    }
}
