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
    use super::*;

    #[test]
    fn each_sign_is_its_own() {
        let ctx = Ctx { op: "", seed: 0, member: None };
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
