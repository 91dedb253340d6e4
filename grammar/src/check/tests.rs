//! Hostile programs end in a fault, and soon.

use std::fmt::Write as _;

use ivx_op::Registry;

use super::{File, Project, Settings, check};
use crate::{Code, parse};

/// The faults of a program of one file, without a library.
fn faults(items: &str) -> Vec<Code> {
    faults_within(items, None)
}

/// The same with another limit of nodes.
fn faults_within(items: &str, max_nodes: Option<usize>) -> Vec<Code> {
    let text = format!("edition \"2026\"\n{items}");
    let (ast, parsed) = parse(&text, 0);
    assert_eq!(parsed, [], "the text reads as the language");
    let file = File {
        path: "a.ivx".into(),
        stem: "a".into(),
        text,
        ast: ast.into(),
        links: std::collections::BTreeMap::new(),
        texts: std::collections::BTreeMap::new(),
        externals: std::collections::BTreeMap::new(),
    };
    let project = Project { files: vec![file] };
    let (_, diagnostics) =
        check(&project, &Registry::default(), &Settings { max_nodes, ..Settings::default() });
    diagnostics.into_iter().map(|diagnostic| diagnostic.code).collect()
}

/// `n` items, each of which names the next.
fn chain(n: usize, item: impl Fn(usize) -> String, last: &str) -> String {
    (0..n).fold(String::new(), |mut text, i| {
        writeln!(text, "{}", item(i)).expect("strings take everything");
        text
    }) + last
}

#[test]
fn a_chain_of_definitions_is_as_deep_as_it_is_allowed_to_be() {
    let last = "let a100000 = 1.0\nexperiment e { measure m = a0 }";
    let text = chain(100_000, |i| format!("let a{i} = a{} + 1.0", i + 1), last);
    assert_eq!(faults(&text), [Code::Nesting]);
    let text = chain(
        50,
        |i| format!("let a{i} = a{} + 1.0", i + 1),
        "let a50 = 1.0\nexperiment e { measure m = a0 }",
    );
    assert_eq!(faults(&text), []);
}

#[test]
fn functions_that_call_each_other_twice_end() {
    let text = chain(
        60,
        |i| format!("let f{i}(x: Float) = f{}(x: x) + f{}(x: x)", i + 1, i + 1),
        "let f60(x: Float) = x\nexperiment e { measure m = f0(x: 1.0) }",
    );
    assert_eq!(faults(&text), [Code::TooLarge]);
}

#[test]
fn lists_of_lists_end() {
    let text = chain(
        60,
        |i| format!("let a{i} = [a{}, a{}]", i + 1, i + 1),
        "let a60 = [1.0]\nexperiment e { axis x = a0 measure m = 1.0 }",
    );
    assert_eq!(faults(&text), [Code::TooLarge]);
}

#[test]
fn axes_without_end_end() {
    assert_eq!(
        faults("experiment e { axis x = 0..9_000_000_000 measure m = 1.0 * x }"),
        [Code::TooLarge]
    );
    let axes = "axis a = 0..1000 axis b = 0..1000 axis c = 0..1000";
    assert_eq!(
        faults(&format!("experiment e {{ {axes} measure m = 1.0 * a * b * c }}")),
        [Code::TooLarge]
    );
}

#[test]
fn the_limit_of_nodes_is_what_settings_say() {
    let text = "experiment e { axis a = 0..3 axis b = 0..4 measure m = 1.0 * a * b }";
    assert_eq!(faults(text), []);
    assert_eq!(faults_within(text, Some(12)), []);
    assert_eq!(faults_within(text, Some(11)), [Code::TooLarge]);
    let axis = "experiment e { axis a = 0..1_000_001 measure m = 1.0 * a }";
    assert_eq!(faults(axis), [Code::TooLarge]);
    assert_eq!(faults_within(axis, Some(2_000_000)), []);
    let other = "experiment e { axis a = [0, 1, 2] axis b = [0, 1] measure m = 1.0 * a * b }";
    assert_eq!(faults_within(other, Some(5)), [Code::TooLarge]);
}

#[test]
fn values_without_end_end() {
    let many = |n: usize, item: &dyn Fn(usize) -> String| {
        format!("experiment e {{\n{}measure m = 1.0 }}", chain(n, item, ""))
    };
    assert_eq!(faults(&many(50, &|i| format!("axis x{i} = 0..1_000_000"))), [Code::TooLarge]);
    let list = format!("let x = [{}]\n", "1, ".repeat(50_000));
    assert_eq!(faults(&(list + &many(500, &|i| format!("let y{i} = x")))), [Code::TooLarge]);
    let doubled = chain(60, |i| format!("let y{} = y{i} + y{i}", i + 1), "let y0 = x");
    let doubled = format!("experiment e {{ axis x = 0..2\n{doubled}\nmeasure m = y60 }}");
    assert_eq!(faults(&doubled), [Code::TooLarge]);
}

#[test]
fn faults_without_end_end() {
    let unknown = chain(100_000, |i| format!("let a{i} = b{i}"), "");
    assert_eq!(faults(&format!("experiment e {{ {unknown} }}")), [Code::UnknownName; 101]);
    let again = "let a = 1 ".repeat(100_000);
    assert_eq!(faults(&again), [Code::Shadowing; 101]);
    let long = "a".repeat(100_000);
    let long = format!("experiment e {{ let {long} = 1 measure m = b{long} }}");
    assert_eq!(faults(&long), [Code::UnknownName]);
}

#[test]
fn many_items_are_checked_soon() {
    assert_eq!(faults(&chain(50_000, |i| format!("experiment e{i} {{}}"), "")), []);
    let sets = chain(20_000, |i| format!("a{i} = 2"), "");
    let params = chain(20_000, |i| format!("param a{i}: Int = 1"), "");
    assert_eq!(faults(&format!("{params}profile quick {{ {sets} }}")), []);
    let params = chain(8_000, |i| format!("a{i}: Int,"), "");
    let args = chain(8_000, |i| format!("a{i}: {i},"), "");
    let call = format!("let f({params}) = a0 experiment e {{ measure m = f({args}) }}");
    assert_eq!(faults(&call), []);
}

#[test]
fn deep_brackets_are_checked_on_a_small_stack() {
    let nested =
        format!("experiment e {{ measure m = {}1.0{} }}", "(".repeat(200), ")".repeat(200));
    let lists = format!(
        "experiment e {{ axis x = {}1{} measure m = 1.0 }}",
        "[".repeat(200),
        "]".repeat(200)
    );
    let small = std::thread::Builder::new().stack_size(2 << 20);
    let checked =
        small.spawn(move || (faults(&nested), faults(&lists))).expect("the system starts threads");
    let (nested, lists) = checked.join().expect("the stack is large enough");
    assert_eq!(nested, []);
    assert!(lists.len() <= 1, "{lists:?}");
}
