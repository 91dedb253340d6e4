//! How often a value falls where.

use ivx_op::{Array, AxisNames, Ctx, Everything, Figure, Op, OpError, declare, is_missing};

use super::arrange::sorted;
use super::drawing::{Axis, Drawing, Mark, Series};
use super::interval::Lacks;
use super::panels::panels;
use super::render::render;
use super::scale::placeable;

declare! {
    /// How many of all values of `y`, over everything it varies over, fall into equal bins: those of NumPy, where a
    /// value at the edge between two counts in the upper, and the highest in the last.
    ///
    /// A panel without values says `n/a`. How many finite ones were left out, the axis says.
    pub struct Histogram = "histogram" @ 4 -> Figure {
        /// The values; those that are not finite, or beyond 1e300, are left out.
        y: Everything<Array>;
        /// Axes that have a panel for each label; those of the last stand side by side.
        facet: AxisNames = Vec::<&str>::new();
        /// How many bins there are between the lowest value and the highest.
        bins: u64 = 20, in 1.0..=1000.0;
        /// Above the panel.
        title: String = "";
        /// What the values measure; where empty, what the spec calls `y`.
        x_label: String = "";
        /// What the vertical axis measures.
        y_label: String = "count";
    }
}

impl Op for Histogram {
    fn run(&self, _: &Ctx) -> Result<Figure, OpError> {
        let name = &self.y.0.name;
        let (dims, mut parts) = sorted(&self.y, &self.facet.0)?;
        let count =
            |wanted: fn(f64) -> bool| parts.iter().flatten().filter(|x| wanted(**x)).count();
        let n_beyond = count(|x| x.is_finite() && !placeable(x));
        let n_infinite = count(f64::is_infinite);
        let of = parts.iter().map(Vec::len).sum();
        let lacks = Lacks { missing: count(is_missing), of, skips: true };
        for values in &mut parts {
            values.retain(|x| placeable(*x));
        }
        let all = || parts.iter().flatten().copied();
        let is_empty = all().next().is_none();
        let ends = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
        let (panel_names, columns) = panels(&dims);
        let mut x_label = if self.x_label.is_empty() { name } else { &self.x_label }.clone();
        for (n, what) in [(n_beyond, "beyond 1e300"), (n_infinite, "infinite")] {
            if n > 0 {
                let blank = if x_label.is_empty() { "" } else { " " };
                x_label = format!("{x_label}{blank}({n} {what} left out)");
            }
        }
        // Without values there is nothing for ticks to say.
        let axis = |label: &str| Axis {
            label: label.to_owned(),
            names: if is_empty { vec![String::new()] } else { Vec::new() },
            bare: is_empty,
            ..Axis::default()
        };
        let bins = usize::try_from(self.bins).unwrap_or(usize::MAX).clamp(1, 1000);
        let series = panel_names.into_iter().zip(&parts).map(|(panel, values)| Series {
            panel,
            marks: match ends {
                _ if is_empty => vec![Mark::Text(0.0, 0.0, "n/a".into())],
                (low, high) if values.is_empty() => {
                    vec![Mark::Text(f64::midpoint(low, high), 0.0, "n/a".into())]
                }
                ends => bars(values, ends, bins),
            },
            ..Series::default()
        });
        Ok(render(&Drawing {
            title: self.title.clone(),
            x: axis(&x_label),
            y: axis(&self.y_label),
            series: series.collect(),
            columns,
            lacks,
            ..Drawing::default()
        }))
    }
}

/// One bar a bin between the ends.
#[expect(clippy::cast_precision_loss, reason = "bins and counts are far below 2^53")]
fn bars(values: &[f64], (low, high): (f64, f64), n_bins: usize) -> Vec<Mark> {
    let (low, high) = if low < high { (low, high) } else { (low - 0.5, high + 0.5) };
    let width = (high - low) / n_bins as f64;
    let counts = counts(values, (low, high), n_bins);
    let bar = |(i, count): (usize, &u32)| {
        let x = low + (i as f64 + 0.5) * width;
        Mark::Bar { x, width: width * 0.96, y: f64::from(*count), whisker: None }
    };
    counts.iter().enumerate().map(bar).collect()
}

