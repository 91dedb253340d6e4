//! What is answered to questions about one text.

use std::path::Path;

use serde_json::{Value, json};

use super::{Editor, SPEC, edited};

#[test]
fn a_fault_is_told_where_it_is_and_mended() {
    let mut editor = Editor::new();
    let text = SPEC.replace("by: ke)", "by: kee)");
    editor.open("gaps.ivx", &text);
    let faults = editor.faults("gaps.ivx");
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert_eq!((&faults[0]["code"], &faults[0]["source"]), (&json!("IVX0306"), &json!("ivx")));
    let place =
        json!({ "start": { "line": 12, "character": 34 }, "end": { "line": 12, "character": 37 } });
    assert_eq!(faults[0]["range"], place);
    let params = json!({
        "textDocument": { "uri": editor.uri("gaps.ivx") },
        "range": place,
        "context": { "diagnostics": [] },
    });
    let actions = editor.ask("textDocument/codeAction", params).expect("it is answered");
    assert_eq!(actions[0]["title"], "did you mean `ke`?");
    let edits = &actions[0]["edit"]["changes"][editor.uri("gaps.ivx")];
    assert_eq!(edited(&text, edits), SPEC);
    editor.change("gaps.ivx", SPEC);
    assert_eq!(editor.faults("gaps.ivx"), [] as [Value; 0]);
}

#[test]
fn a_name_says_what_it_is() {
    let mut editor = Editor::new();
    editor.open("gaps.ivx", SPEC);
    let mut check = |marked: &str, expected: &[&str]| {
        let found = editor.at("textDocument/hover", "gaps.ivx", SPEC, marked);
        let said = found["contents"]["value"].as_str().unwrap_or_default().to_owned();
        for words in expected {
            assert!(said.contains(words), "{marked} says {words}: {said}");
        }
    };
    check("let model = tra", &["train(", "```ivx"]);
    check("argmax(mod", &["let model = train(", "Ensemble<Model>", "over seed"]);
    check("argmax(model, k", &["`ke:", "of `argmax`"]);
    check("by: k", &["axis ke", "`WCM`"]);
    check("gap[ke: \"WC", &["label `WCM` of the axis `ke`, one of 2"]);
    check("members: memb", &["param members: Int = 3", "ensemble size", "Int = 3"]);
}

#[test]
fn what_can_be_written_is_offered() {
    let mut editor = Editor::new();
    editor.open("gaps.ivx", SPEC);
    editor.write("shared.ivx", "edition \"2026\"\n");
    let mut check = |from: &str, to: &str, expected: &[&str], other: &[&str]| {
        let offered = editor.offered("gaps.ivx", &SPEC.replacen(from, to, 1));
        for name in expected {
            assert!(offered.iter().any(|own| own == name), "{to} offers {name}: {offered:?}");
        }
        for name in other {
            assert!(!offered.iter().any(|own| own == name), "{to} offers no {name}");
        }
    };
    check("argmax(model, ke: ke", "argmax(model, |", &["ke:", "among:", "data"], &["model:"]);
    check("= argmax(", "= arg|(", &["argmax"], &[]);
    check("gap[ke: \"WCM\"]", "gap[ke: \"|", &["WCM", "MA"], &["argmax"]);
    check("gap[ke: \"WCM\"]", "gap[|", &["ke", "seed"], &["argmax", "WCM"]);
    check("net: mlp(hidden: [4])", "net: |", &["mlp"], &[]);
    check("members: Int", "members: |", &["Int", "Ke"], &["argmax"]);
    check("    measure gap", "    |\n    measure gap", &["measure", "claim"], &["argmax"]);
    check("experiment gaps", "use \"|\"\nexperiment gaps", &["shared.ivx"], &["gap"]);
    check("    axis seed", "    // ar|\n    axis seed", &[], &["argmax", "measure"]);
    // Of an argument of a family its parts come first.
    let offered = editor.offered(
        "gaps.ivx",
        &SPEC
            .replace("{ \"WCM\": wcm(), \"MA\": ma() }", "[1]")
            .replace("ke: ke, among", "ke: |, among"),
    );
    assert!(["bcm", "cvar", "ma", "wcm"].contains(&offered[0].as_str()), "{:?}", &offered[..4]);
}

