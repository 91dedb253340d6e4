//! Losses of methods that imitate: soft Q imitation, adversarial imitation, and cloning beside another loss (§4.3).

use crate::graph::{Graph, Shape, Var};
use crate::ops::input_gradient::Layer;
use crate::real::{Real, softplus};

/// Steps of soft Q-learning.
#[derive(Clone, Copy, Debug)]
pub struct SoftSteps {
    /// `q(s, ·)`: `[N, A]`.
    pub values: Var,
    /// What was done, counted from 0: `[N]`.
    pub acts: Var,
    /// What was paid up to the state `s'` at which a target looks, discounted: `[N]`.
    pub rewards: Var,
    /// `q⁻(s', ·)` of a copy that follows: `[N, A]`. It passes no gradient.
    pub next: Var,
    /// What it weighs, 0 where an episode ended: `[N]`.
    pub discounts: Var,
}

/// What a discriminator of logits `x`, with `D = σ(x)` the probability of a demonstration, pays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Payment {
    /// `-ln(1 - D) = ln(1 + e^x)`, never below 0: it pays to go on.
    Positive,
    /// `ln D = -ln(1 + e^-x)`, never above 0: it pays to end.
    Negative,
    /// `ln D - ln(1 - D) = x` (Fu et al., 2018).
    Logit,
}

impl Payment {
    /// The reward for a step of this logit.
    #[must_use]
    pub fn of<F: Real>(self, logit: F) -> F {
        match self {
            Self::Positive => softplus(logit),
            Self::Negative => -softplus(-logit),
            Self::Logit => logit,
        }
    }
}

impl<F: Real> Graph<F> {
    /// `α ln Σ_a e^{q(a) / α}` of each item (Haarnoja et al., 2017): `[N]`. It lies between the largest value and that and
    /// `α ln A`.
    ///
    /// - `values`: `[N, A]`.
    /// - `temperature`: `α`, above 0, in the unit of values.
    pub fn soft_values(&self, values: Var, temperature: f64) -> Var {
        let scaled = self.affine(values, 1.0 / temperature, 0.0);
        // Where the largest is, so that nothing cancels.
        let best = self.argmax_items(values);
        let more = self.pick(self.log_softmax(scaled), best);
        self.sub(self.pick(values, best), self.affine(more, temperature, 0.0))
    }

    /// The targets of soft Q-learning: `[N]`. They have no gradient.
    ///
    /// ```text
    /// r + γ α ln Σ_a' e^{q⁻(s', a') / α}
    /// ```
    pub fn soft_targets(&self, steps: &SoftSteps, temperature: f64) -> Var {
        self.still(|| {
            let next = self.mul(self.soft_values(steps.next, temperature), steps.discounts);
            self.add(next, steps.rewards)
        })
    }

    /// The loss of soft Q imitation learning (Reddy et al., 2019) and its two parts: scalars, in squares of values.
    ///
    /// ```text
    /// δ²(D) + λ δ²(B),   δ²(·) = 1/N Σ (q(s, a) - r - γ α ln Σ_a' e^{q⁻(s', a') / α})²
    /// ```
    ///
    /// Each of the two is a mean, so that they are balanced whatever their numbers.
    ///
    /// - `shown`: `D`, steps of demonstrations, each of which pays 1.
    /// - `own`: `B`, those of the agent, which pay 0.
    /// - `temperature`: `α`, above 0, in the unit of values.
    /// - `weight`: `λ`.
    ///
    /// # Panics
    /// If the shapes do not go together, or there is no such action.
    pub fn soft_imitation_loss(
        &self,
        shown: &SoftSteps,
        own: &SoftSteps,
        temperature: f64,
        weight: f64,
    ) -> [Var; 3] {
        let loss = |steps: &SoftSteps| {
            let targets = self.soft_targets(steps, temperature);
            self.mean(self.squared(self.pick(steps.values, steps.acts), targets))
        };
        let (shown, own) = (loss(shown), loss(own));
        [self.add(shown, self.affine(own, weight, 0.0)), shown, own]
    }

    /// The loss of a discriminator that tells steps of demonstrations from those of an agent (Ho and Ermon, 2016): a
    /// scalar.
    ///
    /// ```text
    /// -1/N Σ ln D(shown) - 1/N Σ ln(1 - D(own)),   D = σ(x)
    /// ```
    ///
    /// - `shown`, `own`: logits `x`, `[N]` each, of any numbers.
    pub fn discriminator_loss(&self, shown: Var, own: Var) -> Var {
        let loss = |logits: Var, target: f64| {
            let targets = self.filled(Shape::vectors(1, 1), |out| out.fill(F::of(target)));
            self.mean(self.binary_cross_entropy(logits, targets))
        };
        self.add(loss(shown, 1.0), loss(own, 0.0))
    }

