//! The commands of `docs/ci.md` run, as a CI service would run them.

use std::fs;
use std::path::Path;
use std::process::Command;

const SPEC: &str = r#"edition "2026"

experiment main {
    axis seed = 0..2
    let data = sample(sinusoids(), n: 10)
    let model = train(ensemble(map_estimate(net: mlp(hidden: [48, 48])), members: 2), on: data, steps: 4)
    measure spread = mean(std(predict(model, at: grid(-1.0, 1.0, points: 11)), over: member), over: x)
    claim "members differ" : spread > 0.0
}
"#;

/// The lines of a document that call the command.
fn commands(document: &str) -> Vec<&str> {
    let lines = document.lines().map(str::trim_start);
    let lines = lines.map(|line| line.strip_prefix("- ").unwrap_or(line));
    let lines = lines.map(|line| line.strip_prefix("run: ").unwrap_or(line));
    lines.filter(|line| line.starts_with("ivx ")).collect()
}

/// A machine with nothing but the sources and the lock file.
fn machine(lock: Option<&str>) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("temporary folders can be made");
    fs::create_dir_all(folder.path().join(".ivx")).expect("the folder is empty");
    fs::create_dir(folder.path().join("experiments")).expect("the folder is empty");
    let write = |path: &str, text: &str| {
        fs::write(folder.path().join(path), text).expect("files can be written");
    };
    write("experiments/main.ivx", SPEC);
    if let Some(lock) = lock {
        write("experiments/ivx.lock", lock);
    }
    folder
}

/// What a command line says on both outputs.
fn run(line: &str, machine: &Path, environment: &[(&str, &str)]) -> String {
    let mut ivx = Command::new(env!("CARGO_BIN_EXE_ivx"));
    for name in ["IVX_CACHE", "IVX_STORE", "IVX_STORE_MODE"] {
        ivx.env_remove(name);
    }
    ivx.envs(environment.iter().copied()).current_dir(machine);
    let output = ivx.args(line.split_whitespace().skip(1)).output().expect("the command runs");
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8(said).expect("the command speaks UTF-8");
    assert!(output.status.success(), "{line}: {said}");
    said
}

#[test]
fn every_command_in_the_document_runs_and_what_one_job_found_serves_the_next() {
    let document = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/ci.md");
    let document = fs::read_to_string(document).expect("the document is there");
    let commands = commands(&document);
    assert!(commands.len() >= 7, "{commands:?}");

    let author = machine(None);
    run("ivx exec experiments/main.ivx --lock", author.path(), &[]);
    let lock = fs::read_to_string(author.path().join("experiments/ivx.lock"));
    let lock = lock.expect("the lock file is written");

    let shared = tempfile::tempdir().expect("temporary folders can be made");
    let store = shared.path().join("store").display().to_string();
    for (mode, known) in [("write", [false, true, true, true]), ("read", [true; 4])] {
        let environment = [("IVX_STORE", &*store), ("IVX_STORE_MODE", mode)];
        let job = machine(Some(&lock));
        let lines = commands.iter().filter(|line| !line.contains("--store"));
        let said = lines.map(|line| run(line, job.path(), &environment));
        let said: Vec<_> = said.filter(|said| said.contains("nodes executed")).collect();
        let executed_none = |said: &String| said.contains("\n0 of ");
        assert_eq!(said.iter().map(executed_none).collect::<Vec<_>>(), known, "{said:?}");
    }
    // The one that names the store itself, in a project of its own.
    for line in commands.iter().filter(|line| line.contains("--store")) {
        let said = run(line, machine(Some(&lock)).path(), &[]);
        assert!(said.contains("note: the store .ivx/store is not used"), "{said}");
    }
}

#[test]
fn the_command_line_comes_before_the_environment_and_a_wrong_mode_is_told() {
    let shared = tempfile::tempdir().expect("temporary folders can be made");
    let job = machine(None);
    let mine = shared.path().join("mine").display().to_string();
    let environment = [("IVX_STORE", "elsewhere"), ("IVX_STORE_MODE", "read")];
    let line = format!("ivx exec experiments/main.ivx --store {mine} --store-mode write");
    let said = run(&line, job.path(), &environment);
    assert!(said.contains(&format!("store {mine}: 0 results, new ones are put there")), "{said}");
    assert!(!job.path().join("elsewhere").exists());
    let mut ivx = Command::new(env!("CARGO_BIN_EXE_ivx"));
    ivx.args(["exec", "experiments/main.ivx"]).current_dir(job.path());
    let output = ivx.env("IVX_STORE_MODE", "wriet").output().expect("the command runs");
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("`IVX_STORE_MODE` is `wriet`: write `read` or `write`"), "{said}");
}
