//! A sequence to be remembered.

use ivx_data::Form;
use ivx_op::declare;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::Task;

declare! {
    /// The copying problem (Hochreiter and Schmidhuber, 1997): symbols are shown one after the other, then
    /// none for a while, and then they are to be named in the same order.
    ///
    /// An input has `2 length + delay` steps, each with a 1 for the symbol shown, or for none. The
    /// target of each step is the symbol to be named, or none: one of `symbols + 1` classes.
    pub struct Copying = "copying" @ 1 {
        /// How many symbols are to be remembered.
        length: usize = 3, in 1.0..=1e3;
        /// How many steps lie between.
        delay: usize = 14, in 0.0..=1e4;
        /// How many symbols there are to choose from.
        symbols: usize = 4, in 1.0..=1e3;
    }
}

impl Copying {
    fn steps(&self) -> usize {
        2 * self.length + self.delay
    }
}

impl Task for Copying {
    fn form(&self) -> Form {
        let kinds = self.symbols + 1;
        Form {
            input: vec![self.steps(), kinds],
            target: vec![self.steps()],
            classes: Some(kinds),
            ..Form::default()
        }
    }

    fn draw(&self, rng: &mut ChaCha8Rng) -> (Vec<f64>, Vec<f64>) {
        let (steps, none) = (self.steps(), self.symbols);
        let mut shown = vec![none; steps];
        let mut named = shown.clone();
        for i in 0..self.length {
            let symbol = rng.random_range(0..self.symbols);
            shown[i] = symbol;
            named[self.length + self.delay + i] = symbol;
        }
        let mut x = vec![0.0; steps * (none + 1)];
        for (step, symbol) in x.chunks_exact_mut(none + 1).zip(&shown) {
            step[*symbol] = 1.0;
        }
        #[expect(clippy::cast_precision_loss, reason = "symbols are few")]
        let y = named.into_iter().map(|symbol| symbol as f64).collect();
        (x, y)
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;

    use super::*;

    #[test]
    fn what_was_shown_is_asked_for_at_the_end() {
        let task = Copying { length: 2, delay: 3, symbols: 4 };
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let mut seen = Vec::new();
        for _ in 0..50 {
            let (x, y) = task.draw(&mut rng);
            let shown: Vec<usize> =
                x.chunks(5).map(|step| step.iter().position(|x| *x == 1.0).unwrap()).collect();
            assert_eq!(x.iter().sum::<f64>(), 7.0);
            let class = |i: usize| f64::from(u8::try_from(shown[i]).unwrap());
            assert_eq!(y, [4.0, 4.0, 4.0, 4.0, 4.0, class(0), class(1)]);
            assert!(shown[..2].iter().all(|s| *s < 4) && shown[2..].iter().all(|s| *s == 4));
            seen.push((shown[0], shown[1]));
        }
        seen.sort_unstable();
        seen.dedup();
        assert!(seen.len() > 12, "most pairs of symbols come up");
    }
}
