//! Claims: whether measures relate as a spec says.

use ivx_op::{Array, Ctx, Dim, Everything, Finding, Op, OpError, Outcome, Verdict, declare};

use super::broadcast::broadcast;
use super::reduce::Groups;
use crate::math::interval::{bootstrap, student_t};
use crate::math::moments::mean;

/// From this many seeds on, the interval is the bootstrap's and not Student's.
const BOOTSTRAP_SEEDS: usize = 20;

declare! {
    /// Whether two measures relate as claimed, at every coordinate but `seed`.
    ///
    /// With a dimension `seed`, differences are paired, and the claim holds when the interval of
    /// their mean lies on the claimed side and fails when it lies on the other. The interval is
    /// Student's t below 20 seeds and a percentile bootstrap of 10 000 resamples from 20 on; below
    /// 5 seeds the claim is undecided. `==` and `!=` ask whether all differences are exactly 0;
    /// `==` within a tolerance `t`, whether the interval lies in `[−t, t]`, and it fails when
    /// they are apart. Without `seed` the numbers compare plainly, and within a tolerance if the
    /// difference is at most `t`. Equal infinities do not differ. Sides that rest on fewer than 5 seeds decide nothing either, and
    /// neither does what is not a number. Where differences are infinite there may be no interval.
    pub struct Claim = "claim" @ 6 -> Verdict {
        /// The left side.
        left: Everything<Array>;
        /// The right side.
        right: Everything<Array>;
        /// One of `<`, `<=`, `>`, `>=`, `==`, `!=`.
        relation: String;
        /// How often such intervals hold the true mean.
        confidence: f64 = 0.95, in 0.5..=0.999;
        /// How far apart the sides of `==` may be, in their unit.
        within: f64 = 0.0, in 0.0..;
        /// How many seeds the sides rest on, by the side with fewer; 0 where nothing draws.
        seeds: usize = 0;
    }
}

impl Op for Claim {
    fn run(&self, ctx: &Ctx) -> Result<Verdict, OpError> {
        let relation = Relation::named(&self.relation)?;
        let left = Array::stack(&self.left.0).map_err(OpError::Failed)?;
        let right = Array::stack(&self.right.0).map_err(OpError::Failed)?;
        let differences = broadcast(&left, &right, difference)?;

        let paired = differences.dim("seed").is_some();
        let over = if paired { vec!["seed".to_owned()] } else { vec![] };
        let groups = Groups::of(&differences, &over)?;
        let axes: Vec<&Dim> = groups.kept.iter().map(|&d| &differences.dims[d]).collect();
        let findings = groups.starts.iter().enumerate().map(|(i, &start)| {
            let differences = groups.gather(&differences, start);
            let at = coordinate(&axes, i);
            if paired {
                self.over_seeds(relation, &differences, at, ctx)
            } else {
                let estimate = differences[0];
                let (outcome, n) = if self.lacks_seeds() {
                    (Outcome::Undecided, self.seeds)
                } else {
                    (relation.judge(estimate, estimate, self.within), 0)
                };
                Finding { at, outcome, estimate, interval: None, n, within: self.within }
            }
        });
        Ok(Verdict { findings: findings.collect() })
    }
}

/// How far the left side is above the right: equal infinities do not differ.
fn difference(left: f64, right: f64) -> f64 {
    if left == right { 0.0 } else { left - right }
}

impl Claim {
    /// Whether a side rests on too few seeds.
    fn lacks_seeds(&self) -> bool {
        (1..Finding::MIN_SEEDS).contains(&self.seeds)
    }

    /// The finding from one difference a seed.
    fn over_seeds(
        &self,
        relation: Relation,
        differences: &[f64],
        at: Vec<(String, String)>,
        ctx: &Ctx,
    ) -> Finding {
        let estimate = mean(differences);
        let n = if self.lacks_seeds() { self.seeds } else { differences.len() };
        let finding =
            |outcome, interval| Finding { at, outcome, estimate, interval, n, within: self.within };
        if n < Finding::MIN_SEEDS {
            return finding(Outcome::Undecided, None);
        }
        if matches!(relation, Relation::Equal | Relation::Unequal) && self.within == 0.0 {
            let furthest = differences.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()));
            let furthest = furthest.expect("a group is not empty");
            return finding(relation.judge(furthest, furthest, 0.0), None);
        }
        let (low, high) = if n < BOOTSTRAP_SEEDS {
            student_t(differences, self.confidence)
        } else {
            // One stream for every claim and coordinate: a claim is not stochastic.
            let mut rng = Ctx { seed: 0, member: None, ..*ctx }.rng("bootstrap", &[]);
            bootstrap(differences, self.confidence, &mut rng)
        };
        let known = !low.is_nan() && !high.is_nan();
        finding(relation.judge(low, high, self.within), known.then_some((low, high)))
    }
}

