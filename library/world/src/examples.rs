//! Data drawn from a problem of supervised learning.

use ivx_data::Dataset;
use ivx_op::{Ctx, Facts, Op, OpError, Shapes, declare};

use super::Task;

declare! {
    /// Observations drawn from a task, independently.
    ///
    /// Fewer are the first of more.
    pub struct Examples = "examples" @ 1, stochastic -> Dataset {
        /// The task.
        of: Box<dyn Task>;
        /// How many observations.
        n: usize, in 0.0..=1e7;
        /// Tells apart draws that must differ on one seed, such as training and test data.
        stream: String = "main";
    }
    shapes of_task;
}

fn of_task(facts: &Facts<'_>) -> Option<Shapes> {
    facts.arg::<Box<dyn Task>>("of").map(|task| task.form().shapes())
}

impl Op for Examples {
    fn run(&self, ctx: &Ctx) -> Result<Dataset, OpError> {
        let mut rng = ctx.rng("examples", &[&self.stream]);
        let mut data = Dataset { form: self.of.form(), ..Dataset::default() };
        for _ in 0..self.n {
            let (x, y) = self.of.draw(&mut rng);
            data.x.extend(x);
            data.y.extend(y);
        }
        Ok(data)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Glyphs;
    use super::*;

    #[test]
    fn fewer_are_the_first_of_more() {
        let draw = |n, stream: &str| {
            let of = Box::new(Glyphs { noise: 0.5 });
            let examples = Examples { of, n, stream: stream.to_owned() };
            examples.run(&Ctx::new("examples", 0, None)).unwrap()
        };
        let (few, many) = (draw(2, "main"), draw(5, "main"));
        assert_eq!(few, many.pick(&[0, 1]));
        assert_eq!(many.len(), 5);
        assert_ne!(few, draw(2, "test"));
    }
}
