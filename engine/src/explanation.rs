//! Explanations: the text of a key's walk, taken apart again.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use ivx_cache::Digest;

use crate::key::Walk;
use crate::plan::Source;

/// What the walk of a key shows, of a record or of a step.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Explanation {
    /// The format of keys.
    pub(crate) format: String,
    /// The operation, `name@version`.
    pub(crate) op: String,
    /// The descriptions, by path: `learner.optimiser.lr`.
    pub(crate) args: BTreeMap<String, String>,
    /// What ports take and parts hold, by the name of the port or the path of the argument.
    pub(crate) feeds: BTreeMap<String, Vec<Gathered>>,
    /// The seed, where random numbers are drawn.
    pub(crate) seed: Option<String>,
    /// The member, where random numbers are drawn.
    pub(crate) member: Option<String>,
    /// What the last header was of.
    at: String,
}

/// Values over some axes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Gathered {
    /// What the spec calls it, where that belongs to the key.
    pub(crate) name: Option<String>,
    /// The axes: name, length and, where they belong to the key, labels.
    pub(crate) axes: Vec<String>,
    /// The values.
    pub(crate) inputs: Vec<Input>,
}

/// One value.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Input {
    /// Its digest, if it is known.
    pub(crate) digest: Option<Digest>,
    /// The number that it is, where the spec has one.
    pub(crate) number: Option<String>,
    /// What stands for it in the plan; nothing in a record.
    pub(crate) source: Option<Source>,
}

impl Gathered {
    fn is_whole(&self) -> bool {
        let lengths =
            self.axes.iter().map(|axis| axis.split(' ').nth(1).and_then(|n| n.parse().ok()));
        let n: usize = lengths.map(|n| n.unwrap_or(1)).product();
        self.inputs.len() >= n
    }
}

impl Explanation {
    /// Of the text that a record holds. What does not read as such is left out.
    pub(crate) fn of(text: &str) -> Self {
        let mut read = Self::default();
        for line in text.lines() {
            let (label, value) = line.split_once(' ').unwrap_or((line, ""));
            if label == "input" {
                let (digest, number) = value.split_once(' ').unwrap_or((value, ""));
                let number = Some(number.to_owned()).filter(|number| !number.is_empty());
                read.gather().inputs.push(Input {
                    digest: digest.parse().ok(),
                    number,
                    source: None,
                });
            } else {
                read.part(label, value);
            }
        }
        read
    }

    fn part(&mut self, label: &str, value: &str) {
        let value = || value.to_owned();
        match label {
            "format" => self.format = value(),
            "op" => self.op = value(),
            "seed" => self.seed = Some(value()),
            "member" => self.member = Some(value()),
            "port" => {
                let port = value();
                port.split(' ').next().unwrap_or_default().clone_into(&mut self.at);
                self.feeds.entry(self.at.clone()).or_default();
            }
            "name" => {
                let name = Some(value());
                self.feeds
                    .entry(self.at.clone())
                    .or_default()
                    .push(Gathered { name, ..Gathered::default() });
            }
            "axis" => {
                let axis = value();
                self.gather().axes.push(axis);
            }
            _ => {
                let path = label.strip_prefix("arg.").unwrap_or(label).to_owned();
                self.at.clone_from(&path);
                self.args.insert(path, value());
            }
        }
    }

    /// What is being gathered.
    fn gather(&mut self) -> &mut Gathered {
        let feeds = self.feeds.entry(self.at.clone()).or_default();
        // A name begins a feed even if no input of it was seen.
        let begun = feeds.last().is_some_and(|last| !last.is_whole() || last.inputs.is_empty());
        if !begun {
            feeds.push(Gathered::default());
        }
        feeds.last_mut().expect("one was begun")
    }
}

/// The walk of a step, with what stands for its inputs; an input of which nothing is known has
/// no bytes.
impl Walk for Explanation {
    fn item(&mut self, label: &str, bytes: &[u8]) {
        self.part(label, std::str::from_utf8(bytes).expect("only inputs are no text"));
    }

    fn input(&mut self, source: &Source, bytes: &[u8]) {
        let number = match source {
            Source::Number(x) => Some(format!("{x:?}")),
            Source::Node(_) => None,
        };
        let digest = <[u8; 32]>::try_from(bytes).ok().map(Digest);
        self.gather().inputs.push(Input { digest, number, source: Some(*source) });
    }
}

/// The name and version of what is written `name@version`.
pub(crate) fn versioned(text: &str) -> Option<(&str, &str)> {
    let (name, version) = text.rsplit_once('@')?;
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let is_number = !version.is_empty() && version.bytes().all(|b| b.is_ascii_digit());
    (is_number && name.chars().all(plain)).then_some((name, version))
}

