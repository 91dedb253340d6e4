//! Layers put together in one figure.

use std::mem::discriminant;

use ivx_op::{Ctx, Everything, Facts, Figure, Many, Op, OpError, Wrong, declare};

use super::drawing::{Axis, Drawing, Series, Stroke};
use super::layer::Layer;
use super::log::{known_scales, scaled};
use super::range::{known_range, range};
use super::render::render;

declare! {
    /// Layers in one figure, later ones over earlier ones.
    ///
    /// Series of one label share colour, marker and legend entry, whichever layer they are of: a curve and its band, or
    /// many thin lines. Two curves that could not be told apart are refused.
    pub struct Plot = "plot" @ 3 -> Figure {
        /// What `curve`, `band`, `points` and `level` made.
        layers: Many<Everything<Layer>>;
        /// Above the panel.
        title: String = "";
        /// What the horizontal axis measures; where empty, what the first layer says that knows.
        x_label: String = "";
        /// What the vertical axis measures; where empty, what the first layer says that knows.
        y_label: String = "";
        /// The lowest and the highest `y` shown; where empty, all are.
        y_range: Vec<f64> = Vec::<f64>::new();
        /// Whether equal differences or equal ratios are equally far apart along `x`: `linear` or `log`.
        x_scale: String = "linear";
        /// The same along `y`.
        y_scale: String = "linear";
    }
    rule known_axes;
}

fn known_axes(facts: &Facts<'_>) -> Result<(), Wrong> {
    known_scales(facts)?;
    known_range(facts)
}

impl Op for Plot {
    fn run(&self, _: &Ctx) -> Result<Figure, OpError> {
        let layers: Vec<&Layer> = self.layers.0.iter().flat_map(|port| &port.0.values).collect();
        told_apart(&layers)?;
        let mut drawing = drawing(&layers, &self.title, &self.x_label, &self.y_label);
        drawing.y.range = range(&self.y_range, &self.y_scale).map_err(OpError::Failed)?;
        Ok(render(&scaled(drawing, &self.x_scale, &self.y_scale)?))
    }
}

/// Whether no two layers have lines that look alike.
fn told_apart(layers: &[&Layer]) -> Result<(), OpError> {
    for (i, layer) in layers.iter().enumerate() {
        let earlier = || layers[..i].iter().flat_map(|layer| &layer.series);
        let alike = |series: &&Series| earlier().any(|other| alike(series, other));
        if let Some(Series { label, .. }) = layer.series.iter().find(alike) {
            let message = format!(
                "two layers have lines of the label `{label}`: give one another by `label:`"
            );
            return Err(OpError::Failed(message));
        }
    }
    Ok(())
}

/// Whether nobody could say of which of two series a line is.
fn alike(one: &Series, other: &Series) -> bool {
    let meet = one.panel == other.panel || one.panel.is_empty() || other.panel.is_empty();
    let lines = |series: &Series| {
        let bold =
            series.marks.iter().filter_map(|mark| Some((discriminant(mark), mark.stroke()?)));
        bold.filter(|(_, stroke)| *stroke != Stroke::Thin).collect::<Vec<_>>()
    };
    let same = || lines(one).iter().any(|line| lines(other).contains(line));
    !one.label.is_empty() && one.label == other.label && meet && same()
}

/// The layers as one drawing; empty axis labels are filled from the layers.
pub(super) fn drawing(layers: &[&Layer], title: &str, x_label: &str, y_label: &str) -> Drawing {
    let axis = |given: &str, of: fn(&Layer) -> &str| {
        let mut known = layers.iter().map(|layer| of(layer)).filter(|label| !label.is_empty());
        let label = if given.is_empty() { known.next().unwrap_or_default() } else { given };
        Axis { label: label.to_owned(), ..Axis::default() }
    };
    Drawing {
        title: title.to_owned(),
        x: axis(x_label, |layer| &layer.x_label),
        y: axis(y_label, |layer| &layer.y_label),
        series: layers.iter().flat_map(|layer| layer.series.clone()).collect(),
        columns: layers.iter().map(|layer| layer.columns).max().unwrap_or(0),
        lacks: layers.iter().map(|layer| layer.lacks).sum(),
        ..Drawing::default()
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::Gathered;

    use super::super::drawing::{Mark, Series, Stroke};
    use super::*;

    fn plot(layers: Vec<Layer>, y_range: Vec<f64>) -> Result<String, OpError> {
        let port =
            |layer| Everything(Gathered { dims: vec![], values: vec![layer], name: String::new() });
        let plot = Plot {
            layers: Many(layers.into_iter().map(port).collect()),
            title: "T".into(),
            x_label: String::new(),
            y_label: "reward".into(),
            y_range,
            x_scale: "linear".into(),
            y_scale: "linear".into(),
        };
        let ctx = Ctx::new("plot", 0, None);
        plot.run(&ctx).map(|figure| figure.files["svg"].clone())
    }

    fn layer(label: &str, x_label: &str, mark: Mark) -> Layer {
        let series = vec![Series { label: label.into(), marks: vec![mark], ..Series::default() }];
        Layer { x_label: x_label.into(), y_label: "y".into(), series, ..Layer::default() }
    }

    #[test]
    fn layers_share_one_panel() {
        let line = Mark::Line(Stroke::Solid, vec![(0.0, 0.0), (1.0, 8.0)]);
        let band = Mark::Band(vec![(0.0, -1.0, 1.0), (1.0, 7.0, 9.0)]);
        let layers =
            || vec![layer("truth", "", line.clone()), layer("belief", "action", band.clone())];
        let found = plot(layers(), vec![]).unwrap();
        for text in [">T<", ">action<", ">reward<", ">truth<", ">belief<", ">8<"] {
            assert!(found.contains(text), "{text} in {found}");
        }
        assert!(!found.contains(">y<"));
        // Each once in the panel and once in the legend.
        assert_eq!((found.matches("<polyline").count(), found.matches("<polygon").count()), (2, 2));
        let cut = plot(layers(), vec![0.0, 0.5]).unwrap();
        assert!(cut.contains(">0.5<") && !cut.contains(">8<"));
    }

    #[test]
    fn lines_that_look_alike_are_refused() {
        let line = |stroke| Mark::Line(stroke, vec![(0.0, 0.0), (1.0, 8.0)]);
        let (solid, thin) = (line(Stroke::Solid), line(Stroke::Thin));
        let of = |label: &str, mark: &Mark| layer(label, "x", mark.clone());
        let check = |one: Layer, other: Layer| plot(vec![one, other], vec![]);
        let why = check(of("a", &solid), of("a", &solid)).unwrap_err().to_string();
        assert_eq!(why, "two layers have lines of the label `a`: give one another by `label:`");
        // Those without a label have looks of their own.
        for (one, other) in [("a", "b"), ("", "")] {
            assert!(check(of(one, &solid), of(other, &solid)).is_ok());
        }
        let level = Mark::Level(Stroke::Dashed, 1.0);
        let band = Mark::Band(vec![(0.0, 1.0, 2.0)]);
        for mark in [&line(Stroke::Dashed), &level, &band, &thin] {
            assert!(check(of("a", &solid), of("a", mark)).is_ok(), "{mark:?}");
        }
        assert!(check(of("a", &level), of("a", &level)).is_err());
        assert!(check(of("a", &thin), of("a", &thin)).is_ok());
        let [mut p, mut q] = [of("a", &solid), of("a", &solid)];
        p.series[0].panel = "p".into();
        assert!(check(p.clone(), q.clone()).is_err());
        q.series[0].panel = "q".into();
        assert!(check(p, q).is_ok());
    }
}
