//! A great deal of text, and where its parts stand.

use super::super::*;
use super::check;
use crate::ast::{Expr, ExprKind};

#[test]
fn limits() {
    let chain = |n: usize| format!("edition \"2026\" let a = {}b", "b + ".repeat(n));
    assert_eq!(parse(&chain(900), 0).1, []);
    let too_deep = "IVX0101 1:9 an expression is deeper than 1000 operators and brackets; \
                    give its parts names with `let`";
    let deep = |text: &str| check(&format!("let a = {text}"), &["(let a junk)", too_deep]);
    deep(&format!("b{}", " + b".repeat(20_000)));
    deep(&format!("{}b", "-".repeat(20_000)));
    deep(&format!("b{}", ".c".repeat(20_000)));
    deep(&format!("b{}", "[c: 1]".repeat(20_000)));

    let nested = |n: usize, open: &str, close: &str| {
        format!("edition \"2026\" let a = {}b{}", open.repeat(n), close.repeat(n))
    };
    assert_eq!(parse(&nested(256, "(", ")"), 0).1, []);
    assert_eq!(parse(&nested(128, "f(x: -[", "])"), 0).1, []);
    let nesting = |text: &str| {
        let (ast, diagnostics) = parse(text, 0);
        assert_eq!(ast, Ast::default());
        let codes: Vec<_> = diagnostics.iter().map(|diagnostic| diagnostic.code).collect();
        assert_eq!(codes, [Code::Nesting]);
    };
    nesting(&nested(257, "(", ")"));
    nesting(&"[".repeat(10_000_000));
    nesting(&"f([{".repeat(100));
    nesting(&format!("param a: {}", "List<".repeat(100_000)));
    nesting(&format!("param a: {}", "Map<A, ".repeat(100_000)));
    let quoted = format!("edition \"2026\" let a = \"{0}\" // {0}", "(".repeat(257));
    assert_eq!(parse(&quoted, 0).1, []);
}

#[test]
fn large_files_end_quickly() {
    let faults = |kilobytes: usize, text: &str| {
        let many = text.repeat(kilobytes * 1000 / text.len());
        parse(&format!("edition \"2026\"\n{many}"), 0).1.len()
    };
    for blank in [" ", "// comment\n"] {
        assert_eq!(faults(10_000, blank), 0, "{blank:?}");
    }
    for good in ["let a = 1 ", "let a = f(x, y: [1, 2])\n", "experiment a { let b = 1 } "] {
        assert_eq!(faults(500, good), 0, "{good:?}");
    }
    for one_fault in ["junk ", "é", "\"", ")", "let ", "/// doc\n", "experiment a {}}"] {
        assert_eq!(faults(10_000, one_fault), 1, "{one_fault:?}");
    }
    for many_faults in ["let\n", "experiment a { let } "] {
        assert_eq!(faults(500, many_faults), MOST_FAULTS + 1, "{many_faults:?}");
    }
    // Wherever in a token the limit falls.
    for (entry, shift) in [("1, ", 0), ("\"\\\"é label\", ", 7), ("name, ", 4), ("-12.5e-3, ", 9)]
    {
        for shift in 0..=shift {
            let entries = entry.repeat((1 << 19) / entry.len());
            let one_item = format!("edition \"2026\" {}let a = [{entries}]", " ".repeat(shift));
            let (ast, diagnostics) = parse(&one_item, 0);
            assert!(matches!(ast.items[0].kind, ItemKind::Junk { .. }), "{entry}");
            let said: Vec<_> = diagnostics.iter().map(|fault| &fault.message[..]).collect();
            assert_eq!(said, ["this `let` is longer than 256 KiB"], "{entry} at {shift}");
        }
    }
    let fault = format!("edition \"2026\" let a = [1 {}]", "2, ".repeat(100_000));
    assert_eq!(parse(&fault, 0).1[0].message, "expected `,` or `]`, found `2`");
}

