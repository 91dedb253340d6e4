//! What can be written at a place.

use std::fs;
use std::path::Path;

use gen_lsp_types as lsp;
use ivx_grammar::{Around, Cursor, Sort, Span, cursor, names_at};
use ivx_op::{ArgKind, Decl, Registry, Role, Ty};

use super::seen::Seen;
use super::text::Units;
use crate::reference::{argument, body};

/// What begins an item, with what follows it; `$0` is where one goes on.
const ITEMS: [(&str, &str); 12] = [
    ("param", "param ${1:name}: ${2:Int} = $0"),
    ("axis", "axis ${1:name} = $0"),
    ("let", "let ${1:name} = $0"),
    ("measure", "measure ${1:name} = $0"),
    ("figure", "figure \"${1:name}\" = $0"),
    ("table", "table \"${1:name}\" = $0"),
    ("claim", "claim \"${1:words}\" : $0"),
    ("published", "published ${1:name} from \"$0\""),
    ("profile", "profile ${1:quick} { $0 }"),
    ("experiment", "experiment ${1:name} {\n    $0\n}"),
    ("use", "use \"$0\""),
    ("include", "include \"$0\""),
];

/// The words of the types of parameters that are no families of parts.
const TYPES: [&str; 5] = ["Bool", "Int", "Float", "Str", "List"];

/// What can be written at a byte of the spec's own text.
///
/// - `snippets`: whether the editor goes from gap to gap of what it writes.
pub(super) fn complete(
    seen: &Seen,
    registry: &Registry,
    at: usize,
    (units, snippets): (Units, bool),
) -> Vec<lsp::CompletionItem> {
    let text = seen.text();
    let here = cursor(&text.text, at);
    if here.comment {
        return Vec::new();
    }
    let range = lsp::Range::new(text.position(here.start, units), text.position(at, units));
    let mut items = offered(seen, registry, &here, at);
    for (rank, item) in items.iter_mut().enumerate() {
        let mut with = item.insert_text.take().unwrap_or_else(|| item.label.clone());
        if item.insert_text_format.is_some() && !snippets {
            (with, item.insert_text_format) = (item.label.clone(), None);
        }
        item.text_edit = Some(lsp::TextEdit::new(range, with).into());
        item.sort_text = Some(format!("{rank:05}"));
    }
    items
}

fn offered(seen: &Seen, registry: &Registry, here: &Cursor, at: usize) -> Vec<lsp::CompletionItem> {
    let names = names_at(&seen.loaded.project, 0, u32::try_from(at).unwrap_or(u32::MAX));
    let open = here.around.last();
    if here.quoted {
        return match open {
            Some(open) if open.is_match => labels(seen, &names, &open.head, &open.given),
            Some(open) if open.bracket == '[' => {
                let axis = open.name.as_deref().or_else(|| outer_axis(here));
                axis.map_or_else(Vec::new, |axis| labels(seen, &names, axis, &open.given))
            }
            _ if names_file(here) => files(&seen.paths[0], &seen.text().text[here.start..at]),
            _ => Vec::new(),
        };
    }
    if let Some(of) = &here.of {
        return fields(seen, registry, &names, of);
    }
    if here.item.is_empty() {
        return ITEMS.iter().map(|(word, snippet)| keyword(word, snippet)).collect();
    }
    if here.item == "param" && here.before == ":" {
        return types(registry);
    }
    let mut items = Vec::new();
    match open {
        Some(open) if open.bracket == '[' && open.fresh && !open.head.is_empty() => {
            let axes = names.iter().filter(|(.., sort)| *sort == Sort::Axis);
            return axes
                .map(|(name, ..)| named(name, "axis", lsp::CompletionItemKind::Enum))
                .collect();
        }
        Some(open) if open.bracket == '(' => {
            if let Some(decl) = registry.decl(&open.head) {
                items.extend(in_call(registry, decl, open));
            }
        }
        _ => {}
    }
    items.extend(names.iter().filter(|(.., sort)| *sort != Sort::Profile).map(
        |(name, span, sort)| {
            let kind = match sort {
                Sort::Axis => lsp::CompletionItemKind::Enum,
                Sort::Function => lsp::CompletionItemKind::Function,
                Sort::Param | Sort::Local => lsp::CompletionItemKind::Constant,
                Sort::Experiment => lsp::CompletionItemKind::Module,
                _ => lsp::CompletionItemKind::Variable,
            };
            let detail = seen.value(*span).map_or_else(String::new, |value| value.ty.clone());
            named(name, &detail, kind)
        },
    ));
    // Numbers of an axis and the like are written; what is computed is called.
    items.extend(registry.decls().map(call));
    items
}

