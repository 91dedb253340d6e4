//! Data in two parts, one to learn from and one to be tested on.

use std::collections::BTreeMap;

use ivx_data::Dataset;
use ivx_op::{Ctx, Facts, One, Op, OpError, Shapes, Wrong, declare, record};
use rand::RngExt as _;
use rand::seq::SliceRandom as _;

record! {
    /// Data in two parts that have no observation in common.
    pub struct Split = "Split" {
        /// What is learnt from.
        train: Dataset;
        /// What is tested on.
        test: Dataset;
    }
}

declare! {
    /// Data in two parts: some observations, drawn without repetition, to be tested on, and the rest to learn from.
    ///
    /// Where targets are classes, each has its share of both parts, as nearly as whole observations allow. Fewer that are
    /// tested on are the first of more.
    pub struct SplitData = "split" @ 2, stochastic -> Split {
        /// The data.
        data: One<Dataset>;
        /// The share that is tested on; what is no whole number of observations is rounded up.
        test: f64 = 0.25, in 0.0..=1.0;
        /// Tells apart draws that must differ on one seed.
        stream: String = "main";
    }
    rule is_share;
    shapes both;
}

fn is_share(facts: &Facts<'_>) -> Result<(), Wrong> {
    let test = facts.arg::<f64>("test").unwrap_or(0.5);
    if test > 0.0 && test < 1.0 {
        return Ok(());
    }
    let message = format!("`test` is {test}, which leaves nothing on one side");
    Err(Wrong { arg: "test", message, help: "a share lies between 0 and 1".to_owned() })
}

/// The shapes of both parts: those of the data.
pub(crate) fn both(facts: &Facts<'_>) -> Option<Shapes> {
    let own = facts.shapes("data")?;
    let of = |part: &'static str| {
        own.iter().map(move |(name, shape)| (format!("{part}.{name}"), shape.clone()))
    };
    Some(of("train").chain(of("test")).collect())
}

impl Op for SplitData {
    fn run(&self, ctx: &Ctx) -> Result<Split, OpError> {
        let n = self.data.len();
        #[expect(
            clippy::cast_precision_loss,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "observations are far below 2^53"
        )]
        let n_test = (whole(n as f64 * self.test) as usize).min(n);
        if n_test == 0 || n_test == n {
            let why = format!("{n} observations in two parts leave nothing in one of them");
            return Err(OpError::Failed(why));
        }
        let mut rng = ctx.rng("split", &[&self.stream]);
        // Members of each class lie evenly on a line from 0 to 1: of any beginning of it each has its share. Of those that
        // lie at one place it is drawn who comes first.
        let mut line: Vec<(usize, usize, u64, usize)> = Vec::new();
        for mut members in groups(&self.data) {
            members.shuffle(&mut rng);
            let size = members.len();
            let places = members.into_iter().enumerate();
            line.extend(places.map(|(j, row)| (2 * j + 1, 2 * size, rng.random(), row)));
        }
        // (2j + 1) / 2size, without rounding.
        line.sort_by(|a, b| {
            (a.0 * b.1).cmp(&(b.0 * a.1)).then_with(|| (a.2, a.3).cmp(&(b.2, b.3)))
        });
        let place: Vec<usize> = line.into_iter().map(|(.., row)| row).collect();
        Ok(parts(&self.data, &place[..n_test]))
    }
}

/// What is no whole number is rounded up; 7 % of 100 are 7, though not in binary.
fn whole(n: f64) -> f64 {
    if (n - n.round()).abs() < 1e-9 * n { n.round() } else { n.ceil() }
}

/// Those that are tested on in the order in which they are given, and the rest in that of the data.
pub(crate) fn parts(data: &Dataset, test: &[usize]) -> Split {
    let mut is_test = vec![false; data.len()];
    for row in test {
        is_test[*row] = true;
    }
    let train: Vec<usize> = (0..data.len()).filter(|row| !is_test[*row]).collect();
    Split { train: data.pick(&train), test: data.pick(test) }
}

/// The observations of each class, classes in the order of their first appearance; all together where targets are no
/// classes, or several.
pub(crate) fn groups(data: &Dataset) -> Vec<Vec<usize>> {
    if data.form.classes.is_none() || !data.form.target.is_empty() {
        return vec![(0..data.len()).collect()];
    }
    let mut known: BTreeMap<u64, usize> = BTreeMap::new();
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (row, y) in data.y.iter().enumerate() {
        let group = *known.entry(y.to_bits()).or_insert_with(|| {
            groups.push(Vec::new());
            groups.len() - 1
        });
        groups[group].push(row);
    }
    groups
}

