//! The heights of a town's ground on a raster, for what looks at much of it at once.
//!
//! A cell has a height for each road that leads over it. Small gaps between roads, as there are in junctions, are filled;
//! everything else beside roads has no height. Sidewalks and the like are higher than the road by a kerb (`KERB`).

#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "cells are numbered within the raster, and casts of what is outside saturate"
)]

use crate::geometry::is_paved;
use crate::ground::Ground;
use crate::map::Map;

/// Side of a cell, in metres.
pub(crate) const CELL: f64 = 0.5;
/// How much a sidewalk is higher than the road, in metres. Ours: usual kerbs are 0.1 to 0.15 m.
pub(crate) const KERB: f32 = 0.15;
/// Gaps between roads of less than so many square metres are filled. Ours: islands and blocks are larger.
const GAP: f64 = 100.0;
/// Roads whose heights differ by less are one level, in metres.
const LEVEL: f32 = 2.0;

/// The heights of a town.
#[derive(Clone, Debug)]
pub struct Relief {
    corner: [f64; 2],
    pub(crate) size: [usize; 2],
    /// Row by row along `y`: the height of the lowest road, kerbs included; not a number beside all roads.
    pub(crate) lowest: Vec<f32>,
    /// Places of cells that have more, by place, with their heights.
    more: Vec<(usize, f32)>,
}

/// Heights of a map whose raster has at most so many cells; larger maps have none, and are flat.
const MOST_CELLS: f64 = 1e7;

/// Measures the heights of a town.
#[must_use]
pub fn relief(map: &Map, ground: &Ground) -> Relief {
    let [low, high] = ground.extent();
    let size = [0, 1].map(|i| ((high[i] - low[i]) / CELL).ceil().max(0.0) as usize + 2);
    let n_cells = size[0] as f64 * size[1] as f64;
    if n_cells > MOST_CELLS {
        return Relief { corner: low, size: [0, 0], lowest: Vec::new(), more: Vec::new() };
    }
    let mut relief = Relief {
        corner: [low[0] - CELL, low[1] - CELL],
        size,
        lowest: vec![f32::NAN; size[0] * size[1]],
        more: Vec::new(),
    };
    let mut levels: Vec<(f32, bool)> = Vec::new();
    for place in 0..relief.lowest.len() {
        levels.clear();
        for footing in ground.all(map, relief.middle(place)) {
            let (z, paved) = (footing.z as f32, is_paved(footing.kind));
            match levels.iter_mut().find(|(other, _)| (*other - z).abs() < LEVEL) {
                // Where a road lies on another's sidewalk, cars drive.
                Some(level) if paved && !level.1 => *level = (z, true),
                Some(_) => {}
                None => levels.push((z, paved)),
            }
        }
        levels.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut heights = levels.iter().map(|(z, paved)| if *paved { *z } else { z + KERB });
        if let Some(z) = heights.next() {
            relief.lowest[place] = z;
        }
        relief.more.extend(heights.map(|z| (place, z)));
    }
    fill(&mut relief);
    relief
}

/// Gives small gaps the heights of what is around them.
fn fill(relief: &mut Relief) {
    let mut seen = vec![false; relief.lowest.len()];
    for start in 0..seen.len() {
        if seen[start] || !relief.lowest[start].is_nan() {
            continue;
        }
        seen[start] = true;
        let (mut gap, mut rim, mut n_rim, mut at) = (vec![start], 0.0_f64, 0.0, 0);
        while at < gap.len() {
            for next in relief.beside(gap[at]) {
                if !relief.lowest[next].is_nan() {
                    rim += f64::from(relief.lowest[next]);
                    n_rim += 1.0;
                } else if !seen[next] {
                    seen[next] = true;
                    gap.push(next);
                }
            }
            at += 1;
        }
        if n_rim > 0.0 && (gap.len() as f64) * CELL * CELL < GAP {
            for place in gap {
                relief.lowest[place] = (rim / n_rim) as f32;
            }
        }
    }
}

impl Relief {
    fn middle(&self, place: usize) -> [f64; 2] {
        let [column, row] = [place % self.size[0], place / self.size[0]];
        let middle = |k: usize, corner: f64| corner + (k as f64 + 0.5) * CELL;
        [middle(column, self.corner[0]), middle(row, self.corner[1])]
    }

    fn beside(&self, place: usize) -> impl Iterator<Item = usize> + use<> {
        let [width, height] = self.size;
        let [column, row] = [place % width, place / width];
        [
            (column > 0).then(|| place - 1),
            (column + 1 < width).then_some(place + 1),
            (row > 0).then(|| place - width),
            (row + 1 < height).then_some(place + width),
        ]
        .into_iter()
        .flatten()
    }

