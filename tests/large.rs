//! Texts of ten megabytes and brackets without end: quickly read, or quickly refused.

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use rand::{RngExt as _, SeedableRng as _};

use crate::pipeline;

/// Far more than any of these takes, and far less than a quadratic walk would.
const LONGEST: Duration = Duration::from_mins(1);

const MEGABYTES: usize = 10_000_000;

#[track_caller]
fn check(name: &str, text: &str) {
    let start = Instant::now();
    pipeline::run(text, &ivx_library::registry());
    let took = start.elapsed();
    assert!(took < LONGEST, "{name} took {took:?}");
}

/// An experiment with these items.
fn spec(items: &str) -> String {
    format!("edition \"2026\"\nexperiment e {{\n{items}\n}}\n")
}

#[test]
fn ten_megabytes_are_read_or_refused() {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(0);
    let bytes: Vec<u8> = (0..MEGABYTES).map(|_| rng.random()).collect();
    check("random bytes", &String::from_utf8_lossy(&bytes));
    let bytes: Vec<u8> = bytes.iter().map(|byte| byte & 0x7f).collect();
    check("random letters", &String::from_utf8_lossy(&bytes));
    check("a list", &spec(&format!("let a = [{}]", "1, ".repeat(MEGABYTES / 3))));
    check("a comment", &format!("// {}\n{}", "x".repeat(MEGABYTES), spec("measure m = 1.0")));
    check("a doc comment", &format!("/// {}\n{}", "x".repeat(MEGABYTES), spec("measure m = 1.0")));
    check("comments", &spec(&"// x\n".repeat(MEGABYTES / 5)));
    check("brackets", &"[".repeat(MEGABYTES));
    check("a string", &spec(&format!("let a = \"{}\"", "x".repeat(MEGABYTES))));
    check("strings", &spec(&"\"".repeat(MEGABYTES)));
    check("a name", &spec(&format!("let {} = 1", "x".repeat(MEGABYTES))));
    check("a number", &spec(&format!("let a = {}", "1".repeat(MEGABYTES))));
    check("minus", &spec(&format!("let a = {}1", "-".repeat(MEGABYTES))));
}

#[test]
fn many_small_items_are_checked() {
    let many = |n: usize, item: &dyn Fn(usize) -> String| {
        (0..n).fold(String::new(), |mut text, i| {
            writeln!(text, "{}", item(i)).expect("strings take everything");
            text
        })
    };
    check("lets", &spec(&many(300_000, &|i| format!("let a{i} = {i}"))));
    check("unknown names", &spec(&many(100_000, &|i| format!("let a{i} = b{i}"))));
    check("params", &spec(&many(100_000, &|i| format!("param a{i}: Int = {i}"))));
    check("samples", &spec(&many(100_000, &|i| format!("let a{i} = sample(sinusoids(), n: {i})"))));
    check(
        "experiments",
        &format!("edition \"2026\"\n{}", many(100_000, &|i| format!("experiment e{i} {{}}"))),
    );
}

#[test]
fn brackets_without_end_are_refused() {
    for (open, close) in
        [("(", ")"), ("[", "]"), ("{", "}"), ("<", ">"), ("f(", ")"), ("List<", ">")]
    {
        let nested = format!("{}1{}", open.repeat(100_000), close.repeat(100_000));
        for text in [&nested, &open.repeat(100_000), &close.repeat(100_000)] {
            check(open, text);
            check(open, &spec(&format!("let a = {text}")));
            check(open, &spec(&format!("param a: {text} = 1")));
            check(open, &spec(&format!("axis a = {{ \"a\": {text} }}")));
        }
    }
}
