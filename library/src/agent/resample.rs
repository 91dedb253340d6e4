//! Which episodes each member of an ensemble learns from (Remark 2.7).

use std::ops::Range;

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

/// Which of the steps of an update each member learns from, and how often: as often as it drew their group when it drew as
/// many groups as there are, with replacement, which is `Poisson(1)` times (Oza and Russell, 2001). For one group it is the
/// same in every update. One member alone learns from all.
///
/// Groups are episodes, or steps in a row: targets of temporal differences look at the next step, and where members had
/// steps by themselves, those of a third of them were of steps that the member never learned from, and diverged.
#[derive(Debug)]
pub(super) struct Resample {
    rng: ChaCha8Rng,
    kept: Vec<Vec<usize>>,
}

impl Resample {
    pub(super) fn new(rng: ChaCha8Rng, members: usize) -> Self {
        Self { rng, kept: vec![Vec::new(); members] }
    }

    pub(super) fn members(&self) -> usize {
        self.kept.len()
    }

    /// Looks at the steps of an update.
    ///
    /// - `groups`: the group of each.
    pub(super) fn keep(&mut self, groups: &(impl Iterator<Item = u64> + Clone)) {
        let alone = self.members() == 1;
        for (m, kept) in (0..).zip(&mut self.kept) {
            self.rng.set_stream(m);
            kept.clear();
            for (place, group) in groups.clone().enumerate() {
                self.rng.set_word_pos(u128::from(group) * 2);
                let times = if alone { 1 } else { times(self.rng.random()) };
                kept.extend(std::iter::repeat_n(place, times));
            }
        }
    }

    /// The places of the steps that member `m` learns from among these; all where it has none.
    pub(super) fn within(&self, m: usize, places: &Range<usize>) -> Vec<usize> {
        let own: Vec<usize> = self.kept[m].iter().copied().filter(|i| places.contains(i)).collect();
        if own.is_empty() { places.clone().collect() } else { own }
    }
}

/// The number of a Poisson distribution of mean 1 below which lies a share `u` of it.
fn times(u: f64) -> usize {
    let (mut n, mut share) = (0, (-1.0_f64).exp());
    let mut below = share;
    while u >= below && n < 12 {
        n += 1;
        share /= ivx_math::moments::real(n);
        below += share;
    }
    n
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;

    use super::*;

    #[test]
    fn members_learn_from_other_groups_and_always_from_the_same() {
        let mut two = Resample::new(ChaCha8Rng::seed_from_u64(1), 2);
        let n = 20_000;
        two.keep(&(0..n));
        let all = 0..20_000;
        let (a, b) = (two.within(0, &all), two.within(1, &all));
        for own in [&a, &b] {
            assert!(own.len().abs_diff(20_000) < 500, "{}", own.len());
            let never = 20_000 - own.windows(2).filter(|pair| pair[0] != pair[1]).count() - 1;
            // 1/e of them are never learned from.
            assert!(never.abs_diff(7_358) < 250, "{never}");
        }
        let both = a.iter().filter(|i| b.binary_search(i).is_ok()).count();
        assert!(both.abs_diff(12_642) < 500, "{both}");
        // In another order it is the same groups.
        two.keep(&(0..n).rev());
        let mut mirrored: Vec<usize> = two.within(0, &all).iter().map(|i| 19_999 - i).collect();
        mirrored.sort_unstable();
        assert_eq!(mirrored, a);
        assert_eq!(two.within(0, &(5..9)).iter().filter(|i| !(5..9).contains(*i)).count(), 0);
    }

    #[test]
    fn one_alone_learns_from_all() {
        let mut one = Resample::new(ChaCha8Rng::seed_from_u64(1), 1);
        one.keep(&(10..14));
        assert_eq!(one.within(0, &(1..3)), [1, 2]);
    }

    #[test]
    fn times_by_hand() {
        // 1/e = 0.3679, 2/e = 0.7358, 2.5/e = 0.9197.
        assert_eq!([0.0, 0.36, 0.37, 0.73, 0.74, 0.91, 0.92].map(times), [0, 0, 1, 1, 2, 2, 3]);
        let none =
            Resample { kept: vec![vec![7]], ..Resample::new(ChaCha8Rng::seed_from_u64(1), 1) };
        assert_eq!(none.within(0, &(0..2)), [0, 1], "who has none has all");
    }
}
