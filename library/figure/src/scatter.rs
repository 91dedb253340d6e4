//! One value against another.

use ivx_op::{Array, AxisNames, Ctx, Everything, Figure, Op, OpError, declare};

use super::arrange::{Arranged, arrange, called, names};
use super::drawing::{Axis, Drawing, Mark, Series};
use super::log::{known_scales, scaled};
use super::panels::{panels, spelled};
use super::render::render;

declare! {
    /// A point at `(x, y)` for each label of all that the two vary over, which must be the same; over `seed`,
    /// at the two means.
    pub struct Scatter = "scatter" @ 4 -> Figure {
        /// How far to the right.
        x: Everything<Array>;
        /// How far up.
        y: Everything<Array>;
        /// Axes that have a look and legend entry for each label.
        by: AxisNames = Vec::<&str>::new();
        /// Axes that have a panel for each label; those of the last stand side by side.
        facet: AxisNames = Vec::<&str>::new();
        /// Above the panels.
        title: String = "";
        /// What the horizontal axis measures; where empty, what the spec calls `x`.
        x_label: String = "";
        /// What the vertical axis measures; where empty, what the spec calls `y`.
        y_label: String = "";
        /// Whether equal differences or equal ratios are equally far apart along `x`: `linear` or `log`.
        x_scale: String = "linear";
        /// The same along `y`.
        y_scale: String = "linear";
        /// Whether means are made of what is there where some of it is missing, because a node failed.
        skip_missing: bool = false;
    }
    rule known_scales;
}

impl Op for Scatter {
    fn run(&self, _: &Ctx) -> Result<Figure, OpError> {
        let outer = [&self.facet.0[..], &self.by.0].concat();
        let (x, y) = (
            arrange(&self.x, (&outer, &[]), self.skip_missing)?,
            arrange(&self.y, (&outer, &[]), self.skip_missing)?,
        );
        if (&x.outer, &x.rest) != (&y.outer, &y.rest) {
            return Err(OpError::Failed(differ(&x, &y)));
        }
        let (facets, by) = y.outer.split_at(self.facet.0.len());
        let (panel_names, columns) = panels(facets);
        let by_labels = spelled(by);
        let points: Vec<(f64, f64)> =
            x.cells.iter().zip(&y.cells).map(|(x, y)| (x.mean, y.mean)).collect();
        let each = points.len() / (panel_names.len() * by_labels.len());
        let kinds = panel_names.iter().flat_map(|panel| by_labels.iter().map(move |l| (panel, l)));
        let series = kinds.zip(points.chunks(each)).map(|((panel, label), points)| Series {
            label: label.clone(),
            panel: panel.clone(),
            marks: vec![Mark::Points(points.to_vec())],
        });
        let axis = |given: &str, name: &str| Axis {
            label: if given.is_empty() { name } else { given }.to_owned(),
            ..Axis::default()
        };
        let drawing = Drawing {
            title: self.title.clone(),
            x: axis(&self.x_label, &x.name),
            y: axis(&self.y_label, &y.name),
            series: series.collect(),
            columns,
            lacks: x.lacks() + y.lacks(),
            ..Drawing::default()
        };
        Ok(render(&scaled(drawing, &self.x_scale, &self.y_scale)?))
    }
}

fn differ(x: &Arranged, y: &Arranged) -> String {
    let over = |all: &Arranged| match names(&[&all.outer[..], &all.rest].concat()) {
        names if names.is_empty() => "nothing".to_owned(),
        names => format!("`{names}`"),
    };
    let (a, b) = (called(&x.name), called(&y.name));
    format!("{a} varies over {} and {b} over {}, or over other labels", over(x), over(y))
}

#[cfg(test)]
mod tests {
    use super::super::arrange::tests::{axes, value};
    use super::*;

    fn scatter(x: Everything<Array>, y: Everything<Array>) -> Result<String, OpError> {
        let none = String::new;
        let (by, facet) = (axes(&["ke"]), axes(&[]));
        let all = Scatter {
            x,
            y,
            by,
            facet,
            title: none(),
            x_label: "gap".into(),
            y_label: none(),
            skip_missing: false,
            x_scale: "linear".into(),
            y_scale: "linear".into(),
        };
        all.run(&Ctx::new("scatter", 0, None)).map(|figure| figure.files["svg"].clone())
    }

    #[test]
    fn each_coordinate_has_a_point() {
        let dims: &[(&str, &[&str])] = &[("member", &["0", "1", "2"]), ("ke", &["WCM", "MA"])];
        let x = value(dims, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        let y = value(dims, &[5.0, 4.0, 3.0, 2.0, 1.0, f64::NAN]);
        let found = scatter(x, y).unwrap();
        // Three circles and two squares, and one of each in the legend.
        assert_eq!((found.matches("<circle").count(), found.matches("<polygon").count()), (4, 3));
        for text in [">WCM<", ">MA<", ">gap<", ">y<"] {
            assert!(found.contains(text), "{text} in {found}");
        }
    }

    #[test]
    fn both_vary_over_the_same() {
        let ke: (&str, &[&str]) = ("ke", &["WCM"]);
        let found = scatter(value(&[ke], &[1.0]), value(&[ke, ("n", &["1"])], &[1.0]));
        let message = "`y` varies over `ke` and `y` over `ke, n`, or over other labels";
        assert_eq!(found, Err(OpError::Failed(message.into())));
    }
}
