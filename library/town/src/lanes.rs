//! The lanes of a map as a graph: which lane leads to which, and which lies beside it.

use std::collections::{BTreeMap, BTreeSet};

use crate::geometry::{Across, Pose, across, pose};
use crate::map::{Connection, End, Kind, Link, Map, Road};

/// Most lanes that are entered to find what is ahead.
const MOST_ENTERED: usize = 10_000;

/// A lane that has been entered is left again where its end is so near, in metres: sections meet at sums of rounded numbers.
const CLOSE: f64 = 1e-9;

/// A lane of a section of a road.
#[derive(Clone, Debug, PartialEq)]
pub struct Lane {
    /// Place of the road in `Map::roads`.
    pub road: usize,
    /// Place of the section in `Road::sections`.
    pub section: usize,
    /// Above 0 left of the road's line, where cars drive towards `s = 0`; below 0 right of it.
    pub id: i32,
    /// What it is for.
    pub kind: Kind,
    /// Where the section starts and ends, `s` of the road.
    pub range: [f64; 2],
    /// Lanes that it leads to, in its direction.
    pub next: Vec<usize>,
    /// Lanes that lead to it.
    pub before: Vec<usize>,
    /// The lane to the left of it for who drives along it; that may go the other way.
    pub left: Option<usize>,
    /// The lane to the right of it.
    pub right: Option<usize>,
}

/// A place on a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct At {
    /// Place of the lane in `Network::lanes`.
    pub lane: usize,
    /// Place on the road, within the lane's range.
    pub s: f64,
}

/// The lanes of a map.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    /// What they are the lanes of.
    pub map: Map,
    /// By road, section and number, each from the left of the road's line to the right.
    pub lanes: Vec<Lane>,
}

/// Joins the lanes of a map. Links to lanes that are not there, or that go the other way, lead nowhere.
#[must_use]
pub fn network(map: Map) -> Network {
    let mut lanes = Vec::new();
    let mut named = BTreeMap::new();
    for (r, road) in map.roads.iter().enumerate() {
        for (i, section) in road.sections.iter().enumerate() {
            let end = road.sections.get(i + 1).map_or(road.length, |next| next.s);
            for strip in section.left.iter().rev().chain(&section.right) {
                named.insert((r, i, strip.id), lanes.len());
                lanes.push(Lane {
                    road: r,
                    section: i,
                    id: strip.id,
                    kind: strip.kind,
                    range: [section.s, end],
                    next: Vec::new(),
                    before: Vec::new(),
                    left: None,
                    right: None,
                });
            }
        }
    }
    let roads: BTreeMap<i32, usize> =
        map.roads.iter().enumerate().map(|(r, road)| (road.id, r)).collect();
    for i in 0..lanes.len() {
        let Lane { road, section, id, .. } = lanes[i];
        let towards_middle = if id.abs() == 1 { -id } else { id - id.signum() };
        let beside = |id: i32| named.get(&(road, section, id)).copied();
        (lanes[i].left, lanes[i].right) = (beside(towards_middle), beside(id + id.signum()));
        let mut next = onward(&map, &roads, road, section, id);
        next.retain(|(_, _, other, entered)| (*other < 0) == (*entered == End::Start));
        let next =
            next.iter().filter_map(|(road, section, id, _)| named.get(&(*road, *section, *id)));
        // A file may say the same twice.
        let next: BTreeSet<usize> = next.copied().collect();
        for other in &next {
            lanes[*other].before.push(i);
        }
        lanes[i].next = next.into_iter().collect();
    }
    Network { map, lanes }
}

/// Where a lane leads: road, section, lane, and the end of the section at which it is entered.
fn onward(
    map: &Map,
    roads: &BTreeMap<i32, usize>,
    r: usize,
    section: usize,
    id: i32,
) -> Vec<(usize, usize, i32, End)> {
    let road = &map.roads[r];
    let strip =
        crate::geometry::strip(&road.sections[section], id).expect("it is one of the section");
    let forward = id < 0;
    let linked = if forward { strip.successor } else { strip.predecessor };
    let within = if forward { section + 1 } else { section.wrapping_sub(1) };
    if within < road.sections.len() {
        let entered = if forward { End::Start } else { End::End };
        return linked.map(|other| (r, within, other, entered)).into_iter().collect();
    }
    let own_end = if forward { End::End } else { End::Start };
    let entering = |other: usize, contact: End| match contact {
        End::Start => 0,
        End::End => map.roads[other].sections.len() - 1,
    };
    match if forward { road.successor } else { road.predecessor } {
        None => Vec::new(),
        Some(Link::Road(other, contact)) => {
            let Some(&other) = roads.get(&other) else { return Vec::new() };
            linked.map(|id| (other, entering(other, contact), id, contact)).into_iter().collect()
        }
        Some(Link::Junction(junction)) => {
            let junction = map.junctions.iter().find(|other| other.id == junction);
            let connections = junction.into_iter().flat_map(|junction| &junction.connections);
            let from_here = connections.filter(|way| {
                way.incoming == road.id && comes_from(map, roads, way, road, own_end)
            });
            let lanes = from_here.flat_map(|way| {
                let other = roads.get(&way.connecting).copied();
                let links = way.lanes.iter().filter(|(from, _)| *from == id);
                links.filter_map(move |(_, to)| {
                    other.map(|other| (other, entering(other, way.contact), *to, way.contact))
                })
            });
            lanes.collect()
        }
    }
}

