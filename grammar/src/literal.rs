//! Descriptions given on the command line.

use ivx_op::{Lit, vanishes};

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

/// The value of a number as written, without its sign, or what is wrong with it and how to mend that.
///
/// What is written is what is meant, to the nearest number there is: a number that is none of these, or would
/// become 0, is refused.
pub(crate) fn number(written: &str, negative: bool) -> Result<Lit, (&'static str, String)> {
    let lone = |(i, byte): (usize, u8)| {
        let digit = |at: Option<usize>| {
            at.and_then(|at| written.as_bytes().get(at)).is_some_and(u8::is_ascii_digit)
        };
        byte == b'_' && !(digit(i.checked_sub(1)) && digit(Some(i + 1)))
    };
    if written.bytes().enumerate().any(lone) {
        let help = "write `1_000`, or no `_` at all".to_owned();
        return Err(("one `_` groups digits, and stands between two of them", help));
    }
    let sign = if negative { "-" } else { "" };
    let digits = format!("{sign}{}", written.replace('_', ""));
    let plain = digits.trim_start_matches('-');
    if plain.len() > 1 && plain.starts_with('0') && plain.as_bytes()[1].is_ascii_digit() {
        let rest = plain.trim_start_matches('0');
        let zero = if rest.starts_with(|c: char| c.is_ascii_digit()) { "" } else { "0" };
        return Err(("a number does not begin with 0", format!("write `{sign}{zero}{rest}`")));
    }
    if plain.bytes().all(|byte| byte.is_ascii_digit()) {
        let limits = format!("an `Int` lies from {} to {}", i64::MIN, i64::MAX);
        return digits.parse().map(Lit::Int).map_err(|_| ("the number is too large", limits));
    }
    let limits = || format!("a `Float` lies from {:e} to {:e}", f64::MIN, f64::MAX);
    let value: f64 = digits.parse().map_err(|_| ("this is no number", limits()))?;
    if !value.is_finite() {
        return Err(("the number is too large", limits()));
    }
    if vanishes(&digits) {
        let help =
            "the smallest `Float` above 0 is 5e-324; write `0.0` if that is meant".to_owned();
        return Err(("the number is so small that it would be 0", help));
    }
    Ok(Lit::Real(value))
}

/// The first whole number in a description that no `Float` equals.
pub(crate) fn inexact(lit: &Lit) -> Option<i64> {
    match lit {
        #[expect(clippy::cast_precision_loss, reason = "that is what is looked for")]
        #[expect(clippy::cast_possible_truncation, reason = "within 2^63")]
        Lit::Int(n) => (i128::from(*n) != *n as f64 as i128).then_some(*n),
        Lit::List(items) => items.iter().find_map(inexact),
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
    fn whole_numbers_are_exact_up_to_where_floats_leave_some_out() {
        let large = 1_i64 << 53;
        for (n, found) in
            [(large, None), (large + 1, Some(large + 1)), (large + 2, None), (i64::MIN, None)]
        {
            assert_eq!(inexact(&Lit::List(vec![Lit::Int(3), Lit::Int(n)])), found);
        }
        assert_eq!(inexact(&Lit::Int(i64::MAX)), Some(i64::MAX));
    }

    #[test]
    fn only_plain_data_is_taken() {
        assert_eq!(parse_literal("16"), Some(Lit::Int(16)));
        assert_eq!(parse_literal(" -4e-4 "), Some(Lit::Real(-4e-4)));
        assert_eq!(parse_literal("[true, false]"), Some(vec![true, false].into()));
        assert_eq!(parse_literal("\"a b\""), Some("a b".into()));
        for other in ["1__0", "1_", "007", "1e-400", "1e400", "9223372036854775808", "1_.5", "1._5"]
        {
            assert_eq!(parse_literal(other), None, "{other}");
        }
        assert_eq!(parse_literal("5e-324"), Some(Lit::Real(5e-324)));
        assert_eq!(parse_literal("0e-400"), Some(Lit::Real(0.0)));
        assert_eq!(parse_literal("-9223372036854775808"), Some(Lit::Int(i64::MIN)));
        for other in ["", "wcm()", "1 2", "3 let a = 4", "n", "1 + 1"] {
            assert_eq!(parse_literal(other), None, "{other}");
        }
    }
}
