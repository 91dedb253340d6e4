//! Whether a road can be one: files may have numbers of which towns cannot be made.

use crate::geometry::cubic;
use crate::map::{Cubic, Road, Strip};

/// Metres between places that are looked at.
const STEP: f64 = 1.0;
/// Most metres from a road's line to its edge.
const WIDEST: f64 = 200.0;
/// Most metres that a road is above or below 0.
const HIGHEST: f64 = 10_000.0;
/// Largest coefficient of what changes along a road.
const STEEPEST: f64 = 10.0;

/// The square metres of a road, or where it is none, and why.
pub(crate) fn area(road: &Road) -> Result<f64, (f64, String)> {
    for cubic in road.lane_offset.iter().chain(&road.elevation) {
        steep(cubic, 0.0)?;
    }
    let mut area = 0.0;
    for (i, section) in road.sections.iter().enumerate() {
        let end = road.sections.get(i + 1).map_or(road.length, |next| next.s);
        for strip in section.left.iter().chain(&section.right) {
            for cubic in &strip.widths {
                steep(cubic, section.s)?;
            }
        }
        let n_steps = ((end - section.s) / STEP).ceil();
        let steps = std::iter::successors(Some(0.0), |k| (*k < n_steps).then_some(k + 1.0));
        for s in steps.map(|k| section.s + (end - section.s) * k / n_steps) {
            let height = cubic(&road.elevation, s).0;
            if height.abs() > HIGHEST {
                return Err((s, format!("is at a height of {height} m")));
            }
            let offset = cubic(&road.lane_offset, s).0;
            let of = |strips: &[Strip]| -> Result<f64, (f64, String)> {
                let mut all = 0.0;
                for strip in strips {
                    let width = cubic(&strip.widths, s - section.s).0;
                    if !(-STEP..=WIDEST).contains(&width) {
                        return Err((s, format!("has a lane {} of {width} m", strip.id)));
                    }
                    all += width;
                }
                Ok(all)
            };
            let [left, right] = [of(&section.left)?, of(&section.right)?];
            if offset.abs() + left.max(right) > WIDEST {
                return Err((s, format!("is wider than {WIDEST} m")));
            }
            area += (left + right) * (end - section.s) / (n_steps + 1.0);
        }
    }
    Ok(area)
}

fn steep(cubic: &Cubic, from: f64) -> Result<(), (f64, String)> {
    let largest = [cubic.b, cubic.c, cubic.d].into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    let what = || format!("changes too fast: a coefficient is {largest}");
    if largest > STEEPEST { Err((from + cubic.s, what())) } else { Ok(()) }
}
