//! Laws of keys: what a spec computes decides them, not how it is written.
//!
//! Every run tries the same experiments; `PROPTEST_CASES=10000` tries more of them.

use std::collections::BTreeMap;

use ivx_cache::Digest;
use ivx_engine::{Plan, Source, expand, key, number_digest};
use ivx_grammar::check::{File, Project, Settings, check};
use ivx_grammar::{format, parse};
use ivx_op::Registry;
use proptest::collection::vec;
use proptest::prelude::{BoxedStrategy, Just, ProptestConfig, Strategy, any, prop_oneof, proptest};
use proptest::sample::{Index, select};
use proptest::test_runner::RngSeed;

fn config() -> ProptestConfig {
    ProptestConfig { rng_seed: RngSeed::Fixed(0), failure_persistence: None, ..Default::default() }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn keys_do_not_depend_on_how_a_spec_is_written(
        experiment in experiment(),
        writing in writing(),
    ) {
        let (plain, other) = (Writing::default().of(&experiment), writing.of(&experiment));
        assert_eq!(keys(&plain), keys(&other), "{}\n---\n{}", plain.join("\n"), other.join("\n"));
    }

    #[test]
    fn keys_depend_on_what_a_spec_says(
        experiment in experiment(),
        change in select(&CHANGES[..]),
        writing in writing(),
    ) {
        let mut changed = experiment.clone();
        change(&mut changed);
        let texts = [&experiment, &changed].map(|experiment| writing.of(experiment));
        assert_ne!(keys(&texts[0]), keys(&texts[1]), "{}", texts.map(|t| t.join("\n")).join("\n---\n"));
    }
}

/// Changes of one value that some result depends on.
pub(crate) const CHANGES: [fn(&mut Experiment); 6] = [
    |experiment| experiment.seeds[0] += 100,
    |experiment| experiment.label += "'",
    |experiment| experiment.n += 1,
    |experiment| experiment.noise += 0.5,
    |experiment| experiment.degree += 1,
    |experiment| experiment.bound += 0.5,
];

/// A small experiment: data, models, and results of several kinds on them.
#[derive(Clone, Debug)]
pub(crate) struct Experiment {
    seeds: Vec<i64>,
    label: String,
    n: i64,
    noise: f64,
    degree: i64,
    /// What the claims compare with.
    bound: f64,
    /// Results beside those that every experiment has.
    more: Vec<Operation>,
}

