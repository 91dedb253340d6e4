//! What arithmetic and mathematics make of numbers that are known before anything runs.

use ivx_op::{Lit, Maths};

use super::WHOLE;
use crate::ast::BinaryOp;
pub(super) use crate::literal::inexact;

/// What `join` makes of each item of the lists among some descriptions, with what is no list; of these alone,
/// if there is none.
pub(super) fn each(
    of: &[Lit],
    join: &impl Fn(&[&Lit]) -> Result<Lit, String>,
) -> Result<Lit, String> {
    let lengths = of.iter().filter_map(|lit| match lit {
        Lit::List(items) => Some(items.len()),
        _ => None,
    });
    let lengths: Vec<usize> = lengths.collect();
    let Some(n) = lengths.first() else { return join(&of.iter().collect::<Vec<_>>()) };
    if let Some(other) = lengths.iter().find(|other| *other != n) {
        return Err(format!("a list of {n} does not go with one of {other}"));
    }
    let item = |lit: &Lit, i: usize| match lit {
        Lit::List(items) => items[i].clone(),
        other => other.clone(),
    };
    let items = (0..*n).map(|i| each(&of.iter().map(|lit| item(lit, i)).collect::<Vec<_>>(), join));
    items.collect::<Result<_, _>>().map(Lit::List)
}

/// The value of `+ - * /`.
pub(super) fn arithmetic(op: BinaryOp, left: &Lit, right: &Lit) -> Result<Lit, String> {
    if let (Lit::Int(a), Lit::Int(b)) = (left, right) {
        let whole = match op {
            BinaryOp::Add => a.checked_add(*b),
            BinaryOp::Sub => a.checked_sub(*b),
            BinaryOp::Mul => a.checked_mul(*b),
            _ => return real(op, left, right),
        };
        return whole.map(Lit::Int).ok_or_else(|| format!("{a} {} {b} overflows", op.symbol()));
    }
    real(op, left, right)
}

fn real(op: BinaryOp, left: &Lit, right: &Lit) -> Result<Lit, String> {
    let [a, b] = [float(left)?, float(right)?];
    let value = match op {
        BinaryOp::Add => a + b,
        BinaryOp::Sub => a - b,
        BinaryOp::Mul => a * b,
        BinaryOp::Div => a / b,
        other => unreachable!("`{}` is no arithmetic", other.symbol()),
    };
    let finite = value.is_finite().then_some(Lit::Real(value));
    finite.ok_or_else(|| format!("{left} {} {right} is not finite", op.symbol()))
}

/// The value of a function, of lists item by item.
pub(super) fn maths(maths: Maths, of: &[Lit]) -> Result<Lit, String> {
    match (maths, of) {
        (Maths::Where, [Lit::Bool(holds), one, other]) => {
            Ok(if *holds { one } else { other }.clone())
        }
        _ => each(of, &|of| of_numbers(maths, of)),
    }
}

fn of_numbers(maths: Maths, of: &[&Lit]) -> Result<Lit, String> {
    let whole = of.iter().map(|lit| if let Lit::Int(n) = lit { Some(*n) } else { None });
    if let Some(n) = whole.collect::<Option<Vec<i64>>>() {
        match maths {
            Maths::Abs if n[0] != i64::MIN => return Ok(Lit::Int(n[0].abs())),
            Maths::Sign => return Ok(Lit::Int(n[0].signum())),
            Maths::Minimum => return Ok(Lit::Int(n[0].min(n[1]))),
            Maths::Maximum => return Ok(Lit::Int(n[0].max(n[1]))),
            Maths::Clip if n[1] <= n[2] => return Ok(Lit::Int(n[0].clamp(n[1], n[2]))),
            Maths::Floor | Maths::Ceil | Maths::Round => return Ok(Lit::Int(n[0])),
            _ => {}
        }
    }
    let told = || {
        let of: Vec<String> = of.iter().map(ToString::to_string).collect();
        format!("{}({})", maths.name(), of.join(", "))
    };
    let x = of.iter().map(|lit| float(lit)).collect::<Result<Vec<f64>, _>>()?;
    let value = maths.of(&x);
    match maths {
        _ if value.is_nan() => Err(format!("{} is not a number", told())),
        _ if value.is_infinite() => Err(format!("{} is not finite", told())),
        #[expect(clippy::cast_possible_truncation, reason = "only what is whole and small")]
        Maths::Floor | Maths::Ceil | Maths::Round if value.abs() < WHOLE => {
            Ok(Lit::Int(value as i64))
        }
        Maths::Floor | Maths::Ceil | Maths::Round => {
            Err(format!("{} is too large to be a whole number", told()))
        }
        _ => Ok(Lit::Real(value)),
    }
}

fn float(lit: &Lit) -> Result<f64, String> {
    match inexact(lit) {
        Some(n) => Err(format!("no Float is {n}, which would be rounded")),
        None => Ok(lit.as_f64().expect("a number")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arithmetic_without_a_result_is_an_error() {
        let check = |op, a: Lit, b: Lit| arithmetic(op, &a, &b);
        assert_eq!(check(BinaryOp::Sub, 6.into(), 8.into()), Ok(Lit::Int(-2)));
        assert_eq!(check(BinaryOp::Div, 1.into(), 4.into()), Ok(Lit::Real(0.25)));
        assert!(check(BinaryOp::Div, 1.into(), 0.into()).is_err());
        assert!(check(BinaryOp::Mul, i64::MAX.into(), 2.into()).is_err());
    }

    #[test]
    fn whole_numbers_stay_whole_where_they_can() {
        let check = |name: &str, of: &[Lit], expected: Result<Lit, &str>| {
            let value = maths(Maths::called(name).expect(name), of);
            assert_eq!(value, expected.map_err(str::to_owned), "{name}");
        };
        check("abs", &[(-3).into()], Ok(3.into()));
        check("abs", &[(-3.5).into()], Ok(3.5.into()));
        check("clip", &[7.into(), 0.into(), 5.into()], Ok(5.into()));
        check("minimum", &[7.into(), 0.5.into()], Ok(0.5.into()));
        check("floor", &[(-2.5).into()], Ok((-3).into()));
        check("pow", &[2.into(), 10.into()], Ok(1024.0.into()));
        check("log", &[(-1.0).into()], Err("log(-1.0) is not a number"));
        check("exp", &[1_000.into()], Err("exp(1000) is not finite"));
        check("round", &[1e300.into()], Err("round(1e300) is too large to be a whole number"));
        let of = [true.into(), "a".into(), "b".into()];
        check("where", &of, Ok("a".into()));
    }

    #[test]
    fn lists_go_item_by_item() {
        let list = |values: &[i64]| Lit::List(values.iter().map(|n| Lit::Int(*n)).collect());
        let times = |a: Lit, b: Lit| each(&[a, b], &|of| arithmetic(BinaryOp::Mul, of[0], of[1]));
        assert_eq!(times(list(&[1, 2]), list(&[3, 4])), Ok(list(&[3, 8])));
        assert_eq!(times(list(&[1, 2]), 3.into()), Ok(list(&[3, 6])));
        assert_eq!(
            times(vec![list(&[1]), list(&[2])].into(), 3.into()),
            Ok(vec![list(&[3]), list(&[6])].into())
        );
        assert_eq!(times(list(&[]), 3.into()), Ok(list(&[])));
        let why = times(list(&[1]), list(&[3, 4])).unwrap_err();
        assert_eq!(why, "a list of 1 does not go with one of 2");
    }
}
