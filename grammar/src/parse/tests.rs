use super::*;
use crate::ast::{AxisExpr, Expr, ExprKind, TyExpr};
use rand::{RngExt as _, SeedableRng as _};

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
            "IVX0101 3:5 expected a name, found `=`",
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

#[test]
fn broken_items() {
    check("let a == 1", &["(junk)", "IVX0101 1:7 expected `=`, found `==`; write `=`"]);
    check(
        "let a : Int = 1",
        &[
            "(junk)",
            "IVX0101 1:7 expected `=`, found `:`; a `let` names no type: write `let x = 1`",
        ],
    );
    check(
        "param a = 1",
        &[
            "(junk)",
            "IVX0101 1:9 expected `:`, found `=`; a parameter names its type: `param members: Int = 32`",
        ],
    );
    check("param a: = 1", &["(junk)", "IVX0101 1:10 expected a type, found `=`"]);
    check(
        "claim \"c\" = a < b",
        &[
            "(junk)",
            r#"IVX0101 1:11 expected `:`, found `=`; write `claim "in words" : left < right`"#,
        ],
    );
    check(
        "claim c : a < b",
        &[
            "(junk)",
            r#"IVX0101 1:7 expected a string, found `c`; what is claimed stands in quotes: `claim "in words" : left < right`"#,
        ],
    );
    check(
        "claim \"c\" : a < b < c",
        &[
            r#"(claim "c" (< a b))"#,
            "IVX0101 1:19 comparisons do not chain; write two comparisons, each with its own two sides",
        ],
    );
    check(
        "claim \"c\" : a < b\n  < c",
        &[
            r#"(claim "c" (< a b))"#,
            "IVX0101 2:3 comparisons do not chain; write two comparisons, each with its own two sides",
        ],
    );
    check(
        "figure f = a",
        &["(junk)", "IVX0101 1:8 expected a string, found `f`; its name stands in quotes"],
    );
    check(
        "measure \"m\" = a",
        &["(junk)", r#"IVX0101 1:9 expected a name, found `"m"`; a name stands without quotes"#],
    );
    check(
        "include a.ivx",
        &[
            "(junk)",
            r#"IVX0101 1:9 expected a string, found `a`; the path stands in quotes: `"file.ivx"`"#,
        ],
    );
    check(
        "lett a = 1",
        &["(junk)", "IVX0101 1:1 expected an item, found `lett`; did you mean `let`?"],
    );
    check(
        "let a = 1;\nlet b = 2",
        &[
            "(let a 1)",
            "(let b 2)",
            "IVX0101 1:10 expected an operator or the next item, found `;`; an item needs no `;`",
        ],
    );
    check(
        "let table = 1",
        &["(junk)", "IVX0101 1:5 `table` is a reserved word and cannot be a name"],
    );
    check(
        "let a = as",
        &["(let a junk)", "IVX0101 1:9 `as` is a reserved word and cannot be a name"],
    );
    check(
        "let a = match k { }",
        &["(let a junk)", "IVX0101 1:9 `match` is not part of this version yet"],
    );
    check(
        "axis task(scene, env) = x",
        &["(junk)", "IVX0101 1:10 an axis with fields is not part of this version yet"],
    );
    check(
        "published t from \"t.ron\"\nlet a = 1",
        &["(junk)", "(let a 1)", "IVX0101 1:1 `published` is not part of this version yet"],
    );
    check(
        "axis a = 0..",
        &["(axis a junk)", "IVX0101 1:13 expected an expression, found the end of the file"],
    );
    check(
        "axis a = { x: 1 }",
        &[
            "(axis a junk)",
            "IVX0101 1:12 expected a string or `}`, found `x`; a label stands in quotes",
        ],
    );
    check("use \"a\" { }", &["(junk)", "IVX0101 1:11 expected a name, found `}`"]);
    check("let a(b) = 1", &["(junk)", "IVX0101 1:8 expected `:`, found `)`"]);
    check("profile p { a = 1 b }", &["(junk)", "IVX0101 1:21 expected `=`, found `}`"]);
    check(
        "# comment",
        &["IVX0101 1:1 expected the next item, found `#`; a comment begins with `//`"],
    );
    check(
        "let naïve = 1",
        &[
            "(junk)",
            "IVX0101 1:7 expected `=`, found `ï`; a name is made of `A` to `z`, digits and `_`",
        ],
    );
}

#[test]
fn broken_expressions() {
    expression("", &["junk", "IVX0101 1:1 expected an expression, found the end of the file"]);
    expression("f(a b)", &["junk", "IVX0101 1:5 expected `,`, `)` or `:`, found `b`"]);
    expression(
        "f(a = 1)",
        &[
            "junk",
            "IVX0101 1:5 expected `,`, `)` or `:`, found `=`; what stands in brackets is named with `:`, as in `f(steps: 100)`",
        ],
    );
    expression("f(,)", &["junk", "IVX0101 1:3 expected an expression or `)`, found `,`"]);
    expression("a b", &["a", "IVX0101 1:3 expected an operator or the next item, found `b`"]);
    expression("a +", &["junk", "IVX0101 1:4 expected an expression, found the end of the file"]);
    expression("a + * b", &["junk", "IVX0101 1:5 expected an expression, found `*`"]);
    expression(
        "x[\"WCM\"]",
        &[
            "junk",
            r#"IVX0101 1:3 expected a name, found `"WCM"`; name the axis too: `x[ke: "WCM"]`"#,
        ],
    );
    expression("x[ke \"WCM\"]", &["junk", r#"IVX0101 1:6 expected `:`, found `"WCM"`"#]);
    expression("[1, 2", &["junk", "IVX0101 1:6 expected `,` or `]`, found the end of the file"]);
    expression(
        "f(a))",
        &[
            "(f a)",
            "IVX0101 1:5 expected an operator or the next item, found `)`; it closes nothing",
        ],
    );
    expression(
        "1.",
        &[
            "1",
            "IVX0101 1:2 expected an operator or the next item, found `.`; a number has digits on both sides of its point: `1.0`",
        ],
    );
    expression(
        ".5",
        &[
            "junk",
            "IVX0101 1:1 expected an expression, found `.`; a number has digits on both sides of its point: `0.5`",
        ],
    );
    expression(
        "1abc",
        &[
            "junk",
            "IVX0101 1:1 expected an expression, found `1abc`; a name begins with a letter, and a number holds none but an exponent's `e`",
        ],
    );
    expression(
        "9223372036854775808",
        &[
            "junk",
            "IVX0103 1:1 the number is too large; an `Int` lies from -9223372036854775808 to 9223372036854775807",
        ],
    );
    expression(
        "1e999 + 2",
        &[
            "(+ junk 2)",
            "IVX0103 1:1 the number is too large; a `Float` lies from -1.7976931348623157e308 to 1.7976931348623157e308",
        ],
    );
    expression(
        "'a'",
        &[
            "junk",
            r#"IVX0101 1:1 expected an expression, found `'`; strings stand in plain double quotes: `"`"#,
        ],
    );
    expression(
        "\"a",
        &[
            "junk",
            r#"IVX0101 1:1 this string is not closed; end it with `"` on the same line; a line break within is written `\n`"#,
        ],
    );
    expression(
        r#""a\q""#,
        &["junk", r#"IVX0101 1:3 unknown escape `\q`; known are `\"`, `\\`, `\n` and `\t`"#],
    );
    expression("a ! b", &["a", "IVX0101 1:3 expected an operator or the next item, found `!`"]);
    expression("f(a, \u{0})", &["junk", "IVX0101 1:6 expected an expression or `)`, found U+0000"]);
}

#[test]
fn good_items_survive_broken_ones() {
    check(
        "let a = (1\nlet b = 2\nlet = 3\nlet c = 4",
        &[
            "(let a junk)",
            "(let b 2)",
            "(junk)",
            "(let c 4)",
            "IVX0101 2:1 expected `)`, found `let`; this `(` is still open",
            "IVX0101 3:5 expected a name, found `=`",
        ],
    );
    check(
        "experiment e {\n let a = f(\n let b == 2\n let c = 3\n}\nlet d = 4",
        &[
            "(experiment e (let a junk) (junk) (let c 3))",
            "(let d 4)",
            "IVX0101 3:2 expected an expression or `)`, found `let`; this `(` is still open",
            "IVX0101 3:8 expected `=`, found `==`; write `=`",
        ],
    );
    check(
        "experiment e {\n lett a = { 1\n let b = 2\n}\nlet d = 4",
        &[
            "(experiment e (junk) (let b 2))",
            "(let d 4)",
            "IVX0101 2:2 expected an item, found `lett`; did you mean `let`?",
        ],
    );
    check(
        "experiment e {\n let a = f(g(\n}\nlet d = 4",
        &[
            "(experiment e (let a junk))",
            "(let d 4)",
            "IVX0101 3:1 expected an expression or `)`, found `}`; this `(` is still open",
        ],
    );
    check(
        "experiment e { nonsense } let d = 4",
        &[
            "(experiment e (junk))",
            "(let d 4)",
            "IVX0101 1:16 expected an item, found `nonsense`; known here: `axis`, `claim`, `edition`, `experiment`, `figure`, `include`, `let`, `measure`, `param`, `profile`, `table`, `use`",
        ],
    );
    check(
        "let a = \"b\nlet c = \"d\"",
        &[
            "(let a junk)",
            r#"(let c "d")"#,
            r#"IVX0101 1:9 this string is not closed; end it with `"` on the same line; a line break within is written `\n`"#,
        ],
    );
    check(
        "let a = f(\n  table: 1,\n  = 2)\nlet b = 1",
        &[
            "(let a junk)",
            "(let b 1)",
            "IVX0101 2:3 `table` is a reserved word and cannot be a name",
        ],
    );
}

#[test]
fn experiments() {
    check(
        "experiment a {\n let b = 1\n/// of c\nexperiment c {\n let d = 1\n}",
        &[
            "(experiment a (let b 1))",
            r#"("of c" experiment c (let d 1))"#,
            "IVX0101 1:14 this `{` is never closed; the next experiment begins here; add `}` after the last item of the experiment",
        ],
    );
    check(
        "experiment a {\n experiment b { let c = 1 }\n let d = 2\n}",
        &[
            "(experiment a (junk) (let d 2))",
            "IVX0101 2:2 an experiment stands inside another; the other begins here",
        ],
    );
    check(
        "experiment a {\n experiment b\n let d = 2\n}",
        &[
            "(experiment a (junk) (let d 2))",
            "IVX0101 2:2 an experiment stands inside another; the other begins here",
        ],
    );
    check(
        "experiment \"a\" {\n let b = 1 let = 2\n}\nlet c = 3",
        &[
            "(junk)",
            "(let c 3)",
            r#"IVX0101 1:12 expected a name, found `"a"`; a name stands without quotes"#,
            "IVX0101 2:16 expected a name, found `=`",
        ],
    );
    check(
        "experiment a\nlet c = 3",
        &["(junk)", "(let c 3)", "IVX0101 2:1 expected `{`, found `let`"],
    );
    check(
        "experiment a {\n use \"b\"\n edition \"2026\"\n}",
        &[
            r#"(experiment a (use "b"))"#,
            "IVX0101 2:2 `use` and `include` stand outside of experiments; move it to the top of the file",
            "IVX0104 3:2 the edition is not the first item of the file; write it once, at the top",
        ],
    );
    check(
        "experiment a { }\n}",
        &["(experiment a)", "(junk)", "IVX0101 2:1 this `}` closes nothing"],
    );
    check(
        "experiment a {",
        &[
            "(experiment a)",
            "IVX0101 1:14 this `{` is never closed; add `}` after the last item of the experiment",
        ],
    );
}

#[test]
fn limits() {
    let chain = |n: usize| format!("edition \"2026\" let a = {}b", "b + ".repeat(n));
    assert_eq!(parse(&chain(900), 0).1, []);
    let too_deep = "IVX0101 1:9 an expression is deeper than 1000 operators and brackets; \
                    give its parts names with `let`";
    let deep = |text: &str| check(&format!("let a = {text}"), &["(let a junk)", too_deep]);
    deep(&format!("b{}", " + b".repeat(100_000)));
    deep(&format!("{}b", "-".repeat(100_000)));
    deep(&format!("b{}", ".c".repeat(100_000)));
    deep(&format!("b{}", "[c: 1]".repeat(100_000)));

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
    let large = |text: &str| format!("edition \"2026\"\n{}", text.repeat(10_000_000 / text.len()));
    let faults = |text: &str| {
        let t = std::time::Instant::now();
        let n = parse(&large(text), 0).1.len();
        eprintln!("{text:?} {n} {:?}", t.elapsed());
        n
    };
    assert_eq!(faults(" "), 0);
    assert_eq!(faults("\n"), 0);
    assert_eq!(faults("/// doc\n"), 1);
    assert_eq!(faults("let a = f(x, y: [1, 2])\n"), 0);
    assert_eq!(faults("let a = 1 "), 0);
    assert_eq!(faults("experiment a { let b = 1 } "), 0);
    assert_eq!(faults("junk "), 1);
    assert_eq!(faults("é"), 1);
    assert_eq!(faults("\""), 1);
    assert_eq!(faults(")"), 1);
    assert_eq!(faults("let "), 1);
    assert_eq!(faults("let\n"), MOST_FAULTS + 1);
    assert_eq!(faults("experiment a { let } "), MOST_FAULTS + 1);
    assert_eq!(faults("experiment a {}}"), 1);
    let one_item = format!("edition \"2026\" let a = [{}]", "1, ".repeat(3_000_000));
    let (ast, diagnostics) = parse(&one_item, 0);
    assert_eq!(ast.items[0].kind, ItemKind::Junk);
    assert_eq!(diagnostics[0].message, "this `let` is longer than 1 MiB");
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
fn any_text_gives_a_tree_with_spans_inside_it() {
    let words = [
        "edition",
        "\"2026\"",
        "use",
        "include",
        "param",
        "profile",
        "axis",
        "let",
        "experiment",
        "measure",
        "figure",
        "table",
        "claim",
        "published",
        "match",
        "true",
        "as",
        "a",
        "b",
        "Int",
        "List",
        "<",
        ">",
        "<=",
        "==",
        "=",
        "=",
        ":",
        ",",
        ".",
        "..",
        "(",
        ")",
        "[",
        "]",
        "{",
        "}",
        "{",
        "}",
        "+",
        "-",
        "*",
        "/",
        "1",
        "2.5",
        "1e9",
        "99999999999999999999",
        "\"s\"",
        "\"\\q\"",
        "\"",
        "\\",
        "\n",
        "\n",
        "// c\n",
        "/// d\n",
        "/// d\n",
        "é",
        "\u{feff}",
        "\0",
        ";",
        "!",
    ];
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(0);
    for _ in 0..20_000 {
        let blank = if rng.random() { " " } else { "" };
        let soup: Vec<&str> =
            (0..rng.random_range(0..60)).map(|_| words[rng.random_range(0..words.len())]).collect();
        inside(&format!(
            "{}{}",
            if rng.random() { "edition \"2026\"\n" } else { "" },
            soup.join(blank)
        ));
        let bytes: Vec<u8> = (0..rng.random_range(0..60)).map(|_| rng.random()).collect();
        inside(&String::from_utf8_lossy(&bytes));
        // A good text with a stretch cut out or doubled.
        let [mut from, mut to] =
            [0; 2].map(|_| floor(EXAMPLE, rng.random_range(0..EXAMPLE.len())).len());
        if rng.random() {
            to = floor(EXAMPLE, from + 10).len();
        } else if rng.random() {
            (from, to) = (to, from);
        }
        inside(&format!("{}{}", &EXAMPLE[..from], &EXAMPLE[to..]));
    }
}

/// Checks that diagnostics are in order and that each span of file 7 is a stretch of the text.
fn inside(text: &str) {
    let (ast, diagnostics) = parse(text, 7);
    assert!(diagnostics.is_sorted_by_key(|diagnostic| diagnostic.labels[0].span.start), "{text:?}");
    let shown = format!("{ast:?} {diagnostics:?}");
    for span in shown.split("Span { file: 7, start: ").skip(1) {
        let (start, rest) = span.split_once(", end: ").unwrap();
        let (end, _) = rest.split_once(' ').unwrap();
        let (start, end) = (start.parse().unwrap(), end.parse().unwrap());
        assert!(text.get(start..end).is_some(), "{start}..{end} in {text:?}");
    }
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
    let mut lines: Vec<String> = ast.items.iter().map(item).collect();
    for diagnostic in diagnostics {
        let start = diagnostic.labels[0].span.start as usize;
        let before = &text[..start];
        let line = line + before.matches('\n').count();
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        let mut shown = format!("{} {line}:{column} {}", diagnostic.code, diagnostic.message);
        for label in &diagnostic.labels[1..] {
            shown += &format!("; {}", label.text);
        }
        if let Some(help) = diagnostic.help {
            shown += &format!("; {help}");
        }
        lines.push(shown);
    }
    lines
}

fn item(item: &Item) -> String {
    let docs = if item.docs.is_empty() { String::new() } else { format!("{:?} ", item.docs) };
    let inner = match &item.kind {
        ItemKind::Use { path, names } => {
            let names = names.iter().flatten();
            let names: String =
                names.map(|(a, b)| format!(" {} as {}", a.value, b.value)).collect();
            format!("use {:?}{names}", path.value)
        }
        ItemKind::Include { path } => format!("include {:?}", path.value),
        ItemKind::Param { name, ty, value } => {
            format!("param {} {} {}", name.value, type_of(ty), expr(value))
        }
        ItemKind::Profile { name, sets } => format!("profile {}{}", name.value, named(sets)),
        ItemKind::Axis { name, values } => format!("axis {} {}", name.value, axis(values)),
        ItemKind::Let { name, params: None, value } => {
            format!("let {} {}", name.value, expr(value))
        }
        ItemKind::Let { name, params: Some(params), value } => {
            let params = params.iter().map(|param| {
                let default = param.default.as_ref().map(|value| format!(" {}", expr(value)));
                let default = default.unwrap_or_default();
                format!("({} {}{default})", param.name.value, type_of(&param.ty))
            });
            let params: Vec<_> = params.collect();
            format!("let {} ({}) {}", name.value, params.join(" "), expr(value))
        }
        ItemKind::Experiment { name, items } => {
            let items: String =
                items.iter().map(|inner| format!(" {}", self::item(inner))).collect();
            format!("experiment {}{items}", name.value)
        }
        ItemKind::Measure { name, value } => format!("measure {} {}", name.value, expr(value)),
        ItemKind::Figure { name, value } => format!("figure {:?} {}", name.value, expr(value)),
        ItemKind::Table { name, value } => format!("table {:?} {}", name.value, expr(value)),
        ItemKind::Claim { name, value } => format!("claim {:?} {}", name.value, expr(value)),
        ItemKind::Junk => "junk".to_owned(),
    };
    format!("({docs}{inner})")
}

fn type_of(ty: &TyExpr) -> String {
    let args: Vec<_> = ty.args.iter().map(type_of).collect();
    if args.is_empty() {
        ty.name.value.clone()
    } else {
        format!("{}<{}>", ty.name.value, args.join(" "))
    }
}

fn axis(values: &AxisExpr) -> String {
    match values {
        AxisExpr::Range(start, end) => format!("{}..{}", expr(start), expr(end)),
        AxisExpr::Labelled(labels, _) => {
            let labels: Vec<_> = labels
                .iter()
                .map(|(label, value)| format!("{:?}: {}", label.value, expr(value)))
                .collect();
            format!("{{{}}}", labels.join(" "))
        }
        AxisExpr::List(list) => expr(list),
    }
}

fn named(values: &[(crate::ast::Name, Expr)]) -> String {
    values.iter().map(|(name, value)| format!(" {}: {}", name.value, expr(value))).collect()
}

fn expr(e: &Expr) -> String {
    match &e.kind {
        ExprKind::Bool(value) => value.to_string(),
        ExprKind::Int(value) => value.to_string(),
        ExprKind::Float(value) => format!("{value:?}"),
        ExprKind::Str(value) => format!("{value:?}"),
        ExprKind::List(values) => {
            format!("[{}]", values.iter().map(expr).collect::<Vec<_>>().join(" "))
        }
        ExprKind::Name(name) => name.clone(),
        ExprKind::Call { name, args } => {
            let args = args.iter().map(|(name, value)| match name {
                Some(name) => format!(" {}: {}", name.value, expr(value)),
                None => format!(" {}", expr(value)),
            });
            format!("({}{})", name.value, args.collect::<String>())
        }
        ExprKind::Select { base, at } => format!("(at {}{})", expr(base), named(at)),
        ExprKind::Field { base, name } => format!("{}.{}", expr(base), name.value),
        ExprKind::Negate(inner) => format!("(- {})", expr(inner)),
        ExprKind::Binary { op, left, right } => {
            format!("({} {} {})", op.value.symbol(), expr(left), expr(right))
        }
        ExprKind::Junk => "junk".to_owned(),
    }
}
