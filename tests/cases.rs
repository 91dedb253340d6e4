//! Specs and what the checker says of them: one idea a file, the expected text beside it.
//!
//! `BLESS=1` rewrites the expected texts; review the difference.

use std::fs;
use std::path::{Path, PathBuf};

use ivx_grammar::Code;

use crate::project::Project;

#[test]
fn every_case_says_what_it_should() {
    let bless = std::env::var_os("BLESS").is_some();
    let mut wrong = Vec::new();
    let cases = cases();
    assert!(cases.len() >= 20, "cases are found");
    for case in cases {
        let said = check(&case);
        let golden = case.with_extension("txt");
        if bless {
            fs::write(&golden, &said).expect("golden files can be written");
        } else if fs::read_to_string(&golden).unwrap_or_default() != said {
            wrong.push(format!("{}:\n{said}", case.display()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_code_has_a_case() {
    let said: String = cases().iter().map(|case| check(case)).collect();
    for code in Code::ALL {
        assert!(said.contains(&code.to_string()), "{code}: {}", code.docs());
    }
}

#[test]
fn no_message_names_a_rule_of_the_grammar() {
    for case in cases() {
        let said = check(&case);
        for word in ["Rule::", "expected EOI", "junk", "ASCII", "ident"] {
            assert!(!said.contains(word), "{}: {word}: {said}", case.display());
        }
    }
}

fn cases() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases");
    let entries = fs::read_dir(folder).expect("cases lie beside this file");
    let specs = entries.flatten().map(|entry| entry.path());
    let mut specs: Vec<PathBuf> =
        specs.filter(|path| path.extension().is_some_and(|e| e == "ivx")).collect();
    specs.sort();
    specs
}

/// What `ivx check` says of a case; it can use the files in `cases/lib`.
fn check(case: &Path) -> String {
    let text = fs::read_to_string(case).expect("cases can be read");
    let name = case.file_name().expect("a case is a file").to_string_lossy().into_owned();
    let project = Project::with(&[(&name, &text)]);
    for entry in fs::read_dir(case.with_file_name("lib")).expect("the library of cases").flatten() {
        let lib = fs::read_to_string(entry.path()).expect("files can be read");
        project.write(&format!("lib/{}", entry.file_name().to_string_lossy()), &lib);
    }
    let said = project.run("check", &name, &[]);
    format!("exit {}\n{}{}", said.code, said.out, said.err)
}
