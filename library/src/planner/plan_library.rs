//! Libraries of plans.

use ivx_data::form::{failed, form, wrong};
use ivx_data::{Dataset, Form, Misfit, sizes_told};
use ivx_math::kmeans::kmeans;
use ivx_op::{Array, Ctx, Dim, Facts, Labels, One, Op, OpError, Wrong, declare};

declare! {
    /// A few plans that stand for those of data, for a `trajectory_library` (Eqn. 3.6, Fig. 3.4): the centres of k-means
    /// (Lloyd, 1982), from first centres that are drawn by k-means++ (Arthur and Vassilvitskii, 2007). A plan is the target
    /// of an observation, all numbers of it a point. They are ordered by their numbers.
    pub struct PlanLibrary = "plan_library" @ 1, stochastic -> Array [plan, step, dim] {
        /// The data, whose targets are plans: of `[steps]` numbers, or of `[steps, dims]`.
        on: One<Dataset>;
        /// How many plans.
        plans: usize = 64, in 1.0..=1e5;
        /// From how many draws of first centres the best is taken.
        times: usize = 10, in 1.0..=1e3;
    }
    rule targets_are_plans;
}

fn targets_are_plans(facts: &Facts<'_>) -> Result<(), Wrong> {
    form(facts, "on").map_or(Ok(()), |form| sizes(&form).map(drop).map_err(wrong("on")))
}

/// How many steps a plan has, and how many numbers a step.
fn sizes(form: &Form) -> Result<(usize, usize), Misfit> {
    let help = "give data whose targets are plans";
    match (form.classes, &form.target[..]) {
        (Some(_), _) => {
            Err(Misfit::new("the targets are classes, which are no plans".to_owned(), help))
        }
        (None, [steps]) if *steps > 0 => Ok((*steps, 1)),
        (None, [steps, dims]) if steps * dims > 0 => Ok((*steps, *dims)),
        (None, target) => {
            let message = format!("the targets are {}, which are no plans", sizes_told(target));
            Err(Misfit::new(message, help))
        }
    }
}

impl Op for PlanLibrary {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        let (steps, dims) = sizes(&self.on.form).map_err(failed)?;
        let (n, width, points) = (self.on.len(), steps * dims, &self.on.y);
        if n < self.plans {
            let message = format!("of {n} plans there are to be {} centres", self.plans);
            return Err(OpError::Failed(message));
        }
        if let Some(at) = points.iter().position(|x| !x.is_finite()) {
            let (plan, number, x) = (at / width, at % width, points[at]);
            let message = format!("number {number} of plan {plan} of the data is {x}");
            return Err(OpError::Failed(message));
        }
        let mut rng = ctx.rng("centres", &[]);
        let found = kmeans((points, width), self.plans, self.times, &mut rng).centres;
        let mut centres: Vec<&[f64]> = found.chunks_exact(width).collect();
        let by_number = |(a, b): (&f64, &f64)| a.total_cmp(b);
        centres.sort_by(|a, b| {
            a.iter().zip(*b).map(by_number).find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
        });
        let sizes = [("plan", self.plans), ("step", steps), ("dim", dims)];
        Ok(Array {
            dims: sizes.map(|(name, n)| Dim::new(name, Labels::count(n))).to_vec(),
            values: centres.concat(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn library(form: Form, y: Vec<f64>, plans: usize) -> Result<Array, OpError> {
        let x = vec![0.0; y.len() / form.target_len()];
        let on = One(Dataset { form, x, y });
        PlanLibrary { on, plans, times: 10 }.run(&Ctx::new("plan_library", 3, None))
    }

    fn of(target: &[usize]) -> Form {
        Form { target: target.to_vec(), ..Form::default() }
    }

    #[test]
    fn plans_that_lie_together_become_their_mean() {
        // Two ways to the right, one to the left, of two steps in the plane.
        let plans = [
            [1.0, 0.0, 2.0, 1.0],
            [-1.0, 0.0, -2.0, 0.5],
            [1.0, 0.0, 2.0, 0.0],
            [-1.0, 0.0, -2.0, 1.5],
            [1.0, 9.0, 2.0, 9.0],
        ];
        let found = library(of(&[2, 2]), plans.concat(), 3).unwrap();
        let sizes: Vec<usize> = found.dims.iter().map(Dim::len).collect();
        assert_eq!(sizes, [3, 2, 2]);
        let expected = [[-1.0, 0.0, -2.0, 1.0], [1.0, 0.0, 2.0, 0.5], [1.0, 9.0, 2.0, 9.0]];
        assert_eq!(found.values, expected.concat());
        let found = library(of(&[4]), plans.concat(), 5).unwrap();
        assert_eq!(found.dims.iter().map(Dim::len).collect::<Vec<_>>(), [5, 4, 1]);
        assert_eq!(found.values[..4], plans[1]);
    }

    #[test]
    fn what_are_no_plans_is_told() {
        let why = |form: Form, y: Vec<f64>, plans| library(form, y, plans).unwrap_err().to_string();
        assert_eq!(why(of(&[2]), vec![0.0; 4], 3), "of 2 plans there are to be 3 centres");
        let told = "number 1 of plan 1 of the data is NaN";
        assert_eq!(why(of(&[2]), vec![0.0, 0.0, 0.0, f64::NAN], 1), told);
        assert!(why(of(&[]), vec![0.0; 4], 1).contains("the targets are numbers"));
        let classes = Form { classes: Some(2), ..of(&[2]) };
        assert!(why(classes, vec![0.0; 4], 1).contains("classes"));
    }
}
