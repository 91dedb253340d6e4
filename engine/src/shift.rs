//! Which nodes came, went and changed between two runs, and where that began.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use ivx_cache::Digest;
use serde::{Deserialize, Serialize};

use crate::address::{binding, coordinates};
use crate::difference::{Difference, Part, compare, name};
use crate::explanation::{Explanation, Input};

/// What a run knew of a node.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Made {
    /// Its key, if its inputs were known.
    pub key: Option<Digest>,
    /// The digest of its result, if it had one.
    pub output: Option<Digest>,
    /// How it ended.
    pub fate: Ended,
    /// The node that failed, where it was skipped because of one.
    pub cause: Option<String>,
    /// What its key was made of, where no record says so.
    pub explanation: Option<String>,
}

/// How a node ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "&'static str")]
pub enum Ended {
    /// With a result, as far as anybody knows.
    #[default]
    Known,
    /// Without one, by its own fault.
    Failed,
    /// Without one, by that of another.
    Skipped,
    /// It was not its turn before the run ended.
    Waiting,
}

impl From<String> for Ended {
    fn from(word: String) -> Self {
        match word.as_str() {
            "failed" => Self::Failed,
            "skipped" => Self::Skipped,
            "waiting" => Self::Waiting,
            _ => Self::Known,
        }
    }
}

impl From<Ended> for &'static str {
    fn from(ended: Ended) -> Self {
        match ended {
            Ended::Known => "known",
            Ended::Failed => "failed",
            Ended::Skipped => "skipped",
            Ended::Waiting => "waiting",
        }
    }
}

/// Nodes of one binding to which the same happened for the same reasons.
#[derive(Clone, Debug, PartialEq)]
pub struct Shift {
    /// Their address without coordinates: `small/model/member`.
    pub binding: String,
    /// What happened.
    pub how: Moved,
    /// Where it began; nothing where there is no more to say.
    pub roots: Vec<Root>,
    /// Their addresses.
    pub nodes: Vec<String>,
}

/// What happened to a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Moved {
    /// It has another key.
    Rekeyed,
    /// It has its key, and another result.
    Remade,
    /// It failed, and had not before.
    Failed,
    /// It was skipped since another failed, and was not before.
    Skipped,
    /// The run ended before its turn, and did not before.
    NotRun,
    /// It has a result where it had none.
    Mended,
    /// It was called otherwise.
    Renamed,
    /// There was none.
    Added,
    /// There is none any more.
    Gone,
}

/// Where a change began.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Root {
    /// A part of a key.
    Differs {
        /// The binding of the node whose key that is.
        binding: String,
        /// What differs.
        difference: Difference,
    },
    /// A node that has its key, and another result.
    Remade {
        /// The binding of the node.
        binding: String,
    },
    /// A node that failed.
    Failed {
        /// The binding of the node.
        binding: String,
    },
    /// A node that does not fail any more.
    Mended {
        /// The binding of the node.
        binding: String,
    },
    /// A node whose records the cache has lost.
    Lost {
        /// The binding of the node.
        binding: String,
    },
    /// Coordinates that are only on one side.
    Axis {
        /// The axis.
        name: String,
        /// Their labels, in order of numbers or else of names.
        labels: Vec<String>,
    },
    /// What it was called.
    Was {
        /// The binding.
        binding: String,
    },
}

