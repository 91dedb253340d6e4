//! Elementwise mathematics: what descriptions, arrays and functions of a spec's own share.

use serde::{Deserialize, Serialize};

/// A function of numbers, applied to each by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Maths {
    /// `|x|`.
    Abs,
    /// The smallest whole number that is at least `x`.
    Ceil,
    /// `x`, but not below the second number nor above the third.
    Clip,
    /// The cosine of radians.
    Cos,
    /// `eˣ`.
    Exp,
    /// The largest whole number that is at most `x`.
    Floor,
    /// The natural logarithm.
    Log,
    /// The larger of two.
    Maximum,
    /// The smaller of two.
    Minimum,
    /// `x` to the power of the second.
    Pow,
    /// The nearest whole number; of two, that away from 0.
    Round,
    /// 1 above 0, -1 below, 0 at 0.
    Sign,
    /// The sine of radians.
    Sin,
    /// The square root.
    Sqrt,
    /// The hyperbolic tangent.
    Tanh,
    /// The second number where the first is not 0, else the third.
    Where,
    /// The sum.
    Add,
    /// The difference.
    Sub,
    /// The product.
    Mul,
    /// The quotient.
    Div,
    /// Whether the first is less.
    Less,
    /// Whether the first is at most the second.
    AtMost,
    /// Whether both are equal.
    Equal,
}

/// All of them, by name; those with a sign of their own have that name as operations, too.
const ALL: [(&str, Maths, usize); 23] = [
    ("abs", Maths::Abs, 1),
    ("add", Maths::Add, 2),
    ("at_most", Maths::AtMost, 2),
    ("ceil", Maths::Ceil, 1),
    ("clip", Maths::Clip, 3),
    ("cos", Maths::Cos, 1),
    ("div", Maths::Div, 2),
    ("equal", Maths::Equal, 2),
    ("exp", Maths::Exp, 1),
    ("floor", Maths::Floor, 1),
    ("less", Maths::Less, 2),
    ("log", Maths::Log, 1),
    ("maximum", Maths::Maximum, 2),
    ("minimum", Maths::Minimum, 2),
    ("mul", Maths::Mul, 2),
    ("pow", Maths::Pow, 2),
    ("round", Maths::Round, 1),
    ("sign", Maths::Sign, 1),
    ("sin", Maths::Sin, 1),
    ("sqrt", Maths::Sqrt, 1),
    ("sub", Maths::Sub, 2),
    ("tanh_of", Maths::Tanh, 1),
    ("where", Maths::Where, 3),
];

impl Maths {
    /// The function that a spec calls by a name; none that it writes by a sign.
    #[must_use]
    pub fn called(name: &str) -> Option<Self> {
        let found = ALL.iter().find(|(own, ..)| *own == name).map(|(_, maths, _)| *maths);
        found.filter(|maths| *maths < Self::Add)
    }

    /// What it is called.
    ///
    /// # Panics
    /// Never: all have a name.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.entry().0
    }

    /// How many numbers it takes.
    #[must_use]
    pub fn arity(self) -> usize {
        self.entry().2
    }

    fn entry(self) -> (&'static str, Self, usize) {
        *ALL.iter().find(|(_, maths, _)| *maths == self).expect("all are listed")
    }

    /// Its value. What is not a number in what it takes is none in what it gives, and never counts as true.
    ///
    /// # Panics
    /// If there are not as many numbers as it takes.
    #[must_use]
    pub fn of(self, x: &[f64]) -> f64 {
        let truth = |holds: bool| {
            if x[0].is_nan() || x[1].is_nan() { f64::NAN } else { f64::from(u8::from(holds)) }
        };
        // The smaller and the larger of the standard library pass over what is not a number.
        let either = |first: bool| {
            if x[0].is_nan() || x[1].is_nan() { f64::NAN } else { x[usize::from(!first)] }
        };
        match self {
            Self::Abs => x[0].abs(),
            Self::Ceil => x[0].ceil(),
            Self::Clip if x[1].is_nan() || x[2].is_nan() => f64::NAN,
            Self::Clip if x[0] < x[1] => x[1],
            Self::Clip if x[0] > x[2] => x[2],
            Self::Clip => x[0],
            Self::Cos => x[0].cos(),
            Self::Exp => x[0].exp(),
            Self::Floor => x[0].floor(),
            Self::Log => x[0].ln(),
            Self::Maximum => either(x[0] >= x[1]),
            Self::Minimum => either(x[0] <= x[1]),
            Self::Pow => x[0].powf(x[1]),
            Self::Round => x[0].round(),
            Self::Sign if x[0] == 0.0 || x[0].is_nan() => x[0],
            Self::Sign => x[0].signum(),
            Self::Sin => x[0].sin(),
            Self::Sqrt => x[0].sqrt(),
            Self::Tanh => x[0].tanh(),
            Self::Where if x[0].is_nan() => f64::NAN,
            Self::Where => x[if x[0] == 0.0 { 2 } else { 1 }],
            Self::Add => x[0] + x[1],
            Self::Sub => x[0] - x[1],
            Self::Mul => x[0] * x[1],
            Self::Div => x[0] / x[1],
            Self::Less => truth(x[0] < x[1]),
            Self::AtMost => truth(x[0] <= x[1]),
            Self::Equal => truth(x[0] == x[1]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_its_own() {
        let check = |name: &str, x: &[f64], expected: f64| {
            let maths = Maths::called(name).expect(name);
            assert_eq!((maths.name(), maths.arity()), (name, x.len()));
            let value = maths.of(x);
            assert!((value - expected).abs() < 1e-15, "{name}: {value}");
        };
        check("abs", &[-1.5], 1.5);
        check("ceil", &[-1.5], -1.0);
        check("clip", &[3.0, 0.0, 2.0], 2.0);
        check("clip", &[-3.0, 0.0, 2.0], 0.0);
        check("cos", &[0.0], 1.0);
        check("exp", &[1.0], std::f64::consts::E);
        check("floor", &[-1.5], -2.0);
        check("log", &[std::f64::consts::E], 1.0);
        check("maximum", &[1.0, 2.0], 2.0);
        check("minimum", &[1.0, 2.0], 1.0);
        check("pow", &[2.0, -1.0], 0.5);
        check("round", &[-2.5], -3.0);
        check("sign", &[-0.5], -1.0);
        check("sign", &[0.0], 0.0);
        check("sin", &[std::f64::consts::FRAC_PI_2], 1.0);
        check("sqrt", &[9.0], 3.0);
        check("tanh_of", &[0.5], 0.462_117_157_260_009_76);
        check("where", &[1.0, 2.0, 3.0], 2.0);
        check("where", &[0.0, 2.0, 3.0], 3.0);
        assert_eq!((Maths::called("add"), Maths::called("nothing")), (None, None));
    }

    #[test]
    fn what_is_not_a_number_never_vanishes() {
        for (name, maths, arity) in ALL {
            for place in 0..arity {
                let mut x = vec![0.5; arity];
                x[place] = f64::NAN;
                // What is not chosen does not count.
                let unchosen = maths == Maths::Where && place == 2;
                assert_eq!(maths.of(&x).is_nan(), !unchosen, "{name} at {place}");
            }
        }
    }
}
