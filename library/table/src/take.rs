//! The first observations of data, and data in another order.

use ivx_data::Dataset;
use ivx_op::{Ctx, Facts, One, Op, OpError, Shapes, declare};
use rand::seq::SliceRandom as _;

declare! {
    /// The first observations of data.
    pub struct Take = "take" @ 1 -> Dataset {
        /// The data.
        data: One<Dataset>;
        /// How many.
        n: usize, in 1.0..=1e9;
    }
    shapes same;
}

declare! {
    /// The observations of data in an order that is drawn.
    pub struct Shuffled = "shuffled" @ 1, stochastic -> Dataset {
        /// The data.
        data: One<Dataset>;
        /// Tells apart draws that must differ on one seed.
        stream: String = "main";
    }
    shapes same;
}

/// The shapes of the data.
pub(crate) fn same(facts: &Facts<'_>) -> Option<Shapes> {
    facts.shapes("data").cloned()
}

impl Op for Take {
    fn run(&self, _: &Ctx) -> Result<Dataset, OpError> {
        let n = self.data.len();
        if self.n > n {
            return Err(OpError::Failed(format!("there are {n} observations, and not {}", self.n)));
        }
        Ok(self.data.pick(&(0..self.n).collect::<Vec<_>>()))
    }
}

impl Op for Shuffled {
    fn run(&self, ctx: &Ctx) -> Result<Dataset, OpError> {
        let mut order: Vec<usize> = (0..self.data.len()).collect();
        order.shuffle(&mut ctx.rng("order", &[&self.stream]));
        Ok(self.data.pick(&order))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data() -> One<Dataset> {
        let x: Vec<f64> = (0..20).map(f64::from).collect();
        One(Dataset::pairs(x.clone(), x))
    }

    #[test]
    fn the_first_are_taken() {
        let take = |n| Take { data: data(), n }.run(&Ctx::new("take", 0, None)).map(|data| data.x);
        assert_eq!(take(2), Ok(vec![0.0, 1.0]));
        assert_eq!(take(20).unwrap().len(), 20);
        assert!(take(21).is_err());
    }

    #[test]
    fn another_order_has_the_same_observations() {
        let shuffled = |seed| {
            let shuffled = Shuffled { data: data(), stream: "main".to_owned() };
            shuffled.run(&Ctx::new("shuffled", seed, None)).unwrap()
        };
        let (first, mut other) = (shuffled(0), shuffled(1));
        assert!(first.x != other.x && first.x == first.y && first.x != data().x);
        other.x.sort_by(f64::total_cmp);
        assert_eq!(other.x, data().x);
    }
}
