//! Whether quotes stand where they may (RFC 4180): the reader takes them anywhere.

use super::place::line_at;

/// Whether each quote that begins a cell ends it.
///
/// # Errors
/// Where one does not, with the line.
pub(super) fn sound(bytes: &[u8], separator: u8) -> Result<(), String> {
    // Almost every file of numbers has none.
    if !bytes.contains(&b'"') {
        return Ok(());
    }
    let mut at = bytes.iter().position(|byte| *byte == b'"').unwrap_or(bytes.len());
    loop {
        let begins = match at.checked_sub(1).map(|before| bytes[before]) {
            None | Some(b'\n' | b'\r') => true,
            Some(byte) => byte == separator,
        };
        at = if begins { closed(bytes, at, separator)? } else { at + 1 };
        match bytes[at..].iter().position(|byte| *byte == b'"') {
            Some(more) => at += more,
            None => return Ok(()),
        }
    }
}

/// Behind the quoted cell that begins at `start`.
fn closed(bytes: &[u8], start: usize, separator: u8) -> Result<usize, String> {
    let mut at = start + 1;
    loop {
        let Some(more) = bytes[at..].iter().position(|byte| *byte == b'"') else {
            let line = line_at(bytes, start);
            return Err(format!("line {line} has a quote that does not end"));
        };
        at += more + 1;
        if bytes.get(at) == Some(&b'"') {
            at += 1;
            continue;
        }
        let rest = &bytes[at..];
        let blanks = rest.iter().take_while(|byte| matches!(byte, b' ' | b'\t')).count();
        // A tab may stand between cells.
        let end = |byte: Option<&u8>| match byte {
            None | Some(b'\n' | b'\r') => true,
            Some(byte) => *byte == separator,
        };
        if end(rest.first()) || end(rest.get(blanks)) {
            return Ok(at);
        }
        let behind = rest.iter().take_while(|byte| !matches!(byte, b'\n' | b'\r')).take(40);
        let behind: Vec<u8> = behind.copied().collect();
        let line = line_at(bytes, at);
        return Err(format!(
            "line {line} has `{}` behind a quote that ended",
            String::from_utf8_lossy(&behind)
        ));
    }
}
