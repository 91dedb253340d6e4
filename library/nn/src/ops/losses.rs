//! Losses and log densities of predictions.

use crate::graph::{Graph, Shape, Var};
use crate::real::{Real, softplus};

/// `ln 2π`.
const LN_2_PI: f64 = 1.837_877_066_409_345_5;

impl<F: Real> Graph<F> {
    /// `(x - y)²` of each pair.
    pub fn squared(&self, x: Var, y: Var) -> Var {
        self.zip(
            x,
            y,
            |x, y| (x - y) * (x - y),
            |x, y| {
                let slope = F::of(2.0) * (x - y);
                (slope, -slope)
            },
        )
    }

    /// `|x - y|` of each pair; its slope where they are equal is 0.
    pub fn absolute(&self, x: Var, y: Var) -> Var {
        self.zip(
            x,
            y,
            |x, y| (x - y).abs(),
            |x, y| {
                let slope = if x == y { F::zero() } else { (x - y).signum() };
                (slope, -slope)
            },
        )
    }

    /// Huber's loss of each pair: `d²/2` where `|d| ≤ delta` for `d = x - y`, and
    /// `delta (|d| - delta/2)` beyond.
    pub fn huber(&self, x: Var, y: Var, delta: f64) -> Var {
        let (delta, half) = (F::of(delta), F::of(0.5));
        self.zip(
            x,
            y,
            |x, y| {
                let distance = (x - y).abs();
                let inside = distance.min(delta);
                inside * (distance - half * inside)
            },
            move |x, y| {
                let slope = (x - y).max(-delta).min(delta);
                (slope, -slope)
            },
        )
    }

    /// `-ln p(class)` of each item, where `p` is the softmax of its logits: one number an item.
    ///
    /// # Panics
    /// If there is not one class an item, or an item has no such logit.
    pub fn cross_entropy(&self, logits: Var, class: Var) -> Var {
        self.affine(self.pick(self.log_softmax(logits), class), -1.0, 0.0)
    }

    /// `-(t ln σ(x) + (1 - t) ln(1 - σ(x)))` of each pair of a logit `x` and a target `t`.
    pub fn binary_cross_entropy(&self, logits: Var, targets: Var) -> Var {
        self.zip(
            logits,
            targets,
            |x, t| softplus(x) - x * t,
            |x, t| ((-softplus(-x)).exponential() - t, -x),
        )
    }

    /// `ln N(y | mean, e^{2 log_std})` of each number, for the difference `y - mean`.
    pub fn gaussian_log_prob(&self, difference: Var, log_std: Var) -> Var {
        let (half, shift) = (F::of(0.5), F::of(0.5 * LN_2_PI));
        self.zip(
            difference,
            log_std,
            |d, log_std| {
                let z = d * (-log_std).exponential();
                -half * z * z - log_std - shift
            },
            |d, log_std| {
                let precision = (F::of(-2.0) * log_std).exponential();
                (-d * precision, d * d * precision - F::one())
            },
        )
    }

    /// The same for `tanh y`, whose density is that of `y` over its slope `1 - tanh² y`.
    pub fn squashed_log_prob(&self, y: Var, difference: Var, log_std: Var) -> Var {
        // ln(1 - tanh² y) = 2 (ln 2 - y - ln(1 + e^{-2y})), without cancellation.
        let two = F::of(2.0);
        let log_slope = self.map(
            y,
            |y| two * (F::of(std::f64::consts::LN_2) - y - softplus(-two * y)),
            |y, _| F::of(-2.0) * y.hyperbolic_tangent(),
        );
        self.sub(self.gaussian_log_prob(difference, log_std), log_slope)
    }

    /// The entropy of `N(., e^{2 log_std})`, summed over all numbers: a scalar.
    pub fn gaussian_entropy(&self, log_std: Var) -> Var {
        self.sum(self.affine(log_std, 1.0, 0.5 * (1.0 + LN_2_PI)))
    }

