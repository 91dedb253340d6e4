//! What is said of faults, and what survives them.

use super::{check, expression};
use crate::ast::ItemKind;
use crate::parse;

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
        "claim \"c\" : a == b within 0.5\nlet d = 1",
        &[
            "(claim \"c\" junk)",
            "(let d 1)",
            "IVX0101 1:27 expected `(`, found `0.5`; write `within(0.05)`",
        ],
    );
    check(
        "measure m = a == b within(0.5)",
        &[
            "(measure m (== a b))",
            "IVX0101 1:20 expected an operator or the next item, found `within`; `within(..)` ends a claim, behind the right side of its comparison",
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
}

#[test]
fn words_out_of_place() {
    check(
        "lett a = 1",
        &["(junk)", "IVX0101 1:1 expected an item, found `lett`; did you mean `let`?"],
    );
    check(
        "let a = 1;\nlet b = 2",
        &["(let a 1)", "(let b 2)", "IVX0101 1:10 an item needs no `;`; end it with its line"],
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
        "let a = match k { b: 1 }",
        &["(let a junk)", "IVX0101 1:19 expected a label or `}`, found `b`"],
    );
    check("axis task() = x", &["(junk)", "IVX0101 1:11 expected a name, found `)`"]);
    check(
        "published t = \"t.ron\"\nlet a = 1",
        &[
            "(junk)",
            "(let a 1)",
            "IVX0101 1:13 expected `from`, found `=`; write `published t33 from \"file.ron\"`",
        ],
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
    check(
        "let a(b) = 1",
        &["(junk)", "IVX0101 1:8 a parameter of a function names its type; write `b: Float`"],
    );
    check("profile p { a = 1 b }", &["(junk)", "IVX0101 1:21 expected `=`, found `}`"]);
    check("# comment", &["IVX0101 1:1 a comment begins with `//`; write `//`"]);
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
    expression("", &["junk", "IVX0101 0:23 expected an expression, found the end of the file"]);
    expression("f(a b)", &["junk", "IVX0101 1:5 expected `,`, `)` or `:`, found `b`"]);
    expression(
        "f(a = 1)",
        &[
            "junk",
            "IVX0101 1:5 what stands in brackets is named with `:`, not with `=`; write `a: 1`",
        ],
    );
    expression("f(,)", &["junk", "IVX0101 1:3 expected an expression or `)`, found `,`"]);
    expression("a b", &["a", "IVX0101 1:3 expected an operator or the next item, found `b`"]);
    expression("a +", &["junk", "IVX0101 1:4 expected an expression, found the end of the file"]);
    expression("a + * b", &["junk", "IVX0101 1:5 expected an expression, found `*`"]);
    expression(
        "x[ke \"WCM\"]",
        &["junk", r#"IVX0101 1:6 expected `,`, `]` or `:`, found `"WCM"`"#],
    );
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
        &["junk", "IVX0101 1:1 a number has digits on both sides of its point; write `1.0`"],
    );
    expression(
        ".5",
        &["junk", "IVX0101 1:1 a number has digits on both sides of its point; write `0.5`"],
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
    expression("'a'", &["junk", r#"IVX0101 1:1 strings stand in plain double quotes; write `"`"#]);
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
    expression(
        "a ! b",
        &[
            "junk",
            "IVX0101 1:3 there is no `not`; turn the comparison round: `a >= b` for not `a < b`",
        ],
    );
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
            "IVX0101 2:1 expected `,` or `)`, found `let`; this `(` is still open",
            "IVX0101 3:5 this `let` has no name; write `let x = ..`",
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
            "IVX0101 1:16 expected an item, found `nonsense`; known here: `axis`, `claim`, `edition`, `experiment`, `figure`, `include`, `let`, `measure`, `param`, `profile`, `published`, `table`, `use`",
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
        "let a = +\n  table(b)\nlet c = 1",
        &["(let a junk)", "(let c 1)", "IVX0101 1:9 expected an expression, found `+`"],
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
            "IVX0101 2:2 an experiment stands inside another; the other begins here; move it behind the `}` of the other",
        ],
    );
    check(
        "experiment a {\n experiment b\n let d = 2\n}",
        &[
            "(experiment a (junk) (let d 2))",
            "IVX0101 2:2 an experiment stands inside another; the other begins here; move it behind the `}` of the other",
        ],
    );
    check(
        "experiment \"a\" {\n let b = 1 let = 2\n}\nlet c = 3",
        &[
            "(junk)",
            "(let c 3)",
            r#"IVX0101 1:12 expected a name, found `"a"`; a name stands without quotes"#,
            "IVX0101 2:16 this `let` has no name; write `let x = ..`",
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
fn what_does_not_read_says_which_names_it_seems_to_declare() {
    let names = |text: &str| -> Vec<Option<Vec<String>>> {
        let (ast, _) = parse(&format!("edition \"2026\"\n{text}"), 0);
        let names = ast.items.into_iter().map(|item| match item.kind {
            ItemKind::Junk { names } => {
                names.map(|names| names.into_iter().map(|name| name.value).collect())
            }
            kind => panic!("{kind:?} reads"),
        });
        names.collect()
    };
    for text in
        ["param a Int = 3", "axis a 0..3", "let a: Int = 1", "measure // why\n a", "lte a = 1"]
    {
        assert_eq!(names(text), [Some(vec!["a".to_owned()])], "{text}");
    }
    for text in ["let = 1", "let match = 1", "figure f = a", "profile a = 1", "let"] {
        assert_eq!(names(text), [Some(vec![])], "{text}");
    }
    assert_eq!(names("use a.ivx"), [None]);
}
