//! Claims: whether measures relate as a spec says.

use ivx_math::evidence::{Evidence, N_RESAMPLES, Spread};
use ivx_math::moments::mean;
use ivx_op::{
    Array, Ctx, Dim, Everything, Facts, Finding, Many, Op, OpError, Outcome, Verdict, Wrong,
    declare, is_missing, labels_at,
};

use super::broadcast::broadcast;
use super::reduce::{Groups, SEED, reduce};
use super::relation::Relation;
use super::resample::RESAMPLE;

declare! {
    /// Whether two measures relate as claimed, at every coordinate but `seed`.
    ///
    /// Over seeds, differences are paired. A claim holds when their interval lies on the claimed side, and fails when it
    /// lies on the other: that of Student's t, stretched where differences have a tail (`docs/claims.md`). What is made of
    /// all seeds is judged by resampling them, a share of seeds by the binomial distribution. Below 5 seeds a claim is
    /// undecided, and so it is where fewer than 72 seeds differ by the same number. `==` and `!=` ask whether all
    /// differences are exactly 0; within a tolerance `t`, `==` asks whether the interval lies in `[−t, t]` (two one-sided
    /// tests), `>=` and `<=` whether it is not worse by more than `t`. Without seeds the numbers compare plainly. Equal
    /// infinities do not differ. Sides that rest on fewer than 5 seeds decide nothing either, and neither does what is not
    /// a number. Where differences are infinite there may be no interval.
    pub struct Claim = "claim" @ 10 -> Verdict {
        /// The left side.
        left: Everything<Array>;
        /// The right side.
        right: Everything<Array>;
        /// One of `<`, `<=`, `>`, `>=`, `==`, `!=`.
        relation: String;
        /// How often such intervals hold the truth.
        confidence: f64 = 0.95, in 0.5..=1.0;
        /// How far apart the sides of `==` may be, or how much worse the left one, in their unit.
        within: f64 = 0.0, in 0.0..;
        /// How the interval is found: `tails`, `t`, `bootstrap` or `wilcoxon`; `quantiles` where what is compared is made of
        /// medians and quantiles over seeds; `binomial` where the left side is a condition
        /// and the right one the share of seeds at which it is true, `binomial, right` where they stand the other way.
        by: String = "tails";
        /// How many seeds the sides rest on, by the side with fewer; 0 where nothing draws or it is not known.
        seeds: usize = 0;
        /// What was resampled.
        behind: Many<Everything<Array>> = Vec::<i64>::new();
        /// Whether the numbers are only compared: they say something of these seeds alone.
        describes: bool = false;
    }
    rule known_method;
}

impl Op for Claim {
    fn run(&self, ctx: &Ctx) -> Result<Verdict, OpError> {
        let relation = Relation::named(&self.relation)?;
        let left = Array::stack(&self.left.0).map_err(OpError::Failed)?;
        let right = Array::stack(&self.right.0).map_err(OpError::Failed)?;
        if self.by == SHARE_ON_THE_RIGHT {
            // Judged from the other side, and told as it stands.
            let verdict = self.verdict(relation.mirrored(), "binomial", (&right, &left), ctx)?;
            return Ok(Verdict { findings: verdict.findings.into_iter().map(mirrored).collect() });
        }
        self.verdict(relation, &self.by, (&left, &right), ctx)
    }
}

/// The method where the share of seeds is the right side.
const SHARE_ON_THE_RIGHT: &str = "binomial, right";

/// A finding seen from the other side.
fn mirrored(finding: Finding) -> Finding {
    let interval = finding.interval.map(|(low, high)| (-high, -low));
    Finding { estimate: -finding.estimate, interval, ..finding }
}

