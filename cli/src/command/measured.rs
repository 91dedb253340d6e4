//! Measures that no claim mentions, as `ivx exec` tells them.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};

use ivx_engine::Measure;
use ivx_grammar::ir::{Experiment, ExprId, Spec};
use ivx_math::moments::mean;
use ivx_op::{labels_at, shown, shown_together};

use super::diff::interval;
use crate::render::visible;

/// Measures with more coordinates are told by their range.
const MOST: usize = 8;

/// The axis of replications.
const SEED: &str = "seed";

/// The measures of each experiment that none of its claims mentions or is made of.
pub(super) fn unclaimed(spec: &Spec) -> BTreeMap<String, Vec<String>> {
    let of = |experiment: &Experiment| {
        let mut made_of: BTreeSet<ExprId> = BTreeSet::new();
        let mut todo: Vec<ExprId> = experiment.claims.iter().map(|own| own.output.expr).collect();
        while let Some(id) = todo.pop() {
            if made_of.insert(id) {
                todo.extend(spec.inputs(spec.expr(id)));
            }
        }
        // What is made of all seeds is judged by other expressions than those that show it.
        let word = |c: char| !(c.is_alphanumeric() || c == '_');
        let mentioned = |name: &str| {
            experiment.claims.iter().any(|own| own.output.source.split(word).any(|w| w == name))
        };
        let measures = experiment.measures.iter();
        let free = measures.filter(|own| !made_of.contains(&own.expr) && !mentioned(&own.name));
        (experiment.name.clone(), free.map(|own| own.name.clone()).collect())
    };
    spec.experiments.iter().map(of).collect()
}

/// Writes what a measure amounts to: over seeds, the mean and its 95 % interval.
pub(super) fn write(name: &str, measure: &Measure, out: &mut dyn Write) -> io::Result<()> {
    let (lines, is_one) = (lines(measure), measure.dims.iter().all(|dim| dim.name == SEED));
    match &lines[..] {
        [(_, amount)] if is_one => writeln!(out, "  measured  {name} = {amount}"),
        lines if !lines.is_empty() => {
            writeln!(out, "  measured  {name}")?;
            for (at, amount) in lines {
                writeln!(out, "            {at}: {amount}")?;
            }
            Ok(())
        }
        _ => writeln!(out, "  measured  {name}: {}", range(measure)),
    }
}

/// What there is at each coordinate but of seeds.
fn lines(measure: &Measure) -> Vec<(String, String)> {
    let dims = &measure.dims;
    let n: usize = dims.iter().map(ivx_op::Dim::len).product();
    if measure.values.len() != n {
        return Vec::new();
    }
    let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
    for i in 0..n {
        let at = dims.iter().zip(labels_at(dims, i)).filter(|(dim, _)| dim.name != SEED);
        let at = at.map(|(dim, label)| format!("{} = {}", dim.name, visible(&label)));
        let at = at.collect::<Vec<_>>().join(", ");
        if let Some((_, places)) = groups.iter_mut().find(|(own, _)| *own == at) {
            places.push(i);
        } else if groups.len() == MOST {
            return Vec::new();
        } else {
            groups.push((at, vec![i]));
        }
    }
    groups.into_iter().map(|(at, places)| (at, amount(measure, &places))).collect()
}

fn amount(measure: &Measure, places: &[usize]) -> String {
    let lost = places.iter().filter(|place| measure.missing_at(**place).is_some()).count();
    match (lost, places) {
        (1.., [_]) => return "missing".to_owned(),
        (1.., all) => return format!("missing ({lost} of {})", all.len()),
        _ => {}
    }
    let samples: Vec<f64> = places.iter().map(|place| measure.values[*place]).collect();
    if let [one] = samples[..] {
        return shown(one);
    }
    let mean = mean(&samples);
    match interval(&samples) {
        Some((low, high)) => {
            let told = shown_together(&[mean, low, high]);
            // The ends may be open.
            let told: Vec<String> = told.iter().map(|x| x.replace("inf", "∞")).collect();
            format!("{} in [{}, {}], n = {}", told[0], told[1], told[2], samples.len())
        }
        None => format!("{}, n = {}", shown(mean), samples.len()),
    }
}

fn range(measure: &Measure) -> String {
    let ends = measure.ends().map_or_else(String::new, |(low, high)| {
        format!(" from {}", shown_together(&[low, high]).join(" to "))
    });
    let over: Vec<&str> = measure.dims.iter().map(|dim| dim.name.as_str()).collect();
    let lost = match measure.missing.len() {
        0 => String::new(),
        n => format!(", {n} coordinates missing"),
    };
    format!("{} numbers{ends} over {}{lost}", measure.values.len(), over.join(", "))
}

#[cfg(test)]
mod tests {
    use ivx_op::{Dim, Labels};

    use super::*;

    fn written(measure: &Measure) -> String {
        let mut out = Vec::new();
        write("m", measure, &mut out).expect("vectors take everything");
        String::from_utf8_lossy(&out).into_owned()
    }

    fn over(dims: &[(&str, usize)], values: &[f64]) -> Measure {
        let dims = dims.iter().map(|(name, n)| Dim::new(name, Labels::count(*n))).collect();
        Measure { dims, values: values.to_vec(), ..Measure::default() }
    }

    #[test]
    fn a_measure_is_told_by_its_means() {
        assert_eq!(written(&over(&[], &[0.25])), "  measured  m = 0.25\n");
        // 2 ± 2.484138, as figures have it.
        let seeds = over(&[("seed", 3)], &[1.0, 2.0, 3.0]);
        assert_eq!(written(&seeds), "  measured  m = 2 in [-0.484, 4.484], n = 3\n");
        let by = over(&[("n", 2), ("seed", 2)], &[1.0, 1.0, 2.0, 2.0]);
        let expected = "  measured  m\n            n = 0: 1 in [1, 1], n = 2\n            n = 1: 2 in [2, 2], n = 2\n";
        assert_eq!(written(&by), expected);
        let many = over(&[("n", 9)], &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
        assert_eq!(written(&many), "  measured  m: 9 numbers from 0 to 8 over n\n");
    }

    #[test]
    fn what_is_missing_is_told() {
        let mut by = over(&[("n", 2), ("seed", 2)], &[1.0, f64::NAN, 2.0, 2.0]);
        by.missing.insert("n=0,seed=1".into(), "e/m[n=0,seed=1]".into());
        assert!(written(&by).contains("n = 0: missing (1 of 2)\n"), "{}", written(&by));
    }
}
