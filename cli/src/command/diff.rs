//! `ivx diff`

mod because;
pub(super) mod git;
mod json;
mod markdown;
mod side;
mod text;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{self, Write};
use std::path::Path;

use ivx_cache::{Cache, Digest, History};
use ivx_engine::{Change, Made, Moved, Results, Root, Shift, platform, shifts};
use ivx_math::evidence::{Evidence, Spread};
use side::{Side, current, last, side};

use crate::args::{self, DiffFormat, StoreMode};
use crate::found::Found;
use crate::render::visible;
use crate::source::is_spec;
use crate::{At as _, FAILED, OK, Trouble, WRONG, project, store};

/// What differs between the results of one spec.
struct Pair {
    /// The spec, or its folder.
    name: String,
    /// Whether it is on one side only, and if so, whether that is the later one.
    only: Option<bool>,
    changes: Vec<Change>,
    /// What happened to the nodes, where both sides tell of them.
    nodes: Option<Nodes>,
}

/// What happened to the nodes.
struct Nodes {
    before: usize,
    after: usize,
    blocks: Vec<Block>,
}

/// Nodes to which the same happened for the same reasons.
struct Block {
    how: Moved,
    roots: Vec<Root>,
    shifts: Vec<Shift>,
}

/// What is told: what was compared, and what differs.
struct Told {
    before: String,
    after: String,
    pairs: Vec<Pair>,
    /// Whether every node is named.
    names_nodes: bool,
}