    /// `ln N(y | mean, L Lᵀ)` of each item, for the difference `y - mean`: one number an item.
    ///
    /// - `factor`: `[d, d]` an item, row after row; only the lower triangle counts, and its diagonal
    ///   must be positive.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn full_gaussian_log_prob(&self, difference: Var, factor: Var) -> Var {
        let Shape { n, .. } = self.shape(difference);
        let d = self.shape(difference).width();
        assert_eq!(self.shape(factor).len(), n * d * d, "a square factor an item");
        // z = L⁻¹ (y - mean).
        let solved = self.keep(n * d, |arena, out| {
            let items = arena.value(difference).chunks_exact(d);
            let items = items.zip(arena.value(factor).chunks_exact(d * d));
            for (z, (difference, factor)) in out.chunks_exact_mut(d).zip(items) {
                for i in 0..d {
                    let known = (0..i).map(|j| factor[i * d + j] * z[j]).sum::<F>();
                    z[i] = (difference[i] - known) / factor[i * d + i];
                }
            }
        });
        let work = self.keep(n * d, |_, _| {});
        let shift = F::of(0.5 * LN_2_PI * f64::from(u32::try_from(d).expect("items are short")));
        self.op_with(
            work,
            Shape::vectors(n, 1),
            &[difference, factor],
            &[],
            |arena, _, out| {
                let items = arena.value(solved).chunks_exact(d);
                let items = items.zip(arena.value(factor).chunks_exact(d * d));
                for (y, (z, factor)) in out.iter_mut().zip(items) {
                    let log_det = (0..d).map(|i| factor[i * d + i].ln()).sum::<F>();
                    *y = F::of(-0.5) * z.iter().map(|&z| z * z).sum::<F>() - log_det - shift;
                }
            },
            // With w = L⁻ᵀ z: ∂/∂(y - mean) = -w and ∂/∂L = w zᵀ - diag(1/L_ii), below the diagonal.
            move |arena, work, _, grad| {
                let items = arena.value(solved).chunks_exact(d);
                let items = items.zip(arena.value(factor).chunks_exact(d * d));
                for (w, (z, factor)) in work.chunks_exact_mut(d).zip(items) {
                    for i in (0..d).rev() {
                        let known = (i + 1..d).map(|j| factor[j * d + i] * w[j]).sum::<F>();
                        w[i] = (z[i] - known) / factor[i * d + i];
                    }
                }
                arena.pass(difference, |_, out, add| {
                    for (i, (out, &w)) in out.iter_mut().zip(&*work).enumerate() {
                        let new = -w * grad[i / d];
                        *out = if add { *out + new } else { new };
                    }
                });
                arena.pass(factor, |arena, out, add| {
                    if !add {
                        out.fill(F::zero());
                    }
                    let items = arena.value(solved).chunks_exact(d).zip(work.chunks_exact(d));
                    let items = items.zip(arena.value(factor).chunks_exact(d * d)).zip(&*grad);
                    for (out, (((z, w), factor), &g)) in out.chunks_exact_mut(d * d).zip(items) {
                        for i in 0..d {
                            (0..=i).for_each(|j| out[i * d + j] += g * w[i] * z[j]);
                            out[i * d + i] -= g / factor[i * d + i];
                        }
                    }
                });
            },
        )
    }

    /// `KL(p ‖ q) = Σ p (ln p - ln q)` of each pair of items of logits: one number an item.
    pub fn categorical_kl(&self, p: Var, q: Var) -> Var {
        let (log_p, log_q) = (self.log_softmax(p), self.log_softmax(q));
        self.sum_items(self.mul(self.exp(log_p), self.sub(log_p, log_q)))
    }

    /// `-Σ p ln p` of each item of logits: one number an item.
    pub fn entropy(&self, logits: Var) -> Var {
        let log_p = self.log_softmax(logits);
        self.affine(self.sum_items(self.mul(self.exp(log_p), log_p)), -1.0, 0.0)
    }

    /// `KL(N(m_p, s_p²) ‖ N(m_q, s_q²))` of each pair of items, summed over their numbers: one
    /// number an item. Each is a pair of means and logarithms of standard deviations.
    ///
    /// ```text
    /// ln s_q - ln s_p + (s_p² + (m_p - m_q)²) / (2 s_q²) - 1/2
    /// ```
    pub fn gaussian_kl(&self, (mean_p, log_p): (Var, Var), (mean_q, log_q): (Var, Var)) -> Var {
        let difference = self.sub(mean_p, mean_q);
        let logs = self.sub(log_p, log_q);
        let half = F::of(0.5);
        let spread = self.map(
            logs,
            |x| half * (x + x).exponential() - x - half,
            |x, _| (x + x).exponential() - F::one(),
        );
        let distance = self.zip(
            difference,
            log_q,
            |d, log_q| half * d * d * (F::of(-2.0) * log_q).exponential(),
            |d, log_q| {
                let precision = (F::of(-2.0) * log_q).exponential();
                (d * precision, -d * d * precision)
            },
        );
        self.sum_items(self.add(spread, distance))
    }
}
