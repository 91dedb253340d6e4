//! The loop: what the editor says and asks, and what it is told.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use crossbeam_channel::{Receiver, Sender, TryRecvError, select};
use gen_lsp_types as lsp;
use ivx_grammar::format;
use ivx_library::registry;
use ivx_op::Registry;
use lsp_server::{Connection, ErrorCode, Message, Notification, Request, Response};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::complete::complete;
use super::faults::{actions, faults};
use super::greeting::{Can, greet};
use super::hints::{hints, lenses};
use super::hover::hover;
use super::known::{Known, Question, answers};
use super::names::{definition, references, rename, renamed};
use super::outline::{folds, symbols, tokens};
use super::seen::{Called, Seen, called_as, see};
use super::text::{Text, Units};
use super::{path, remark};
use crate::load::{self, Parsed};

/// What goes wrong between server and editor.
pub(super) type Broken = Box<dyn std::error::Error + Send + Sync>;

/// Serves until the editor says that it is done, or is gone. Whether it was told to shut down, as it should be.
pub(super) fn serve(connection: &Connection) -> Result<bool, Broken> {
    let Some(can) = greet(connection)? else { return Ok(false) };
    let (ask, told) = answers();
    let mut server = Server {
        sender: &connection.sender,
        registry: Rc::new(registry()),
        units: can.units,
        open: BTreeMap::new(),
        called: Called::new(),
        seen: BTreeMap::new(),
        parsed: Parsed::new(),
        known: BTreeMap::new(),
        unknown: Known::default(),
        changed: BTreeSet::new(),
        told_of: BTreeMap::new(),
        ask,
        can,
        is_shut: false,
        n_asked: 0,
    };
    server.run(&connection.receiver, &told)
}

/// A text in the editor.
struct Open {
    version: Option<i32>,
    text: Text,
}

/// What was changed in a text.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Changed {
    text_document: Version,
    content_changes: Vec<Change>,
}

/// A text, and its version where the editor counts them.
#[derive(Deserialize)]
struct Version {
    uri: lsp::Uri,
    version: Option<i32>,
}

/// A text in place of what was somewhere, or of all.
#[derive(Deserialize)]
struct Change {
    range: Option<lsp::Range>,
    text: String,
}

struct Server<'c> {
    sender: &'c Sender<Message>,
    registry: Rc<Registry>,
    units: Units,
    /// By the path with its links resolved.
    open: BTreeMap<PathBuf, Open>,
    /// What was open at some time: what was told of it is taken back by the same name.
    called: Called,
    /// What is known of each text that is open.
    seen: BTreeMap<PathBuf, Seen>,
    /// Texts as they last read without a fault.
    parsed: Parsed,
    known: BTreeMap<PathBuf, Known>,
    /// Of what was not answered yet.
    unknown: Known,
    /// The texts that are to be checked again.
    changed: BTreeSet<PathBuf>,
    /// What the editor was told to be wrong with each file.
    told_of: BTreeMap<PathBuf, Vec<lsp::Diagnostic>>,
    ask: Sender<Question>,
    can: Can,
    /// Whether nothing but the end is waited for.
    is_shut: bool,
    /// How often the editor was asked something.
    n_asked: i32,
}

