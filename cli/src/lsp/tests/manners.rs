//! What is said to editors that write, say and ask what nobody should.

use serde_json::{Value, json};

use super::Editor;

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