/// Whether a way into a junction starts at this end of a road: both ends may meet the same junction.
fn comes_from(
    map: &Map,
    roads: &BTreeMap<i32, usize>,
    way: &Connection,
    road: &Road,
    end: End,
) -> bool {
    let connecting = roads.get(&way.connecting).map(|r| &map.roads[*r]);
    let before = connecting.and_then(|road| match way.contact {
        End::Start => road.predecessor,
        End::End => road.successor,
    });
    match before {
        Some(Link::Road(id, contact)) => id != road.id || contact == end,
        _ => true,
    }
}

impl Network {
    /// The lane of this road (as the file calls it), section and number.
    #[must_use]
    pub fn lane(&self, road: i32, section: usize, id: i32) -> Option<usize> {
        self.lanes.iter().position(|lane| {
            self.map.roads[lane.road].id == road && lane.section == section && lane.id == id
        })
    }

    /// The lane of this road (as the file calls it) and number at `s`.
    #[must_use]
    pub fn lane_at(&self, road: i32, id: i32, s: f64) -> Option<At> {
        let fits = |lane: &&Lane| lane.id == id && self.map.roads[lane.road].id == road;
        let mut lanes = self.lanes.iter().enumerate().filter(|(_, lane)| fits(lane));
        let (lane, _) = lanes.find(|(_, lane)| lane.range[0] <= s && s <= lane.range[1])?;
        Some(At { lane, s })
    }

    /// Whether cars are meant to drive along it.
    #[must_use]
    pub fn is_driven(&self, lane: usize) -> bool {
        self.lanes[lane].kind == Kind::Driving
    }

    /// The junction that it is in, as the file calls it.
    #[must_use]
    pub fn junction(&self, lane: usize) -> Option<i32> {
        self.map.roads[self.lanes[lane].road].junction
    }

    /// Where a lane lies beside its road's line: within its section, where another offset may follow at the end.
    pub(crate) fn across(&self, at: At) -> Across {
        let lane = &self.lanes[at.lane];
        let road = &self.map.roads[lane.road];
        across(road, &road.sections[lane.section], lane.id, self.inside(at))
    }

    fn inside(&self, at: At) -> f64 {
        let [start, end] = self.lanes[at.lane].range;
        at.s.min(end - CLOSE).max(start)
    }

    /// Metres from edge to edge.
    #[must_use]
    pub fn width(&self, at: At) -> f64 {
        self.across(at).width
    }

    /// The pose of a car that drives along the middle of the lane.
    #[must_use]
    pub fn pose(&self, at: At) -> Pose {
        let lane = &self.lanes[at.lane];
        let across = self.across(at);
        pose(&self.map.roads[lane.road], self.inside(at), across.middle, across.slope, lane.id > 0)
    }

    /// Where a car enters a lane.
    #[must_use]
    pub fn start(&self, lane: usize) -> At {
        let Lane { range, id, .. } = self.lanes[lane];
        At { lane, s: if id < 0 { range[0] } else { range[1] } }
    }

    /// Where a car leaves a lane.
    #[must_use]
    pub fn end(&self, lane: usize) -> At {
        let Lane { range, id, .. } = self.lanes[lane];
        At { lane, s: if id < 0 { range[1] } else { range[0] } }
    }