    /// Items between two others: `ε x + (1 - ε) y`.
    ///
    /// - `x`, `y`: `[N, d]`.
    /// - `shares`: `ε`, `[N]`.
    ///
    /// # Panics
    /// If the shapes do not go together.
    pub fn between(&self, x: Var, y: Var, shares: Var) -> Var {
        self.add(self.mul(self.sub(x, y), shares), y)
    }

    /// How far the slope of a discriminator is from 1 (Gulrajani et al., 2017): a scalar.
    ///
    /// ```text
    /// 1/N Σ (‖∂D(x)/∂x‖ - 1)²
    /// ```
    ///
    /// Its gradient by the parameters is of second derivatives, and the slope of a length of 0 is 0. The network is a
    /// perceptron whose output is a logit.
    ///
    /// - `x`: `[N, d]`, such as what is [between](Graph::between) demonstrations and steps of the agent.
    ///
    /// # Panics
    /// As [`Graph::input_gradient`].
    pub fn gradient_penalty(&self, layers: &[Layer], x: Var) -> Var {
        let (_, slopes) = self.input_gradient(layers, x);
        self.mean(self.square(self.affine(self.lengths(slopes), 1.0, -1.0)))
    }

    /// A loss with that of cloning demonstrations beside it, which shapes what the networks of both share (Eqn. 4.3), and
    /// that of cloning alone: scalars.
    ///
    /// ```text
    /// L + λ 1/N Σ -ln π(a | h(s))
    /// ```
    ///
    /// - `logits`: of the policy, `[N, A]`.
    /// - `acts`: what was done, counted from 0, `[N]`.
    ///
    /// # Panics
    /// If the shapes do not go together, or there is no such action.
    pub fn with_cloning(&self, loss: Var, (logits, acts): (Var, Var), weight: f64) -> [Var; 2] {
        let cloning = self.mean(self.cross_entropy(logits, acts));
        [self.add(loss, self.affine(cloning, weight, 0.0)), cloning]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::Curve;
    use crate::ops::tests::check;
    use crate::params::Params;

    fn numbers(graph: &Graph<f64>, n: usize, values: &[f64]) -> Var {
        graph.input(Shape::vectors(n, values.len() / n), values)
    }

    fn steps(
        graph: &Graph<f64>,
        (values, reward): (Var, f64),
        next: &[f64],
        discounts: &[f64],
    ) -> SoftSteps {
        let n = discounts.len();
        let acts: Vec<f64> = (0..n).map(|i| [1.0, 0.0][i % 2]).collect();
        SoftSteps {
            values,
            acts: numbers(graph, n, &acts),
            rewards: numbers(graph, n, &vec![reward; n]),
            next: numbers(graph, n, next),
            discounts: numbers(graph, n, discounts),
        }
    }

    #[test]
    fn soft_values_by_hand_and_at_their_limits() {
        let graph = Graph::<f64>::new(Params::default());
        let q = numbers(&graph, 2, &[0.0, 3.0_f64.ln(), 1000.0, -1000.0]);
        let at = |temperature| graph.value(graph.soft_values(q, temperature));
        assert!((at(1.0)[0] - 4.0_f64.ln()).abs() < 1e-15);
        assert_eq!(at(1.0)[1], 1000.0);
        assert!((at(1e-3)[0] - 3.0_f64.ln()).abs() < 1e-15);
        // Half of ln(1 + 9).
        assert!((at(0.5)[0] - 0.5 * 10.0_f64.ln()).abs() < 1e-15);
    }

    #[test]
    fn demonstrations_pay_one_and_weigh_as_much_as_the_rest() {
        let graph = Graph::<f64>::new(Params::default());
        let shown = numbers(&graph, 1, &[0.0, 2.0]);
        let shown = steps(&graph, (shown, 1.0), &[0.0, 0.0], &[0.5]);
        let own = numbers(&graph, 2, &[9.0, 1.0, 3.0, 9.0]);
        let own = steps(&graph, (own, 0.0), &[0.0, 0.0, 0.0, 0.0], &[0.0, 0.0]);
        // 2 - 1 - ½ ln 2; 1 and 3.
        let first = (1.0 - 0.5 * 2.0_f64.ln()).powi(2);
        let loss =
            |weight| graph.soft_imitation_loss(&shown, &own, 1.0, weight).map(|l| graph.scalar(l));
        let near = |found: [f64; 3], all: f64| {
            let apart = found.into_iter().zip([all, first, 5.0]);
            assert!(apart.into_iter().all(|(a, b)| (a - b).abs() < 1e-15), "{found:?}");
        };
        near(loss(1.0), first + 5.0);
        near(loss(0.1), first + 0.5);
    }

    #[test]
    fn a_discriminator_by_hand() {
        let graph = Graph::<f64>::new(Params::default());
        // D = ¾ and ½ of demonstrations, ¼ of the agent: -½ ln(3/8) - ln ¾.
        let logit = 3.0_f64.ln();
        let (shown, own) = (numbers(&graph, 2, &[logit, 0.0]), numbers(&graph, 1, &[-logit]));
        let loss = graph.scalar(graph.discriminator_loss(shown, own));
        assert!((loss + 0.5 * (3.0_f64 / 8.0).ln() + 0.75_f64.ln()).abs() < 1e-15);
        let paid = [Payment::Positive, Payment::Negative, Payment::Logit].map(|p| p.of(logit));
        let expected = [4.0_f64.ln(), 0.75_f64.ln(), logit];
        assert!(paid.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{paid:?}");
        let x = numbers(&graph, 2, &[4.0, 8.0]);
        let y = numbers(&graph, 2, &[0.0, 4.0]);
        let between = graph.between(x, y, numbers(&graph, 2, &[0.25, 1.0]));
        assert_eq!(graph.value(between), [1.0, 8.0]);
    }

    #[test]
    fn a_flat_discriminator_is_penalised_without_a_gradient() {
        let mut params = Params::<f64>::default();
        let weight = params.add("w".into(), vec![2, 1], vec![3.0, 4.0]);
        let bias = params.add("b".into(), vec![1], vec![0.0]);
        let layers = [Layer { weight, bias, curve: Curve::Identity }];
        let graph = Graph::new(params);
        let x = numbers(&graph, 2, &[1.0, 2.0, 3.0, 4.0]);
        // (5 - 1)², and 2 (5 - 1) W / 5.
        let penalty = graph.gradient_penalty(&layers, x);
        graph.backward(penalty);
        assert_eq!(graph.scalar(penalty), 16.0);
        let grad = graph.params().grad(weight).unwrap().to_vec();
        assert!((grad[0] - 4.8).abs() < 1e-14 && (grad[1] - 6.4).abs() < 1e-14, "{grad:?}");
        graph.begin();
        graph.params().value_mut(weight).fill(0.0);
        let x = numbers(&graph, 1, &[1.0, 2.0]);
        let penalty = graph.gradient_penalty(&layers, x);
        graph.backward(penalty);
        assert_eq!(graph.scalar(penalty), 1.0);
        assert_eq!(graph.params().grad(weight).unwrap(), [0.0, 0.0]);
    }

    #[test]
    fn gradients_are_central_differences() {
        check("soft_values", |case| {
            let (n, width) = (case.size(1, 4), case.size(2, 4));
            case.input(n, [width, 1, 1]);
            Box::new(|graph, x| graph.soft_values(x[0], 0.3))
        });
        check("soft_imitation_loss", |case| {
            let (n, m) = (case.size(1, 3), case.size(1, 3));
            case.input(n, [2, 1, 1]);
            case.input(m, [2, 1, 1]);
            let next = [case.numbers(2 * n), case.numbers(2 * m)];
            let discounts = [case.numbers(n), case.numbers(m)];
            Box::new(move |graph, x| {
                let of = |i: usize, pays| steps(graph, (x[i], pays), &next[i], &discounts[i]);
                graph.soft_imitation_loss(&of(0, 1.0), &of(1, 0.0), 0.5, 0.7)[0]
            })
        });
        check("discriminator_loss", |case| {
            let (n, m) = (case.size(1, 3), case.size(1, 3));
            case.input(n, [1, 1, 1]);
            case.input(m, [1, 1, 1]);
            Box::new(|graph, x| graph.discriminator_loss(x[0], x[1]))
        });
        check("gradient_penalty", |case| {
            let (n, n_in, width) = (case.size(1, 3), case.size(1, 3), case.size(2, 4));
            let layers = [(n_in, width, Curve::Tanh), (width, 1, Curve::Identity)];
            let layers = layers.map(|(n_in, n_out, curve)| {
                let weight = case.param(&[n_in, n_out]);
                Layer { weight, bias: case.param(&[n_out]), curve }
            });
            for _ in 0..2 {
                case.input(n, [n_in, 1, 1]);
            }
            let shares = case.numbers(n);
            Box::new(move |graph, x| {
                let x = graph.between(x[0], x[1], numbers(graph, n, &shares));
                graph.gradient_penalty(&layers, x)
            })
        });
        check("with_cloning", |case| {
            let n = case.size(1, 4);
            case.input(n, [2, 1, 1]);
            case.input(n, [3, 1, 1]);
            Box::new(move |graph, x| {
                let acts: Vec<f64> = (0..n).map(|i| [2.0, 0.0][i % 2]).collect();
                let loss = graph.mean(graph.square(x[0]));
                graph.with_cloning(loss, (x[1], numbers(graph, n, &acts)), 0.3)[0]
            })
        });
    }
}
