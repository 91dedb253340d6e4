//! Marks on the road that are crossed.

use crate::change::line_at;
use crate::ground::Footing;
use crate::map::{Line, Section};
use crate::town::Town;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maps::town_map;
    use crate::town::town;

    #[test]
    fn marks_are_crossed_in_their_order() {
        let town = town(town_map("Town04").unwrap());
        let network = &town.network;
        let middle = |id: i32| {
            let at = network.lane_at(36, id, 40.0).unwrap();
            let pose = network.pose(at);
            (at.lane, [pose.x, pose.y, pose.z])
        };
        let road = network.lanes[middle(-4).0].road;
        let crossed = |from: i32, to: i32| crossed(&town, road, middle(from).1, middle(to).1);
        // At s = 40 of road 36 all lines between its lanes on the right are broken.
        let (three, two) = (middle(-3).0, middle(-2).0);
        assert_eq!(crossed(-4, -2), [(Line::Broken, Some(three)), (Line::Broken, Some(two))]);
        // Then come lane 0 and two shoulders, all behind solid lines but one.
        let lines: Vec<Line> = crossed(-1, 3).iter().map(|(line, _)| *line).collect();
        assert_eq!(lines, [Line::Solid, Line::None, Line::Solid]);
        assert_eq!(crossed(-1, 2)[1], (Line::None, None));
        assert_eq!(crossed(-3, -3), []);
        let nowhere = super::crossed(&town, road, middle(-3).1, [1e6, 0.0, 0.0]);
        assert_eq!(nowhere, []);
    }
}
