//! What range an axis shows, and where its ticks are.

use super::drawing::{Axis, Drawing, Mark, Series};

/// The range of values along one side of the panel; `low < high`, both of moderate size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// At the left or bottom.
    pub(super) low: f64,
    /// At the right or top.
    pub(super) high: f64,
}

/// Ticks of a numeric axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ticks {
    /// Where they are.
    pub(super) at: Vec<f64>,
    /// What they say, in units of `10^exponent`.
    pub(super) labels: Vec<String>,
    /// 0 where labels say the number itself.
    pub(super) exponent: i32,
}

/// Beyond this, sums and differences of coordinates would overflow.
const LARGEST: f64 = 1e300;

/// Whether a number can be placed.
pub(super) fn placeable(x: f64) -> bool {
    x.abs() < LARGEST
}

/// Whether two ends are far enough apart for ticks between them to be told apart.
pub(super) fn apart(low: f64, high: f64) -> bool {
    high - low > 1e-13 * low.abs().max(high.abs()) && high - low > 1e-300
}

/// The range of the horizontal axis, and that of the vertical axis of each panel.
pub(super) fn scales(drawing: &Drawing) -> (Scale, Vec<Scale>) {
    let marks = drawing.series.iter().flat_map(|series| &series.marks);
    let xs = marks.flat_map(|mark| extent(mark).0);
    let x = places(&drawing.x)
        .unwrap_or_else(|| drawing.x.range.map_or_else(|| padded(xs, 0.02), exactly));
    let panels = drawing.panels();
    let y = if drawing.y.free {
        let here = |panel: &&str| upward(drawing, |series| [*panel, ""].contains(&&*series.panel));
        panels.iter().map(here).collect()
    } else {
        vec![upward(drawing, |_| true); panels.len()]
    };
    (x, y)
}

/// The range of a vertical axis along which these series lie.
fn upward(drawing: &Drawing, here: impl Fn(&Series) -> bool) -> Scale {
    let axis = &drawing.y;
    let all: Vec<&Series> = drawing.series.iter().filter(|series| here(series)).collect();
    let marks = || all.iter().flat_map(|series| &series.marks);
    let has_bars = marks().any(|mark| matches!(mark, Mark::Bar { .. }));
    let foot = (has_bars && !axis.log).then_some(0.0);
    let ys = marks().flat_map(|mark| extent(mark).1).chain(foot);
    let y = places(axis).unwrap_or_else(|| axis.range.map_or_else(|| padded(ys, 0.05), exactly));
    if !has_bars || axis.range.is_some() {
        return y;
    }
    // A bar stands on the axis, and where that is logarithmic on a power of ten.
    let hanging = marks().any(|mark| extent(mark).1.iter().any(|&y| y < 0.0));
    match (axis.log, hanging) {
        (true, _) => Scale { low: y.low.floor(), ..y },
        (false, true) => y,
        (false, false) => Scale { low: 0.0, ..y },
    }
}

/// The range of an axis that has names.
#[expect(clippy::cast_precision_loss, reason = "names are few")]
fn places(axis: &Axis) -> Option<Scale> {
    let n = axis.names.len();
    (n > 0).then(|| Scale { low: -0.5, high: n as f64 - 0.5 })
}

impl Scale {
    /// Where `value` lies on a side of this length, from its low end.
    pub(super) fn place(self, value: f64, length: f64) -> f64 {
        (value - self.low) / (self.high - self.low) * length
    }
}

