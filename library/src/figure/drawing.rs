//! What a drawing shows, before anything is said about pixels.

use serde::{Deserialize, Serialize};

/// A drawing: one panel with axes and series.
#[derive(Clone, Debug, PartialEq, Default)]
pub(super) struct Drawing {
    /// Above the panel; may be empty.
    pub(super) title: String,
    /// The horizontal axis.
    pub(super) x: Axis,
    /// The vertical axis.
    pub(super) y: Axis,
    /// What is drawn; later series lie over earlier ones.
    pub(super) series: Vec<Series>,
}

/// One axis of a drawing.
#[derive(Clone, Debug, PartialEq, Default)]
pub(super) struct Axis {
    /// What it measures.
    pub(super) label: String,
    /// The range shown; where not given, that of the marks and some room.
    pub(super) range: Option<(f64, f64)>,
    /// Names of the places 0, 1, 2, …; where there are none, ticks are numbers.
    pub(super) names: Vec<String>,
}

/// Marks of one look. Series of one label share colour, shape and legend entry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Its legend entry; none where empty.
    pub label: String,
    /// Its marks.
    pub marks: Vec<Mark>,
}

/// One mark, in the units of the axes. What is not finite is left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Mark {
    /// A line through `(x, y)`, broken where a point is not finite.
    Line(Stroke, Vec<(f64, f64)>),
    /// The area between `(x, low, high)`, broken likewise.
    Band(Vec<(f64, f64, f64)>),
    /// Points `(x, y)`.
    Points(Vec<(f64, f64)>),
    /// A line at `y` across the panel.
    Level(Stroke, f64),
    /// A bar from 0 to `y`, centred at `x`.
    Bar {
        /// The centre.
        x: f64,
        /// The width.
        width: f64,
        /// The end.
        y: f64,
        /// The ends of the whisker.
        whisker: Option<(f64, f64)>,
    },
    /// Text centred on `(x, y)`, just above it.
    Text(f64, f64, String),
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Stroke {
    /// Unbroken, with a few markers where several labels are told apart.
    Solid,
    /// Broken.
    Dashed,
    /// Fine and pale, for one of many.
    Thin,
}

impl Mark {
    /// How its line is drawn, if it is one.
    pub(super) fn stroke(&self) -> Option<Stroke> {
        match self {
            Self::Line(stroke, _) | Self::Level(stroke, _) => Some(*stroke),
            _ => None,
        }
    }
}
