//! Marks on the road that are crossed.

use crate::ground::Footing;
use crate::route::line_at;
use crate::town::Town;
use crate::xodr::{Line, Section};

/// Marks between two places near each other, in the order in which they are crossed, and the lane behind each, if cars drive
/// there.
///
/// - `road`: place of the road that is followed, in `Map::roads`. Where others lie on it, as in junctions, its marks count and
///   no others; beside it those of the road that is there. Between two roads nothing is crossed: there marks end.
#[must_use]
pub fn crossed(
    town: &Town,
    road: usize,
    from: [f64; 3],
    to: [f64; 3],
) -> Vec<(Line, Option<usize>)> {
    let map = &town.network.map;
    let below = |point: [f64; 3]| {
        let followed = town.ground.on_road(map, road, point);
        followed.or_else(|| town.ground.below(map, point))
    };
    let [Some(from), Some(to)] = [from, to].map(below) else {
        return Vec::new();
    };
    let elsewhere = from.road != road && map.roads[from.road].junction.is_some();
    if elsewhere || from.road != to.road || from.lane == to.lane || from.section != to.section {
        return Vec::new();
    }
    let section = &map.roads[from.road].sections[from.section];
    let step = (to.lane - from.lane).signum();
    let mut marks = Vec::new();
    let mut lane = from.lane;
    while lane != to.lane {
        let next = if lane + step == 0 { step } else { lane + step };
        let line = between(section, lane, next, from.s - section.s);
        marks.push((line, behind(town, &to, next)));
        lane = next;
    }
    marks
}

fn behind(town: &Town, footing: &Footing, id: i32) -> Option<usize> {
    let name = town.network.map.roads[footing.road].id;
    let lane = town.network.lane(name, footing.section, id)?;
    town.network.is_driven(lane).then_some(lane)
}

/// The mark between two lanes beside each other: it belongs to that which is nearer to lane 0, or to lane 0.
fn between(section: &Section, one: i32, other: i32, s: f64) -> Line {
    if one.signum() != other.signum() {
        return line_at(&section.centre, s);
    }
    let inner = if one.abs() < other.abs() { one } else { other };
    crate::geometry::strip(section, inner).map_or(Line::None, |strip| line_at(&strip.marks, s))
}
