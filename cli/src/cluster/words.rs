//! What a driver is told and tells, and what `ivx node exec` says of each key: a JSON object a line.

use ivx_cache::Digest;
use ivx_engine::Word;
use serde::{Deserialize, Serialize};

/// What a driver is told.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum Ask {
    /// To run some keys, one after another, on one machine.
    Run(Batch),
    /// To end a batch.
    Cancel {
        /// Which.
        cancel: u64,
    },
}

/// Some keys to run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Batch {
    /// What it is called.
    pub(super) run: u64,
    pub(super) keys: Vec<Digest>,
    /// How many threads it takes.
    pub(super) cpus: usize,
    pub(super) gpus: usize,
    /// How many bytes it takes, as far as they are worth counting.
    pub(super) memory: u64,
}

/// What a driver tells. One of the first six says which kind of thing.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Tell {
    /// It can begin, or has more room: what it runs on, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) ready: Option<String>,
    /// Something to know.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) note: Option<String>,
    /// It cannot begin, or go on, and why.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) failed: Option<String>,
    /// A batch whose machine is gone, and that runs again.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) lost: Option<u64>,
    /// A batch that has ended.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) done: Option<u64>,
    /// With `ready`: all threads.
    pub(super) cpus: usize,
    /// With `ready`: the threads of the largest machine.
    pub(super) largest_cpus: usize,
    /// With `ready`: the bytes of memory of the largest machine; 0 where nobody knows.
    pub(super) largest_memory: u64,
    /// With `lost`: what happened.
    pub(super) why: String,
    /// With `done`: how `ivx node exec` ended; below 0 if it did not.
    pub(super) code: i64,
    /// With `done`: what it said, line by line.
    pub(super) said: String,
    /// With `done`: the end of its standard error.
    pub(super) err: String,
}

/// What `ivx node exec` says of a key.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Said {
    pub(super) key: Digest,
    #[serde(flatten)]
    pub(super) word: SaidWord,
}

/// Its words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum SaidWord {
    /// Its result is on record for this platform.
    Done(String),
    /// Its operation failed.
    Failed(String),
    /// Bytes that it takes are nowhere.
    Missing(Digest),
    /// It was not begun.
    Refused(String),
}

/// What is said of keys in some lines; others are left out.
pub(super) fn words(said: &str) -> Vec<(Digest, Word)> {
    let said = said.lines().filter_map(|line| serde_json::from_str::<Said>(line).ok());
    let word = |Said { key, word }| {
        let word = match word {
            SaidWord::Done(platform) => Word::Done(platform),
            SaidWord::Failed(why) => Word::Failed(why),
            SaidWord::Missing(digest) => Word::Missing(digest),
            SaidWord::Refused(why) => Word::Refused(why),
        };
        (key, word)
    };
    said.map(word).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_as_they_are_written() {
        let key = Digest::of(b"key");
        let batch = Batch { run: 7, keys: vec![key], cpus: 2, gpus: 0, memory: 9 };
        for ask in [Ask::Run(batch), Ask::Cancel { cancel: 7 }] {
            let line = serde_json::to_string(&ask).expect("plain data");
            assert_eq!(serde_json::from_str::<Ask>(&line).expect("as written"), ask, "{line}");
        }
        assert_eq!(serde_json::to_string(&Ask::Cancel { cancel: 7 }).unwrap(), r#"{"cancel":7}"#);
        let said = Said { key, word: SaidWord::Failed("as told\n".to_owned()) };
        let line = serde_json::to_string(&said).expect("plain data");
        assert_eq!(line, format!(r#"{{"key":"{key}","failed":"as told\n"}}"#));
        let lines =
            format!("something else\n{line}\n{{\"key\":\"{key}\",\"refused\":\"stale\"}}\n");
        let refused = Word::Refused("stale".to_owned());
        assert_eq!(words(&lines), [(key, Word::Failed("as told\n".to_owned())), (key, refused)]);
        let tell: Tell = serde_json::from_str(r#"{"lost": 7, "why": "gone", "more": 1}"#).unwrap();
        assert_eq!(tell, Tell { lost: Some(7), why: "gone".to_owned(), ..Tell::default() });
    }
}