#[test]
fn spans_are_of_what_was_written() {
    let text = "\u{feff}edition \"2026\"\r\nlet é = 1\r\nlet a = f(\"é\", b) // é\r\nlet c = (x + 1) * -2 ";
    let (ast, diagnostics) = parse(text, 3);
    let written = |span: Span| &text[span.start as usize..span.end as usize];
    let items: Vec<_> = ast.items.iter().map(|item| written(item.span)).collect();
    assert_eq!(items, ["let é = 1", "let a = f(\"é\", b)", "let c = (x + 1) * -2"]);
    assert_eq!(written(ast.edition.unwrap().span), "\"2026\"");
    assert_eq!(written(diagnostics[0].labels[0].span), "é");
    let ItemKind::Let { value: Expr { kind: ExprKind::Call { name, args }, span }, .. } =
        &ast.items[1].kind
    else {
        panic!("a call was written");
    };
    let call = [name.span, args[0].1.span, args[1].1.span, *span].map(written);
    assert_eq!(call, ["f", "\"é\"", "b", "f(\"é\", b)"]);
    let ItemKind::Let { value: Expr { kind: ExprKind::Binary { op, left, right }, span }, .. } =
        &ast.items[2].kind
    else {
        panic!("a product was written");
    };
    let product = [op.span, left.span, right.span, *span].map(written);
    assert_eq!(product, ["*", "(x + 1)", "-2", "(x + 1) * -2"]);
}

#[test]
fn the_example_parses() {
    let (ast, diagnostics) = parse(EXAMPLE, 0);
    assert_eq!(diagnostics, []);
    let ItemKind::Experiment { items, .. } = &ast.items[1].kind else {
        panic!("an experiment was written");
    };
    assert_eq!(items.len(), 13);
    assert_eq!(ast.items[1].docs, "Thesis Example 2.8: what optimising a learned reward costs.");
    assert_eq!(items[0].docs, "ensemble size K");
}

#[test]
fn an_edited_text_reads_as_if_it_were_new() {
    let text = format!("{EXAMPLE}{MORE}");
    let (ast, diagnostics) = parse(&text, 0);
    assert_eq!(diagnostics, []);
    let typed = [
        "",
        "x",
        " ",
        "\n",
        "let ",
        "}",
        "{",
        "(",
        ")",
        "\"",
        "//",
        "/// doc\n",
        "é",
        "= 1 ",
        "use \"a\"",
        "experiment b {",
        "} experiment c { let",
        ".f[a: 1] + 2",
        " within(1) let d = e ",
        "profile",
        "\0",
    ];
    for at in (0..=text.len()).filter(|at| text.is_char_boundary(*at)) {
        let typed = typed.iter().cycle().skip(at % 5).step_by(5);
        for (i, typed) in typed.take(9).enumerate() {
            let end = text.ceil_char_boundary((at + i * i).min(text.len()));
            let edited = format!("{}{typed}{}", &text[..at], &text[end..]);
            let (again, anew) = (parse_again(&edited, 3, (&text, &ast)), parse(&edited, 3));
            assert_eq!(again, anew, "{typed:?} instead of {:?} at {at}", &text[at..end]);
        }
    }
}

const MORE: &str = r#"
profile desk: quick { a = -1 } published p from "p.ron" /// behind
param f: Map<Str, List<Int>> = [] let g(a: Ke, b: Float = 0.5) = match e.ke { "a": -x, -1: (y: 1, z) }
axis task(scene, env) = [("a", true)] axis n = a..b[c: 2.., d: ..e.f + 1]
experiment second { claim "c" at 0.9 by "t" family "F" : a on par with b within(0.1, "why") table "1" = t(x) }"#;

const EXAMPLE: &str = r#"edition "2026"
use "problems.ivx" { reward_curve }

/// Thesis Example 2.8: what optimising a learned reward costs.
experiment overoptimisation {
    param members: Int = 32                 /// ensemble size K
    param steps: Int = 10_000
    param seeds: Int = 20
    profile quick { members = 8, steps = 500, seeds = 5 }

    axis seed = 0..seeds
    axis ke   = { "WCM": wcm(), "MA": ma(), "BCM": bcm() }

    let data  = sample(reward_curve, n: 25, noise: 0.1)
    let model = train(
        ensemble(
            map_estimate(net: mlp(hidden: [1024, 1024], activation: tanh()),
                         prior: normal(0.0, 1.0),
                         optimiser: adamw(lr: linear(4e-4, 0.0))),
            members: members, bootstrap: true, prior_network: true),
        on: data, steps: steps)

    let decision = argmax(model, ke: ke, among: grid(-2.0, 2.0, points: 1001))

    measure optimality_gap = regret(decision, under: reward_curve)
    measure hallucination_gap = hallucination(decision, under: reward_curve)

    figure "2.10a" = bars(optimality_gap, by: ke)
    claim "hallucination is least under pessimism" :
        hallucination_gap[ke: "WCM"] < hallucination_gap[ke: "BCM"]
}
"#;