#[test]
fn the_text_is_laid_out_folded_and_coloured() {
    let mut editor = Editor::new();
    let untidy = SPEC.replace("axis seed = 0..4", "axis   seed = 0..4");
    editor.open("gaps.ivx", &untidy);
    let edits = editor.of("textDocument/formatting", "gaps.ivx");
    assert_eq!(edits.as_array().map(Vec::len), Some(1));
    let tidy = ivx_grammar::format(SPEC).expect("the text reads");
    assert_eq!(edited(&untidy, &edits), tidy);
    editor.change("gaps.ivx", SPEC);
    let symbols = editor.of("textDocument/documentSymbol", "gaps.ivx");
    assert_eq!(symbols[0]["name"], "gaps");
    let inside = symbols[0]["children"].as_array().expect("it has items").iter();
    let names: Vec<&str> = inside.filter_map(|symbol| symbol["name"].as_str()).collect();
    let expected = [
        "members",
        "seed",
        "ke",
        "data",
        "model",
        "decision",
        "gap",
        "gaps",
        "pessimism is less deceived",
    ];
    assert_eq!(names, expected);
    let folds = editor.of("textDocument/foldingRange", "gaps.ivx");
    assert!(
        folds.as_array().expect("a list").contains(&json!({ "startLine": 3, "endLine": 13 })),
        "{folds}"
    );
    let tokens = editor.of("textDocument/semanticTokens/full", "gaps.ivx");
    // The first is the name of the experiment, declared there: line 3, from 11 on, 4 long.
    let first: Vec<u64> = tokens["data"]
        .as_array()
        .expect("numbers")
        .iter()
        .take(5)
        .filter_map(Value::as_u64)
        .collect();
    assert_eq!(first, [3, 11, 4, 0, 1]);
    let lenses = editor.of("textDocument/codeLens", "gaps.ivx");
    let titles: Vec<&str> = lenses
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|lens| lens["command"]["title"].as_str())
        .collect();
    assert_eq!(titles, ["run", "why"]);
    assert_eq!(lenses[1]["command"]["arguments"][1], "gaps/gap");
}

#[test]
fn what_a_run_found_out_stands_beside_the_text() {
    let mut editor = Editor::new();
    editor.write("gaps.ivx", SPEC);
    editor.open("gaps.ivx", SPEC);
    let hints = |editor: &mut Editor| -> Vec<String> {
        let found = editor.of("textDocument/inlayHint", "gaps.ivx");
        let found = found.as_array().expect("a list").iter();
        found.filter_map(|hint| hint["label"].as_str().map(str::to_owned)).collect()
    };
    editor.asked("workspace/inlayHint/refresh");
    let before = hints(&mut editor);
    assert!(before.iter().any(|hint| hint == "seed × member, 12 nodes to run"), "{before:?}");
    assert!(before.iter().any(|hint| hint == "seed × ke, 8 nodes to run"), "{before:?}");
    assert_eq!(editor.of("ivx/report", "gaps.ivx"), json!({ "path": null }));
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let spec = editor.path("gaps.ivx");
    let line =
        ["ivx".as_ref(), "exec".as_ref(), spec.as_os_str()].map(std::ffi::OsStr::to_os_string);
    let code = crate::run(line, &mut out, &mut err);
    assert_eq!(code, crate::OK, "{}", String::from_utf8_lossy(&err));
    let saved = json!({ "textDocument": { "uri": editor.uri("gaps.ivx") } });
    editor.tell("textDocument/didSave", saved);
    editor.asked("workspace/inlayHint/refresh");
    let after = hints(&mut editor);
    assert!(after.iter().any(|hint| hint == "seed × member, 12 nodes, known"), "{after:?}");
    let verdict = after.last().expect("the claim is last");
    assert!(verdict.contains("n = 4"), "{verdict}");
    let said = editor.at("textDocument/hover", "gaps.ivx", SPEC, "measure ga");
    let said = said["contents"]["value"].as_str().expect("it says something").to_owned();
    assert!(said.contains("in the last run: 8 numbers from"), "{said}");
    let report = editor.of("ivx/report", "gaps.ivx");
    let report = report["path"].as_str().expect("there is one").to_owned();
    assert!(Path::new(&report).is_file(), "{report}");
}