/// Round numbers inside the scale, about this many, with labels of equal precision.
#[expect(clippy::cast_possible_truncation, reason = "logarithms and tick numbers are small")]
#[expect(clippy::cast_precision_loss, reason = "tick numbers are small")]
pub(super) fn ticks(scale: Scale, about: u32) -> Ticks {
    let raw = (scale.high - scale.low) / f64::from(about);
    let floor = raw.log10().floor() as i32;
    let unit = raw / 10_f64.powi(floor);
    let (power, digit) = match unit {
        _ if unit <= 1.0 => (floor, 1),
        _ if unit <= 2.0 => (floor, 2),
        _ if unit <= 5.0 => (floor, 5),
        _ => (floor + 1, 1),
    };
    let step = f64::from(digit) * 10_f64.powi(power);
    let first = (scale.low / step - 1e-6).ceil() as i64;
    let last = (scale.high / step + 1e-6).floor() as i64;
    let at: Vec<f64> = (first..=last).map(|i| i as f64 * step).collect();

    let largest = at.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    let magnitude = if largest > 0.0 { (largest.log10() + 1e-9).floor() as i32 } else { 0 };
    let digits_after = magnitude - power;
    let exponent = match magnitude {
        _ if magnitude < -3 => magnitude,
        _ if magnitude >= 5 && digits_after <= 3 => magnitude,
        _ => 0,
    };
    let decimals = usize::try_from(exponent - power).unwrap_or(0);
    let label = |x: &f64| format!("{:.decimals$}", x / 10_f64.powi(exponent)).replace('-', "−");
    Ticks { labels: at.iter().map(label).collect(), at, exponent }
}

fn exactly((low, high): (f64, f64)) -> Scale {
    Scale { low, high }
}

/// All finite coordinates, with room for `share` of the span at either end.
fn padded(values: impl Iterator<Item = f64>, share: f64) -> Scale {
    let ends = values.filter(|&x| placeable(x)).fold(None, |ends: Option<(f64, f64)>, x| {
        Some(ends.map_or((x, x), |(low, high)| (low.min(x), high.max(x))))
    });
    let (low, high) = ends.unwrap_or((0.0, 1.0));
    let size = low.abs().max(high.abs());
    let room = match high - low {
        span if apart(low, high) => span * share,
        _ if size > 1e-290 => size * 0.1,
        _ => 0.5,
    };
    Scale { low: low - room, high: high + room }
}

/// The horizontal and vertical coordinates that a mark reaches.
fn extent(mark: &Mark) -> (Vec<f64>, Vec<f64>) {
    match mark {
        Mark::Line(_, points) | Mark::Points(points) => {
            points.iter().filter(|(x, y)| placeable(*x) && placeable(*y)).copied().unzip()
        }
        Mark::Band(points) => {
            // Open ends lie on the frame, wherever that is.
            let fits = |x: f64| placeable(x) || x.is_infinite();
            let whole =
                |&&(x, low, high): &&(f64, f64, f64)| placeable(x) && fits(low) && fits(high);
            let whole: Vec<_> = points.iter().filter(whole).collect();
            let xs = whole.iter().map(|point| point.0).collect();
            (xs, whole.iter().flat_map(|point| [point.1, point.2]).collect())
        }
        Mark::Level(_, y) => (Vec::new(), vec![*y]),
        Mark::Upright(_, x) => (vec![*x], Vec::new()),
        Mark::Bar { x, width, y, whisker } => {
            let xs = vec![x - width / 2.0, x + width / 2.0];
            (xs, whisker.iter().flat_map(|(low, high)| [*low, *high]).chain([*y]).collect())
        }
        Mark::Text(x, y, _)
        | Mark::Frame(x, y)
        | Mark::Cell { x, y, .. }
        | Mark::Sign { at: (x, y), .. }
        | Mark::Shape { at: (x, y), .. } => (vec![*x], vec![*y]),
        Mark::Ways(_, lines) => lines.iter().flatten().copied().unzip(),
        Mark::Arrow { from, to, .. } => (vec![from.0, to.0], vec![from.1, to.1]),
    }
}

#[cfg(test)]
mod tests {
    use super::super::drawing::Stroke;
    use super::*;

    fn check(low: f64, high: f64, labels: &[&str], exponent: i32) {
        let found = ticks(Scale { low, high }, 5);
        assert_eq!(
            (found.labels, found.exponent),
            (labels.iter().map(ToString::to_string).collect(), exponent)
        );
    }

    #[test]
    fn ticks_are_round_and_equally_precise() {
        check(0.0, 1.0, &["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"], 0);
        check(-2.1, 2.1, &["−2", "−1", "0", "1", "2"], 0);
        check(0.0, 47.0, &["0", "10", "20", "30", "40"], 0);
        check(0.0, 3e6, &["0", "1", "2", "3"], 6);
        check(0.0, 1e-4, &["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"], -4);
        check(
            1e6,
            1e6 + 1.0,
            &["1000000.0", "1000000.2", "1000000.4", "1000000.6", "1000000.8", "1000001.0"],
            0,
        );
    }

