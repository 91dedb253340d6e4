//! What completes command lines, the manual, and what `--version` says.

#![cfg(unix)]

mod common;
#[path = "common/appears.rs"]
mod wait;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use wait::appears;

#[track_caller]
fn said(folder: &Path, args: &[&str]) -> String {
    let output = common::ivx(folder, args).output().expect("the command runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("it speaks UTF-8")
}

/// The subcommands that `ivx help` lists.
fn subcommands(folder: &Path, of: &[&str]) -> BTreeSet<String> {
    let help = said(folder, &[of, &["--help"]].concat());
    let list = help.split("Commands:\n").nth(1).unwrap_or_default();
    let lines = list.lines().take_while(|line| !line.is_empty());
    let names = lines.filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    names.filter(|name| !name.is_empty() && *name != "help").map(str::to_owned).collect()
}

/// What bash offers at the end of a line of words.
fn offered(folder: &Path, words: &[&str]) -> BTreeSet<String> {
    let last = words.last().expect("there are words");
    let before = &words[words.len() - 2];
    let quoted: Vec<String> = words.iter().map(|word| format!("'{word}'")).collect();
    let script = format!(
        "source ivx.bash; COMP_WORDS=({}); COMP_CWORD={}\n\
         how=$(complete -p ivx); how=${{how#*-F }}; ${{how%% *}} ivx '{last}' '{before}' 2> /dev/null\n\
         printf '%s\\n' \"${{COMPREPLY[@]}}\"",
        quoted.join(" "),
        words.len() - 1,
    );
    let output = Command::new("bash").args(["--norc", "-c", &script]).current_dir(folder).output();
    let output = output.expect("bash is there");
    let err = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && err.is_empty(), "{err}");
    String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect()
}

fn set(names: &[&str]) -> BTreeSet<String> {
    names.iter().map(ToString::to_string).collect()
}

#[test]
fn bash_completes_subcommands_options_and_specs() {
    if Command::new("bash").arg("--version").output().is_err() {
        eprintln!("skipped: there is no bash to complete in");
        return;
    }
    let files =
        [("e.ivx", ""), ("e one.ivx", ""), ("e.txt", ""), ("early/f.ivx", ""), ("d.ivx", "")];
    let folder = common::project(&files);
    let folder = folder.path();
    let script = said(folder, &["completions", "bash"]);
    fs::write(folder.join("ivx.bash"), &script).expect("files can be written");
    assert_eq!(script, said(folder, &["completions", "bash"]));
    assert_eq!(offered(folder, &["ivx", "ex"]), set(&["exec", "explain", "export"]));
    assert_eq!(offered(folder, &["ivx", "exec", "--stri"]), set(&["--strict"]));
    assert_eq!(offered(folder, &["ivx", "exec", "--format", ""]), set(&["text", "json"]));
    assert_eq!(offered(folder, &["ivx", "runs", "ke"]), set(&["keep"]));
    let specs = set(&["e.ivx", "e one.ivx", "early"]);
    for line in [
        &["ivx", "exec", "e"][..],
        &["ivx", "plan", "--nodes", "e"],
        &["ivx", "exec", "--jobs", "2", "e"],
    ] {
        assert_eq!(offered(folder, line), specs, "{line:?}");
    }
    // What is no spec there is completed as files are.
    assert_eq!(offered(folder, &["ivx", "exec", "--set", "e"]), set(&["e"]));
    assert_eq!(offered(folder, &["ivx", "exec", "early/"]), set(&["early/f.ivx"]));
}

#[test]
fn every_shell_gets_a_script_that_knows_specs() {
    let folder = common::project(&[]);
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = said(folder.path(), &["completions", shell]);
        assert!(script.contains("completions"), "{shell}");
        let knows = script.contains(".ivx");
        assert_eq!(knows, ["bash", "zsh", "fish"].contains(&shell), "{shell}");
    }
}

