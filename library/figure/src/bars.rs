//! Bars with whiskers.

use ivx_op::{
    Array, AxisNames, Ctx, Dim, Everything, Facts, Figure, Op, OpError, Wrong, declare, shown,
};

use super::arrange::{arrange, labels, left_over, names};
use super::drawing::{Axis, Drawing, Mark, Series};
use super::interval::Estimate;
use super::panels::{panels, spelled};
use super::render::render;
use super::scale::placeable;

/// The share of a place that its bars take.
const FILLED: f64 = 0.72;

declare! {
    /// One bar for each label of `by`; over `seed`, the mean with its 95 % interval.
    ///
    /// One more axis gives groups of bars. Where a value is not finite, or beyond 1e300, the figure says `n/a`.
    pub struct Bars = "bars" @ 5 -> Figure {
        /// The heights.
        y: Everything<Array>;
        /// Axes that have a bar for each label.
        by: AxisNames;
        /// Axes that have a panel for each label; those of the last stand side by side.
        facet: AxisNames = Vec::<&str>::new();
        /// Above the panel.
        title: String = "";
        /// What the vertical axis measures; where empty, what the spec calls `y`.
        y_label: String = "";
        /// Whether means are made of what is there where some of it is missing, because a node failed.
        skip_missing: bool = false;
    }
    rule one_group;
}

impl Op for Bars {
    fn run(&self, _: &Ctx) -> Result<Figure, OpError> {
        let outer = [&self.facet.0[..], &self.by.0].concat();
        let all =
            arrange(&self.y, (&outer, &[]), self.skip_missing)?.at_most(1, "name it in `by`")?;
        let (facets, by) = all.outer.split_at(self.facet.0.len());
        let (panel_names, columns) = panels(facets);
        let each = all.cells.len() / panel_names.len();
        let per_panel = panel_names.iter().zip(all.cells.chunks(each));
        let series = per_panel.flat_map(|(panel, cells)| series(panel, &all.rest, cells));
        let y_label = if self.y_label.is_empty() { &all.name } else { &self.y_label };
        Ok(render(&Drawing {
            title: self.title.clone(),
            x: Axis { label: names(by), names: labels(by), ..Axis::default() },
            y: Axis { label: y_label.clone(), ..Axis::default() },
            series: series.collect(),
            columns,
            lacks: all.lacks(),
            colours: None,
        }))
    }
}

fn one_group(facts: &Facts<'_>) -> Result<(), Wrong> {
    left_over(facts, "y", &["by", "facet"], 1, "name it in `by`")
}

/// The series of a panel: one for each label of the axis left over.
#[expect(clippy::cast_precision_loss, reason = "bars are few")]
fn series(panel: &str, rest: &[Dim], cells: &[Estimate]) -> Vec<Series> {
    let groups = spelled(rest);
    let width = FILLED / groups.len() as f64;
    let left = |group: usize| (group as f64 + 0.5) * width - FILLED / 2.0;
    let of_group = |(group, label): (usize, &String)| {
        let cells = cells.iter().skip(group).step_by(groups.len());
        let marks = cells.enumerate().map(|(i, cell)| bar(i as f64 + left(group), width, *cell));
        Series { label: label.clone(), panel: panel.to_owned(), marks: marks.collect() }
    };
    groups.iter().enumerate().map(of_group).collect()
}

fn bar(x: f64, width: f64, Estimate { mean: y, interval: whisker, .. }: Estimate) -> Mark {
    match y {
        _ if placeable(y) => Mark::Bar { x, width, y, whisker },
        // There is a number, and no room for it.
        _ if y.is_finite() => Mark::Text(x, 0.0, format!("n/a ({})", shown(y))),
        _ => Mark::Text(x, 0.0, "n/a".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::arrange::tests::{axes, value};
    use super::*;

    fn bars(y: Everything<Array>) -> Result<String, OpError> {
        let (by, facet) = (axes(&["ke"]), axes(&[]));
        let bars =
            Bars { y, by, facet, title: "T".into(), y_label: String::new(), skip_missing: false };
        let ctx = Ctx::new("bars", 0, None);
        bars.run(&ctx).map(|figure| figure.files["svg"].clone())
    }

    #[test]
    fn each_label_has_a_bar_and_seeds_give_whiskers() {
        let y = value(&[("seed", &["0", "1"]), ("ke", &["WCM", "MA"])], &[1.0, 2.0, 3.0, 4.0]);
        let found = bars(y).unwrap();
        for text in [">T<", ">ke<", ">y<", ">WCM<", ">MA<"] {
            assert!(found.contains(text), "{text} in {found}");
        }
        // The background and each bar.
        assert_eq!(found.matches("<rect").count(), 3);
        assert_eq!(found.matches(r#"stroke-width="1.2""#).count(), 2);
        let found = bars(value(&[("ke", &["WCM", "MA"])], &[1.0, f64::INFINITY])).unwrap();
        assert_eq!((found.matches("<rect").count(), found.contains(">n/a<")), (2, true));
        let found = bars(value(&[("ke", &["WCM", "MA"])], &[1e308, 1.0])).unwrap();
        assert_eq!((found.matches("<rect").count(), found.contains(">n/a (1e308)<")), (2, true));
    }

    #[test]
    fn groups_stand_side_by_side_about_their_place() {
        let y = value(&[("task", &["t", "u"]), ("ke", &["a", "b"])], &[1.0, 2.0, 3.0, 4.0]);
        let all = arrange(&y, (&["ke".into()], &[]), false).unwrap();
        let check = |group: usize, label: &str, expected: [(f64, f64); 2]| {
            let found = &series("", &all.rest, &all.cells)[group];
            assert_eq!(found.label, label);
            for (mark, (place, height)) in found.marks.iter().zip(expected) {
                let Mark::Bar { x, y, .. } = mark else { panic!("{mark:?}") };
                assert!((x - place).abs() < 1e-9 && *y == height, "{mark:?}");
            }
        };
        check(0, "t", [(-0.18, 1.0), (0.82, 2.0)]);
        check(1, "u", [(0.18, 3.0), (1.18, 4.0)]);
    }

    #[test]
    fn two_axes_too_many_are_one_too_many() {
        let y = value(&[("a", &["0"]), ("b", &["0"]), ("ke", &["k"])], &[1.0]);
        let found = bars(y).unwrap_err().to_string();
        assert!(found.starts_with("`y` also varies over `b`: name it in `by`"), "{found}");
    }
}
