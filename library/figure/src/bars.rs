//! Bars with whiskers.

use ivx_op::{
    Array, AxisNames, Ctx, Dim, Everything, Facts, Figure, Op, OpError, Wrong, declare, shown,
};

use super::arrange::{arrange, labels, left_over, names};
use super::drawing::{Axis, Drawing, Mark, Series};
use super::interval::Estimate;
use super::log::{is_log, known_scales, scaled};
use super::panels::{panels, spelled};
use super::range::{known_range, range};
use super::render::render;
use super::scale::placeable;

/// The share of a place that its bars take.
const FILLED: f64 = 0.72;

declare! {
    /// One bar for each label of `by`; over `seed`, the mean with its 95 % interval.
    ///
    /// One more axis gives groups of bars. Where a value is not finite, or beyond 1e300, or not above 0 where the
    /// axis is logarithmic, the figure says `n/a`. A bar that goes beyond `y_range` ends in an arrow.
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
        /// The lowest and the highest `y` shown; where empty, all are.
        y_range: Vec<f64> = Vec::<f64>::new();
        /// Whether equal differences or equal ratios are equally far apart along `y`: `linear` or `log`.
        y_scale: String = "linear";
        /// Whether each panel has a range of its own along `y`, as for values of different units.
        y_free: bool = false;
        /// Whether means are made of what is there where some of it is missing, because a node failed.
        skip_missing: bool = false;
    }
    rule shows_all;
}

impl Op for Bars {
    fn run(&self, _: &Ctx) -> Result<Figure, OpError> {
        let outer = [&self.facet.0[..], &self.by.0].concat();
        let all =
            arrange(&self.y, (&outer, &[]), self.skip_missing)?.at_most(1, "name it in `by`")?;
        let (facets, by) = all.outer.split_at(self.facet.0.len());
        let is_log = is_log(&self.y_scale).map_err(OpError::Failed)?;
        let range = range(&self.y_range, &self.y_scale).map_err(OpError::Failed)?;
        let (panel_names, columns) = panels(facets);
        let each = all.cells.len() / panel_names.len();
        let per_panel = panel_names.iter().zip(all.cells.chunks(each));
        let series = per_panel.flat_map(|(panel, cells)| series((panel, is_log), &all.rest, cells));
        let y_label = if self.y_label.is_empty() { &all.name } else { &self.y_label };
        let drawing = Drawing {
            title: self.title.clone(),
            x: Axis { label: names(by), names: labels(by), ..Axis::default() },
            y: Axis { label: y_label.clone(), range, free: self.y_free, ..Axis::default() },
            series: series.collect(),
            columns,
            lacks: all.lacks(),
            ..Drawing::default()
        };
        Ok(render(&scaled(drawing, "linear", &self.y_scale)?))
    }
}

fn shows_all(facts: &Facts<'_>) -> Result<(), Wrong> {
    known_scales(facts)?;
    known_range(facts)?;
    let given = facts.arg::<Vec<f64>>("y_range").is_some_and(|ends| !ends.is_empty());
    if given && facts.arg("y_free") == Some(true) {
        let message = "`y_range` is of all panels, and `y_free` gives each its own".to_owned();
        return Err(Wrong { arg: "y_range", message, help: "give one of both".to_owned() });
    }
    left_over(facts, "y", &["by", "facet"], 1, "name it in `by`")
}

/// The series of a panel, along whose axis a number may have no logarithm: one for each label of the axis left over.
#[expect(clippy::cast_precision_loss, reason = "bars are few")]
fn series((panel, is_log): (&str, bool), rest: &[Dim], cells: &[Estimate]) -> Vec<Series> {
    let groups = spelled(rest);
    let width = FILLED / groups.len() as f64;
    let left = |group: usize| (group as f64 + 0.5) * width - FILLED / 2.0;
    let of_group = |(group, label): (usize, &String)| {
        let cells = cells.iter().skip(group).step_by(groups.len());
        let marks =
            cells.enumerate().map(|(i, cell)| bar((i as f64 + left(group), width), *cell, is_log));
        Series { label: label.clone(), panel: panel.to_owned(), marks: marks.collect() }
    };
    groups.iter().enumerate().map(of_group).collect()
}

