//! Losses of successor features, cumulants and preferences (§4.1 and §4.2).
//!
//! A batch has `N` steps. `Ψ(s, ·)` of a network is `[N, A d]`, the vectors of one action after the other, of which
//! [`Graph::gather`] takes those of what was done, and [`Graph::contract`] makes values `Ψ w`. Preferences `w` are one item
//! of `d` numbers. Each loss is a scalar to lower, in the unit of rewards, or their square where the norm is one.

use crate::graph::{Graph, Var};
use crate::real::Real;

/// What `‖δ‖` is of the error of a step, which the thesis leaves open. Losses are means of it over steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Norm {
    /// `Σ δ_i²`: the square of the length.
    Squares,
    /// `1/d Σ δ_i²`.
    MeanSquare,
    /// `√(Σ δ_i²)`, whose slope at 0 is 0.
    Length,
    /// `Σ |δ_i|`, whose slope at 0 is 0.
    Absolute,
}

/// Steps whose successor features are to be consistent with cumulants.
#[derive(Clone, Copy, Debug)]
pub struct SuccessorSteps {
    /// `Ψ(s, a)`: `[N, d]`.
    pub features: Var,
    /// `Φ(s, a)`: `[N, d]`; over several steps their sum, each weighing the discount times the one before.
    pub cumulants: Var,
    /// `Ψ(s', a')`: `[N, d]`, of the network itself (online) or of a copy that follows (target). No gradient passes through
    /// it, whichever it is of.
    pub next: Var,
    /// What it weighs: the discount, to the power of the number of steps, and 0 where an episode ended: `[N]`.
    pub discounts: Var,
}

/// How the parts of a ΨΦ-learner weigh in its loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weighting {
    /// All alike (Eqn. 4.22).
    Alike,
    /// The temporal-difference loss of the agent's own features weighs `1/d` (Alg. 3, line 14).
    ByFeature,
}

/// The losses of a ΨΦ-learner, all scalars.
#[derive(Clone, Debug)]
pub struct PsiPhiLosses {
    /// Of each other agent: of its actions (Eqn. 4.17), and of cumulants and features (Eqn. 4.18).
    pub others: Vec<(Var, Var)>,
    /// Of rewards (Eqn. 4.21a).
    pub reward: Var,
    /// Of the values of the agent's own policy (Eqn. 4.21b).
    pub value: Var,
    /// Of its features (Eqn. 4.21c).
    pub features: Var,
}

impl<F: Real> Graph<F> {
    /// The mean norm of errors: a scalar.
    ///
    /// - `errors`: `[N, d]`.
    pub fn mean_norm(&self, errors: Var, norm: Norm) -> Var {
        match norm {
            Norm::Squares => self.mean(self.sum_items(self.square(errors))),
            Norm::MeanSquare => self.mean(self.square(errors)),
            Norm::Length => self.mean(self.lengths(errors)),
            Norm::Absolute => {
                let zeros = self.still(|| self.affine(errors, 0.0, 0.0));
                self.mean(self.sum_items(self.absolute(errors, zeros)))
            }
        }
    }

    /// The temporal-difference errors of successor features (Eqns. 4.10c, 4.11): `[N, d]`.
    ///
    /// ```text
    /// δ = Ψ(s, a) - Φ(s, a) - γ SG[Ψ(s', a')]
    /// ```
    ///
    /// Gradients pass to features and cumulants.
    ///
    /// # Panics
    /// If the shapes do not go together.
    pub fn successor_errors(&self, steps: &SuccessorSteps) -> Var {
        let next = self.still(|| self.mul(steps.next, steps.discounts));
        self.sub(self.sub(steps.features, steps.cumulants), next)
    }

    /// The temporal-difference loss of successor features, whose cumulants are given (Eqns. 4.11, 4.21c): a scalar.
    ///
    /// Gradients pass to `Ψ(s, a)` alone.
    ///
    /// # Panics
    /// If the shapes do not go together.
    pub fn successor_loss(&self, steps: &SuccessorSteps, norm: Norm) -> Var {
        let cumulants = self.stop_gradient(steps.cumulants);
        self.inverse_loss(&SuccessorSteps { cumulants, ..*steps }, norm)
    }

