//! What a drawing shows, before anything is said about pixels.

use ivx_data::Picture;
use serde::{Deserialize, Serialize};

use super::interval::Lacks;

/// A drawing: panels that share their axes, one for each name among the series.
#[derive(Clone, Debug, PartialEq, Default)]
pub(super) struct Drawing {
    /// Above the panels; may be empty.
    pub(super) title: String,
    /// The horizontal axis.
    pub(super) x: Axis,
    /// The vertical axis.
    pub(super) y: Axis,
    /// What is drawn; later series lie over earlier ones.
    pub(super) series: Vec<Series>,
    /// How many panels stand side by side; where 0, as many as look well.
    pub(super) columns: usize,
    /// How many of the values that it shows are missing.
    pub(super) lacks: Lacks,
    /// What the colours of cells mean.
    pub(super) colours: Option<Colours>,
    /// How wide and high a panel is, in pixels; where not given, as looks well.
    pub(super) size: Option<(f64, f64)>,
    /// A picture in a panel before those of the series, or alone where its name is empty.
    pub(super) picture: Option<(String, Picture)>,
}

/// What the colours of cells mean.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Colours {
    /// What they measure.
    pub(super) label: String,
    /// What the first and the last colour stand for.
    pub(super) ends: (String, String),
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
    /// Whether its places speak for themselves, and need no ticks.
    pub(super) bare: bool,
    /// Whether its places are logarithms to base 10 of what its ticks say.
    pub(super) log: bool,
    /// Whether each panel has a range of its own.
    pub(super) free: bool,
}

/// Marks of one look. Series of one label share colour, shape and legend entry.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Its legend entry; none where empty.
    pub label: String,
    /// The panel that it is in; all of them where empty.
    pub panel: String,
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
    /// An upright line at `x` across the panel.
    Upright(Stroke, f64),
    /// A bar from 0, or from the floor of a logarithmic axis, to `y`, centred at `x`.
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
    /// A unit square about `(x, y)`, coloured.
    Cell {
        /// The centre.
        x: f64,
        /// The centre.
        y: f64,
        /// Where between the first and the last colour its own is; crossed out where not finite.
        share: f64,
        /// What it is the place of.
        name: String,
        /// What is there.
        value: String,
    },
    /// A frame around the unit square about `(x, y)`.
    Frame(f64, f64),
    /// Text centred on `(x, y)`, just above it.
    Text(f64, f64, String),
    /// A circle or rectangle.
    Shape {
        /// The centre.
        at: (f64, f64),
        /// How wide and how high it is; a circle is as wide.
        size: (f64, f64),
        /// What it is.
        form: Form,
        /// How it is filled.
        tint: Tint,
        /// What stands in it.
        text: String,
    },
    /// Lines of a map; of one place, a dot.
    Ways(Way, Vec<Vec<(f64, f64)>>),
    /// A sign on a map.
    Sign {
        /// What it is.
        sign: Sign,
        /// Where it is.
        at: (f64, f64),
        /// From where one came there.
        from: (f64, f64),
    },
    /// An arrow between two shapes.
    Arrow {
        /// Where it starts.
        from: (f64, f64),
        /// Where its head is.
        to: (f64, f64),
        /// How far to the left of the straight way its middle is.
        bend: f64,
        /// What stands beside its middle.
        text: String,
    },
}

/// What lines of a map are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Way {
    /// Edges of roads.
    Road,
    /// The edge of the map.
    Frame,
    /// A length.
    Scale,
    /// Where one shall go.
    Route,
    /// Where somebody went.
    Driven,
    /// Places where somebody was.
    Dots,
    /// A part of where somebody went.
    Shaded,
}

/// A sign on a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sign {
    /// A circle, where one begins.
    Start,
    /// A square, where one shall arrive.
    Goal,
    /// The head of an arrow, where one was last.
    End,
    /// A cross, where something went wrong.
    Fault,
}

/// The form of a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Form {
    /// As for states and marbles.
    Circle,
    /// As for cells and boxes.
    Rectangle,
}

/// How a shape is filled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tint {
    /// Not at all.
    White,
    /// As what ends an episode.
    Grey,
    /// As an action.
    Black,
    /// As what pays.
    Green,
    /// As what costs.
    Red,
}

impl Tint {
    /// That of a reward.
    pub(super) fn of(reward: f64) -> Self {
        match reward {
            r if r > 0.0 => Self::Green,
            r if r < 0.0 => Self::Red,
            _ => Self::White,
        }
    }
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
            Self::Line(stroke, _) | Self::Level(stroke, _) | Self::Upright(stroke, _) => {
                Some(*stroke)
            }
            _ => None,
        }
    }
}

impl Drawing {
    /// The names of the panels, in order; a single empty one where nothing names any.
    pub(super) fn panels(&self) -> Vec<&str> {
        let picture = self.picture.iter().map(|(name, _)| name.as_str());
        let mut panels: Vec<&str> = picture.filter(|name| !name.is_empty()).collect();
        for Series { panel, .. } in &self.series {
            if !panel.is_empty() && !panels.contains(&panel.as_str()) {
                panels.push(panel);
            }
        }
        if panels.is_empty() { vec![""] } else { panels }
    }
}
