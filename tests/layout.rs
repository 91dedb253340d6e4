//! `ivx fmt`.

use std::fs;

use crate::project::Project;

const WRITTEN: &str = "edition \"2026\"\nlet  a = 1 // one\n";
const LAID_OUT: &str = "edition \"2026\"\nlet a = 1   // one\n";

#[test]
fn specs_are_changed_in_place_and_only_once() {
    let project = Project::with(&[("a.ivx", WRITTEN), ("b.ivx", LAID_OUT)]);
    let (a, b) = (project.path("a.ivx").display().to_string(), project.path("b.ivx"));
    let b = b.display().to_string();
    let checked = project.run("fmt", "a.ivx", &[&b, "--check"]);
    assert_eq!((checked.code, checked.out), (1, format!("{a}\n")));
    assert_eq!(project.read("a.ivx"), WRITTEN);

    let changed = project.run("fmt", "a.ivx", &[&b]);
    assert_eq!((changed.code, changed.out), (0, format!("{a}\n")));
    assert_eq!([project.read("a.ivx"), project.read("b.ivx")], [LAID_OUT; 2]);

    let checked = project.run("fmt", "a.ivx", &[&b, "--check"]);
    assert_eq!((checked.code, checked.out, checked.err), (0, String::new(), String::new()));
}

#[cfg(unix)]
#[test]
fn a_spec_is_replaced_and_keeps_its_permissions() {
    use std::os::unix::fs::{PermissionsExt as _, symlink};
    let project = Project::with(&[("a.ivx", WRITTEN)]);
    let a = project.path("a.ivx");
    fs::set_permissions(&a, fs::Permissions::from_mode(0o640)).expect("the file is ours");
    // What was open under another name stays whole.
    fs::hard_link(&a, project.path("before.ivx")).expect("files can be linked");
    symlink("a.ivx", project.path("link.ivx")).expect("files can be linked");

    assert_eq!(project.run("fmt", "link.ivx", &[]).code, 0);
    assert_eq!([project.read("a.ivx"), project.read("before.ivx")], [LAID_OUT, WRITTEN]);
    let mode = fs::metadata(&a).expect("the file is there").permissions().mode();
    assert_eq!(mode & 0o777, 0o640);
    assert!(fs::symlink_metadata(project.path("link.ivx")).is_ok_and(|link| link.is_symlink()));
    let names: Vec<String> = project.files("").into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["a.ivx", "before.ivx", "link.ivx"]);
}

#[test]
fn a_spec_that_does_not_parse_stays_as_it_is() {
    let faulty = "edition \"2026\"\nlet  a =\n";
    let project = Project::with(&[("a.ivx", faulty), ("b.ivx", WRITTEN)]);
    let b = project.path("b.ivx").display().to_string();
    let said = project.run("fmt", "a.ivx", &[&b]);
    assert_eq!(said.code, 2);
    assert!(said.err.contains("IVX0101") && said.err.contains("a.ivx:2"), "{}", said.err);
    assert_eq!([project.read("a.ivx"), project.read("b.ivx")], [faulty, LAID_OUT]);
    assert_eq!(project.run("fmt", "none.ivx", &[]).code, 2);
}
