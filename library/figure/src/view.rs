//! What of a map a panel shows.

use ivx_data::Place;
use ivx_math::simplify::simplified;

use super::drawing::{Mark, Way};
use super::text::width;

/// Below a map, for its scale.
const STRIP: f64 = 18.0;

/// Pixels that a line may be off where it has fewer places.
const OFF: f64 = 0.25;

/// Around what is shown, in metres.
const MARGIN: f64 = 20.0;

/// A part of a map, and the pixels that it takes; a metre is as high as it is wide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    left: f64,
    top: f64,
    /// Pixels of a metre.
    unit: f64,
    /// Pixels of the map.
    wide: f64,
    high: f64,
}

/// The least part that has all places, `[left, top]` and `[right, bottom]` in metres; `None` of none.
pub(super) fn around<'a>(places: impl Iterator<Item = &'a Place>) -> Option<[Place; 2]> {
    let whole = places.filter(|place| place.iter().all(|x| x.is_finite()));
    whole.fold(None, |found: Option<[Place; 2]>, &[x, y]| {
        let [[left, top], [right, bottom]] = found.unwrap_or([[x, y]; 2]);
        Some([[left.min(x), top.min(y)], [right.max(x), bottom.max(y)]])
    })
}

/// The part that both have.
pub(super) fn both([a, b]: [Place; 2], [c, d]: [Place; 2]) -> [Place; 2] {
    [[a[0].min(c[0]), a[1].min(c[1])], [b[0].max(d[0]), b[1].max(d[1])]]
}

/// How wide and high a map of this part is that stands alone, in pixels.
pub(super) fn alone([[left, top], [right, bottom]]: [Place; 2]) -> (f64, f64) {
    let (across, down) = (right - left + 2.0 * MARGIN, bottom - top + 2.0 * MARGIN);
    let shape = (across / down).clamp(0.5, 3.0);
    let (wide, high): (f64, f64) =
        if shape > 4.0 / 3.0 { (560.0, 560.0 / shape) } else { (420.0 * shape, 420.0) };
    (wide.round(), high.round())
}

impl View {
    /// The view of a part with room around it, grown to the form of the pixels that there are.
    pub(super) fn of([[left, top], [right, bottom]]: [Place; 2], (wide, high): (f64, f64)) -> Self {
        let (across, down) = (right - left + 2.0 * MARGIN, bottom - top + 2.0 * MARGIN);
        let unit = (wide / across).min(high / down);
        let middle = [f64::midpoint(left, right), f64::midpoint(top, bottom)];
        let [left, top] = [middle[0] - wide / unit / 2.0, middle[1] - high / unit / 2.0];
        Self { left, top, unit, wide, high }
    }

    /// How wide and high the panel is: the map and its scale.
    pub(super) fn size(&self) -> (f64, f64) {
        (self.wide, self.high + STRIP)
    }

    /// Where a place is in the panel, whose pixels are counted from the lower left.
    pub(super) fn at(&self, [x, y]: Place) -> (f64, f64) {
        let (x, y) = ((x - self.left) * self.unit, (y - self.top) * self.unit);
        (x, self.high + STRIP - y)
    }

    /// What is seen of a line, with no more places than it takes.
    pub(super) fn lines(&self, line: &[Place]) -> Vec<Vec<(f64, f64)>> {
        let mut runs: Vec<Vec<Place>> = Vec::new();
        for pair in line.windows(2) {
            let Some([a, b]) = self.inside([pair[0], pair[1]]) else { continue };
            match runs.last_mut().filter(|run| run.last() == Some(&a)) {
                Some(run) => run.push(b),
                None => runs.push(vec![a, b]),
            }
        }
        let few = |run: Vec<Place>| simplified(&run, OFF / self.unit);
        runs.into_iter().map(|run| few(run).into_iter().map(|at| self.at(at)).collect()).collect()
    }

