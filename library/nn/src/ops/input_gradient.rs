//! The gradient of a network by its inputs as a value of the pass, which has gradients by parameters itself.

use crate::curve::Curve;
use crate::graph::{Graph, Shape, Var};
use crate::matmul::{Matrix, multiply};
use crate::module::Module;
use crate::params::ParamId;
use crate::real::Real;

/// A linear map, its bias and what follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// `[n_in, n_out]`.
    pub weight: ParamId,
    /// `[n_out]`.
    pub bias: ParamId,
    /// What follows, whose slope must follow from its value: any but [`Curve::Silu`].
    pub curve: Curve,
}

impl Module {
    /// Whether it is a perceptron, none of whose layers is followed by [`Curve::Silu`].
    #[must_use]
    pub fn is_perceptron(&self) -> bool {
        let simple =
            |part: &Self| matches!(part, Self::Dense { curve, .. } if *curve != Curve::Silu);
        match self {
            Self::Sequence(parts) => parts.iter().all(simple),
            part => simple(part),
        }
    }

    /// The layers of a perceptron, whose gradient by its inputs [`Graph::input_gradient`] makes; `None` if it has others,
    /// or one followed by [`Curve::Silu`].
    ///
    /// - `params`: the places of its arrays, in the order of [`Module::arrays`].
    #[must_use]
    pub fn perceptron(&self, params: &[ParamId]) -> Option<Vec<Layer>> {
        let parts = match self {
            Self::Sequence(parts) => &parts[..],
            part => std::slice::from_ref(part),
        };
        let arrays = params.chunks_exact(2);
        let layers = parts.iter().zip(arrays).map(|(part, arrays)| match part {
            Self::Dense { curve, .. } if *curve != Curve::Silu => {
                Some(Layer { weight: arrays[0], bias: arrays[1], curve: *curve })
            }
            _ => None,
        });
        let layers: Vec<Layer> = layers.collect::<Option<_>>()?;
        (layers.len() == parts.len() && 2 * layers.len() == params.len()).then_some(layers)
    }
}

impl<F: Real> Graph<F> {
    /// What a perceptron of one output makes of `x`, `[N]`, and its gradient by `x`, `[N, n_in]`.
    ///
    /// ```text
    /// h_l = ν_l(h_{l-1} W_l + b_l),   g_{l-1} = (g_l ν_l'(h_l)) W_lᵀ,   g_L = 1
    /// ```
    ///
    /// The gradient is a value like others: a loss of it has gradients by parameters, which are second derivatives of the
    /// network. Those of a curve of straight pieces are 0.
    ///
    /// # Panics
    /// If the network has no layer or more than one output, or the shapes do not fit.
    pub fn input_gradient(&self, layers: &[Layer], x: Var) -> (Var, Var) {
        let mut h = x;
        let values: Vec<Var> = layers
            .iter()
            .map(|layer| {
                h = self.linear(h, layer.weight, layer.bias, layer.curve);
                h
            })
            .collect();
        assert!(!layers.is_empty(), "a network has a layer");
        assert_eq!(self.shape(h).width(), 1, "a network of one output");
        let mut g = self.filled(Shape::vectors(self.shape(x).n, 1), |out| out.fill(F::one()));
        for (layer, h) in layers.iter().zip(values).rev() {
            if layer.curve != Curve::Identity {
                let slope = self.slope(h, layer.curve);
                g = self.mul(slope, g);
            }
            g = self.linear_back(g, layer.weight);
        }
        (h, g)
    }

