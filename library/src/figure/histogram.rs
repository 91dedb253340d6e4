//! How often a value falls where.

use ivx_op::{Array, AxisNames, Ctx, Everything, Figure, Op, OpError, declare};

use super::arrange::{called, sorted};
use super::drawing::{Axis, Drawing, Mark, Series};
use super::panels::panels;
use super::render::render;

declare! {
    /// How many of all values of `y`, over everything it varies over, fall into equal bins.
    pub struct Histogram = "histogram" @ 2 -> Figure {
        /// The values; those that are not finite are left out.
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
        for values in &mut parts {
            values.retain(|x| x.abs() < 1e300);
        }
        let all = || parts.iter().flatten().copied();
        if all().next().is_none() {
            return Err(OpError::Failed(format!("{} has no finite values", called(name))));
        }
        let ends = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
        let (panel_names, columns) = panels(&dims);
        let x_label = if self.x_label.is_empty() { name } else { &self.x_label };
        let axis = |label: &str| Axis { label: label.to_owned(), ..Axis::default() };
        let bins = usize::try_from(self.bins).unwrap_or(usize::MAX).clamp(1, 1000);
        let series = panel_names.into_iter().zip(&parts).map(|(panel, values)| Series {
            panel,
            marks: bars(values, ends, bins),
            ..Series::default()
        });
        Ok(render(&Drawing {
            title: self.title.clone(),
            x: axis(x_label),
            y: axis(&self.y_label),
            series: series.collect(),
            columns,
            colours: None,
        }))
    }
}

/// One bar a bin between the ends. A value between two bins counts in the upper, the highest in the last.
#[expect(clippy::cast_precision_loss, reason = "bins and counts are far below 2^53")]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bins are few")]
fn bars(values: &[f64], (low, high): (f64, f64), n_bins: usize) -> Vec<Mark> {
    let (low, high) = if low < high { (low, high) } else { (low - 0.5, high + 0.5) };
    let width = (high - low) / n_bins as f64;
    let mut counts = vec![0_u32; n_bins];
    for x in values {
        counts[(((x - low) / width) as usize).min(n_bins - 1)] += 1;
    }
    let bar = |(i, count): (usize, &u32)| {
        let x = low + (i as f64 + 0.5) * width;
        Mark::Bar { x, width: width * 0.96, y: f64::from(*count), whisker: None }
    };
    counts.iter().enumerate().map(bar).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(values: &[f64], n_bins: usize) -> Vec<(f64, f64)> {
        let ends = (values[0], values[values.len() - 1]);
        let place = |mark: &Mark| match mark {
            Mark::Bar { x, y, .. } => (*x, *y),
            _ => (f64::NAN, f64::NAN),
        };
        bars(values, ends, n_bins).iter().map(place).collect()
    }

    #[test]
    fn each_value_counts_once() {
        let found = counts(&[0.0, 0.5, 1.0, 1.0, 1.9, 4.0], 4);
        assert_eq!(found, [(0.5, 2.0), (1.5, 3.0), (2.5, 0.0), (3.5, 1.0)]);
        assert_eq!(counts(&[3.0, 3.0], 1), [(3.0, 2.0)]);
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
        let found = all.run(&Ctx::new("histogram", 0, None));
        assert_eq!(found, Err(OpError::Failed("`y` has no finite values".into())));
    }
}
