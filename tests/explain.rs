//! `ivx explain` and its pages.

use std::fs;
use std::path::Path;

use ivx_grammar::Code;

use crate::examples::try_all;
use crate::project::run;

fn explain(rest: &[&str]) -> crate::project::Said {
    run(["ivx", "explain"].iter().chain(rest).map(Into::into).collect())
}

#[test]
fn every_page_is_about_a_code_and_its_examples_are_true() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/errors");
    assert_eq!(fs::read_dir(&folder).expect("pages are there").count(), Code::ALL.len());
    for code in Code::ALL {
        let page = explain(&[&code.to_string()]).out;
        let file = fs::read_to_string(folder.join(format!("{code}.md"))).expect("it has a page");
        assert_eq!(page, file, "{code}");
        assert_eq!(
            page.matches(&format!("\nWrong:\n\n```ivx,fails={code}\n")).count(),
            1,
            "{code}"
        );
        assert_eq!(page.matches("\nMended:\n\n```ivx\n").count(), 1, "{code}");
        assert!(try_all(&format!("{code}.md"), &page) >= 2);
    }
}

#[test]
fn without_a_code_all_are_listed() {
    let said = explain(&[]);
    for code in Code::ALL {
        assert!(said.out.lines().any(|line| line.starts_with(&code.to_string())), "{code}");
    }
}

#[test]
fn an_unknown_code_is_an_error() {
    let said = explain(&["IVX9302"]);
    assert_eq!((said.code, said.out.as_str()), (2, ""));
    assert!(said.err.contains("did you mean"), "{}", said.err);
}
