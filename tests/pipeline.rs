//! The stages that run nothing, and the laws that hold for any text. `fuzz/` goes through them too.

use std::sync::Arc;

use ivx_engine::expand;
use ivx_grammar::ast::Ast;
use ivx_grammar::check::{File, Project, Settings, check, runs};
use ivx_grammar::{Outside, externals, format, known_as, parse};
use ivx_op::{Content, External, ExternalKind, Registry};

/// Most nodes of a program that is expanded here.
const MOST_NODES: usize = 5_000;

/// Parses, formats, checks and expands a text as a spec of one file.
///
/// # Panics
/// If a stage does, or breaks its law.
pub(crate) fn run(text: &str, registry: &Registry) {
    let (ast, faults) = parse(text, 0);
    let tree = tree(&ast);
    if runs(&faults) {
        lawful(text, &tree);
    }
    let file = File {
        path: "spec.ivx".to_owned(),
        stem: "spec".to_owned(),
        text: text.to_owned(),
        ast: ast.into(),
        ..File::default()
    };
    let mut project = Project { files: vec![file] };
    // What lies outside is found, whatever it is called.
    for (_, Outside { kind, name, .. }) in externals(&project, registry) {
        let found = Ok(Arc::new(external(kind, &name.value)));
        project.files[0].externals.insert(known_as(kind, &name), found);
    }
    let settings = Settings { max_nodes: Some(MOST_NODES), ..Settings::default() };
    let (spec, more) = check(&project, registry, &settings);
    if runs(&faults) && runs(&more) {
        let plan = expand(&spec, registry);
        assert!(plan.graph.node_count() <= MOST_NODES, "{text}");
    }
}

fn external(kind: ExternalKind, name: &str) -> External {
    let file = External::file(name.to_owned(), Vec::new(), false);
    match kind {
        ExternalKind::File => file,
        ExternalKind::Program => External { content: Content::Program(name.into()), ..file },
        ExternalKind::Variable => External::variable(name.to_owned(), None),
        ExternalKind::Foreign => External::foreign(name.to_owned(), "", name.into()),
    }
}

/// Checks that the layout of a text changes nothing but blanks and commas, keeps the tree, and is
/// its own.
fn lawful(text: &str, tree: &str) {
    let formatted = format(text).expect("what parses is formatted");
    assert!(words(text).eq(words(&formatted)), "{text}\n---\n{formatted}");
    assert_eq!(tree, self::tree(&parse(&formatted, 0).0), "{text}\n---\n{formatted}");
    assert_eq!(format(&formatted).as_ref(), Ok(&formatted), "{text}");
}

/// What layout leaves as it is.
fn words(text: &str) -> impl Iterator<Item = char> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    text.chars().filter(|c| !c.is_whitespace() && *c != ',')
}

/// The tree as text, without spans.
fn tree(ast: &Ast) -> String {
    let shown = format!("{ast:?}");
    let mut parts = shown.split("Span { ");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |tree, part| tree + part.split_once(" }").map_or(part, |(_, rest)| rest))
}
