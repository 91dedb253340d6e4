//! What each action is worth under risk and ignorance.

use ivx_op::{Array, Ctx, Dim, Labels, Op, OpError, Part, declare};
use ivx_world::{Belief, Problem};

use crate::ce::CertaintyEquivalent;
use crate::ke::KnowledgeEquivalent;

declare! {
    /// The worth of each action: the knowledge equivalent over models of the certainty
    /// equivalent of each model (§2.1.2).
    pub struct Utility = "utility" @ 1 -> Array [action] {
        /// The choice.
        problem: Box<dyn Problem>;
        /// How risk is reduced.
        ce: Box<dyn CertaintyEquivalent> = Part::new("eu");
        /// How ignorance is reduced.
        ke: Box<dyn KnowledgeEquivalent> = Part::new("ma");
    }
}

impl Op for Utility {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        utilities(self.problem.as_ref(), self.ce.as_ref(), self.ke.as_ref())
    }
}

/// The worth of each action, over the dimension `action`.
pub(super) fn utilities(
    problem: &dyn Problem,
    ce: &dyn CertaintyEquivalent,
    ke: &dyn KnowledgeEquivalent,
) -> Result<Array, OpError> {
    let (mut names, mut values) = (Vec::new(), Vec::new());
    for (name, belief) in problem.actions() {
        names.push(name.to_owned());
        values.push(worth(belief, ce, ke)?);
    }
    Ok(Array::series(Dim::new("action", Labels::Names(names)), values))
}

fn worth(
    belief: &dyn Belief,
    ce: &dyn CertaintyEquivalent,
    ke: &dyn KnowledgeEquivalent,
) -> Result<f64, OpError> {
    let (models, weights) = belief.models()?;
    let mut scores = Vec::with_capacity(models.len());
    for model in models {
        let (outcomes, probabilities) = model.atoms()?;
        scores.push(ce.value(outcomes, probabilities));
    }
    Ok(ke.reduce(&scores, &weights))
}
