//! Lines of a value along an axis.

use ivx_op::{Array, AxisNames, Ctx, Everything, Facts, NumericAxis, Op, OpError, Wrong, declare};

use super::arrange::{arrange, left_over_but, names, numbers};
use super::drawing::{Mark, Series, Stroke};
use super::layer::{Layer, entry};
use super::panels::{panels, spelled};

declare! {
    /// Lines of `y` along `x`.
    ///
    /// Over `seed` a line is the mean, within a band that is its 95 % interval. Each member of an ensemble has a thin
    /// line of its own, without a band; so has each label of other axes where the style is `thin`.
    pub struct Curve = "curve" @ 5 -> Layer {
        /// The heights.
        y: Everything<Array>;
        /// An axis or dimension whose labels are numbers.
        x: NumericAxis;
        /// Axes that have a line and legend entry for each label.
        by: AxisNames = Vec::<&str>::new();
        /// Axes that have a panel for each label; those of the last stand side by side.
        facet: AxisNames = Vec::<&str>::new();
        /// The legend entry; where empty, what the spec calls `y`, or the label of `by` alone.
        label: String = "";
        /// `solid`, `dashed` or `thin`.
        style: String = "solid";
        /// Whether means are made of what is there where some of it is missing, because a node failed.
        skip_missing: bool = false;
    }
    rule known_style;
}

impl Op for Curve {
    fn run(&self, _: &Ctx) -> Result<Layer, OpError> {
        let stroke = stroke(&self.style).map_err(OpError::Failed)?;
        let looks = (&self.by, &self.facet, self.skip_missing);
        curves(&self.y, &self.x, looks, &self.label, stroke)
    }
}

/// The layer of lines of `y` along `x`, one series for each label of `by` in each panel.
pub(super) fn curves(
    y: &Everything<Array>,
    x: &NumericAxis,
    (by, facet, skips): (&AxisNames, &AxisNames, bool),
    label: &str,
    stroke: Stroke,
) -> Result<Layer, OpError> {
    let outer = [&facet.0[..], &by.0].concat();
    let all = arrange(y, (&outer, std::slice::from_ref(&x.0)), skips)?;
    let xs = numbers(&all.inner)?;
    let mut ascending: Vec<usize> = (0..xs.len()).collect();
    ascending.sort_by(|&i, &j| xs[i].total_cmp(&xs[j]));

    let (facets, by) = all.outer.split_at(facet.0.len());
    let (panel_names, columns) = panels(facets);
    let by_labels = spelled(by);
    let kinds = panel_names.iter().flat_map(|panel| by_labels.iter().map(move |l| (panel, l)));
    let per_kind = all.cells.chunks(all.cells.len() / (panel_names.len() * by_labels.len()));
    let single = all.rest.is_empty();
    let series = kinds.zip(per_kind).map(|((panel, coordinate), cells)| {
        let mut marks = Vec::new();
        for line in cells.chunks(xs.len()) {
            let edges = |i: usize| line[i].interval.map_or((f64::NAN, f64::NAN), |ends| ends);
            let band = ascending.iter().map(|&i| (xs[i], edges(i).0, edges(i).1)).collect();
            if single && line.iter().any(|cell| cell.interval.is_some()) {
                marks.push(Mark::Band(band));
            }
            let points = ascending.iter().map(|&i| (xs[i], line[i].mean)).collect();
            marks.push(Mark::Line(if single { stroke } else { Stroke::Thin }, points));
        }
        Series { label: entry(label, &all.name, coordinate), panel: panel.clone(), marks }
    });
    let (x_label, y_label) = (names(&all.inner), all.name.clone());
    Ok(Layer { x_label, y_label, columns, series: series.collect(), lacks: all.lacks() })
}

/// The rule that a line is told from every other, but those of members, which are alike.
pub(super) fn told_apart(facts: &Facts<'_>) -> Result<(), Wrong> {
    left_over_but("member", facts, "y", (&["x", "by", "facet"], 0), "name it in `by` or `facet`")
}