#[cfg(test)]
pub(crate) mod tests {
    use ivx_data::Form;

    use super::*;

    /// Observations whose inputs are their places, with so many of each class.
    pub(crate) fn of_classes(counts: &[usize]) -> Dataset {
        let y = counts.iter().enumerate().flat_map(|(class, n)| vec![class; *n]);
        #[expect(clippy::cast_precision_loss, reason = "they are few")]
        let y: Vec<f64> = y.map(|class| class as f64).collect();
        let x = (0..i32::try_from(y.len()).unwrap()).map(f64::from).collect();
        Dataset { form: Form { classes: Some(counts.len()), ..Form::default() }, x, y }
    }

    /// How many of each class there are.
    pub(crate) fn counts(data: &Dataset) -> Vec<usize> {
        let of = |class: usize| {
            #[expect(clippy::cast_precision_loss, reason = "they are few")]
            data.y.iter().filter(|y| **y == class as f64).count()
        };
        (0..data.form.classes.unwrap()).map(of).collect()
    }

    fn split(data: &Dataset, test: f64, seed: i64) -> Split {
        let split = SplitData { data: One(data.clone()), test, stream: "main".to_owned() };
        split.run(&Ctx::new("split", seed, None)).unwrap()
    }

    #[test]
    fn every_observation_is_in_one_part() {
        let data = Dataset::pairs((0..10).map(f64::from).collect(), vec![0.0; 10]);
        let found = split(&data, 0.25, 0);
        assert_eq!((found.test.len(), found.train.len()), (3, 7));
        let mut all = [&found.test.x[..], &found.train.x].concat();
        all.sort_by(f64::total_cmp);
        assert_eq!(all, data.x);
        assert!(found.train.x.is_sorted());
        assert_ne!(split(&data, 0.25, 1).test.x, found.test.x);
        let fewer = split(&data, 0.1, 0).test;
        assert_eq!(fewer.x, found.test.x[..1]);
    }

    #[test]
    fn every_class_has_its_share() {
        let data = of_classes(&[40, 20, 4]);
        for test in [0.25, 0.5] {
            let found = split(&data, test, 0);
            let expected = if test == 0.25 { [10, 5, 1] } else { [20, 10, 2] };
            assert_eq!(counts(&found.test), expected, "{test}");
        }
        let few = split(&data, 0.1, 0);
        assert_eq!((few.test.len(), counts(&few.test)), (7, vec![5, 2, 0]));
    }

    /// Of classes that have the same claim to a place, it is drawn which has it.
    #[test]
    fn no_class_is_always_left_out() {
        for (counts_of, test) in [(vec![4_u32; 20], 0.1), (vec![1; 12], 0.25), (vec![50; 3], 0.25)]
        {
            let data = of_classes(&counts_of.iter().map(|n| *n as usize).collect::<Vec<_>>());
            let seeds = (0..60).map(|seed| counts(&split(&data, test, seed).test));
            let tested = seeds.reduce(|all, one| {
                all.iter().zip(one).map(|(all, one)| all + one).collect::<Vec<usize>>()
            });
            let mean = 60.0 * test * f64::from(counts_of[0]);
            for n in tested.unwrap() {
                let n = f64::from(u32::try_from(n).unwrap());
                // Four standard deviations of so many draws, at most.
                assert!((n - mean).abs() < 4.0 * mean.sqrt(), "{n} and {mean} of {test}");
            }
        }
    }

    #[test]
    fn shares_that_are_whole_are_not_rounded() {
        let data = Dataset::pairs(vec![0.0; 100], vec![0.0; 100]);
        for (test, n) in [(0.07, 7), (0.14, 14), (0.28, 28), (0.55, 55), (0.56, 56), (0.071, 8)] {
            assert_eq!(split(&data, test, 0).test.len(), n, "{test}");
        }
    }

    #[test]
    fn nothing_is_left_empty() {
        let split = |n: usize| {
            let data = One(Dataset::pairs(vec![0.0; n], vec![0.0; n]));
            let split = SplitData { data, test: 0.5, stream: String::new() };
            split.run(&Ctx::new("split", 0, None)).map(|split| split.train.len())
        };
        assert_eq!(split(2), Ok(1));
        assert!(split(1).is_err() && split(0).is_err());
    }
}