    /// The cell of a point, if it is on the raster.
    pub(crate) fn place(&self, [x, y]: [f64; 2]) -> Option<usize> {
        // What lies below 0 saturates, and is told apart by its sign.
        let [u, v] = [(x - self.corner[0]) / CELL, (y - self.corner[1]) / CELL];
        let [column, row] = [u as usize, v as usize];
        let inside = u >= 0.0 && v >= 0.0 && column < self.size[0] && row < self.size[1];
        inside.then(|| row * self.size[0] + column)
    }

    /// The height at a point that is nearest to `z`; `None` beside all roads.
    #[must_use]
    pub fn height(&self, point: [f64; 2], z: f64) -> Option<f64> {
        let place = self.place(point)?;
        let lowest = self.lowest[place];
        if lowest.is_nan() {
            return None;
        }
        let z = z as f32;
        Some(f64::from(if (lowest - z).abs() < LEVEL { lowest } else { self.nearest(place, z) }))
    }

    /// The height at a point for who looks along a road: of the roads there that which is nearest to the road before, which it
    /// becomes; beside all roads a bank over the road before.
    pub(crate) fn seen_from(&self, point: [f64; 2], road: &mut f32, bank: f32) -> f32 {
        let Some(place) = self.place(point) else { return *road + bank };
        let lowest = self.lowest[place];
        if lowest.is_nan() {
            return *road + bank;
        }
        *road = if (lowest - *road).abs() < LEVEL { lowest } else { self.nearest(place, *road) };
        *road
    }

    /// The height of a cell on a road that is nearest to `z`.
    pub(crate) fn nearest(&self, place: usize, z: f32) -> f32 {
        let from = self.more.partition_point(|(other, _)| *other < place);
        let more = self.more[from..].iter().take_while(|(other, _)| *other == place);
        let all = more.map(|(_, height)| *height);
        all.fold(self.lowest[place], |best, height| {
            if (height - z).abs() < (best - z).abs() { height } else { best }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::ground;
    use crate::maps::town_map;

    #[test]
    fn the_raster_has_the_heights_of_roads() {
        let map = town_map("Town03").unwrap();
        let ground = ground(&map);
        let relief = relief(&map, &ground);
        // On a ramp, on the deck, in a junction's gap, and in the middle of the large roundabout.
        let exact = |x: f64, y: f64, z: f64| ground.below(&map, [x, y, z]).map(|footing| footing.z);
        for (x, y, z) in [(78.75, -50.6, 5.2), (90.0, -135.0, 8.0), (235.5, 156.85, 1.4)] {
            let (expected, found) = (exact(x, y, z).unwrap(), relief.height([x, y], z).unwrap());
            assert!((expected - z).abs() < 0.3, "{x} {y}: {expected}");
            // Within half a cell of a slope of 20 %.
            assert!((found - expected).abs() < 0.08, "{x} {y}: {found} {expected}");
        }
        assert_eq!((exact(145.13, -140.65, 8.0), relief.height([0.0, 0.0], 0.0)), (None, None));
        assert!((relief.height([145.13, -140.65], 8.0).unwrap() - 8.0).abs() < 0.1);
        assert_eq!(relief.height([1e9, f64::NAN], 0.0), None);
    }

    #[test]
    fn bridges_are_told_from_what_they_lead_over() {
        let map = town_map("Town04").unwrap();
        let ground = ground(&map);
        let relief = relief(&map, &ground);
        let over: Vec<usize> = relief.more.iter().map(|(place, _)| *place).collect();
        assert!(over.len() > 100, "{} cells are below a bridge", over.len());
        let place = over[over.len() / 2];
        let [x, y] = relief.middle(place);
        let levels: Vec<f64> = ground.all(&map, [x, y]).map(|footing| footing.z).collect();
        for z in levels {
            let below = ground.below(&map, [x, y, z]).unwrap();
            assert!((below.z - z).abs() < 2.0);
            assert!((relief.height([x, y], z).unwrap() - z).abs() < 2.0);
        }
        assert!(relief.nearest(place, 100.0) - relief.nearest(place, -100.0) > 4.0);
    }

    #[test]
    fn grades_are_those_between_heights() {
        let map = town_map("Town03").unwrap();
        let ground = ground(&map);
        let at = |x: f64, y: f64| ground.below(&map, [x, y, 5.2]).unwrap();
        let (here, h) = (at(78.75, -50.6), 1e-3);
        let along = [
            (at(78.75 + h, -50.6).z - at(78.75 - h, -50.6).z) / (2.0 * h),
            (at(78.75, -50.6 + h).z - at(78.75, -50.6 - h).z) / (2.0 * h),
        ];
        assert!((here.slope[0] - along[0]).abs() < 1e-6 && (here.slope[1] - along[1]).abs() < 1e-6);
        assert!(here.slope[1] < -0.15, "it goes down by 17 % where y grows: {:?}", here.slope);
        // Off by the sign of y, it would go up.
        assert!((here.slope[1] + along[1]).abs() > 0.3);
    }
}
