//! Normalisation: of channels over a batch, and of items.

use crate::graph::{Arena, Graph, Shape, Var};
use crate::params::ParamId;
use crate::real::Real;

/// What batch normalisation learns and remembers; each `[channels]`.
#[derive(Clone, Copy, Debug)]
pub struct BatchNorm {
    /// What normalised numbers are multiplied by.
    pub scale: ParamId,
    /// What is added then.
    pub shift: ParamId,
    /// The running mean, which training does not learn but keeps.
    pub mean: ParamId,
    /// The running variance, likewise.
    pub variance: ParamId,
    /// The share of a batch's statistics in the running ones.
    pub momentum: f64,
    /// Added to the variance.
    pub eps: f64,
}

/// How the numbers of a value are grouped: number `i` belongs to group `i / inner % groups`.
#[derive(Clone, Copy)]
struct Groups {
    groups: usize,
    inner: usize,
}

impl Groups {
    fn sums<F: Real>(self, terms: impl Iterator<Item = F>, sums: &mut [F]) {
        sums.fill(F::zero());
        for (i, x) in terms.enumerate() {
            sums[i / self.inner % self.groups] += x;
        }
    }
}

impl<F: Real> Graph<F> {
    /// Each channel brought to mean 0 and variance 1 over the batch, then scaled and shifted
    /// (Ioffe and Szegedy, 2015); the running statistics take their share. The running variance
    /// is the unbiased one.
    ///
    /// # Panics
    /// If the shapes do not fit, or a channel has one number only.
    #[expect(clippy::cast_precision_loss, reason = "values have far fewer than 2^53 numbers")]
    pub fn batch_norm(&self, x: Var, norm: &BatchNorm) -> Var {
        let shape = self.shape(x);
        let groups = Groups { groups: shape.item[0], inner: shape.item[1] * shape.item[2] };
        let n = shape.len() / groups.groups;
        assert!(n > 1, "one number has no variance");
        let statistics = self.standardised(x, groups, norm.eps);
        let normal = statistics.normal;
        {
            let (keep, new) = (F::of(1.0 - norm.momentum), F::of(norm.momentum));
            let unbiased = F::of(n as f64 / (n - 1) as f64);
            self.remember(statistics.mean, norm.mean, |m, x| keep * m + new * x);
            self.remember(statistics.variance, norm.variance, |v, x| keep * v + new * unbiased * x);
        }
        self.scaled(normal, groups, norm.scale, norm.shift)
    }

