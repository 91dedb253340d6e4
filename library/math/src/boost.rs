//! Gradient boosting (Friedman, 2001): trees one after the other, each grown on what is left of the error.

use rand_chacha::ChaCha8Rng;

use crate::moments::{mean, real};
use crate::tree::{Growth, Sample, Tree, grow};

/// A sum of trees: of number or logit `o` of `O`, a constant and every `O`th tree from the `o`th on.
#[derive(Clone, Debug, PartialEq)]
pub struct Boosted {
    /// The constants: `[O]`.
    pub base: Vec<f64>,
    /// The trees, of one target each.
    pub trees: Vec<Tree>,
}

/// What is boosted, by the targets of data.
#[derive(Clone, Copy, Debug)]
pub enum Targets<'a> {
    /// Numbers: `[N, O]`, row by row, under squared error.
    Numbers(&'a [f64], usize),
    /// Classes: `[N]`, each below so many, under cross-entropy. Two have one logit, that of the second.
    Classes(&'a [usize], usize),
}

impl Boosted {
    /// The constants that say most without inputs: the mean, or the logarithms of the shares of classes.
    ///
    /// A class that no datum has is impossible, with −∞.
    ///
    /// # Errors
    /// If all data are of one class.
    pub fn constant(targets: &Targets<'_>) -> Result<Self, String> {
        let base = match *targets {
            Targets::Numbers(ys, width) => {
                let column = |o: usize| ys[o..].iter().step_by(width).copied().collect::<Vec<_>>();
                (0..width).map(|o| mean(&column(o))).collect()
            }
            Targets::Classes(classes, n_classes) => {
                let count = |k: usize| real(classes.iter().filter(|class| **class == k).count());
                let logs: Vec<f64> =
                    (0..n_classes).map(|k| (count(k) / real(classes.len())).ln()).collect();
                if logs.iter().filter(|log| log.is_finite()).count() < 2 {
                    return Err(ONE_CLASS.to_owned());
                }
                if n_classes == 2 { vec![logs[1] - logs[0]] } else { logs }
            }
        };
        Ok(Self { base, trees: Vec::new() })
    }

    /// The sums for inputs one after the other: `[N, O]`, row by row.
    #[must_use]
    pub fn values(&self, xs: &[f64], n_inputs: usize) -> Vec<f64> {
        let n_outputs = self.base.len();
        let mut values: Vec<f64> = Vec::new();
        for x in xs.chunks_exact(n_inputs) {
            let row = values.len();
            values.extend(&self.base);
            for (i, tree) in self.trees.iter().enumerate() {
                values[row + i % n_outputs] += tree.value(tree.leaf(x))[0];
            }
        }
        values
    }

    /// Adds a tree for each number or logit, grown on the gradient of the loss at the sums as they are; its leaves are
    /// the step of Newton's method there, times `rate`:
    ///
    /// ```text
    /// Σ (y − F) / n,   Σ (y − p) / Σ p (1 − p) of a sigmoid,   (K − 1)/K Σ (y − p) / Σ |y − p| (1 − |y − p|) of a softmax
    /// ```
    ///
    /// - `xs`: `[N, D]`, row by row, of which `sums` are [`Boosted::values`], which are updated.
    pub fn add(
        &mut self,
        (xs, n_inputs): (&[f64], usize),
        targets: &Targets<'_>,
        sums: &mut [f64],
        (how, rate): (Growth, f64),
        rng: &mut ChaCha8Rng,
    ) {
        let n_outputs = self.base.len();
        let rows = xs.len() / n_inputs;
        let left = targets.left(sums, n_outputs);
        for o in 0..n_outputs {
            let own: Vec<f64> = left[o..].iter().step_by(n_outputs).copied().collect();
            let sample = Sample { xs, n_inputs, ys: &own, n_targets: 1 };
            let mut tree = grow(&sample, (0..rows).collect(), how, rng);
            let leaves: Vec<usize> = xs.chunks_exact(n_inputs).map(|x| tree.leaf(x)).collect();
            let mut over_under = vec![(0.0, 0.0); tree.splits.len()];
            for (leaf, left) in leaves.iter().zip(&own) {
                over_under[*leaf].0 += left;
                over_under[*leaf].1 += targets.curvature(*left, n_outputs);
            }
            for (value, (over, under)) in tree.values.iter_mut().zip(over_under) {
                *value = if under > 0.0 { rate * over / under } else { 0.0 };
            }
            for (row, leaf) in leaves.into_iter().enumerate() {
                sums[row * n_outputs + o] += tree.value(leaf)[0];
            }
            self.trees.push(tree);
        }
    }
}

impl Targets<'_> {
    /// What is left of the targets: `y − F`, or `y − p`.
    fn left(&self, sums: &[f64], n_outputs: usize) -> Vec<f64> {
        match *self {
            Self::Numbers(ys, _) => ys.iter().zip(sums).map(|(y, f)| y - f).collect(),
            Self::Classes(classes, _) => {
                let rows = sums.chunks_exact(n_outputs).zip(classes);
                rows.flat_map(|(logits, class)| of_classes(logits, *class)).collect()
            }
        }
    }

    /// What a datum adds below the line of a leaf's step, by what is left of it.
    fn curvature(&self, left: f64, n_outputs: usize) -> f64 {
        match self {
            Self::Numbers(..) => 1.0,
            Self::Classes(..) => {
                let spread = left.abs() * (1.0 - left.abs());
                if n_outputs == 1 { spread } else { spread * real(n_outputs) / real(n_outputs - 1) }
            }
        }
    }
}

