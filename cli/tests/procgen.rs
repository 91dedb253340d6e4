//! Games of Procgen, where ivx is built with them and `PROCGEN_DIR` names the folder of its library.
#![cfg(feature = "procgen")]

mod common;

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

fn library() -> Option<PathBuf> {
    let folder = std::env::var_os("PROCGEN_DIR").map(PathBuf::from);
    if folder.is_none() {
        eprintln!("without PROCGEN_DIR, a folder with Procgen's library, nothing is tried here");
    }
    folder
}

fn spec(rest: &str) -> String {
    format!(
        r#"edition "2026"
experiment e {{
    axis seed = 0..1
    axis n = [1, 20]
    let fruits = procgen("fruitbot", levels: n, first: 7, mode: "easy"{rest})
    let how = dqn(net: cnn(channels: [2], strides: [4], hidden: [4]), warm_up: 8, batch: 4)
    let run = learn(how, in: fruits, for: steps(24), every: 12, trials: 1)
    measure won = mean(run.returns, over: trial)
    measure played = run.played
}}
"#
    )
}

#[track_caller]
fn finds(folder: &Path, args: &[&str], code: i32, parts: &[&str]) {
    let output = common::ivx(folder, args).output().expect("the command runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let text = text(&output.stdout) + &text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{text}");
    for part in parts {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn a_result_knows_the_library_and_not_where_it_lies() {
    let Some(library) = library() else { return };
    let project = common::project(&[("e.ivx", &spec(""))]);
    let folder = project.path();
    finds(folder, &["exec", "e.ivx"], 0, &["8 of 8 nodes executed"]);
    let results = || fs::read(folder.join("results/e/results.ron")).expect("they are");
    let first = results();
    symlink(&library, folder.join("linked")).expect("a link");
    fs::write(folder.join("e.ivx"), spec(", path: \"linked\"")).expect("files can be written");
    finds(folder, &["exec", "e.ivx"], 0, &["0 of 8 nodes executed"]);
    fs::remove_dir_all(folder.join(".ivx/cache")).expect("a cache");
    finds(folder, &["exec", "e.ivx"], 0, &["8 of 8 nodes executed"]);
    assert!(results() == first, "what is found depends on where the library lies");
    // Other rewards are another world.
    let pays = ", path: \"linked\", pays: [0.0, 0.0, 1.0]";
    fs::write(folder.join("e.ivx"), spec(pays)).expect("files can be written");
    finds(folder, &["exec", "e.ivx"], 0, &["nodes executed"]);
}

#[test]
fn what_cannot_be_played_is_told_before_anything_runs() {
    if library().is_none() {
        return;
    }
    let project = common::project(&[]);
    let folder = project.path();
    let check = |text: &str, parts: &[&str]| {
        fs::write(folder.join("e.ivx"), text).expect("files can be written");
        finds(folder, &["check", "e.ivx"], 2, parts);
    };
    check(
        &spec(", path: \"nowhere\""),
        &["`fruitbot` cannot be played", "nowhere", "No such file"],
    );
    check(&spec(", path: \".\""), &["has no `prebuilt/libenv.so`"]);
    check(&spec(", pays: [1.0]"), &["not for 1", "give three numbers"]);
    check(&spec("").replace("fruitbot", "frutbot"), &["no game of Procgen is called \"frutbot\""]);
    check(&spec("").replace("easy", "memory"), &["no mode is called \"memory\""]);
}
