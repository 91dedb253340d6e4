//! `ivx why`

mod json;
mod text;

use std::collections::BTreeSet;
use std::io::{self, Write};
use std::path::Path;

use ivx_cache::Cache;
use ivx_engine::{NodeIndex, Plan, address, consult, expand, platform};
use ivx_grammar::{Advice, suggest};

use super::{Ready, ready};
use crate::args::StoreMode;
use crate::render::safe;
use crate::setter::{Setter, setter};
use crate::source::is_spec;
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
    if let Some(spec) = swapped(&args.spec.path, &args.node) {
        let path = args.spec.path.display();
        writeln!(err, "error: the spec comes before the node: `ivx why {spec} {path}`")?;
        return Ok(WRONG);
    }
    let Some(ready) = ready(&args.spec, err)? else { return Ok(WRONG) };
    let plan = expand(&ready.spec, &ready.registry);
    let Some((name, nodes)) = named(&plan, &args.node, err)? else { return Ok(WRONG) };
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
    if all.iter().any(|why| !plan.graph[why.node].address.starts_with(&name)) {
        writeln!(text, "{name} has nodes that equal others, which they are told as:")?;
    }
    match &all[..] {
        [one] => text::one(&told, one, &mut text)?,
        all => text::several(&told, &name, all, &mut text)?,
    }
    // Records may come from anyone's archive.
    write!(out, "{}", safe(&String::from_utf8_lossy(&text)))?;
    Ok(OK)
}

/// What was given for the node, if that is a spec and what was given for the spec is none.
pub(super) fn swapped<'a>(spec: &Path, node: &'a str) -> Option<&'a str> {
    (!spec.exists() && is_spec(Path::new(node)) && Path::new(node).is_file()).then_some(node)
}

/// The nodes that a name means, and how the address of each begins; says so if there is none, or
/// several experiments have such.
pub(super) fn named(
    plan: &Plan,
    name: &str,
    err: &mut dyn Write,
) -> io::Result<Option<(String, Vec<NodeIndex>)>> {
    let (nodes, is_whole) = beginning(plan, name);
    if is_whole {
        return Ok(Some((name.to_owned(), nodes)));
    }
    let experiments: BTreeSet<&str> =
        addresses(plan).filter_map(|(address, _)| Some(address.split_once('/')?.0)).collect();
    let mut within = experiments.iter().filter_map(|experiment| {
        let address = format!("{experiment}/{name}");
        let (nodes, is_whole) = beginning(plan, &address);
        is_whole.then_some((address, nodes))
    });
    match (within.next(), within.next()) {
        (Some(found), None) => Ok(Some(found)),
        (None, _) if !nodes.is_empty() => Ok(Some((name.to_owned(), nodes))),
        (Some((first, _)), Some((second, _))) => {
            let all = [first, second].into_iter().chain(within.map(|(address, _)| address));
            let all = all.map(|address| format!("`{address}`")).collect::<Vec<_>>().join(", ");
            writeln!(err, "error: several experiments have a `{name}`: say which: {all}")?;
            Ok(None)
        }
        (None, _) => unknown(plan, name, err).map(|()| None),
    }
}

/// Says that no node has this name, and which was perhaps meant.
fn unknown(plan: &Plan, name: &str, err: &mut dyn Write) -> io::Result<()> {
    let known = || addresses(plan).map(|(address, _)| address);
    let stems: BTreeSet<String> = known().map(stem).collect();
    let stems = || stems.iter().map(String::as_str);
    let bare = stems().filter_map(|stem| address::parts(stem).get(1).copied());
    let help = suggest(name, stems());
    let is_near = Advice::is_near;
    let help = help.filter(is_near).or_else(|| suggest(name, bare).filter(is_near));
    let help = help.or_else(|| suggest(name, stems()));
    let help = help.or_else(|| suggest(name, known()));
    let help = help.map_or_else(|| "`ivx plan --nodes` lists them".to_owned(), String::from);
    writeln!(err, "error: no node is called `{name}`: {help}")
}

/// Every address of a node.
fn addresses(plan: &Plan) -> impl Iterator<Item = (&str, NodeIndex)> {
    let own = plan.graph.node_indices().map(|node| (plan.graph[node].address.as_str(), node));
    own.chain(plan.aliases.iter().map(|(address, node)| (address.as_str(), *node)))
}

/// The nodes that a name means: the one that it is an address of, else those that it is the
/// beginning of, up to where a word ends if there are such; and whether there are.
fn beginning(plan: &Plan, name: &str) -> (Vec<NodeIndex>, bool) {
    let mut found = BTreeSet::new();
    let mut is_whole = false;
    for (address, node) in addresses(plan) {
        let Some(rest) = address.strip_prefix(name) else { continue };
        if rest.is_empty() {
            return (vec![node], true);
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
    (found.into_iter().collect(), is_whole)
}

/// An address without its coordinates and its member.
fn stem(address: &str) -> String {
    let parts = address::parts(address).into_iter().map(address::stem);
    parts.take_while(|part| *part != "member").collect::<Vec<_>>().join("/")
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
            let found = beginning(&plan, name).0;
            let found: Vec<&str> = found.iter().map(|n| plan.graph[*n].address.as_str()).collect();
            assert_eq!(found, expected, "{name}");
        }
        for (name, expected) in [
            ("x", Ok("f/x")),
            ("c", Ok("e/c")),
            ("c/member[0]", Ok("e/c/member[0]")),
            ("e/a", Ok("e/a")),
            ("ab", Err("several experiments have a `ab`: say which: `e/ab`, `g/ab`")),
            ("aa", Err("no node is called `aa`: did you mean `a`?")),
            ("e/d", Err("no node is called `e/d`: did you mean `e/a`?")),
            ("quite another", Err("no node is called `quite another`: known here: `e/a`")),
        ] {
            let mut err = Vec::new();
            let found = named(&plan, name, &mut err).expect("vectors take everything");
            let said = String::from_utf8_lossy(&err).into_owned();
            match expected {
                Ok(address) => assert_eq!(found.map(|(name, _)| name).as_deref(), Some(address)),
                Err(why) => assert!(found.is_none() && said.contains(why), "{said}"),
            }
        }
    }
}
