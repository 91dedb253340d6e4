//! Shapes reach the rules of what takes a value, coordinate by coordinate, or not at all.

use std::fmt::Debug;
use std::sync::Arc;
use std::sync::LazyLock;

use ivx_op::{
    Array, Artifact, Collected, Ctx, Facts, Many, MemberCount, Members, One, Op, OpError, Parts,
    Registry, Shapes, Wrong, declare, family,
};

use crate::ir::{AxisId, Known, Place};
use crate::{Span, check, parse};

/// Something computed, of a kind.
#[derive(Debug)]
struct Made<const KIND: u8>;

impl<const KIND: u8> Artifact for Made<KIND> {
    const KIND: &'static str = if KIND == 0 { "Images" } else { "Machine" };
    fn encode(&self) -> Vec<u8> {
        Vec::new()
    }
    fn decode(_: &[u8]) -> Option<Self> {
        Some(Self)
    }
}

type Images = Made<0>;
type Machine = Made<1>;

trait Net: Debug + Send + Sync {
    fn side(&self) -> usize;
}

declare! {
    /// A network for images of one size.
    struct Conv = "conv" @ 1 {
        /// Their side.
        side: usize;
    }
}

impl Net for Conv {
    fn side(&self) -> usize {
        self.side
    }
}

declare! {
    /// Many networks.
    struct Several = "several" @ 1 {
        /// Of which make.
        net: Box<dyn Net>;
        /// How many.
        members: MemberCount = 3;
    }
}

impl Net for Several {
    fn side(&self) -> usize {
        let MemberCount = self.members;
        self.net.side()
    }
}

fn nets() -> &'static Parts<dyn Net> {
    static TABLE: LazyLock<Parts<dyn Net>> = LazyLock::new(|| {
        Parts::<dyn Net>::new().with(|x: Conv| Box::new(x)).with(|x: Several| Box::new(x))
    });
    &TABLE
}

family!(dyn Net, "Net", nets);

fn images(side: usize) -> Shapes {
    Shapes::from([("x".to_owned(), vec![side, side])])
}

/// Whether all shapes that are known are those of the first.
fn alike(facts: &Facts<'_>, ports: &[&'static str]) -> Result<(), Wrong> {
    let all = ports.iter().flat_map(|port| {
        let n = facts.over[*port].len();
        (0..n).filter_map(move |i| Some((*port, facts.shapes_at(port, i)?)))
    });
    let all: Vec<_> = all.collect();
    match all.iter().find(|(_, shapes)| *shapes != all[0].1) {
        None => Ok(()),
        Some((arg, odd)) => Err(Wrong {
            arg,
            message: format!("{:?} meets {:?}", all[0].1["x"], odd["x"]),
            help: "take others".to_owned(),
        }),
    }
}

macro_rules! op {
    (
        $ty:ident = $name:literal -> $out:ident { $($field:ident: $field_ty:ty),* }
        $(rule $rule:path;)? $(shapes $shapes:path;)?
    ) => {
        declare! {
            /// An operation.
            struct $ty = $name @ 1 -> $out {
                $(
                    /// An argument.
                    $field: $field_ty;
                )*
            }
            $(rule $rule;)?
            $(shapes $shapes;)?
        }
        impl Op for $ty {
            fn run(&self, _: &Ctx) -> Result<$out, OpError> {
                $( let _ = &self.$field; )*
                unreachable!("only checked")
            }
        }
    };
}

op! { Draw = "draw" -> Images { side: usize, contrast: f64 } shapes drawn; }
op! { Read = "read" -> Images { side: usize } }
op! { Fit = "fit" -> Machine { net: Box<dyn Net>, on: One<Images> } rule fits; shapes fitted; }
op! { Both = "both" -> Images { left: One<Images>, right: One<Images> } rule same; shapes left; }
op! { Join = "join" -> Images { all: Collected<Images> } shapes joined; }
op! { Guess = "guess" -> Array { by: One<Machine>, of: One<Images> } rule guesses; }
op! { Vote = "vote" -> Array { by: Members<Machine>, of: One<Images> } rule guesses; }
op! { Maybe = "maybe" -> Array { on: One<Images>, beside: Option<One<Images>> } rule maybe; }
op! { Show = "show" -> Array { all: Many<One<Images>> } rule shown; }