impl Claim {
    /// The verdict on these sides by a method.
    fn verdict(
        &self,
        relation: Relation,
        by: &str,
        (left, right): (&Array, &Array),
        ctx: &Ctx,
    ) -> Result<Verdict, OpError> {
        let mut differences = broadcast(left, right, difference)?;
        let resampled = differences.dim(RESAMPLE).is_some();
        if resampled && differences.dim(SEED).is_some() {
            differences = reduce(&differences, &[SEED.to_owned()], mean)?;
        }
        let behind = self.seeds_behind()?;
        let n_behind = self.n_behind(&behind);
        let sampled = [RESAMPLE, SEED].into_iter().find(|name| differences.dim(name).is_some());
        let sampled: Vec<String> = sampled.map(str::to_owned).into_iter().collect();
        let groups = Groups::of(&differences, &sampled)?;
        let shares = if by == "binomial" { Some(conditions(left, right)?) } else { None };

        let axes: Vec<&Dim> = groups.kept.iter().map(|&d| &differences.dims[d]).collect();
        let findings = groups.starts.iter().enumerate().map(|(i, &start)| {
            let values = groups.gather(&differences, start);
            let names = axes.iter().map(|axis| axis.name.clone());
            let at = names.zip(labels_at(axes.iter().copied(), i)).collect();
            let finding = Finding { at, within: self.within, ..Finding::default() };
            if let Some(missing) = missing(&differences, &values, &behind) {
                let n = values.iter().filter(|x| !is_missing(**x)).count();
                let n = if sampled.is_empty() || resampled { 0 } else { n };
                return Finding { n, estimate: f64::NAN, missing, ..finding };
            }
            if sampled.is_empty() || self.describes {
                return self.plain(relation, &values, finding);
            }
            let n = if resampled { n_behind } else { values.len() };
            let n = if self.lacks_seeds() { self.seeds } else { n };
            let estimate = if resampled { values[0] } else { mean(&values) };
            let finding = Finding { n, estimate, ..finding };
            if n < Finding::MIN_SEEDS {
                return finding;
            }
            if let Some((conditions, bound)) = &shares {
                return self.of_share(
                    relation,
                    &groups.gather(conditions, start),
                    bound.values[start],
                    finding,
                );
            }
            if !resampled && self.within == 0.0 && relation.is_equality() {
                return self.all_equal(relation, &values, finding);
            }
            let evidence = match by {
                "bootstrap" | "quantiles" if resampled => {
                    Evidence::percentiles(values[0], &values[1..=N_RESAMPLES], n)
                }
                by if resampled => {
                    let (draws, exchanged) = values[1..].split_at(N_RESAMPLES);
                    let spread = Spread::of_resamples(values[0], draws, exchanged, n);
                    Evidence::Mean(if by == "t" { spread.plain() } else { spread })
                }
                // One stream for every claim and coordinate: a claim is not stochastic.
                "bootstrap" => Evidence::bootstrap(
                    &values,
                    &mut Ctx { seed: 0, member: None, ..*ctx }.rng("bootstrap", &[]),
                ),
                "wilcoxon" => Evidence::ranks(&values),
                "t" => Evidence::Mean(Spread::of_mean(&values).plain()),
                _ => Evidence::Mean(Spread::of_mean(&values)),
            };
            self.judged(relation, &evidence, 0.0, finding)
        });
        Ok(Verdict { findings: findings.collect() })
    }
}

fn known_method(facts: &Facts<'_>) -> Result<(), Wrong> {
    let by = facts.arg::<String>("by").unwrap_or_default();
    if ["", "tails", "t", "bootstrap", "wilcoxon", "binomial", SHARE_ON_THE_RIGHT, "quantiles"]
        .contains(&by.as_str())
    {
        return Ok(());
    }
    let help =
        "say `by \"t\"`, `by \"bootstrap\"` or `by \"wilcoxon\"`, or leave it out".to_owned();
    Err(Wrong { arg: "by", message: format!("no interval of a claim is called {by:?}"), help })
}

/// So many seeds are foreseen at most.
const MOST_FORESEEN: usize = 2000;

/// How far the left side is above the right: equal infinities do not differ.
fn difference(left: f64, right: f64) -> f64 {
    if left == right { 0.0 } else { left - right }
}

/// The condition and what its share is compared with, over the same.
fn conditions(condition: &Array, bound: &Array) -> Result<(Array, Array), OpError> {
    Ok((broadcast(condition, bound, |x, _| x)?, broadcast(condition, bound, |_, bound| bound)?))
}

impl Claim {
    /// Whether a side rests on too few seeds.
    fn lacks_seeds(&self) -> bool {
        (1..Finding::MIN_SEEDS).contains(&self.seeds)
    }

    /// The seeds of each value that was resampled, and whether something of it is missing there.
    fn seeds_behind(&self) -> Result<Vec<Vec<(String, bool)>>, OpError> {
        let seeds = |array: &Everything<Array>| {
            let array = Array::stack(&array.0).map_err(OpError::Failed)?;
            let Some(d) = array.dim(SEED) else { return Ok(Vec::new()) };
            let lacks = |seed| array.picked(d, &[seed]).values.iter().any(|x| is_missing(*x));
            let labels = &array.dims[d].labels;
            Ok((0..labels.len()).map(|seed| (labels.text(seed), lacks(seed))).collect())
        };
        self.behind.0.iter().map(seeds).collect()
    }

    /// The fewest seeds among what was resampled, but those that are missing.
    fn n_behind(&self, behind: &[Vec<(String, bool)>]) -> usize {
        let most = if self.seeds > 0 { self.seeds } else { usize::MAX };
        let there = behind.iter().filter(|seeds| !seeds.is_empty());
        let there = there.map(|seeds| seeds.iter().filter(|(_, lacks)| !lacks).count());
        there.fold(most, usize::min)
    }

    /// The finding on numbers that rest on no seeds, or are told of these seeds alone.
    fn plain(&self, relation: Relation, differences: &[f64], finding: Finding) -> Finding {
        let finding = Finding { estimate: mean(differences), ..finding };
        if self.lacks_seeds() {
            return Finding { n: self.seeds, ..finding };
        }
        let each = differences.iter().map(|difference| relation.compare(*difference, self.within));
        let outcome = match each.max().unwrap_or_default() {
            Outcome::Holds if self.describes => Outcome::Describes,
            outcome => outcome,
        };
        Finding { outcome, n: if self.describes { self.seeds } else { 0 }, ..finding }
    }

