//! The report to read.

use std::fs;
use std::path::Path;

use crate::project::Project;

const SPEC: &str = include_str!("specs/documented.ivx");

/// `BLESS=1` rewrites the expected report; review the difference.
#[test]
fn docs_of_every_kind_and_what_came_out_are_told() {
    let project = Project::with(&[("documented.ivx", SPEC)]);
    project.executed("documented.ivx", &[]);
    let report = project.read("results/documented/report.md");
    for line in SPEC.lines().filter_map(|line| line.split_once("///")) {
        assert!(report.contains(line.1.trim()), "{}", line.1);
    }
    for link in report.split("](<").skip(1) {
        let path = link.split('>').next().unwrap_or_default();
        assert!(project.path(&format!("results/documented/{path}")).exists(), "{path}");
    }
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("specs/documented.md");
    if std::env::var_os("BLESS").is_some() {
        fs::write(&golden, &report).expect("golden files can be written");
    }
    assert_eq!(report, fs::read_to_string(&golden).expect("it is there"));
}

#[test]
fn what_failed_is_told() {
    let broken = SPEC.replace("([known], [1.0])", "([known], [0.5])");
    let project = Project::with(&[("documented.ivx", &broken)]);
    assert_eq!(project.run("exec", "documented.ivx", &[]).code, 1);
    let report = project.read("results/documented/report.md");
    assert!(report.contains("\n## Failures\n\n- `documented/"), "{report}");
    assert!(report.contains("Not there, because something that it needs has failed."), "{report}");
    assert!(report.contains("**undecided**: a loss is feared"), "{report}");
}
