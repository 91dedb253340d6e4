//! The server as an editor sees it.

mod answers;
mod files;
mod manners;

use std::fs;
use std::path::PathBuf;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use lsp_server::{Connection, Message, Notification, Request, Response};
use serde_json::{Value, json};

use super::server::serve;
use super::uri;

pub(super) const SPEC: &str = r#"edition "2026"

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
        let server = thread::spawn(move || assert!(serve(&there).expect("the editor is there")));
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