impl Server<'_> {
    fn run(
        &mut self,
        receiver: &Receiver<Message>,
        told: &Receiver<(PathBuf, Known)>,
    ) -> Result<bool, Broken> {
        loop {
            let message = if self.changed.is_empty() {
                select! {
                    recv(receiver) -> message => match message {
                        Ok(message) => message,
                        Err(_) => return Ok(true),
                    },
                    recv(told) -> known => {
                        let (path, known) = known?;
                        self.knows(path, known)?;
                        continue;
                    }
                }
            } else {
                match receiver.try_recv() {
                    Ok(message) => message,
                    Err(TryRecvError::Empty) => {
                        self.check()?;
                        continue;
                    }
                    Err(TryRecvError::Disconnected) => return Ok(true),
                }
            };
            match message {
                Message::Notification(note) if note.method == "exit" => return Ok(self.is_shut),
                Message::Request(request) => {
                    let response = self.answer(request)?;
                    self.sender.send(response.into())?;
                }
                Message::Notification(note) if !self.is_shut => {
                    let method = note.method.clone();
                    match self.hear(note) {
                        Err(error) if error.is::<serde_json::Error>() => {
                            let why = remark(&format!("`{method}` says nothing: {error}"));
                            self.sender.send(why.into())?;
                        }
                        heard => heard?,
                    }
                }
                Message::Notification(_) | Message::Response(_) => {}
            }
        }
    }

    /// Asks to be told of files that other programs change.
    fn watch(&mut self) -> Result<(), Broken> {
        let watcher = |glob: &str| json!({ "globPattern": glob });
        let watchers = [watcher("**/*.ivx"), watcher("**/*.ron")];
        let registration = json!({ "registrations": [{
            "id": "files",
            "method": "workspace/didChangeWatchedFiles",
            "registerOptions": { "watchers": watchers },
        }] });
        self.request("client/registerCapability", registration)
    }

    fn request(&mut self, method: &str, params: Value) -> Result<(), Broken> {
        self.n_asked += 1;
        let request = Request { id: self.n_asked.into(), method: method.to_owned(), params };
        Ok(self.sender.send(request.into())?)
    }

    fn hear(&mut self, note: Notification) -> Result<(), Broken> {
        match note.method.as_str() {
            "initialized" if self.can.watch => self.watch()?,
            "textDocument/didOpen" => {
                let lsp::DidOpenTextDocumentParams { text_document: own } =
                    serde_json::from_value(note.params)?;
                let Some(path) = path(&own.uri) else { return Ok(()) };
                let open = Open { version: Some(own.version), text: Text::new(own.text) };
                self.called.insert(path.clone(), own.uri);
                self.open.insert(path.clone(), open);
                self.touch(&path);
            }
            "textDocument/didChange" => {
                let Changed { text_document: own, content_changes } =
                    serde_json::from_value(note.params)?;
                let Some(path) = path(&own.uri) else { return Ok(()) };
                let Some(open) = self.open.get_mut(&path) else { return Ok(()) };
                open.version = own.version;
                for Change { range, text } in content_changes {
                    open.text = std::mem::take(&mut open.text).edited(range, &text, self.units);
                }
                self.touch(&path);
            }
            "textDocument/didClose" => {
                let lsp::DidCloseTextDocumentParams { text_document } =
                    serde_json::from_value(note.params)?;
                let Some(path) = path(&text_document.uri) else { return Ok(()) };
                self.touch(&path);
                self.open.remove(&path);
                self.seen.remove(&path);
                self.parsed.remove(&path);
                self.known.remove(&path);
                self.changed.remove(&path);
                self.publish()?;
            }
            "textDocument/didSave" | "workspace/didChangeWatchedFiles" => {
                self.changed.extend(self.open.keys().cloned());
            }
            _ => {}
        }
        Ok(())
    }

    /// A file is another than it was: whoever reads it is checked again.
    fn touch(&mut self, path: &Path) {
        let reads = |seen: &Seen| seen.loaded.read.contains_key(path);
        let readers = self.seen.iter().filter(|(_, seen)| reads(seen)).map(|(own, _)| own.clone());
        self.changed.extend(readers);
        if self.open.contains_key(path) {
            self.changed.insert(path.to_owned());
        }
    }

    fn from(&self) -> load::Open<'_> {
        let texts = self.open.iter().map(|(path, open)| (&**path, &*open.text.text)).collect();
        load::Open { texts, parsed: &self.parsed }
    }

    /// Checks what has changed, and tells the editor.
    fn check(&mut self) -> Result<(), Broken> {
        if self.changed.is_empty() {
            return Ok(());
        }
        // What is not needed any more is taken apart once the editor knows.
        let mut old = Vec::new();
        for path in std::mem::take(&mut self.changed) {
            // A text that cannot be read any more is seen as it was.
            let Ok(seen) = see(&path, (&self.from(), &self.called), &self.registry) else {
                continue;
            };
            seen.keep(&mut self.parsed);
            if seen.runs() {
                self.ask.send(Question::of(path.clone(), &seen))?;
            }
            old.extend(self.seen.insert(path, seen));
        }
        self.publish()
    }

    /// Tells what is wrong with each file, of which that is another than it was told to be.
    fn publish(&mut self) -> Result<(), Broken> {
        let mut all: BTreeMap<PathBuf, Vec<lsp::Diagnostic>> = BTreeMap::new();
        for path in self.told_of.keys().chain(self.open.keys()) {
            all.insert(path.clone(), Vec::new());
        }
        for seen in self.seen.values() {
            for (path, faults) in faults(seen, self.units) {
                let own = all.entry(path).or_default();
                for fault in faults {
                    if !own.contains(&fault) {
                        own.push(fault);
                    }
                }
            }
        }
        for (path, diagnostics) in &all {
            if self.told_of.get(path) == Some(diagnostics) {
                continue;
            }
            let open = self.open.get(path);
            let told = lsp::PublishDiagnosticsParams {
                uri: called_as(path, &self.called),
                version: open.and_then(|open| open.version),
                diagnostics: diagnostics.clone(),
            };
            self.tell("textDocument/publishDiagnostics", &told)?;
        }
        all.retain(|path, found| !found.is_empty() || self.open.contains_key(path));
        self.told_of = all;
        Ok(())
    }

    fn tell(&self, method: &str, params: &impl Serialize) -> Result<(), Broken> {
        let note = Notification::new(method.to_owned(), params);
        Ok(self.sender.send(note.into())?)
    }

    /// Something is known of a spec: what stands beside its text is shown anew.
    fn knows(&mut self, path: PathBuf, known: Known) -> Result<(), Broken> {
        if self.known.get(&path) == Some(&known) || !self.open.contains_key(&path) {
            return Ok(());
        }
        self.known.insert(path, known);
        if self.can.refresh {
            self.request("workspace/inlayHint/refresh", Value::Null)?;
        }
        Ok(())
    }

    fn answer(&mut self, request: Request) -> Result<Response, Broken> {
        let Request { id, method, params } = request;
        let fault = |id, code: ErrorCode, why| Response::new_err(id, code as i32, why);
        if self.is_shut {
            let why = format!("`{method}` comes after `shutdown`");
            return Ok(fault(id, ErrorCode::InvalidRequest, why));
        }
        if method == "shutdown" {
            self.is_shut = true;
            return Ok(Response::new_ok(id, Value::Null));
        }
        self.check()?;
        Ok(match self.answered(&method, &params) {
            Ok(Some(result)) => Response::new_ok(id, result),
            Ok(None) => {
                fault(id, ErrorCode::MethodNotFound, format!("`{method}` is not known here"))
            }
            Err(why) => fault(id, ErrorCode::RequestFailed, why),
        })
    }

    /// The answer to a request; none where it is of no kind that is known.
    fn answered(&self, method: &str, params: &Value) -> Result<Option<Value>, String> {
        let units = self.units;
        // Of a text that is not open, nothing is known.
        let uri = params.pointer("/textDocument/uri").or_else(|| params.get("uri"));
        let own = uri.and_then(Value::as_str).and_then(|uri| path(&lsp::Uri(uri.to_owned())));
        let seen = own.as_ref().and_then(|path| self.seen.get(path));
        let known = own.as_ref().and_then(|path| self.known.get(path)).unwrap_or(&self.unknown);
        let at = |seen: &Seen| -> Result<usize, String> {
            let place = params.get("position").cloned().unwrap_or_default();
            Ok(seen.text().offset(read(place)?, units))
        };
        let Some(seen) = seen else {
            let is_known = method.starts_with("textDocument/") || method.starts_with("ivx/");
            return Ok(is_known.then_some(Value::Null));
        };
        let found = match method {
            "textDocument/hover" => written(&hover(seen, known, &self.registry, at(seen)?, units)),
            "textDocument/completion" => {
                written(&complete(seen, &self.registry, at(seen)?, (units, self.can.snippets)))
            }
            "textDocument/definition" => written(&definition(seen, at(seen)?, units)),
            "textDocument/references" => written(&references(
                seen,
                at(seen)?,
                (&self.from(), &self.called),
                &self.registry,
                units,
            )),
            "textDocument/prepareRename" => written(&renamed(seen, at(seen)?, units)?),
            "textDocument/rename" => {
                let name = params.get("newName").and_then(Value::as_str).unwrap_or_default();
                written(&rename(
                    seen,
                    at(seen)?,
                    name,
                    ((&self.from(), &self.called), &self.registry, units),
                )?)
            }
            "textDocument/documentSymbol" => written(&symbols(seen, units)),
            "textDocument/foldingRange" => written(&folds(seen, units)),
            "textDocument/semanticTokens/full" => written(&tokens(seen, units)),
            "textDocument/inlayHint" => written(&hints(seen, known, units)),
            "textDocument/codeLens" => written(&lenses(seen, units)),
            "textDocument/codeAction" => {
                let range = params.get("range").cloned().unwrap_or_default();
                written(&actions(seen, read(range)?, units))
            }
            "textDocument/formatting" => written(&formatted(seen, units)),
            "ivx/report" => json!({ "path": known.report }),
            _ => return Ok(None),
        };
        Ok(Some(found))
    }
}