/// The arguments that a call does not have yet, and what the argument at hand takes.
fn in_call(registry: &Registry, decl: &Decl, open: &Around) -> Vec<lsp::CompletionItem> {
    let at_hand = match &open.name {
        Some(name) => decl.arg(name),
        None => decl.args.get(open.index),
    };
    let mut items = Vec::new();
    if let Some(arg) = at_hand
        && let ArgKind::Literal(ty) = &arg.kind
    {
        items.extend(of_type(registry, ty));
    }
    if open.fresh && open.name.is_none() {
        let free = decl.args.iter().enumerate().filter(|(place, arg)| {
            *place >= open.index.min(decl.args.len())
                && !open.given.iter().any(|own| own == arg.name)
        });
        items.extend(free.map(|(_, arg)| lsp::CompletionItem {
            kind: Some(lsp::CompletionItemKind::Property),
            detail: Some(arg.kind.to_string()),
            documentation: Some(markdown(argument(arg))),
            insert_text: Some(format!("{}: ", arg.name)),
            ..labelled(&format!("{}:", arg.name))
        }));
    }
    items
}

/// What is of a type: the parts of its family, or its words.
fn of_type(registry: &Registry, ty: &Ty) -> Vec<lsp::CompletionItem> {
    match ty {
        Ty::Bool => ["true", "false"].map(|word| keyword(word, word)).into(),
        Ty::List(item) => of_type(registry, item),
        Ty::Part(family) => {
            let parts = registry.decls().filter(|decl| decl.family() == Some(family.as_str()));
            parts.map(call).collect()
        }
        _ => Vec::new(),
    }
}

/// A call of the library, ready to be given arguments.
fn call(decl: &Decl) -> lsp::CompletionItem {
    let snippet = if decl.args.is_empty() {
        format!("{}()", decl.name)
    } else {
        format!("{}($0)", decl.name)
    };
    lsp::CompletionItem {
        kind: Some(match decl.role {
            Role::Op(_) => lsp::CompletionItemKind::Function,
            _ => lsp::CompletionItemKind::Struct,
        }),
        detail: Some(decl.to_string()),
        documentation: Some(markdown(body(decl))),
        insert_text: Some(snippet),
        insert_text_format: Some(lsp::InsertTextFormat::Snippet),
        ..labelled(decl.name)
    }
}

/// The labels of an axis that were not given yet.
fn labels(
    seen: &Seen,
    names: &[(String, Span, Sort)],
    axis: &str,
    given: &[String],
) -> Vec<lsp::CompletionItem> {
    let declared = names.iter().find(|(name, _, sort)| name == axis && *sort == Sort::Axis);
    let value = declared.and_then(|(_, span, _)| seen.value(*span));
    let labels = value.map_or(&[][..], |value| &value.labels);
    let left = labels.iter().filter(|label| !given.contains(label));
    left.map(|label| named(label, axis, lsp::CompletionItemKind::EnumMember)).collect()
}

/// The axis of `gap[ke: ["..`, seen from the inner bracket.
fn outer_axis(here: &Cursor) -> Option<&str> {
    let outer = here.around.iter().rev().nth(1)?;
    (outer.bracket == '[').then_some(outer.name.as_deref()?)
}