/// Whether a path leads into what another leads to.
pub(crate) fn is_below(path: &str, other: &str) -> bool {
    path.strip_prefix(other).is_some_and(|rest| rest.starts_with(['.', '[']))
}

/// The description at a path, as the language writes it.
pub(crate) fn written(args: &BTreeMap<String, String>, path: &str) -> String {
    let Some(value) = args.get(path) else { return String::new() };
    if let Some((name, _)) = versioned(value) {
        let inner = args.keys().filter_map(|key| key.strip_prefix(path)?.strip_prefix('.'));
        let own: Vec<&str> = inner.filter(|key| !key.contains(['.', '['])).collect();
        let mut text = format!("{name}(");
        for (i, arg) in own.iter().enumerate() {
            let value = written(args, &format!("{path}.{arg}"));
            let comma = if i == 0 { "" } else { ", " };
            write!(text, "{comma}{arg}: {value}").expect("strings take everything");
        }
        return text + ")";
    }
    if let Some(n) = value.strip_prefix("list of ").and_then(|n| n.parse::<usize>().ok()) {
        let items: Vec<String> = (0..n).map(|i| written(args, &format!("{path}[{i}]"))).collect();
        return format!("[{}]", items.join(", "));
    }
    if value == "computed" { "something computed".to_owned() } else { value.clone() }
}

#[cfg(test)]
mod tests {
    use ivx_op::{Args, Dim, Held, Labels, Lit, Part, Registry};

    use super::*;
    use crate::key::{explain, number_digest, walk};
    use crate::plan::{Draw, Fed, Step};

    fn step() -> Step {
        let fed = |dims: Vec<Dim>, numbers: &[f64], name: Option<&str>| Fed {
            dims,
            sources: numbers.iter().map(|x| Source::Number(*x)).collect(),
            labelled: name.is_some(),
            name: name.unwrap_or_default().into(),
        };
        let n = Dim::new("n", Labels::Names(vec!["a b".into(), "c@1".into()]));
        let part = Part::new("cvar").with("alpha", 0.1).with("over", vec![1, 2]);
        let part = part.with("tau", Lit::Held(Held::Slot(0))).with("name", "cvar@7");
        Step {
            address: "e/x".into(),
            op: "toy".into(),
            args: Args::from([("ke".into(), part.into()), ("z".into(), true.into())]),
            held: vec![fed(vec![], &[7.0], None)],
            ports: vec![
                (
                    "x".into(),
                    vec![fed(vec![], &[0.5], None), fed(vec![n], &[1.0, 2.0], Some("gap"))],
                ),
                ("y".into(), vec![]),
            ],
            draw: Some(Draw { seed: 3, member: Some(1) }),
            shapes: None,
        }
    }

    fn digest(source: &Source) -> Digest {
        match source {
            Source::Number(x) => number_digest(*x),
            Source::Node(_) => unreachable!("the toy has no inputs"),
        }
    }

    #[test]
    fn the_text_of_a_walk_reads_as_the_walk() {
        let registry = Registry::default();
        let text = explain(&step(), &registry, digest);
        let mut walked = Explanation::default();
        walk(&step(), &registry, |source| digest(source).0, &mut walked);
        let numbers = |name: &str| -> Vec<Vec<Option<String>>> {
            let inputs = walked.feeds[name].iter().map(|fed| fed.inputs.iter());
            inputs.map(|inputs| inputs.map(|input| input.number.clone()).collect()).collect()
        };
        let some = |x: &str| Some(x.to_owned());
        assert_eq!(numbers("x"), [vec![some("0.5")], vec![some("1.0"), some("2.0")]]);
        assert_eq!((numbers("ke.tau"), numbers("y")), (vec![vec![some("7.0")]], vec![]));
        assert_eq!(walked.feeds["x"][1].name, some("gap"));
        assert_eq!(walked.feeds["x"][1].axes, [r#"n 2 ["a b", "c@1"]"#]);
        for fed in walked.feeds.values_mut().flatten() {
            fed.inputs.iter_mut().for_each(|input| input.source = None);
        }
        assert_eq!(Explanation::of(&text), walked, "{text}");
    }

    #[test]
    fn a_description_is_written_as_in_the_language() {
        let text = explain(&step(), &Registry::default(), digest);
        let written = written(&Explanation::of(&text).args, "ke");
        let expected = r#"cvar(alpha: 0.1, name: "cvar@7", over: [1, 2], tau: something computed)"#;
        assert_eq!(written, expected);
    }

    #[test]
    fn what_is_no_explanation_is_read_without_harm() {
        for text in
            ["", "input", "axis", "name\nname", "port", "\n\n", "op\narg.", "input zz\naxis n x"]
        {
            Explanation::of(text);
        }
    }
}
