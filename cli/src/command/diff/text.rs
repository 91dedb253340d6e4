//! What `ivx diff` says to a person.

use std::io::{self, Write};

use super::because::{headline, own};
use super::{Pair, Told};
use crate::render::visible;

pub(super) fn write(told: &Told, out: &mut dyn Write) -> io::Result<()> {
    if told.is_same() {
        return writeln!(out, "no differences");
    }
    let mut line = |indent: usize, text: &str| writeln!(out, "{:indent$}{}", "", visible(text));
    line(0, &format!("{} -> {}", told.before, told.after))?;
    let is_one = told.pairs.len() == 1;
    for pair in told.pairs.iter().filter(|pair| !pair.is_same()) {
        if let Some(new) = pair.only {
            line(0, &format!("{} results of {}", if new { '+' } else { '-' }, pair.name))?;
            continue;
        }
        if !is_one {
            line(0, &format!("{}:", pair.name))?;
        }
        differences(pair, told.names_nodes, &mut line)?;
    }
    Ok(())
}

fn differences(
    pair: &Pair,
    names_nodes: bool,
    line: &mut impl FnMut(usize, &str) -> io::Result<()>,
) -> io::Result<()> {
    for change in &pair.changes {
        line(0, &change.to_string())?;
        for detail in change.details() {
            line(4, &detail)?;
        }
    }
    let Some(nodes) = &pair.nodes else {
        return line(0, "nodes are not compared: one side has no run.ron");
    };
    if nodes.blocks.is_empty() {
        return Ok(());
    }
    line(0, &format!("nodes: {}", nodes.summary()))?;
    for block in &nodes.blocks {
        let (head, reasons) = headline(block, &pair.changes);
        line(2, &head)?;
        for reason in reasons {
            line(4, &format!("- {reason}"))?;
        }
        for shift in &block.shifts {
            line(4, &own(shift, block))?;
            for node in shift.nodes.iter().filter(|_| names_nodes) {
                line(6, node)?;
            }
        }
    }
    Ok(())
}
