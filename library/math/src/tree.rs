//! Trees of decisions (Breiman, Friedman, Olshen and Stone, 1984).

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use crate::moments::real;

/// A tree: its nodes, each behind the one that leads to it, with the root first.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Tree {
    /// Where each node leads; none for a leaf.
    pub splits: Vec<Option<Split>>,
    /// The mean of the targets that came to each node: `[nodes, T]`, row by row.
    pub values: Vec<f64>,
}

/// A question about one input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split {
    /// Which input.
    pub input: usize,
    /// Inputs up to this go to `below`, and others to `above`.
    pub at: f64,
    /// A node.
    pub below: usize,
    /// Another.
    pub above: usize,
}

impl Tree {
    /// The leaf that an input comes to.
    #[must_use]
    pub fn leaf(&self, x: &[f64]) -> usize {
        let mut node = 0;
        while let Some(split) = self.splits[node] {
            node = if x[split.input] <= split.at { split.below } else { split.above };
        }
        node
    }

    /// The targets of a node.
    #[must_use]
    pub fn value(&self, node: usize) -> &[f64] {
        let width = self.values.len() / self.splits.len();
        &self.values[node * width..][..width]
    }
}

/// What a tree is grown on.
#[derive(Clone, Copy, Debug)]
pub struct Sample<'a> {
    /// Inputs: `[N, D]`, row by row.
    pub xs: &'a [f64],
    /// `D`.
    pub n_inputs: usize,
    /// Targets: `[N, T]`; of classes 1 for that of a datum and 0 for the others.
    pub ys: &'a [f64],
    /// `T`.
    pub n_targets: usize,
}

/// How far a tree is grown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Growth {
    /// How many splits lead to a leaf at most; 0 for as many as there are.
    pub depth: usize,
    /// How many data a leaf has at least.
    pub min_leaf: usize,
    /// Of how many inputs, drawn anew for each node, the best split is taken: more only where these are all constant.
    pub tried: usize,
}

impl Sample<'_> {
    fn x(&self, place: usize, input: usize) -> f64 {
        self.xs[place * self.n_inputs + input]
    }

    fn y(&self, place: usize) -> &[f64] {
        &self.ys[place * self.n_targets..][..self.n_targets]
    }

    fn mean(&self, places: &[usize]) -> Vec<f64> {
        let first = self.y(places[0]);
        // Summed from the first on, equal targets have their own mean.
        let mean = |t: usize| {
            let above: f64 = places.iter().map(|&place| self.y(place)[t] - first[t]).sum();
            first[t] + above / real(places.len())
        };
        (0..self.n_targets).map(mean).collect()
    }

    fn is_pure(&self, places: &[usize]) -> bool {
        places.iter().all(|&place| self.y(place) == self.y(places[0]))
    }
}

/// A tree whose splits lower the squared error most, one after the other:
///
/// ```text
/// max over inputs and places of  n_l n_r / (n_l + n_r) ‖ȳ_l − ȳ_r‖²
/// ```
///
/// Of targets that are 1 for a class and 0 for others, that is `n` times what Gini's impurity is lowered by. Places of
/// splits are half-way between data. The first of equal splits is taken, in the order of inputs as drawn, from below.
///
/// - `places`: which data it is grown on, repetitions included.
///
/// # Panics
/// If there are no data.
#[must_use]
pub fn grow(
    sample: &Sample<'_>,
    mut places: Vec<usize>,
    how: Growth,
    rng: &mut ChaCha8Rng,
) -> Tree {
    assert!(!places.is_empty(), "a tree of some data");
    let mut tree = Tree { splits: vec![None], values: sample.mean(&places) };
    let mut open = vec![(0, 0..places.len(), 0)];
    while let Some((node, range, depth)) = open.pop() {
        let own = &mut places[range.clone()];
        if how.depth > 0 && depth == how.depth {
            continue;
        }
        let Some((input, at)) = best_split(sample, own, how, rng) else { continue };
        own.sort_by_key(|&place| sample.x(place, input) > at);
        let middle = range.start + own.partition_point(|&place| sample.x(place, input) <= at);
        let (below, above) = (tree.splits.len(), tree.splits.len() + 1);
        tree.splits[node] = Some(Split { input, at, below, above });
        for (child, range) in [(below, range.start..middle), (above, middle..range.end)] {
            tree.splits.push(None);
            tree.values.extend(sample.mean(&places[range.clone()]));
            open.push((child, range, depth + 1));
        }
    }
    tree
}

/// The input and the place of the best split; none where there is nothing to split.
fn best_split(
    sample: &Sample<'_>,
    places: &[usize],
    how: Growth,
    rng: &mut ChaCha8Rng,
) -> Option<(usize, f64)> {
    if places.len() < 2 * how.min_leaf.max(1) || sample.is_pure(places) {
        return None;
    }
    let mean = sample.mean(places);
    let mut inputs: Vec<usize> = (0..sample.n_inputs).collect();
    let mut best: Option<(f64, usize, f64)> = None;
    let mut n_tried = 0;
    for i in 0..inputs.len() {
        if how.tried < inputs.len() {
            let drawn = rng.random_range(i..inputs.len());
            inputs.swap(i, drawn);
        }
        let Some(found) = best_of_input(sample, places, inputs[i], how.min_leaf, &mean) else {
            continue;
        };
        n_tried += 1;
        if let Some((worth, at)) = found
            && best.is_none_or(|(most, ..)| worth > most)
        {
            best = Some((worth, inputs[i], at));
        }
        if n_tried >= how.tried && best.is_some() {
            break;
        }
    }
    best.map(|(_, input, at)| (input, at))
}

