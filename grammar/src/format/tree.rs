//! The tokens of an item as a tree of brackets.

use super::token::{COMMA, Comment, Kind, Token};

/// A token, or a pair of brackets with all between.
pub(super) enum Node<'t> {
    Leaf(Token<'t>),
    Group(Group<'t>),
}

/// A pair of brackets.
pub(super) struct Group<'t> {
    pub(super) open: Token<'t>,
    /// What commas part; a profile does without them.
    pub(super) entries: Vec<Entry<'t>>,
    pub(super) close: Token<'t>,
    /// Whether it selects from what is before it.
    pub(super) selects: bool,
}

/// What stands between two commas.
pub(super) struct Entry<'t> {
    /// The comments above its first token.
    pub(super) above: Vec<Comment<'t>>,
    pub(super) nodes: Vec<Node<'t>>,
    /// The comment behind it and its comma.
    pub(super) behind: Option<&'t str>,
}

/// The nodes of the item that `tokens` begin with, up to the next item or the end of the block.
/// The tokens of nodes are taken away.
///
/// - `head`: end with the `{` of an experiment, which is not taken.
pub(super) fn item<'t>(tokens: &mut &[Token<'t>], head: bool) -> Vec<Node<'t>> {
    let mut nodes = vec![leaf(tokens)];
    let ends = |token: &Token| match token.kind {
        Kind::Item | Kind::Close | Kind::End => true,
        _ => head && token.text == "{",
    };
    while !ends(&tokens[0]) {
        let node = node(tokens, nodes.last());
        nodes.push(node);
    }
    nodes
}

fn node<'t>(tokens: &mut &[Token<'t>], before: Option<&Node<'t>>) -> Node<'t> {
    if tokens[0].kind != Kind::Open {
        return leaf(tokens);
    }
    let operand = match before {
        Some(Node::Leaf(token)) => token.kind == Kind::Operand,
        Some(Node::Group(_)) => true,
        None => false,
    };
    Node::Group(group(tokens, operand))
}

/// - `operand`: whether an operand stands before the bracket.
fn group<'t>(tokens: &mut &[Token<'t>], operand: bool) -> Group<'t> {
    let open = take(tokens);
    let mut entries = Vec::new();
    while tokens[0].kind != Kind::Close {
        entries.push(entry(tokens, open.text == "{"));
    }
    let selects = operand && open.text == "[";
    Group { open, entries, close: take(tokens), selects }
}

/// - `braces`: whether a name that something is set to begins another entry.
fn entry<'t>(tokens: &mut &[Token<'t>], braces: bool) -> Entry<'t> {
    let mut nodes: Vec<Node> = Vec::new();
    let mut first = tokens[0].clone();
    let above = std::mem::take(&mut first.above);
    if first.kind != Kind::Open {
        *tokens = &tokens[1..];
        nodes.push(Node::Leaf(first));
    } else if let Node::Group(group) = node(tokens, None) {
        nodes.push(Node::Group(Group { open: first, ..group }));
    }
    let behind = loop {
        match tokens[0].kind {
            Kind::Comma => break take(tokens).behind,
            Kind::Close => break last(&mut nodes).behind.take(),
            _ if braces && tokens[1].kind == Kind::Equals => {
                break last(&mut nodes).behind.take();
            }
            _ => {
                let node = node(tokens, nodes.last());
                nodes.push(node);
            }
        }
    };
    Entry { above, nodes, behind }
}

fn leaf<'t>(tokens: &mut &[Token<'t>]) -> Node<'t> {
    Node::Leaf(take(tokens))
}

fn take<'t>(tokens: &mut &[Token<'t>]) -> Token<'t> {
    let (first, rest) = tokens.split_first().expect("an end token is never taken");
    *tokens = rest;
    first.clone()
}

fn last<'a, 't>(nodes: &'a mut [Node<'t>]) -> &'a mut Token<'t> {
    match nodes.last_mut().expect("an entry is not empty") {
        Node::Leaf(token) => token,
        Node::Group(group) => &mut group.close,
    }
}

impl Node<'_> {
    /// Whether something stands between its brackets, if only a comment.
    pub(super) fn is_filled(&self) -> bool {
        let Node::Group(group) = self else { return false };
        let comments = group.open.behind.is_some() || !group.close.above.is_empty();
        comments || !group.entries.is_empty()
    }
}

/// Whether comments keep the nodes from standing on one line. Those above the first token and
/// behind the last do not.
pub(super) fn commented(nodes: &[Node<'_>]) -> bool {
    let end = nodes.len() - 1;
    nodes.iter().enumerate().any(|(index, node)| match node {
        Node::Leaf(token) => own_line(token, index > 0, index < end),
        Node::Group(group) => {
            own_line(&group.open, index > 0, true)
                || own_line(&group.close, true, index < end)
                || group.entries.iter().any(Entry::commented)
        }
    })
}

fn own_line(token: &Token<'_>, above: bool, behind: bool) -> bool {
    above && !token.above.is_empty() || behind && token.behind.is_some()
}

impl Entry<'_> {
    fn commented(&self) -> bool {
        !self.above.is_empty() || self.behind.is_some() || commented(&self.nodes)
    }
}

/// Calls `visit` with each token as they stand on one line.
pub(super) fn each_token<'t>(nodes: &[Node<'t>], visit: &mut dyn FnMut(&Token<'t>)) {
    for node in nodes {
        match node {
            Node::Leaf(token) => visit(token),
            Node::Group(group) => {
                visit(&group.open);
                for (index, entry) in group.entries.iter().enumerate() {
                    if index > 0 {
                        visit(&COMMA);
                    }
                    each_token(&entry.nodes, visit);
                }
                visit(&group.close);
            }
        }
    }
}
