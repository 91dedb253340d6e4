//! Numbers on a scale of their own: the mean is 0 and the standard deviation 1.

/// Where 0 is and how large 1 is in each column of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// Where 0 is.
    pub means: Vec<f64>,
    /// How large 1 is.
    pub stds: Vec<f64>,
}

impl Scale {
    /// That of rows of `width` numbers, whose standard deviation divides by their number. A column that is the same in
    /// all rows has 1 as its standard deviation.
    #[must_use]
    pub fn of(rows: &[f64], width: usize) -> Self {
        let columns = (0..width).map(|i| column(&rows.iter().skip(i).step_by(width)));
        let (means, stds) = columns.unzip();
        Self { means, stds }
    }

    /// That of `width` columns which stay as they are.
    #[must_use]
    pub fn none(width: usize) -> Self {
        Self { means: vec![0.0; width], stds: vec![1.0; width] }
    }

    /// `(x − mean) / std` of each number of rows.
    #[must_use]
    pub fn scaled(&self, rows: &[f64]) -> Vec<f64> {
        self.each(rows, |x, mean, std| (x - mean) / std)
    }

    /// `mean + std x`: what was scaled, in its own units.
    #[must_use]
    pub fn in_units(&self, rows: &[f64]) -> Vec<f64> {
        self.each(rows, |x, mean, std| mean + std * x)
    }

    /// `std x`: what was scaled and is a distance, in its own units.
    #[must_use]
    pub fn distances_in_units(&self, rows: &[f64]) -> Vec<f64> {
        self.each(rows, |x, _, std| std * x)
    }

    fn each(&self, rows: &[f64], of: impl Fn(f64, f64, f64) -> f64) -> Vec<f64> {
        let width = self.means.len();
        let place = rows.iter().enumerate();
        place.map(|(i, x)| of(*x, self.means[i % width], self.stds[i % width])).collect()
    }
}

/// The mean and the standard deviation of numbers; of those that are all the same that and 1.
fn column<'a>(xs: &(impl Iterator<Item = &'a f64> + Clone)) -> (f64, f64) {
    let n = crate::moments::real(xs.clone().count());
    let first = xs.clone().next().copied().unwrap_or_default();
    if xs.clone().all(|x| *x == first) {
        return (first, 1.0);
    }
    // From the first number on, so that large ones that lie close do not lose their digits.
    let mean = first + xs.clone().map(|x| x - first).sum::<f64>() / n;
    let squares = |unit: f64| xs.clone().map(|x| ((x - mean) / unit).powi(2)).sum::<f64>();
    // Squares of very large and very small numbers are no numbers, unless they are taken in a unit of theirs.
    let unit = xs.clone().map(|x| (x - mean).abs()).fold(0.0, f64::max);
    let unit = if (1e-140..1e140).contains(&unit) || unit == 0.0 { 1.0 } else { unit };
    let std = unit * (squares(unit) / n).sqrt();
    (mean, if std > 0.0 { std } else { 1.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_have_scales_of_their_own() {
        // 1 and 3 have the mean 2 and the deviation 1; 0.1 and 0.1 are the same.
        let scale = Scale::of(&[1.0, 0.1, 3.0, 0.1], 2);
        assert_eq!(scale, Scale { means: vec![2.0, 0.1], stds: vec![1.0, 1.0] });
        assert_eq!(scale.scaled(&[5.0, 0.6]), [3.0, 0.5]);
        assert_eq!(scale.in_units(&[3.0, 0.5]), [5.0, 0.6]);
        assert_eq!(Scale::of(&[0.0, 4.0], 1).distances_in_units(&[3.0]), [6.0]);
    }

    #[test]
    fn large_numbers_keep_their_digits() {
        let rows = [1e9, 1e9 + 1.0, 1e9 + 2.0];
        let scaled = Scale::of(&rows, 1).scaled(&rows);
        assert!((scaled[0] + 1.5_f64.sqrt()).abs() < 1e-12 && scaled[1] == 0.0, "{scaled:?}");
        for unit in [1e-200, 1e200, 1e-310] {
            let rows = [unit, 3.0 * unit];
            let scaled = Scale::of(&rows, 1).scaled(&rows);
            assert!((scaled[0] + 1.0).abs() < 1e-9 && (scaled[1] - 1.0).abs() < 1e-9, "{scaled:?}");
        }
    }
}
