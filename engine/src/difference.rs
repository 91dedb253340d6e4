//! What differs between two explanations.

use std::collections::BTreeSet;
use std::fmt;

use crate::explanation::{Explanation, Gathered, Input, is_below, versioned, written};

/// One part of a key that was something else.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Difference {
    /// Which part.
    pub part: Part,
    /// What it was; nothing if it was not there.
    pub before: Option<String>,
    /// What it is; nothing if it is not there.
    pub after: Option<String>,
}

/// A part of a key. Paths begin with the operation: `train.learner.optimiser.lr`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// The format of keys.
    Format,
    /// The operation, with its version.
    Operation,
    /// A description.
    Argument(String),
    /// The version of the part at a path.
    Version(String),
    /// How many values a port is given.
    Count(String),
    /// The axes that a port gathers, with the labels that travel.
    Axes(String),
    /// What the spec calls a value whose name travels.
    Name(String),
    /// What a port takes or a part holds: a number, or a node.
    Input(String),
    /// The seed.
    Seed,
    /// The member of the ensemble.
    Member,
    /// The platform: two results of one key.
    Platform,
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Format => write!(f, "the format of keys"),
            Self::Operation => write!(f, "the operation"),
            Self::Argument(path) | Self::Input(path) => write!(f, "`{path}`"),
            Self::Version(path) => write!(f, "the part `{path}`"),
            Self::Count(port) => write!(f, "the number of values of `{port}`"),
            Self::Axes(port) => write!(f, "what `{port}` gathers over"),
            Self::Name(port) => write!(f, "the name of `{port}`"),
            Self::Seed => write!(f, "the seed"),
            Self::Member => write!(f, "the member"),
            Self::Platform => write!(f, "the platform"),
        }
    }
}

/// `sample.n` was 20, is 25.
impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.before, &self.after) {
            (Some(before), Some(after)) => write!(f, "{} was {before}, is {after}", self.part),
            (None, Some(after)) => write!(f, "{} is new: {after}", self.part),
            (Some(before), None) => write!(f, "{} is gone: it was {before}", self.part),
            (None, None) => write!(f, "{} differs", self.part),
        }
    }
}

/// A value that a port took or takes, and what it was before.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Replaced<'a> {
    /// The port, or the path of the argument that holds it.
    pub(crate) port: &'a str,
    /// What it was; nothing if there was none.
    pub(crate) before: Option<&'a Input>,
    /// What it is; nothing if there is none.
    pub(crate) after: Option<&'a Input>,
}

/// What differs between an earlier explanation and the one at hand: parts of their own, and
/// inputs. Of another operation everything does, which is told as one difference.
///
/// - `same`: whether an input is what another was, by what is known beside their digests.
pub(crate) fn compare<'a>(
    before: &'a Explanation,
    after: &'a Explanation,
    same: &dyn Fn(&Input, &Input) -> bool,
) -> (Vec<Difference>, Vec<Replaced<'a>>) {
    let mut found = Vec::new();
    let mut note = |part, before: Option<&str>, after: Option<&str>| {
        if before != after {
            let own = |text: Option<&str>| text.map(str::to_owned);
            found.push(Difference { part, before: own(before), after: own(after) });
        }
    };
    let mut replaced = Vec::new();
    note(Part::Operation, Some(&before.op), Some(&after.op));
    let op = name(&after.op);
    if name(&before.op) != op {
        return (found, replaced);
    }
    note(Part::Format, Some(&before.format), Some(&after.format));
    let covered = args(before, after, &mut note);
    let ports: BTreeSet<&String> = before.feeds.keys().chain(after.feeds.keys()).collect();
    for port in ports {
        if covered.iter().any(|path| path == port || is_below(port, path)) {
            continue;
        }
        let feeds = |of: &'a Explanation| of.feeds.get(port).map(Vec::as_slice).unwrap_or_default();
        let (old, new) = (feeds(before), feeds(after));
        let path = || format!("{op}.{port}");
        let inputs = |feeds: &'a [Gathered]| feeds.iter().flat_map(|feed| &feed.inputs).collect();
        if old.len() != new.len() {
            let counts = [old, new].map(|feeds| feeds.len().to_string());
            note(Part::Count(path()), Some(&counts[0]), Some(&counts[1]));
            alike(port, (inputs(old), inputs(new)), same, &mut replaced);
            continue;
        }
        for (old, new) in old.iter().zip(new) {
            note(Part::Name(path()), old.name.as_deref(), new.name.as_deref());
            if old.axes == new.axes {
                placed(port, old, new, &mut replaced);
            } else {
                note(Part::Axes(path()), Some(&axes(old)), Some(&axes(new)));
                let inputs = (old.inputs.iter().collect(), new.inputs.iter().collect());
                alike(port, inputs, same, &mut replaced);
            }
        }
    }
    note(Part::Seed, before.seed.as_deref(), after.seed.as_deref());
    note(Part::Member, before.member.as_deref(), after.member.as_deref());
    (found, replaced)
}

