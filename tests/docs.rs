//! The documents say what is true.

use std::fs;
use std::path::{Path, PathBuf};

use crate::examples::try_all;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

#[test]
fn the_specs_in_documents_do_what_they_should() {
    for (path, least) in [("README.md", 1), ("docs/language.md", 15), ("docs/command.md", 3)] {
        let text = fs::read_to_string(root().join(path)).expect("the document is there");
        assert!(try_all(path, &text) >= least, "{path} has its blocks");
    }
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
