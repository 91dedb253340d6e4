//! Descriptions given on the command line.

use ivx_op::Lit;

use crate::ast::{Expr, ExprKind, ItemKind};
use crate::parse;

/// A number, string, truth value or list of them; `None` for any other text.
#[must_use]
pub fn parse_literal(text: &str) -> Option<Lit> {
    let (ast, diagnostics) = parse(&format!("edition \"2026\"\nparam value: Int = {text}"), 0);
    match &ast.items[..] {
        [item] if diagnostics.is_empty() => match &item.kind {
            ItemKind::Param { value, .. } => literal(value),
            _ => None,
        },
        _ => None,
    }
}

fn literal(expr: &Expr) -> Option<Lit> {
    Some(match &expr.kind {
        ExprKind::Bool(b) => Lit::Bool(*b),
        ExprKind::Int(n) => Lit::Int(*n),
        ExprKind::Float(x) => Lit::Real(*x),
        ExprKind::Str(text) => Lit::Text(text.clone()),
        ExprKind::List(items) => Lit::List(items.iter().map(literal).collect::<Option<_>>()?),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_plain_data_is_taken() {
        assert_eq!(parse_literal("16"), Some(Lit::Int(16)));
        assert_eq!(parse_literal(" -4e-4 "), Some(Lit::Real(-4e-4)));
        assert_eq!(parse_literal("[true, false]"), Some(vec![true, false].into()));
        assert_eq!(parse_literal("\"a b\""), Some("a b".into()));
        for other in ["", "wcm()", "1 2", "3 let a = 4", "n", "1 + 1"] {
            assert_eq!(parse_literal(other), None, "{other}");
        }
    }
}
