//! Where lines are broken.
//!
//! What fits on one line stands on one. What does not is broken at its outermost place: an
//! expression before its loosest operators, a term within its widest brackets.

use super::page::{Page, Reach};
use super::token::{COMMA, Kind, Token};
use super::tree::{Entry, Group, Node, commented, each_token};

/// How far each line is set in from the one that it belongs to.
pub(super) const INDENT: usize = 4;

/// The most characters on a line.
const WIDTH: usize = 100;

/// Writes an item other than an experiment.
pub(super) fn item<'t>(page: &mut Page<'t>, nodes: &[Node<'t>], indent: usize) {
    let sign = |node: &Node| leaf_is(node, |kind| matches!(kind, Kind::Equals | Kind::ClaimColon));
    let head = nodes.iter().position(sign).map_or(nodes.len(), |sign| sign + 1);
    let (head, value) = nodes.split_at(head);
    term(page, head, indent, 0);
    let (Some(sign), Some(first)) = (head.last(), value.first()) else { return };
    if fits(page, value, 0) && first_token(first).above.is_empty() {
        return flat(page, value, indent);
    }
    let breaks_within = leaf_is(sign, |kind| kind == Kind::Equals)
        && loosest(value).is_none()
        && value.iter().any(Node::is_filled)
        && first_token(first).above.is_empty()
        && !page.ended();
    if breaks_within {
        term(page, value, indent, 0);
    } else {
        page.newline(indent + INDENT);
        expr(page, value, indent + INDENT, 0);
    }
}

/// Writes an expression, with its name if it has one.
///
/// - `indent`: of the line on which it begins.
/// - `tail`: how many characters must fit behind it.
fn expr<'t>(page: &mut Page<'t>, nodes: &[Node<'t>], indent: usize, tail: usize) {
    if fits(page, nodes, tail) {
        return flat(page, nodes, indent);
    }
    let Some(loosest) = loosest(nodes) else {
        return term(page, nodes, indent, tail);
    };
    let ends = |node: &Node| binds(node) == Some(loosest);
    let mut rest = nodes;
    let mut broken = false;
    while !rest.is_empty() {
        // An operator and the operand behind it; the first operand has none before it.
        let begun = rest.iter().take_while(|node| ends(node)).count();
        let end = rest[begun..].iter().position(ends).map_or(rest.len(), |end| begun + end);
        let (part, after) = rest.split_at(end);
        let tail = if after.is_empty() { tail } else { 0 };
        // Behind the last line of a broken operand, what fits goes on, and a margin behind any.
        let goes_on = broken || leaf_is(&rest[0], |kind| kind == Kind::Within);
        if begun > 0 && !(goes_on && fits(page, part, tail)) {
            page.newline(indent + INDENT);
        }
        let inner = if begun > 0 { indent + INDENT } else { indent };
        flat(page, &part[..begun], inner);
        if page.ended() {
            page.newline(inner);
        }
        broken = !fits(page, &part[begun..], tail);
        expr(page, &part[begun..], inner, tail);
        rest = after;
    }
}

/// Writes what can be broken within brackets only.
fn term<'t>(page: &mut Page<'t>, nodes: &[Node<'t>], indent: usize, tail: usize) {
    if fits(page, nodes, tail) {
        return flat(page, nodes, indent);
    }
    let widths = nodes.iter().map(|node| if node.is_filled() { width(node) } else { 0 });
    let widest = widths.enumerate().filter(|(_, width)| *width > 0);
    let widest = widest.max_by_key(|(index, width)| (*width, usize::MAX - index));
    // Where comments break the line, brackets are broken for their own width only.
    let widest = widest.map(|(index, _)| index).filter(|_| !commented(nodes));
    let mut base = indent;
    for (index, node) in nodes.iter().enumerate() {
        let (one, after) = (std::slice::from_ref(node), &nodes[index + 1..]);
        if page.ended() {
            base = indent + INDENT;
            page.newline(base);
        }
        match node {
            Node::Group(inner)
                if node.is_filled() && (Some(index) == widest || !fits(page, one, 0)) =>
            {
                group(page, inner, base, after.iter().map(width).sum::<usize>() + tail);
            }
            _ => flat(page, one, indent + INDENT),
        }
    }
}

