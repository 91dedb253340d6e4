//! What is below a point: which road and lane, how high, and how steep.

use crate::geometry::{cubic, is_paved, onto, pose};
use crate::grid::Grid;
use crate::map::{Kind, Map, Piece, Road, Section};

/// Most metres of road that are looked at together.
const STRETCH: f64 = 5.0;
/// Roads whose heights differ by less lie on each other: in metres.
const LEVEL: f64 = 2.0;

/// Where roads are.
#[derive(Clone, Debug)]
pub struct Ground {
    grid: Grid<Stretch>,
}

/// A part of a section, on one piece of its road.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    road: usize,
    section: usize,
    piece: Piece,
    range: [f64; 2],
}

/// What is below a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footing {
    /// Place of the road in `Map::roads`.
    pub road: usize,
    /// Place of its section in `Road::sections`.
    pub section: usize,
    /// The lane, which is not 0.
    pub lane: i32,
    /// What it is for.
    pub kind: Kind,
    /// Place along the road.
    pub s: f64,
    /// Metres to the left of the road's line.
    pub t: f64,
    /// Height in metres.
    pub z: f64,
    /// Where the ground rises, in metres a metre: along `x` and `y` of the town.
    pub slope: [f64; 2],
}

/// Sorts roads by place.
#[must_use]
pub fn ground(map: &Map) -> Ground {
    let mut boxed = Vec::new();
    for (r, road) in map.roads.iter().enumerate() {
        for (i, section) in road.sections.iter().enumerate() {
            let end = road.sections.get(i + 1).map_or(road.length, |next| next.s);
            for piece in &road.plan {
                let [from, to] = [piece.s.max(section.s), (piece.s + piece.length).min(end)];
                let n_parts = ((to - from) / STRETCH).ceil();
                let parts = std::iter::successors(Some(0.0), |k| Some(k + 1.0));
                for k in parts.take_while(|k| *k < n_parts) {
                    let at = |k: f64| from + (to - from) * k / n_parts;
                    let range = [at(k), at(k + 1.0)];
                    let stretch = Stretch { road: r, section: i, piece: *piece, range };
                    boxed.push((around(road, section, range), stretch));
                }
            }
        }
    }
    Ground { grid: Grid::of(&boxed, 4.0) }
}

/// The box around a stretch, with something to spare.
fn around(road: &Road, section: &Section, [from, to]: [f64; 2]) -> [f64; 4] {
    let mut b = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    for s in [from, f64::midpoint(from, to), to] {
        let offset = cubic(&road.lane_offset, s).0;
        let side = |strips: &[crate::map::Strip]| -> f64 {
            strips.iter().map(|strip| cubic(&strip.widths, s - section.s).0).sum()
        };
        for t in [offset + side(&section.left), offset - side(&section.right)] {
            let corner = pose(road, s, t, 0.0, false);
            b = [b[0].min(corner.x), b[1].min(corner.y), b[2].max(corner.x), b[3].max(corner.y)];
        }
    }
    [b[0] - 1.0, b[1] - 1.0, b[2] + 1.0, b[3] + 1.0]
}

impl Ground {
    /// The least and the largest `x` and `y` of all roads, with something to spare.
    pub(crate) fn extent(&self) -> [[f64; 2]; 2] {
        self.grid.extent()
    }

    /// All roads that lie at a point, in no order that means anything.
    pub(crate) fn all<'a>(
        &'a self,
        map: &'a Map,
        point: [f64; 2],
    ) -> impl Iterator<Item = Footing> + 'a {
        self.grid.at(point).iter().filter_map(move |stretch| footing(map, stretch, point))
    }

    /// Where a point lies on a road.
    pub(crate) fn on_road(&self, map: &Map, road: usize, [x, y, z]: [f64; 3]) -> Option<Footing> {
        self.all(map, [x, y]).find(|found| found.road == road && (found.z - z).abs() < LEVEL)
    }

    /// What is below a point: of roads that lie on each other what is made for cars first; of a bridge and what it leads over,
    /// what is nearest to `z`. `None` beside all roads.
    #[must_use]
    pub fn below(&self, map: &Map, [x, y, z]: [f64; 3]) -> Option<Footing> {
        let level = |footing: &Footing| ((footing.z - z).abs() / LEVEL).floor();
        let use_of = |footing: &Footing| match footing.kind {
            Kind::Driving => 0,
            kind if is_paved(kind) => 1,
            _ => 2,
        };
        let better = |a: &Footing, b: &Footing| {
            level(a).total_cmp(&level(b)).then(use_of(a).cmp(&use_of(b)))
        };
        self.all(map, [x, y]).min_by(|a, b| better(a, b))
    }
}

fn footing(map: &Map, stretch: &Stretch, point: [f64; 2]) -> Option<Footing> {
    let [s, t] = onto(&stretch.piece, point)?;
    // What two stretches share belongs to both.
    if s < stretch.range[0] - 1e-6 || s > stretch.range[1] + 1e-6 {
        return None;
    }
    let s = s.clamp(stretch.range[0], stretch.range[1]);
    let road = &map.roads[stretch.road];
    let section = &road.sections[stretch.section];
    let offset = cubic(&road.lane_offset, s).0;
    let (strips, out) =
        if t >= offset { (&section.left, t - offset) } else { (&section.right, offset - t) };
    let mut edge = 0.0;
    let strip = strips.iter().find(|strip| {
        edge += cubic(&strip.widths, s - section.s).0;
        out <= edge
    })?;
    let (z, grade) = cubic(&road.elevation, s);
    let yaw = pose(road, s, 0.0, 0.0, false).yaw;
    let (road, section) = (stretch.road, stretch.section);
    let slope = [grade * yaw.cos(), grade * yaw.sin()];
    Some(Footing { road, section, lane: strip.id, kind: strip.kind, s, t, z, slope })
}