pub(crate) fn diff(
    args: &args::Diff,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<u8, Trouble> {
    let root = project::here();
    let cache = project::cache(&root);
    let history = if cache.join("version").exists() { Some(History::open(&cache)?) } else { None };
    for trouble in history.iter().flat_map(|history| &history.troubles) {
        writeln!(err, "note: {trouble}")?;
    }
    let sides = match (&args.before, &args.after) {
        (None, _) => last(None, history.as_ref(), err)?,
        (Some(spec), None) if is_spec(spec) => last(Some(spec), history.as_ref(), err)?,
        (Some(before), after) => {
            let Some(before) = side(before, &root, history.as_ref(), err)? else {
                return Ok(WRONG);
            };
            let after = match after {
                Some(after) => side(after, &root, history.as_ref(), err)?,
                None => current(&root, err)?,
            };
            after.map(|after| (before, after))
        }
    };
    let Some((before, after)) = sides else { return Ok(WRONG) };
    let titles = (before.title.clone(), after.title.clone());
    let Some(paired) = pair(before, after, err)? else { return Ok(WRONG) };
    let mut cache = Cache::look(&cache, &platform())?;
    store::attach(&args.store, StoreMode::Read, &mut cache, err)?;
    let pairs = paired.into_iter().map(|(name, before, after)| {
        compare(name, before.as_ref(), after.as_ref(), args.tolerance, &mut cache)
    });
    let told =
        Told { before: titles.0, after: titles.1, pairs: pairs.collect(), names_nodes: args.nodes };
    store::notes(&mut cache, err)?;
    match args.format {
        DiffFormat::Text => text::write(&told, out)?,
        DiffFormat::Json => json::write(&told, out)?,
        DiffFormat::Markdown => markdown::write(&told, out)?,
    }
    Ok(if told.is_same() { OK } else { FAILED })
}

/// The results of a file or its folder.
pub(super) fn results(path: &Path) -> Result<Results, Trouble> {
    read(path).map(|found| found.results)
}

/// What a results file or its folder tells, with the `run.ron` beside it.
fn read(path: &Path) -> Result<Found, Trouble> {
    let path = if path.is_dir() { path.join("results.ron") } else { path.to_owned() };
    let text = fs::read_to_string(&path).at(&path)?;
    // Beside another file it would be of another run.
    let is_own = path.file_name().is_some_and(|name| name == "results.ron");
    let run = is_own.then(|| fs::read_to_string(path.with_file_name("run.ron")).ok()).flatten();
    Found::of(&text, run.as_deref())
        .map_err(|why| Trouble::Content { path: path.display().to_string(), why })
}

/// What is compared: a name, and what each side has of it.
type Paired = Vec<(String, Option<Found>, Option<Found>)>;

/// What of two sides is compared with what; says so if one lacks what the other is about.
fn pair(before: Side, after: Side, err: &mut dyn Write) -> io::Result<Option<Paired>> {
    let (mut old, mut new) = (before.found, after.found);
    match (before.is_single, after.is_single) {
        (true, false) => by_default(&mut old, &new),
        (false, true) => by_default(&mut new, &old),
        _ => {}
    }
    if before.is_single && after.is_single {
        let (old, new) = (old.pop_first(), new.pop_first());
        let name = new.as_ref().map(|(name, _)| name.clone()).unwrap_or_default();
        return Ok(Some(vec![(name, old.map(|(_, found)| found), new.map(|(_, found)| found))]));
    }
    let names: BTreeSet<String> = match (before.is_single, after.is_single) {
        (true, _) => old.keys().cloned().collect(),
        (_, true) => new.keys().cloned().collect(),
        _ => old.keys().chain(new.keys()).cloned().collect(),
    };
    if before.is_single || after.is_single {
        for (title, found) in [(&before.title, &old), (&after.title, &new)] {
            if let Some(name) = names.iter().find(|name| !found.contains_key(*name)) {
                let known: Vec<&str> = found.keys().map(String::as_str).collect();
                let said =
                    format!("{title} has no results of `{name}`: it has {}", known.join(", "));
                writeln!(err, "error: {}", visible(&said))?;
                return Ok(None);
            }
        }
    }
    let paired = names.into_iter().map(|name| {
        let (old, new) = (old.remove(&name), new.remove(&name));
        (name, old, new)
    });
    Ok(Some(paired.collect()))
}

/// Where many have no results of what was asked of one run, it is compared with those of its spec by default.
fn by_default(one: &mut BTreeMap<String, Found>, many: &BTreeMap<String, Found>) {
    let asked = one.keys().find(|name| !many.contains_key(*name)).cloned();
    if let Some(name) = asked
        && let Some((plain, _)) = name.rsplit_once('@')
        && many.contains_key(plain)
        && let Some(found) = one.remove(&name)
    {
        one.insert(plain.to_owned(), found);
    }
}

fn compare(
    name: String,
    before: Option<&Found>,
    after: Option<&Found>,
    tolerance: f64,
    cache: &mut Cache,
) -> Pair {
    let (Some(before), Some(after)) = (before, after) else {
        return Pair { name, only: Some(after.is_some()), changes: Vec::new(), nodes: None };
    };
    let changes = ivx_engine::diff(&before.results, &after.results, tolerance, interval);
    let nodes = before.nodes.as_ref().zip(after.nodes.as_ref()).map(|(before, after)| {
        let is_at = |key, address, of: &BTreeMap<String, Made>| {
            of.get(address).is_some_and(|made| made.key == Some(key))
        };
        for (address, made) in before.iter().chain(after) {
            let is_other =
                |key: &Digest| !is_at(*key, address, before) || !is_at(*key, address, after);
            if let Some(key) = made.key.filter(is_other) {
                // What the cache lacks may be in the store.
                cache.find(&key);
            }
        }
        let explain = |key: &Digest| Some(cache.lookup(key)?.provenance.explanation.as_str());
        Nodes {
            before: before.len(),
            after: after.len(),
            blocks: blocks(shifts(before, after, &explain)),
        }
    });
    Pair { name, only: None, changes, nodes }
}

/// The 95 % interval of a mean, by the rule of claims.
pub(super) fn interval(samples: &[f64]) -> Option<(f64, f64)> {
    let is_sound = samples.len() > 1 && samples.iter().all(|x| x.is_finite());
    is_sound.then(|| Evidence::Mean(Spread::of_mean(samples)).shown_interval(0.95))
}

/// Whether nodes to which this happened are told of with its reasons: coordinates, and names that they
/// had, are told of each.
fn told_together(how: Moved) -> bool {
    !matches!(how, Moved::Remade | Moved::Renamed | Moved::Added | Moved::Gone)
}

/// Shifts by what happened and why. Coordinates are no such reason: they are told of each.
fn blocks(shifts: Vec<Shift>) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    for shift in shifts {
        let roots = if told_together(shift.how) { shift.roots.clone() } else { Vec::new() };
        match blocks.iter_mut().find(|block| block.how == shift.how && block.roots == roots) {
            Some(block) => block.shifts.push(shift),
            None => blocks.push(Block { how: shift.how, roots, shifts: vec![shift] }),
        }
    }
    blocks
}

impl Told {
    fn is_same(&self) -> bool {
        self.pairs.iter().all(Pair::is_same)
    }
}

impl Pair {
    fn is_same(&self) -> bool {
        let nodes_same = self.nodes.as_ref().is_none_or(|nodes| nodes.blocks.is_empty());
        self.only.is_none() && self.changes.is_empty() && nodes_same
    }
}

impl Nodes {
    /// `22 re-keyed, 2 new (38 before, 40 after)`
    fn summary(&self) -> String {
        let mut parts = Vec::new();
        let all = [
            (Moved::Rekeyed, "re-keyed"),
            (Moved::Remade, "with their key and another result"),
            (Moved::Failed, "failed"),
            (Moved::Skipped, "skipped"),
            (Moved::NotRun, "not run"),
            (Moved::Mended, "with a result again"),
            (Moved::Renamed, "renamed"),
            (Moved::Added, "new"),
            (Moved::Gone, "gone"),
        ];
        for (how, word) in all {
            let own = self.blocks.iter().filter(|block| block.how == how);
            let n: usize = own.map(Block::n_nodes).sum();
            if n > 0 {
                parts.push(format!("{n} {word}"));
            }
        }
        format!("{} ({} before, {} after)", parts.join(", "), self.before, self.after)
    }
}

impl Block {
    fn n_nodes(&self) -> usize {
        self.shifts.iter().map(|shift| shift.nodes.len()).sum()
    }
}