/// How a result is made of those before it.
#[derive(Clone, Debug)]
enum Operation {
    Truth,
    Spread,
    Scaled(f64, Index),
    Negated(Index),
    Combined(&'static str, Index, Index),
    Reduced(&'static str, Index),
    Selected(Index),
    Matched(Index, Index),
    Grouped(Index),
}

/// Any experiment.
pub(crate) fn experiment() -> impl Strategy<Value = Experiment> {
    let label = select(vec!["A", "WCM", "the worst"]).prop_map(str::to_owned);
    let numbers = (1..20_i64, 0..4_u8, 1..5_i64, -2.0..2.0_f64);
    (0..5_i64, 1..3_i64, label, numbers, vec(operation(), 0..6)).prop_map(
        |(first, step, label, (n, noise, degree, bound), more)| Experiment {
            seeds: vec![first, first + step],
            label,
            n,
            noise: f64::from(noise) / 4.0,
            degree,
            bound,
            more,
        },
    )
}

fn operation() -> BoxedStrategy<Operation> {
    let one = any::<Index>;
    let op = select(vec!["+", "-", "*", "/", "<", "<=", ">", ">=", "==", "!="]);
    let reduction = select(vec!["mean", "max", "std", "share"]);
    prop_oneof![
        Just(Operation::Truth),
        Just(Operation::Spread),
        (-2.0..2.0_f64, one()).prop_map(|(by, x)| Operation::Scaled(by, x)),
        one().prop_map(Operation::Negated),
        (op, one(), one()).prop_map(|(op, left, right)| Operation::Combined(op, left, right)),
        (reduction, one()).prop_map(|(reduction, x)| Operation::Reduced(reduction, x)),
        one().prop_map(Operation::Selected),
        (one(), one()).prop_map(|(first, second)| Operation::Matched(first, second)),
        one().prop_map(Operation::Grouped),
    ]
    .boxed()
}

/// One way to write an experiment.
#[derive(Clone, Debug, Default)]
#[expect(clippy::struct_excessive_bools, reason = "each is a way to write of its own")]
pub(crate) struct Writing {
    /// Whether names have others.
    renamed: bool,
    /// Whether each `let` is written out where it is used; the last goes for all that follow.
    inlined: Vec<bool>,
    /// How many `let`s lie in another file.
    elsewhere: usize,
    /// The order of items; those of equal numbers stay in order.
    order: Vec<u8>,
    /// Whether named arguments stand in reverse.
    reversed: bool,
    /// Whether comments stand about items and arguments.
    commented: bool,
    /// Whether the text is in its one layout.
    formatted: bool,
}

/// Any way to write.
pub(crate) fn writing() -> impl Strategy<Value = Writing> {
    let flags = any::<[bool; 4]>();
    (vec(any::<bool>(), 0..8), 0..12_usize, vec(any::<u8>(), 0..12), flags).prop_map(
        |(inlined, elsewhere, order, [renamed, reversed, commented, formatted])| Writing {
            renamed,
            inlined,
            elsewhere,
            order,
            reversed,
            commented,
            formatted,
        },
    )
}

/// An expression.
#[derive(Clone)]
enum Term {
    Plain(String),
    /// The `let` of this number.
    Bound(usize),
    Call(&'static str, Vec<(&'static str, Term)>),
    /// The function of the experiment with its argument.
    Learner(i64),
    Binary(&'static str, Box<Term>, Box<Term>),
    Negated(Box<Term>),
    Selected(Box<Term>, String),
    /// A match over `ke`: labels and arms.
    Match(Vec<(String, Term)>),
}

/// A result: a `let`, and the axes it varies over.
#[derive(Clone)]
struct Value {
    term: Term,
    axes: Vec<&'static str>,
}

fn plain(text: &str) -> Term {
    Term::Plain(text.to_owned())
}

fn number(n: i64) -> Term {
    Term::Plain(n.to_string())
}

fn grid() -> Term {
    Term::Call("grid", vec![("low", plain("-1.0")), ("high", plain("1.0")), ("points", number(3))])
}

fn reward() -> Term {
    Term::Call("sinusoids", vec![])
}

impl Experiment {
    /// The data and the models.
    fn made(&self) -> Vec<Term> {
        let sample = |n: i64, stream: &str| {
            let args = vec![
                ("reward", reward()),
                ("n", number(n)),
                ("noise", plain(&format!("{:?}", self.noise))),
                ("stream", plain(&format!("{stream:?}"))),
            ];
            Term::Call("sample", args)
        };
        let train = |learner: Term, steps: i64| {
            let args = vec![("learner", learner), ("on", Term::Bound(0)), ("steps", number(steps))];
            Term::Call("train", args)
        };
        let net = Term::Call("map_estimate", vec![("batch", plain("2"))]);
        let ensemble = Term::Call("ensemble", vec![("learner", net), ("members", number(2))]);
        vec![
            sample(self.n, "main"),
            sample(9, "test"),
            train(Term::Learner(self.degree), 0),
            train(ensemble, 3),
        ]
    }

    /// The `let`s: data, models, and then the results.
    fn lets(&self) -> (Vec<Term>, Vec<Value>) {
        let made = self.made();
        let predicted = Term::Call("predict", vec![("model", Term::Bound(3)), ("at", grid())]);
        let chosen = vec![("model", Term::Bound(3)), ("ke", plain("ke")), ("among", grid())];
        let mut values = vec![
            Value {
                term: Term::Call("rmse", vec![("model", Term::Bound(2)), ("on", Term::Bound(1))]),
                axes: vec!["degree", "seed"],
            },
            Value {
                term: Term::Call(
                    "regret",
                    vec![("decision", Term::Call("argmax", chosen)), ("under", reward())],
                ),
                axes: vec!["ke", "seed"],
            },
        ];
        for operation in &self.more {
            let taken = |index: &Index| {
                let i = index.index(values.len());
                (Box::new(Term::Bound(made.len() + i)), values[i].axes.clone())
            };
            let over = |x: Term, function: &'static str, axis: &str| {
                Term::Call(function, vec![("x", x), ("over", plain(axis))])
            };
            let (term, axes) = match operation {
                Operation::Truth => {
                    let truth = vec![("reward", reward()), ("at", grid())];
                    (over(Term::Call("reward_at", truth), "mean", "x"), vec![])
                }
                Operation::Spread => {
                    (over(over(predicted.clone(), "std", "member"), "max", "x"), vec!["seed"])
                }
                Operation::Scaled(by, x) => {
                    let (x, axes) = taken(x);
                    (Term::Binary("*", Box::new(plain(&format!("({by:?})"))), x), axes)
                }
                Operation::Negated(x) => {
                    let (x, axes) = taken(x);
                    (Term::Negated(x), axes)
                }
                Operation::Combined(op, left, right) => {
                    let ((left, mut axes), (right, more)) = (taken(left), taken(right));
                    axes.extend(more);
                    axes.sort_unstable();
                    axes.dedup();
                    (Term::Binary(op, left, right), axes)
                }
                Operation::Reduced(function, x) => match taken(x) {
                    (x, mut axes) if !axes.is_empty() => {
                        let axis = axes.remove(0);
                        (over(*x, function, axis), axes)
                    }
                    (x, axes) => (Term::Negated(x), axes),
                },
                Operation::Selected(x) => match taken(x) {
                    (x, mut axes) if !axes.is_empty() => {
                        let at = match axes.remove(0) {
                            "seed" => format!("seed: {}", self.seeds[1]),
                            "ke" => format!("ke: {:?}", self.label),
                            _ => "degree: 1".to_owned(),
                        };
                        (Term::Selected(x, at), axes)
                    }
                    (x, axes) => (Term::Negated(x), axes),
                },
                Operation::Matched(first, second) => {
                    let ((first, mut axes), (second, more)) = (taken(first), taken(second));
                    axes.extend(more);
                    axes.push("ke");
                    axes.sort_unstable();
                    axes.dedup();
                    let arms = vec![(self.label.clone(), *first), ("MA".to_owned(), *second)];
                    (Term::Match(arms), axes)
                }
                Operation::Grouped(x) => {
                    let (x, axes) = taken(x);
                    let cost = Term::Binary("*", Box::new(plain("task.cost")), x);
                    let by = ("by", plain("task.kind"));
                    let mean = Term::Call("mean", vec![("x", cost), ("over", plain("task")), by]);
                    (Term::Selected(Box::new(mean), "kind: \"easy\"".to_owned()), axes)
                }
            };
            values.push(Value { term, axes });
        }
        (made, values)
    }
}

impl Writing {
    /// The texts of the spec and of the file that it uses.
    pub(crate) fn of(&self, experiment: &Experiment) -> Vec<String> {
        let (made, values) = experiment.lets();
        let terms = [made.clone(), values.iter().map(|v| v.term.clone()).collect()].concat();
        let n_elsewhere = self.elsewhere.min(terms.len());
        // What is brought gets its other name on the way.
        let there = Self { renamed: self.renamed && n_elsewhere == 0, ..self.clone() };
        let (learner, degree) = (there.name("learner"), self.name("power"));
        let mut theirs = vec![
            "axis degree = [1, 2]".to_owned(),
            "axis task(kind, cost) = { \"a\": (\"easy\", 1), \"b\": (\"hard\", 2.5), \"c\": (\"easy\", 3) }"
                .to_owned(),
            format!("axis ke = {{ {:?}: wcm(), \"MA\": ma() }}", experiment.label),
            format!(
                "let {learner}({degree}: Int) = {}",
                there.call(
                    "linear_map",
                    &[
                        ("features", format!("polynomial({degree})")),
                        ("prior", "normal(0.0, degree)".to_owned()),
                    ]
                )
            ),
        ];
        let mut ours = vec![format!("axis seed = {:?}", experiment.seeds)];
        let mut brought = vec![
            "degree".to_owned(),
            "ke".to_owned(),
            "task".to_owned(),
            format!("{learner} as {}", self.name("learner")),
        ];
        for (i, term) in terms.iter().enumerate().filter(|(i, _)| !self.inlines(*i)) {
            let bound = |by: &Self| format!("let {} = {}", by.bound(i), by.term(term, &terms));
            if i < n_elsewhere {
                theirs.push(bound(&there));
                brought.push(format!("{} as {}", there.bound(i), self.bound(i)));
            } else {
                ours.push(bound(self));
            }
        }
        for (i, value) in values.iter().enumerate() {
            let term = self.term(&Term::Bound(made.len() + i), &terms);
            ours.push(format!("measure m{i} = {term}"));
            ours.push(format!("claim \"c{i}\" : m{i} <= {:?}", experiment.bound));
            if let ["ke", "seed"] = value.axes[..] {
                ours.push(format!("figure \"f{i}\" = bars(m{i}, by: ke)"));
                ours.push(format!("table \"t{i}\" = table(1.0 * {term}, rows: ke)"));
            }
        }
        let data = self.term(&Term::Bound(0), &terms);
        ours.push(format!("figure \"data\" = plot([points(collect({data}, over: seed))])"));
        if n_elsewhere == 0 {
            ours.append(&mut theirs);
            return vec![self.text("", &ours)];
        }
        let mut head = String::new();
        if self.renamed {
            head = format!("{{ {} }}", brought.join(", "));
        }
        vec![self.text(&format!("use \"lib.ivx\" {head}\n"), &ours), self.file("", &theirs)]
    }

