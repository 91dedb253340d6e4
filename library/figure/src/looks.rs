//! How each series of a drawing looks.

use std::collections::BTreeSet;

use super::drawing::{Drawing, Series, Stroke};
use super::marks::Look;

impl Drawing {
    /// The distinct labels that need a legend. A single one that the axis already bears does not.
    pub(super) fn labels(&self) -> Vec<&str> {
        let mut labels: Vec<&str> = Vec::new();
        for Series { label, .. } in &self.series {
            if !label.is_empty() && !labels.contains(&label.as_str()) {
                labels.push(label);
            }
        }
        if labels == [self.y.label.as_str()] { Vec::new() } else { labels }
    }
}

/// How each series looks: those of one label alike, those without a label like no other of their panel, and the same
/// in each panel.
///
/// Lines bear markers where only colour would tell two of them apart.
pub(super) fn looks(drawing: &Drawing) -> Vec<Look> {
    // The label of each kind; of those without, which one of its panel it is.
    let mut kinds: Vec<(&str, usize)> = Vec::new();
    let mut indices = Vec::new();
    for (i, Series { label, panel, .. }) in drawing.series.iter().enumerate() {
        let nth = |here: &&Series| here.label.is_empty() && here.panel == *panel;
        let nth = if label.is_empty() { drawing.series[..i].iter().filter(nth).count() } else { 0 };
        let kind = (label.as_str(), nth);
        indices.push(kinds.iter().position(|other| *other == kind).unwrap_or(kinds.len()));
        if indices.last() == Some(&kinds.len()) {
            kinds.push(kind);
        }
    }
    let n_kinds_with = |stroke: Stroke| {
        let has = |series: &Series| series.marks.iter().any(|mark| mark.stroke() == Some(stroke));
        let with = drawing.series.iter().zip(&indices).filter(|(series, _)| has(series));
        with.map(|(_, index)| index).collect::<BTreeSet<_>>().len()
    };
    let marked = n_kinds_with(Stroke::Solid) > 1 || n_kinds_with(Stroke::Dashed) > 1;
    indices.into_iter().map(|index| Look { index, marked }).collect()
}

#[cfg(test)]
mod tests {
    use super::super::drawing::Mark;
    use super::*;

    #[test]
    fn series_of_one_label_look_alike_and_share_an_entry() {
        let sloping = |up| Mark::Line(Stroke::Solid, vec![(0.0, 0.0), (1.0, up)]);
        let series = |label: &str, mark: Mark| Series {
            label: label.to_owned(),
            marks: vec![mark],
            ..Series::default()
        };
        let all = |[a, b, c]: [&str; 3]| {
            let level = Mark::Level(Stroke::Dashed, 0.5);
            let series = vec![series(a, sloping(1.0)), series(b, level), series(c, sloping(2.0))];
            Drawing { series, ..Drawing::default() }
        };
        let indices =
            |drawing: &Drawing| looks(drawing).iter().map(|look| look.index).collect::<Vec<_>>();
        assert_eq!(indices(&all(["a", "b", "a"])), [0, 1, 0]);
        assert_eq!(indices(&all(["", "", ""])), [0, 1, 2]);
        assert!(looks(&all(["a", "b", "c"])).iter().all(|look| look.marked));
        assert!(!looks(&all(["a", "b", "a"])).iter().any(|look| look.marked));
        assert_eq!(all(["a", "b", "a"]).labels(), ["a", "b"]);
        assert_eq!(all(["a", "a", ""]).labels(), ["a"]);
        let mut single = all(["a", "a", "a"]);
        single.y.label = "a".into();
        assert_eq!(single.labels(), Vec::<&str>::new());
        let mut apart = all(["", "", ""]);
        for (series, panel) in apart.series.iter_mut().zip(["p", "q", "r"]) {
            series.panel = panel.into();
        }
        assert_eq!(indices(&apart), [0, 0, 0]);
        let mut pairs = all(["", "", ""]);
        pairs.series.push(pairs.series[2].clone());
        for (series, panel) in pairs.series.iter_mut().zip(["p", "p", "q", "q"]) {
            series.panel = panel.into();
        }
        assert_eq!(indices(&pairs), [0, 1, 0, 1]);
    }
}