fn known_style(facts: &Facts<'_>) -> Result<(), Wrong> {
    // Who asks for thin lines means many that are alike.
    if facts.arg::<String>("style").is_none_or(|style| style != "thin") {
        told_apart(facts)?;
    }
    let Some(Err(message)) = facts.arg("style").map(|style: String| stroke(&style)) else {
        return Ok(());
    };
    let help = "write `\"solid\"`, `\"dashed\"` or `\"thin\"`".to_owned();
    Err(Wrong { arg: "style", message, help })
}

fn stroke(style: &str) -> Result<Stroke, String> {
    match style {
        "solid" => Ok(Stroke::Solid),
        "dashed" => Ok(Stroke::Dashed),
        "thin" => Ok(Stroke::Thin),
        _ => Err(format!("no style is called `{style}`")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::arrange::tests::{axes, value};
    use super::*;

    fn check(y: &Everything<Array>, by: &[&str], label: &str) -> Vec<Series> {
        curves(y, &NumericAxis("x".into()), (&axes(by), &axes(&[]), false), label, Stroke::Dashed)
            .unwrap()
            .series
    }

    fn series(label: &str, marks: Vec<Mark>) -> Series {
        Series { label: label.into(), marks, ..Series::default() }
    }

    #[test]
    fn each_label_has_a_line_in_the_order_of_x() {
        let y = value(&[("x", &["2", "1"]), ("ke", &["a", "b"])], &[1.0, 2.0, 3.0, 4.0]);
        let line = |points| vec![Mark::Line(Stroke::Dashed, points)];
        assert_eq!(
            check(&y, &["ke"], "g"),
            [
                series("g, a", line(vec![(1.0, 3.0), (2.0, 1.0)])),
                series("g, b", line(vec![(1.0, 4.0), (2.0, 2.0)])),
            ]
        );
    }

    #[test]
    fn each_panel_has_its_own() {
        let y = value(&[("x", &["0", "1"]), ("ke", &["a", "b"])], &[1.0, 2.0, 3.0, 4.0]);
        let (x, facet) = (NumericAxis("x".into()), axes(&["ke"]));
        let found = curves(&y, &x, (&axes(&[]), &facet, false), "", Stroke::Solid).unwrap().series;
        let line = |panel: &str, points| Series {
            label: "y".into(),
            panel: panel.into(),
            marks: vec![Mark::Line(Stroke::Solid, points)],
        };
        let [a, b] = [vec![(0.0, 1.0), (1.0, 3.0)], vec![(0.0, 2.0), (1.0, 4.0)]];
        assert_eq!(found, [line("a", a), line("b", b)]);
    }

    #[test]
    fn seeds_give_a_band_and_members_give_thin_lines() {
        let y = value(&[("seed", &["0", "1"]), ("x", &["0", "1"])], &[1.0, 2.0, 1.0, 2.0]);
        let found = check(&y, &[], "");
        assert_eq!(found[0].label, "y");
        let band = Mark::Band(vec![(0.0, 1.0, 1.0), (1.0, 2.0, 2.0)]);
        assert_eq!(
            found[0].marks,
            [band, Mark::Line(Stroke::Dashed, vec![(0.0, 1.0), (1.0, 2.0)])]
        );

        let y = value(&[("member", &["0", "1"]), ("x", &["0", "1"])], &[1.0, 2.0, 3.0, 4.0]);
        let thin = |points| Mark::Line(Stroke::Thin, points);
        let lines = [thin(vec![(0.0, 1.0), (1.0, 2.0)]), thin(vec![(0.0, 3.0), (1.0, 4.0)])];
        assert_eq!(check(&y, &[], "")[0].marks, lines);
    }

    #[test]
    fn an_unknown_style_is_an_error() {
        assert_eq!(stroke("bold"), Err("no style is called `bold`".to_owned()));
        assert_eq!(stroke("thin"), Ok(Stroke::Thin));
    }
}
