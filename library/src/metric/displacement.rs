//! How far plans are from what came, as the nuScenes prediction challenge has it.

use ivx_data::form::{form, told, wrong};
use ivx_data::{Dataset, Misfit};
use ivx_math::moments::real;
use ivx_math::trajectory::{Displacement, displacements, is_miss, min_ade, min_fde};
use ivx_op::{Array, Ctx, Dim, Facts, Labels, One, Op, OpError, Wrong, declare};

declare! {
    /// The least mean distance of the `k` plans that are worth most from what came, of each observation: minADE_k.
    pub struct MinAde = "min_ade" @ 1 -> Array [row] {
        /// Plans, `[row, mode, step, dim]`, of two numbers a place.
        plans: One<Array>;
        /// What each is worth, `[row, mode]`.
        worth: One<Array>;
        /// What came: data whose targets are sequences of places.
        to: One<Dataset>;
        /// How many plans count; all where there are fewer.
        k: usize, in 1.0..=100_000.0;
    }
    rule are_places;
}

declare! {
    /// The least distance of the last place of the `k` plans that are worth most from that of what came, of each
    /// observation: minFDE_k.
    pub struct MinFde = "min_fde" @ 1 -> Array [row] {
        /// Plans, `[row, mode, step, dim]`, of two numbers a place.
        plans: One<Array>;
        /// What each is worth, `[row, mode]`.
        worth: One<Array>;
        /// What came: data whose targets are sequences of places.
        to: One<Dataset>;
        /// How many plans count; all where there are fewer.
        k: usize, in 1.0..=100_000.0;
    }
    rule are_places;
}

declare! {
    /// Whether all of the `k` plans that are worth most are somewhere as far from what came as a bound, or further, as 1 or
    /// 0: their mean over observations is the miss rate.
    pub struct Missed = "missed" @ 1 -> Array [row] {
        /// Plans, `[row, mode, step, dim]`, of two numbers a place.
        plans: One<Array>;
        /// What each is worth, `[row, mode]`.
        worth: One<Array>;
        /// What came: data whose targets are sequences of places.
        to: One<Dataset>;
        /// How many plans count; all where there are fewer.
        k: usize, in 1.0..=100_000.0;
        /// The bound.
        bound: f64 = 2.0, in 0.0..;
    }
    rule are_places;
}

/// The rule that what came are places of two numbers.
fn are_places(facts: &Facts<'_>) -> Result<(), Wrong> {
    match form(facts, "to") {
        Some(form) if form.classes.is_some() || !matches!(form.target[..], [_, 2]) => {
            let message = format!("the data are {}, and no plans in the plane", told(&form));
            let help = "give data whose targets are `[steps, 2]`, such as `windows` makes";
            Err(wrong("to")(Misfit::new(message, help)))
        }
        _ => Ok(()),
    }
}

