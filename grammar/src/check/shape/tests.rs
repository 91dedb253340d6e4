//! Shapes reach the rules of what takes a value, coordinate by coordinate, or not at all.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_op::{
    Array, Artifact, Collected, Ctx, Facts, Many, MemberCount, Members, One, Op, OpError, Parts,
    Registry, Shapes, Wrong, declare, family,
};

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
        .op::<Show>()
        .parts(nets());
    let files = texts.iter().enumerate().map(|(i, text)| {
        let (ast, faults) = parse(text, u32::try_from(i).expect("a few files"));
        assert_eq!(faults, [], "{text}");
        check::File {
            stem: format!("f{i}"),
            text: (*text).to_owned(),
            ast,
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
fn what_is_not_known_is_not_judged() {
    let silent = |items: &str| assert_eq!(told(items), [] as [&str; 0], "{items}");
    silent("let m = fit(conv(side: 9), on: read(8))");
    silent("let b = both(read(8), draw(9, 0.0)) let m = fit(conv(side: 8), on: b)");
    silent(
        "axis n = [8, 9] let all = collect(draw(n, 0.0), over: n) let m = fit(conv(side: 7), on: join(all))",
    );
    silent(
        "axis n = [8, 9] let d = match n { \"8\": read(8), \"9\": draw(9, 0.0) } let m = fit(conv(side: 9), on: d)",
    );
}
