//! Small cases.

pub(crate) mod dump;
mod faults;
mod total;

use super::parse;

#[test]
fn items() {
    check(
        "use \"a.ivx\" use \"b.ivx\" { c, d as e, }",
        &[r#"(use "a.ivx")"#, r#"(use "b.ivx" c as c d as e)"#],
    );
    check("include \"a.ivx\"", &[r#"(include "a.ivx")"#]);
    check(
        "param n: Int = 3\nparam xs: Map<List<Float>, Str> = []",
        &["(param n Int 3)", "(param xs Map<List<Float> Str> [])"],
    );
    check(
        "profile quick { a = 1, b = 2, }\nprofile desk { a = 1\n b = -2 }\nprofile none {}",
        &["(profile quick a: 1 b: 2)", "(profile desk a: 1 b: -2)", "(profile none)"],
    );
    check(
        "profile desk: quick { a = 1 } profile d : q {}",
        &["(profile desk of quick a: 1)", "(profile d of q)"],
    );
    check(
        "published t from \"t.ron\" published from from \"../t.ron\"",
        &[r#"(published t "t.ron")"#, r#"(published from "../t.ron")"#],
    );
    check(
        "axis seed = 0..seeds axis x = a.b..f(1)+2",
        &["(axis seed 0..seeds)", "(axis x a.b..(+ (f 1) 2))"],
    );
    check(
        "axis ke = { \"WCM\": wcm(), \"MA\": ma(), } axis none = {}",
        &[r#"(axis ke {"WCM": (wcm) "MA": (ma)})"#, "(axis none {})"],
    );
    check("axis n = [1, 2,] axis m = ns", &["(axis n [1 2])", "(axis m ns)"]);
    check(
        "let f(a: Ke, b: Float = 0.5,) = a let g() = 1",
        &["(let f ((a Ke) (b Float 0.5)) a)", "(let g () 1)"],
    );
    check(
        "measure m = a figure \"1\" = b table \"2\" = c claim \"3\" : d < e",
        &["(measure m a)", r#"(figure "1" b)"#, r#"(table "2" c)"#, r#"(claim "3" (< d e))"#],
    );
    check(
        "claim \"1\" : a == b within(0.05)\nclaim \"2\" : within (c) == d + within within(e) let within = 1",
        &[
            r#"(claim "1" (== a b) within 0.05)"#,
            r#"(claim "2" (== (within c) (+ d within)) within e)"#,
            "(let within 1)",
        ],
    );
    check(
        "claim \"1\" at 0.9 by \"t\" family \"F\" : a >= b within(0.1, \"why\",) let family = by claim \"2\" family \"G\" : on on par with par within(with)",
        &[
            r#"(claim "1" at 0.9 by "t" family "F" (>= a b) within 0.1 "why")"#,
            "(let family by)",
            r#"(claim "2" family "G" (== on par) on par within with)"#,
        ],
    );
    check(
        "claim \"1\" at 0.99 : a < b let at = 1 claim \"2\" at at : at == at within(at)",
        &[
            r#"(claim "1" at 0.99 (< a b))"#,
            "(let at 1)",
            r#"(claim "2" at at (== at at) within at)"#,
        ],
    );
    check(
        "table \"1\" = table(a) figure \"2\" = figure (b) table \"3\" =\ntable(c)",
        &[r#"(table "1" (table a))"#, r#"(figure "2" (figure b))"#, r#"(table "3" (table c))"#],
    );
    check(
        "experiment a { let b = 1 } experiment c {}",
        &["(experiment a (let b 1))", "(experiment c)"],
    );
}

#[test]
fn expressions() {
    expression("true", &["true"]);
    expression("truer", &["truer"]);
    expression("1_000", &["1000"]);
    expression("1_000.5", &["1000.5"]);
    expression("4e-4", &["0.0004"]);
    expression("-9223372036854775808", &["-9223372036854775808"]);
    expression("- 2.0", &["-2.0"]);
    expression("--2", &["(- -2)"]);
    expression("-x[a: 1].b", &["(- (at x a: 1).b)"]);
    expression(r#""a \" \\ \n \t é // b""#, &[r#""a \" \\ \n \t é // b""#]);
    expression("[[], [1, x,]]", &["[[] [1 x]]"]);
    expression("f(a, b: 1, c: g(),)", &["(f a b: 1 c: (g))"]);
    expression("f (x).y[a: [1, 2], b: \"c\"]", &[r#"(at (f x).y a: [1 2] b: "c")"#]);
    expression("a - b - c", &["(- (- a b) c)"]);
    expression("a + b * c / d - e", &["(- (+ a (/ (* b c) d)) e)"]);
    expression("(a + b) * c", &["(* (+ a b) c)"]);
    expression("-a * -b", &["(* (- a) (- b))"]);
    expression("a + 1 < b * 2", &["(< (+ a 1) (* b 2))"]);
    expression("a == b", &["(== a b)"]);
    expression("(a <= b) != (c >= d)", &["(!= (<= a b) (>= c d))"]);
    expression("a\n// comment\n+ b // comment", &["(+ a b)"]);
}

#[test]
fn docs() {
    check(
        "/// one\n///two\n\n// no\nlet a = 1 /// three\n/// four\nlet b = 2 //// no",
        &[r#"("one\ntwo\nthree" let a 1)"#, r#"("four" let b 2)"#],
    );
    check(
        "/// of e\nexperiment e { /// of a\n let a = 1\n let b = 2 /// of b\n} /// of e too",
        &[r#"("of e\nof e too" experiment e ("of a" let a 1) ("of b" let b 2))"#],
    );
    check(
        "let a = f(x, /// inside\n y)",
        &[
            "(let a (f x y))",
            "IVX0105 1:14 a doc comment stands before nothing; write `//` for a plain comment",
        ],
    );
    check(
        "experiment e {\n  let a = 1\n  /// nothing\n}\n/// the\n/// end",
        &[
            "(experiment e (let a 1))",
            "IVX0105 3:3 a doc comment stands before nothing; write `//` for a plain comment",
            "IVX0105 5:1 a doc comment stands before nothing; write `//` for a plain comment",
        ],
    );
    check(
        "let a = 1 /// of a\n/// of b\nlet = 2\n/// of c\nlet c = 3",
        &[
            r#"("of a" let a 1)"#,
            r#"("of b" junk)"#,
            r#"("of c" let c 3)"#,
            "IVX0101 3:5 this `let` has no name; write `let x = ..`",
        ],
    );
}

#[test]
fn editions() {
    check_file("edition \"2026\"", &[]);
    check_file("\u{feff}// first\r\nedition \"2026\"\r\nlet a = 1\r\n", &["(let a 1)"]);
    check_file(
        "",
        &[
            r#"IVX0104 1:1 the file does not begin with its edition; write `edition "2026"` at the top"#,
        ],
    );
    check_file(
        "let a = 1",
        &[
            "(let a 1)",
            r#"IVX0104 1:1 the file does not begin with its edition; write `edition "2026"` at the top"#,
        ],
    );
    check_file(
        "edition \"1999\"",
        &[r#"IVX0104 1:9 this version does not know the edition `1999`; write `edition "2026"`"#],
    );
    check_file(
        "edition 2026\nlet a = 1",
        &[
            "(junk)",
            "(let a 1)",
            r#"IVX0101 1:9 expected a string, found `2026`; write `edition "2026"`"#,
        ],
    );
    check_file(
        "editon \"2026\"\nlet a = 1",
        &[
            "(junk)",
            "(let a 1)",
            "IVX0101 1:1 expected an item, found `editon`; did you mean `edition`?",
        ],
    );
    check_file(
        "let a = 1\nedition \"2026\"",
        &[
            "(let a 1)",
            "IVX0104 2:1 the edition is not the first item of the file; write it once, at the top",
        ],
    );
    check_file(
        "edition \"2026\"\nedition \"2026\"",
        &["IVX0104 2:1 the edition is not the first item of the file; write it once, at the top"],
    );
}

/// Checks a text behind an edition, which is line 0.
#[track_caller]
fn check(text: &str, expected: &[&str]) {
    assert_eq!(outcome(&format!("edition \"2026\"\n{text}"), 0), expected);
}

/// Checks a whole text.
#[track_caller]
fn check_file(text: &str, expected: &[&str]) {
    assert_eq!(outcome(text, 1), expected);
}

/// Checks an expression, which begins in column 1 of line 1.
#[track_caller]
fn expression(text: &str, expected: &[&str]) {
    let mut outcome = outcome(&format!("edition \"2026\" let a =\n{text}"), 0);
    outcome[0] = outcome[0].strip_prefix("(let a ").unwrap().strip_suffix(')').unwrap().to_owned();
    assert_eq!(outcome, expected);
}

/// The tree, and the diagnostics as `code line:column message; help`.
///
/// - `line`: the number of the first line.
fn outcome(text: &str, line: usize) -> Vec<String> {
    let (ast, diagnostics) = parse(text, 7);
    let mut lines: Vec<String> = ast.items.iter().map(dump::item).collect();
    for diagnostic in diagnostics {
        let start = diagnostic.labels[0].span.start as usize;
        let before = &text[..start];
        let line = line + before.matches('\n').count();
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        let mut shown = format!("{} {line}:{column} {}", diagnostic.code, diagnostic.message);
        for label in &diagnostic.labels[1..] {
            shown = format!("{shown}; {}", label.text);
        }
        if let Some(help) = diagnostic.help {
            shown = format!("{shown}; {help}");
        }
        lines.push(shown);
    }
    lines
}
