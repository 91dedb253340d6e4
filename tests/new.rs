//! `ivx new`

use crate::project::Project;

#[test]
fn a_new_spec_runs_and_its_claim_does_not_fail() {
    let project = Project::with(&[]);
    let said = project.run("new", "first_steps", &[]);
    assert_eq!(said.code, 0, "{}", said.err);
    let said = project.run("exec", "first_steps.ivx", &["--strict"]);
    assert_eq!((said.code, said.err.as_str()), (0, ""), "{}", said.out);
    assert!(said.out.starts_with("first_steps\n"), "{}", said.out);
    assert!(["holds", "undecided"].iter().any(|word| said.out.contains(word)), "{}", said.out);
    assert!(project.path("results/first_steps/figures/error.svg").is_file());
}

#[test]
fn nothing_is_overwritten() {
    let project = Project::with(&[("mine.ivx", "precious")]);
    for name in ["mine", "mine.ivx"] {
        let said = project.run("new", name, &[]);
        assert_eq!(said.code, 2);
        assert!(said.err.contains("already there"), "{}", said.err);
    }
    assert_eq!(project.read("mine.ivx"), "precious");
}

#[test]
fn what_is_not_a_name_is_refused() {
    let project = Project::with(&[]);
    assert_eq!(project.run("new", "let", &[]).code, 2);
    assert!(!project.path("let.ivx").exists());
}
