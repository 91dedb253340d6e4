//! The area about a value.

use ivx_op::{Array, Ctx, Everything, Facts, NumericAxis, Op, OpError, Wrong, declare};

use super::arrange::{Arranged, arrange, called, left_over, names, numbers};
use super::drawing::{Mark, Series};
use super::layer::{Layer, entry};

declare! {
    /// The area `center ± width · spread` along `x`; over `seed`, that of the two means.
    ///
    /// A curve of the same label has the same colour.
    pub struct Band = "band" @ 1 -> Layer {
        /// The middle.
        center: Everything<Array>;
        /// Half the height, in units of `width`.
        spread: Everything<Array>;
        /// An axis or dimension of both whose labels are numbers.
        x: NumericAxis;
        /// How many spreads the area reaches to either side.
        width: f64 = 3.0, in 0.0.., unit "spreads";
        /// The legend entry; where empty, what the spec calls `center`.
        label: String = "";
    }
    rule only_x;
}

impl Op for Band {
    fn run(&self, _: &Ctx) -> Result<Layer, OpError> {
        let along =
            |value| arrange(value, &[], std::slice::from_ref(&self.x.0))?.at_most(0, ONLY_X);
        let (center, spread): (Arranged, Arranged) = (along(&self.center)?, along(&self.spread)?);
        if center.inner != spread.inner {
            let (a, b, x) = (called(&center.name), called(&spread.name), names(&center.inner));
            return Err(OpError::Failed(format!("{a} and {b} differ in the labels of `{x}`")));
        }
        let cells = center.cells.iter().zip(&spread.cells);
        let ends = cells.map(|(c, s)| (c.mean - self.width * s.mean, c.mean + self.width * s.mean));
        let xs = numbers(&center.inner)?.into_iter();
        let mut area: Vec<_> = xs.zip(ends).map(|(x, (low, high))| (x, low, high)).collect();
        area.sort_by(|a, b| a.0.total_cmp(&b.0));
        let label = entry(&self.label, &center.name, "");
        Ok(Layer {
            x_label: names(&center.inner),
            y_label: center.name,
            series: vec![Series { label, marks: vec![Mark::Band(area)] }],
        })
    }
}

fn only_x(facts: &Facts<'_>) -> Result<(), Wrong> {
    left_over(facts, "center", "x", 0, ONLY_X)?;
    left_over(facts, "spread", "x", 0, ONLY_X)
}

const ONLY_X: &str = "a band has only `x`";

#[cfg(test)]
mod tests {
    use super::super::arrange::tests::value;
    use super::*;

    const CTX: Ctx = Ctx::new("band", 0, None);

    fn band(center: Everything<Array>, spread: Everything<Array>) -> Result<Layer, OpError> {
        Band { center, spread, x: NumericAxis("x".into()), width: 2.0, label: "±2σ".into() }
            .run(&CTX)
    }

    #[test]
    fn the_area_is_about_the_means() {
        // Means 2 and 5, spreads 0.5 and 1: 2 ± 1 and 5 ± 2.
        let dims: &[(&str, &[&str])] = &[("seed", &["0", "1"]), ("x", &["0", "1"])];
        let center = value(dims, &[1.0, 4.0, 3.0, 6.0]);
        let found = band(center, value(&dims[1..], &[0.5, 1.0])).unwrap();
        let marks = vec![Mark::Band(vec![(0.0, 1.0, 3.0), (1.0, 3.0, 7.0)])];
        assert_eq!(found.series, [Series { label: "±2σ".into(), marks }]);
    }

    #[test]
    fn both_need_the_same_places() {
        let found = band(value(&[("x", &["0"])], &[1.0]), value(&[("x", &["1"])], &[1.0]));
        let message = "`y` and `y` differ in the labels of `x`";
        assert_eq!(found, Err(OpError::Failed(message.into())));
    }
}
