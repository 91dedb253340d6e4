//! How far the numbers of a measure moved.

use std::collections::BTreeMap;
use std::fmt;

use ivx_op::{Dim, shown, shown_together};

use crate::results::Measure;

/// How far the numbers of a measure moved, coordinate by coordinate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Move {
    /// How many moved beyond the tolerance.
    pub moved: usize,
    /// How many are on both sides.
    pub of: usize,
    /// How many have coordinates that were not there before.
    pub added: usize,
    /// How many had coordinates that are not there any more.
    pub gone: usize,
    /// The one that moved furthest.
    pub largest: Option<Largest>,
    /// What moved beyond what chance explains, where the measure varies over `seed`.
    pub beyond: Option<Beyond>,
}

/// The number that moved furthest.
#[derive(Clone, Debug, PartialEq)]
pub struct Largest {
    /// Its coordinates: `seed=1, ke=MA`; empty for a single number.
    pub at: String,
    /// What it was.
    pub before: f64,
    /// What it is.
    pub after: f64,
}

/// Means over seeds that lie outside the 95 % interval that they had before.
#[derive(Clone, Debug, PartialEq)]
pub struct Beyond {
    /// How many.
    pub n: usize,
    /// How many have such an interval.
    pub of: usize,
    /// The one that lies outside by most of its interval's width.
    pub worst: Option<Outside>,
}

/// A mean outside the interval that it had before.
#[derive(Clone, Debug, PartialEq)]
pub struct Outside {
    /// Its coordinates.
    pub at: String,
    /// The interval there.
    pub interval: (f64, f64),
    /// The mean there now.
    pub mean: f64,
}

/// The 95 % interval of the mean of two numbers or more; none if they are not finite.
pub type Interval = fn(&[f64]) -> Option<(f64, f64)>;

/// How far a measure moved; none if it did not. Its numbers are compared where their coordinates
/// are the same, as are means over `seed`, whichever seeds there are.
///
/// - `tolerance`: what is no move, relative to the larger number.
pub(crate) fn moved(
    before: &Measure,
    after: &Measure,
    tolerance: f64,
    interval: Interval,
) -> Option<Move> {
    if before == after {
        return None;
    }
    let (old, new) = (numbers(before), numbers(after));
    let mut found = Move::default();
    let mut furthest = 0.0;
    for (at, &after) in &new {
        let Some(&before) = old.get(at) else {
            found.added += 1;
            continue;
        };
        found.of += 1;
        if near(before, after, tolerance) {
            continue;
        }
        found.moved += 1;
        let apart = (after - before).abs();
        if found.moved == 1 || apart > furthest || (apart.is_nan() && !furthest.is_nan()) {
            furthest = apart;
            found.largest = Some(Largest { at: words(at), before, after });
        }
    }
    found.gone = old.len() - found.of;
    if found.moved + found.added + found.gone == 0 {
        return None;
    }
    found.beyond = beyond(&by_seed(&old), &by_seed(&new), tolerance, interval);
    Some(found)
}

/// Whether two numbers are the same within a tolerance relative to the larger.
pub(crate) fn near(a: f64, b: f64, tolerance: f64) -> bool {
    let is_same = a == b || (a.is_nan() && b.is_nan());
    is_same || (a - b).abs() / a.abs().max(b.abs()) <= tolerance
}

/// Axis and label, in the order of the measure's dimensions.
type At<'m> = Vec<(&'m str, String)>;

/// The numbers by coordinates.
fn numbers(measure: &Measure) -> BTreeMap<At<'_>, f64> {
    let at = |mut i: usize| {
        let coordinate = |dim: &'_ Dim| {
            let place = i % dim.len();
            i /= dim.len();
            dim.labels.text(place)
        };
        let labels: Vec<String> = measure.dims.iter().rev().map(coordinate).collect();
        let names = measure.dims.iter().map(|dim| dim.name.as_str());
        names.zip(labels.into_iter().rev()).collect()
    };
    measure.values.iter().enumerate().map(|(i, value)| (at(i), *value)).collect()
}

