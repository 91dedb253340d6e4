//! Text to the same text in its one layout.

mod layout;
mod page;
#[cfg(test)]
pub(crate) mod tests;
mod token;
mod tree;

use crate::{Diagnostic, Severity, parse};
use layout::INDENT;
use page::Page;
use token::{Kind, Token};
use tree::Node;

/// The text of one file in its one layout: the tree and the comments stay, and of what lies
/// between tokens only the empty lines between items, at most one at a place.
///
/// # Errors
/// What is wrong with the text if it does not parse.
pub fn format(text: &str) -> Result<String, Vec<Diagnostic>> {
    let (ast, diagnostics) = parse(text, 0);
    if diagnostics.iter().any(|diagnostic| diagnostic.code.severity() == Severity::Error) {
        return Err(diagnostics);
    }
    let mut page = Page::default();
    items(&mut page, &mut &token::tokens(text, &ast)[..], 0);
    Ok(page.text())
}

/// Writes the items up to the end of the block, or of the file.
fn items<'t>(page: &mut Page<'t>, tokens: &mut &[Token<'t>], indent: usize) {
    let mut first = true;
    loop {
        let token = &tokens[0];
        for comment in &token.above {
            page.paragraph(indent, comment.blank && !first);
            page.comments(std::slice::from_ref(comment));
            first = false;
        }
        if token.kind != Kind::Item {
            return;
        }
        page.paragraph(indent, token.blank && !first);
        first = false;
        item(page, tokens, indent);
    }
}

fn item<'t>(page: &mut Page<'t>, tokens: &mut &[Token<'t>], indent: usize) {
    let is_experiment = tokens[0].text == "experiment";
    let mut nodes = tree::item(tokens, is_experiment);
    if let Some(Node::Leaf(word)) = nodes.first_mut() {
        // They are written already.
        word.above.clear();
    }
    layout::item(page, &nodes, indent);
    if !is_experiment {
        return;
    }
    page.token(&tokens[0], indent);
    *tokens = &tokens[1..];
    let empty = !page.ended() && tokens[0].above.is_empty() && tokens[0].kind == Kind::Close;
    if !empty {
        items(page, tokens, indent + INDENT);
        page.newline(indent);
    }
    page.token(&Token { above: Vec::new(), ..tokens[0].clone() }, indent);
    *tokens = &tokens[1..];
}
