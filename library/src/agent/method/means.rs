//! What the parts of a loss were on average.

use ivx_op::State;

/// The means of the parts of a loss over the updates since they were asked for last.
#[derive(Clone, Debug)]
pub struct Means {
    names: &'static [&'static str],
    sums: Vec<f64>,
    n: u64,
    /// Of the last update.
    last: f64,
}

impl Means {
    /// Of no update yet.
    #[must_use]
    pub fn new(names: &'static [&'static str]) -> Self {
        Self { names, sums: vec![0.0; names.len()], n: 0, last: f64::NAN }
    }

    /// What the parts are called.
    #[must_use]
    pub fn names(&self) -> &'static [&'static str] {
        self.names
    }

    /// Adds those of an update.
    pub fn add(&mut self, parts: &[f64]) {
        self.sums.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
        self.n += 1;
        self.last = parts[0];
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
        let n = self.n as f64;
        self.n = 0;
        self.sums.iter_mut().map(|sum| std::mem::take(sum) / n).collect()
    }

    /// Walks over the sums.
    pub fn state(&mut self, state: &mut State) {
        state.count("n", &mut self.n);
        for (i, sum) in self.sums.iter_mut().enumerate() {
            state.real(&format!("{i}"), sum);
        }
    }
}
