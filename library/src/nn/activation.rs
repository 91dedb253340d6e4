//! What lies between the linear maps of a network.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_op::{Parts, declare, family};

/// A function without parameters, applied number by number.
///
/// Its slope must follow from its output alone, so that training keeps only outputs.
pub trait Activation: Debug + Send + Sync {
    /// The name that a spec and a stored network call it by.
    fn name(&self) -> &'static str;
    /// Replaces each number by the function's value.
    fn apply(&self, xs: &mut [f32]);
    /// Multiplies each gradient by the function's slope where it took the value `y`.
    fn backward(&self, ys: &[f32], gradients: &mut [f32]);
}

declare! {
    /// The hyperbolic tangent, `tanh(x)`.
    pub struct Tanh = "tanh" @ 1 {}
}

declare! {
    /// The rectified linear unit, `max(x, 0)`.
    pub struct Relu = "relu" @ 1 {}
}

declare! {
    /// The exponential linear unit: `x` above 0 and `exp(x) - 1` below.
    pub struct Elu = "elu" @ 1 {}
}

impl Activation for Tanh {
    fn name(&self) -> &'static str {
        "tanh"
    }

    fn apply(&self, xs: &mut [f32]) {
        for x in xs {
            *x = tanh(*x);
        }
    }

    fn backward(&self, ys: &[f32], gradients: &mut [f32]) {
        gradients.iter_mut().zip(ys).for_each(|(g, y)| *g *= 1.0 - y * y);
    }
}

/// `tanh` as an odd rational function: it runs in vector registers, and on every platform
/// by the same multiplications and additions, unlike the system's.
#[inline]
#[expect(clippy::excessive_precision, reason = "the coefficients as fitted")]
fn tanh(x: f32) -> f32 {
    const P: [f32; 7] = [
        -2.760_768_5e-16,
        2.000_187_9e-13,
        -8.604_671_5e-11,
        5.122_297_1e-8,
        1.485_722_36e-5,
        6.372_619_3e-4,
        4.893_524_6e-3,
    ];
    const Q: [f32; 4] = [1.198_258_4e-6, 1.185_347_06e-4, 2.268_434_6e-3, 4.893_525_2e-3];
    // Beyond this the quotient is 1 to single precision; the polynomials go on growing.
    let x = x.clamp(-7.998_812, 7.998_812);
    let square = x * x;
    let value = |coefficients: &[f32]| coefficients.iter().fold(0.0, |sum, c| sum * square + c);
    x * value(&P) / value(&Q)
}

impl Activation for Relu {
    fn name(&self) -> &'static str {
        "relu"
    }

    fn apply(&self, xs: &mut [f32]) {
        for x in xs {
            *x = x.max(0.0);
        }
    }

    fn backward(&self, ys: &[f32], gradients: &mut [f32]) {
        gradients.iter_mut().zip(ys).for_each(|(g, y)| *g = if *y > 0.0 { *g } else { 0.0 });
    }
}

impl Activation for Elu {
    fn name(&self) -> &'static str {
        "elu"
    }

    fn apply(&self, xs: &mut [f32]) {
        for x in xs {
            *x = if *x > 0.0 { *x } else { x.exp_m1() };
        }
    }

    fn backward(&self, ys: &[f32], gradients: &mut [f32]) {
        // Below 0 the slope exp(x) is one more than the value.
        gradients.iter_mut().zip(ys).for_each(|(g, y)| *g *= if *y > 0.0 { 1.0 } else { y + 1.0 });
    }
}

/// The activations, by name.
pub(crate) fn activations() -> &'static Parts<dyn Activation> {
    static TABLE: LazyLock<Parts<dyn Activation>> = LazyLock::new(|| {
        Parts::<dyn Activation>::new()
            .with(|x: Tanh| Box::new(x))
            .with(|x: Relu| Box::new(x))
            .with(|x: Elu| Box::new(x))
    });
    &TABLE
}

family!(dyn Activation, "Activation", activations);

#[cfg(test)]
mod tests {
    use ivx_op::Part;

    use super::*;

    fn grid() -> Vec<f32> {
        (-4000_i16..=4000).map(|i| f32::from(i) / 200.0).collect()
    }

    #[test]
    fn tanh_agrees_with_double_precision() {
        for x in grid() {
            let exact = f64::from(x).tanh();
            assert!((f64::from(tanh(x)) - exact).abs() <= 4e-7 * exact.abs(), "at {x}");
            assert!(tanh(x).abs() <= 1.0);
        }
        assert!(tanh(f32::NAN).is_nan());
    }

    #[test]
    fn hand_worked_values() {
        let apply = |activation: &dyn Activation| {
            let mut xs = [-1.0, 0.0, 2.0];
            activation.apply(&mut xs);
            xs
        };
        assert_eq!(apply(&Relu {}), [0.0, 0.0, 2.0]);
        // e⁻¹ − 1
        assert_eq!(apply(&Elu {}), [-0.632_120_55, 0.0, 2.0]);
    }

    #[test]
    fn slopes_agree_with_central_differences() {
        for name in ["tanh", "relu", "elu"] {
            let activation = activations().build(&Part::new(name)).unwrap();
            assert_eq!(activation.name(), name);
            let h = 1.0 / 128.0;
            for x in [-3.0_f32, -1.0, -0.25, 0.25, 1.0, 3.0] {
                let mut ys = [x - h, x, x + h];
                activation.apply(&mut ys);
                let mut slope = [2.0];
                activation.backward(&ys[1..2], &mut slope);
                let difference = (ys[2] - ys[0]) / h;
                assert!((slope[0] - difference).abs() < 2e-4, "{name} at {x}");
            }
        }
    }
}
