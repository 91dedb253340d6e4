//! What is known of files beside the one that is asked about.

use std::fs;

use serde_json::{Value, json};

use super::{Editor, SPEC, edited};

#[test]
fn names_are_found_and_changed_in_every_file() {
    let mut editor = Editor::new();
    let shared =
        "edition \"2026\"\nlet net = mlp(hidden: [4])\nlet wide(n: Int) = mlp(hidden: [n])\n";
    editor.write("shared.ivx", shared);
    let user = SPEC.replace(
        "edition \"2026\"\n",
        "edition \"2026\"\nuse \"shared.ivx\" { net, wide as broad }\n",
    );
    let user = user.replace("net: mlp(hidden: [4])", "net: net");
    editor.write("user.ivx", &user);
    editor.open("shared.ivx", shared);
    editor.open("gaps.ivx", &user);
    let found = editor.at("textDocument/definition", "gaps.ivx", &user, "net: ne");
    assert_eq!(found["uri"], editor.uri("shared.ivx"));
    assert_eq!(found["range"]["start"], json!({ "line": 1, "character": 4 }));
    let found = editor.at("textDocument/definition", "gaps.ivx", &user, "\"shared.i");
    assert_eq!(found["uri"], editor.uri("shared.ivx"));
    let found = editor.at("textDocument/definition", "gaps.ivx", &user, "gap[ke: \"M");
    assert_eq!(found["range"]["start"]["line"], 7, "the label where the axis is declared");
    // One of the users is not open, and one is not on the disk.
    let found = editor.at("textDocument/references", "shared.ivx", shared, "let ne");
    let files: Vec<&str> =
        found.as_array().expect("a list").iter().filter_map(|at| at["uri"].as_str()).collect();
    let count = |name: &str| files.iter().filter(|file| file.ends_with(name)).count();
    assert_eq!((count("shared.ivx"), count("user.ivx")), (1, 2), "{files:?}");
    let mut rename = |marked: &str, name: &str| {
        let mut params = editor.place("gaps.ivx", &user, marked);
        params["newName"] = json!(name);
        editor.ask("textDocument/rename", params)
    };
    let changed = rename("net: ne", "small").expect("it can be renamed");
    assert!(rename("net: ne", "let").expect_err("a word").contains("no name"));
    assert!(rename("net: ne", "wide").expect_err("is there").contains("declared already"));
    assert!(rename("axis see", "luck").expect_err("of seeds").contains("random numbers"));
    assert!(rename("= trai", "learn").expect_err("of the library").contains("library"));
    let changes = &changed["changes"];
    let new = edited(&user, &changes[editor.uri("gaps.ivx")]);
    assert!(new.contains("{ small, wide as broad }") && new.contains("net: small"), "{new}");
    assert!(edited(shared, &changes[editor.uri("shared.ivx")]).contains("let small = mlp"));
    assert!(changes.get(editor.uri("user.ivx")).is_some());
}

#[test]
fn a_text_that_is_not_saved_counts_for_those_that_use_it() {
    let mut editor = Editor::new();
    let shared = "edition \"2026\"\nlet net = mlp(hidden: [4])\n";
    editor.write("shared.ivx", shared);
    let user = SPEC.replace("edition \"2026\"\n", "edition \"2026\"\nuse \"shared.ivx\" { net }\n");
    let user = user.replace("net: mlp(hidden: [4])", "net: net");
    editor.open("shared.ivx", shared);
    editor.open("gaps.ivx", &user);
    assert_eq!(editor.faults("gaps.ivx"), [] as [Value; 0]);
    editor.change("shared.ivx", &shared.replace("let net", "let nets"));
    let faults = editor.faults("gaps.ivx");
    assert_eq!(faults[0]["code"], "IVX0301", "{faults:?}");
    // What is on the disk counts again once it is closed.
    let document = json!({ "textDocument": { "uri": editor.uri("shared.ivx") } });
    editor.tell("textDocument/didClose", document);
    assert_eq!(editor.faults("gaps.ivx"), [] as [Value; 0]);
}

#[test]
fn two_projects_are_kept_apart() {
    let mut editor = Editor::new();
    for name in ["a", "b"] {
        fs::create_dir_all(editor.path(name).join(".git")).expect("folders can be made");
        let value =
            format!("edition \"2026\"\nlet shared = {}\n", if name == "a" { "1" } else { "\"b\"" });
        editor.write(&format!("{name}/shared.ivx"), &value);
        let user = "edition \"2026\"\nuse \"shared.ivx\" { shared }\nexperiment e { measure m = 1.0 * shared }\n";
        editor.open(&format!("{name}/user.ivx"), user);
    }
    assert_eq!(editor.faults("a/user.ivx"), [] as [Value; 0]);
    assert_eq!(editor.faults("b/user.ivx").len(), 1);
    editor.open("outside.ivx", "edition \"2026\"\nuse \"../x.ivx\"\n");
    assert_eq!(editor.faults("outside.ivx")[0]["code"], "IVX0203");
}

#[test]
fn a_text_that_was_never_saved_can_be_used() {
    let mut editor = Editor::new();
    let user = "edition \"2026\"\nuse \"shared.ivx\" { a }\nexperiment e { measure m = 1.0 * a }\n";
    editor.open("user.ivx", user);
    assert_eq!(editor.faults("user.ivx")[0]["code"], "IVX0201");
    let shared = "edition \"2026\"\nlet a = 1\n";
    editor.open("shared.ivx", shared);
    assert_eq!(editor.faults("user.ivx"), [] as [Value; 0]);
    let found = editor.at("textDocument/references", "shared.ivx", shared, "let a");
    assert_eq!(found.as_array().map(Vec::len), Some(3), "{found}");
    let document = json!({ "textDocument": { "uri": editor.uri("shared.ivx") } });
    editor.tell("textDocument/didClose", document);
    assert_eq!(editor.faults("user.ivx")[0]["code"], "IVX0201");
}

#[cfg(unix)]
#[test]
fn files_are_called_as_the_editor_calls_them() {
    let mut editor = Editor::new();
    fs::create_dir(editor.path("real")).expect("folders can be made");
    std::os::unix::fs::symlink(editor.path("real"), editor.path("link")).expect("it can be linked");
    let text = SPEC.replace("by: ke)", "by: kee)");
    editor.open("link/gaps.ivx", &text);
    assert_eq!(editor.faults("link/gaps.ivx").len(), 1);
    let own = editor.uri("link/gaps.ivx");
    let everywhere = json!({
        "textDocument": { "uri": own },
        "range": { "start": { "line": 0, "character": 0 }, "end": { "line": 99, "character": 0 } },
    });
    let actions = editor.ask("textDocument/codeAction", everywhere).expect("it is answered");
    let edits = &actions[0]["edit"]["changes"][&own];
    assert_eq!(edited(&text, edits), SPEC);
    let found = editor.at("textDocument/definition", "link/gaps.ivx", &text, "argmax(mod");
    assert_eq!(found["uri"], own);
    let mut params = editor.place("link/gaps.ivx", &text, "argmax(mod");
    params["newName"] = json!("learned");
    let changed = editor.ask("textDocument/rename", params).expect("it can be renamed");
    assert!(edited(&text, &changed["changes"][&own]).contains("argmax(learned"));
    let lenses = editor.of("textDocument/codeLens", "link/gaps.ivx");
    assert_eq!(lenses[0]["command"]["arguments"][0], own);
    // What was told by one name is taken back by the same.
    editor.tell("textDocument/didClose", json!({ "textDocument": { "uri": own } }));
    assert_eq!(editor.faults("link/gaps.ivx"), [] as [Value; 0]);
}
