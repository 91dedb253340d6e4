//! What a run found out, whole: its results, and what became of its nodes.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use ivx_engine::{Ended, Made, Outcome, Plan, Results};
use serde::Deserialize;

/// What a run found out.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) results: Results,
    /// The nodes by address, where that is known.
    pub(crate) nodes: Option<BTreeMap<String, Made>>,
    /// The files beside the results that a rerun writes alike, by path in their folder; none where they were not
    /// kept.
    pub(crate) files: BTreeMap<String, String>,
}

/// The nodes in `run.ron`, or in what the cache keeps of a run.
#[derive(Deserialize)]
struct Nodes {
    nodes: BTreeMap<String, Made>,
}

impl Found {
    /// What the texts of `results.ron` and, if it is there, `run.ron` say; or why they do not read.
    pub(crate) fn of(results: &str, run: Option<&str>) -> Result<Self, String> {
        let results = Results::from_ron(results).map_err(|why| why.to_string())?;
        let nodes = run.and_then(|run| ron::from_str::<Nodes>(run).ok()).map(|run| run.nodes);
        Ok(Self { results, nodes, files: BTreeMap::new() })
    }

    /// From what the cache keeps.
    pub(crate) fn unpack(bytes: Vec<u8>) -> Result<Self, String> {
        let text = String::from_utf8(bytes).map_err(|why| why.to_string())?;
        let (results, rest) = text.split_once('\0').unwrap_or((&text, ""));
        let (nodes, files) = rest.split_once('\0').unwrap_or((rest, "{}"));
        let mut found = Self::of(results, Some(nodes))?;
        found.files = ron::from_str(files).map_err(|why| why.to_string())?;
        Ok(found)
    }
}

/// What the cache keeps of a run: nothing that varies from rerun to rerun, so that these share it.
///
/// - `results`: the text of its results.
/// - `files`: those beside it that a rerun writes alike.
pub(crate) fn pack(
    results: &str,
    files: &BTreeMap<String, String>,
    plan: &Plan,
    outcome: &Outcome,
) -> Vec<u8> {
    let mut nodes = outcome.made(plan);
    nodes.sort_unstable_by_key(|(address, _)| *address);
    let mut text = String::with_capacity(results.len() + 256 * (nodes.len() + 1));
    text.push_str(results);
    write(&mut text, &nodes, files).expect("strings take everything");
    text.into_bytes()
}

fn write(
    text: &mut String,
    nodes: &[(&str, Made)],
    files: &BTreeMap<String, String>,
) -> std::fmt::Result {
    // No text of RON has this one as itself.
    text.push_str("\0(nodes:{\n");
    for (address, made) in nodes {
        write!(text, "{address:?}:(")?;
        for (name, digest) in [("key", made.key), ("output", made.output)] {
            if let Some(digest) = digest {
                write!(text, "{name}:Some(\"{digest}\"),")?;
            }
        }
        if made.fate != Ended::Known {
            write!(text, "fate:{:?},", <&str>::from(made.fate))?;
        }
        for (name, own) in [("cause", &made.cause), ("explanation", &made.explanation)] {
            if let Some(own) = own {
                write!(text, "{name}:Some({own:?}),")?;
            }
        }
        text.push_str("),\n");
    }
    text.push_str("})\0{\n");
    for (path, content) in files {
        writeln!(text, "{path:?}:{content:?},")?;
    }
    text.push('}');
    Ok(())
}

#[cfg(test)]
mod tests {
    use ivx_cache::Digest;

    use super::*;

    #[test]
    fn what_is_packed_is_unpacked_whatever_it_is_called() {
        let odd = "e/x[label=\"q\\\" \n\0\u{301}é\u{1f600}\u{7f}]";
        let made = Made {
            key: Some(Digest([1; 32])),
            output: None,
            fate: Ended::Failed,
            cause: Some(odd.to_owned()),
            explanation: Some(format!("op x@1\narg {odd}\n")),
        };
        let results = Results { spec: odd.to_owned(), ..Results::default() };
        let mut text = results.to_ron();
        let files: BTreeMap<_, _> = [(odd.to_owned(), format!("<svg>\r\n{odd}"))].into();
        write(&mut text, &[(odd, made.clone()), ("f", Made::default())], &files)
            .expect("strings take everything");
        let found = Found::unpack(text.into_bytes()).expect("it reads");
        assert_eq!(found.results, results);
        assert_eq!(found.files, files);
        let expected = [(odd.to_owned(), made), ("f".to_owned(), Made::default())];
        assert_eq!(found.nodes, Some(expected.into()));
        assert!(Found::of("no results", None).is_err());
    }
}