/// The numbers over `seed`, by the other coordinates.
fn by_seed<'m>(numbers: &BTreeMap<At<'m>, f64>) -> BTreeMap<At<'m>, Vec<f64>> {
    let mut samples: BTreeMap<At<'m>, Vec<f64>> = BTreeMap::new();
    for (at, number) in numbers {
        if at.iter().any(|(axis, _)| *axis == "seed") {
            let rest = at.iter().filter(|(axis, _)| *axis != "seed").cloned().collect();
            samples.entry(rest).or_default().push(*number);
        }
    }
    samples
}

fn beyond(
    before: &BTreeMap<At<'_>, Vec<f64>>,
    after: &BTreeMap<At<'_>, Vec<f64>>,
    tolerance: f64,
    interval: Interval,
) -> Option<Beyond> {
    let (mut of, mut outside) = (0, Vec::new());
    for (at, new) in after {
        let old = before.get(at).filter(|old| old.len() > 1);
        let Some((old, (low, high))) = old.and_then(|old| Some((old, interval(old)?))) else {
            continue;
        };
        of += 1;
        let mean = mean(new);
        if !(low..=high).contains(&mean) && !near(self::mean(old), mean, tolerance) {
            let by = (low - mean).max(mean - high) / (high - low);
            outside.push((by, at, (low, high), mean));
        }
    }
    let n = outside.len();
    // Of equal ones the first counts, so that the order of coordinates decides.
    let worst = outside.into_iter().rev().max_by(|a, b| a.0.total_cmp(&b.0));
    let worst = worst.map(|(_, at, interval, mean)| Outside { at: words(at), interval, mean });
    (of > 0).then_some(Beyond { n, of, worst })
}

/// The mean, which is never outside its samples.
#[expect(clippy::cast_precision_loss, reason = "seeds number far below 2^53")]
pub(crate) fn mean(samples: &[f64]) -> f64 {
    let ends = samples
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    if mean.is_nan() { mean } else { mean.max(ends.0).min(ends.1) }
}

/// `3 of 8 moved, at most 0.5 -> 0.625 (+25 %) at seed=1, ke=MA`
impl fmt::Display for Move {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts = Vec::new();
        if let Some(Largest { at, before, after }) = &self.largest {
            let percent = (after - before) / before.abs() * 100.0;
            let size = shown(percent.abs());
            let sign = if percent < 0.0 { '-' } else { '+' };
            let share =
                if percent.is_finite() { format!(" ({sign}{size} %)") } else { String::new() };
            let at = if at.is_empty() { String::new() } else { format!(" at {at}") };
            let numbers = shown_together(&[*before, *after]).join(" -> ");
            let (moved, of) = (self.moved, self.of);
            parts.push(format!("{moved} of {of} moved, at most {numbers}{share}{at}"));
        }
        for (n, how) in [(self.added, "new"), (self.gone, "gone")] {
            if n > 0 {
                parts.push(format!("{n} {how}"));
            }
        }
        if self.of == 0 {
            parts.push("none has coordinates that both have".to_owned());
        }
        f.write_str(&parts.join("; "))
    }
}

impl Move {
    /// What the means over seeds say, a line if there are any.
    #[must_use]
    pub fn details(&self) -> Vec<String> {
        let Some(Beyond { n, of, worst }) = &self.beyond else { return Vec::new() };
        let (earlier, is_one) = ("earlier 95 % interval", *of == 1);
        let told = match worst {
            None if is_one => format!("the mean over seed is within its {earlier}"),
            None => format!("{of} means over seed are within their {earlier}s"),
            Some(Outside { at, interval: (low, high), mean }) => {
                let at = if at.is_empty() { String::new() } else { format!(" at {at}") };
                let numbers = shown_together(&[*mean, *low, *high]);
                let [mean, low, high] = &numbers[..] else { unreachable!("there are three") };
                let whose = if is_one {
                    format!("the mean over seed is beyond its {earlier}")
                } else {
                    format!("{n} of {of} means over seed are beyond their {earlier}s")
                };
                format!("{whose}: {mean} outside [{low}, {high}]{at}")
            }
        };
        vec![told]
    }
}

