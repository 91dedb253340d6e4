//! Bars with whiskers.

use ivx_op::{Array, AxisNames, Ctx, Everything, Facts, Figure, Op, OpError, Wrong, declare};

use super::arrange::{Arranged, arrange, labels, left_over, names};
use super::drawing::{Axis, Drawing, Mark, Series};
use super::interval::Estimate;
use super::render::render;

/// The share of a place that its bars take.
const FILLED: f64 = 0.72;

declare! {
    /// One bar for each label of `by`; over `seed`, the mean with its 95 % interval.
    ///
    /// One more axis gives groups of bars. Where a value is not finite, the figure says `n/a`.
    pub struct Bars = "bars" @ 1 -> Figure {
        /// The heights.
        y: Everything<Array>;
        /// Axes that have a bar for each label.
        by: AxisNames;
        /// Above the panel.
        title: String = "";
        /// What the vertical axis measures; where empty, what the spec calls `y`.
        y_label: String = "";
    }
    rule one_group;
}

impl Op for Bars {
    fn run(&self, _: &Ctx) -> Result<Figure, OpError> {
        let all = arrange(&self.y, &self.by.0, &[])?.at_most(1, "name it in `by`")?;
        let y_label = if self.y_label.is_empty() { &all.name } else { &self.y_label };
        Ok(render(&Drawing {
            title: self.title.clone(),
            x: Axis { label: names(&all.outer), names: labels(&all.outer), range: None },
            y: Axis { label: y_label.clone(), ..Axis::default() },
            series: series(&all),
        }))
    }
}

fn one_group(facts: &Facts<'_>) -> Result<(), Wrong> {
    left_over(facts, "y", "by", 1, "name it in `by`")
}

/// One series for each label of the axis left over.
#[expect(clippy::cast_precision_loss, reason = "bars are few")]
fn series(all: &Arranged) -> Vec<Series> {
    let groups = labels(&all.rest);
    let width = FILLED / groups.len() as f64;
    let left = |group: usize| (group as f64 + 0.5) * width - FILLED / 2.0;
    let of_group = |(group, label): (usize, &String)| {
        let cells = all.cells.iter().skip(group).step_by(groups.len());
        let marks = cells.enumerate().map(|(i, cell)| bar(i as f64 + left(group), width, *cell));
        Series { label: label.clone(), marks: marks.collect() }
    };
    groups.iter().enumerate().map(of_group).collect()
}

fn bar(x: f64, width: f64, Estimate { mean: y, interval: whisker }: Estimate) -> Mark {
    if y.is_finite() {
        Mark::Bar { x, width, y, whisker }
    } else {
        Mark::Text(x, 0.0, "n/a".into())
    }
}

#[cfg(test)]
mod tests {
    use super::super::arrange::tests::{axes, value};
    use super::*;

    fn bars(y: Everything<Array>) -> Result<String, OpError> {
        let bars = Bars { y, by: axes(&["ke"]), title: "T".into(), y_label: String::new() };
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
    }

    #[test]
    fn groups_stand_side_by_side_about_their_place() {
        let y = value(&[("task", &["t", "u"]), ("ke", &["a", "b"])], &[1.0, 2.0, 3.0, 4.0]);
        let all = arrange(&y, &["ke".into()], &[]).unwrap();
        let check = |group: usize, label: &str, expected: [(f64, f64); 2]| {
            let found = &series(&all)[group];
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