    /// The file with the experiment.
    fn text(&self, head: &str, items: &[String]) -> String {
        self.file(head, &[format!("experiment e {{\n{}}}", self.ordered(items))])
    }

    fn file(&self, head: &str, items: &[String]) -> String {
        let text = format!("edition \"2026\"\n{head}{}", self.ordered(items));
        if self.formatted { format(&text).expect("the text reads") } else { text }
    }

    fn ordered(&self, items: &[String]) -> String {
        let mut items: Vec<_> = items.iter().enumerate().collect();
        items.sort_by_key(|(i, _)| self.order.get(i % self.order.len().max(1)));
        let comment = if self.commented { "   // so\n\n// and so" } else { "" };
        let items = items.iter().map(|(_, item)| format!("{item}{comment}\n"));
        items.collect::<Vec<_>>().concat()
    }

    fn inlines(&self, i: usize) -> bool {
        self.inlined.get(i).or(self.inlined.last()).is_some_and(|inlined| *inlined)
    }

    fn bound(&self, i: usize) -> String {
        self.name(&format!("a{i}"))
    }

    fn name(&self, name: &str) -> String {
        if self.renamed { format!("renamed_{name}") } else { name.to_owned() }
    }

    fn term(&self, term: &Term, terms: &[Term]) -> String {
        let written = |term: &Term| self.term(term, terms);
        match term {
            Term::Plain(text) => text.clone(),
            Term::Bound(i) if self.inlines(*i) => format!("({})", written(&terms[*i])),
            Term::Bound(i) => self.bound(*i),
            Term::Learner(degree) => format!("{}({degree} * degree)", self.name("learner")),
            Term::Call(name, args) => {
                let args: Vec<_> = args.iter().map(|(name, arg)| (*name, written(arg))).collect();
                self.call(name, &args)
            }
            Term::Binary(op, left, right) => format!("{} {op} {}", written(left), written(right)),
            Term::Negated(x) => format!("-{}", written(x)),
            Term::Selected(x, at) => format!("{}[{at}]", written(x)),
            Term::Match(arms) => {
                let arms = arms.iter().map(|(label, arm)| format!("{label:?}: {}", written(arm)));
                let mut arms: Vec<_> = arms.collect();
                if self.reversed {
                    arms.reverse();
                }
                format!("match ke {{ {} }}", arms.join(", "))
            }
        }
    }

