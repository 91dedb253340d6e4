//! Arithmetic on measures; `+ - * /` are written for these.

use ivx_op::{Array, Ctx, One, Op, OpError, declare};

use super::broadcast::broadcast;

macro_rules! binary {
    ($($(#[doc = $doc:literal])+ $ty:ident = $name:literal by $join:expr;)+) => {$(
        declare! {
            $(#[doc = $doc])+
            pub struct $ty = $name @ 1 -> Array [union] {
                /// The left side.
                left: One<Array>;
                /// The right side.
                right: One<Array>;
            }
        }

        impl Op for $ty {
            fn run(&self, _: &Ctx) -> Result<Array, OpError> {
                broadcast(&self.left, &self.right, $join)
            }
        }
    )+};
}

binary! {
    /// The sum; dimensions are matched by name.
    Add = "add" by |l, r| l + r;
    /// The difference; dimensions are matched by name.
    Sub = "sub" by |l, r| l - r;
    /// The product; dimensions are matched by name.
    Mul = "mul" by |l, r| l * r;
    /// The quotient; dimensions are matched by name.
    Div = "div" by |l, r| l / r;
    /// 1 where the left side is less than the right, otherwise 0; written `<`.
    Less = "less" by |l, r| truth(l, r, l < r);
    /// 1 where the left side is at most the right, otherwise 0; written `<=`.
    AtMost = "at_most" by |l, r| truth(l, r, l <= r);
    /// 1 where the left side is greater than the right, otherwise 0; written `>`.
    Greater = "greater" by |l, r| truth(l, r, l > r);
    /// 1 where the left side is at least the right, otherwise 0; written `>=`.
    AtLeast = "at_least" by |l, r| truth(l, r, l >= r);
    /// 1 where both sides are equal, otherwise 0; written `==`.
    Equal = "equal" by |l, r| truth(l, r, l == r);
    /// 1 where the sides differ, otherwise 0; written `!=`.
    Unequal = "unequal" by |l, r| truth(l, r, l != r);
}

/// A condition as a number; what is not a number is neither true nor false.
fn truth(l: f64, r: f64, holds: bool) -> f64 {
    if l.is_nan() || r.is_nan() { f64::NAN } else { f64::from(u8::from(holds)) }
}

declare! {
    /// The number with its sign turned.
    pub struct Neg = "neg" @ 1 -> Array [like x] {
        /// Of what.
        x: One<Array>;
    }
}

impl Op for Neg {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let values = self.x.values.iter().map(|x| -x).collect();
        Ok(Array { dims: self.x.dims.clone(), values })
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::{Dim, Labels};

    use super::*;

    #[test]
    fn each_comparison_is_its_own() {
        let ctx = Ctx::new("", 0, None);
        let x = Dim::new("x", Labels::Numbers(vec![0.0, 1.0, 2.0, 3.0]));
        let left = || One(Array::series(x.clone(), vec![1.0, 2.0, 3.0, f64::NAN]));
        let right = || One(Array::scalar(2.0));
        let results = [
            Less { left: left(), right: right() }.run(&ctx),
            AtMost { left: left(), right: right() }.run(&ctx),
            Greater { left: left(), right: right() }.run(&ctx),
            AtLeast { left: left(), right: right() }.run(&ctx),
            Equal { left: left(), right: right() }.run(&ctx),
            Unequal { left: left(), right: right() }.run(&ctx),
        ];
        let results = results.map(|result| result.unwrap().values);
        assert!(results.iter().all(|values| values[3].is_nan()));
        let told = results.map(|values| values[..3].to_vec());
        let expected = [
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 1.0, 1.0],
            [0.0, 1.0, 0.0],
            [1.0, 0.0, 1.0],
        ];
        assert_eq!(told, expected);
    }

    #[test]
    fn each_sign_is_its_own() {
        let ctx = Ctx::new("", 0, None);
        let (left, right) = (|| One(Array::scalar(6.0)), || One(Array::scalar(4.0)));
        let results = [
            Add { left: left(), right: right() }.run(&ctx),
            Sub { left: left(), right: right() }.run(&ctx),
            Mul { left: left(), right: right() }.run(&ctx),
            Div { left: left(), right: right() }.run(&ctx),
            Neg { x: left() }.run(&ctx),
        ];
        assert_eq!(results.map(|r| r.unwrap().values[0]), [10.0, 2.0, 24.0, 1.5, -6.0]);
    }
}
