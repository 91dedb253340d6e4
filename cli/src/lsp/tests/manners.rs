//! What is said to editors that write, say and ask what nobody should.

use std::thread;

use lsp_server::{Connection, Message, Notification, Request};
use serde_json::{Value, json};

use super::super::server::serve;
use super::{Editor, PATIENCE, SPEC};

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
    let text = "edition \"2026\"\nuse \"x.ivx\"\n";
    let document = json!({ "uri": "file:///", "languageId": "ivx", "version": 1, "text": text });
    editor.tell("textDocument/didOpen", json!({ "textDocument": document }));
    let error = editor.ask("workspace/nonsense", json!({})).expect_err("it is not known");
    assert!(error.contains("not known"), "{error}");
}

#[test]
fn what_says_nothing_is_noted_and_changes_nothing() {
    let mut editor = Editor::new();
    editor.open("gaps.ivx", SPEC);
    assert_eq!(editor.faults("gaps.ivx"), [] as [Value; 0]);
    let own = editor.uri("gaps.ivx");
    let before =
        json!({ "start": { "line": -1, "character": 0 }, "end": { "line": 0, "character": 0 } });
    let mut check = |method: &str, params: Value| {
        editor.told.clear();
        editor.tell(method, params.clone());
        let said = editor.at("textDocument/hover", "gaps.ivx", SPEC, "axis k");
        assert!(!said.is_null(), "{params}");
        let noted = |note: &Notification| note.method == "window/logMessage";
        assert!(editor.told.iter().any(noted), "{params}: {:?}", editor.told);
    };
    for method in ["didOpen", "didChange", "didClose"] {
        for params in [Value::Null, json!(3), json!({}), json!({ "textDocument": { "uri": 3 } })] {
            check(&format!("textDocument/{method}"), params);
        }
    }
    let text = json!({ "uri": own, "version": 2 });
    let changes = json!([{ "range": before, "text": "" }]);
    check("textDocument/didChange", json!({ "textDocument": text, "contentChanges": changes }));
    // Not every editor counts.
    let changes = json!([{ "range": null, "text": "}" }]);
    let text = json!({ "uri": own, "version": null });
    let params = json!({ "textDocument": text, "contentChanges": changes });
    editor.tell("textDocument/didChange", params);
    assert!(!editor.faults("gaps.ivx").is_empty());
}

#[test]
fn before_it_begins_and_after_it_ends_nothing_is_answered() {
    let (here, there) = Connection::memory();
    let server = thread::spawn(move || serve(&there).expect("the editor is there"));
    let ask = |method: &str, params: Value| {
        let request = Request { id: 1.into(), method: method.to_owned(), params };
        here.sender.send(request.into()).expect("the server listens");
        match here.receiver.recv_timeout(PATIENCE).expect("the server answers") {
            Message::Response(response) => response.response_result.map_err(|error| error.code),
            other => panic!("{other:?} is no answer"),
        }
    };
    assert_eq!(ask("shutdown", Value::Null), Err(-32002));
    // What is not understood of the other side is nothing that it can.
    let told = ask("initialize", json!({ "capabilities": { "general": 5 }, "processId": "x" }));
    assert_eq!(told.expect("it begins")["capabilities"]["positionEncoding"], "utf-16");
    assert_eq!(ask("textDocument/hover", Value::Null), Ok(Value::Null));
    assert_eq!(ask("shutdown", Value::Null), Ok(Value::Null));
    assert_eq!(ask("textDocument/hover", Value::Null), Err(-32600));
    let exit = Notification { method: "exit".to_owned(), params: Value::Null };
    here.sender.send(exit.clone().into()).expect("the server listens");
    assert!(server.join().expect("the server ends well"));
    // Who ends it without a word has not shut it down.
    for begun in [false, true] {
        let (here, there) = Connection::memory();
        let params = json!({ "capabilities": {} });
        let request = Request { id: 1.into(), method: "initialize".to_owned(), params };
        let first = begun.then(|| request.into());
        for message in first.into_iter().chain([Message::from(exit.clone())]) {
            here.sender.send(message).expect("the server listens");
        }
        assert!(!serve(&there).expect("the editor is there"));
    }
}
