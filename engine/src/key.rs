//! Keys: what a result depends on, walked once for two sinks.
//!
//! [`key`] hashes the walk and [`explain`] writes it down, so that the reason for a rerun can
//! never disagree with the key.

use std::fmt::Write as _;
use std::sync::LazyLock;

use ivx_cache::Digest;
use ivx_op::{Array, Artifact as _, Decl, Held, Labels, Lit, Registry};

use crate::plan::{Fed, Source, Step};

/// Rises when the walk changes, so that no old record is taken for a new one.
const FORMAT: &str = "1";

/// Receives the parts of a key in one fixed order.
pub(crate) trait Walk {
    /// One part.
    fn item(&mut self, label: &str, bytes: &[u8]);

    /// One input, by what stands for it.
    fn input(&mut self, _: &Source, bytes: &[u8]) {
        self.item("input", bytes);
    }
}

/// The key of a step whose inputs have these digests.
pub fn key(step: &Step, registry: &Registry, input: impl Fn(&Source) -> Digest) -> Digest {
    let mut bytes = Vec::new();
    walk(step, registry, |source| input(source).0, &mut bytes);
    Digest::of(&bytes)
}

/// The same walk as text: one line a part.
pub fn explain(step: &Step, registry: &Registry, input: impl Fn(&Source) -> Digest) -> String {
    let mut text = Text(String::new());
    walk(step, registry, |source| input(source).0, &mut text);
    text.0
}

/// The digest of a number that stands where an artifact is expected.
#[must_use]
pub fn number_digest(number: f64) -> Digest {
    // All of them are encoded alike but for the last bytes, which are the number's.
    static ZERO: LazyLock<Vec<u8>> = LazyLock::new(|| Array::scalar(0.0).encode());
    let mut bytes = ZERO.clone();
    let start = bytes.len() - size_of::<f64>();
    bytes[start..].copy_from_slice(&number.to_le_bytes());
    Digest::of(&bytes)
}

/// The parts one after another, each preceded by its length.
impl Walk for Vec<u8> {
    fn item(&mut self, label: &str, bytes: &[u8]) {
        for part in [label.as_bytes(), bytes] {
            self.extend((part.len() as u64).to_le_bytes());
            self.extend(part);
        }
    }
}

struct Text(String);

impl Walk for Text {
    fn item(&mut self, label: &str, bytes: &[u8]) {
        let text = std::str::from_utf8(bytes).expect("only inputs are no text");
        writeln!(self.0, "{label} {text}").expect("strings take everything");
    }

    /// In hexadecimal, and a number that is written in the spec also as such.
    fn input(&mut self, source: &Source, bytes: &[u8]) {
        self.0.push_str("input ");
        for byte in bytes {
            write!(self.0, "{byte:02x}").expect("strings take everything");
        }
        if let Source::Number(x) = source {
            write!(self.0, " {x:?}").expect("strings take everything");
        }
        self.0.push('\n');
    }
}

/// Shows everything that a step's result depends on to `sink`.
pub(crate) fn walk<B: AsRef<[u8]>>(
    step: &Step,
    registry: &Registry,
    input: impl Fn(&Source) -> B,
    sink: &mut impl Walk,
) {
    let mut walker = Walker { registry, input, held: &step.held, sink };
    walker.sink.item("format", FORMAT.as_bytes());
    let version = walker.version(&step.op).to_string();
    walker.sink.item("op", [&step.op, "@", &version].concat().as_bytes());
    let decl = registry.decl(&step.op);
    for (name, lit) in step.args.iter().filter(|(name, _)| !is_how(decl, name)) {
        walker.lit(&format!("arg.{name}"), lit);
    }
    for (name, feds) in &step.ports {
        walker.sink.item("port", [name, " ", &feds.len().to_string()].concat().as_bytes());
        for fed in feds {
            walker.fed(fed);
        }
    }
    if let Some(draw) = step.draw {
        sink.item("seed", draw.seed.to_string().as_bytes());
        let member = draw.member.map_or_else(|| "none".to_owned(), |member| member.to_string());
        sink.item("member", member.as_bytes());
    }
}