/// A number for each observation, of the distances of its plans, the most worth first.
fn each(
    (plans, worth, to): (&Array, &Array, &Dataset),
    number: impl Fn(&[Displacement]) -> f64,
) -> Result<Array, OpError> {
    let failed = |why: String| OpError::Failed(why);
    let names: Vec<&str> = plans.dims.iter().map(|dim| dim.name.as_str()).collect();
    let (["row", "mode", "step", "dim"], [steps, 2]) = (&names[..], &to.form.target[..]) else {
        let why = format!(
            "plans are by row, mode, step and dim, with targets of two numbers a place; these are by {}, and \
             targets are of {:?}",
            names.join(", "),
            to.form.target
        );
        return Err(failed(why));
    };
    let sizes: Vec<usize> = plans.dims.iter().map(Dim::len).collect();
    if sizes[0] != to.len() || sizes[2] != *steps || sizes[3] != 2 || worth.dims != plans.dims[..2]
    {
        let why = format!(
            "plans {sizes:?} with {} numbers of worth are not those of {} targets of {steps} places",
            worth.values.len(),
            to.len()
        );
        return Err(failed(why));
    }
    let (places, _) = plans.values.as_chunks::<2>();
    let (taken, _) = to.y.as_chunks::<2>();
    let modes = sizes[1];
    let rows = places.chunks_exact(modes * steps).zip(worth.values.chunks_exact(modes));
    let values = rows.zip(taken.chunks_exact(*steps)).map(|((places, worth), taken)| {
        if let Some(mode) = worth.iter().position(|worth| worth.is_nan()) {
            return Err(format!("plan {mode} is worth no number"));
        }
        // Only their order counts.
        let mut order: Vec<usize> = (0..modes).collect();
        order.sort_by(|i, j| worth[*j].total_cmp(&worth[*i]));
        let mut shares = vec![0.0; modes];
        (0..modes).for_each(|rank| shares[order[rank]] = real(modes - rank));
        displacements(places, &shares, taken).map(|modes| number(&modes))
    });
    let values = values.collect::<Result<Vec<f64>, String>>().map_err(failed)?;
    Ok(Array::series(Dim::new("row", Labels::count(to.len())), values))
}

impl Op for MinAde {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        each((&self.plans, &self.worth, &self.to), |modes| min_ade(modes, self.k))
    }
}

impl Op for MinFde {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        each((&self.plans, &self.worth, &self.to), |modes| min_fde(modes, self.k))
    }
}

impl Op for Missed {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        each((&self.plans, &self.worth, &self.to), |modes| {
            f64::from(u8::from(is_miss(modes, self.k, self.bound)))
        })
    }
}

#[cfg(test)]
mod tests {
    use ivx_data::Form;

    use super::*;

    /// Two plans of two places; what came is the second but for its end, which is 3 away.
    #[test]
    fn the_plan_worth_most_counts_first() {
        let dims = [("row", 1), ("mode", 2), ("step", 2), ("dim", 2)];
        let dims = dims.map(|(name, n)| Dim::new(name, Labels::count(n))).to_vec();
        let worth =
            |values: [f64; 2]| One(Array { dims: dims[..2].to_vec(), values: values.to_vec() });
        let values = vec![0.0, 4.0, 0.0, 8.0, 1.0, 0.0, 2.0, 0.0];
        let plans = || One(Array { dims: dims.clone(), values: values.clone() });
        let form = Form { target: vec![2, 2], ..Form::default() };
        let to = || One(Dataset { form: form.clone(), x: vec![0.0], y: vec![1.0, 0.0, 5.0, 0.0] });
        let ctx = Ctx::new("min_ade", 0, None);
        let ade =
            |worth, k| MinAde { plans: plans(), worth, to: to(), k }.run(&ctx).unwrap().values[0];
        let first = f64::midpoint(17.0_f64.sqrt(), 89.0_f64.sqrt());
        // Worths a thousand apart are told apart, too.
        assert_eq!(ade(worth([-1.0, -1001.0]), 1), first);
        assert_eq!(ade(worth([-1.0, -1001.0]), 2), 1.5);
        assert_eq!(ade(worth([-1001.0, -1.0]), 1), 1.5);
        let (k, worth) = (1, || worth([0.0, 1.0]));
        let fde = MinFde { plans: plans(), worth: worth(), to: to(), k }.run(&ctx).unwrap();
        let missed = |bound| Missed { plans: plans(), worth: worth(), to: to(), k, bound };
        assert_eq!((fde.values[0], missed(2.0).run(&ctx).unwrap().values[0]), (3.0, 1.0));
        assert_eq!(missed(3.5).run(&ctx).unwrap().values[0], 0.0);
        let (plans, to) = (worth(), to());
        let why = MinFde { plans, worth: worth(), to, k }.run(&ctx).unwrap_err().to_string();
        assert!(why.starts_with("plans are by row, mode, step and dim"), "{why}");
    }
}