fn bar((x, width): (f64, f64), cell: Estimate, is_log: bool) -> Mark {
    let Estimate { mean: y, interval: whisker, .. } = cell;
    match y {
        _ if is_log && y <= 0.0 && y.is_finite() => {
            Mark::Text(x, 0.0, format!("n/a ({})", shown(y)))
        }
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

    fn plain() -> Bars {
        Bars {
            y: value(&[], &[0.0]),
            by: axes(&[]),
            facet: axes(&[]),
            title: String::new(),
            y_label: String::new(),
            y_range: Vec::new(),
            y_scale: "linear".into(),
            y_free: false,
            skip_missing: false,
        }
    }

    /// The drawing of bars that differ from those of `a`, `b` and so on.
    fn drawn(heights: &[f64], bars: Bars) -> String {
        let labels = ["a", "b", "c", "d"];
        let y = value(&[("k", &labels[..heights.len()])], heights);
        let bars = Bars { y, by: axes(&["k"]), ..bars };
        bars.run(&Ctx::new("bars", 0, None)).unwrap().files["svg"].clone()
    }

    /// The top and the height of each bar, without the background.
    fn tops(svg: &str) -> Vec<(f64, f64)> {
        let of = |bar: &str, name: &str| -> f64 {
            let from = bar.split(&format!(" {name}=\"")).nth(1).unwrap();
            from.split('"').next().unwrap().parse().unwrap()
        };
        let all = svg.split("<rect").skip(2).filter(|bar| bar.contains("fill=\"#0072B2\""));
        all.map(|bar| (of(bar, "y"), of(bar, "height"))).collect()
    }

    fn bars(y: Everything<Array>) -> Result<String, OpError> {
        let (by, facet) = (axes(&["ke"]), axes(&[]));
        let bars = Bars { y, by, facet, title: "T".into(), ..plain() };
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
    fn logarithmic_bars_stand_on_a_power_of_ten() {
        let log = || Bars { y_scale: "log".into(), ..plain() };
        let found = drawn(&[1.0, 100.0, -2.0, 0.0], log());
        for text in [">0.1<", ">1<", ">10<", ">100<", ">n/a (-2)<", ">n/a (0)<"] {
            assert!(found.contains(text), "{text} in {found}");
        }
        let tops = tops(&found);
        // From −1 to 2.1: one is 1 of 3.1 high, the other 3 of 3.1.
        let heights: Vec<f64> = tops.iter().map(|(_, height)| *height).collect();
        assert!((heights[1] / heights[0] - 3.0).abs() < 1e-3, "{heights:?}");
        assert!(tops.iter().all(|(top, height)| (top + height - 250.0).abs() < 0.02), "{tops:?}");
        assert!(!found.contains("NaN") && !found.contains("inf"), "{found}");
        let none = drawn(&[-1.0, f64::NAN], log());
        assert!(none.contains(">n/a (-1)<") && !none.contains("NaN"), "{none}");
    }

    #[test]
    fn what_leaves_the_range_ends_in_an_arrow() {
        let of = |low, high| Bars { y_range: vec![low, high], ..plain() };
        let found = drawn(&[0.5, 7.0, -3.0], of(0.0, 1.0));
        assert_eq!(tops(&found)[0], (125.0, 125.0));
        assert_eq!(found.matches("Z\" fill=\"#ffffff\"").count(), 2, "{found}");
        assert!(found.contains(">7<") && found.contains(">−3<"), "{found}");
        // One that does not reach the range is told too, and so is what is no number.
        let found = drawn(&[0.5, 1.5, f64::NAN], of(1.0, 2.0));
        assert_eq!(found.matches("Z\" fill=\"#ffffff\"").count(), 1, "{found}");
        assert!(found.contains(r#"y="246" font-size="11""#) && found.contains(">n/a<"), "{found}");
        let found = drawn(&[5.0, 1e4], Bars { y_scale: "log".into(), ..of(1.0, 1000.0) });
        assert!(found.contains(">10000<") || found.contains(">1e4<"), "{found}");
        assert_eq!(drawn(&[0.0, 1.0], of(0.0, 1.0)).matches('Z').count(), 0);
    }

    #[test]
    fn open_ends_of_intervals_lie_at_the_edge() {
        let (none, all) = (f64::NEG_INFINITY, f64::INFINITY);
        for (ends, scale) in [
            ([2.0, none, 3.0], "linear"),
            ([2.0, none, all], "linear"),
            ([2.0, none, 3.0], "log"),
            ([2.0, -1.0, 3.0], "log"),
        ] {
            let y = value(&[("k", &["a"]), (ivx_data::END, &ivx_data::ENDS)], &ends);
            let bars = Bars { y, by: axes(&["k"]), y_scale: scale.into(), ..plain() };
            let found = bars.run(&Ctx::new("bars", 0, None)).unwrap().files["svg"].clone();
            // A whisker from the bottom of the panel, without a cap there.
            let whisker = found.split(r#"fill="none""#).next().unwrap();
            let open = whisker.rsplit("<path").next().unwrap();
            assert!(open.contains(r#"d="M200 250L200"#), "{open} of {found}");
            let caps = usize::from(ends[2].is_finite() && ends[1] != all);
            assert_eq!(open.matches('M').count(), 1 + caps, "{open}");
            assert!(!found.contains("NaN") && !found.contains("inf"), "{found}");
        }
    }

    #[test]
    fn panels_of_other_units_have_ranges_of_their_own() {
        let y = || {
            let dims: &[(&str, &[&str])] = &[("target", &["kg", "mm"]), ("ke", &["a", "b"])];
            value(dims, &[1.0, 2.0, 1000.0, 2000.0])
        };
        let found = |y_free| {
            let (by, facet) = (axes(&["ke"]), axes(&["target"]));
            let bars = Bars { y: y(), by, facet, y_free, ..plain() };
            bars.run(&Ctx::new("bars", 0, None)).unwrap().files["svg"].clone()
        };
        let (free, shared) = (tops(&found(true)), tops(&found(false)));
        assert_eq!((free[0], free[1]), (free[2], free[3]));
        assert!(shared[0].1 < 1.0 && shared[2] == free[2], "{shared:?}");
        let labelled = found(true);
        assert!(labelled.contains(">2.0<") && labelled.contains(">2000<"), "{labelled}");
    }

    #[test]
    fn groups_stand_side_by_side_about_their_place() {
        let y = value(&[("task", &["t", "u"]), ("ke", &["a", "b"])], &[1.0, 2.0, 3.0, 4.0]);
        let all = arrange(&y, (&["ke".into()], &[]), false).unwrap();
        let check = |group: usize, label: &str, expected: [(f64, f64); 2]| {
            let found = &series(("", false), &all.rest, &all.cells)[group];
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