    /// `x Wᵀ` of each item `x`, as vectors: what [`Graph::linear`] passes back.
    ///
    /// - `weight`: `[n_out, n_in]`.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn linear_back(&self, x: Var, weight: ParamId) -> Var {
        let shape = self.shape(x);
        let (n, n_in) = (shape.n, shape.width());
        let n_out = self.params().value(weight).len() / n_in;
        self.op(
            Shape::vectors(n, n_out),
            &[x],
            &[weight],
            |arena, out| {
                let weight = Matrix::new(arena.params.value(weight), n_out, n_in);
                multiply(Matrix::new(arena.value(x), n, n_in), weight.transposed(), false, out);
            },
            move |arena, _, grad| {
                let rows = Matrix::new(grad, n, n_out);
                arena.learn(weight, |arena, out, add| {
                    multiply(rows.transposed(), Matrix::new(arena.value(x), n, n_in), add, out);
                });
                arena.pass(x, |arena, out, add| {
                    let weight = Matrix::new(arena.params.value(weight), n_out, n_in);
                    multiply(rows, weight, add, out);
                });
            },
        )
    }

    /// The slope of a curve where it took the values `y`.
    fn slope(&self, y: Var, curve: Curve) -> Var {
        self.op(
            self.shape(y),
            &[y],
            &[],
            |arena, out| {
                out.fill(F::one());
                curve.backward(arena.value(y), out);
            },
            move |arena, _, grad| {
                arena.pass(y, |arena, out, add| {
                    let values = arena.value(y).iter().zip(grad.iter());
                    for (out, (&y, &g)) in out.iter_mut().zip(values) {
                        let new = curve.bend(y) * g;
                        *out = if add { *out + new } else { new };
                    }
                });
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::tests::check;
    use crate::params::Params;

    const CURVES: [Curve; 7] = [
        Curve::Identity,
        Curve::Tanh,
        Curve::Relu,
        Curve::Relu6,
        Curve::Elu,
        Curve::Sigmoid,
        Curve::Softplus,
    ];

    #[test]
    fn by_hand() {
        // tanh(2 x - 1) times 3: 3 tanh 0 and 3·2 at ½.
        let mut params = Params::<f64>::default();
        let mut add = |name: &str, value| params.add(name.to_owned(), vec![1, 1], vec![value]);
        let layers = [
            Layer { weight: add("a", 2.0), bias: add("b", -1.0), curve: Curve::Tanh },
            Layer { weight: add("c", 3.0), bias: add("d", 0.0), curve: Curve::Identity },
        ];
        let graph = Graph::new(params);
        let x = graph.input(Shape::vectors(1, 1), &[0.5]);
        let (y, slope) = graph.input_gradient(&layers, x);
        assert_eq!((graph.scalar(y), graph.scalar(slope)), (0.0, 6.0));
        // d/dW of W V: V and W.
        graph.backward(slope);
        let grads = [0, 2].map(|i| {
            let layer = [layers[0].weight, layers[0].bias, layers[1].weight][i];
            graph.params().grad(layer).unwrap()[0]
        });
        assert_eq!(grads, [3.0, 2.0]);
    }

    /// What is made as a value is what the pass back makes, and its gradients are central differences.
    #[test]
    fn slopes_of_slopes_are_central_differences() {
        for curve in CURVES {
            check("input_gradient", move |case| {
                let (n, n_in) = (case.size(1, 3), case.size(1, 3));
                let widths = [n_in, case.size(1, 4), case.size(1, 4), 1];
                let layers: Vec<Layer> = (0..3)
                    .map(|l| {
                        let curve = if l == 2 { Curve::Identity } else { curve };
                        let weight = case.param(&[widths[l], widths[l + 1]]);
                        Layer { weight, bias: case.param(&[widths[l + 1]]), curve }
                    })
                    .collect();
                case.input(n, [n_in, 1, 1]);
                Box::new(move |graph, x| {
                    let (y, slope) = graph.input_gradient(&layers, x[0]);
                    graph.concat(&[y, slope])
                })
            });
        }
    }

    #[test]
    fn slopes_are_those_of_the_pass_back() {
        for curve in CURVES {
            let mut params = Params::<f64>::default();
            let numbers = |n: u8, by: f64| (0..n).map(|i| (f64::from(i) * by + by).sin()).collect();
            let layers = [
                Layer {
                    weight: params.add("a".into(), vec![3, 4], numbers(12, 1.7)),
                    bias: params.add("b".into(), vec![4], numbers(4, 0.9)),
                    curve,
                },
                Layer {
                    weight: params.add("c".into(), vec![4, 1], numbers(4, 2.3)),
                    bias: params.add("d".into(), vec![1], vec![0.1]),
                    curve: Curve::Softplus,
                },
            ];
            let graph = Graph::new(params);
            let x: Vec<f64> = numbers(6, 0.6);
            let x = graph.variable(Shape::vectors(2, 3), &x);
            let (y, slope) = graph.input_gradient(&layers, x);
            graph.backward(graph.sum(y));
            let apart = graph.value(slope).into_iter().zip(graph.grad(x));
            assert!(apart.into_iter().all(|(a, b)| (a - b).abs() < 1e-15), "{curve:?}");
        }
    }

    #[test]
    fn a_perceptron_is_known_by_its_layers() {
        let dense = |inputs, outputs, curve| Module::Dense { inputs, outputs, curve };
        let mut params = Params::<f64>::default();
        let ids: Vec<ParamId> =
            (0..4).map(|i| params.add(format!("p{i}"), vec![1], vec![0.0])).collect();
        let of = |layers: Vec<Module>| Module::Sequence(layers).perceptron(&ids);
        let layers = vec![dense(2, 3, Curve::Tanh), dense(3, 1, Curve::Identity)];
        assert!(Module::Sequence(layers.clone()).is_perceptron());
        assert!(!Module::Sequence(vec![dense(2, 3, Curve::Silu)]).is_perceptron());
        assert!(!Module::Sequence(vec![dense(2, 3, Curve::Tanh), Module::Flatten]).is_perceptron());
        let two = of(layers).unwrap();
        assert_eq!(two[1], Layer { weight: ids[2], bias: ids[3], curve: Curve::Identity });
        assert_eq!(of(vec![dense(2, 3, Curve::Silu), dense(3, 1, Curve::Identity)]), None);
        assert_eq!(of(vec![dense(2, 3, Curve::Tanh), Module::Flatten]), None);
        assert_eq!(of(vec![dense(2, 3, Curve::Tanh)]), None);
    }
}
