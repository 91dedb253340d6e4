//! Trying what does not look best.

use ivx_nn::Schedule;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

/// ε-greedy: each action is drawn evenly with a probability that changes as an agent learns, and is the best one
/// otherwise.
#[derive(Debug)]
pub(crate) struct Explore<'a> {
    /// The probability.
    pub(crate) epsilon: &'a dyn Schedule,
    /// After how many steps it stays as it is.
    pub(crate) over: u64,
    /// For how many steps all actions are drawn.
    pub(crate) warm_up: u64,
    /// Where the draws come from.
    pub(crate) rng: ChaCha8Rng,
}

impl Explore<'_> {
    /// What is tried of `n` actions in each lane after `t` steps; none where the best is to be done.
    pub(crate) fn tried(&mut self, t: u64, n: usize, lanes: usize, tried: &mut Vec<Option<usize>>) {
        let epsilon =
            if t < self.warm_up { 1.0 } else { self.epsilon.at(t.min(self.over), self.over) };
        self.rng.set_stream(t);
        self.rng.set_word_pos(0);
        tried.clear();
        tried.extend((0..lanes).map(|_| {
            let tries = self.rng.random::<f64>() < epsilon;
            let drawn = self.rng.random_range(0..n);
            tries.then_some(drawn)
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivx_nn::Linear;
    use rand::SeedableRng as _;

    #[test]
    fn it_tries_as_often_as_its_schedule_says() {
        let (epsilon, rng) = (Linear { from: 1.0, to: 0.1 }, ChaCha8Rng::seed_from_u64(1));
        let mut explore = Explore { epsilon: &epsilon, over: 1000, warm_up: 100, rng };
        let mut tried = Vec::new();
        let mut share = |t: u64| {
            explore.tried(t, 4, 20_000, &mut tried);
            let share = |n: usize| ivx_math::moments::real(n) / 20_000.0;
            let found = share(tried.iter().flatten().count());
            let third = share(tried.iter().flatten().filter(|a| **a == 3).count());
            assert!((third - found / 4.0).abs() < 0.02);
            found
        };
        assert_eq!(share(99), 1.0);
        assert!((share(500) - 0.55).abs() < 0.02 && (share(5000) - 0.1).abs() < 0.01);
    }
}