/// The text in its one layout, as one edit of what differs; of text that does not read, none.
fn formatted(seen: &Seen, units: Units) -> Option<Vec<lsp::TextEdit>> {
    let old = seen.text();
    let new = format(&old.text).ok()?;
    if new == old.text {
        return Some(Vec::new());
    }
    // Lines that stay are left alone, and with them the cursor and what is folded.
    let same = |pair: &(&str, &str)| pair.0 == pair.1;
    let (before, after) = (old.text.split_inclusive('\n'), new.split_inclusive('\n'));
    let start: usize =
        before.clone().zip(after.clone()).take_while(same).map(|(line, _)| line.len()).sum();
    let (rest, other) = (&old.text[start..], &new[start..]);
    let ends = rest.split_inclusive('\n').rev().zip(other.split_inclusive('\n').rev());
    let end: usize = ends.take_while(same).map(|(line, _)| line.len()).sum();
    let range =
        lsp::Range::new(old.position(start, units), old.position(old.text.len() - end, units));
    let with = other[..other.len() - end].to_owned();
    Some(vec![lsp::TextEdit::new(range, with)])
}

fn read<T: DeserializeOwned>(value: Value) -> Result<T, String> {
    serde_json::from_value(value).map_err(|error| error.to_string())
}

fn written(found: &impl Serialize) -> Value {
    serde_json::to_value(found).unwrap_or_default()
}
