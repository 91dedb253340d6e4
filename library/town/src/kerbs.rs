//! Where the road ends for cars.

use crate::geometry::{cubic, is_paved, pose, side};
use crate::ground::Ground;
use crate::map::Map;

/// Most metres of a segment.
const STEP: f64 = 2.0;
/// How far beyond an edge is looked for another road, in metres.
const BEYOND: f64 = 0.1;

/// A piece of the edge of what is made for cars: its ends, `x`, `y` and `z`, in metres.
pub type Kerb = [[f64; 3]; 2];

/// The outer edges of driving lanes, parking lanes and shoulders, but where another road goes on.
#[must_use]
pub fn kerbs(map: &Map, ground: &Ground) -> Vec<Kerb> {
    let mut kerbs = Vec::new();
    for road in &map.roads {
        for (i, section) in road.sections.iter().enumerate() {
            let end = road.sections.get(i + 1).map_or(road.length, |next| next.s);
            for left in [true, false] {
                let strips = side(section, left);
                let n_paved =
                    strips.iter().rposition(|strip| is_paved(strip.kind)).map_or(0, |k| k + 1);
                if n_paved == 0 {
                    continue;
                }
                let sign = if left { 1.0 } else { -1.0 };
                let at = |s: f64, beyond: f64| {
                    // Just before the end the offset is still that of the section.
                    let s = s.min(end - 1e-9).max(section.s);
                    let width = |strip: &crate::map::Strip| cubic(&strip.widths, s - section.s).0;
                    let out: f64 = strips[..n_paved].iter().map(width).sum();
                    let t = cubic(&road.lane_offset, s).0 + sign * (out + beyond);
                    let pose = pose(road, s, t, 0.0, false);
                    [pose.x, pose.y, pose.z]
                };
                let n_steps = ((end - section.s) / STEP).ceil().max(1.0);
                let steps = std::iter::successors(Some(0.0), |k| Some(k + 1.0));
                for k in steps.take_while(|k| *k < n_steps) {
                    let [from, to] =
                        [k, k + 1.0].map(|k| section.s + (end - section.s) * k / n_steps);
                    let outside = at(f64::midpoint(from, to), BEYOND);
                    if ground.below(map, outside).is_none_or(|footing| !is_paved(footing.kind)) {
                        kerbs.push([at(from, 0.0), at(to, 0.0)]);
                    }
                }
            }
        }
    }
    kerbs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::ground;
    use crate::maps::town_map;

    #[test]
    fn kerbs_are_between_what_is_made_for_cars_and_what_is_not() {
        let map = town_map("Town01").unwrap();
        let ground = ground(&map);
        let kerbs = kerbs(&map, &ground);
        let paved = |x: f64, y: f64| {
            ground.below(&map, [x, y, 0.0]).is_some_and(|footing| is_paved(footing.kind))
        };
        let mut metres = 0.0;
        for [a, b] in &kerbs {
            let [dx, dy] = [b[0] - a[0], b[1] - a[1]];
            let length = dx.hypot(dy);
            metres += length;
            if length < 0.1 {
                continue;
            }
            let [x, y] = [f64::midpoint(a[0], b[0]), f64::midpoint(a[1], b[1])];
            let sides = [0.3, -0.3].map(|d| paved(x - d * dy / length, y + d * dx / length));
            assert_ne!(sides[0], sides[1], "{a:?} {b:?}");
        }
        // Two lanes of 4 m and shoulders of 0.3 m make a road of 8.6 m, with a kerb on each side; roads have 2 900 m.
        let roads: f64 =
            map.roads.iter().filter(|road| road.junction.is_none()).map(|road| road.length).sum();
        assert!(metres > 1.9 * roads && metres < 2.4 * roads, "{metres} of {roads}");
    }
}