fn drawn(facts: &Facts<'_>) -> Option<Shapes> {
    facts.arg("side").map(images)
}

fn fits(facts: &Facts<'_>) -> Result<(), Wrong> {
    let (Some(net), Some(on)) = (facts.arg::<Box<dyn Net>>("net"), facts.shapes("on")) else {
        return Ok(());
    };
    let (wanted, found) = (net.side(), on["x"][0]);
    if wanted == found {
        return Ok(());
    }
    let message = format!("the network takes {wanted}, not {found}");
    Err(Wrong { arg: "net", message, help: format!("say `side: {found}`") })
}

fn fitted(facts: &Facts<'_>) -> Option<Shapes> {
    facts.arg::<Box<dyn Net>>("net").map(|net| images(net.side()))
}

fn same(facts: &Facts<'_>) -> Result<(), Wrong> {
    alike(facts, &["left", "right"])
}

fn left(facts: &Facts<'_>) -> Option<Shapes> {
    facts.shapes("left").cloned()
}

fn joined(facts: &Facts<'_>) -> Option<Shapes> {
    facts.shapes("all").cloned()
}

fn guesses(facts: &Facts<'_>) -> Result<(), Wrong> {
    alike(facts, &["by", "of"])
}

fn maybe(facts: &Facts<'_>) -> Result<(), Wrong> {
    assert_eq!(facts.over["beside"].is_empty(), !facts.is_given("beside"));
    alike(facts, &["on", "beside"])
}

fn shown(facts: &Facts<'_>) -> Result<(), Wrong> {
    alike(facts, &["all"])
}

/// What is told of the items of an experiment: the message, and what is underlined.
fn told(items: &str) -> Vec<String> {
    told_of(&[&format!("edition \"2026\"\nexperiment e {{ {items} }}")])
}

/// The same of files, of which each uses the next as "b".
fn told_of(texts: &[&str]) -> Vec<String> {
    let registry = Registry::default()
        .op::<Draw>()
        .op::<Read>()
        .op::<Fit>()
        .op::<Both>()
        .op::<Join>()
        .op::<Guess>()
        .op::<Vote>()
        .op::<Maybe>()
        .op::<Show>()
        .parts(nets());
    let files = texts.iter().enumerate().map(|(i, text)| {
        let (ast, faults) = parse(text, u32::try_from(i).expect("a few files"));
        assert_eq!(faults, [], "{text}");
        check::File {
            stem: format!("f{i}"),
            text: (*text).to_owned(),
            ast: ast.into(),
            links: [("b".to_owned(), i + 1)].into(),
            ..check::File::default()
        }
    });
    let project = check::Project { files: files.collect() };
    let (_, diagnostics) = check::check(&project, &registry, &check::Settings::default());
    let source = |span: Span| &texts[span.file as usize][span.start as usize..span.end as usize];
    let told = diagnostics.iter().filter(|d| d.code.severity() == crate::Severity::Error);
    told.map(|d| {
        let labels = d.labels.iter().map(|label| format!(" <{}>", source(label.span)));
        d.message.clone() + &labels.collect::<String>()
    })
    .collect()
}

#[test]
fn a_rule_sees_the_shapes_of_what_ports_take() {
    let check = |items: &str, expected: &[&str]| assert_eq!(told(items), expected, "{items}");
    check("measure m = guess(fit(conv(side: 8), on: draw(8, 1.0)), of: draw(8, 0.0))", &[]);
    check(
        "let data = draw(8, 1.0) let m = fit(conv(side: 9), on: data)",
        &["the network takes 9, not 8 <conv(side: 9)>"],
    );
    check(
        "let data = draw(8, 1.0) measure m = guess(fit(conv(side: 8), on: data), of: draw(9, 0.0))",
        &["[8, 8] meets [9, 9] <draw(9, 0.0)>"],
    );
    check(
        "let data = draw(8, 1.0) let other = draw(9, 1.0) let b = both(left: data, right: other)",
        &["[8, 8] meets [9, 9] <other> <draw(9, 1.0)>"],
    );
    check(
        "measure m = show([draw(8, 1.0), draw(8, 0.0), draw(7, 0.0)])",
        &["[8, 8] meets [7, 7] <[draw(8, 1.0), draw(8, 0.0), draw(7, 0.0)]>"],
    );
}

