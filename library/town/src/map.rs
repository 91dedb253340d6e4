//! A map as a tree of numbers, as `OpenDRIVE` has them: lengths are in metres, angles in radians, and `y` is to the left of `x`.

/// A map: roads and junctions, each in the order of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// At least one road.
    pub roads: Vec<Road>,
    /// Where roads meet.
    pub junctions: Vec<Junction>,
}

/// A road along a line on which `s` is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Road {
    /// How the file calls it; no other road is called so.
    pub id: i32,
    /// Metres along its line.
    pub length: f64,
    /// The junction that it is part of.
    pub junction: Option<i32>,
    /// Pieces of its line, at least one, by `s`, the first at 0.
    pub plan: Vec<Piece>,
    /// Height of its line over `s`, in metres; 0 where there is none.
    pub elevation: Vec<Cubic>,
    /// By how much lane 0 lies to the left of its line, over `s`.
    pub lane_offset: Vec<Cubic>,
    /// Sections with lanes of their own, at least one, by `s`, the first at 0.
    pub sections: Vec<Section>,
    /// What is before `s = 0`.
    pub predecessor: Option<Link>,
    /// What is behind the end.
    pub successor: Option<Link>,
}

/// A piece of a road's line: an arc, or a straight line where the curvature is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Where it starts on the road.
    pub s: f64,
    /// Where it starts.
    pub x: f64,
    /// Where it starts.
    pub y: f64,
    /// Its direction there, from `x` to `y`.
    pub heading: f64,
    /// In metres.
    pub length: f64,
    /// Radians a metre, to the left.
    pub curvature: f64,
}

/// `a + b d + c d² + d d³`, where `d` is the distance from `s`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "the coefficients are called as in the equation")]
pub struct Cubic {
    /// From where on it holds: on the road, or in the section for what lanes have.
    pub s: f64,
    pub a: f64,
    pub b: f64,
    pub c: f64,
    pub d: f64,
}

/// A stretch of a road on which its lanes stay the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Where it starts on the road.
    pub s: f64,
    /// Lanes 1, 2, … to the left of the line, outwards.
    pub left: Vec<Strip>,
    /// Lanes -1, -2, … to the right of the line, outwards.
    pub right: Vec<Strip>,
    /// Marks along lane 0.
    pub centre: Vec<Mark>,
}

/// A lane of a section.
#[derive(Clone, Debug, PartialEq)]
pub struct Strip {
    /// Above 0 to the left, below 0 to the right.
    pub id: i32,
    /// What it is for.
    pub kind: Kind,
    /// Its width over `s` of the section, at least one.
    pub widths: Vec<Cubic>,
    /// Marks along its outer edge, by `s` of the section.
    pub marks: Vec<Mark>,
    /// The lane before it, towards `s = 0` of the road.
    pub predecessor: Option<i32>,
    /// The lane behind it.
    pub successor: Option<i32>,
}

/// What a lane is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "they are called as in the file")]
pub enum Kind {
    Driving,
    Bidirectional,
    Parking,
    Shoulder,
    Sidewalk,
    Border,
    Median,
    None,
    /// Any other.
    Other,
}

/// What is painted or built along the edge of a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// From where on in the section.
    pub s: f64,
    /// What it is.
    pub line: Line,
}

/// A kind of mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "they are called as in the file")]
pub enum Line {
    None,
    Solid,
    Broken,
    SolidSolid,
    SolidBroken,
    BrokenSolid,
    Curb,
    /// Any other.
    Other,
}

/// An end of a road.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// `s = 0`.
    Start,
    /// `s` is the length.
    End,
}

/// What a road leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Link {
    /// The end of another road.
    Road(i32, End),
    /// A junction.
    Junction(i32),
}

/// Where roads meet: which roads lead through, and from where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Junction {
    /// How the file calls it; no other junction is called so.
    pub id: i32,
    /// Ways in.
    pub connections: Vec<Connection>,
}

/// A way into a junction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Connection {
    /// The road that it comes from.
    pub incoming: i32,
    /// The road of the junction by which it goes on.
    pub connecting: i32,
    /// The end of the connecting road where it enters.
    pub contact: End,
    /// Lanes of the incoming road, and the lanes that they lead to.
    pub lanes: Vec<(i32, i32)>,
}