/// How many values each bin has. Division finds the bin but for rounding; the edges, as they are rounded, decide.
#[expect(clippy::cast_precision_loss, reason = "bins are far below 2^53")]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bins are few")]
fn counts(values: &[f64], (low, high): (f64, f64), n_bins: usize) -> Vec<u32> {
    let step = (high - low) / n_bins as f64;
    let edge = |i: usize| if i == n_bins { high } else { i as f64 * step + low };
    let mut counts = vec![0; n_bins];
    for &x in values {
        let place = (x - low) / (high - low) * n_bins as f64;
        let mut bin = (place as usize).min(n_bins - 1);
        if x < edge(bin) {
            bin = bin.saturating_sub(1);
        } else if bin + 1 < n_bins && x >= edge(bin + 1) {
            bin += 1;
        }
        counts[bin] += 1;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placed(values: &[f64], n_bins: usize) -> Vec<(f64, f64)> {
        let ends = (values[0], values[values.len() - 1]);
        let place = |mark: &Mark| match mark {
            Mark::Bar { x, y, .. } => (*x, *y),
            _ => (f64::NAN, f64::NAN),
        };
        bars(values, ends, n_bins).iter().map(place).collect()
    }

    #[test]
    fn each_value_counts_once() {
        let found = placed(&[0.0, 0.5, 1.0, 1.0, 1.9, 4.0], 4);
        assert_eq!(found, [(0.5, 2.0), (1.5, 3.0), (2.5, 0.0), (3.5, 1.0)]);
        assert_eq!(placed(&[3.0, 3.0], 1), [(3.0, 2.0)]);
    }

    #[test]
    #[expect(clippy::unreadable_literal, reason = "as NumPy prints them")]
    #[expect(clippy::too_many_lines, reason = "a number a line")]
    fn golden_bins_are_those_of_numpy() {
        // np.histogram(values, bins=len(counts))[0] of NumPy 2.4.
        let cases: &[(&[f64], &[u32])] = &[
            (
                &[
                    0.0,
                    0.1,
                    0.2,
                    0.30000000000000004,
                    0.4,
                    0.5,
                    0.6000000000000001,
                    0.7000000000000001,
                    0.8,
                    0.9,
                    1.0,
                ],
                &[1, 1, 1, 1, 1, 1, 1, 1, 1, 2],
            ),
            (
                &[0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0],
                &[1, 1, 2, 0, 1, 2, 1, 0, 1, 2],
            ),
            (
                &[0.1, 0.2, 0.30000000000000004, 0.4, 0.5, 0.6000000000000001, 0.7000000000000001],
                &[1, 1, 1, 2, 0, 2],
            ),
            (
                &[
                    0.0,
                    0.3,
                    0.6,
                    0.8999999999999999,
                    1.2,
                    1.5,
                    1.7999999999999998,
                    2.1,
                    2.4,
                    2.6999999999999997,
                    3.0,
                    3.3,
                    3.5999999999999996,
                    3.9,
                    4.2,
                    4.5,
                    4.8,
                    5.1,
                    5.3999999999999995,
                    5.7,
                ],
                &[1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 2],
            ),
            (
                &[
                    0.0,
                    0.3333333333333333,
                    0.6666666666666666,
                    1.0,
                    1.3333333333333333,
                    1.6666666666666665,
                    2.0,
                    2.333333333333333,
                    2.6666666666666665,
                    3.0,
                    3.333333333333333,
                    3.6666666666666665,
                    4.0,
                ],
                &[1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 2],
            ),
            (
                &[
                    -0.7,
                    -0.6,
                    -0.49999999999999994,
                    -0.3999999999999999,
                    -0.29999999999999993,
                    -0.19999999999999996,
                    -0.09999999999999987,
                    1.1102230246251565e-16,
                    0.10000000000000009,
                    0.20000000000000007,
                    0.30000000000000004,
                    0.40000000000000013,
                    0.5000000000000002,
                    0.6000000000000001,
                    0.7000000000000002,
                ],
                &[1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 2],
            ),
            (
                &[0.0, 1e-300, 2e-300, 3e-300, 4e-300, 5e-300, 6e-300, 7e-300],
                &[1, 1, 1, 1, 1, 1, 2],
            ),
            (
                &[
                    1e+16,
                    1.0000000000000002e+16,
                    1.0000000000000004e+16,
                    1.0000000000000006e+16,
                    1.0000000000000008e+16,
                    1.000000000000001e+16,
                    1.0000000000000012e+16,
                    1.0000000000000014e+16,
                    1.0000000000000016e+16,
                ],
                &[1, 1, 1, 1, 1, 1, 1, 2],
            ),
            (&[0.1, 0.1, 0.1, 0.1, 0.1], &[0, 5, 0]),
            (
                &[
                    0.0,
                    1.1,
                    2.2,
                    3.3000000000000003,
                    4.4,
                    5.5,
                    6.6000000000000005,
                    7.700000000000001,
                    8.8,
                    9.9,
                    11.0,
                    12.100000000000001,
                    13.200000000000001,
                    14.3,
                    15.400000000000002,
                    16.5,
                    17.6,
                    18.700000000000003,
                    19.8,
                    20.900000000000002,
                    22.0,
                    23.1,
                    24.200000000000003,
                    25.3,
                    26.400000000000002,
                    27.500000000000004,
                    28.6,
                    29.700000000000003,
                    30.800000000000004,
                    31.900000000000002,
                ],
                &[
                    1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
                    1, 1, 2,
                ],
            ),
        ];
        for (values, expected) in cases {
            let (low, high) = (values[0], values[values.len() - 1]);
            let ends = if low < high { (low, high) } else { (low - 0.5, high + 0.5) };
            assert_eq!(counts(values, ends, expected.len()), *expected, "{values:?}");
        }
    }

    #[test]
    fn panels_have_the_same_bins() {
        let dims: &[(&str, &[&str])] = &[("seed", &["0", "1"]), ("ke", &["MA", "WCM"])];
        let y = super::super::arrange::tests::value(dims, &[0.0, 3.0, 1.0, 4.0]);
        let (dims, parts) = sorted(&y, &["ke".into()]).unwrap();
        assert_eq!(
            (panels(&dims).0, &parts[0][..]),
            (vec!["MA".into(), "WCM".into()], &[0.0, 1.0][..])
        );
        let first: Vec<f64> = bars(&parts[1], (0.0, 4.0), 2)
            .iter()
            .map(|mark| if let Mark::Bar { y, .. } = mark { *y } else { f64::NAN })
            .collect();
        assert_eq!(first, [0.0, 2.0]);
    }

    #[test]
    fn only_finite_values_count() {
        let y = super::super::arrange::tests::value(&[("x", &["0", "1"])], &[f64::NAN; 2]);
        let none = String::new;
        let facet = AxisNames(Vec::new());
        let all = Histogram { y, facet, bins: 2, title: none(), x_label: none(), y_label: none() };
        let svg = |all: &Histogram| {
            all.run(&Ctx::new("histogram", 0, None)).unwrap().files["svg"].clone()
        };
        let found = svg(&all);
        assert!(found.contains(">n/a<") && !found.contains("left out"), "{found}");
        let y = super::super::arrange::tests::value(&[("x", &["0", "1"])], &[1e300, 1e308]);
        let found = svg(&Histogram { y, ..all });
        assert!(found.contains(">n/a<") && found.contains("(2 beyond 1e300 left out)"), "{found}");
    }
}
