//! Reductions: many numbers along named dimensions become one.

use ivx_math::{moments, order};
use ivx_op::{Array, AxisNames, Ctx, GroupBy, MISSING, Named, Op, OpError, declare, is_missing};

/// The axis of replications.
pub(super) const SEED: &str = "seed";

macro_rules! reductions {
    ($($(#[doc = $doc:literal])+ $ty:ident = $name:literal @ $version:literal by $function:path;)+) => {
        /// The reduction of this name.
        pub(super) fn named(name: &str) -> Option<fn(&[f64]) -> f64> {
            match name {
                $($name => Some($function),)+
                _ => None,
            }
        }
    $(
        declare! {
            $(#[doc = $doc])+
            pub struct $ty = $name @ $version -> Array [reduce x] {
                /// What to reduce.
                x: Named<Array>;
                /// The axes and dimensions that vanish.
                over: AxisNames;
                /// The field of an axis that vanishes, as in `task.scene`: one result for each of its values.
                by: GroupBy = Vec::<i64>::new();
                /// Whether it is made of what is there where some of it is missing, because a node failed.
                skip_missing: bool = false;
            }
        }

        impl Op for $ty {
            fn run(&self, _: &Ctx) -> Result<Array, OpError> {
                let x = Array::stack(&self.x.0).map_err(OpError::Failed)?;
                reduce_rest(&x, (&self.over.0, self.skip_missing), $function)
            }
        }
    )+};
}

reductions! {
    /// The arithmetic mean: the exact sum over the number of values, and never outside them.
    Mean = "mean" @ 2 by moments::mean;
    /// The sum of the numbers, exact and rounded once.
    Sum = "sum" @ 2 by moments::sum;
    /// The share of coordinates at which a condition is true: `share(a < b, over: seed)`.
    Share = "share" @ 2 by moments::mean;
    /// The median: infinite between a number and an infinity.
    Median = "median" @ 2 by order::median;
    /// The interquartile mean: the mean without the lowest and the highest quarter, rounded down.
    Iqm = "iqm" @ 2 by order::iqm;
    /// The population standard deviation: 0 of equal numbers, NaN of what is not finite.
    Std = "std" @ 2 by moments::std;
    /// The standard error of the mean, from the sample standard deviation; NaN of one value.
    Stderr = "stderr" @ 2 by moments::stderr;
    /// The smallest number.
    Min = "min" @ 1 by order::min;
    /// The largest number.
    Max = "max" @ 1 by order::max;
}

/// The array without the dimensions in `over`; `join` is given what lay along them, in the order
/// of the values.
///
/// # Errors
/// If there is no such dimension, or nothing along it.
pub(super) fn reduce(
    x: &Array,
    over: &[String],
    join: impl Fn(&[f64]) -> f64,
) -> Result<Array, OpError> {
    let groups = Groups::of(x, over)?;
    let values = groups.starts.iter().map(|start| join(&groups.gather(x, *start))).collect();
    Ok(Array { dims: groups.kept.iter().map(|&d| x.dims[d].clone()).collect(), values })
}

/// The same, of what is there if `skips`: what is made of nothing is missing, and otherwise what is made of something
/// missing.
///
/// # Errors
/// If there is no such dimension, or nothing along it.
pub(super) fn reduce_rest(
    x: &Array,
    (over, skips): (&[String], bool),
    join: impl Fn(&[f64]) -> f64,
) -> Result<Array, OpError> {
    reduce(x, over, |values| {
        if !values.iter().any(|x| is_missing(*x)) {
            return join(values);
        }
        let rest: Vec<f64> = values.iter().copied().filter(|x| !is_missing(*x)).collect();
        if skips && !rest.is_empty() { join(&rest) } else { MISSING }
    })
}

/// How the values of an array fall into groups, one for each coordinate that is kept.
pub(super) struct Groups {
    /// The dimensions kept.
    pub(super) kept: Vec<usize>,
    /// Where each group starts in the values.
    pub(super) starts: Vec<usize>,
    /// Where its values lie from there.
    pub(super) offsets: Vec<usize>,
}

impl Groups {
    /// The groups that vanish along `over`.
    pub(super) fn of(x: &Array, over: &[String]) -> Result<Self, OpError> {
        if let Some(name) = over.iter().find(|name| x.dim(name).is_none()) {
            let names: Vec<String> = x.dims.iter().map(|d| format!("`{}`", d.name)).collect();
            let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            return Err(OpError::Failed(format!(
                "there is no dimension `{name}` to reduce over; there are: {names}"
            )));
        }
        let (gone, kept): (Vec<usize>, Vec<usize>) =
            (0..x.dims.len()).partition(|&d| over.contains(&x.dims[d].name));
        let (starts, offsets) = (places(x, &kept), places(x, &gone));
        if offsets.is_empty() {
            return Err(OpError::Failed(format!("there is nothing over `{}`", over.join("`, `"))));
        }
        Ok(Self { kept, starts, offsets })
    }

    /// The values of the group that starts at `start`.
    pub(super) fn gather(&self, x: &Array, start: usize) -> Vec<f64> {
        self.offsets.iter().map(|offset| x.values[start + offset]).collect()
    }
}

/// The distances from the first value to each coordinate of some dimensions, last one fastest.
fn places(x: &Array, dims: &[usize]) -> Vec<usize> {
    let strides = x.strides();
    dims.iter().fold(vec![0], |places, &d| {
        let along = |place: usize| (0..x.dims[d].len()).map(move |i| (place, i));
        places.into_iter().flat_map(along).map(|(place, i)| place + i * strides[d]).collect()
    })
}

#[cfg(test)]
mod tests {
    use ivx_op::{Dim, Gathered, Labels};

    use super::*;

    const CTX: Ctx = Ctx::new("", 0, None);

    fn dim(name: &str, n: u32) -> Dim {
        Dim::new(name, Labels::Numbers((0..n).map(f64::from).collect()))
    }

    /// Over the gathered axis `#0` of three: [0, 1], [10, 11], [26, 27] over `x`.
    fn gathered() -> Named<Array> {
        let row = |start: f64| Array::series(dim("x", 2), vec![start, start + 1.0]);
        let values = vec![row(0.0), row(10.0), row(26.0)];
        Named(Gathered { dims: vec![dim("#0", 3)], values, name: String::new() })
    }

    fn over(names: &[&str]) -> AxisNames {
        AxisNames(names.iter().map(|&name| name.to_owned()).collect())
    }

    #[test]
    fn an_axis_a_dimension_or_both_vanish() {
        let mean = |names: &[&str]| {
            Mean { x: gathered(), over: over(names), by: GroupBy, skip_missing: false }
                .run(&CTX)
                .unwrap()
        };
        assert_eq!(mean(&["#0"]), Array::series(dim("x", 2), vec![12.0, 13.0]));
        assert_eq!(mean(&["x"]), Array::series(dim("#0", 3), vec![0.5, 10.5, 26.5]));
        assert_eq!(mean(&["x", "#0"]), Array::scalar(12.5));
        assert_eq!(mean(&[]).values, [0.0, 1.0, 10.0, 11.0, 26.0, 27.0]);
    }

    #[test]
    fn each_reduction_is_its_own() {
        let (x, over) = (gathered, || over(&["#0"]));
        assert_eq!(
            Median { x: x(), over: over(), by: GroupBy, skip_missing: false }
                .run(&CTX)
                .unwrap()
                .values,
            [10.0, 11.0]
        );
        assert_eq!(
            Min { x: x(), over: over(), by: GroupBy, skip_missing: false }
                .run(&CTX)
                .unwrap()
                .values,
            [0.0, 1.0]
        );
        assert_eq!(
            Max { x: x(), over: over(), by: GroupBy, skip_missing: false }
                .run(&CTX)
                .unwrap()
                .values,
            [26.0, 27.0]
        );
        assert_eq!(
            Iqm { x: x(), over: over(), by: GroupBy, skip_missing: false }
                .run(&CTX)
                .unwrap()
                .values,
            [12.0, 13.0]
        );
        // Deviations −12, −2, 14: squares sum to 344.
        let std = Std { x: x(), over: over(), by: GroupBy, skip_missing: false }
            .run(&CTX)
            .unwrap()
            .values;
        assert!((std[0] - (344.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        let stderr = Stderr { x: x(), over: over(), by: GroupBy, skip_missing: false }
            .run(&CTX)
            .unwrap()
            .values;
        assert!((stderr[1] - (344.0_f64 / 6.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_reduced_is_explained() {
        let message = |x: Named<Array>, names: &[&str]| {
            Mean { x, over: over(names), by: GroupBy, skip_missing: false }
                .run(&CTX)
                .unwrap_err()
                .to_string()
        };
        let unknown = "there is no dimension `y` to reduce over; there are: `#0`, `x`";
        assert_eq!(message(gathered(), &["y"]), unknown);
        let empty = Gathered { dims: vec![dim("#0", 0)], values: vec![], name: String::new() };
        assert_eq!(message(Named(empty), &["#0"]), "there is nothing over `#0`");
    }
}