    /// The loss of inverse temporal-difference learning, by which cumulants come to explain the features of
    /// demonstrators (Eqn. 4.18): a scalar.
    ///
    /// Gradients pass to `Φ(s, a)` and to `Ψ(s, a)`. Eqn. 4.18 has `Ψ(s, a)` under the stop of the gradient, where `(s',
    /// a')` is meant (Eqns. B.4, B.7).
    ///
    /// # Panics
    /// If the shapes do not go together.
    pub fn inverse_loss(&self, steps: &SuccessorSteps, norm: Norm) -> Var {
        self.mean_norm(self.successor_errors(steps), norm)
    }

    /// The loss of demonstrators that act by a softmax of their values (Eqns. 4.16, 4.17): a scalar.
    ///
    /// ```text
    /// -1/N Σ ln softmax[Ψ(s, ·) w][a]
    /// ```
    ///
    /// Their temperature is part of `Ψ w`. Gradients pass to both.
    ///
    /// - `features`: `Ψ(s, ·)`, `[N, A d]`.
    /// - `preferences`: `w`, `[d]`.
    /// - `acts`: what was done, counted from 0, `[N]`.
    ///
    /// # Panics
    /// If the shapes do not go together, or there is no such action.
    pub fn demonstrator_loss(&self, features: Var, preferences: Var, acts: Var) -> Var {
        self.mean(self.cross_entropy(self.contract(features, preferences), acts))
    }

    /// `λ ‖w‖₁`, which makes preferences sparse (Alg. 2, line 6): a scalar. Its slope at 0 is 0.
    pub fn sparsity_loss(&self, preferences: Var, weight: f64) -> Var {
        let zeros = self.still(|| self.affine(preferences, 0.0, 0.0));
        self.affine(self.sum(self.absolute(preferences, zeros)), weight, 0.0)
    }

    /// How far rewards are from what cumulants and preferences say (Eqn. 4.21a): a scalar. Of one number an item
    /// [`Norm::Squares`] is the square, and the others but [`Norm::MeanSquare`] its size.
    ///
    /// ```text
    /// 1/N Σ ‖Φ(s, a)ᵀ w - r'‖
    /// ```
    ///
    /// Gradients pass to cumulants and preferences.
    ///
    /// - `cumulants`: `Φ(s, a)`, `[N, d]`.
    /// - `preferences`: `w`, `[d]`.
    /// - `rewards`: `[N]`.
    ///
    /// # Panics
    /// If the shapes do not go together.
    pub fn reward_loss(&self, cumulants: Var, preferences: Var, rewards: Var, norm: Norm) -> Var {
        self.mean_norm(self.sub(self.contract(cumulants, preferences), rewards), norm)
    }

    /// The targets of the values of an agent's own policy (Eqn. 4.21b): `[N]`. They have no gradient.
    ///
    /// ```text
    /// r' + γ max_a' Ψ⁻(s', a')ᵀ w
    /// ```
    ///
    /// - `next`: `Ψ⁻(s', ·)` of a copy that follows, `[N, A d]`.
    /// - `preferences`: `w`, `[d]`.
    /// - `rewards`: `[N]`; over several steps their sum, each weighing the discount times the one before.
    /// - `discounts`: what the rest weighs, 0 where an episode ended, `[N]`.
    ///
    /// # Panics
    /// If the shapes do not go together.
    pub fn preferred_targets(
        &self,
        next: Var,
        preferences: Var,
        (rewards, discounts): (Var, Var),
    ) -> Var {
        self.still(|| {
            let best = self.max_items(self.contract(next, preferences));
            self.add(self.mul(best, discounts), rewards)
        })
    }

    /// How far the values of an agent's own policy are from their targets (Eqn. 4.21b): a scalar. Norms are as for
    /// [`Graph::reward_loss`].
    ///
    /// Gradients pass to `Ψ(s, a)`, and not to preferences, which rewards alone tell.
    ///
    /// - `features`: `Ψ(s, a)`, `[N, d]`.
    /// - `preferences`: `w`, `[d]`.
    /// - `targets`: [`Graph::preferred_targets`], `[N]`.
    ///
    /// # Panics
    /// If the shapes do not go together.
    pub fn preferred_loss(&self, features: Var, preferences: Var, targets: Var, norm: Norm) -> Var {
        let values = self.contract(features, self.stop_gradient(preferences));
        self.mean_norm(self.sub(values, self.stop_gradient(targets)), norm)
    }

