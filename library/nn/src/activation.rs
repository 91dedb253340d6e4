//! What lies between the linear maps of a network.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_op::{Part, Parts, declare, family};

use super::curve::Curve;

/// A function without parameters, applied number by number.
pub trait Activation: Debug + Send + Sync {
    /// The function.
    fn curve(&self) -> Curve;
}

declare! {
    /// The number itself.
    pub struct Identity = "identity" @ 1 {}
}

declare! {
    /// The rectified linear unit up to six, `min(max(x, 0), 6)`.
    pub struct Relu6 = "relu6" @ 1 {}
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

declare! {
    /// The logistic sigmoid, `1 / (1 + exp(-x))`.
    pub struct Sigmoid = "sigmoid" @ 1 {}
}

declare! {
    /// The smooth rectifier, `ln(1 + exp(x))`.
    pub struct Softplus = "softplus" @ 1 {}
}

declare! {
    /// The sigmoid linear unit, `x / (1 + exp(-x))`.
    pub struct Silu = "silu" @ 1 {}
}

macro_rules! activations {
    ($($part:ident),+) => {
        $(impl Activation for $part {
            fn curve(&self) -> Curve {
                Curve::$part
            }
        })+

        /// The activations, by name.
        pub(crate) fn activations() -> &'static Parts<dyn Activation> {
            static TABLE: LazyLock<Parts<dyn Activation>> = LazyLock::new(|| {
                Parts::<dyn Activation>::new()$(.with(|x: $part| Box::new(x)))+
            });
            &TABLE
        }
    };
}

activations! { Identity, Tanh, Relu, Relu6, Elu, Sigmoid, Softplus, Silu }

family!(dyn Activation, "Activation", activations);

/// The function of a name.
///
/// # Errors
/// Which names there are.
pub fn curve(name: &str) -> Result<Curve, String> {
    let activation = activations().build(&Part::new(name)).map_err(|_| {
        let known: Vec<&str> = activations().names().collect();
        format!("its activation is one of {}, and not {name:?}", known.join(", "))
    })?;
    Ok(activation.curve())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Graph, Params, Shape};

    const NAMES: [&str; 6] = ["tanh", "relu", "elu", "sigmoid", "softplus", "silu"];

    fn curve(name: &str) -> Curve {
        let activation = activations().build(&Part::new(name)).unwrap();
        activation.curve()
    }

    #[test]
    fn hand_worked_values() {
        let apply = |name: &str| {
            let graph = Graph::<f64>::new(Params::default());
            let x = graph.input(Shape::vectors(1, 3), &[-1.0, 0.0, 2.0]);
            graph.value(graph.curve(x, curve(name)))
        };
        assert_eq!(apply("relu"), [0.0, 0.0, 2.0]);
        for (name, expected) in [
            // e⁻¹ − 1
            ("elu", [-0.632_120_558_828_557_7, 0.0, 2.0]),
            ("sigmoid", [0.268_941_421_369_995_1, 0.5, 0.880_797_077_977_882_3]),
            (
                "softplus",
                [0.313_261_687_518_222_9, std::f64::consts::LN_2, 2.126_928_011_042_972_4],
            ),
            // Those of the sigmoid times x.
            ("silu", [-0.268_941_421_369_995_1, 0.0, 1.761_594_155_955_764_6]),
        ] {
            let close = apply(name).iter().zip(expected).all(|(y, e)| (y - e).abs() < 1e-14);
            assert!(close, "{name}: {:?}", apply(name));
        }
    }

    #[test]
    fn slopes_agree_with_central_differences() {
        for name in NAMES {
            let h = 1e-5;
            for x in [-30.0, -3.0, -1.0, -0.25, 0.25, 1.0, 3.0, 30.0] {
                let graph = Graph::<f64>::new(Params::default());
                let x = graph.variable(Shape::vectors(1, 3), &[x - h, x, x + h]);
                let y = graph.curve(x, curve(name));
                graph.backward(graph.sum(y));
                let (ys, slope) = (graph.value(y), graph.grad(x)[1]);
                let difference = (ys[2] - ys[0]) / (2.0 * h);
                assert!((slope - difference).abs() < 1e-9, "{name}: {slope} and {difference}");
            }
        }
    }
}
