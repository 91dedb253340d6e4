//! Drawing plans ever nearer to the best of those drawn before.

use ivx_data::Misfit;
use ivx_math::moments::real;
use ivx_math::policy::{greedy, pick};
use ivx_op::{Facts, OpError, Wrong, declare};
use ivx_world::Luck;

use super::best::Best;
use super::{Objective, Planner, Planning, Space, sized};

declare! {
    /// The cross-entropy method (Rubinstein, 1999): in every round plans are drawn, number by number, and what the next
    /// are drawn from is what the best of them were like. The best plan of all rounds is kept.
    ///
    /// Real numbers are drawn from normals, brought back between the bounds: at first about the start, then with the
    /// means and standard deviations of the elites. Discrete ones are drawn evenly at first, then as often as elites had
    /// them. In each round the middle is tried besides: the start, then the means of the elites, or what most of them had.
    pub struct Cem = "cem" @ 1 {
        /// How many plans are drawn in a round.
        samples: usize = 100, in 1.0..=1e6;
        /// How many of the best the next round follows.
        elites: usize = 10, in 1.0..=1e6;
        /// How many rounds.
        rounds: usize = 5, in 1.0..=1e4;
        /// The standard deviation of the first round, in units of a plan's numbers; of no use to discrete ones.
        std: f64 = 1.0, in f64::MIN_POSITIVE..;
    }
    rule elites_are_drawn;
}

fn elites_are_drawn(facts: &Facts<'_>) -> Result<(), Wrong> {
    let (samples, elites) = (facts.arg::<usize>("samples"), facts.arg::<usize>("elites"));
    match samples.zip(elites) {
        Some((samples, elites)) if elites > samples => Err(Wrong {
            arg: "elites",
            message: format!("of {samples} plans there are no {elites} best"),
            help: "draw more, or follow fewer".to_owned(),
        }),
        _ => Ok(()),
    }
}

impl Planner for Cem {
    fn fits(&self, _: &Space, _: usize) -> Result<(), Misfit> {
        Ok(())
    }

    fn open(&self) -> Box<dyn Planning> {
        let &Self { samples, elites, rounds, std } = self;
        Box::new(Narrowing { samples, elites, rounds, std, ..Narrowing::default() })
    }
}

#[derive(Default)]
struct Narrowing {
    samples: usize,
    elites: usize,
    rounds: usize,
    std: f64,
    /// `[rows, samples + 1, len]`, the middle first.
    tried: Vec<f64>,
    worth: Vec<f64>,
    /// `[rows, len]`.
    middle: Vec<f64>,
    /// Standard deviations, `[rows, len]`; or how probable each of `k` choices is, `[rows, len, k]`.
    spread: Vec<f64>,
    /// The places of the plans of a problem, the best first.
    order: Vec<usize>,
}

impl Planning for Narrowing {
    fn plan(
        &mut self,
        of: &mut dyn Objective,
        plans: &mut [f64],
        worth: &mut [f64],
        luck: &mut Luck,
    ) -> Result<(), OpError> {
        let (rows, len, n) = (of.rows(), of.len(), self.samples + 1);
        let middle = sized(&mut self.middle, rows * len);
        middle.iter_mut().zip(&*plans).enumerate().for_each(|(i, (middle, start))| {
            *middle = of.space().clip(i % len, *start);
        });
        match of.space() {
            Space::Continuous { .. } => sized(&mut self.spread, rows * len).fill(self.std),
            Space::Discrete(k) => sized(&mut self.spread, rows * len * k).fill(1.0 / real(*k)),
        }
        let mut best = Best::none(plans, worth, len);
        sized(&mut self.worth, rows * n);
        for _ in 0..self.rounds {
            self.draw(of.space(), (rows, len), luck);
            of.worth(&self.tried, n, &mut self.worth);
            best.see(&self.tried, &self.worth);
            (0..rows).for_each(|row| self.follow(of.space(), (row, len)));
        }
        best.found()
    }
}

