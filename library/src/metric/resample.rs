//! Seeds drawn anew, for claims about what is made of all of them.

use ivx_math::evidence::N_RESAMPLES;
use ivx_math::order::quantile;
use ivx_op::{Array, Ctx, Dim, Everything, Labels, Op, OpError, declare, is_missing};
use rand::RngExt as _;

use super::reduce::{SEED, named, reduce_rest};

/// The dimension of samples drawn anew.
pub(super) const RESAMPLE: &str = "resample";

declare! {
    /// What varies over seeds, as it is; with as many seeds drawn anew, with replacement, 1 000 times; and with each seed in
    /// turn given up for another one. With a reduction, what that makes of each.
    ///
    /// A claim about a mean or median over seeds puts it in the place of what is reduced, so that every number
    /// made of it is there for each resample. What has the same seeds is drawn alike.
    pub struct Resample = "resample" @ 1 -> Array [reduce x to resample] {
        /// What varies over `seed`.
        x: Everything<Array>;
        /// The reduction of each sample, by its name; empty for none.
        reduction: String = "";
        /// Over which it reduces.
        along: Vec<String> = Vec::<&str>::new();
        /// The share below, where the reduction is `quantile`.
        q: f64 = 0.5, in 0.0..=1.0;
        /// Whether seeds of which something is missing are left out.
        skip_missing: bool = false;
    }
}

impl Op for Resample {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        let x = Array::stack(&self.x.0).map_err(OpError::Failed)?;
        let d = x.dim(SEED).ok_or_else(|| OpError::Failed("there are no seeds".to_owned()))?;
        let n = x.dims[d].len();
        let labels: Vec<String> = (0..n).map(|i| x.dims[d].labels.text(i)).collect();
        let ctx = Ctx { seed: 0, member: None, ..*ctx };
        let mut rng = ctx.rng(RESAMPLE, &[&labels.join(" ")]);
        let draws = (0..N_RESAMPLES).map(|_| (0..n).map(|_| rng.random_range(0..n)).collect());
        let mut samples: Vec<Vec<usize>> = vec![(0..n).collect()];
        samples.extend(draws);
        let there: Vec<usize> = (0..n).filter(|seed| !lacks(&x, d, *seed)).collect();
        if self.skip_missing && !there.is_empty() && there.len() < n {
            // Seeds that are there on both sides of a claim stay drawn alike.
            let mut again = ctx.rng(RESAMPLE, &[&labels.join(" "), "again"]);
            for seed in samples[1..].iter_mut().flatten().filter(|seed| !there.contains(seed)) {
                *seed = there[again.random_range(0..there.len())];
            }
        }
        samples.extend(exchanges(n));

        let (block, inner) = ((n * x.strides()[d]).max(1), x.strides()[d]);
        let mut sampled = x.clone();
        let (mut values, mut dims) = (Vec::new(), Vec::new());
        for sample in &samples {
            let blocks = x.values.chunks(block).zip(sampled.values.chunks_mut(block));
            for (from, to) in blocks {
                for (to, i) in to.chunks_mut(inner.max(1)).zip(sample) {
                    to.copy_from_slice(&from[i * inner..(i + 1) * inner]);
                }
            }
            if self.reduction.is_empty() {
                values.extend_from_slice(&sampled.values);
                dims.clone_from(&sampled.dims);
            } else {
                let reduced = self.reduced(&sampled)?;
                values.extend(reduced.values);
                dims = reduced.dims;
            }
        }
        let resample = Dim::new(RESAMPLE, Labels::count(samples.len()));
        Ok(Array { dims: [resample].into_iter().chain(dims).collect(), values })
    }
}

impl Resample {
    fn reduced(&self, sample: &Array) -> Result<Array, OpError> {
        if self.reduction == "quantile" {
            return reduce_rest(sample, (&self.along, self.skip_missing), |xs| {
                quantile(xs, self.q)
            });
        }
        let missing = || OpError::Failed(format!("no reduction is called `{}`", self.reduction));
        reduce_rest(
            sample,
            (&self.along, self.skip_missing),
            named(&self.reduction).ok_or_else(missing)?,
        )
    }
}

/// Whether something of a seed is missing.
fn lacks(x: &Array, d: usize, seed: usize) -> bool {
    x.picked(d, &[seed]).values.iter().any(|x| is_missing(*x))
}

/// All samples in which one seed gives way to another, those of the first seed first; where there are many, to so many
/// that follow it.
fn exchanges(n: usize) -> impl Iterator<Item = Vec<usize>> {
    let others = (N_RESAMPLES / n).clamp(1, n.max(2) - 1);
    (0..n).flat_map(move |i| {
        (1..=others).map(move |step| {
            let mut sample: Vec<usize> = (0..n).collect();
            sample[i] = (i + step) % n;
            sample
        })
    })
}

#[cfg(test)]
mod tests {
    use ivx_op::{Gathered, MISSING};

    use super::*;

    fn resampled(values: Vec<f64>) -> Array {
        let seed = Dim::new(SEED, Labels::count(values.len()));
        let values = values.into_iter().map(Array::scalar).collect();
        let x = Everything(Gathered { dims: vec![seed], values, name: String::new() });
        let resample = Resample {
            x,
            reduction: String::new(),
            along: Vec::new(),
            q: 0.5,
            skip_missing: false,
        };
        resample.run(&Ctx::new("resample", 0, None)).expect("it has seeds")
    }

    #[test]
    fn a_seed_that_is_missing_is_drawn_where_it_is_not_left_out() {
        let mean = |skip_missing| {
            let seed = Dim::new(SEED, Labels::count(3));
            let values = [1.0, MISSING, 5.0].map(Array::scalar).to_vec();
            let x = Everything(Gathered { dims: vec![seed], values, name: String::new() });
            let (reduction, along) = ("mean".to_owned(), vec![SEED.to_owned()]);
            let resample = Resample { x, reduction, along, q: 0.5, skip_missing };
            resample.run(&Ctx::new("resample", 0, None)).expect("it has seeds").values
        };
        let kept = mean(true);
        assert_eq!(kept[0], 3.0);
        assert!(kept[1..=N_RESAMPLES].iter().all(|x| (1.0..=5.0).contains(x)));
        assert!(is_missing(mean(false)[0]));
    }

    #[test]
    fn what_has_the_same_seeds_is_drawn_alike_and_first_as_it_is() {
        let (x, y) = (resampled(vec![1.0, 2.0, 3.0]), resampled(vec![10.0, 20.0, 30.0]));
        assert_eq!(x.values[..3], [1.0, 2.0, 3.0]);
        assert!(x.values.iter().zip(&y.values).all(|(x, y)| x * 10.0 == *y));
        let of_three = x.values[3..3 * (N_RESAMPLES + 1)]
            .chunks(3)
            .filter(|drawn| *drawn == [2.0, 2.0, 2.0])
            .count();
        // One in 27: 37 of 1 000, and by chance hardly 18 more or less.
        assert!((19..=55).contains(&of_three), "{of_three}");
        assert_eq!(x.dims.iter().map(Dim::len).collect::<Vec<_>>(), [N_RESAMPLES + 7, 3]);
        assert_eq!(x.values[3 * (N_RESAMPLES + 1)..][..6], [2.0, 2.0, 3.0, 3.0, 2.0, 3.0]);
    }
}
