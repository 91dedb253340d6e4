//! Axes along which equal ratios are equally far apart.

use ivx_op::{Facts, OpError, Wrong, shown};

use super::drawing::{Drawing, Mark};
use super::scale::{Scale, Ticks, ticks};

/// Whether an axis is logarithmic, by the name of its scale.
///
/// # Errors
/// If there is no such scale.
pub(super) fn is_log(scale: &str) -> Result<bool, String> {
    match scale {
        "linear" => Ok(false),
        "log" => Ok(true),
        other => Err(format!("no scale is called `{other}`")),
    }
}

/// The rule that `x_scale` and `y_scale` name a scale.
pub(super) fn known_scales(facts: &Facts<'_>) -> Result<(), Wrong> {
    for arg in ["x_scale", "y_scale"] {
        if let Some(Err(message)) = facts.arg::<String>(arg).map(|scale| is_log(&scale)) {
            let help = "write `\"linear\"` or `\"log\"`".to_owned();
            return Err(Wrong { arg, message, help });
        }
    }
    Ok(())
}

/// The drawing with the scales asked for: along a logarithmic axis marks lie at the logarithms to base 10 of where they
/// lie, and what is not above 0 lies nowhere. The label of the axis says how many points are left out so.
///
/// # Errors
/// If there is no such scale.
pub(super) fn scaled(mut drawing: Drawing, x: &str, y: &str) -> Result<Drawing, OpError> {
    let logs = (is_log(x).map_err(OpError::Failed)?, is_log(y).map_err(OpError::Failed)?);
    (drawing.x.log, drawing.y.log) = logs;
    let along = |log: bool, value: f64| match value {
        value if !log => value,
        // The lower end of an interval that reaches 0 is open.
        value if value <= 0.0 => f64::NEG_INFINITY,
        value => value.log10(),
    };
    let mut left_out = (0, 0);
    let (along_x, along_y) = (|x: f64| along(logs.0, x), |y: f64| along(logs.1, y));
    for mark in drawing.series.iter_mut().flat_map(|series| &mut series.marks) {
        match mark {
            Mark::Line(_, points) | Mark::Points(points) => {
                for (x, y) in points {
                    left_out.0 += usize::from(logs.0 && *x <= 0.0);
                    left_out.1 += usize::from(logs.1 && *y <= 0.0);
                    (*x, *y) = (along_x(*x), along_y(*y));
                }
            }
            Mark::Band(points) => {
                for (x, low, high) in points {
                    (*x, *low, *high) = (along_x(*x), along_y(*low), along_y(*high));
                }
            }
            Mark::Level(_, y) | Mark::Text(_, y, _) => *y = along_y(*y),
            Mark::Upright(_, x) => *x = along_x(*x),
            Mark::Bar { y, whisker, .. } => {
                *y = along_y(*y);
                *whisker = whisker.map(|(low, high)| (along_y(low), along_y(high)));
            }
            // Nothing else is drawn by what has scales.
            _ => {}
        }
    }
    for (axis, n) in [(&mut drawing.x, left_out.0), (&mut drawing.y, left_out.1)] {
        if n > 0 {
            let blank = if axis.label.is_empty() { "" } else { " " };
            axis.label = format!("{}{blank}({n} at or below 0 left out)", axis.label);
        }
    }
    let ends = |log: bool, (low, high): (f64, f64)| (along(log, low), along(log, high));
    drawing.x.range = drawing.x.range.map(|range| ends(logs.0, range));
    drawing.y.range = drawing.y.range.map(|range| ends(logs.1, range));
    Ok(drawing)
}

/// Ticks at powers of ten; where fewer than three would be seen, at 2 and 5 of each too, then at all digits, and at last
/// at round numbers.
pub(super) fn log_ticks(scale: Scale, about: u32) -> Ticks {
    let within = |at: &f64| (scale.low - 1e-9..=scale.high + 1e-9).contains(at);
    #[expect(clippy::cast_possible_truncation, reason = "logarithms of numbers are below 309")]
    let (first, last) = (scale.low.floor() as i32, scale.high.ceil() as i32);
    let at = |digits: &[f64]| -> Vec<(f64, f64)> {
        // Divided by whole powers, so that 0.6 is what it reads.
        let scaled = |digit: f64, power: i32| match power {
            0.. => digit * 10_f64.powi(power),
            _ => digit / 10_f64.powi(-power),
        };
        let of = |power: i32| digits.iter().map(move |digit| scaled(*digit, power));
        let all = (first..=last).flat_map(of).map(|value| (value.log10(), value));
        all.filter(|(at, _)| within(at)).collect()
    };
    let digits: [&[f64]; 3] =
        [&[1.0], &[1.0, 2.0, 5.0], &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]];
    let enough = digits.into_iter().map(at).find(|places| places.len() >= 3);
    let Some(places) = enough else {
        let ends = Scale { low: 10_f64.powf(scale.low), high: 10_f64.powf(scale.high) };
        let mut round = ticks(ends, about);
        round.at.iter_mut().for_each(|value| *value = value.log10());
        return round;
    };
    let step = places.len().div_ceil(about.max(2) as usize).max(1);
    let places: Vec<(f64, f64)> = places.into_iter().step_by(step).collect();
    let labels = places.iter().map(|(_, value)| shown(*value).replace('-', "−")).collect();
    Ticks { at: places.into_iter().map(|(at, _)| at).collect(), labels, exponent: 0 }
}

#[cfg(test)]
mod tests {
    use super::super::drawing::{Series, Stroke};
    use super::*;

    #[test]
    fn marks_lie_at_logarithms_and_what_is_not_above_nothing_nowhere() {
        let line = Mark::Line(Stroke::Solid, vec![(0.01, 100.0), (0.0, 10.0), (1.0, -1.0)]);
        let series = vec![Series { marks: vec![line], ..Series::default() }];
        let drawing = Drawing { series, ..Drawing::default() };
        let labels = scaled(drawing.clone(), "log", "log").unwrap();
        assert_eq!(labels.x.label, "(1 at or below 0 left out)");
        assert_eq!(labels.y.label, "(1 at or below 0 left out)");
        assert_eq!(scaled(drawing.clone(), "linear", "linear").unwrap().x.label, "");
        let marks = |x: &str, y: &str| {
            let found = scaled(drawing.clone(), x, y).unwrap();
            found.series[0].marks[0].clone()
        };
        let none = f64::NEG_INFINITY;
        let both = Mark::Line(Stroke::Solid, vec![(-2.0, 2.0), (none, 1.0), (0.0, none)]);
        assert_eq!(marks("log", "log"), both);
        assert_eq!(marks("linear", "linear"), drawing.series[0].marks[0]);
        let across = Mark::Line(Stroke::Solid, vec![(-2.0, 100.0), (none, 10.0), (0.0, -1.0)]);
        assert_eq!(marks("log", "linear"), across);
        assert!(scaled(drawing.clone(), "logarithmic", "linear").is_err());
    }

    #[test]
    fn ticks_are_powers_of_ten_or_parts_of_them() {
        let labels = |low: f64, high: f64| log_ticks(Scale { low, high }, 5).labels;
        assert_eq!(labels(-3.0, 0.0), ["0.001", "0.01", "0.1", "1"]);
        assert_eq!(labels(-0.1, 1.1), ["1", "2", "5", "10"]);
        assert_eq!(labels(0.0, 10.0).len(), 4);
        assert_eq!(labels(-0.45, -0.1), ["0.4", "0.5", "0.6", "0.7"]);
        assert_eq!(labels(0.31, 0.34), ["2.05", "2.10", "2.15"]);
    }
}
