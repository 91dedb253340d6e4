//! What the parts of a loss were on average.

use ivx_op::State;

/// The means of the parts of a loss over the updates since they were asked for last.
#[derive(Clone, Debug)]
pub struct Means {
    names: Vec<&'static str>,
    sums: Vec<f64>,
    /// How many updates each sum is over.
    counts: Vec<u64>,
    /// Of the last update.
    last: f64,
}

impl Means {
    /// Of no update yet.
    #[must_use]
    pub fn new(names: &[&'static str]) -> Self {
        let n = names.len();
        Self { names: names.to_vec(), sums: vec![0.0; n], counts: vec![0; n], last: f64::NAN }
    }

    /// What the parts are called.
    #[must_use]
    pub fn names(&self) -> &[&'static str] {
        &self.names
    }

    /// Adds those of an update, from the first on.
    pub fn add(&mut self, parts: &[f64]) {
        self.sums.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
        self.counts.iter_mut().zip(parts).for_each(|(n, _)| *n += 1);
        self.last = parts[0];
    }

    /// Moves here what others counted, whose parts are the last of these.
    ///
    /// # Panics
    /// If they have other parts.
    pub fn gather(&mut self, others: &mut Self) {
        let from = self.names.len() - others.names.len();
        assert_eq!(self.names[from..], others.names, "the last parts are those of the others");
        let sums = self.sums[from..].iter_mut().zip(&mut others.sums);
        sums.for_each(|(own, other)| *own += std::mem::take(other));
        let counts = self.counts[from..].iter_mut().zip(&mut others.counts);
        counts.for_each(|(own, other)| *own += std::mem::take(other));
    }

    /// Whether all are numbers so far.
    #[must_use]
    pub fn are_finite(&self) -> bool {
        self.sums.iter().all(|sum| sum.is_finite())
    }

    /// The first part of the last update.
    #[must_use]
    pub fn last(&self) -> f64 {
        self.last
    }

    /// The means, which begin anew: not numbers where there was no update.
    #[must_use]
    pub fn take(&mut self) -> Vec<f64> {
        #[expect(clippy::cast_precision_loss, reason = "updates are far below 2^53")]
        let mean = |(sum, n): (&mut f64, &mut u64)| std::mem::take(sum) / std::mem::take(n) as f64;
        self.sums.iter_mut().zip(&mut self.counts).map(mean).collect()
    }

    /// Walks over the sums.
    pub fn state(&mut self, state: &mut State) {
        for (i, (sum, n)) in self.sums.iter_mut().zip(&mut self.counts).enumerate() {
            state.count(&format!("{i}.n"), n);
            state.real(&format!("{i}"), sum);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_part_is_a_mean_over_its_own_updates() {
        let (mut all, mut other) = (Means::new(&["a", "b", "c"]), Means::new(&["b", "c"]));
        all.add(&[4.0]);
        other.add(&[1.0, 10.0]);
        other.add(&[2.0, 20.0]);
        all.gather(&mut other);
        other.add(&[6.0, 60.0]);
        all.gather(&mut other);
        assert_eq!((all.take(), all.last()), (vec![4.0, 3.0, 30.0], 4.0));
        assert!(all.are_finite());
        all.add(&[1.0, f64::NAN]);
        assert!(!all.are_finite() && all.take()[1].is_nan());
        assert!(all.take().iter().all(|x| x.is_nan()) && other.take()[0].is_nan());
    }
}
