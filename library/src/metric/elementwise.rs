//! Functions of each number of a measure.

use ivx_op::{Array, Ctx, Maths, One, Op, OpError, declare};

use super::broadcast::broadcast;

macro_rules! of_one {
    ($($(#[doc = $doc:literal])+ $ty:ident = $name:literal;)+) => {$(
        declare! {
            $(#[doc = $doc])+
            pub struct $ty = $name @ 1 -> Array [like x] {
                /// Of what.
                x: One<Array>;
            }
        }

        impl Op for $ty {
            fn run(&self, _: &Ctx) -> Result<Array, OpError> {
                let values = self.x.values.iter().map(|x| Maths::$ty.of(&[*x])).collect();
                Ok(Array { dims: self.x.dims.clone(), values })
            }
        }
    )+};
}

of_one! {
    /// The absolute value.
    Abs = "abs";
    /// The smallest whole number that is not below.
    Ceil = "ceil";
    /// The cosine of radians.
    Cos = "cos";
    /// The exponential.
    Exp = "exp";
    /// The largest whole number that is not above.
    Floor = "floor";
    /// The natural logarithm: NaN below 0, `-inf` at 0.
    Log = "log";
    /// The nearest whole number; of two, that away from 0.
    Round = "round";
    /// 1 above 0, -1 below, 0 at 0.
    Sign = "sign";
    /// The sine of radians.
    Sin = "sin";
    /// The square root: NaN below 0.
    Sqrt = "sqrt";
    /// The hyperbolic tangent; written `tanh(x)`, where `tanh()` is an activation.
    Tanh = "tanh_of";
}

macro_rules! of_several {
    ($($(#[doc = $doc:literal])+ $ty:ident = $name:literal {
        $($(#[doc = $arg_doc:literal])+ $arg:ident,)+
    })+) => {$(
        declare! {
            $(#[doc = $doc])+
            pub struct $ty = $name @ 1 -> Array [union] {
                $($(#[doc = $arg_doc])+ $arg: One<Array>;)+
            }
        }

        impl Op for $ty {
            fn run(&self, _: &Ctx) -> Result<Array, OpError> {
                each(Maths::$ty, &[$(&self.$arg.0),+])
            }
        }
    )+};
}

of_several! {
    /// A number that is not below `low` and not above `high`.
    Clip = "clip" {
        /// Of what.
        x,
        /// The lowest it may be.
        low,
        /// The highest it may be.
        high,
    }
    /// The larger of two numbers; written `max(a, b)`.
    Maximum = "maximum" {
        /// One.
        left,
        /// The other.
        right,
    }
    /// The smaller of two numbers; written `min(a, b)`.
    Minimum = "minimum" {
        /// One.
        left,
        /// The other.
        right,
    }
    /// A number to a power: NaN of a negative one to a power that is not whole.
    Pow = "pow" {
        /// Of what.
        x,
        /// The power.
        to,
    }
    /// One number where a condition is true, another where it is not; NaN where it is neither.
    Where = "where" {
        /// The condition: `a < b`, or what is 0 where it is not true.
        condition,
        /// The number where it is true.
        then,
        /// The number where it is not.
        otherwise,
    }
}

/// The function at each coordinate of any of the arrays; dimensions are matched by name.
fn each(maths: Maths, of: &[&Array]) -> Result<Array, OpError> {
    // All along the dimensions of all: what is added and taken away again is no number where one is infinite.
    let all = of.iter().try_fold(Array::scalar(0.0), |all, x| broadcast(&all, x, |_, _| 0.0))?;
    let spread = of.iter().map(|x| broadcast(&all, x, |_, x| x));
    let spread = spread.collect::<Result<Vec<Array>, _>>()?;
    let at = |i: usize| maths.of(&spread.iter().map(|x| x.values[i]).collect::<Vec<_>>());
    let values = (0..all.values.len()).map(at).collect();
    Ok(Array { dims: all.dims, values })
}

#[cfg(test)]
mod tests {
    use ivx_op::{Dim, Labels};

    use super::*;

    const CTX: Ctx = Ctx::new("", 0, None);

    fn over(name: &str, values: Vec<f64>) -> One<Array> {
        One(Array::series(Dim::new(name, Labels::count(values.len())), values))
    }

    #[test]
    fn every_number_is_seen_by_itself() {
        let x = || over("x", vec![-2.5, 0.0, f64::NAN]);
        let of = [
            Abs { x: x() }.run(&CTX),
            Floor { x: x() }.run(&CTX),
            Sign { x: x() }.run(&CTX),
            Round { x: x() }.run(&CTX),
        ];
        let values = of.map(|of| of.unwrap().values);
        assert!(values.iter().all(|values| values[2].is_nan()));
        assert_eq!(values.map(|v| v[0]), [2.5, -3.0, -1.0, -3.0]);
    }

    #[test]
    fn several_are_matched_by_the_names_of_their_dimensions() {
        let condition = over("a", vec![1.0, 0.0]);
        let (then, otherwise) =
            (over("b", vec![1.0, 2.0, f64::INFINITY]), One(Array::scalar(-1.0)));
        let chosen = Where { condition, then, otherwise }.run(&CTX).unwrap();
        assert_eq!(chosen.dims.iter().map(|dim| dim.name.as_str()).collect::<Vec<_>>(), ["a", "b"]);
        assert_eq!(chosen.values, [1.0, 2.0, f64::INFINITY, -1.0, -1.0, -1.0]);

        let clip = Clip {
            x: over("a", vec![-3.0, 0.5]),
            low: One(Array::scalar(0.0)),
            high: over("b", vec![0.25, 1.0]),
        };
        assert_eq!(clip.run(&CTX).unwrap().values, [0.0, 0.0, 0.25, 0.5]);
        let apart = Pow { x: over("a", vec![1.0]), to: over("a", vec![1.0, 2.0]) }.run(&CTX);
        assert!(apart.unwrap_err().to_string().contains("different labels along `a`"));
    }
}
