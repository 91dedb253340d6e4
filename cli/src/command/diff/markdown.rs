//! What `ivx diff` says in a comment on a pull request.

use std::io::{self, Write};

use ivx_engine::{Change, code};

use super::because::{headline, own};
use super::{Nodes, Pair, Told};
use crate::render::visible;

/// How many changes are listed before the rest is counted: a comment takes 65 536 characters.
const MOST: usize = 50;
/// How many kinds of nodes are.
const MOST_BLOCKS: usize = 20;

pub(super) fn write(told: &Told, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "### {} → {}\n", quoted(&told.before), quoted(&told.after))?;
    if told.is_same() {
        return writeln!(out, "No differences.");
    }
    let is_one = told.pairs.len() == 1;
    for (i, pair) in told.pairs.iter().filter(|pair| !pair.is_same()).enumerate() {
        if i > 0 {
            writeln!(out)?;
        }
        match pair.only {
            Some(true) => writeln!(out, "**{}** is new.", quoted(&pair.name))?,
            Some(false) => writeln!(out, "**{}** is gone.", quoted(&pair.name))?,
            None => {
                if !is_one {
                    writeln!(out, "#### {}\n", quoted(&pair.name))?;
                }
                differences(pair, told.names_nodes, out)?;
            }
        }
    }
    Ok(())
}

fn differences(pair: &Pair, names_nodes: bool, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "{}\n", counts(&pair.changes))?;
    // What is to be looked at first comes first.
    let mut changes: Vec<&Change> = pair.changes.iter().collect();
    changes.sort_by_key(|change| change.sign() != '!');
    for change in changes.iter().take(MOST) {
        let ((kind, name), how) = (change.subject(), change.how());
        let mark = match change.sign() {
            '+' => "new ",
            '-' => "gone: ",
            _ => "",
        };
        write!(out, "- {mark}**{kind}** {}", quoted(name))?;
        writeln!(out, "{}", if how.is_empty() { how } else { format!(": {}", quoted(&how)) })?;
        for detail in change.details() {
            writeln!(out, "  - {}", quoted(&detail))?;
        }
    }
    if changes.len() > MOST {
        writeln!(out, "- and {} more", changes.len() - MOST)?;
    }
    match &pair.nodes {
        None => writeln!(out, "\nNodes are not compared: one side has no `run.ron`."),
        Some(nodes) if nodes.blocks.is_empty() => Ok(()),
        Some(nodes) => of_nodes(nodes, &pair.changes, names_nodes, out),
    }
}

/// `**1 claim flipped, 2 measures moved**`
fn counts(changes: &[Change]) -> String {
    let count = |is: fn(&Change) -> bool| changes.iter().filter(|change| is(change)).count();
    let all = [
        (count(|c| matches!(c, Change::Claim { .. })), "claim", " flipped"),
        (count(|c| matches!(c, Change::Measure { .. })), "measure", " moved"),
        (count(|c| matches!(c, Change::File { .. })), "figure or table", " changed"),
        (count(|c| matches!(c, Change::Param { .. })), "parameter", " changed"),
        (
            count(|c| matches!(c, Change::Only { .. } | Change::Failure { .. })),
            "other difference",
            "",
        ),
    ];
    let told = all.iter().filter(|(n, ..)| *n > 0).map(|(n, what, how)| match (*n, *what) {
        (1, _) => format!("1 {what}{how}"),
        (n, "figure or table") => format!("{n} figures and tables{how}"),
        (n, _) => format!("{n} {what}s{how}"),
    });
    let told: Vec<String> = told.collect();
    if told.is_empty() {
        "**The results are the same.**".to_owned()
    } else {
        format!("**{}**", told.join(", "))
    }
}

fn of_nodes(
    nodes: &Nodes,
    changes: &[Change],
    names_nodes: bool,
    out: &mut dyn Write,
) -> io::Result<()> {
    writeln!(out, "\n<details><summary>nodes: {}</summary>\n", nodes.summary())?;
    for block in nodes.blocks.iter().take(MOST_BLOCKS) {
        let (head, reasons) = headline(block, changes);
        let (what, why) = head.split_once(" because ").unwrap_or((&head, ""));
        let why = if why.is_empty() { String::new() } else { format!(" because {}", quoted(why)) };
        writeln!(out, "- {what}{why}")?;
        for reason in reasons {
            writeln!(out, "  - because {}", quoted(&reason))?;
        }
        for shift in &block.shifts {
            writeln!(out, "  - {}", quoted(&own(shift, block)))?;
            for node in shift.nodes.iter().filter(|_| names_nodes) {
                writeln!(out, "    - {}", quoted(node))?;
            }
        }
    }
    if nodes.blocks.len() > MOST_BLOCKS {
        writeln!(out, "- and {} other reasons", nodes.blocks.len() - MOST_BLOCKS)?;
    }
    writeln!(out, "\n</details>")
}

/// As code, so that nothing in it is Markdown, a link or somebody's name.
fn quoted(text: &str) -> String {
    code(&visible(text))
}