/// What the best split of one input is worth, and its place, where leaves are large enough; none where it is constant.
#[expect(clippy::option_option, reason = "an input that is not constant counts as tried")]
fn best_of_input(
    sample: &Sample<'_>,
    places: &[usize],
    input: usize,
    min_leaf: usize,
    mean: &[f64],
) -> Option<Option<(f64, f64)>> {
    let mut sorted: Vec<(f64, usize)> =
        places.iter().map(|&place| (sample.x(place, input), place)).collect();
    sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
    let n = sorted.len();
    if sorted[0].0 == sorted[n - 1].0 {
        return None;
    }
    let mut best: Option<(f64, f64)> = None;
    // What lies below is above the mean by as much as what lies above is below it.
    let mut above_mean = vec![0.0; mean.len()];
    for n_below in 1..n {
        let (low, place) = sorted[n_below - 1];
        for ((sum, y), mean) in above_mean.iter_mut().zip(sample.y(place)).zip(mean) {
            *sum += y - mean;
        }
        let high = sorted[n_below].0;
        if low == high || n_below < min_leaf || n - n_below < min_leaf {
            continue;
        }
        let squares: f64 = above_mean.iter().map(|sum| sum * sum).sum();
        let worth = squares * (1.0 / real(n_below) + 1.0 / real(n - n_below));
        if best.is_none_or(|(most, _)| worth > most) {
            let middle = low + (high - low) / 2.0;
            best = Some((worth, if middle < high { middle } else { low }));
        }
    }
    Some(best)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;

    use super::*;

    fn grown(xs: &[f64], n_inputs: usize, ys: &[f64], how: Growth) -> Tree {
        let sample = Sample { xs, n_inputs, ys, n_targets: ys.len() * n_inputs / xs.len() };
        let places = (0..xs.len() / n_inputs).collect();
        grow(&sample, places, how, &mut ChaCha8Rng::seed_from_u64(0))
    }

    const FULL: Growth = Growth { depth: 0, min_leaf: 1, tried: usize::MAX };

    #[test]
    fn the_first_split_by_hand() {
        // n_l n_r / n (ȳ_l − ȳ_r)² is ¾ (8/3)² behind the first, 4² behind the second and ¾ 4² behind the third.
        let (xs, ys) = ([0.0, 1.0, 3.0, 4.0], [0.0, 0.0, 3.0, 5.0]);
        let stump = grown(&xs, 1, &ys, Growth { depth: 1, ..FULL });
        assert_eq!(stump.splits[0], Some(Split { input: 0, at: 2.0, below: 1, above: 2 }));
        assert_eq!(stump.values, [2.0, 0.0, 4.0]);
        assert_eq!(stump.value(stump.leaf(&[2.0])), [0.0]);
        assert_eq!(stump.value(stump.leaf(&[2.1])), [4.0]);
        // A leaf of three leaves nothing to split.
        assert_eq!(grown(&xs, 1, &ys, Growth { min_leaf: 3, ..FULL }).splits, [None]);
        assert_eq!(grown(&xs, 1, &ys, Growth { min_leaf: 2, ..FULL }), stump);
    }

    #[test]
    fn distinct_rows_are_fitted_exactly() {
        // No single split of an exclusive or lowers the error.
        let xor = grown(&[0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0], 2, &[0.1, 0.3, 0.3, 0.1], FULL);
        for (x, y) in [([0.0, 0.0], 0.1), ([0.0, 1.0], 0.3), ([1.0, 0.0], 0.3), ([1.0, 1.0], 0.1)] {
            assert_eq!(xor.value(xor.leaf(&x)), [y]);
        }
    }

    #[test]
    fn the_input_that_tells_most_is_asked() {
        // The second input separates the classes, the first does not.
        let xs = [0.0, 5.0, 1.0, 1.0, 2.0, 6.0, 3.0, 2.0];
        let ys = [1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0];
        let tree = grown(&xs, 2, &ys, FULL);
        let split = tree.splits[0].expect("it is no leaf");
        assert_eq!((split.input, split.at, tree.splits.len()), (1, 3.5, 3));
        assert_eq!(tree.value(0), [0.5, 0.5]);
        assert_eq!(tree.value(tree.leaf(&[0.0, 9.0])), [1.0, 0.0]);
    }

    #[test]
    fn equal_rows_share_a_leaf_and_constant_inputs_are_passed_over() {
        let xs = [7.0, 0.0, 7.0, 0.0, 7.0, 1.0];
        for tried in [1, 2] {
            let tree = grown(&xs, 2, &[1.0, 2.0, 9.0], Growth { tried, ..FULL });
            assert_eq!(tree.values, [4.0, 1.5, 9.0], "{tree:?}");
        }
    }
}