/// Writes brackets with each entry on a line of its own, save that simple ones share lines.
///
/// - `indent`: of the line on which they open.
fn group<'t>(page: &mut Page<'t>, group: &Group<'t>, indent: usize, tail: usize) {
    let inner = indent + INDENT;
    page.token(&group.open, inner);
    if let Some(entry) = only_brackets(group) {
        expr(page, &entry.nodes, indent, tail + 1);
        return page.token(&group.close, indent);
    }
    // What is called or selected ends with its last argument, a collection on a line of its own.
    let hanging = group.open.text == "(" || group.selects;
    let fills = group.open.text != "{" || group.entries.iter().all(Entry::is_bare);
    let mut simple = false;
    for (index, entry) in group.entries.iter().enumerate() {
        let last = index + 1 == group.entries.len();
        let tail = if last && hanging { tail + 1 } else { 1 };
        let follows =
            simple && entry.is_simple() && !page.ended() && fits(page, &entry.nodes, tail);
        simple = fills && entry.is_simple();
        if !follows {
            page.newline(inner);
        }
        page.comments(&entry.above);
        expr(page, &entry.nodes, inner, tail);
        if !(last && hanging) {
            page.token(&COMMA, inner);
        }
        page.behind(entry.behind);
    }
    if !hanging || page.ended() || !group.close.above.is_empty() {
        page.newline(inner);
        page.comments(&group.close.above);
        page.newline(indent);
    }
    page.token(&Token { above: Vec::new(), ..group.close.clone() }, indent);
}

/// The only argument of a call if it is or ends with brackets that can be broken instead.
fn only_brackets<'a, 't>(group: &'a Group<'t>) -> Option<&'a Entry<'t>> {
    let [entry] = &group.entries[..] else { return None };
    let (last, before) = entry.nodes.split_last()?;
    let named = |node: &Node| leaf_is(node, |kind| matches!(kind, Kind::Operand | Kind::Colon));
    let comments = group.open.behind.is_some()
        || !entry.above.is_empty()
        || entry.behind.is_some()
        || !group.close.above.is_empty();
    let only = group.open.text == "(" && last.is_filled() && before.iter().all(named);
    (only && !comments).then_some(entry)
}

impl Entry<'_> {
    /// Whether it can share its line: it holds no calls but empty ones, and no nested brackets.
    fn is_simple(&self) -> bool {
        let simple = |node: &Node| match node {
            Node::Leaf(_) => true,
            Node::Group(group) => {
                let leaf = |node: &Node| matches!(node, Node::Leaf(_));
                let flat = group.open.text == "["
                    && group.entries.iter().all(|entry| entry.nodes.iter().all(leaf));
                group.entries.is_empty() || flat
            }
        };
        self.above.is_empty() && !commented(&self.nodes) && self.nodes.iter().all(simple)
    }

    /// Whether it is names only.
    fn is_bare(&self) -> bool {
        self.nodes.iter().all(|node| leaf_is(node, |kind| kind == Kind::Operand))
    }
}

/// Writes nodes on the line that is begun, if comments do not keep them from it.
fn flat<'t>(page: &mut Page<'t>, nodes: &[Node<'t>], indent: usize) {
    each_token(nodes, &mut |token| page.token(token, indent));
}

/// Whether nodes can go on with the line.
fn fits(page: &Page<'_>, nodes: &[Node<'_>], tail: usize) -> bool {
    let Some(first) = nodes.first() else { return true };
    let goes_on = !page.ended() && (page.at_start() || first_token(first).above.is_empty());
    let mut reach = page.reach();
    each_token(nodes, &mut |token| reach.add(token));
    goes_on && !commented(nodes) && reach.column + tail <= WIDTH
}

fn width(node: &Node<'_>) -> usize {
    let mut reach = Reach::default();
    each_token(std::slice::from_ref(node), &mut |token| reach.add(token));
    reach.column
}

/// How tightly the loosest operator outside of brackets binds.
fn loosest(nodes: &[Node<'_>]) -> Option<u8> {
    nodes.iter().filter_map(binds).min()
}

/// How tightly an operator binds, or the margin of a claim.
fn binds(node: &Node<'_>) -> Option<u8> {
    match node {
        Node::Leaf(Token { kind: Kind::Operator(binds), .. }) => Some(*binds),
        Node::Leaf(Token { kind: Kind::Within, .. }) => Some(0),
        _ => None,
    }
}

fn first_token<'a, 't>(node: &'a Node<'t>) -> &'a Token<'t> {
    match node {
        Node::Leaf(token) => token,
        Node::Group(group) => &group.open,
    }
}

fn leaf_is(node: &Node<'_>, is: impl Fn(Kind) -> bool) -> bool {
    matches!(node, Node::Leaf(token) if is(token.kind))
}