/// Whether an argument says how to compute and not what.
fn is_how(decl: Option<&Decl>, arg: &str) -> bool {
    decl.and_then(|decl| decl.arg(arg)).is_some_and(|arg| arg.how)
}

struct Walker<'a, I, S> {
    registry: &'a Registry,
    input: I,
    held: &'a [Fed],
    sink: &'a mut S,
}

impl<B: AsRef<[u8]>, I: Fn(&Source) -> B, S: Walk> Walker<'_, I, S> {
    fn version(&self, name: &str) -> u32 {
        self.registry.decl(name).map_or(0, |decl| decl.version)
    }

    fn fed(&mut self, fed: &Fed) {
        if fed.labelled {
            self.sink.item("name", fed.name.as_bytes());
        }
        for dim in &fed.dims {
            let labels = match &dim.labels {
                _ if !fed.labelled => String::new(),
                Labels::Numbers(xs) => format!(" {xs:?}"),
                Labels::Names(names) => format!(" {names:?}"),
            };
            self.sink.item("axis", format!("{} {}{labels}", dim.name, dim.len()).as_bytes());
        }
        for source in &fed.sources {
            self.sink.input(source, (self.input)(source).as_ref());
        }
    }

    fn lit(&mut self, path: &str, lit: &Lit) {
        match lit {
            Lit::List(items) => {
                self.sink.item(path, format!("list of {}", items.len()).as_bytes());
                for (i, item) in items.iter().enumerate() {
                    self.lit(&format!("{path}[{i}]"), item);
                }
            }
            Lit::Part(part) => {
                let version = self.version(&part.name);
                self.sink.item(path, format!("{}@{version}", part.name).as_bytes());
                let decl = self.registry.decl(&part.name);
                for (name, value) in part.args.iter().filter(|(name, _)| !is_how(decl, name)) {
                    self.lit(&format!("{path}.{name}"), value);
                }
            }
            Lit::Held(Held::Slot(slot)) => {
                self.sink.item(path, b"computed");
                let held = self.held;
                self.fed(&held[*slot]);
            }
            plain => self.sink.item(path, plain.to_string().as_bytes()),
        }
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::{Args, Part};

    use super::*;
    use crate::plan::Draw;

    fn step() -> Step {
        let fed = Fed {
            dims: vec![],
            sources: vec![Source::Number(0.5)],
            labelled: false,
            name: String::new(),
        };
        Step {
            address: "e/x".into(),
            op: "toy".into(),
            args: Args::from([("ke".into(), Part::new("cvar").with("alpha", 0.1).into())]),
            held: vec![],
            ports: vec![("x".into(), vec![fed])],
            draw: Some(Draw { seed: 3, member: None }),
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
    fn the_explanation_reads_as_what_is_hashed() {
        let text = explain(&step(), &Registry::default(), digest);
        let expected = format!(
            "format 1\nop toy@0\narg.ke cvar@0\narg.ke.alpha 0.1\nport x 1\ninput {} 0.5\nseed 3\nmember none\n",
            number_digest(0.5)
        );
        assert_eq!(text, expected);
    }

    #[test]
    fn the_digest_of_a_number_is_that_of_its_artifact() {
        for x in [0.0, -0.0, 1.5, -1e300, f64::MIN_POSITIVE, f64::INFINITY, f64::NAN] {
            assert_eq!(number_digest(x), Digest::of(&Array::scalar(x).encode()), "{x}");
        }
    }

    #[test]
    fn every_part_of_a_step_moves_the_key_but_its_address() {
        let registry = Registry::default();
        let base = key(&step(), &registry, digest);
        let changed = |change: &dyn Fn(&mut Step)| {
            let mut step = step();
            change(&mut step);
            key(&step, &registry, digest)
        };
        assert_eq!(changed(&|s| s.address = "other".into()), base);
        assert_ne!(changed(&|s| s.op = "tox".into()), base);
        assert_ne!(changed(&|s| s.args.clear()), base);
        assert_ne!(changed(&|s| s.draw = None), base);
        assert_ne!(changed(&|s| s.draw = Some(Draw { seed: 3, member: Some(0) })), base);
        assert_ne!(changed(&|s| s.ports[0].1[0].sources[0] = Source::Number(0.25)), base);
    }
}
