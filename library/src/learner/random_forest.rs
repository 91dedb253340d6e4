//! Random forests.

use std::sync::Arc;

use ivx_data::{Dataset, Form, Misfit};
use ivx_math::tree::{Growth, Sample, grow};
use ivx_nn::{Fitted, Forest, Model};
use ivx_op::{Ctx, OpError, declare};
use rand::RngExt as _;

use super::Learner;
use super::targets::{are_numbers_or_classes, are_sound, as_numbers};

declare! {
    /// The mean of many trees, each grown on its own resample of the data (Breiman, 2001): of numbers, or of the shares
    /// of classes.
    ///
    /// Each split is the best of some inputs, drawn anew: it lowers the squared error most, or Gini's impurity. Inputs of
    /// any shape are vectors of their numbers, whose scales do not matter. A class that no leaf has is impossible, with
    /// an infinite `nll` where it is right.
    pub struct RandomForest = "random_forest" @ 1, stochastic {
        /// How many trees.
        trees: usize = 100, in 1.0..=1e5;
        /// How many splits lead to a leaf at most; 0 for as many as there are.
        depth: usize = 0, in 0.0..;
        /// How many data a leaf has at least.
        min_leaf: usize = 1, in 1.0..;
        /// How many inputs a split chooses from; 0 for all where targets are numbers, and for the root of how many there
        /// are where they are classes.
        inputs: usize = 0, in 0.0..;
        /// Whether each tree sees its own resample of the data, as many with replacement.
        bootstrap: bool = true;
    }
}

impl Learner for RandomForest {
    fn train(&self, data: &Dataset, _: u64, ctx: &Ctx) -> Result<Model, OpError> {
        are_sound(data)?;
        let (ys, n_targets) = as_numbers(data);
        let n_inputs = data.form.input_len();
        let sample = Sample { xs: &data.x, n_inputs, ys: &ys, n_targets };
        let tried = match self.inputs {
            0 if data.form.classes.is_some() => n_inputs.isqrt().max(1),
            0 => n_inputs,
            inputs => inputs.min(n_inputs),
        };
        let how = Growth { depth: self.depth, min_leaf: self.min_leaf, tried };
        let mut trees = Vec::with_capacity(self.trees);
        for t in 0..self.trees {
            // It can be stopped here, and is soon done anew.
            ctx.checkpoint(Vec::new)?;
            ctx.tell(t as u64, self.trees as u64, || format!("{t} trees"));
            let mut rng = ctx.rng("tree", &[&t.to_string()]);
            let n = data.len();
            let place = |i| if self.bootstrap { rng.random_range(0..n) } else { i };
            let places = (0..n).map(place).collect();
            trees.push(grow(&sample, places, how, &mut rng));
        }
        let function = Arc::new(Forest(trees));
        Ok(Model::Fitted(Fitted { form: data.form.clone(), function }))
    }

    fn fits(&self, form: &Form) -> Result<(), Misfit> {
        are_numbers_or_classes("random_forest", form)
    }

    fn memory(&self, form: &Form, n: u64) -> u64 {
        // A node has five numbers and its targets, and there are two a datum; twice while they are encoded.
        let width = form.classes.unwrap_or_else(|| form.target_len()) as u64;
        let node = 8 * (5 + width);
        n.saturating_mul(2 * 2 * node).saturating_mul(self.trees as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metric::{Accuracy, Rmse};
    use ivx_op::{Array, One, Op as _};

    fn forest(trees: usize, bootstrap: bool) -> RandomForest {
        RandomForest { trees, depth: 0, min_leaf: 1, inputs: 0, bootstrap }
    }

    /// The function of Friedman (1991) on even numbers of `[0, 1)⁵`, without noise.
    fn friedman(n: usize, from: usize) -> Dataset {
        let form = Form { input: vec![5], ..Form::default() };
        // A lattice of irrational steps.
        let roots = [2.0_f64, 3.0, 5.0, 7.0, 11.0].map(f64::sqrt);
        let place = |i: usize| roots.map(|root| (root * ivx_math::moments::real(i)).fract());
        let rows: Vec<[f64; 5]> = (from..from + n).map(place).collect();
        let y = rows.iter().map(|[a, b, c, d, e]| {
            let wave = 10.0 * (std::f64::consts::PI * a * b).sin();
            wave + 20.0 * (c - 0.5).powi(2) + 10.0 * d + 5.0 * e
        });
        Dataset { form, y: y.collect(), x: rows.concat() }
    }

    fn rmse(learner: &dyn Learner, ctx: &Ctx) -> f64 {
        let model = learner.train(&friedman(300, 1), 0, ctx).unwrap();
        let on = One(friedman(300, 1000));
        Rmse { model: One(model), on }.run(ctx).unwrap().values[0]
    }

    #[test]
    fn one_tree_of_all_data_fits_distinct_rows() {
        let data = friedman(100, 1);
        let ctx = Ctx::new("train", 0, None);
        let model = forest(1, false).train(&data, 0, &ctx).unwrap();
        assert_eq!(model.predict(&data.x), data.y);
        let resampled = forest(1, true).train(&data, 0, &ctx).unwrap();
        assert_ne!(resampled.predict(&data.x), data.y);
    }

    #[test]
    fn many_trees_beat_one_and_a_linear_model() {
        let ctx = Ctx::new("train", 0, None);
        let (one, many) = (rmse(&forest(1, true), &ctx), rmse(&forest(50, true), &ctx));
        let linear = rmse(&super::super::Ridge { alpha: 1e-6 }, &ctx);
        assert!(many < 0.75 * one && many < 0.85 * linear, "{many}, one {one}, linear {linear}");
    }

    #[test]
    fn streams_decide_and_nothing_else() {
        let data = friedman(60, 1);
        let train = |seed, member| {
            let ctx = Ctx::new("train", seed, member);
            forest(5, true).train(&data, 0, &ctx).unwrap()
        };
        assert_eq!(train(0, None), train(0, None));
        assert_ne!(train(0, None), train(1, None));
        assert_ne!(train(0, Some(0)), train(0, Some(1)));
        // The first trees of more are these.
        let ctx = Ctx::new("train", 0, None);
        let few = forest(1, true).train(&data, 0, &ctx).unwrap().predict(&data.x);
        let two = forest(2, true).train(&data, 0, &ctx).unwrap().predict(&data.x);
        assert!(few.iter().zip(&two).any(|(a, b)| a != b));
    }

    #[test]
    fn classes_on_a_board_are_told_apart() {
        // A board of 4 × 4 fields by turns, which no linear model tells apart.
        let form = Form { input: vec![2], target: vec![], classes: Some(2), ..Form::default() };
        let board = |n: usize, from: usize| {
            let lattice = friedman(n, from);
            let rows: Vec<&[f64]> = lattice.x.chunks_exact(5).collect();
            let field = |x: f64| (4.0 * x).floor();
            let y = rows.iter().map(|row| (field(row[0]) + field(row[1])) % 2.0).collect();
            let x = rows.iter().flat_map(|row| row[..2].to_vec()).collect();
            Dataset { form: form.clone(), x, y }
        };
        let ctx = Ctx::new("train", 0, None);
        let share = |learner: &dyn Learner| {
            let model = One(learner.train(&board(600, 1), 0, &ctx).unwrap());
            let Array { values, .. } =
                Accuracy { model, on: One(board(300, 2000)) }.run(&ctx).unwrap();
            values[0]
        };
        let (trees, linear) = (share(&forest(50, true)), share(&super::super::Logistic { c: 1.0 }));
        assert!(trees > 0.9 && linear < 0.65, "{trees} and {linear}");
    }
}