/// What happened to the nodes of a run until another, and why, by what happened, binding and
/// reason. Nodes that neither run has a key of are passed over.
///
/// - `explain`: the explanation of a key, if it is known.
#[must_use]
pub fn shifts<'a>(
    before: &BTreeMap<String, Made>,
    after: &BTreeMap<String, Made>,
    explain: &dyn Fn(&Digest) -> Option<&'a str>,
) -> Vec<Shift> {
    let mut groups: BTreeMap<(Moved, String, Vec<Root>), Vec<String>> = BTreeMap::new();
    let mut note = |how, address: &str, roots: Vec<Root>| {
        let nodes = groups.entry((how, binding(address), roots)).or_default();
        nodes.push(address.to_owned());
    };
    let mut search = Search::new(before, after, explain);
    for (address, new) in after {
        let Some(old) = before.get(address) else { continue };
        let is_rekeyed = old.key.zip(new.key).is_some_and(|(old, new)| old != new);
        if old.fate != new.fate {
            let behind = |made: &Made, root: fn(String) -> Root| {
                made.cause.iter().map(|cause| root(binding(cause))).collect::<Vec<_>>()
            };
            let (how, roots) = match (old.fate, new.fate) {
                (_, Ended::Skipped) => {
                    (Moved::Skipped, behind(new, |binding| Root::Failed { binding }))
                }
                (_, Ended::Waiting) => (Moved::NotRun, Vec::new()),
                (_, Ended::Failed) => (Moved::Failed, Vec::new()),
                (Ended::Skipped, Ended::Known) => {
                    (Moved::Mended, behind(old, |binding| Root::Mended { binding }))
                }
                (_, Ended::Known) => (Moved::Mended, Vec::new()),
            };
            let roots = if is_rekeyed { search.roots(address) } else { roots };
            note(how, address, roots);
            continue;
        }
        match (old.key, new.key) {
            (Some(_), Some(_)) if is_rekeyed => {
                note(Moved::Rekeyed, address, search.roots(address));
            }
            (Some(_), Some(_)) if search.is_remade(address) => {
                note(Moved::Remade, address, Vec::new());
            }
            _ => {}
        }
    }
    let absent = |of: &BTreeMap<String, Made>, from: &BTreeMap<String, Made>| {
        let absent = of.iter().filter(|(address, _)| !from.contains_key(*address));
        absent.map(|(address, made)| (address.clone(), made.key)).collect::<Vec<_>>()
    };
    let mut gone = absent(before, after);
    let (old, new) = (Labels::of(before), Labels::of(after));
    for (address, key) in absent(after, before) {
        match gone.iter().position(|(_, own)| key.is_some() && *own == key) {
            Some(i) => {
                let was = Root::Was { binding: binding(&gone.remove(i).0) };
                note(Moved::Renamed, &address, vec![was]);
            }
            None => note(Moved::Added, &address, new.lacking(&address, &old)),
        }
    }
    for (address, _) in gone {
        note(Moved::Gone, &address, old.lacking(&address, &new));
    }
    let shift = |((how, binding, roots), nodes)| Shift { binding, how, roots, nodes };
    groups.into_iter().map(shift).collect()
}

/// The labels of a run by binding and axis.
struct Labels<'a>(BTreeMap<String, BTreeMap<&'a str, BTreeSet<&'a str>>>);

impl<'a> Labels<'a> {
    fn of(nodes: &'a BTreeMap<String, Made>) -> Self {
        let mut labels: BTreeMap<String, BTreeMap<_, BTreeSet<_>>> = BTreeMap::new();
        for address in nodes.keys() {
            let axes = labels.entry(binding(address)).or_default();
            for (axis, label) in coordinates(address) {
                axes.entry(axis).or_default().insert(label);
            }
        }
        Self(labels)
    }

    /// The axes along which a node of this run lies where the other has none of its binding.
    fn lacking(&self, address: &str, other: &Self) -> Vec<Root> {
        let own = binding(address);
        let Some(there) = other.0.get(&own) else { return Vec::new() };
        let roots = coordinates(address).into_iter().filter_map(|(axis, label)| {
            let there = there.get(axis)?;
            if there.contains(label) {
                return None;
            }
            let mut labels: Vec<String> =
                self.0[&own][axis].difference(there).map(|label| (*label).to_owned()).collect();
            let number = |label: &String| label.parse::<f64>().unwrap_or(f64::INFINITY);
            labels.sort_by(|a, b| number(a).total_cmp(&number(b)));
            Some(Root::Axis { name: axis.to_owned(), labels })
        });
        roots.collect()
    }
}

/// The nodes of one run, by the bytes that they made.
type ByOutput<'n> = BTreeMap<Digest, Vec<&'n str>>;

struct Search<'n, 'e, 'a> {
    before: &'n BTreeMap<String, Made>,
    after: &'n BTreeMap<String, Made>,
    made_before: ByOutput<'n>,
    made_after: ByOutput<'n>,
    explain: &'e dyn Fn(&Digest) -> Option<&'a str>,
    links: BTreeMap<&'n str, Link<'n>>,
    roots: BTreeMap<&'n str, BTreeSet<Root>>,
}

/// What differs of a node itself, and the inputs that differ.
#[derive(Default)]
struct Link<'n> {
    own: BTreeSet<Root>,
    inputs: BTreeSet<&'n str>,
}

impl<'n, 'e, 'a> Search<'n, 'e, 'a> {
    fn new(
        before: &'n BTreeMap<String, Made>,
        after: &'n BTreeMap<String, Made>,
        explain: &'e dyn Fn(&Digest) -> Option<&'a str>,
    ) -> Self {
        let (made_before, made_after) = (by_output(before), by_output(after));
        let (links, roots) = (BTreeMap::new(), BTreeMap::new());
        Self { before, after, made_before, made_after, explain, links, roots }
    }

