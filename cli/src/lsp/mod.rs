//! `ivx lsp`: what an editor asks of specs while they are written.
//!
//! One thread reads messages, checks what has changed once no more wait, and answers; another says what is known of
//! each spec's nodes and of its last run.

mod complete;
mod faults;
mod greeting;
mod hints;
mod hover;
mod known;
mod names;
mod outline;
mod seen;
mod server;
mod stdio;
#[cfg(test)]
mod tests;
mod text;

use std::path::{Path, PathBuf};

use gen_lsp_types as lsp;
use lsp_server::Notification;
use percent_encoding::{AsciiSet, CONTROLS, percent_decode_str, utf8_percent_encode};
use serde_json::json;

use crate::{FAILED, OK, Trouble, project};

/// Serves one editor over standard input and output, until it says that it is done.
pub(crate) fn lsp() -> Result<u8, Trouble> {
    let (connection, threads) = stdio::stdio();
    // Of an editor that cannot be answered any more, nothing is waited for.
    let is_shut = server::serve(&connection)
        .map_err(|error| Trouble::Output(std::io::Error::other(error.to_string())))?;
    drop(connection);
    threads.join()?;
    Ok(if is_shut { OK } else { FAILED })
}

/// What the editor notes for who looks why something is not as it should be.
fn remark(words: &str) -> Notification {
    const WARNING: u8 = 2;
    let params = json!({ "type": WARNING, "message": words });
    Notification::new("window/logMessage".to_owned(), params)
}

/// What a path of an address is written with but for letters, digits and these.
const WRITTEN: &AsciiSet = &CONTROLS
    .add(b' ')
    .add(b'"')
    .add(b'#')
    .add(b'%')
    .add(b'<')
    .add(b'>')
    .add(b'?')
    .add(b'[')
    .add(b'\\')
    .add(b']')
    .add(b'^')
    .add(b'`')
    .add(b'{')
    .add(b'|')
    .add(b'}')
    .add(b':')
    .add(b'@')
    .add(b'=');

/// The address of a file.
fn uri(path: &Path) -> lsp::Uri {
    let path = path.to_string_lossy().replace('\\', "/");
    let root = if path.starts_with('/') { "" } else { "/" };
    lsp::Uri(format!("file://{root}{}", utf8_percent_encode(&path, WRITTEN)))
}

/// The file at an address, links resolved as far as it is there; none where it is of another kind, such as a text that was never saved.
fn path(uri: &lsp::Uri) -> Option<PathBuf> {
    let rest = uri.0.strip_prefix("file://")?;
    let from = rest.find('/')?;
    let path = percent_decode_str(&rest[from..]).decode_utf8().ok()?;
    // `/c:/x` is `c:/x`.
    let drive = path.as_bytes().get(2) == Some(&b':');
    let path = project::real(Path::new(if drive { &path[1..] } else { &*path }));
    // The root of all folders is no file.
    path.parent().is_some().then_some(path)
}
