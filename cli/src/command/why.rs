//! `ivx why`

mod json;
mod text;

use std::collections::BTreeSet;
use std::io::{self, Write};

use ivx_cache::Cache;
use ivx_engine::{NodeIndex, Plan, consult, expand, platform};
use ivx_grammar::suggest;

use super::{Ready, ready};
use crate::args::StoreMode;
use crate::render::safe;
use crate::setter::{Setter, setter};
pub(super) use json::part;

use crate::{OK, Trouble, WRONG, args, project, store};

/// What telling of a node needs beside what is told.
struct Told<'a> {
    ready: &'a Ready,
    plan: &'a Plan,
}

pub(crate) fn why(
    args: &args::Why,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let Some(ready) = ready(&args.spec, err)? else { return Ok(WRONG) };
    let plan = expand(&ready.spec, &ready.registry);
    let nodes = matching(&plan, &args.node);
    if nodes.is_empty() {
        unknown(&plan, &args.node, err)?;
        return Ok(WRONG);
    }
    let mut cache = Cache::look(&project::cache(&ready.loaded.root), &platform())?;
    store::attach(&args.store, StoreMode::Read, &mut cache, err)?;
    consult(&plan, &ready.registry, &mut cache);
    store::notes(&mut cache, err)?;
    let all = ivx_engine::why(&plan, &ready.registry, &cache, &nodes)?;
    let told = Told { ready: &ready, plan: &plan };
    if args.format == args::Format::Json {
        json::write(&told, &all, out)?;
        return Ok(OK);
    }
    let mut text = Vec::new();
    if all.iter().any(|why| !plan.graph[why.node].address.starts_with(&args.node)) {
        writeln!(text, "{} has nodes that equal others, which they are told as:", args.node)?;
    }
    match &all[..] {
        [one] => text::one(&told, one, &mut text)?,
        all => text::several(&told, &args.node, all, &mut text)?,
    }
    // Records may come from anyone's archive.
    write!(out, "{}", safe(&String::from_utf8_lossy(&text)))?;
    Ok(OK)
}

/// Says that no node has this name, and which was perhaps meant.
pub(super) fn unknown(plan: &Plan, name: &str, err: &mut dyn Write) -> io::Result<()> {
    let addresses = || {
        let own = plan.graph.node_weights().map(|step| step.address.as_str());
        own.chain(plan.aliases.keys().map(String::as_str))
    };
    let help = suggest(name, addresses().map(stem));
    let help = help.or_else(|| suggest(name, addresses()));
    let help = help.unwrap_or_else(|| "`ivx plan --nodes` lists them".to_owned());
    writeln!(err, "error: no node is called `{name}`: {help}")
}

/// The nodes that a name means: the one that it is an address of, else those that it is the
/// beginning of, up to where a word ends if there are such.
pub(super) fn matching(plan: &Plan, name: &str) -> Vec<NodeIndex> {
    let own = plan.graph.node_indices().map(|node| (plan.graph[node].address.as_str(), node));
    let others = plan.aliases.iter().map(|(address, node)| (address.as_str(), *node));
    let mut found = BTreeSet::new();
    let mut is_whole = false;
    for (address, node) in own.chain(others) {
        let Some(rest) = address.strip_prefix(name) else { continue };
        if rest.is_empty() {
            return vec![node];
        }
        let goes_on = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.');
        let ends = !rest.starts_with(goes_on);
        if ends && !is_whole {
            found.clear();
            is_whole = true;
        }
        if ends == is_whole {
            found.insert(node);
        }
    }
    found.into_iter().collect()
}

/// An address without its coordinates and its member.
fn stem(address: &str) -> &str {
    let stem = address.split('[').next().unwrap_or(address);
    stem.split("/member").next().unwrap_or(stem)
}

impl Told<'_> {
    /// The parameter that a description of a node is, and who set it.
    fn setter(&self, node: NodeIndex, part: &ivx_engine::Part) -> Option<Setter> {
        let ivx_engine::Part::Argument(path) = part else { return None };
        let (Ready { loaded, spec, registry, .. }, address) =
            (self.ready, &self.plan.graph[node].address);
        setter(&loaded.project, spec, registry, address, path)
    }
}

#[cfg(test)]
mod tests {
    use ivx_engine::Step;
    use ivx_op::Args;

    use super::*;

    #[test]
    fn a_name_means_a_node_or_those_that_it_begins() {
        let mut plan = Plan::default();
        let addresses =
            ["e/a[seed=1]", "e/a[seed=10]", "e/ab", "e/ab/mean", "e/c/member[0]", "f/x"];
        for address in addresses {
            plan.graph.add_node(Step {
                address: address.into(),
                op: "op".into(),
                args: Args::new(),
                held: vec![],
                ports: vec![],
                draw: None,
                shapes: None,
            });
        }
        plan.aliases.insert("g/ab".into(), NodeIndex::new(2));
        plan.aliases.insert("e/ab[seed=0]".into(), NodeIndex::new(0));
        for (name, expected) in [
            ("g", &["e/ab"][..]),
            ("g/ab", &["e/ab"]),
            ("e/ab[", &["e/a[seed=1]"]),
            ("e/ab", &["e/ab"]),
            ("e/a", &["e/a[seed=1]", "e/a[seed=10]"]),
            ("e/a[seed=1", &["e/a[seed=1]"]),
            ("e/c", &["e/c/member[0]"]),
            ("f", &["f/x"]),
            ("e/ab/m", &["e/ab/mean"]),
            ("e", &addresses[..5]),
            ("h", &[]),
        ] {
            let found = matching(&plan, name);
            let found: Vec<&str> = found.iter().map(|n| plan.graph[*n].address.as_str()).collect();
            assert_eq!(found, expected, "{name}");
        }
    }
}