/// The axes and labels of the `i`-th coordinate, last axis fastest.
fn coordinate(axes: &[&Dim], mut i: usize) -> Vec<(String, String)> {
    let mut at = Vec::with_capacity(axes.len());
    for axis in axes.iter().rev() {
        at.push((axis.name.clone(), axis.labels.text(i % axis.len())));
        i /= axis.len();
    }
    at.reverse();
    at
}

/// How the left side is claimed to relate to the right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Relation {
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Equal,
    Unequal,
}

impl Relation {
    fn named(sign: &str) -> Result<Self, OpError> {
        match sign {
            "<" => Ok(Self::Less),
            "<=" => Ok(Self::LessOrEqual),
            ">" => Ok(Self::Greater),
            ">=" => Ok(Self::GreaterOrEqual),
            "==" => Ok(Self::Equal),
            "!=" => Ok(Self::Unequal),
            other => Err(OpError::Failed(format!(
                "`{other}` is no relation; use one of <, <=, >, >=, ==, !="
            ))),
        }
    }

    /// What an interval of the difference, left minus right, says of the claim: `Holds` if it is
    /// true of every number in the interval, `Fails` if of none.
    ///
    /// - `within`: how far from 0 counts as equal.
    fn judge(self, low: f64, high: f64, within: f64) -> Outcome {
        let (always, never) = match self {
            Self::Less => (high < 0.0, low >= 0.0),
            Self::LessOrEqual => (high <= 0.0, low > 0.0),
            Self::Greater => (low > 0.0, high <= 0.0),
            Self::GreaterOrEqual => (low >= 0.0, high < 0.0),
            Self::Equal => (-within <= low && high <= within, low > within || high < -within),
            Self::Unequal => (low > 0.0 || high < 0.0, low == 0.0 && high == 0.0),
        };
        match (always, never) {
            (true, _) => Outcome::Holds,
            (_, true) => Outcome::Fails,
            _ => Outcome::Undecided,
        }
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::{Gathered, Labels};
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;

    const CTX: Ctx = Ctx::new("claim", 0, None);

    fn scalar(x: f64) -> Everything<Array> {
        Everything(Gathered { dims: vec![], values: vec![Array::scalar(x)], name: String::new() })
    }

    /// One number a seed.
    fn seeds(xs: &[f64]) -> Everything<Array> {
        let seed = Dim::new("seed", Labels::count(xs.len()));
        let values = xs.iter().copied().map(Array::scalar).collect();
        Everything(Gathered { dims: vec![seed], values, name: String::new() })
    }

    fn claim(left: Everything<Array>, relation: &str, right: Everything<Array>) -> Verdict {
        let relation = relation.to_owned();
        Claim { left, right, relation, confidence: 0.95, within: 0.0, seeds: 0 }.run(&CTX).unwrap()
    }

    /// The finding on `left == right within(..)`.
    fn within(within: f64, left: Everything<Array>, right: Everything<Array>) -> Finding {
        let claim =
            Claim { left, right, relation: "==".into(), confidence: 0.95, within, seeds: 0 };
        claim.run(&CTX).unwrap().findings.remove(0)
    }

    fn outcome(left: Everything<Array>, relation: &str, right: Everything<Array>) -> Outcome {
        claim(left, relation, right).outcome()
    }

    #[test]
    fn deterministic_numbers_compare_plainly() {
        use Outcome::{Fails, Holds, Undecided};
        let all =
            |l, r| ["<", "<=", ">", ">=", "==", "!="].map(|s| outcome(scalar(l), s, scalar(r)));
        assert_eq!(all(1.0, 2.0), [Holds, Holds, Fails, Fails, Fails, Holds]);
        assert_eq!(all(2.0, 2.0), [Fails, Holds, Fails, Holds, Holds, Fails]);
        assert_eq!(all(3.0, 2.0), [Fails, Fails, Holds, Holds, Fails, Holds]);
        assert_eq!(all(f64::NAN, 2.0), [Undecided; 6]);
        let infinite = [f64::INFINITY, f64::NEG_INFINITY];
        for x in infinite {
            assert_eq!(all(x, x), [Fails, Holds, Fails, Holds, Holds, Fails]);
            assert_eq!(within(0.5, scalar(x), scalar(x)).outcome, Holds);
            assert_eq!(within(0.5, scalar(x), scalar(-x)).outcome, Fails);
            for n in [5, BOOTSTRAP_SEEDS] {
                let alike = ["<", "<=", "==", "!="]
                    .map(|sign| outcome(seeds(&vec![x; n]), sign, seeds(&vec![x; n])));
                assert_eq!(alike, [Fails, Holds, Holds, Fails]);
                assert_eq!(
                    outcome(seeds(&vec![-x; n]), "<", seeds(&vec![x; n])),
                    if x > 0.0 { Holds } else { Fails }
                );
            }
        }
        let finding = &claim(scalar(1.0), "<", scalar(3.0)).findings[0];
        assert_eq!((finding.estimate, finding.interval, finding.n), (-2.0, None, 0));
    }

    #[test]
    fn seeds_are_paired() {
        // The sides overlap by far, but every pair differs by about 1.
        let left = [0.0, 10.0, 20.0, 30.0, 40.0];
        let right = [1.1, 10.9, 21.0, 31.0, 41.0];
        let verdict = claim(seeds(&left), "<", seeds(&right));
        assert_eq!(verdict.outcome(), Outcome::Holds);
        let finding = &verdict.findings[0];
        assert!((finding.estimate + 1.0).abs() < 1e-12 && finding.n == 5 && finding.at.is_empty());
        assert!(finding.interval.is_some_and(|(low, high)| low < -1.0 && -1.0 < high));
        assert_eq!(outcome(seeds(&left), ">", seeds(&right)), Outcome::Fails);
        assert_eq!(outcome(seeds(&left[..4]), "<", seeds(&right[..4])), Outcome::Undecided);
        assert_eq!(outcome(seeds(&left), "<", scalar(20.5)), Outcome::Undecided);
    }

    #[test]
    fn equal_pairs_decide_equality() {
        let (xs, mut ys) = ([1.0, 2.0, 3.0, 4.0, 5.0], [1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(outcome(seeds(&xs), "==", seeds(&ys)), Outcome::Holds);
        assert_eq!(outcome(seeds(&xs), "<=", seeds(&ys)), Outcome::Holds);
        assert_eq!(outcome(seeds(&xs), "<", seeds(&ys)), Outcome::Fails);
        ys[3] = 4.5;
        assert_eq!(outcome(seeds(&xs), "==", seeds(&ys)), Outcome::Fails);
        assert_eq!(outcome(seeds(&xs), "!=", seeds(&ys)), Outcome::Holds);
    }

    #[test]
    fn what_was_reduced_over_few_seeds_decides_nothing() {
        let of = |seeds, left: Everything<Array>| {
            let (relation, right) = ("<".to_owned(), scalar(9.0));
            let claim = Claim { left, right, relation, confidence: 0.95, within: 0.0, seeds };
            let finding = claim.run(&CTX).unwrap().findings.remove(0);
            (finding.outcome, finding.n, finding.lacks_seeds())
        };
        assert_eq!(of(0, scalar(1.0)), (Outcome::Holds, 0, false));
        assert_eq!(of(1, scalar(1.0)), (Outcome::Undecided, 1, true));
        assert_eq!(of(4, scalar(1.0)), (Outcome::Undecided, 4, true));
        assert_eq!(of(5, scalar(1.0)), (Outcome::Holds, 0, false));
        // Paired with what was picked from one seed.
        assert_eq!(of(1, seeds(&[1.0; 6])), (Outcome::Undecided, 1, true));
        assert_eq!(of(6, seeds(&[1.0; 6])), (Outcome::Holds, 6, false));
    }

    #[test]
    fn what_is_infinite_has_no_interval() {
        for n in [5, BOOTSTRAP_SEEDS] {
            let mut differences = vec![1.0; n];
            differences[0] = f64::INFINITY;
            let finding = claim(seeds(&differences), "<", scalar(0.0)).findings.remove(0);
            assert_eq!((finding.estimate, finding.n), (f64::INFINITY, n));
            assert!(finding.interval.is_none_or(|(low, high)| low <= high), "{finding:?}");
            differences[1] = f64::NEG_INFINITY;
            let finding = claim(seeds(&differences), "<", scalar(0.0)).findings.remove(0);
            assert_eq!((finding.outcome, finding.interval), (Outcome::Undecided, None));
        }
    }

    #[test]
    fn equality_within_a_tolerance_is_of_the_interval() {
        use Outcome::{Fails, Holds, Undecided};
        // Mean 3, s² = 2.5: the interval of the mean is 3 ± 1.963.
        let by = |tolerance, n| {
            within(tolerance, seeds(&[1.0, 2.0, 3.0, 4.0, 5.0][..n]), scalar(0.0)).outcome
        };
        assert_eq!([by(5.0, 5), by(3.0, 5), by(1.0, 5)], [Holds, Undecided, Fails]);
        assert_eq!(by(5.0, 4), Undecided);
        let finding = within(5.0, scalar(0.0), seeds(&[1.0, 2.0, 3.0, 4.0, 5.0]));
        let (low, high) = finding.interval.unwrap();
        assert!((low + 4.963).abs() < 1e-3 && (high + 1.037).abs() < 1e-3, "{low} {high}");
        assert_eq!((finding.outcome, finding.estimate, finding.n), (Holds, -3.0, 5));

        let plainly = |tolerance, l| within(tolerance, scalar(l), scalar(2.0)).outcome;
        assert_eq!(
            [plainly(0.5, 2.5), plainly(0.5, 1.5), plainly(0.5, 2.6)],
            [Holds, Holds, Fails]
        );
        assert_eq!(plainly(0.5, f64::NAN), Undecided);
    }

    #[test]
    fn a_tolerance_does_not_depend_on_the_number_of_seeds() {
        for x in [0.1, 0.7, 1.0 / 3.0, 1e-300, 123.456, 1e300] {
            for n in [5, 6, 10, 19, 20, 40] {
                let finding = within(x, seeds(&vec![x; n]), scalar(0.0));
                assert_eq!((finding.outcome, finding.estimate), (Outcome::Holds, x), "{n} of {x}");
                assert_eq!(finding.interval, Some((x, x)));
                let above = f64::from_bits(x.to_bits() + 1);
                let finding = within(x, seeds(&vec![above; n]), scalar(0.0));
                assert_eq!(finding.outcome, Outcome::Fails);
                assert_ne!(
                    finding.shown()[0].parse(),
                    Ok(x),
                    "what fails is not shown as what holds"
                );
                let less = outcome(seeds(&vec![x; n]), "<=", scalar(x));
                assert_eq!(less, Outcome::Holds, "{n} of {x}");
                // All but one: the interval ends at the tolerance and not beyond.
                let mut most = vec![x; n];
                most[0] = 0.99 * x;
                if n >= BOOTSTRAP_SEEDS {
                    assert_eq!(within(x, seeds(&most), scalar(0.0)).outcome, Outcome::Holds);
                }
            }
        }
    }

    #[test]
    fn other_axes_mean_for_all() {
        let ke = Dim::new("ke", Labels::Names(vec!["WCM".into(), "BCM".into()]));
        let n = Dim::new("n", Labels::Numbers(vec![5.0, 10.0]));
        let row = |values| Array::series(n.clone(), values);
        let values = vec![row(vec![0.0, 1.0]), row(vec![2.0, 3.0])];
        let left = Everything(Gathered { dims: vec![ke], values, name: String::new() });
        let verdict = claim(left, "<", scalar(2.5));
        let at: Vec<String> = verdict.findings.iter().map(|f| format!("{:?}", f.at)).collect();
        assert_eq!(at[1], r#"[("ke", "WCM"), ("n", "10")]"#);
        assert_eq!(at[2], r#"[("ke", "BCM"), ("n", "5")]"#);
        let outcomes: Vec<Outcome> = verdict.findings.iter().map(|f| f.outcome).collect();
        assert_eq!(outcomes, [Outcome::Holds, Outcome::Holds, Outcome::Holds, Outcome::Fails]);
        assert_eq!(verdict.outcome(), Outcome::Fails);
    }

    #[test]
    fn unknown_relations_are_refused() {
        let (left, right) = (scalar(0.0), scalar(1.0));
        let claim =
            Claim { left, right, relation: "~".into(), confidence: 0.95, within: 0.0, seeds: 0 };
        assert!(claim.run(&CTX).is_err());
    }

    #[test]
    fn verdicts_are_seldom_wrong() {
        let mut rng = Ctx { op: "test", ..CTX }.rng("differences", &[]);
        for n in [5, 10, 20] {
            let (n_trials, mut n_wrong, mut n_right) = (300, 0, 0);
            for _ in 0..n_trials {
                let noise: Vec<f64> = (0..n).map(|_| StandardNormal.sample(&mut rng)).collect();
                // No difference: `<` must not hold. A difference of three deviations: it should.
                n_wrong += i32::from(outcome(seeds(&noise), "<", scalar(0.0)) == Outcome::Holds);
                n_right += i32::from(outcome(seeds(&noise), "<", scalar(3.0)) == Outcome::Holds);
            }
            assert!(n_wrong * 100 < n_trials * 6, "{n_wrong} of {n_trials} at n = {n}");
            assert!(n_right * 100 > n_trials * 95, "{n_right} of {n_trials} at n = {n}");
        }
    }
}