impl Narrowing {
    /// Draws the plans of a round.
    fn draw(&mut self, space: &Space, (rows, len): (usize, usize), luck: &mut Luck) {
        let n = self.samples + 1;
        let tried = sized(&mut self.tried, rows * n * len);
        for (row, middle) in self.middle.chunks_exact(len).enumerate() {
            tried[row * n * len..][..len].copy_from_slice(middle);
        }
        for (sample, i) in (1..n).flat_map(|sample| (0..len).map(move |i| (sample, i))) {
            let drawn = match space {
                Space::Continuous { .. } => luck.normal(),
                Space::Discrete(_) => luck.unit(),
            };
            for row in 0..rows {
                let at = row * len + i;
                tried[(row * n + sample) * len + i] = match space {
                    Space::Continuous { .. } => {
                        space.clip(i, self.middle[at] + self.spread[at] * drawn)
                    }
                    Space::Discrete(k) => real(pick(&self.spread[at * k..][..*k], drawn)),
                };
            }
        }
    }

    /// Follows the elites of a problem; where no plan is worth a number, nobody.
    fn follow(&mut self, space: &Space, (row, len): (usize, usize)) {
        let n = self.samples + 1;
        let (worth, order) = (&self.worth[row * n..][..n], &mut self.order);
        order.clear();
        order.extend((0..n).filter(|i| !worth[*i].is_nan()));
        order.sort_unstable_by(|a, b| worth[*b].total_cmp(&worth[*a]).then(a.cmp(b)));
        order.truncate(self.elites);
        if order.is_empty() {
            return;
        }
        let n_elites = real(order.len());
        for i in 0..len {
            let elites = order.iter().map(|sample| self.tried[(row * n + sample) * len + i]);
            let at = row * len + i;
            match space {
                Space::Continuous { .. } => {
                    let mean = elites.clone().sum::<f64>() / n_elites;
                    let squares = elites.map(|x| (x - mean).powi(2)).sum::<f64>();
                    (self.middle[at], self.spread[at]) = (mean, (squares / n_elites).sqrt());
                }
                Space::Discrete(k) => {
                    let shares = &mut self.spread[at * k..][..*k];
                    for (choice, share) in shares.iter_mut().enumerate() {
                        let count = elites.clone().filter(|x| *x == real(choice)).count();
                        *share = real(count) / n_elites;
                    }
                    self.middle[at] = real(greedy(shares));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What follows three draws and the middle, of one number: the middle and the spread.
    fn followed(space: &Space, tried: &[f64], worth: &[f64], elites: usize) -> (f64, Vec<f64>) {
        let mut all = Narrowing {
            samples: 3,
            elites,
            tried: tried.to_vec(),
            worth: worth.to_vec(),
            middle: vec![7.0],
            spread: vec![0.5; 3],
            ..Narrowing::default()
        };
        all.follow(space, (0, 1));
        (all.middle[0], all.spread)
    }

    #[test]
    fn elites_are_followed_by_hand() {
        let line = Space::Continuous { low: vec![-9.0], high: vec![9.0] };
        let nan = f64::NAN;
        // The best two are 1 and 3: their mean is 2, their standard deviation 1.
        let (middle, spread) = followed(&line, &[0.0, 1.0, 3.0, 9.0], &[0.0, 5.0, 4.0, nan], 2);
        assert_eq!((middle, spread[0]), (2.0, 1.0));
        // Fewer are worth a number than are to be followed; of none nothing follows.
        let (middle, spread) = followed(&line, &[0.0, 1.0, 3.0, 9.0], &[nan, 5.0, nan, nan], 2);
        assert_eq!((middle, spread[0]), (1.0, 0.0));
        assert_eq!(followed(&line, &[0.0; 4], &[nan; 4], 2), (7.0, vec![0.5; 3]));
        // Of the best three two are the second choice.
        let three = Space::Discrete(3);
        let (middle, shares) = followed(&three, &[0.0, 1.0, 1.0, 2.0], &[3.0, 2.0, 1.0, 0.0], 3);
        assert_eq!((middle, shares), (1.0, vec![1.0 / 3.0, 2.0 / 3.0, 0.0]));
    }
}