/// What can stand behind the point of `of.`.
fn fields(
    seen: &Seen,
    registry: &Registry,
    names: &[(String, Span, Sort)],
    of: &str,
) -> Vec<lsp::CompletionItem> {
    let Some((_, span, sort)) = names.iter().find(|(name, ..)| name == of) else {
        return Vec::new();
    };
    let field = |name: &str, detail: &str| named(name, detail, lsp::CompletionItemKind::Field);
    let Some((item, _)) = seen.item(*span) else { return Vec::new() };
    match (&item.kind, sort) {
        (ivx_grammar::ast::ItemKind::Axis { fields, .. }, _) => {
            fields.iter().map(|own| field(&own.value, of)).collect()
        }
        (ivx_grammar::ast::ItemKind::Experiment { items, .. }, _) => {
            let own = items.iter().filter_map(ivx_grammar::declares);
            own.map(|(name, _)| field(&name.value, of)).collect()
        }
        _ => {
            let kind = seen.value(*span).map(|value| value.ty.clone()).unwrap_or_default();
            let makes = |decl: &&Decl| matches!(&decl.role, Role::Op(out) if out.artifact == kind && !out.fields.is_empty());
            let made = registry.decls().find(makes);
            let Some(Role::Op(out)) = made.map(|decl| &decl.role) else { return Vec::new() };
            out.fields.iter().map(|own| field(own.name, own.docs.trim())).collect()
        }
    }
}

/// Whether a string at the cursor names a file.
fn names_file(here: &Cursor) -> bool {
    match here.item.as_str() {
        "use" | "include" => {
            here.around.iter().all(|open| open.bracket == '{' && open.head == "experiment")
        }
        "published" => here.before == "from",
        _ => here.around.last().is_some_and(|open| open.bracket == '('),
    }
}

/// The files and folders that a path which is begun could go on with.
fn files(spec: &Path, begun: &str) -> Vec<lsp::CompletionItem> {
    const MOST: usize = 1_000;
    let (folder, _) = begun.rsplit_once('/').unwrap_or_default();
    let Some(beside) = spec.parent() else { return Vec::new() };
    let entries = fs::read_dir(beside.join(folder)).into_iter().flatten().flatten().take(MOST);
    let mut found: Vec<(bool, String)> = entries
        .map(|entry| {
            let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            (is_folder, entry.file_name().to_string_lossy().into_owned())
        })
        .filter(|(_, name)| !name.starts_with('.'))
        .collect();
    found.sort();
    let shown = |(is_folder, name): (bool, String)| {
        let prefix = if folder.is_empty() { String::new() } else { format!("{folder}/") };
        let (kind, end) = if is_folder {
            (lsp::CompletionItemKind::Folder, "/")
        } else {
            (lsp::CompletionItemKind::File, "")
        };
        named(&format!("{prefix}{name}{end}"), "", kind)
    };
    found.into_iter().map(shown).collect()
}

fn types(registry: &Registry) -> Vec<lsp::CompletionItem> {
    let mut families: Vec<&str> = registry.decls().filter_map(Decl::family).collect();
    families.sort_unstable();
    families.dedup();
    let all = TYPES.into_iter().chain(families);
    all.map(|name| named(name, "", lsp::CompletionItemKind::Class)).collect()
}

fn keyword(word: &str, snippet: &str) -> lsp::CompletionItem {
    lsp::CompletionItem {
        kind: Some(lsp::CompletionItemKind::Keyword),
        insert_text: Some(snippet.to_owned()),
        insert_text_format: Some(lsp::InsertTextFormat::Snippet),
        ..labelled(word)
    }
}

fn named(name: &str, detail: &str, kind: lsp::CompletionItemKind) -> lsp::CompletionItem {
    let detail = (!detail.is_empty()).then(|| detail.to_owned());
    lsp::CompletionItem { kind: Some(kind), detail, ..labelled(name) }
}

fn labelled(label: &str) -> lsp::CompletionItem {
    lsp::CompletionItem { label: label.to_owned(), ..lsp::CompletionItem::default() }
}

fn markdown(text: String) -> lsp::Documentation {
    lsp::MarkupContent::new(lsp::MarkupKind::Markdown, text).into()
}
