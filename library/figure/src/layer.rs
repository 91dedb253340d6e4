//! One layer of a plot.

use ivx_op::{Artifact, Tensors};
use serde::{Deserialize, Serialize};

use super::drawing::Series;
use super::interval::Lacks;

/// Series that belong together, and what they say about the axes.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Layer {
    /// What the horizontal axis measures; empty where unknown.
    pub x_label: String,
    /// What the vertical axis measures; empty where unknown.
    pub y_label: String,
    /// How many panels stand side by side; 0 where nothing is said of it.
    pub columns: usize,
    /// What is drawn.
    pub series: Vec<Series>,
    /// How many of its values are missing.
    #[serde(default, skip_serializing_if = "Lacks::nothing")]
    pub lacks: Lacks,
}

impl Artifact for Layer {
    const KIND: &'static str = "Layer";

    fn encode(&self) -> Vec<u8> {
        Tensors::default().encode(Self::KIND, self)
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        Tensors::decode(Self::KIND, bytes).map(|(_, layer)| layer)
    }
}

/// The legend entry of a series: the label given, or else the value's name; then the coordinate.
pub(super) fn entry(label: &str, name: &str, coordinate: &str) -> String {
    match (label, coordinate) {
        ("", "") => name.to_owned(),
        ("", _) => coordinate.to_owned(),
        (_, "") => label.to_owned(),
        _ => format!("{label}, {coordinate}"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::drawing::{Mark, Stroke};
    use super::*;

    #[test]
    fn survives_the_round_trip_with_what_is_not_finite() {
        let marks = vec![
            Mark::Line(Stroke::Thin, vec![(0.1, f64::NEG_INFINITY), (0.2, -0.0)]),
            Mark::Band(vec![(1e300, f64::INFINITY, f64::NAN)]),
            Mark::Bar { x: 0.0, width: 1.0, y: 2.0, whisker: Some((1.0, 3.0)) },
        ];
        let series = vec![Series { label: "a \"b\"".into(), marks, ..Series::default() }];
        let layer = Layer { x_label: "x".into(), series, ..Layer::default() };
        let back = Layer::decode(&layer.encode()).unwrap();
        assert_eq!(format!("{back:?}"), format!("{layer:?}"));
    }

    #[test]
    fn an_entry_says_what_it_knows() {
        assert_eq!(entry("", "gap", ""), "gap");
        assert_eq!(entry("", "gap", "WCM"), "WCM");
        assert_eq!(entry("true", "gap", ""), "true");
        assert_eq!(entry("true", "gap", "WCM"), "true, WCM");
    }
}
