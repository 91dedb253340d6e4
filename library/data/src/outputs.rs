//! What programs leave behind.

use std::collections::BTreeMap;

use ivx_op::{Artifact, Data, Tensors};

/// The files that a program wrote and that were asked for.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Outputs {
    /// They themselves, by name.
    pub files: BTreeMap<String, Blob>,
}

/// One file, whatever is in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Blob {
    /// What is in it.
    pub bytes: Vec<u8>,
    /// Whether it may be executed.
    pub is_executable: bool,
}

impl Blob {
    /// A file that nobody executes.
    #[must_use]
    pub fn plain(bytes: Vec<u8>) -> Self {
        Self { bytes, is_executable: false }
    }
}

impl Artifact for Outputs {
    const KIND: &'static str = "Outputs";

    fn encode(&self) -> Vec<u8> {
        // An array may not bear every name, so that the names are facts.
        let arrays = self.files.values().enumerate();
        let arrays = arrays.map(|(i, file)| (i.to_string(), Data::bytes(file.bytes.clone())));
        let names: Vec<(&String, bool)> =
            self.files.iter().map(|(name, file)| (name, file.is_executable)).collect();
        Tensors { arrays: arrays.collect() }.encode(Self::KIND, &names)
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, names) = Tensors::decode::<Vec<(String, bool)>>(Self::KIND, bytes)?;
        let files = names.into_iter().enumerate().map(|(i, (name, is_executable))| {
            match tensors.arrays.remove(&i.to_string())? {
                Data::U8(_, bytes) => Some((name, Blob { bytes, is_executable })),
                _ => None,
            }
        });
        files.collect::<Option<_>>().map(|files| Self { files })
    }
}

impl Artifact for Blob {
    const KIND: &'static str = "File";

    fn encode(&self) -> Vec<u8> {
        let arrays = [("bytes".to_owned(), Data::bytes(self.bytes.clone()))];
        Tensors { arrays: arrays.into() }.encode(Self::KIND, &self.is_executable)
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, is_executable) = Tensors::decode(Self::KIND, bytes)?;
        match tensors.arrays.remove("bytes")? {
            Data::U8(_, bytes) => Some(Self { bytes, is_executable }),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_survive_the_round_trip_whatever_they_are_called() {
        let file = |name: &str| Blob { bytes: name.into(), is_executable: name == "ü" };
        let files = ["a/b.json", "__metadata__", "ü"].map(|name| (name.to_owned(), file(name)));
        let outputs = Outputs { files: files.into() };
        assert_eq!(Outputs::decode(&outputs.encode()), Some(outputs));
        let blob = Blob { bytes: vec![0, 255], is_executable: true };
        assert_eq!(Blob::decode(&blob.encode()), Some(blob));
        assert_eq!(Outputs::decode(&Blob::plain(Vec::new()).encode()), None);
    }
}