/// `seed=1, ke=MA`
fn words(at: &At<'_>) -> String {
    let words: Vec<String> = at.iter().map(|(axis, label)| format!("{axis}={label}")).collect();
    words.join(", ")
}

#[cfg(test)]
mod tests {
    use ivx_op::Labels;

    use super::*;

    fn measure(seeds: &[f64], values: &[f64]) -> Measure {
        let ke = Dim::new("ke", Labels::Names(vec!["a".into(), "b".into()]));
        let seed = Dim::new("seed", Labels::Numbers(seeds.to_vec()));
        Measure { dims: vec![ke, seed], values: values.to_vec(), ..Measure::default() }
    }

    /// A tenth around the mean.
    #[expect(clippy::unnecessary_wraps, reason = "intervals can be none")]
    fn tenth(xs: &[f64]) -> Option<(f64, f64)> {
        Some((mean(xs) - 0.1, mean(xs) + 0.1))
    }

    #[test]
    fn numbers_are_compared_where_their_coordinates_are_the_same() {
        let before = measure(&[0.0, 1.0], &[1.0, 2.0, 3.0, 4.0]);
        assert_eq!(moved(&before, &before, 0.0, tenth), None);
        // Seed 0 went and seed 2 came; of `b` the mean was 3.5 and is 8.
        let after = measure(&[1.0, 2.0], &[2.0, 1.0, 6.0, 10.0]);
        let found = moved(&before, &after, 1e-9, tenth).unwrap();
        assert_eq!((found.moved, found.of, found.added, found.gone), (1, 2, 2, 2));
        let largest = Largest { at: "ke=b, seed=1".into(), before: 4.0, after: 6.0 };
        assert_eq!(found.largest, Some(largest));
        let worst = Outside { at: "ke=b".into(), interval: (3.4, 3.6), mean: 8.0 };
        let beyond = Beyond { n: 1, of: 2, worst: Some(worst) };
        assert_eq!(found.beyond, Some(beyond));
        assert_eq!(
            found.to_string(),
            "1 of 2 moved, at most 4 -> 6 (+50 %) at ke=b, seed=1; 2 new; 2 gone"
        );
        let told = "1 of 2 means over seed are beyond their earlier 95 % intervals: \
                    8 outside [3.4, 3.6] at ke=b";
        assert_eq!(found.details(), [told]);
    }

    #[test]
    fn what_moved_a_little_looks_moved() {
        let found = |before, after| {
            let one = |x| Measure { dims: vec![], values: vec![x], ..Measure::default() };
            moved(&one(before), &one(after), 0.0, tenth).unwrap().to_string()
        };
        assert_eq!(
            found(1.0, 1.0 + f64::EPSILON),
            "1 of 1 moved, at most 1 -> 1.0000000000000002 (+2.220e-14 %)"
        );
        assert_eq!(found(1e200, 2e200), "1 of 1 moved, at most 1e200 -> 2e200 (+100 %)");
    }

    #[test]
    fn a_number_that_is_none_moved_furthest() {
        let before = measure(&[0.0], &[1.0, 2.0]);
        let found = moved(&before, &measure(&[0.0], &[f64::NAN, 9.0]), 0.0, tenth).unwrap();
        let largest = found.largest.unwrap();
        assert_eq!((found.moved, largest.at.as_str()), (2, "ke=a, seed=0"));
        assert_eq!(found.beyond, None, "one seed has no interval");
        let nothing = measure(&[0.0], &[f64::NAN, 2.0]);
        assert_eq!(moved(&nothing, &nothing.clone(), 0.0, tenth), None);
    }

    #[test]
    fn a_measure_over_something_else_has_no_number_in_common() {
        let before = measure(&[0.0], &[1.0, 2.0]);
        let after = Measure { dims: vec![], values: vec![1.0], ..Measure::default() };
        let found = moved(&before, &after, 0.0, tenth).unwrap();
        assert_eq!((found.moved, found.of, found.added, found.gone), (0, 0, 1, 2));
    }
}
