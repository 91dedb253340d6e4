//! Lines across a panel.

use ivx_op::{Array, AxisNames, Ctx, Everything, Op, OpError, declare};

use super::arrange::arrange;
use super::drawing::{Mark, Series, Stroke};
use super::layer::{Layer, entry};
use super::panels::{panels, spelled};

declare! {
    /// Dashed lines across the plot at `y`; over `seed`, at its mean.
    ///
    /// What `y` also varies over gives one thin line each. A curve of the same label has the
    /// same colour.
    pub struct Level = "level" @ 4 -> Layer {
        /// The heights.
        y: Everything<Array>;
        /// Axes that have a line and legend entry for each label.
        by: AxisNames = Vec::<&str>::new();
        /// Axes that have a panel for each label; those of the last stand side by side.
        facet: AxisNames = Vec::<&str>::new();
        /// The legend entry; where empty, what the spec calls `y`, or the label of `by` alone.
        label: String = "";
        /// Whether the lines stand upright, where the horizontal axis is at `y`.
        upright: bool = false;
        /// Whether means are made of what is there where some of it is missing, because a node failed.
        skip_missing: bool = false;
    }
}

impl Op for Level {
    fn run(&self, _: &Ctx) -> Result<Layer, OpError> {
        let outer = [&self.facet.0[..], &self.by.0].concat();
        let all = arrange(&self.y, (&outer, &[]), self.skip_missing)?;
        let (facets, by) = all.outer.split_at(self.facet.0.len());
        let (panel_names, columns) = panels(facets);
        let stroke = if all.rest.is_empty() { Stroke::Dashed } else { Stroke::Thin };
        let by_labels = spelled(by);
        let kinds = panel_names.iter().flat_map(|panel| by_labels.iter().map(move |l| (panel, l)));
        let per_kind = all.cells.chunks(all.cells.len() / (panel_names.len() * by_labels.len()));
        let mark = |at| {
            if self.upright { Mark::Upright(stroke, at) } else { Mark::Level(stroke, at) }
        };
        let series = kinds.zip(per_kind).map(|((panel, coordinate), cells)| Series {
            label: entry(&self.label, &all.name, coordinate),
            panel: panel.clone(),
            marks: cells.iter().map(|cell| mark(cell.mean)).collect(),
        });
        Ok(Layer { columns, series: series.collect(), lacks: all.lacks(), ..Layer::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::super::arrange::tests::{axes, value};
    use super::*;

    #[test]
    fn each_label_has_its_mean() {
        let found = |upright| {
            let y = value(&[("seed", &["0", "1"]), ("ke", &["a", "b"])], &[1.0, 2.0, 3.0, 6.0]);
            let (by, facet, label) = (axes(&["ke"]), axes(&[]), String::new());
            let ctx = Ctx::new("level", 0, None);
            Level { y, by, facet, label, upright, skip_missing: false }.run(&ctx).unwrap().series
        };
        let series = |label: &str, mark| Series {
            label: label.into(),
            marks: vec![mark],
            ..Series::default()
        };
        let level = |label, y| series(label, Mark::Level(Stroke::Dashed, y));
        assert_eq!(found(false), [level("a", 2.0), level("b", 4.0)]);
        let upright = |label, x| series(label, Mark::Upright(Stroke::Dashed, x));
        assert_eq!(found(true), [upright("a", 2.0), upright("b", 4.0)]);
    }
}
