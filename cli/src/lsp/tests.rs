//! The server as an editor sees it.

use std::fs;
use std::path::{Path, PathBuf};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use lsp_server::{Connection, Message, Notification, Request, Response};
use serde_json::{Value, json};

use super::server::serve;
use super::uri;

const SPEC: &str = r#"edition "2026"

/// What acting greedily costs.
experiment gaps {
    param members: Int = 3   /// ensemble size
    axis seed = 0..4
    axis ke = { "WCM": wcm(), "MA": ma() }
    let data = sample(sinusoids(), n: 20)
    let model = train(
        ensemble(map_estimate(net: mlp(hidden: [4])), members: members), on: data, steps: 5)
    let decision = argmax(model, ke: ke, among: grid(-2.0, 2.0, points: 11))
    measure gap = hallucination(decision, under: sinusoids())
    figure "gaps" = bars(gap, by: ke)
    claim "pessimism is less deceived" : gap[ke: "WCM"] < gap[ke: "MA"]
}
"#;

/// How long a message is waited for: longer than anything takes, since nothing is measured here.
const PATIENCE: Duration = Duration::from_mins(2);

struct Editor {
    connection: Option<Connection>,
    server: Option<JoinHandle<()>>,
    folder: tempfile::TempDir,
    id: i32,
    /// What came while something else was waited for.
    told: Vec<Notification>,
}

impl Editor {
    fn new() -> Self {
        Self::speaking(&json!({
            "general": { "positionEncodings": ["utf-16"] },
            "workspace": { "inlayHint": { "refreshSupport": true } },
            "textDocument": { "completion": { "completionItem": { "snippetSupport": true } } },
        }))
        .0
    }

    /// One that can do this, and what the server said it can.
    fn speaking(capabilities: &Value) -> (Self, Value) {
        let folder = tempfile::tempdir().expect("temporary folders can be made");
        fs::create_dir(folder.path().join(".git")).expect("the folder is empty");
        let (here, there) = Connection::memory();
        let server =
            thread::spawn(move || serve(&there).expect("the editor keeps to the protocol"));
        let mut editor =
            Self { connection: Some(here), server: Some(server), folder, id: 0, told: Vec::new() };
        let params = json!({ "processId": null, "rootUri": null, "capabilities": capabilities });
        let told = editor.ask("initialize", params).expect("a server can be started");
        editor.tell("initialized", json!({}));
        (editor, told)
    }

    fn connection(&self) -> &Connection {
        self.connection.as_ref().expect("it is open")
    }

    fn path(&self, name: &str) -> PathBuf {
        fs::canonicalize(self.folder.path()).expect("it is there").join(name)
    }

    fn uri(&self, name: &str) -> String {
        uri(&self.path(name)).0
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).expect("files can be written");
    }

    fn tell(&self, method: &str, params: Value) {
        let note = Notification { method: method.to_owned(), params };
        self.connection().sender.send(note.into()).expect("the server listens");
    }

    fn ask(&mut self, method: &str, params: Value) -> Result<Value, String> {
        self.id += 1;
        let request = Request { id: self.id.into(), method: method.to_owned(), params };
        self.connection().sender.send(request.into()).expect("the server listens");
        loop {
            match self.connection().receiver.recv_timeout(PATIENCE).expect("the server answers") {
                Message::Response(Response { id, response_result, .. }) if id == self.id.into() => {
                    return response_result.map_err(|error| error.message);
                }
                Message::Notification(note) => self.told.push(note),
                _ => {}
            }
        }
    }

    fn open(&self, name: &str, text: &str) {
        let document =
            json!({ "uri": self.uri(name), "languageId": "ivx", "version": 1, "text": text });
        self.tell("textDocument/didOpen", json!({ "textDocument": document }));
    }

    /// Writes a text in place of all that was there.
    fn change(&self, name: &str, text: &str) {
        let document = json!({ "uri": self.uri(name), "version": 2 });
        let changes = json!([{ "text": text }]);
        let params = json!({ "textDocument": document, "contentChanges": changes });
        self.tell("textDocument/didChange", params);
    }

    /// What is told of a file, once it is told again.
    fn faults(&mut self, name: &str) -> Vec<Value> {
        let wanted = self.uri(name);
        let is_told = |note: &Notification| {
            note.method == "textDocument/publishDiagnostics" && note.params["uri"] == *wanted
        };
        loop {
            if let Some(at) = self.told.iter().position(is_told) {
                let note = self.told.remove(at);
                return note.params["diagnostics"].as_array().expect("it is a list").clone();
            }
            let message = self.connection().receiver.recv_timeout(PATIENCE);
            if let Message::Notification(note) = message.expect("the server tells of faults") {
                self.told.push(note);
            }
        }
    }

    /// Waits for a request of the server.
    fn asked(&mut self, method: &str) {
        loop {
            let message = self.connection().receiver.recv_timeout(PATIENCE);
            match message.expect("the server asks") {
                Message::Request(request) if request.method == method => return,
                Message::Notification(note) => self.told.push(note),
                _ => {}
            }
        }
    }

    /// The answer to a question about the place behind `marked`, a stretch of a text.
    fn at(&mut self, method: &str, name: &str, text: &str, marked: &str) -> Value {
        let params = self.place(name, text, marked);
        self.ask(method, params).expect("it is answered")
    }

    fn place(&self, name: &str, text: &str, marked: &str) -> Value {
        let end = text.find(marked).unwrap_or_else(|| panic!("{marked} is there")) + marked.len();
        let line = text[..end].matches('\n').count();
        let column = text[..end].rsplit('\n').next().unwrap_or_default().encode_utf16().count();
        json!({
            "textDocument": { "uri": self.uri(name) },
            "position": { "line": line, "character": column },
        })
    }

    fn of(&mut self, method: &str, name: &str) -> Value {
        let params = json!({ "textDocument": { "uri": self.uri(name) } });
        self.ask(method, params).expect("it is answered")
    }

    /// What can be written at `|`.
    fn offered(&mut self, name: &str, text: &str) -> Vec<String> {
        let place = text.find('|').expect("the text says where");
        let plain = text.replace('|', "");
        self.change(name, &plain);
        let found = self.at("textDocument/completion", name, &plain, &plain[..place]);
        let items = found.as_array().expect("it is a list").iter();
        items.map(|item| item["label"].as_str().expect("it has a label").to_owned()).collect()
    }
}

