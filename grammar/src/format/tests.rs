//! Small cases, and laws over every spec there is.

use std::fs;
use std::path::{Path, PathBuf};

use super::format;
use crate::parse;
use crate::parse::scan;
use crate::parse::tests::dump;

#[test]
fn what_fits_stands_on_one_line() {
    check("let   white  =\n lottery( [ 0.0 ,] , [1.0]\n)", "let white = lottery([0.0], [1.0])");
    check(
        "param n:Int=10_000   param lr : Float = 4e-4",
        "param n: Int = 10_000\nparam lr: Float = 4e-4",
    );
    check("param xs:Map<List<Float>,Str>=[]", "param xs: Map<List<Float>, Str> = []");
    check("let f (a:Ke,xs:List<Int>=[ ],)=g()", "let f(a: Ke, xs: List<Int> = []) = g()");
    check("use \"a\"{a,b as c,}use \"b\"", "use \"a\" { a, b as c }\nuse \"b\"");
    check(
        "profile quick{a=1\nb=-2}profile none{ }",
        "profile quick { a = 1, b = -2 }\nprofile none {}",
    );
    check("axis s=0 .. n\naxis k={\"A\":wcm( ),}", "axis s = 0..n\naxis k = { \"A\": wcm() }");
    check("axis n=- 1 .. -a . b", "axis n = -1..-a.b");
    check("table \"1\"=table (a)", "table \"1\" = table(a)");
    check("claim \"c\":( (a) )<=b [ k : \"x\" ,]", "claim \"c\" : ((a)) <= b[k: \"x\"]");
    check("let a=- - b*-( c-1 )/\"\\\"//\"", "let a = --b * -(c - 1) / \"\\\"//\"");
}

#[test]
fn items_stand_on_lines_of_their_own() {
    check("experiment e{let a=1 let b=2}", "experiment e {\n    let a = 1\n    let b = 2\n}");
    check("experiment e {\n\n}", "experiment e {}");
    check("\n\n\nlet a = 1\n\n\n\nlet b = 2\n\n", "\nlet a = 1\n\nlet b = 2");
    check(
        "experiment e {\n\n    let a = 1\n \t\n    // c\n\n    let b = 2\n\n}",
        "experiment e {\n    let a = 1\n\n    // c\n\n    let b = 2\n}",
    );
}

#[test]
fn calls_break_at_their_arguments() {
    check(
        "measure m = mean(std(predict(model, at: grid(-1.0, 1.0, points: 11), more: 1), over: member), over: x)",
        "measure m = mean(
    std(predict(model, at: grid(-1.0, 1.0, points: 11), more: 1), over: member),
    over: x)",
    );
    check(
        "let model = train(ensemble(map_estimate(net: mlp(hidden: [6, 5]), optimiser: optimiser), members: 3), on: data, steps: 5)",
        "let model = train(
    ensemble(map_estimate(net: mlp(hidden: [6, 5]), optimiser: optimiser), members: 3),
    on: data, steps: 5)",
    );
    check(
        "figure \"f\" = plot([truth, shown, curve(predict(initial[seed: 0], at: canvas), x: x, style: \"dashed\")])",
        "figure \"f\" = plot([
    truth, shown,
    curve(predict(initial[seed: 0], at: canvas), x: x, style: \"dashed\"),
])",
    );
    let words = "\"twenty characters..\"";
    check(
        &format!("let a = f({words}, {words}, {words}, {words}, [1, 2])[k: 1]"),
        &format!("let a = f(\n    {words}, {words}, {words}, {words},\n    [1, 2])[k: 1]"),
    );
    check(
        &format!("axis a = {{ {words}: 1, \"b\": {words}, \"c\": {words}, \"d\": {words} }}"),
        &format!(
            "axis a = {{\n    {words}: 1,\n    \"b\": {words},\n    \"c\": {words},\n    \"d\": {words},\n}}"
        ),
    );
}

#[test]
fn expressions_break_before_operators() {
    let long = "f(aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa)";
    check(
        &format!("claim \"c\" : {long} + {long} < {long}"),
        &format!("claim \"c\" :\n    {long} + {long}\n        < {long}"),
    );
    check("claim \"c\"at  0.99:a<b", "claim \"c\" at 0.99 : a < b");
    check(
        "claim \"c\"by  \"t\"family\"F\":a[k:1]on  par\nwith b within (0.1,\"why\")",
        "claim \"c\" by \"t\" family \"F\" : a[k: 1] on par with b within(0.1, \"why\")",
    );
    check("claim \"c\":a==b\nwithin ( 0.05 )", "claim \"c\" : a == b within(0.05)");
    check(
        &format!("claim \"c\" : {long} + {long} == {long} within(0.05)"),
        &format!("claim \"c\" :\n    {long} + {long}\n        == {long} within(0.05)"),
    );
    check(
        &format!("let a = {long} * {long} - {long}"),
        &format!("let a =\n    {long} * {long}\n        - {long}"),
    );
    check(
        &format!("let a = f(x: {long} / {long} / {long})"),
        &format!("let a = f(\n    x: {long}\n        / {long}\n        / {long})"),
    );
    let wide = format!("{long}, {long}, {long}");
    check(
        &format!("let a = g({wide}) / 2.0 - {long}"),
        &format!(
            "let a =\n    g(\n        {long},\n        {long},\n        {long}) / 2.0\n        - {long}"
        ),
    );
    let text = format!("\"{}\"", "x".repeat(100));
    check(&format!("let a = {text}"), &format!("let a =\n    {text}"));
}