#[test]
fn a_port_that_is_left_out_is_absent() {
    let check = |items: &str, expected: &[&str]| assert_eq!(told(items), expected, "{items}");
    check("measure m = maybe(draw(8, 1.0))", &[]);
    check("measure m = maybe(draw(8, 1.0), beside: draw(8, 0.0))", &[]);
    check(
        "measure m = maybe(draw(8, 1.0), beside: draw(9, 0.0))",
        &["[8, 8] meets [9, 9] <draw(9, 0.0)>"],
    );
    check(
        "measure m = maybe(beside: draw(9, 0.0))",
        &["`maybe` needs `on: Images` <maybe(beside: draw(9, 0.0))>"],
    );
    check(
        "measure m = maybe(draw(8, 1.0), beside: [draw(8, 0.0)])",
        &["`maybe.beside` takes one Images, found a list of 1 <[draw(8, 0.0)]>"],
    );
    // It varies over what is given to it, and over nothing where nothing is.
    check(
        "axis n = [8, 9] let d = draw(n, 0.0) measure a = maybe(draw(8, 1.0))[n: 8] \
         measure b = maybe(draw(8, 1.0), beside: d[n: [8]])[n: 8]",
        &["this does not vary over `n` <n>"],
    );
}

const NINE: &str = "the network takes 9, not 8";

#[test]
fn shapes_pass_through_what_the_language_does() {
    let check = |items: &str, expected: &[&str]| assert_eq!(told(items), expected, "{items}");
    let nine = format!("{NINE} <conv(side: 9)>");
    let refused = |items: &str| check(items, &[&nine]);
    refused("let a = draw(8, 0.0) let b = a let m = fit(conv(side: 9), on: b)");
    refused("let f(on: Images) = on let m = fit(conv(side: 9), on: f(on: draw(8, 0.0)))");
    refused("let f(on: Images) = fit(conv(side: 9), on: on) let m = f(on: draw(8, 0.0))");
    refused("param n: Int = 8 let m = fit(conv(side: 9), on: draw(n, 0.0))");
    refused(
        "axis n = [9, 8, 7] let m = fit(conv(side: 9), on: draw(n, 0.0)[n: [9, 8]][n: [8, 9]][n: 8])",
    );
    refused(
        "axis c = [0.0, 1.0] let all = collect(draw(8, c), over: c) \
         let m = fit(conv(side: 9), on: join(all))",
    );
    check(
        "let m = fit(several(conv(side: 8)), on: draw(8, 0.0)) \
         let n = vote(m, of: draw(9, 0.0)) let o = guess(m[member: 1], of: draw(9, 0.0)) \
         let p = vote(m[member: [0, 2]], of: draw(8, 0.0))",
        &["[8, 8] meets [9, 9] <draw(9, 0.0)>", "[8, 8] meets [9, 9] <draw(9, 0.0)>"],
    );
}

#[test]
fn shapes_pass_from_one_experiment_and_file_to_another() {
    let here = "edition \"2026\" experiment a { let d = draw(8, 0.0) } \
                experiment e { let m = fit(conv(side: 9), on: a.d) }";
    assert_eq!(told_of(&[here]), [format!("{NINE} <conv(side: 9)>")]);
    let here = "edition \"2026\" use \"b\" { data } \
                experiment e { let m = fit(conv(side: 9), on: data) }";
    let there = "edition \"2026\" let data = draw(8, 0.0)";
    assert_eq!(told_of(&[here, there]), [format!("{NINE} <conv(side: 9)>")]);
    let alone = "edition \"2026\" let data = draw(8, 0.0) let m = fit(conv(side: 9), on: data)";
    assert_eq!(told_of(&[alone]), [format!("{NINE} <conv(side: 9)>")]);
}

