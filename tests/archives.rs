//! `ivx cache export` and `ivx cache import`.

use std::ffi::OsString;
use std::fs;

use crate::project::{Project, run};

const SMALL: &str = include_str!("specs/small.ivx");

fn small() -> Project {
    Project::with(&[("small.ivx", &SMALL.replace("hidden: [8]", "hidden: [32, 32]"))])
}

/// Exports what a spec of the project needs.
fn export(project: &Project, file: &str, rest: &[&str]) -> String {
    let mut args: Vec<OsString> = ["ivx", "cache", "export"].map(OsString::from).to_vec();
    args.extend([project.path(file).into(), "--spec".into(), project.path("small.ivx").into()]);
    args.extend(rest.iter().map(OsString::from));
    let said = run(args);
    assert_eq!((said.code, said.err.as_str()), (0, ""));
    said.out
}

#[test]
fn an_archive_of_a_spec_spares_another_project_its_runs() {
    let project = small();
    project.executed("small.ivx", &["--set", "members=3"]);
    project.executed("small.ivx", &[]);
    let said = export(&project, "all.ivxa", &["--set", "members=3"]);
    assert!(said.contains(" records, ") && said.contains(" objects of "), "{said}");
    export(&project, "two.ivxa", &[]);
    export(&project, "again.ivxa", &[]);
    let bytes = |file: &str| fs::read(project.path(file)).expect("it was written");
    assert_eq!(bytes("two.ivxa"), bytes("again.ivxa"));
    assert!(bytes("two.ivxa").len() < bytes("all.ivxa").len());
    assert!(!project.path("all.ivxa.part").exists());

    let other = small();
    let mut cache = ivx_cache::Cache::open(&other.path(".ivx/cache"), &ivx_engine::platform())
        .expect("the cache opens");
    let limits = ivx_cache::Limits::default();
    ivx_cache::import(&mut cache, &bytes("two.ivxa")[..], &limits).expect("it is an archive");
    cache.close().expect("the cache closes");
    assert_eq!(other.executed("small.ivx", &[]), 0);
    let results = |project: &Project| project.read("results/small/results.ron");
    assert_eq!(results(&other), results(&project));
    // What the other run needs beyond: its two models more, and what is made of all three.
    let more = other.run("plan", "small.ivx", &["--nodes", "--set", "members=3"]).out;
    let trained: Vec<&str> = more.lines().filter(|line| line.contains("/model")).collect();
    assert_eq!(trained.iter().filter(|line| line.starts_with("run")).count(), 2);
}