    /// The same by the running statistics, as after training.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn batch_norm_fixed(&self, x: Var, norm: &BatchNorm) -> Var {
        let shape = self.shape(x);
        let groups = Groups { groups: shape.item[0], inner: shape.item[1] * shape.item[2] };
        let (mean, variance, eps) = (norm.mean, norm.variance, F::of(norm.eps));
        let factor = move |arena: &Arena<F>, i: usize| {
            let variance = arena.params.value(variance)[i / groups.inner % groups.groups];
            F::one() / (variance + eps).sqrt()
        };
        let normal = self.op(
            shape,
            &[x],
            &[],
            |arena, out| {
                let means = arena.params.value(mean);
                for (i, (y, &x)) in out.iter_mut().zip(arena.value(x)).enumerate() {
                    *y = (x - means[i / groups.inner % groups.groups]) * factor(arena, i);
                }
            },
            move |arena, _, grad| {
                arena.pass(x, |arena, out, add| {
                    for (i, (out, &g)) in out.iter_mut().zip(grad.iter()).enumerate() {
                        let new = g * factor(arena, i);
                        *out = if add { *out + new } else { new };
                    }
                });
            },
        );
        self.scaled(normal, groups, norm.scale, norm.shift)
    }

    /// Each item brought to mean 0 and variance 1, then scaled and shifted number by number
    /// (Ba et al., 2016).
    ///
    /// - `scale`, `shift`: as long as an item.
    ///
    /// # Panics
    /// If the shapes do not fit.
    pub fn layer_norm(&self, x: Var, scale: ParamId, shift: ParamId, eps: f64) -> Var {
        let shape = self.shape(x);
        let statistics =
            self.standardised(x, Groups { groups: shape.n, inner: shape.width() }, eps);
        let columns = Groups { groups: shape.width(), inner: 1 };
        self.scaled(statistics.normal, columns, scale, shift)
    }

    /// Each group brought to mean 0 and variance 1.
    #[expect(clippy::cast_precision_loss, reason = "values have far fewer than 2^53 numbers")]
    fn standardised(&self, x: Var, groups: Groups, eps: f64) -> Statistics {
        let shape = self.shape(x);
        let share = F::of(groups.groups as f64 / shape.len() as f64);
        let eps = F::of(eps);
        let mean = self.keep(groups.groups, |arena, out| {
            groups.sums(arena.value(x).iter().copied(), out);
            for sum in out {
                *sum *= share;
            }
        });
        let variance = self.keep(groups.groups, |arena, out| {
            let means = arena.value(mean);
            let pairs = arena.value(x).iter().enumerate();
            let squares = pairs.map(|(i, &x)| {
                let deviation = x - means[i / groups.inner % groups.groups];
                deviation * deviation
            });
            groups.sums(squares, out);
            for sum in out {
                *sum *= share;
            }
        });
        let sums = self.keep(2 * groups.groups, |_, _| {});
        let normal = self.op_with(
            sums,
            shape,
            &[x],
            &[],
            |arena, _, out| {
                let (means, variances) = (arena.value(mean), arena.value(variance));
                for (i, (y, &x)) in out.iter_mut().zip(arena.value(x)).enumerate() {
                    let group = i / groups.inner % groups.groups;
                    *y = (x - means[group]) / (variances[group] + eps).sqrt();
                }
            },
            // dx = (dy - mean(dy) - y mean(y dy)) / σ, with means over the group.
            move |arena, sums, y, grad| {
                let (plain, weighted) = sums.split_at_mut(groups.groups);
                groups.sums(grad.iter().copied(), plain);
                groups.sums(grad.iter().zip(y).map(|(&g, &y)| g * y), weighted);
                arena.pass(x, |arena, out, add| {
                    let variances = arena.value(variance);
                    let terms = grad.iter().zip(y).enumerate();
                    for (out, (i, (&g, &y))) in out.iter_mut().zip(terms) {
                        let group = i / groups.inner % groups.groups;
                        let centred = g - share * plain[group] - y * share * weighted[group];
                        let new = centred / (variances[group] + eps).sqrt();
                        *out = if add { *out + new } else { new };
                    }
                });
            },
        );
        Statistics { mean, variance, normal }
    }

    /// `x` times the scale of its group, and its shift added.
    fn scaled(&self, x: Var, groups: Groups, scale: ParamId, shift: ParamId) -> Var {
        let shape: Shape = self.shape(x);
        self.op(
            shape,
            &[x],
            &[scale, shift],
            |arena, out| {
                let (scales, shifts) = (arena.params.value(scale), arena.params.value(shift));
                for (i, (y, &x)) in out.iter_mut().zip(arena.value(x)).enumerate() {
                    let group = i / groups.inner % groups.groups;
                    *y = x * scales[group] + shifts[group];
                }
            },
            move |arena, _, grad| {
                for (param, is_scale) in [(scale, true), (shift, false)] {
                    arena.learn(param, |arena, out, add| {
                        if !add {
                            out.fill(F::zero());
                        }
                        for (i, (&x, &g)) in arena.value(x).iter().zip(grad.iter()).enumerate() {
                            out[i / groups.inner % groups.groups] +=
                                if is_scale { g * x } else { g };
                        }
                    });
                }
                arena.pass(x, |arena, out, add| {
                    let scales = arena.params.value(scale);
                    for (i, (out, &g)) in out.iter_mut().zip(grad.iter()).enumerate() {
                        let new = g * scales[i / groups.inner % groups.groups];
                        *out = if add { *out + new } else { new };
                    }
                });
            },
        )
    }
}

struct Statistics {
    mean: Var,
    variance: Var,
    normal: Var,
}
