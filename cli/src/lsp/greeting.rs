//! What both sides say first: what they can do.

use gen_lsp_types as lsp;
use lsp_server::{Connection, ErrorCode, Message, Response};
use serde_json::{Value, json};

use super::outline::{KINDS, MODIFIERS};
use super::server::Broken;
use super::text::Units;

/// Tells the editor what the server can, and learns what the editor can; nothing of one that says no more before that.
pub(super) fn greet(connection: &Connection) -> Result<Option<Can>, Broken> {
    for message in &connection.receiver {
        match message {
            Message::Request(request) if request.method == "initialize" => {
                let can = Can::of(&request.params["capabilities"]);
                let about = json!({ "name": "ivx", "version": env!("CARGO_PKG_VERSION") });
                let told = json!({ "capabilities": capabilities(can.units), "serverInfo": about });
                connection.sender.send(Response::new_ok(request.id, told).into())?;
                return Ok(Some(can));
            }
            Message::Request(request) => {
                let message = format!("`initialize` comes before `{}`", request.method);
                let code = ErrorCode::ServerNotInitialized as i32;
                connection.sender.send(Response::new_err(request.id, code, message).into())?;
            }
            Message::Notification(note) if note.method == "exit" => break,
            Message::Notification(_) | Message::Response(_) => {}
        }
    }
    Ok(None)
}

/// What the editor can do that not every one can.
#[derive(Clone, Copy)]
pub(super) struct Can {
    /// In what it counts along a line.
    pub(super) units: Units,
    /// Tell of files that other programs change.
    pub(super) watch: bool,
    /// Show anew what stands beside a text.
    pub(super) refresh: bool,
    /// Go from gap to gap of what it writes.
    pub(super) snippets: bool,
}

impl Can {
    /// What is not said, or not understood, it cannot.
    fn of(capabilities: &Value) -> Self {
        let can = |path: &str| capabilities.pointer(path) == Some(&Value::Bool(true));
        Self {
            units: Units::agreed(capabilities.pointer("/general/positionEncodings")),
            watch: can("/workspace/didChangeWatchedFiles/dynamicRegistration"),
            refresh: can("/workspace/inlayHint/refreshSupport"),
            snippets: can("/textDocument/completion/completionItem/snippetSupport"),
        }
    }
}

/// What the server can do.
fn capabilities(units: Units) -> lsp::ServerCapabilities {
    let legend = lsp::SemanticTokensLegend {
        token_types: KINDS.map(str::to_owned).into(),
        token_modifiers: MODIFIERS.map(str::to_owned).into(),
    };
    let words = |words: &[&str]| Some(words.iter().map(ToString::to_string).collect());
    lsp::ServerCapabilities {
        position_encoding: Some(units.kind()),
        text_document_sync: Some(
            lsp::TextDocumentSyncOptions {
                open_close: Some(true),
                change: Some(lsp::TextDocumentSyncKind::Incremental),
                save: Some(true.into()),
                ..lsp::TextDocumentSyncOptions::default()
            }
            .into(),
        ),
        completion_provider: Some(lsp::CompletionOptions {
            trigger_characters: words(&["(", "[", "\"", ".", ":", ",", "/"]),
            ..lsp::CompletionOptions::default()
        }),
        hover_provider: Some(true.into()),
        definition_provider: Some(true.into()),
        references_provider: Some(true.into()),
        document_symbol_provider: Some(true.into()),
        code_action_provider: Some(true.into()),
        code_lens_provider: Some(lsp::CodeLensOptions::default()),
        document_formatting_provider: Some(true.into()),
        rename_provider: Some(
            lsp::RenameOptions { prepare_provider: Some(true), ..lsp::RenameOptions::default() }
                .into(),
        ),
        folding_range_provider: Some(true.into()),
        semantic_tokens_provider: Some(
            lsp::SemanticTokensOptions {
                legend,
                full: Some(true.into()),
                ..lsp::SemanticTokensOptions::default()
            }
            .into(),
        ),
        inlay_hint_provider: Some(true.into()),
        ..lsp::ServerCapabilities::default()
    }
}