/// The name of what is written `name@version`.
pub(crate) fn name(op: &str) -> &str {
    versioned(op).map_or(op, |(name, _)| name)
}

/// Notes which descriptions differ, each as high up as it is another. Returns their paths.
fn args<'a>(
    before: &'a Explanation,
    after: &'a Explanation,
    note: &mut impl FnMut(Part, Option<&str>, Option<&str>),
) -> Vec<&'a str> {
    let op = name(&after.op);
    let mut covered: Vec<&str> = Vec::new();
    let paths: BTreeSet<&String> = before.args.keys().chain(after.args.keys()).collect();
    for path in paths {
        let (old, new) = (before.args.get(path), after.args.get(path));
        if old == new || covered.iter().any(|other| is_below(path, other)) {
            continue;
        }
        let full = format!("{op}.{path}");
        if let (Some(old), Some(new)) = (old, new)
            && let Some(((old_name, _), (new_name, _))) = versioned(old).zip(versioned(new))
            && old_name == new_name
        {
            note(Part::Version(full), Some(old), Some(new));
            continue;
        }
        let whole =
            |of: &Explanation, value: Option<&String>| value.map(|_| written(&of.args, path));
        let (old, new) = (whole(before, old), whole(after, new));
        note(Part::Argument(full), old.as_deref(), new.as_deref());
        covered.push(path);
    }
    covered
}

/// The axes of a feed, as people read them.
fn axes(feed: &Gathered) -> String {
    let axes = feed.axes.iter().map(|axis| match axis.splitn(3, ' ').collect::<Vec<_>>()[..] {
        [name, _, labels] => format!("{name} {labels}"),
        [name, n] if name.starts_with('#') => format!("{n} values"),
        _ => axis.clone(),
    });
    let axes: Vec<String> = axes.collect();
    if axes.is_empty() { "none".to_owned() } else { axes.join(" by ") }
}

fn equal(old: &Input, new: &Input) -> bool {
    old.digest.is_some() && old.digest == new.digest
}

/// Finds the inputs that were others, by their places.
fn placed<'a>(
    port: &'a str,
    before: &'a Gathered,
    after: &'a Gathered,
    replaced: &mut Vec<Replaced<'a>>,
) {
    for (old, new) in before.inputs.iter().zip(&after.inputs) {
        if !equal(old, new) {
            replaced.push(Replaced { port, before: Some(old), after: Some(new) });
        }
    }
}

/// Finds the inputs that were others, or none, by what they are.
fn alike<'a>(
    port: &'a str,
    (mut old, mut new): (Vec<&'a Input>, Vec<&'a Input>),
    same: &dyn Fn(&Input, &Input) -> bool,
    replaced: &mut Vec<Replaced<'a>>,
) {
    for alike in [&equal as &dyn Fn(&Input, &Input) -> bool, same] {
        new.retain(|input| {
            let Some(i) = old.iter().position(|old| alike(old, input)) else { return true };
            let (before, after) = (Some(old.remove(i)), Some(*input));
            if !before.is_some_and(|before| equal(before, input)) {
                replaced.push(Replaced { port, before, after });
            }
            false
        });
    }
    replaced.extend(new.into_iter().map(|new| Replaced { port, before: None, after: Some(new) }));
    replaced.extend(old.into_iter().map(|old| Replaced { port, before: Some(old), after: None }));
}

#[cfg(test)]
mod tests {
    use super::*;

    const BASE: &str = "format 1\nop train@2\narg.learner ensemble@1\narg.learner.net mlp@1\n\
        arg.learner.net.hidden list of 2\narg.learner.net.hidden[0] 8\n\
        arg.learner.net.hidden[1] 8\narg.learner.tau computed\ninput 00 1.5\narg.steps 20\n\
        port on 1\nname data\naxis n 2 [1.0, 2.0]\ninput 11\ninput 22\nseed 3\nmember none\n";