    /// All places that are `distance` metres ahead, measured along the lines of roads; none where lanes end before.
    ///
    /// - `distance`: at least 0. After 10 000 lanes no more are entered: a file may have circles of next to no length.
    #[must_use]
    pub fn ahead(&self, at: At, distance: f64) -> Vec<At> {
        let mut found = Vec::new();
        let mut seen = BTreeSet::new();
        let mut open = vec![(at, distance)];
        while let Some((at, rest)) = open.pop() {
            let end = self.end(at.lane).s;
            let room = (end - at.s).abs();
            if rest <= room {
                found.push(At { lane: at.lane, s: at.s + rest.copysign(end - at.s) });
                continue;
            }
            let rest = rest - room + CLOSE;
            for next in self.lanes[at.lane].next.iter().rev() {
                if seen.len() < MOST_ENTERED && seen.insert((*next, rest.to_bits())) {
                    open.push((self.start(*next), rest));
                }
            }
        }
        found
    }

    /// Pairs of a place where a lane is entered, and of one where the next is; the end of lanes that lead nowhere.
    #[must_use]
    pub fn topology(&self) -> Vec<[At; 2]> {
        let driven = (0..self.lanes.len()).filter(|lane| self.is_driven(*lane));
        let pairs = driven.flat_map(|lane| {
            let next = self.lanes[lane].next.iter().map(|next| self.start(*next));
            let mut exits: Vec<At> = next.collect();
            if exits.is_empty() {
                exits.push(self.end(lane));
            }
            exits.into_iter().map(move |exit| [self.start(lane), exit])
        });
        pairs.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Roads of 10 m one behind the other, each with lanes 1 and -1; the last leads to the first.
    fn circle(n: i32, length: f64) -> Network {
        let road = |i: i32| {
            let [before, behind] = [(i + n - 1) % n, (i + 1) % n];
            let lane = |id: i32| {
                format!(
                    r#"<lane id="{id}" type="driving"><link><predecessor id="{id}"/><successor id="{id}"/></link>
                    <width sOffset="0" a="3" b="0" c="0" d="0"/></lane>"#
                )
            };
            format!(
                r#"<road id="{i}" length="{length}" junction="-1"><link>
                <predecessor elementType="road" elementId="{before}" contactPoint="end"/>
                <successor elementType="road" elementId="{behind}" contactPoint="start"/></link>
                <planView><geometry s="0" x="0" y="0" hdg="0" length="{length}"><line/></geometry></planView>
                <lanes><laneSection s="0"><left>{}</left><right>{}</right></laneSection></lanes></road>"#,
                lane(1),
                lane(-1)
            )
        };
        let roads: String = (0..n).map(road).collect();
        network(crate::xodr::read_map(&format!("<OpenDRIVE>{roads}</OpenDRIVE>")).unwrap())
    }

    #[test]
    fn lanes_lead_along_their_direction() {
        let network = circle(3, 10.0);
        let lane = |road, id| network.lane(road, 0, id).unwrap();
        assert_eq!(network.lanes[lane(0, -1)].next, [lane(1, -1)]);
        assert_eq!(network.lanes[lane(0, 1)].next, [lane(2, 1)]);
        assert_eq!(network.lanes[lane(0, 1)].before, [lane(1, 1)]);
        assert_eq!(network.lanes[lane(0, 1)].left, Some(lane(0, -1)));
        assert_eq!(network.lanes[lane(0, 1)].right, None);
        // 12 m ahead of s = 4 is s = 6 of the next; against the road it is s = 2 of the one before.
        let ahead = |at: At, d: f64| network.ahead(at, d);
        let found = ahead(At { lane: lane(0, -1), s: 4.0 }, 12.0);
        assert!(
            found.len() == 1 && found[0].lane == lane(1, -1) && (found[0].s - 6.0).abs() < 1e-8
        );
        let found = ahead(At { lane: lane(0, 1), s: 4.0 }, 12.0);
        assert!(found.len() == 1 && found[0].lane == lane(2, 1) && (found[0].s - 2.0).abs() < 1e-8);
        assert_eq!(network.lane_at(1, -1, 10.0), Some(At { lane: lane(1, -1), s: 10.0 }));
        assert_eq!(network.lane_at(1, -2, 10.0), None);
    }

    #[test]
    fn circles_come_to_an_end() {
        // Two million lanes would have to be entered.
        let network = circle(2, 1e-6);
        assert_eq!(network.ahead(At { lane: 0, s: 0.0 }, 2.0), []);
        // One that leads to itself.
        let network = circle(1, 10.0);
        assert_eq!(network.ahead(At { lane: 0, s: 0.0 }, 1e9), []);
        assert_eq!(network.ahead(At { lane: 1, s: 0.0 }, 25.0).len(), 1);
        assert_eq!(network.topology().len(), 2);
    }
}
