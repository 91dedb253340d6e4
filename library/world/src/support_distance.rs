//! How far places lie from the data.

use ivx_data::Dataset;
use ivx_data::form;
use ivx_op::{Array, Ctx, Facts, One, Op, OpError, Wrong, declare};

use super::{Points, curve};

declare! {
    /// The distance from each place to the nearest input: 0 on the data, large outside their support.
    pub struct SupportDistance = "support_distance" @ 1 -> Array [x] {
        /// The data.
        data: One<Dataset>;
        /// The places.
        at: Box<dyn Points>;
    }
    rule of_pairs;
}

fn of_pairs(facts: &Facts<'_>) -> Result<(), Wrong> {
    let form = form::form(facts, "data").unwrap_or_default();
    form::pairs("this operation", &form).map_err(form::wrong("data"))
}

impl Op for SupportDistance {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        if self.data.x.is_empty() {
            return Err(OpError::Failed("there are no data to be distant from".to_owned()));
        }
        form::pairs("this operation", &self.data.form).map_err(form::failed)?;
        let points = self.at.points()?;
        let nearest =
            |a: &f64| self.data.x.iter().map(|x| (x - a).abs()).fold(f64::INFINITY, f64::min);
        let distances = points.iter().map(nearest).collect();
        Ok(curve(points, distances))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Grid;
    use super::*;

    #[test]
    fn the_nearest_input_counts() {
        let data = One(Dataset::pairs(vec![0.5, -1.0], vec![0.0, 0.0]));
        let at = Box::new(Grid { low: -2.0, high: 1.0, points: 4 });
        let ctx = Ctx::new("support_distance", 0, None);
        let distances = SupportDistance { data, at }.run(&ctx).unwrap();
        assert_eq!(distances.values, [1.0, 0.0, 0.5, 0.5]);
    }
}