    /// The whole loss of a ΨΦ-learner (Eqn. 4.22): a scalar.
    ///
    /// ```text
    /// Σ_k (L_BC^k + L_ITD^k) + L_r + L_q + L_TD-Ψ
    /// ```
    ///
    /// - `d`: how many numbers a cumulant has, by which [`Weighting::ByFeature`] divides.
    pub fn psi_phi_loss(&self, losses: &PsiPhiLosses, d: usize, weighting: Weighting) -> Var {
        let share = match weighting {
            Weighting::Alike => 1.0,
            Weighting::ByFeature => 1.0 / ivx_math::moments::real(d),
        };
        let own = self.add(losses.value, self.affine(losses.features, share, 0.0));
        let parts = losses.others.iter().map(|(acts, inverse)| self.add(*acts, *inverse));
        parts.fold(self.add(losses.reward, own), |sum, part| self.add(sum, part))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Shape;
    use crate::ops::tests::check;
    use crate::params::Params;

    const NORMS: [Norm; 4] = [Norm::Squares, Norm::MeanSquare, Norm::Length, Norm::Absolute];

    fn numbers(graph: &Graph<f64>, n: usize, values: &[f64]) -> Var {
        graph.input(Shape::vectors(n, values.len() / n), values)
    }

    #[test]
    fn by_hand() {
        let graph = Graph::<f64>::new(Params::default());
        let steps = SuccessorSteps {
            features: graph.variable(Shape::vectors(2, 2), &[4.0, 6.0, 1.0, 0.0]),
            cumulants: graph.variable(Shape::vectors(2, 2), &[0.0, 1.0, 1.0, 0.0]),
            next: graph.variable(Shape::vectors(2, 2), &[2.0, 2.0, 9.0, 9.0]),
            discounts: numbers(&graph, 2, &[0.5, 0.0]),
        };
        assert_eq!(graph.value(graph.successor_errors(&steps)), [3.0, 4.0, 0.0, 0.0]);
        let of = |norm| graph.scalar(graph.inverse_loss(&steps, norm));
        assert_eq!(NORMS.map(of), [12.5, 6.25, 2.5, 3.5]);
        // Slopes at an error of 0 are 0, of the length too.
        graph.backward(graph.inverse_loss(&steps, Norm::Length));
        let slopes = graph.grad(steps.features);
        let near = slopes.iter().zip([0.3, 0.4, 0.0, 0.0]).all(|(a, b)| (a - b).abs() < 1e-15);
        assert!(near, "{slopes:?}");
        let back = slopes.iter().map(|g| -g);
        assert_eq!(graph.grad(steps.cumulants), back.collect::<Vec<_>>());
        assert_eq!(graph.grad(steps.next), [0.0; 4]);

        // Values 1 and 2 of the first state, -2 and 0 of the second.
        let w = numbers(&graph, 1, &[1.0, -1.0]);
        let next = numbers(&graph, 2, &[1.0, 0.0, 4.0, 2.0, 0.0, 2.0, 1.0, 1.0]);
        let after = (numbers(&graph, 2, &[0.5, 0.25]), steps.discounts);
        let targets = graph.preferred_targets(next, w, after);
        assert_eq!(graph.value(targets), [1.5, 0.25]);
        // Values -2 and 1: errors -3.5 and 0.75.
        let of = |norm| graph.scalar(graph.preferred_loss(steps.features, w, targets, norm));
        assert_eq!(NORMS.map(of), [6.406_25, 6.406_25, 2.125, 2.125]);
        // Cumulants say -1 and 1: errors -1.5 and 0.75.
        let of = |norm| graph.scalar(graph.reward_loss(steps.cumulants, w, after.0, norm));
        assert_eq!(NORMS.map(of), [1.406_25, 1.406_25, 1.125, 1.125]);
        assert_eq!(graph.scalar(graph.sparsity_loss(w, 0.25)), 0.5);
        // ln(1 + e^{2-1}) and ln(1 + e^{-2}).
        let acts = numbers(&graph, 2, &[0.0, 1.0]);
        let expected = f64::midpoint(1.0_f64.exp().ln_1p(), (-2.0_f64).exp().ln_1p());
        assert!((graph.scalar(graph.demonstrator_loss(next, w, acts)) - expected).abs() < 1e-15);
    }

    #[test]
    fn parts_weigh_alike_or_by_feature() {
        let graph = Graph::<f64>::new(Params::default());
        let [a, b, c, d, reward, value, features] =
            [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0].map(|x| numbers(&graph, 1, &[x]));
        let losses = PsiPhiLosses { others: vec![(a, b), (c, d)], reward, value, features };
        let of = |weighting| graph.scalar(graph.psi_phi_loss(&losses, 4, weighting));
        assert_eq!((of(Weighting::Alike), of(Weighting::ByFeature)), (127.0, 79.0));
    }

    #[test]
    fn gradients_are_central_differences() {
        for norm in NORMS {
            check("inverse_loss", move |case| {
                let (n, d) = (case.size(1, 4), case.size(1, 4));
                case.input(n, [d, 1, 1]);
                case.input(n, [d, 1, 1]);
                let (next, discounts) = (case.numbers(n * d), case.numbers(n));
                Box::new(move |graph, x| {
                    let (next, discounts) =
                        (numbers(graph, n, &next), numbers(graph, n, &discounts));
                    let (features, cumulants) = (x[0], x[1]);
                    let steps = SuccessorSteps { features, cumulants, next, discounts };
                    graph.inverse_loss(&steps, norm)
                })
            });
            check("reward_loss", move |case| {
                let (n, d) = (case.size(1, 4), case.size(1, 4));
                case.input(n, [d, 1, 1]);
                case.input(1, [d, 1, 1]);
                let rewards = case.numbers(n);
                Box::new(move |graph, x| {
                    graph.reward_loss(x[0], x[1], numbers(graph, n, &rewards), norm)
                })
            });
            check("preferred_loss", move |case| {
                let (n, d) = (case.size(1, 4), case.size(1, 4));
                case.input(n, [d, 1, 1]);
                let (w, targets) = (case.numbers(d), case.numbers(n));
                Box::new(move |graph, x| {
                    let (w, targets) = (numbers(graph, 1, &w), numbers(graph, n, &targets));
                    graph.preferred_loss(x[0], w, targets, norm)
                })
            });
        }
        check("demonstrator_loss", |case| {
            let (n, d, n_actions) = (case.size(1, 4), case.size(1, 4), case.size(2, 3));
            case.input(n, [n_actions * d, 1, 1]);
            case.input(1, [d, 1, 1]);
            Box::new(move |graph, x| {
                let acts: Vec<f64> = (0..n).map(|i| [0.0, 1.0][i % 2]).collect();
                let loss = graph.demonstrator_loss(x[0], x[1], numbers(graph, n, &acts));
                graph.add(loss, graph.sparsity_loss(x[1], 0.05))
            })
        });
    }

    /// What is given passes no gradient: cumulants of a temporal-difference loss, preferences of a value's, and what
    /// follows in either.
    #[test]
    fn gradients_stop_at_what_is_given() {
        let graph = Graph::<f64>::new(Params::default());
        let of = |values: &[f64]| graph.variable(Shape::vectors(1, values.len()), values);
        let (features, cumulants, next) = (of(&[1.0, 2.0]), of(&[0.5, 3.0]), of(&[4.0, -1.0]));
        let (w, rewards, discounts) = (of(&[1.0, 2.0]), of(&[1.0]), of(&[0.5]));
        let steps = SuccessorSteps { features, cumulants, next, discounts };
        let targets = graph.preferred_targets(next, w, (rewards, discounts));
        let loss = graph.add(
            graph.successor_loss(&steps, Norm::Squares),
            graph.preferred_loss(features, w, targets, Norm::Squares),
        );
        graph.backward(loss);
        // 2 δ with δ = (-1.5, -0.5), and 2 (5 - 2) w.
        assert_eq!(graph.grad(features), [3.0, 11.0]);
        for given in [cumulants, next, w, rewards, discounts] {
            assert!(graph.grad(given).iter().all(|g| *g == 0.0));
        }
    }
}
