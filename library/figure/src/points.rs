//! Datasets as points.

use ivx_data::Dataset;
use ivx_op::{Ctx, Everything, Op, OpError, declare};

use super::drawing::{Mark, Series};
use super::layer::{Layer, entry};

declare! {
    /// The pairs of one or more datasets as points, all in one look.
    pub struct Points = "points" @ 3 -> Layer {
        /// The datasets.
        data: Everything<Dataset>;
        /// The legend entry; where empty, what the spec calls `data`.
        label: String = "";
    }
}

impl Op for Points {
    fn run(&self, _: &Ctx) -> Result<Layer, OpError> {
        let pairs =
            |data: &Dataset| data.x.iter().copied().zip(data.y.iter().copied()).collect::<Vec<_>>();
        let marks = vec![Mark::Points(self.data.0.values.iter().flat_map(pairs).collect())];
        let label = entry(&self.label, &self.data.0.name, "");
        Ok(Layer { series: vec![Series { label, marks, ..Series::default() }], ..Layer::default() })
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::Gathered;

    use super::*;

    #[test]
    fn all_pairs_are_shown() {
        let data = |x: &[f64], y: &[f64]| Dataset::pairs(x.to_vec(), y.to_vec());
        let values = vec![data(&[1.0, 2.0], &[3.0, 4.0]), data(&[5.0], &[6.0])];
        let data = Everything(Gathered { dims: vec![], values, name: "demos".into() });
        let ctx = Ctx::new("points", 0, None);
        let found = Points { data, label: String::new() }.run(&ctx).unwrap();
        let marks = vec![Mark::Points(vec![(1.0, 3.0), (2.0, 4.0), (5.0, 6.0)])];
        assert_eq!(found.series, [Series { label: "demos".into(), marks, ..Series::default() }]);
    }
}