/// `y − p` of each logit.
fn of_classes(logits: &[f64], class: usize) -> Vec<f64> {
    let target = |k: usize| if k == class { 1.0 } else { 0.0 };
    if let [second] = logits {
        return vec![target(1) - 1.0 / (1.0 + (-second).exp())];
    }
    let shares = crate::policy::boltzmann(logits, 1.0);
    shares.into_iter().enumerate().map(|(k, p)| target(k) - p).collect()
}

/// Why there is no classifier.
pub const ONE_CLASS: &str =
    "the data are of fewer than two classes, of which none can be told apart";

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;

    use super::*;

    const STUMP: Growth = Growth { depth: 1, min_leaf: 1, tried: usize::MAX };

    fn boosted(xs: &[f64], targets: Targets<'_>, stages: usize, rate: f64) -> Boosted {
        let mut fit = Boosted::constant(&targets).expect("it has classes");
        let mut sums = fit.values(xs, 1);
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        for _ in 0..stages {
            fit.add((xs, 1), &targets, &mut sums, (STUMP, rate), &mut rng);
            assert_eq!(sums, fit.values(xs, 1));
        }
        fit
    }

    #[test]
    fn two_stages_by_hand() {
        // The mean is 2; what is left, −2 −2 1 3, splits in the middle into −2 and 2: half of that is added.
        // Then −1 −1 0 2 is left, which splits behind the third: ¾ (−⅔ − 2)² against (−1 − 1)².
        let (xs, ys) = ([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 3.0, 5.0]);
        let fit = boosted(&xs, Targets::Numbers(&ys, 1), 1, 0.5);
        assert_eq!(fit.values(&xs, 1), [1.0, 1.0, 3.0, 3.0]);
        let fit = boosted(&xs, Targets::Numbers(&ys, 1), 2, 0.5);
        let third = -1.0 / 3.0;
        let expected = [1.0 + third, 1.0 + third, 3.0 + third, 4.0];
        for (found, expected) in fit.values(&xs, 1).iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }

    #[test]
    fn one_stage_of_two_classes_by_hand() {
        // p = ¾ everywhere; the leaf of 0 has −¾ / (3/16) = −4, that of the others ¼ / (3/16) = 4/3.
        let xs = [0.0, 1.0, 2.0, 3.0];
        let fit = boosted(&xs, Targets::Classes(&[0, 1, 1, 1], 2), 1, 1.0);
        let (odds, found) = (3.0_f64.ln(), fit.values(&[0.0, 9.0], 1));
        assert!(
            (found[0] - odds + 4.0).abs() < 1e-12 && (found[1] - odds - 4.0 / 3.0).abs() < 1e-12
        );
    }

    #[test]
    fn one_stage_of_three_classes_by_hand() {
        // p = ½, ¼, ¼. The first class against the rest, behind the second: ⅔ (±½)/(½ · ½) = ±4/3.
        let xs = [0.0, 1.0, 2.0, 3.0];
        let fit = boosted(&xs, Targets::Classes(&[0, 0, 1, 2], 3), 1, 1.0);
        let found = fit.values(&[0.0], 1);
        assert!((found[0] - 0.5_f64.ln() - 4.0 / 3.0).abs() < 1e-12, "{found:?}");
        // The second is told apart behind the third, or behind the second; either leaf of 0 has −¼s: ⅔ (−¼)/(3/16).
        let absent = boosted(&xs, Targets::Classes(&[0, 0, 1, 1], 3), 3, 1.0);
        assert_eq!(absent.values(&[0.0], 1)[2], f64::NEG_INFINITY);
        assert!(Boosted::constant(&Targets::Classes(&[1, 1], 3)).is_err());
    }

    #[test]
    fn without_stages_it_is_the_mean_and_with_many_the_data() {
        let (xs, ys) = ([0.0, 1.0, 2.0, 3.0], [0.0, 0.5, 3.0, 5.5]);
        assert_eq!(boosted(&xs, Targets::Numbers(&ys, 1), 0, 0.5).values(&xs, 1), [2.25; 4]);
        let many = boosted(&xs, Targets::Numbers(&ys, 1), 200, 0.5).values(&xs, 1);
        assert!(many.iter().zip(ys).all(|(a, b)| (a - b).abs() < 1e-6), "{many:?}");
    }
}
