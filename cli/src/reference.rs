//! The reference: what the declarations say of every operation and part, as Markdown.

use std::collections::BTreeMap;

use ivx_library::registry;
use ivx_op::{ArgDecl, Decl, Registry, Role};

const INTRODUCTION: &str = "\
# Reference

Every operation and part that specs can use, as declared. `ivx ops` lists them, and `ivx ops NAME`
says the same of one. Operations are computed, each a node of the graph; parts are values inside
the arguments of operations. An argument with `=` has a default. Where an operation draws random
numbers, it varies over `seed`.
";

/// The reference, whole.
#[must_use]
pub fn reference() -> String {
    let mut text = INTRODUCTION.to_owned();
    for (title, decls) in groups(&registry()) {
        text.extend(["\n## ", &title, "\n"]);
        for decl in decls {
            let signature = decl.to_string();
            text.extend(["\n### `", decl.name, "`\n\n```text\n", &signature, "\n```\n\n"]);
            text += &body(decl);
        }
    }
    text
}

/// What is declared: the operations, and the parts of each family.
pub(crate) fn groups(registry: &Registry) -> Vec<(String, Vec<&Decl>)> {
    let (mut operations, mut rows) = (Vec::new(), Vec::new());
    let mut families: BTreeMap<&str, Vec<&Decl>> = BTreeMap::new();
    for decl in registry.decls() {
        match &decl.role {
            Role::Op(_) => operations.push(decl),
            Role::Part(family) => families.entry(family).or_default().push(decl),
            Role::Rows(_) => rows.push(decl),
        }
    }
    let parts = families.into_iter().map(|(family, decls)| (format!("Parts: {family}"), decls));
    let all = std::iter::once(("Operations".to_owned(), operations)).chain(parts);
    all.chain([("Coordinates of axes".to_owned(), rows)])
        .filter(|(_, decls)| !decls.is_empty())
        .collect()
}

/// What is said below the signature.
pub(crate) fn body(decl: &Decl) -> String {
    let mut text = String::new();
    for line in decl.docs.trim().lines() {
        text += line.strip_prefix(' ').unwrap_or(line);
        text.push('\n');
    }
    if !decl.args.is_empty() {
        text.push('\n');
    }
    for arg in &decl.args {
        text += &argument(arg);
    }
    if let Role::Op(out) = &decl.role
        && !out.fields.is_empty()
    {
        text += "\nIts fields:\n\n";
        for field in out.fields {
            let dims = if field.dims.is_empty() {
                String::new()
            } else {
                format!("[{}]", field.dims.join(", "))
            };
            let docs = field.docs.trim();
            text.extend(["- `", field.name, ": ", field.artifact, &dims, "`: ", docs, "\n"]);
        }
    }
    let drawn = if decl.stochastic { ", draws random numbers" } else { "" };
    text.extend(["\nVersion ", &decl.version.to_string(), drawn, ".\n"]);
    text
}

/// What is said of an argument, as an item of a list.
pub(crate) fn argument(arg: &ArgDecl) -> String {
    let mut text = format!("- `{}: {}`", arg.name, arg.kind);
    for (i, line) in arg.docs.trim().lines().map(str::trim).enumerate() {
        text += if i == 0 { ": " } else { "\n  " };
        text += line;
    }
    if let Some(range) = &arg.range {
        text.extend([" Range: ", &range.to_string(), &arg.in_unit(), "."]);
    } else if let Some(unit) = arg.unit {
        text.extend([" In ", unit, "."]);
    }
    if let Some(default) = &arg.default {
        text.extend([" Default: `", &default.to_string(), "`."]);
    }
    if arg.default.is_none() && arg.is_optional() {
        text += " May be left out.";
    }
    if arg.how {
        text += " It is in no key.";
    }
    text + "\n"
}

#[cfg(test)]
mod tests {
    use ivx_op::Lit;

    use super::*;

    #[test]
    fn an_argument_is_one_item() {
        let arg = ArgDecl {
            name: "alpha",
            docs: " The share\n kept.\n",
            kind: ivx_op::ArgKind::Literal(ivx_op::Ty::Float),
            default: Some(Lit::Real(0.5)),
            range: Some((0.0..=1.0).into()),
            unit: None,
            how: false,
        };
        let expected = "- `alpha: Float`: The share\n  kept. Range: from 0 to 1. Default: `0.5`.\n";
        assert_eq!(argument(&arg), expected);
        let arg = ArgDecl { unit: Some("mm"), default: None, ..arg };
        let expected = "- `alpha: Float`: The share\n  kept. Range: from 0 to 1 mm.\n";
        assert_eq!(argument(&arg), expected);
        let expected = "- `alpha: Float`: The share\n  kept. In mm.\n";
        assert_eq!(argument(&ArgDecl { range: None, ..arg.clone() }), expected);
        let expected = "- `alpha: Float`: The share\n  kept. In mm. It is in no key.\n";
        assert_eq!(argument(&ArgDecl { range: None, how: true, ..arg.clone() }), expected);
        let gather = ivx_op::Gather::Pointwise;
        let port = ivx_op::Port { artifact: "Agent", gather, takes: ivx_op::Takes::AtMostOne };
        let kind = ivx_op::ArgKind::Port(port);
        let expected = "- `alpha: Agent`: The share\n  kept. May be left out.\n";
        assert_eq!(argument(&ArgDecl { range: None, unit: None, kind, ..arg }), expected);
    }
}
