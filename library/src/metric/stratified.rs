//! What many runs on many tasks come to, with an interval.

use ivx_data::{END, ENDS};
use ivx_math::evidence::N_RESAMPLES;
use ivx_math::interval::percentile;
use ivx_math::moments::mean;
use ivx_math::order::median;
use ivx_math::several::shortfall;
use ivx_op::{Array, AxisNames, Ctx, Dim, Facts, Labels, Named, Op, OpError, Wrong, declare};
use rand::RngExt as _;

use super::reduce::{Groups, named};

declare! {
    /// A statistic of all runs on all tasks, with the interval of a bootstrap that draws runs anew for each task
    /// (Agarwal et al., 2021): `estimate`, `low` and `high` along `end`, which figures and tables show as a number with
    /// its interval.
    ///
    /// The statistic is the name of a reduction of all scores together, such as `iqm` or `mean`; `optimality_gap`; or
    /// `median`, that of the means of tasks.
    pub struct Stratified = "stratified" @ 1 -> Array [reduce x to end] {
        /// The scores.
        x: Named<Array>;
        /// The axis of runs.
        over: AxisNames;
        /// The axes of tasks.
        tasks: AxisNames = Vec::<&str>::new();
        /// What all scores come to.
        statistic: String = "iqm";
        /// How often such intervals hold the truth.
        confidence: f64 = 0.95, in 0.5..=0.999;
        /// What a run should reach, for `optimality_gap`.
        target: f64 = 1.0;
    }
    rule known_statistic;
}

fn known_statistic(facts: &Facts<'_>) -> Result<(), Wrong> {
    let statistic = facts.arg::<String>("statistic").unwrap_or_else(|| "iqm".to_owned());
    if statistic == "optimality_gap" || named(&statistic).is_some() {
        return Ok(());
    }
    let help = "say `\"iqm\"`, `\"mean\"`, `\"median\"` or `\"optimality_gap\"`".to_owned();
    let message = format!("no statistic of runs and tasks is called {statistic:?}");
    Err(Wrong { arg: "statistic", message, help })
}

impl Op for Stratified {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        let x = Array::stack(&self.x.0).map_err(OpError::Failed)?;
        // Of each coordinate that is kept, the runs of each task.
        let over_all = [&self.over.0[..], &self.tasks.0].concat();
        let all = Groups::of(&x, &over_all)?;
        let tasks = tasks(&x, &self.over.0, &self.tasks.0)?;
        let dims = all.kept.iter().map(|d| x.dims[*d].clone());
        let end = Dim::new(END, Labels::Names(ENDS.map(str::to_owned).into()));
        let dims: Vec<Dim> = dims.chain([end]).collect();
        let mut values = Vec::new();
        for start in &all.starts {
            let scores: Vec<Vec<f64>> = tasks
                .iter()
                .map(|runs| runs.iter().map(|run| x.values[start + run]).collect())
                .collect();
            let mut rng = Ctx { seed: 0, member: None, ..*ctx }.rng("runs", &[]);
            let mut drawn = || {
                let one = |runs: &Vec<f64>| -> Vec<f64> {
                    runs.iter().map(|_| runs[rng.random_range(0..runs.len())]).collect()
                };
                self.statistic(&scores.iter().map(one).collect::<Vec<_>>())
            };
            let resamples: Vec<f64> = (0..N_RESAMPLES).map(|_| drawn()).collect();
            // A run that is missing could be anything.
            let (low, high) = if scores.iter().flatten().any(|x| x.is_nan()) {
                (f64::NAN, f64::NAN)
            } else {
                percentile(&resamples, self.confidence)
            };
            values.extend([self.statistic(&scores), low, high]);
        }
        Ok(Array { dims, values })
    }
}

impl Stratified {
    /// Of the runs of each task.
    fn statistic(&self, scores: &[Vec<f64>]) -> f64 {
        let all = || scores.concat();
        match self.statistic.as_str() {
            "median" => median(&scores.iter().map(|runs| mean(runs)).collect::<Vec<_>>()),
            "optimality_gap" => shortfall(&all(), self.target),
            name => named(name).map_or(f64::NAN, |reduction| reduction(&all())),
        }
    }
}

/// Where the runs of each task lie behind the first number of all.
fn tasks(x: &Array, runs: &[String], tasks: &[String]) -> Result<Vec<Vec<usize>>, OpError> {
    let of_runs = Groups::of(x, runs)?.offsets;
    let of_tasks = if tasks.is_empty() { vec![0] } else { Groups::of(x, tasks)?.offsets };
    Ok(of_tasks.iter().map(|task| of_runs.iter().map(|run| task + run).collect()).collect())
}

#[cfg(test)]
mod tests {
    use ivx_op::Gathered;

    use super::*;

    fn stratified(statistic: &str, scores: &[f64], n_runs: usize) -> Vec<f64> {
        let dims = vec![Dim::new("#0", Labels::count(n_runs)), Dim::new("#1", Labels::count(2))];
        let values = scores.iter().copied().map(Array::scalar).collect();
        let x = Named(Gathered { dims, values, name: String::new() });
        let axes = |name: &str| AxisNames(vec![name.to_owned()]);
        let (over, tasks, statistic) = (axes("#0"), axes("#1"), statistic.to_owned());
        let op = Stratified { x, over, tasks, statistic, confidence: 0.95, target: 1.0 };
        let found = op.run(&Ctx::new("stratified", 0, None)).expect("there are runs");
        assert_eq!(found.dims.iter().map(|dim| dim.name.as_str()).collect::<Vec<_>>(), ["end"]);
        found.values
    }

    #[test]
    fn two_runs_on_two_tasks() {
        // As in `several`: the runs 0, 1 and 0.5, 3 on two tasks.
        let scores = [0.0, 1.0, 0.5, 3.0];
        assert_eq!(stratified("mean", &scores, 2)[0], 1.125);
        assert_eq!(stratified("median", &scores, 2)[0], 1.125);
        assert_eq!(stratified("iqm", &scores, 2)[0], 0.75);
        assert_eq!(stratified("optimality_gap", &scores, 2)[0], 0.375);
        // Runs are drawn within their tasks: the least mean is (0 + 1) / 2, the largest (0.5 + 3) / 2.
        assert_eq!(stratified("mean", &scores, 2)[1..], [0.5, 1.75]);
        let missing = stratified("optimality_gap", &[0.0, 1.0, f64::NAN, 3.0], 2);
        assert!(missing.iter().all(|x| x.is_nan()), "{missing:?}");
        // Tasks that differ and runs that do not leave no doubt.
        assert_eq!(stratified("mean", &[0.0, 9.0, 0.0, 9.0, 0.0, 9.0], 3), [4.5; 3]);
    }
}