#[test]
fn claims_break_before_their_words_first() {
    let long = "progression[method: \"deep ensemble\"]";
    check(
        &format!("claim \"c\" : {long} on par with {long} within(0.02, \"0.03 of R²\")"),
        &format!(
            "claim \"c\" :\n    {long}\n        on par with {long} within(0.02, \"0.03 of R²\")"
        ),
    );
    let why = "what a σ that is 15 % off costs";
    check(
        &format!("claim \"c\" : {long} <= {long} + {long} within(0.02, \"{why}\")"),
        &format!(
            "claim \"c\" :\n    {long}\n        <= {long} + {long}\n        within(0.02, \"{why}\")"
        ),
    );
    check("claim \"c\" : a on par with  - b", "claim \"c\" : a on par with -b");
    check(
        "claim \"c\" : a on // on\n par with b within(1)",
        "claim \"c\" :\n    a\n        on   // on\n        par with b within(1)",
    );
    check("profile p{on=a.on par=2 with=3}", "profile p { on = a.on, par = 2, with = 3 }");
    check("let a = within (1) + on", "let a = within(1) + on");
}

#[test]
fn comments_stay_where_they_are() {
    check("//// a \n/// of a\nlet a = 1 /// of a", "//// a\n/// of a\nlet a = 1   /// of a");
    check(
        "let a = 1 // one\nlet bcd = 2 // two\n\nlet e = 3 // three\nlet f = 4\n// end",
        "let a = 1     // one\nlet bcd = 2   // two\n\nlet e = 3   // three\nlet f = 4\n// end",
    );
    check(
        "experiment e { /// of a\n let a = 1\n let b = 2 /// of b\n// last\n} // end",
        "experiment e {   /// of a
    let a = 1
    let b = 2   /// of b
    // last
}   // end",
    );
    check(
        "let a = f( // open\n// above\nx, // x\n y // y\n)",
        "let a = f(   // open\n    // above\n    x,   // x\n    y    // y\n)",
    );
    check("let a = f(\n// none\n)", "let a = f(\n    // none\n)");
    check(
        "axis a = { \"A\": b // b\n, // more\n \"C\": d\n// end\n}",
        "axis a = {\n    \"A\": b,   // b\n    // more\n    \"C\": d,\n    // end\n}",
    );
    check("published  t\nfrom \"t.ron\"", "published t from \"t.ron\"");
    check("profile p:q{a=1}", "profile p: q { a = 1 }");
    check("profile p { a = 1 // a\n b = 2 }", "profile p {\n    a = 1,   // a\n    b = 2,\n}");
    check("let a = // why\n b + // b\n c", "let a =   // why\n    b\n        +   // b\n        c");
    check("let // a\n a\n// b\n= 1", "let   // a\n    a\n    // b\n    = 1");
    check("let a =\n// b\n f(c).d", "let a =\n    // b\n    f(c).d");
    check("let a = f(x) // c\n [k: 1]", "let a = f(x)   // c\n    [k: 1]");
}

#[test]
fn what_does_not_parse_is_not_formatted() {
    for text in ["", "let a = 1", "edition \"1999\"", "edition \"2026\" let a = )"] {
        assert!(!format(text).unwrap_err().is_empty(), "{text}");
    }
}

#[test]
fn the_layout_of_every_spec_is_lawful() {
    let mut specs = Vec::new();
    for folder in ["experiments", "tests"] {
        collect(&Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(folder), &mut specs);
    }
    assert!(specs.len() > 40, "specs are found");
    for spec in specs {
        let text = fs::read_to_string(&spec).unwrap();
        if let Ok(formatted) = format(&text) {
            lawful(&text, &formatted);
        }
    }
}

/// Checks the layout of a text behind an edition.
#[track_caller]
fn check(text: &str, expected: &str) {
    let text = format!("edition \"2026\"\n{text}");
    let formatted = format(&text).unwrap();
    assert_eq!(formatted, format!("edition \"2026\"\n{expected}\n"));
    lawful(&text, &formatted);
}

/// Checks that a layout keeps the tree and the comments, and is its own.
#[track_caller]
pub(crate) fn lawful(text: &str, formatted: &str) {
    assert_eq!(tree(text), tree(formatted), "{text}\n---\n{formatted}");
    assert_eq!(comments(text), comments(formatted), "{text}\n---\n{formatted}");
    assert_eq!(format(formatted).as_deref(), Ok(formatted), "{text}");
}

/// The tree without spans.
pub(crate) fn tree(text: &str) -> Vec<String> {
    let (ast, _) = parse(text, 0);
    let edition = ast.edition.map(|edition| edition.value);
    edition.into_iter().chain(ast.items.iter().map(dump::item)).collect()
}

/// The comments in their order.
fn comments(text: &str) -> Vec<&str> {
    let mut comments = Vec::new();
    let mut at = 0;
    loop {
        let gap = scan::gap(text, at);
        comments.extend(gap.comments.iter().map(|comment| &text[comment.start..comment.end]));
        at = scan::token_end(text, gap.next);
        if at == gap.next {
            return comments;
        }
    }
}

fn collect(folder: &Path, specs: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, specs);
        } else if path.extension().is_some_and(|extension| extension == "ivx") {
            specs.push(path);
        }
    }
    specs.sort();
}
