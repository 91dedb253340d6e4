//! `run.ron`: what varies from run to run.

use std::fmt::Write as _;
use std::time::UNIX_EPOCH;

use ivx_engine::{Fate, Node, NodeIndex, platform};

use crate::account::Account;

/// What varies from run to run: where and when it was, and what became of each node.
///
/// Written by hand, since a run that has nothing to do does little else.
pub(super) fn run_file(run: &Account<'_>) -> String {
    let &Account { plan, outcome, jobs, began, took, .. } = run;
    let began = began.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let mut nodes: Vec<(&str, &Node)> = plan
        .graph
        .node_weights()
        .zip(&outcome.nodes)
        .map(|(step, node)| (step.address.as_str(), node))
        .collect();
    nodes.sort_unstable_by_key(|(address, _)| *address);
    let mut text = String::with_capacity(256 * (nodes.len() + 1));
    let address_of = |node: NodeIndex| plan.graph[node].address.as_str();
    write(&mut text, jobs, began, took.as_secs_f64(), &nodes, &address_of)
        .expect("strings take everything");
    text
}

/// - `began`: seconds since 1970.
fn write<'p>(
    text: &mut String,
    jobs: usize,
    began: u64,
    seconds: f64,
    nodes: &[(&str, &Node)],
    address_of: &dyn Fn(NodeIndex) -> &'p str,
) -> std::fmt::Result {
    let (version, platform) = (env!("CARGO_PKG_VERSION"), platform());
    write!(text, "(\n version: {version:?},\n platform: {platform:?},\n jobs: {jobs},\n")?;
    write!(text, " started: {began},\n seconds: {seconds:?},\n nodes: {{\n")?;
    for (address, node) in nodes {
        let (fate, millis) = match &node.fate {
            Fate::Waiting => ("waiting", 0),
            Fate::Hit => ("hit", 0),
            Fate::Ran { millis } => ("ran", *millis),
            Fate::Failed { .. } => ("failed", 0),
            Fate::Skipped { .. } => ("skipped", 0),
        };
        writeln!(text, "  {address:?}: (")?;
        let output = node.output.as_ref().map(|output| output.digest);
        for (name, digest) in [("key", node.key), ("output", output)] {
            match digest {
                Some(digest) => writeln!(text, "   {name}: Some(\"{digest}\"),")?,
                None => writeln!(text, "   {name}: None,")?,
            }
        }
        if let Fate::Skipped { cause } = node.fate {
            writeln!(text, "   cause: Some({:?}),", address_of(cause))?;
        }
        if let Some(explanation) = &node.explanation {
            writeln!(text, "   explanation: Some({explanation:?}),")?;
        }
        write!(text, "   fate: \"{fate}\",\n   millis: {millis},\n  ),\n")?;
    }
    text.push_str(" },\n)\n");
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use ivx_cache::{Digest, Output};
    use serde::Deserialize;

    use super::*;

    #[derive(Debug, PartialEq, Deserialize)]
    struct Read {
        version: String,
        platform: String,
        jobs: usize,
        started: u64,
        seconds: f64,
        nodes: BTreeMap<String, ReadNode>,
    }

    #[derive(Debug, PartialEq, Deserialize)]
    struct ReadNode {
        key: Option<String>,
        output: Option<String>,
        fate: String,
        millis: u64,
    }

    #[test]
    fn it_is_read_back_whatever_nodes_are_called() {
        let output = Output { digest: Digest([2; 32]), size: 0, inline: None };
        let ran = Node {
            key: Some(Digest([1; 32])),
            output: Some(output),
            fate: Fate::Ran { millis: 17 },
            explanation: None,
        };
        let odd = "e/x[label=\"q\\\" \n\0\u{301}é\u{1f600}\u{7f}]";
        let mut text = String::new();
        let nodes = [("a", &ran), (odd, &Node::default())];
        write(&mut text, 2, 5, 0.25, &nodes, &|_| "").expect("strings take everything");
        let read: Read = ron::from_str(&text).expect("it is RON");
        let ran = ReadNode {
            key: Some("01".repeat(32)),
            output: Some("02".repeat(32)),
            fate: "ran".to_owned(),
            millis: 17,
        };
        let waiting = ReadNode { key: None, output: None, fate: "waiting".to_owned(), millis: 0 };
        let expected = Read {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            platform: platform(),
            jobs: 2,
            started: 5,
            seconds: 0.25,
            nodes: [("a".to_owned(), ran), (odd.to_owned(), waiting)].into(),
        };
        assert_eq!(read, expected);
    }
}