    /// The finding on whether all differences are 0: one that is not decides it.
    fn all_equal(&self, relation: Relation, differences: &[f64], finding: Finding) -> Finding {
        if differences.iter().any(|x| x.is_nan()) {
            return Finding { estimate: f64::NAN, ..finding };
        }
        let furthest = differences.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()));
        let furthest = furthest.expect("a group is not empty");
        if furthest != 0.0 {
            let outcome = relation.compare(furthest, 0.0);
            let p = if outcome == Outcome::Holds { (0.0, 1.0) } else { (1.0, 0.0) };
            return Finding { outcome, p: Some(p), ..finding };
        }
        self.judged(relation, &Evidence::Mean(Spread::of_mean(differences)), 0.0, finding)
    }

    /// The finding on the share of seeds at which a condition is true.
    fn of_share(
        &self,
        relation: Relation,
        conditions: &[f64],
        bound: f64,
        finding: Finding,
    ) -> Finding {
        if conditions.iter().any(|x| x.is_nan()) {
            return Finding { estimate: f64::NAN, ..finding };
        }
        if !conditions.iter().all(|x| *x == 0.0 || *x == 1.0) {
            // A share of numbers is their mean.
            let evidence = Evidence::Mean(Spread::of_mean(conditions));
            return self.judged(relation, &evidence, bound, finding);
        }
        let k = conditions.iter().filter(|x| **x == 1.0).count();
        let n = conditions.len();
        let found = self.judged(relation, &Evidence::Share { k, n }, bound, finding);
        if found.outcome != Outcome::Undecided {
            return found;
        }
        // How many seeds of which as large a share are successes would decide it.
        let decides = |more: &usize| {
            let (holds, fails) =
                relation.p(&Evidence::Share { k: k * more / n, n: *more }, bound, self.within);
            holds.min(fails) <= 1.0 - self.confidence
        };
        Finding { enough: (n + 1..=MOST_FORESEEN).find(decides), ..found }
    }

    /// The finding from what was seen of a number that is compared with `bound`.
    fn judged(
        &self,
        relation: Relation,
        evidence: &Evidence,
        bound: f64,
        finding: Finding,
    ) -> Finding {
        let (holds, fails) = relation.p(evidence, bound, self.within);
        let level = 1.0 - self.confidence;
        let outcome = match () {
            () if holds <= level => Outcome::Holds,
            () if fails <= level => Outcome::Fails,
            () => Outcome::Undecided,
        };
        // Where an end that lies far away decides it, this end is what is to be seen.
        let (low, high) = match outcome {
            Outcome::Undecided => evidence.shown_interval(self.confidence),
            _ => evidence.interval(self.confidence),
        };
        let interval =
            Some((low - bound, high - bound)).filter(|(low, high)| !low.is_nan() && !high.is_nan());
        let estimate = evidence.estimate() - bound;
        let p = Some((holds, fails)).filter(|(holds, fails)| !holds.is_nan() && !fails.is_nan());
        let finding = Finding { outcome, estimate, interval, p, ..finding };
        if interval.is_none() {
            return finding;
        }
        let edges: Vec<f64> = relation.edges(bound, self.within);
        let nearest = |near: f64, edge: &f64| near.min((evidence.estimate() - edge).abs());
        let distance = edges.iter().fold(f64::INFINITY, nearest);
        Finding {
            smallest: evidence.smallest(self.confidence),
            enough: evidence.seeds_to_tell(distance, self.confidence),
            too_few: outcome == Outcome::Undecided
                && edges.iter().all(|edge| evidence.plain_tells(*edge, self.confidence)),
            ..finding
        }
    }
}

/// The seeds of which something is missing, if any of some differences is.
fn missing(
    differences: &Array,
    values: &[f64],
    behind: &[Vec<(String, bool)>],
) -> Option<Vec<String>> {
    // Of resamples the first is the sample itself.
    let sampled = if differences.dim(RESAMPLE).is_some() { &values[..1] } else { values };
    if !sampled.iter().any(|x| is_missing(*x)) {
        return None;
    }
    let labels: Vec<String> = match differences.dim(SEED) {
        Some(d) if values.len() == differences.dims[d].len() => {
            let labels = &differences.dims[d].labels;
            let lost = (0..values.len()).filter(|seed| is_missing(values[*seed]));
            lost.map(|seed| labels.text(seed)).collect()
        }
        _ => {
            let lost = behind.iter().flatten().filter(|(_, lacks)| *lacks);
            let mut labels: Vec<String> = Vec::new();
            for (seed, _) in lost {
                if !labels.contains(seed) {
                    labels.push(seed.clone());
                }
            }
            labels
        }
    };
    Some(if labels.is_empty() { vec![String::new()] } else { labels })
}

#[cfg(test)]
mod tests;
