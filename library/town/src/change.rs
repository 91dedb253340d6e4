//! Where a car may go to the lane beside its own.

use crate::geometry::strip;
use crate::lanes::Network;
use crate::map::{Line, Mark};

/// Metres in which a car goes to the lane beside its own, if there are as many.
pub(crate) const CHANGE: f64 = 15.0;
/// Where fewer are left no change is begun.
const SHORT: f64 = 10.0;

/// The mark at `s` of a section.
pub(crate) fn line_at(marks: &[Mark], s: f64) -> Line {
    let behind = marks.partition_point(|mark| mark.s <= s);
    marks.get(behind.saturating_sub(1)).map_or(Line::None, |mark| mark.line)
}

/// The first metres, counted from `start` towards `end`, on which a car may go from a lane to one beside it: 10 m or more along
/// a broken line, or none outside of junctions. `None` where it may not, as between lanes of two directions.
pub(crate) fn passable(
    network: &Network,
    [lane, other]: [usize; 2],
    start: f64,
    end: f64,
) -> Option<[f64; 2]> {
    let [own, beside] = [lane, other].map(|lane| &network.lanes[lane]);
    if own.id.signum() != beside.id.signum() || !network.is_driven(other) {
        return None;
    }
    let section = &network.map.roads[own.road].sections[own.section];
    // The line between two lanes belongs to that which is nearer to the middle of the road.
    let inner = if beside.id.abs() < own.id.abs() { beside.id } else { own.id };
    let marks = strip(section, inner).map(|strip| &strip.marks[..]).unwrap_or_default();
    let in_junction = network.junction(lane).is_some();
    // From mark to mark, as `s` of the road, where a line may be passed.
    let mut spans: Vec<[f64; 2]> = Vec::new();
    let mut edges: Vec<f64> = marks.iter().map(|mark| section.s + mark.s).collect();
    edges.insert(0, own.range[0]);
    edges.push(own.range[1]);
    for pair in edges.windows(2) {
        let line = line_at(marks, f64::midpoint(pair[0], pair[1]) - section.s);
        if !(line == Line::Broken || (line == Line::None && !in_junction)) {
            continue;
        }
        match spans.last_mut() {
            Some(span) if span[1] == pair[0] => span[1] = pair[1],
            _ => spans.push([pair[0], pair[1]]),
        }
    }
    let room = (end - start).abs();
    let sign = (end - start).signum();
    let along = |span: &[f64; 2]| {
        let mut ends = span.map(|s| ((s - start) * sign).clamp(0.0, room));
        ends.sort_by(f64::total_cmp);
        ends
    };
    let mut spans: Vec<[f64; 2]> = spans.iter().map(along).collect();
    spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
    spans.into_iter().find(|span| span[1] - span[0] >= SHORT)
}

/// When each change from a lane to the next is begun, in metres from `start`, and in how many it is done.
pub(crate) fn schedule(network: &Network, lanes: &[usize], start: f64, end: f64) -> Vec<[f64; 2]> {
    let room = (end - start).abs();
    let mut from = 0.0;
    let sign = (end - start).signum();
    let changes = lanes.windows(2).map(|pair| {
        let open = passable(network, [pair[0], pair[1]], start + sign * from, end);
        // Where there are too many one after the other, some are done where there is any room left.
        let [first, last] = open.unwrap_or([0.0, room - from]);
        let change = [from + first, (last - first).clamp(0.0, CHANGE)];
        from = change[0] + change[1];
        change
    });
    changes.collect()
}

/// The lane that is left, that which is gone to, and how much of the way is done, after `along` metres.
pub(crate) fn changed(lanes: &[usize], schedule: &[[f64; 2]], along: f64) -> (usize, usize, f64) {
    for (pair, [from, metres]) in lanes.windows(2).zip(schedule) {
        let done = (along - from) / metres.max(1e-9);
        if done < 0.0 {
            return (pair[0], pair[0], 0.0);
        }
        if done < 1.0 {
            // Lanes are left and entered along them.
            return (pair[0], pair[1], done * done * (3.0 - 2.0 * done));
        }
    }
    let last = lanes[lanes.len() - 1];
    (last, last, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::network;
    use crate::maps::town_map;

    #[test]
    fn lanes_are_changed_one_after_the_other() {
        let schedule = [[2.0, 10.0], [12.0, 10.0]];
        let at = |along: f64| changed(&[7, 8, 9], &schedule, along);
        // Half of the first after 7 m, and 5/32 of the second after 14.5 m.
        assert_eq!((at(1.0), at(7.0), at(14.5)), ((7, 7, 0.0), (7, 8, 0.5), (8, 9, 5.0 / 32.0)));
        assert_eq!(at(22.0), (9, 9, 0.0));
        assert_eq!(changed(&[7], &[], 3.0), (7, 7, 0.0));
    }

    #[test]
    fn lines_are_passed_where_they_are_broken() {
        let network = network(town_map("Town04").unwrap());
        let lane = |id: i32| network.lane(36, 0, id).unwrap();
        // Between -3 and -4 of road 36 the line is broken from 20.8 to 58.1.
        let open = passable(&network, [lane(-4), lane(-3)], 0.0, 89.0).unwrap();
        assert!((open[0] - 20.78).abs() < 0.01 && (open[1] - 58.09).abs() < 0.01, "{open:?}");
        let open = passable(&network, [lane(-3), lane(-4)], 30.0, 89.0).unwrap();
        assert!(open[0] == 0.0 && (open[1] - 28.09).abs() < 0.01, "{open:?}");
        assert_eq!(passable(&network, [lane(-3), lane(-4)], 50.0, 89.0), None);
        assert_eq!(passable(&network, [lane(-1), lane(1)], 0.0, 89.0), None);
        // Against the road's line, where it is driven so: -1 and -2 are broken all along, and so are 3 and 4.
        let open = passable(&network, [lane(4), lane(3)], 80.0, 5.0).unwrap();
        assert_eq!(open, [0.0, 75.0]);
        let done = schedule(&network, &[lane(-4), lane(-3)], 0.0, 89.0);
        assert!((done[0][0] - 20.78).abs() < 0.01 && done[0][1] == 15.0);
    }
}