    /// The part of a straight line that is on the map (Liang and Barsky, 1984).
    fn inside(&self, [a, b]: [Place; 2]) -> Option<[Place; 2]> {
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        let sides = [(self.left, self.wide), (self.top, self.high)];
        for (i, (low, pixels)) in sides.into_iter().enumerate() {
            let (step, high) = (b[i] - a[i], low + pixels / self.unit);
            if step == 0.0 && !(low..=high).contains(&a[i]) {
                return None;
            }
            if step != 0.0 {
                let ends = [(low - a[i]) / step, (high - a[i]) / step];
                from = from.max(ends[0].min(ends[1]));
                to = to.min(ends[0].max(ends[1]));
            }
        }
        let at = |share: f64| match share {
            0.0 => a,
            1.0 => b,
            share => [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])],
        };
        (from < to).then(|| [at(from), at(to)])
    }

    /// The frame of the map, and a length below it.
    pub(super) fn furniture(&self) -> Vec<Mark> {
        let (wide, top) = (self.wide, self.high + STRIP);
        let corners =
            [(0.5, STRIP), (wide - 0.5, STRIP), (wide - 0.5, top - 0.5), (0.5, top - 0.5)];
        let frame = corners.iter().chain(&corners[..1]).copied().collect();
        let metres = round_length(0.3 * wide / self.unit);
        let long = metres * self.unit;
        let said =
            if metres < 1000.0 { format!("{metres} m") } else { format!("{} km", metres / 1000.0) };
        let bar = vec![(1.0, 9.0), (1.0, 5.0), (1.0 + long, 5.0), (1.0 + long, 9.0)];
        let middle = long + 7.0 + width(&said, 11.0) / 2.0;
        vec![
            Mark::Ways(Way::Frame, vec![frame]),
            Mark::Ways(Way::Scale, vec![bar]),
            Mark::Text(middle, -0.5, said),
        ]
    }
}

/// The largest of 1, 2 and 5 times a power of ten that is no longer.
fn round_length(most: f64) -> f64 {
    let power = 10_f64.powi(exponent(most));
    let digits = [5.0, 2.0].into_iter().find(|digit| digit * power <= most);
    digits.unwrap_or(1.0) * power
}

#[expect(clippy::cast_possible_truncation, reason = "maps are no larger than the earth")]
fn exponent(x: f64) -> i32 {
    x.log10().floor() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From (10, 20), two pixels a metre, 40 m wide and 50 m high.
    const VIEW: View = View { left: 10.0, top: 20.0, unit: 2.0, wide: 80.0, high: 100.0 };

    #[test]
    fn a_metre_is_as_high_as_it_is_wide() {
        assert_eq!(VIEW.at([10.0, 20.0]), (0.0, 118.0));
        assert_eq!(VIEW.at([15.0, 30.0]), (10.0, 98.0));
        // 60 m by 40 m with the margin: the height grows to 60 m about the same middle.
        let view = View::of([[0.0, 0.0], [20.0, 0.0]], (120.0, 120.0));
        assert_eq!((view.left, view.top, view.unit), (-20.0, -30.0, 2.0));
        assert_eq!(alone([[0.0, 0.0], [20.0, 0.0]]), (560.0, 373.0));
        assert_eq!(alone([[0.0, 0.0], [0.0, 400.0]]), (210.0, 420.0));
    }

    #[test]
    fn lines_end_at_the_edge() {
        let across = VIEW.lines(&[[0.0, 30.0], [20.0, 30.0], [30.0, 30.0], [60.0, 30.0]]);
        assert_eq!(across, [[(0.0, 98.0), (80.0, 98.0)]]);
        // It leaves at the bottom and comes back.
        let back = VIEW.lines(&[[20.0, 60.0], [20.0, 80.0], [40.0, 80.0], [40.0, 60.0]]);
        assert_eq!(back, [[(20.0, 38.0), (20.0, 18.0)], [(60.0, 18.0), (60.0, 38.0)]]);
        assert!(VIEW.lines(&[[0.0, 0.0], [9.0, 99.0]]).is_empty());
        assert!(VIEW.lines(&[[20.0, 30.0]]).is_empty());
    }

    #[test]
    fn a_scale_is_a_round_length() {
        let found = [0.7, 1.0, 4.9, 5.0, 37.0, 220.0, 999.0].map(round_length);
        assert_eq!(found, [0.5, 1.0, 2.0, 5.0, 20.0, 200.0, 500.0]);
        let Mark::Text(_, _, said) = &VIEW.furniture()[2] else { panic!("it says a length") };
        assert_eq!(said, "10 m");
    }
}
