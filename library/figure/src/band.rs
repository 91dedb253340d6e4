//! The area about a value.

use ivx_op::{Array, AxisNames, Ctx, Everything, Facts, NumericAxis, Op, OpError, Wrong, declare};

use super::arrange::{Arranged, arrange, called, left_over, names, numbers};
use super::drawing::{Mark, Series};
use super::layer::{Layer, entry};
use super::panels::panels;

declare! {
    /// The area `center ± width · spread` along `x`; over `seed`, that of the two means.
    ///
    /// A curve of the same label has the same colour.
    pub struct Band = "band" @ 3 -> Layer {
        /// The middle.
        center: Everything<Array>;
        /// Half the height, in units of `width`.
        spread: Everything<Array>;
        /// An axis or dimension of both whose labels are numbers.
        x: NumericAxis;
        /// Axes that have a panel for each label; those of the last stand side by side.
        facet: AxisNames = Vec::<&str>::new();
        /// How many spreads the area reaches to either side.
        width: f64 = 3.0, in 0.0.., unit "spreads";
        /// The legend entry; where empty, what the spec calls `center`.
        label: String = "";
        /// Whether means are made of what is there where some of it is missing, because a node failed.
        skip_missing: bool = false;
    }
    rule only_x;
}

impl Op for Band {
    fn run(&self, _: &Ctx) -> Result<Layer, OpError> {
        let along = |value| {
            let at = (&self.facet.0[..], std::slice::from_ref(&self.x.0));
            arrange(value, at, self.skip_missing)?.at_most(0, ONLY_X)
        };
        let (center, spread): (Arranged, Arranged) = (along(&self.center)?, along(&self.spread)?);
        if (&center.inner, &center.outer) != (&spread.inner, &spread.outer) {
            let all = [&center.inner[..], &center.outer].concat();
            let (a, b, x) = (called(&center.name), called(&spread.name), names(&all));
            return Err(OpError::Failed(format!("{a} and {b} differ in the labels of `{x}`")));
        }
        let cells = center.cells.iter().zip(&spread.cells);
        let ends = cells.map(|(c, s)| (c.mean - self.width * s.mean, c.mean + self.width * s.mean));
        let ends: Vec<(f64, f64)> = ends.collect();
        let xs = numbers(&center.inner)?;
        let (panel_names, columns) = panels(&center.outer);
        let label = entry(&self.label, &center.name, "");
        let series = panel_names.into_iter().zip(ends.chunks(xs.len())).map(|(panel, ends)| {
            let places = xs.iter().zip(ends);
            let mut area: Vec<_> = places.map(|(x, (low, high))| (*x, *low, *high)).collect();
            area.sort_by(|a, b| a.0.total_cmp(&b.0));
            Series { label: label.clone(), panel, marks: vec![Mark::Band(area)] }
        });
        let lacks = center.lacks() + spread.lacks();
        Ok(Layer {
            lacks,
            x_label: names(&center.inner),
            y_label: center.name,
            columns,
            series: series.collect(),
        })
    }
}

fn only_x(facts: &Facts<'_>) -> Result<(), Wrong> {
    left_over(facts, "center", &["x", "facet"], 0, ONLY_X)?;
    left_over(facts, "spread", &["x", "facet"], 0, ONLY_X)
}

const ONLY_X: &str = "name it in `facet`";

#[cfg(test)]
mod tests {
    use super::super::arrange::tests::{axes, value};
    use super::*;

    const CTX: Ctx = Ctx::new("band", 0, None);

    fn band(center: Everything<Array>, spread: Everything<Array>) -> Result<Layer, OpError> {
        let (x, facet) = (NumericAxis("x".into()), axes(&[]));
        Band { center, spread, x, facet, width: 2.0, label: "±2σ".into(), skip_missing: false }
            .run(&CTX)
    }

    #[test]
    fn the_area_is_about_the_means() {
        // Means 2 and 5, spreads 0.5 and 1: 2 ± 1 and 5 ± 2.
        let dims: &[(&str, &[&str])] = &[("seed", &["0", "1"]), ("x", &["0", "1"])];
        let center = value(dims, &[1.0, 4.0, 3.0, 6.0]);
        let found = band(center, value(&dims[1..], &[0.5, 1.0])).unwrap();
        let marks = vec![Mark::Band(vec![(0.0, 1.0, 3.0), (1.0, 3.0, 7.0)])];
        assert_eq!(found.series, [Series { label: "±2σ".into(), marks, ..Series::default() }]);
    }

    #[test]
    fn both_need_the_same_places() {
        let found = band(value(&[("x", &["0"])], &[1.0]), value(&[("x", &["1"])], &[1.0]));
        let message = "`y` and `y` differ in the labels of `x`";
        assert_eq!(found, Err(OpError::Failed(message.into())));
    }
}