#[test]
fn every_subcommand_has_a_page_and_pages_are_the_same_each_time() {
    let folder = common::project(&[]);
    let folder = folder.path();
    let told = said(folder, &["man", "first"]);
    said(folder, &["man", "second"]);
    let mut pages = set(&["ivx.1"]);
    for name in subcommands(folder, &[]) {
        pages.insert(format!("ivx-{name}.1"));
        let inner = subcommands(folder, &[&name]);
        pages.extend(inner.into_iter().map(|own| format!("ivx-{name}-{own}.1")));
    }
    let page =
        |folder: &Path, name: &str| fs::read_to_string(folder.join(name)).expect("it is there");
    let there = fs::read_dir(folder.join("first")).expect("it was made").flatten();
    let there: BTreeSet<String> =
        there.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    assert_eq!(there, pages);
    assert!(pages.contains("ivx-cache-gc.1") && pages.len() > 20, "{pages:?}");
    assert!(told.starts_with(&format!("{} pages in first", pages.len())), "{told}");
    for name in &pages {
        let text = page(&folder.join("first"), name);
        assert_eq!(text, page(&folder.join("second"), name));
        assert!(text.contains(".SH NAME") && text.contains(".SH SYNOPSIS"), "{name}: {text}");
        // Of who formats pages, whichever there is.
        for format in [&["mandoc", "-Tlint", "-W", "error"][..], &["man", "-l"]] {
            let mut run = Command::new(format[0]);
            let run =
                run.args(&format[1..]).arg(folder.join("first").join(name)).env("MANPAGER", "cat");
            if let Ok(shown) = run.output() {
                let err = String::from_utf8_lossy(&shown.stderr).into_owned();
                assert!(shown.status.success() || err.contains("not found"), "{name}: {err}");
            }
        }
    }
    let exec = page(&folder.join("first"), "ivx-exec.1");
    assert!(exec.contains("strict") && exec.contains("experiments/thesis.ivx"), "{exec}");
}

#[test]
fn the_version_is_one_line_with_library_and_features() {
    let folder = common::project(&[]);
    for flag in ["--version", "-V"] {
        let line = said(folder.path(), &[flag]);
        let known = &ivx_library::SOURCE_DIGEST[..8];
        let start = format!("ivx {} (library {known}", env!("CARGO_PKG_VERSION"));
        assert!(line.starts_with(&start) && line.ends_with(")\n"), "{line}");
        assert_eq!(line.contains("parquet"), cfg!(feature = "parquet"));
        assert_eq!(line.contains("procgen"), cfg!(feature = "procgen"));
    }
}

const SPEC: &str = r#"edition "2026"
experiment e {
    param level: Float = 1.0
    claim "low" : level < 2.0
}
"#;

#[test]
fn the_last_report_of_a_spec_is_found_and_opened() {
    let folder = common::project(&[("x/e.ivx", SPEC), ("f.ivx", SPEC)]);
    let folder = folder.path();
    let refused = |args: &[&str], why: &str| {
        let output = common::ivx(folder, &[&["report"], args].concat()).output().expect("it runs");
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{err}");
        assert!(err.contains(why), "{err}");
    };
    refused(&["x/e.ivx"], "there is no report of x/e.ivx yet: `ivx exec x/e.ivx` makes it");
    refused(&[], "there is no report yet: `ivx exec SPEC` makes it");
    refused(&["x/g.ivx"], "there is no such file");

    let report = "results/x/e/report.html\n";
    said(folder, &["exec", "x/e.ivx"]);
    assert_eq!(said(folder, &["report", "x/e.ivx"]), report);
    said(folder, &["exec", "x/e.ivx", "--set", "level=1.5"]);
    let other = "results/x/e@level=1.5/report.html\n";
    assert_eq!(said(folder, &["report", "x/e.ivx"]), other);
    assert_eq!(said(folder, &["report", "results/x/e"]), report);
    said(folder, &["exec", "f.ivx"]);
    assert_eq!(said(folder, &["report", "x/e.ivx"]), other);
    assert_eq!(said(folder, &["report"]), "results/f/report.html\n");
    assert_eq!(said(folder, &["report", "results/x"]), other);

    let browser = folder.join("browser");
    fs::write(&browser, "#!/bin/sh\necho \"$1\" > \"$0.part\" && mv \"$0.part\" \"$0.told\"\n")
        .expect("files can be written");
    let executable = std::os::unix::fs::PermissionsExt::from_mode(0o755);
    fs::set_permissions(&browser, executable).expect("the file is ours");
    let named = format!("{}:{}", folder.join("none").display(), browser.display());
    let mut open = common::ivx(folder, &["report", "x/e.ivx", "--open"]);
    let shown = open.env("BROWSER", named).output().expect("it runs");
    assert!(shown.status.success(), "{}", String::from_utf8_lossy(&shown.stderr));
    assert_eq!(String::from_utf8_lossy(&shown.stdout), other);
    let told = folder.join("browser.told");
    appears(&told);
    let opened = fs::read_to_string(told).expect("it is there");
    let page = fs::canonicalize(folder.join(other.trim())).expect("it is there");
    assert_eq!(opened.trim(), page.display().to_string());

    let mut open = common::ivx(folder, &["report", "--open"]);
    let failed = open.env("BROWSER", folder.join("none")).output().expect("it runs");
    assert_eq!(failed.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&failed.stderr).contains("no browser shows it"));
}
