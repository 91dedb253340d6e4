//! Gradient-boosted trees.

use std::sync::Arc;

use ivx_data::{Dataset, Form, Misfit};
use ivx_math::boost::{Boosted, Targets};
use ivx_math::tree::Growth;
use ivx_nn::{Fitted, Model};
use ivx_op::{Ctx, OpError, declare};

use super::Learner;
use super::targets::{are_numbers_or_classes, are_sound, classes};

declare! {
    /// The sum of small trees, each grown on what those before it left of the error (Friedman, 2001): of squared error
    /// where targets are numbers, and of cross-entropy where they are classes, with a tree for each, of two for one.
    ///
    /// Every input is tried at every split, so that nothing is drawn. Inputs of any shape are vectors of their numbers,
    /// whose scales do not matter.
    pub struct BoostedTrees = "boosted_trees" @ 1 {
        /// How many times trees are added.
        stages: usize = 100, in 0.0..=1e5;
        /// What each tree is multiplied by.
        rate: f64 = 0.1, in 0.0..=1.0;
        /// How many splits lead to a leaf at most; 0 for as many as there are.
        depth: usize = 3, in 0.0..;
        /// How many data a leaf has at least.
        min_leaf: usize = 1, in 1.0..;
    }
}

impl Learner for BoostedTrees {
    fn train(&self, data: &Dataset, _: u64, ctx: &Ctx) -> Result<Model, OpError> {
        are_sound(data)?;
        let (form, of) = (data.form.clone(), classes(data));
        let targets = match form.classes {
            Some(n) => Targets::Classes(&of, n),
            None => Targets::Numbers(&data.y, form.target_len()),
        };
        let mut fit = Boosted::constant(&targets).map_err(OpError::Failed)?;
        let n_inputs = form.input_len();
        let mut sums = fit.values(&data.x, n_inputs);
        let how = Growth { depth: self.depth, min_leaf: self.min_leaf, tried: n_inputs };
        // All inputs are tried, and so nothing is drawn.
        let mut rng = ctx.rng("none", &[]);
        for stage in 0..self.stages {
            // It can be stopped here, and is soon done anew.
            ctx.checkpoint(Vec::new)?;
            ctx.tell(stage as u64, self.stages as u64, || format!("{stage} stages"));
            fit.add((&data.x, n_inputs), &targets, &mut sums, (how, self.rate), &mut rng);
        }
        Ok(Model::Fitted(Fitted { form, function: Arc::new(fit) }))
    }

    fn fits(&self, form: &Form) -> Result<(), Misfit> {
        are_numbers_or_classes("boosted_trees", form)
    }

    fn memory(&self, form: &Form, n: u64) -> u64 {
        // A few numbers a datum, and trees of nodes with six numbers each, twice while they are encoded.
        let nodes = if self.depth == 0 { 2 * n } else { (2 * n).min(2 << self.depth.min(40)) };
        let outputs = form.classes.unwrap_or_else(|| form.target_len()) as u64;
        let trees = nodes.saturating_mul(2 * 8 * 6).saturating_mul(self.stages as u64);
        outputs.saturating_mul(trees.saturating_add(8 * 4 * n))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metric::{Accuracy, Rmse};
    use ivx_op::{One, Op as _};

    const CTX: Ctx = Ctx::new("train", 0, None);

    fn boosted(stages: usize) -> BoostedTrees {
        BoostedTrees { stages, rate: 0.1, depth: 3, min_leaf: 1 }
    }

    #[test]
    fn stages_lower_the_error_of_a_wave() {
        let wave = |n: u32, shift: f64| {
            let x: Vec<f64> = (0..n).map(|i| (f64::from(i) + shift) / f64::from(n)).collect();
            Dataset::pairs(x.clone(), x.iter().map(|x| (9.0 * x).sin()).collect())
        };
        let rmse = |stages| {
            let model = One(boosted(stages).train(&wave(200, 0.0), 0, &CTX).unwrap());
            Rmse { model, on: One(wave(150, 0.4)) }.run(&CTX).unwrap().values[0]
        };
        let (mean, many) = (rmse(0), rmse(100));
        assert!(many < 0.05 * mean, "{many} of {mean}");
    }

    #[test]
    fn classes_of_rings_are_told_apart() {
        let form = Form { input: vec![2], target: vec![], classes: Some(3), ..Form::default() };
        let ring = |i: u32| {
            let (turn, radius) =
                (f64::from(i) * 0.7, 0.3 + f64::from(i % 3) + 0.2 * (f64::from(i) * 1.3).sin());
            [radius * turn.cos(), radius * turn.sin()]
        };
        let data = |from: u32, to: u32| Dataset {
            form: form.clone(),
            x: (from..to).flat_map(ring).collect(),
            y: (from..to).map(|i| f64::from(i % 3)).collect(),
        };
        let model = One(boosted(40).train(&data(0, 300), 0, &CTX).unwrap());
        let share = Accuracy { model, on: One(data(1000, 1300)) }.run(&CTX).unwrap().values[0];
        assert!(share > 0.9, "{share}");
    }
}