#[test]
fn only_coordinates_that_go_wrong_are_named() {
    let check = |items: &str, expected: &[&str]| assert_eq!(told(items), expected, "{items}");
    let axes = "axis seed = 0..3 axis c = [0.0, 1.0] axis n = [7, 8, 9]";
    let with = |items: &str| format!("{axes} {items}");
    check(
        &with("let m = fit(conv(side: 8), on: draw(n, c)[n: [8, 9]])"),
        &["the network takes 8, not 9 at n = 9 <conv(side: 8)>"],
    );
    check(
        &with("let m = fit(conv(side: n), on: draw(n, c)) let o = guess(m, of: draw(n, c))"),
        &[],
    );
    check(
        &with("let d = draw(n, c) let m = fit(conv(side: n), on: d[n: 8])"),
        &["the network takes 7, not 8 at n = 7 <conv(side: n)>"],
    );
    check(
        &with(
            "let d = match n { \"7\": read(7), \"8\": draw(8, c), \"9\": draw(6, c) } \
             let m = fit(conv(side: 8), on: d) let o = guess(fit(conv(side: 8), on: d[n: 8]), of: d)",
        ),
        &[
            "the network takes 8, not 6 at n = 9 <conv(side: 8)>",
            "[8, 8] meets [6, 6] at n = 9 <d> <draw(6, c)>",
        ],
    );
    check(
        "axis t(side, net) = { \"a\": (8, conv(side: 8)), \"b\": (9, conv(side: 7)) } \
         let m = fit(t.net, on: draw(t.side, 0.0))",
        &["the network takes 7, not 9 at t = b <t.net>"],
    );
    // Where what is seen together is alike at some coordinates only.
    check(
        &with(
            "axis k = [7, 8] let d = match k { \"7\": draw(7, c), \"8\": draw(n, c) } \
             let m = fit(conv(side: 5), on: join(collect(d, over: n)))",
        ),
        &["the network takes 5, not 7 at k = 7 <conv(side: 5)>"],
    );
}

#[test]
fn what_is_not_known_is_not_judged() {
    let silent = |items: &str| assert_eq!(told(items), [] as [&str; 0], "{items}");
    silent("let m = fit(conv(side: 9), on: read(8))");
    silent("let b = both(read(8), draw(9, 0.0)) let m = fit(conv(side: 8), on: b)");
    silent(
        "axis n = [8, 9] let all = collect(draw(n, 0.0), over: n) \
         let m = fit(conv(side: 7), on: join(all))",
    );
    silent(
        "axis n = [8, 9] let d = match n { \"8\": read(8), \"9\": draw(9, 0.0) } \
         let m = fit(conv(side: 9), on: d)",
    );
}

#[test]
fn long_chains_and_diamonds_end() {
    let chain = |n: usize| -> String {
        let both = (1..=n).map(|i| format!("let a{i} = both(a{}, a{})\n", i - 1, i / 2));
        format!("axis n = [8, 9] let a0 = draw(n, 0.0)\n{}", both.collect::<String>())
    };
    let check = |n: usize| {
        let items = format!("{} let m = fit(conv(side: 8), on: a{n})", chain(n));
        assert_eq!(told(&items), ["the network takes 8, not 9 at n = 9 <conv(side: 8)>"]);
    };
    check(60);
    check(10_000);
    let pick =
        |i: usize| format!("let b{i} = match n {{ \"8\": b{0}, \"9\": b{0}[n: 9] }}\n", i - 1);
    let picks: Vec<String> = (1..=10_000).map(pick).collect();
    let picks = picks.concat();
    let items = format!(
        "axis n = [8, 9] let b0 = draw(n, 0.0)\n{picks} let m = fit(conv(side: 8), on: b10000)"
    );
    assert_eq!(told(&items), ["the network takes 8, not 9 at n = 9 <conv(side: 8)>"]);
}

#[test]
fn axes_along_which_nothing_differs_are_left_out() {
    let axes = vec![(AxisId(1), 2), (AxisId(3), 2), (AxisId(4), 3)];
    let [seven, eight] = [7, 8].map(|side| Some(Arc::new(images(side))));
    let row = |shapes: &Option<Arc<Shapes>>| vec![shapes.clone(); 3];
    let at = [&seven, &None, &seven, &None].map(row).concat();
    let known = Known::new(axes.clone(), at).expect("something is known");
    assert!(known.axes().eq([AxisId(3)]));
    assert_eq!(known.at(&Place::from([(AxisId(3), 1)])), None);
    assert_eq!(known.at(&Place::from([(AxisId(3), 0), (AxisId(9), 5)])), seven.as_ref());
    let at = [&seven, &seven, &seven, &eight].map(row).concat();
    let known = Known::new(axes.clone(), at).expect("something is known");
    assert!(known.axes().eq([AxisId(1), AxisId(3)]));
    assert_eq!(known.at(&Place::from([(AxisId(1), 1), (AxisId(3), 1)])), eight.as_ref());
    assert_eq!(Known::new(axes, vec![None; 12]), None);
}
