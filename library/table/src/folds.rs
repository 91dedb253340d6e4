//! Data in as many parts as there are folds, each of which is tested on once.

use ivx_data::Dataset;
use ivx_op::{Ctx, Facts, One, Op, OpError, Wrong, declare};
use rand::seq::SliceRandom as _;

use crate::split::{Split, both, groups, parts};

declare! {
    /// One fold of `k`: the part of the data that is tested on in it, and the rest to learn from. Each observation is
    /// tested on in one of the folds, which `axis fold = 0..5` goes through.
    ///
    /// The folds of one seed are parts of one drawing. Where targets are classes, each has its share of every fold, to
    /// within one observation.
    pub struct Folds = "folds" @ 1, stochastic -> Split {
        /// The data.
        data: One<Dataset>;
        /// How many folds there are.
        k: usize = 5, in 2.0..=1e6;
        /// Which this is, from 0.
        fold: usize, in 0.0..=1e6;
        /// Tells apart draws that must differ on one seed.
        stream: String = "main";
    }
    rule is_one_of_k;
    shapes both;
}

fn is_one_of_k(facts: &Facts<'_>) -> Result<(), Wrong> {
    let (Some(k), Some(fold)) = (facts.arg::<usize>("k"), facts.arg::<usize>("fold")) else {
        return Ok(());
    };
    if fold < k {
        return Ok(());
    }
    let message = format!("there is no fold {fold} of {k}: they are counted from 0");
    Err(Wrong { arg: "fold", message, help: format!("write `axis fold = 0..{k}`") })
}

impl Op for Folds {
    fn run(&self, ctx: &Ctx) -> Result<Split, OpError> {
        let (n, k) = (self.data.len(), self.k);
        if k > n {
            return Err(OpError::Failed(format!("{n} observations make no {k} folds")));
        }
        let mut groups = groups(&self.data);
        let largest = groups.iter().map(Vec::len).max().unwrap_or_default();
        if k > largest {
            let why = format!("{k} folds are more than any class has members: {largest} at most");
            return Err(OpError::Failed(why));
        }
        let mut rng = ctx.rng("folds", &[&self.stream]);
        // Observations of the first class lie before those of the second, and so on, and go to the folds in turn.
        let mut test = Vec::new();
        let mut before = 0;
        for members in &mut groups {
            members.shuffle(&mut rng);
            let of = |fold: usize| {
                (before + members.len()).saturating_sub(fold).div_ceil(k)
                    - usize::saturating_sub(before, fold).div_ceil(k)
            };
            let from: usize = (0..self.fold).map(of).sum();
            test.extend_from_slice(&members[from..from + of(self.fold)]);
            before += members.len();
        }
        test.sort_unstable();
        Ok(parts(&self.data, &test))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::split::tests::{counts, of_classes};

    fn fold(data: &Dataset, k: usize, fold: usize) -> Split {
        let folds = Folds { data: One(data.clone()), k, fold, stream: "main".to_owned() };
        folds.run(&Ctx::new("folds", 0, None)).unwrap()
    }

    #[test]
    fn every_observation_is_tested_on_once() {
        for data in [
            Dataset::pairs((0..11).map(f64::from).collect(), vec![0.0; 11]),
            of_classes(&[5, 4, 2]),
        ] {
            let folds: Vec<Split> = (0..3).map(|i| fold(&data, 3, i)).collect();
            let mut all: Vec<f64> = folds.iter().flat_map(|fold| fold.test.x.clone()).collect();
            all.sort_by(f64::total_cmp);
            assert_eq!(all, data.x);
            for fold in &folds {
                assert_eq!(fold.train.len() + fold.test.len(), 11);
                assert!(fold.test.x.iter().all(|x| !fold.train.x.contains(x)));
            }
            assert!(folds.iter().map(|fold| fold.test.len()).eq([4, 4, 3]));
        }
    }

    #[test]
    fn every_class_has_its_share_of_every_fold() {
        // As StratifiedKFold(3) has it: y sorted, every third of 0 0 0 0 0 1 1 1 1 2 2.
        let found: Vec<_> =
            (0..3).map(|i| counts(&fold(&of_classes(&[5, 4, 2]), 3, i).test)).collect();
        assert_eq!(found, [[2, 1, 1], [2, 1, 1], [1, 2, 0]]);
    }

    #[test]
    fn too_many_folds_are_refused() {
        let run = |data: Dataset, k| {
            let folds = Folds { data: One(data), k, fold: 0, stream: String::new() };
            folds.run(&Ctx::new("folds", 0, None)).map(|fold| fold.test.len())
        };
        assert_eq!(run(of_classes(&[3, 1]), 3), Ok(2));
        assert!(run(of_classes(&[3, 3]), 4).is_err());
        assert!(run(Dataset::pairs(vec![0.0; 3], vec![0.0; 3]), 4).is_err());
    }
}