    fn drawing(marks: Vec<Mark>) -> Drawing {
        let series = vec![Series { marks, ..Series::default() }];
        Drawing { series, ..Drawing::default() }
    }

    #[test]
    fn the_range_is_that_of_the_finite_marks() {
        let line = vec![(0.0, 1.0), (100.0, f64::NAN), (10.0, 3.0), (f64::INFINITY, 9.0)];
        let (x, y) = scales(&drawing(vec![Mark::Line(Stroke::Solid, line)]));
        assert_eq!((x.low, x.high), (-0.2, 10.2));
        assert_eq!((y[0].low, y[0].high), (0.9, 3.1));
        let (_, y) = scales(&drawing(vec![Mark::Level(Stroke::Solid, 5.0)]));
        assert_eq!((y[0].low, y[0].high), (4.5, 5.5));
        let (x, _) = scales(&drawing(vec![]));
        assert_eq!((x.low, x.high), (-0.02, 1.02));
    }

    #[test]
    fn bars_stand_on_zero_and_a_given_range_is_kept() {
        let bar = |y| Mark::Bar { x: 0.0, width: 0.5, y, whisker: None };
        let named = |y| Drawing {
            x: Axis { names: vec!["a".into()], ..Axis::default() },
            ..drawing(vec![bar(y)])
        };
        let (x, y) = scales(&named(2.0));
        assert_eq!((x.low, x.high, y[0].low, y[0].high), (-0.5, 0.5, 0.0, 2.1));
        assert_eq!(scales(&named(-2.0)).1, [Scale { low: -2.1, high: 0.1 }]);
        // Along logarithms they stand on the power of ten below: 0.3 · 1.05 and −0.3 − 0.05 · 2.3.
        let mut log = named(2.0);
        log.y.log = true;
        log.series[0].marks.push(bar(-0.3));
        assert_eq!(scales(&log).1, [Scale { low: -1.0, high: 2.115 }]);
        let mut given = named(2.0);
        given.y.range = Some((1.0, 4.0));
        assert_eq!(scales(&given).1, [Scale { low: 1.0, high: 4.0 }]);
    }

    #[test]
    fn panels_have_ranges_of_their_own_where_that_is_asked_for() {
        let bar = |y| Mark::Bar { x: 0.0, width: 0.5, y, whisker: None };
        let of = |panel: &str, y| Series {
            panel: panel.into(),
            marks: vec![bar(y)],
            ..Series::default()
        };
        let series = vec![of("a", 2.0), of("b", -100.0), of("a", 4.0)];
        let mut drawing = Drawing { series, ..Drawing::default() };
        let both = Scale { low: -105.2, high: 9.2 };
        assert_eq!(scales(&drawing).1, [both, both]);
        drawing.y.free = true;
        let (a, b) = (Scale { low: 0.0, high: 4.2 }, Scale { low: -105.0, high: 5.0 });
        assert_eq!(scales(&drawing).1, [a, b]);
    }

    #[test]
    fn there_are_some_ticks_and_all_lie_inside() {
        let lows = [-7.3e12, -1e5, -2.5, -1e-9, 0.0, 3e-7, 0.99, 12_345.6, 8e11];
        let sizes = (-6..13).flat_map(|power| [1.0, 2.3, 4.9, 7.7].map(|m| m * 10_f64.powi(power)));
        for (low, size) in
            lows.into_iter().flat_map(|low| sizes.clone().map(move |size| (low, size)))
        {
            if size < 1e-8 * f64::abs(low) {
                continue;
            }
            let found = ticks(Scale { low, high: low + size }, 5);
            let inside = |x: &f64| low - size * 1e-5 <= *x && *x <= low + size * (1.0 + 1e-5);
            assert!((2..=6).contains(&found.at.len()), "{low} {size}: {found:?}");
            assert!(found.at.iter().all(inside), "{low} {size}: {found:?}");
            assert!(found.labels.windows(2).all(|pair| pair[0] != pair[1]), "{found:?}");
        }
    }
}
