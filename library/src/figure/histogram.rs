//! How often a value falls where.

use ivx_op::{Array, Ctx, Everything, Figure, Op, OpError, declare};

use super::arrange::called;
use super::drawing::{Axis, Drawing, Mark, Series};
use super::render::render;

declare! {
    /// How many of all values of `y`, over everything it varies over, fall into equal bins.
    pub struct Histogram = "histogram" @ 1 -> Figure {
        /// The values; those that are not finite are left out.
        y: Everything<Array>;
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
        let gathered = &self.y.0;
        let values = gathered.values.iter().flat_map(|array| &array.values).copied();
        let values: Vec<f64> = values.filter(|x| x.abs() < 1e300).collect();
        if values.is_empty() {
            let message = format!("{} has no finite values", called(&gathered.name));
            return Err(OpError::Failed(message));
        }
        let x_label = if self.x_label.is_empty() { &gathered.name } else { &self.x_label };
        let axis = |label: &str| Axis { label: label.to_owned(), ..Axis::default() };
        let bins = usize::try_from(self.bins).unwrap_or(usize::MAX).clamp(1, 1000);
        Ok(render(&Drawing {
            title: self.title.clone(),
            x: axis(x_label),
            y: axis(&self.y_label),
            series: vec![Series { label: String::new(), marks: bars(&values, bins) }],
        }))
    }
}

/// One bar a bin. A value between two bins counts in the upper, the highest in the last.
#[expect(clippy::cast_precision_loss, reason = "bins and counts are far below 2^53")]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bins are few")]
fn bars(values: &[f64], n_bins: usize) -> Vec<Mark> {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
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
        let place = |mark: &Mark| match mark {
            Mark::Bar { x, y, .. } => (*x, *y),
            _ => (f64::NAN, f64::NAN),
        };
        bars(values, n_bins).iter().map(place).collect()
    }

    #[test]
    fn each_value_counts_once() {
        let found = counts(&[0.0, 0.5, 1.0, 1.0, 1.9, 4.0], 4);
        assert_eq!(found, [(0.5, 2.0), (1.5, 3.0), (2.5, 0.0), (3.5, 1.0)]);
        assert_eq!(counts(&[3.0, 3.0], 1), [(3.0, 2.0)]);
    }

    #[test]
    fn only_finite_values_count() {
        let y = super::super::arrange::tests::value(&[("x", &["0", "1"])], &[f64::NAN; 2]);
        let none = String::new;
        let all = Histogram { y, bins: 2, title: none(), x_label: none(), y_label: none() };
        let found = all.run(&Ctx::new("histogram", 0, None));
        assert_eq!(found, Err(OpError::Failed("`y` has no finite values".into())));
    }
}