    /// Whether a node has its key in both runs, and another result.
    fn is_remade(&self, address: &str) -> bool {
        let (old, new) = (&self.before[address], &self.after[address]);
        old.key == new.key && old.output.zip(new.output).is_some_and(|(old, new)| old != new)
    }

    /// Where the change of a node began, followed through its inputs.
    fn roots(&mut self, address: &'n str) -> Vec<Root> {
        let mut todo = vec![address];
        while let Some(node) = todo.last().copied() {
            if let Some(link) = self.links.get(node) {
                todo.pop();
                let inputs = link.inputs.iter().filter_map(|input| self.roots.get(input));
                let all = link.own.iter().chain(inputs.flatten()).cloned().collect();
                self.roots.entry(node).or_insert(all);
            } else {
                let link = self.link(node);
                todo.extend(link.inputs.iter().filter(|input| !self.links.contains_key(*input)));
                self.links.insert(node, link);
            }
        }
        self.roots[address].iter().cloned().collect()
    }

    fn link(&self, node: &'n str) -> Link<'n> {
        let own = |root| Link { own: [root].into(), inputs: BTreeSet::new() };
        if self.is_remade(node) {
            return own(Root::Remade { binding: binding(node) });
        }
        let explanation = |of: &BTreeMap<String, Made>| {
            let own = of[node].explanation.as_deref();
            own.or_else(|| of[node].key.as_ref().and_then(self.explain)).map(Explanation::of)
        };
        let (Some(before), Some(after)) = (explanation(self.before), explanation(self.after))
        else {
            return own(Root::Lost { binding: binding(node) });
        };
        let same = |old: &Input, new: &Input| self.maker(old, new).is_some();
        let (differences, replaced) = compare(&before, &after, &same);
        let mut link = Link::default();
        let mut differs = |difference| {
            link.own.insert(Root::Differs { binding: binding(node), difference });
        };
        differences.into_iter().for_each(&mut differs);
        for replaced in replaced {
            // One that was added or taken away came with a difference of axes or counts.
            let (Some(old), Some(new)) = (replaced.before, replaced.after) else { continue };
            if let Some(input) = self.maker(old, new) {
                link.inputs.insert(input);
                continue;
            }
            let part = Part::Input(format!("{}.{}", name(&after.op), replaced.port));
            let (before, after) = self.shown(old, new);
            let difference = Difference { part, before: Some(before), after: Some(after) };
            link.own.insert(Root::Differs { binding: binding(node), difference });
        }
        link
    }

    /// The node that made one input before and another now.
    fn maker(&self, old: &Input, new: &Input) -> Option<&'n str> {
        let (old, new) = (old.digest?, new.digest?);
        let was =
            |node: &&&str| self.before.get(**node).is_some_and(|made| made.output == Some(old));
        self.made_after.get(&new)?.iter().find(was).copied()
    }

    /// Two inputs for people: a number, or what made it, as short as tells them apart.
    fn shown(&self, old: &Input, new: &Input) -> (String, String) {
        type Short = fn(&str) -> String;
        let made = |input: &Input, made: &ByOutput<'_>, short: Short| {
            let node = input.digest.and_then(|digest| made.get(&digest)?.first().copied());
            let node = node.map_or("something that is not known any more".to_owned(), short);
            input.number.clone().unwrap_or(node)
        };
        let both = |short: Short| {
            (made(old, &self.made_before, short), made(new, &self.made_after, short))
        };
        let (before, after) = both(binding);
        if before == after { both(str::to_owned) } else { (before, after) }
    }
}

fn by_output(nodes: &BTreeMap<String, Made>) -> ByOutput<'_> {
    let mut made = ByOutput::new();
    for (address, node) in nodes {
        if let Some(output) = node.output {
            made.entry(output).or_default().push(address);
        }
    }
    made
}

/// `hidden was 8, is 16`, or why there is no more to say.
impl fmt::Display for Root {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Differs { binding, difference } => write!(f, "{difference} ({binding})"),
            Self::Remade { binding } => write!(f, "{binding} came out otherwise, of the same key"),
            Self::Failed { binding } => write!(f, "{binding} failed"),
            Self::Mended { binding } => write!(f, "{binding} does not fail any more"),
            Self::Lost { binding } => write!(f, "the cache has lost what {binding} was made from"),
            Self::Axis { name, labels } => write!(f, "{name} = {}", labels.join(", ")),
            Self::Was { binding } => write!(f, "it was {binding}"),
        }
    }
}

#[cfg(test)]
mod tests;
