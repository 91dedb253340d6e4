//! What models of worlds are learned of.

use ivx_data::{Dataset, Rollouts, shown_by};
use ivx_op::{Ctx, Facts, One, Op, OpError, Shapes, declare};

use super::learned::form;

declare! {
    /// What followed each step of some episodes, for a model of their world to be learned of (Eqn. 2.66): inputs are what
    /// was seen and what was done, with a 1 in the place of one of so many; targets are how what is seen changed, and what
    /// was paid.
    pub struct LabelledTransitions = "labelled_transitions" @ 1 -> Dataset {
        /// The episodes.
        of: One<Rollouts>;
    }
    shapes of_world;
}

fn of_world(facts: &Facts<'_>) -> Option<Shapes> {
    let (sees, does) = shown_by(facts.shapes("of")?)?;
    Some(form(&sees, &does).shapes())
}

impl Op for LabelledTransitions {
    fn run(&self, _: &Ctx) -> Result<Dataset, OpError> {
        let paths = &self.of.paths;
        let form = form(paths.seen.fields(), &paths.does);
        let (seen, acts) = (&paths.seen, &paths.acts);
        let numbers = |of: &ivx_data::Columns, row: usize| -> Vec<f64> {
            let mut numbers = vec![0.0; of.width()];
            of.spread_rows(&[row], &mut numbers);
            numbers.into_iter().map(f64::from).collect()
        };
        let (mut x, mut y) = (Vec::new(), Vec::new());
        for (from, done, steps, _) in paths.each() {
            for t in 0..steps {
                let (before, after) = (numbers(seen, from + t), numbers(seen, from + t + 1));
                y.extend(after.iter().zip(&before).map(|(after, before)| after - before));
                y.push(self.of.rewards[done + t]);
                x.extend(before);
                x.extend(numbers(acts, done + t));
            }
        }
        Ok(Dataset { form, x, y })
    }
}
