//! The documents say what is true.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
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