    /// The explanation of a text whose digests are written by two of their digits.
    fn explanation(text: &str) -> Explanation {
        let lines = text.lines().map(|line| match line.strip_prefix("input ") {
            Some(rest) => format!("input {}{}", rest[..2].repeat(32), &rest[2..]),
            None => line.to_owned(),
        });
        Explanation::of(&lines.collect::<Vec<_>>().join("\n"))
    }

    /// What a change of the text is told as.
    #[track_caller]
    fn check(from: &str, to: &str, expected: &[&str]) {
        let changed = BASE.replace(from, to);
        assert_ne!(changed, BASE, "the change finds its place");
        let (before, after) = (explanation(BASE), explanation(&changed));
        let (found, replaced) = compare(&before, &after, &|_, _| false);
        let short = |input: Option<&Input>| {
            let digest = input.map(|input| input.digest.expect("each is known").short());
            digest.map_or("none".to_owned(), |digest| digest[..2].to_owned())
        };
        let replaced = replaced.iter();
        let replaced =
            replaced.map(|r| format!("{} {} {}", r.port, short(r.before), short(r.after)));
        let all: Vec<String> = found.iter().map(ToString::to_string).chain(replaced).collect();
        assert_eq!(all, expected);
    }

    #[test]
    fn each_change_is_told_as_high_up_as_it_is_one() {
        check("steps 20", "steps 25", &["`train.steps` was 20, is 25"]);
        check("arg.steps 20\n", "", &["`train.steps` is gone: it was 20"]);
        check("arg.steps", "arg.more \"x\"\narg.steps", &["`train.more` is new: \"x\""]);
        check("hidden[1] 8", "hidden[1] 9", &["`train.learner.net.hidden[1]` was 8, is 9"]);
        check(
            "list of 2",
            "list of 3\narg.learner.net.hidden[2] 4",
            &["`train.learner.net.hidden` was [8, 8], is [8, 8, 4]"],
        );
        check(
            "mlp@1",
            "conv@1",
            &["`train.learner.net` was mlp(hidden: [8, 8]), is conv(hidden: [8, 8])"],
        );
        check("mlp@1", "mlp@2", &["the part `train.learner.net` was mlp@1, is mlp@2"]);
        check("train@2", "train@3", &["the operation was train@2, is train@3"]);
        check("train@2", "infer@2", &["the operation was train@2, is infer@2"]);
        check("format 1", "format 2", &["the format of keys was 1, is 2"]);
        check("seed 3", "seed 4", &["the seed was 3, is 4"]);
        check("member none", "member 4", &["the member was none, is 4"]);
        check(
            "seed 3\nmember none\n",
            "",
            &["the seed is gone: it was 3", "the member is gone: it was none"],
        );
        check("name data", "name other", &["the name of `train.on` was data, is other"]);
        check(
            "[1.0, 2.0]",
            "[1.0, 3.0]",
            &["what `train.on` gathers over was n [1.0, 2.0], is n [1.0, 3.0]"],
        );
        check(
            "computed\ninput 00 1.5",
            "0.5",
            &["`train.learner.tau` was something computed, is 0.5"],
        );
    }

    #[test]
    fn inputs_are_compared_by_place_or_else_by_what_they_are() {
        check("input 22", "input 33", &["on 22 33"]);
        check("input 11\ninput 22", "input 22\ninput 11", &["on 11 22", "on 22 11"]);
        check("input 00", "input 44", &["learner.tau 00 44"]);
        let axes = "what `train.on` gathers over was n [1.0, 2.0], is n";
        check(
            "n 2 [1.0, 2.0]\ninput 11\ninput 22",
            "n 3 [0.5, 1.0, 2.0]\ninput 55\ninput 11\ninput 22",
            &[&format!("{axes} [0.5, 1.0, 2.0]"), "on none 55"],
        );
        check(
            "n 2 [1.0, 2.0]\ninput 11\n",
            "n 1 [2.0]\n",
            &[&format!("{axes} [2.0]"), "on 11 none"],
        );
        check(
            "port on 1\n",
            "port on 2\ninput 77\n",
            &["the number of values of `train.on` was 1, is 2", "on none 77"],
        );
    }
}