    fn call(&self, name: &str, args: &[(&str, String)]) -> String {
        let mut args: Vec<_> = args.iter().map(|(name, arg)| format!("{name}: {arg}")).collect();
        if self.reversed {
            args.reverse();
        }
        let comma = if self.commented { ",   // and\n" } else { ", " };
        format!("{name}({})", args.join(comma))
    }
}

/// The plan of a spec.
///
/// - `texts`: the spec, and then maybe `lib.ivx`.
pub(crate) fn plan(texts: &[String], registry: &Registry) -> Plan {
    let files = texts.iter().enumerate().map(|(i, text)| {
        let (ast, faults) = parse(text, u32::try_from(i).expect("files are few"));
        assert_eq!(faults, [], "{text}");
        let stem = ["spec", "lib"][i].to_owned();
        let links = if i + 1 < texts.len() {
            BTreeMap::from([("lib.ivx".to_owned(), i + 1)])
        } else {
            BTreeMap::new()
        };
        File {
            path: format!("{stem}.ivx"),
            stem,
            text: text.clone(),
            ast: ast.into(),
            links,
            ..File::default()
        }
    });
    let project = Project { files: files.collect() };
    let (spec, faults) = check(&project, registry, &Settings::default());
    let faults: Vec<_> = faults.iter().filter(|fault| fault.code as u16 / 100 != 6).collect();
    assert!(faults.is_empty(), "{faults:?}\n{}", texts.join("\n---\n"));
    expand(&spec, registry)
}

/// The keys of a spec's nodes, sorted, each made with its inputs' keys for their digests.
fn keys(texts: &[String]) -> Vec<Digest> {
    let registry = ivx_library::registry();
    let plan = plan(texts, &registry);
    let mut keys: Vec<Digest> = Vec::new();
    for step in plan.graph.node_weights() {
        // Inputs have smaller numbers.
        let input = |source: &Source| match source {
            Source::Node(node) => keys[node.index()],
            Source::Number(number) => number_digest(*number),
        };
        keys.push(key(step, &registry, input));
    }
    assert!(keys.len() > 20, "the experiment computes something");
    keys.sort_unstable();
    keys
}