impl Drop for Editor {
    fn drop(&mut self) {
        if thread::panicking() {
            return;
        }
        self.ask("shutdown", Value::Null).expect("a server can be stopped");
        self.tell("exit", Value::Null);
        self.connection = None;
        self.server.take().expect("it runs").join().expect("the server ends well");
    }
}

/// The text after edits that the editor was told to make in a file.
fn edited(text: &str, edits: &Value) -> String {
    let mut text = super::text::Text::new(text.to_owned());
    let mut edits: Vec<gen_lsp_types::TextEdit> =
        serde_json::from_value(edits.clone()).expect("they are edits");
    edits.sort_by_key(|edit| (edit.range.start.line, edit.range.start.character));
    for edit in edits.into_iter().rev() {
        text = text.edited(Some(edit.range), &edit.new_text, super::text::Units::Utf16);
    }
    text.text
}

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

#[test]
fn odd_texts_and_questions_are_answered() {
    let (mut editor, told) =
        Editor::speaking(&json!({ "general": { "positionEncodings": ["utf-8", "utf-16"] } }));
    assert_eq!(told["capabilities"]["positionEncoding"], "utf-8");
    for (i, text) in [
        "",
        "}",
        "edition",
        "edition \"2026\"\nexperiment é { let a = f(",
        "\u{feff}edition \"2026\"\r\nlet a = 1\r\n",
        "((((((((",
        "\0",
        "let \"\n\"\n// é",
    ]
    .iter()
    .enumerate()
    {
        let name = format!("odd {i}.ivx");
        editor.open(&name, text);
        editor.faults(&name);
        for method in [
            "documentSymbol",
            "foldingRange",
            "semanticTokens/full",
            "inlayHint",
            "codeLens",
            "formatting",
        ] {
            editor.of(&format!("textDocument/{method}"), &name);
        }
        for place in [(0, 0), (0, 99), (99, 0), (1, 5)] {
            let params = json!({
                "textDocument": { "uri": editor.uri(&name) },
                "position": { "line": place.0, "character": place.1 },
            });
            for method in ["hover", "completion", "definition", "references"] {
                let found = editor.ask(&format!("textDocument/{method}"), params.clone());
                found.unwrap_or_else(|error| panic!("{text:?} {method}: {error}"));
            }
        }
    }
    // Who cannot go from gap to gap is given words alone.
    let text = "edition \"2026\"\nlet a = argm\n";
    editor.open("plain.ivx", text);
    let offered = editor.at("textDocument/completion", "plain.ivx", text, "argm");
    let own = offered.as_array().expect("a list").iter().find(|item| item["label"] == "argmax");
    assert_eq!(own.expect("it is offered")["textEdit"]["newText"], "argmax");
    // What is not open, not a file, or nothing that is known.
    assert_eq!(editor.of("textDocument/hover", "none.ivx"), Value::Null);
    let params = json!({ "textDocument": { "uri": "untitled:Untitled-1" }, "position": { "line": 0, "character": 0 } });
    assert_eq!(editor.ask("textDocument/hover", params), Ok(Value::Null));
    let error = editor.ask("workspace/nonsense", json!({})).expect_err("it is not known");
    assert!(error.contains("not known"), "{error}");
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
