//! A figure of curves alone.

use ivx_op::{
    Array, AxisNames, Ctx, Everything, Facts, Figure, NumericAxis, Op, OpError, Wrong, declare,
};

use super::curve::{curves, told_apart};
use super::drawing::Stroke;
use super::log::{known_scales, scaled};
use super::plot::drawing;
use super::render::render;

declare! {
    /// A figure of `y` along `x`: short for `plot(curve(y, x: x, by: by))`.
    pub struct Lines = "lines" @ 5 -> Figure {
        /// The heights.
        y: Everything<Array>;
        /// An axis or dimension whose labels are numbers.
        x: NumericAxis;
        /// Axes that have a line and legend entry for each label.
        by: AxisNames = Vec::<&str>::new();
        /// Axes that have a panel for each label; those of the last stand side by side.
        facet: AxisNames = Vec::<&str>::new();
        /// Above the panel.
        title: String = "";
        /// What the horizontal axis measures; where empty, the name of `x`.
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
    rule shows_all;
}

fn shows_all(facts: &Facts<'_>) -> Result<(), Wrong> {
    told_apart(facts)?;
    known_scales(facts)
}

impl Op for Lines {
    fn run(&self, _: &Ctx) -> Result<Figure, OpError> {
        let layer = curves(
            &self.y,
            &self.x,
            (&self.by, &self.facet, self.skip_missing),
            "",
            Stroke::Solid,
        )?;
        let drawing = drawing(&[&layer], &self.title, &self.x_label, &self.y_label);
        Ok(render(&scaled(drawing, &self.x_scale, &self.y_scale)?))
    }
}

#[cfg(test)]
mod tests {
    use super::super::arrange::tests::{axes, value};
    use super::*;

    #[test]
    fn axes_are_named_after_what_they_show() {
        let lines = |by: &[&str]| Lines {
            y: value(&[("ke", &["WCM", "MA"]), ("x", &["0", "1"])], &[1.0, 2.0, 3.0, 4.0]),
            x: NumericAxis("x".into()),
            by: axes(by),
            facet: axes(&[]),
            title: String::new(),
            x_label: String::new(),
            y_label: String::new(),
            x_scale: "linear".into(),
            y_scale: "linear".into(),
            skip_missing: false,
        };
        let ctx = Ctx::new("lines", 0, None);
        let run = |by| lines(by).run(&ctx).unwrap().files["svg"].clone();
        let found = run(&["ke"]);
        for text in [">x<", ">y<", ">WCM<", ">MA<"] {
            assert!(found.contains(text), "{text} in {found}");
        }
        assert_eq!(found.matches("<polyline").count(), 4);
        // Without `by`, thin lines under the axis label alone.
        let found = run(&[]);
        assert_eq!((found.matches("<polyline").count(), found.contains("WCM")), (2, false));
    }

    #[test]
    fn a_thousand_points_of_fifty_series_are_less_than_a_megabyte() {
        let labels: Vec<String> = (0..1000).map(|i: i32| i.to_string()).collect();
        let labels: Vec<&str> = labels.iter().map(String::as_str).collect();
        let heights: Vec<f64> =
            (0..50_000_u32).map(|i| f64::from(i.wrapping_mul(2_654_435_761)) / 1e7).collect();
        let none = String::new;
        let lines = Lines {
            y: value(&[("ke", &labels[..50]), ("x", &labels)], &heights),
            x: NumericAxis("x".into()),
            by: axes(&["ke"]),
            facet: axes(&[]),
            title: none(),
            x_label: none(),
            y_label: none(),
            x_scale: "linear".into(),
            y_scale: "linear".into(),
            skip_missing: false,
        };
        let draw = || lines.run(&Ctx::new("lines", 0, None)).unwrap().files["svg"].clone();
        let (svg, again) = (draw(), draw());
        assert!(svg.len() < 1_000_000, "{}", svg.len());
        assert_eq!(svg, again);
    }
}
