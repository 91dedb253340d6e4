//! The documents say what is true.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::examples::{blocks, try_all};
use crate::project::Project;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

#[test]
fn the_specs_in_documents_do_what_they_should() {
    for (path, least) in [
        ("README.md", 1),
        ("docs/language.md", 15),
        ("docs/data.md", 5),
        ("docs/command.md", 3),
        ("docs/agents.md", 3),
        ("docs/learners.md", 2),
        ("docs/from-python.md", 3),
    ] {
        let text = fs::read_to_string(root().join(path)).expect("the document is there");
        assert!(try_all(path, &text) >= least, "{path} has its blocks");
    }
}

/// `BLESS=1` draws the picture anew; review the difference.
#[test]
fn the_first_thing_that_one_sees_is_what_comes_out() {
    let text = fs::read_to_string(root().join("docs/language.md")).expect("the document is there");
    let project = Project::with(&[("points.ivx", blocks(&text)[0].text)]);
    let said = project.run("exec", "points.ivx", &[]);
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);

    let shown = text.split("```text\n").nth(1).and_then(|rest| rest.split("```").next());
    let shown = shown.expect("the document shows verdicts");
    assert!(said.out.starts_with(shown), "{shown}\nbut there came\n{}", said.out);

    let drawn = project.read("results/points/figures/error.svg");
    let path = root().join("docs/pictures/points.svg");
    if std::env::var_os("BLESS").is_some() {
        fs::write(&path, &drawn).expect("pictures can be written");
    }
    let picture = fs::read_to_string(&path).expect("the picture is there");
    assert!(picture == drawn, "docs/pictures/points.svg is stale: run this test with BLESS=1");
}

/// `BLESS=1` rewrites the reference; review the difference.
#[test]
fn the_reference_is_what_the_declarations_say() {
    let path = root().join("docs/reference.md");
    let reference = ivx_cli::reference();
    if std::env::var_os("BLESS").is_some() {
        fs::write(&path, &reference).expect("documents can be written");
    }
    let written = fs::read_to_string(&path).expect("the reference is there");
    assert!(written == reference, "docs/reference.md is stale: run this test with BLESS=1");
}

/// `BLESS=1` writes the names of the library anew, which the fuzzer puts into specs.
#[test]
fn the_fuzzer_knows_what_is_declared() {
    const MARK: &str = "# The names of the library: `BLESS=1 cargo test --release -p ivx-tests --test across docs::` writes what follows.\n";
    let path = root().join("fuzz/ivx.dict");
    let written = fs::read_to_string(&path).expect("the words are there");
    let (language, _) = written.split_once(MARK).expect("what is generated is marked");
    let registry = ivx_library::registry();
    let mut words: BTreeSet<String> = BTreeSet::new();
    for decl in registry.decls() {
        words.insert(format!("{:?}\n", format!("{}(", decl.name)));
        words.extend(decl.args.iter().map(|arg| format!("{:?}\n", format!("{}: ", arg.name))));
    }
    let known = [language, MARK].into_iter().chain(words.iter().map(String::as_str));
    let known: String = known.collect();
    if std::env::var_os("BLESS").is_some() {
        fs::write(&path, &known).expect("words can be written");
        return;
    }
    assert!(written == known, "fuzz/ivx.dict is stale: run this test with BLESS=1");
}
