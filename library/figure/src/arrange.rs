//! How a gathered value is laid out for a figure: which dimension plays which role.

use ivx_data::{END, ENDS};
use ivx_op::{Array, Dim, Everything, Facts, Labels, OpError, Wrong};

use super::interval::{Estimate, Lacks, interval_of_rest};

/// The axis of replications, over which figures show the mean and its interval.
const SEED: &str = "seed";

/// A value in cells: first the outer dimensions, then the rest, then the inner ones.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Arranged {
    /// What the spec calls the value.
    pub(super) name: String,
    /// The dimensions asked for outside, in the order asked for.
    pub(super) outer: Vec<Dim>,
    /// The dimensions nobody asked for.
    pub(super) rest: Vec<Dim>,
    /// The dimensions asked for inside.
    pub(super) inner: Vec<Dim>,
    /// Whether each cell is the mean over seeds, or another number with an interval.
    pub(super) over_seed: bool,
    /// One estimate a coordinate, last dimension fastest.
    pub(super) cells: Vec<Estimate>,
}

/// The value with `outer` dimensions outermost and `inner` ones innermost.
///
/// `seed` is reduced to a mean and an interval, unless it is asked for.
///
/// - `skips`: whether a mean is made of the rest where some are missing.
///
/// # Errors
/// If a name is unknown or given twice, or a dimension has no labels.
pub(super) fn arrange(
    value: &Everything<Array>,
    (outer, inner): (&[String], &[String]),
    skips: bool,
) -> Result<Arranged, OpError> {
    let name = &value.0.name;
    let array = Array::stack(&value.0).map_err(OpError::Failed)?;
    if let Some(empty) = array.dims.iter().find(|dim| dim.is_empty()) {
        return Err(OpError::Failed(format!("`{}` has no labels, so nothing to show", empty.name)));
    }
    let outer = places(&array, name, outer)?;
    let inner = places(&array, name, inner)?;
    if let Some(&twice) = inner.iter().find(|d| outer.contains(d)) {
        return Err(given_twice(&array.dims[twice].name));
    }
    let named = |d: &usize| outer.contains(d) || inner.contains(d);
    let own = |name: &str| array.dim(name).filter(|d| !named(d));
    // A number that brings its interval along needs none of seeds.
    let is_end = |d: &usize| {
        (0..3).all(|i| array.dims[*d].len() == 3 && array.dims[*d].labels.text(i) == ENDS[i])
    };
    let ends = own(END).filter(is_end);
    let seed = if ends.is_some() { ends } else { own(SEED) };
    let rest: Vec<usize> =
        (0..array.dims.len()).filter(|d| !named(d) && Some(*d) != seed).collect();

    let order: Vec<usize> = outer.iter().chain(&rest).chain(&inner).copied().chain(seed).collect();
    let values = transpose(&array, &order);
    let n_seeds = seed.map_or(1, |d| array.dims[d].len());
    let dims = |places: &[usize]| places.iter().map(|&d| array.dims[d].clone()).collect();
    Ok(Arranged {
        name: name.clone(),
        outer: dims(&outer),
        rest: dims(&rest),
        inner: dims(&inner),
        over_seed: seed.is_some(),
        cells: if ends.is_some() {
            let cell = |ends: &[f64]| match ends {
                [mean, low, high] if !ivx_op::is_missing(*mean) => {
                    Estimate { mean: *mean, interval: Some((*low, *high)), ..Estimate::default() }
                }
                ends => interval_of_rest(&ends[..1], skips),
            };
            values.chunks(n_seeds).map(cell).collect()
        } else {
            values.chunks(n_seeds).map(|seeds| interval_of_rest(seeds, skips)).collect()
        },
    })
}

/// All values, seeds among them, at each label of some dimensions.
///
/// # Errors
/// If a name is unknown or given twice.
pub(super) fn sorted(
    value: &Everything<Array>,
    outer: &[String],
) -> Result<(Vec<Dim>, Vec<Vec<f64>>), OpError> {
    if outer.is_empty() {
        // They need not have their dimensions in common.
        let all = value.0.values.iter().flat_map(|array| array.values.clone());
        return Ok((Vec::new(), vec![all.collect()]));
    }
    let array = Array::stack(&value.0).map_err(OpError::Failed)?;
    let outer = places(&array, &value.0.name, outer)?;
    let rest = (0..array.dims.len()).filter(|d| !outer.contains(d));
    let order: Vec<usize> = outer.iter().copied().chain(rest).collect();
    let dims: Vec<Dim> = outer.iter().map(|&d| array.dims[d].clone()).collect();
    let n: usize = dims.iter().map(Dim::len).product();
    let values = transpose(&array, &order);
    let each = values.len().checked_div(n).unwrap_or(0).max(1);
    Ok((dims, values.chunks(each).map(<[f64]>::to_vec).collect()))
}

impl Arranged {
    /// How many of its values are missing.
    pub(super) fn lacks(&self) -> Lacks {
        self.cells.iter().map(|cell| cell.lacks).sum()
    }

    /// The same, provided that at most `n` dimensions were left over.
    ///
    /// # Errors
    /// If there were more; the message says how to be rid of one.
    pub(super) fn at_most(self, n: usize, remedy: &str) -> Result<Self, OpError> {
        let Some(dim) = self.rest.get(n) else { return Ok(self) };
        let (name, help) = (called(&self.name), rid_of(&dim.name, remedy));
        Err(OpError::Failed(format!("{name} also varies over `{}`: {help}", dim.name)))
    }
}

/// The rule that at most `n` dimensions of a value are left over, where these arguments name the others.
pub(super) fn left_over(
    facts: &Facts<'_>,
    value: &'static str,
    named: &[&str],
    n: usize,
    remedy: &str,
) -> Result<(), Wrong> {
    left_over_but("", facts, value, (named, n), remedy)
}

/// The same, but for an axis that has a place of its own.
pub(super) fn left_over_but(
    spared: &str,
    facts: &Facts<'_>,
    value: &'static str,
    (named, n): (&[&str], usize),
    remedy: &str,
) -> Result<(), Wrong> {
    let named = named.iter().flat_map(|arg| facts.arg::<Vec<String>>(arg).unwrap_or_default());
    let named: Vec<String> = named.collect();
    for over in facts.over.get(value).into_iter().flatten() {
        let spared = |name: &str| name == SEED || name == END || name == spared;
        let mut rest = over.iter().filter(|name| !spared(name) && !named.contains(name));
        if let Some(name) = rest.nth(n) {
            let message = format!("`{value}` also varies over `{name}`");
            return Err(Wrong { arg: value, message, help: rid_of(name, remedy) });
        }
    }
    Ok(())
}

/// How to be rid of a dimension.
fn rid_of(dim: &str, remedy: &str) -> String {
    format!("{remedy}, reduce it with `mean(.., over: {dim})`, or select one label")
}

/// One text a coordinate of the product of dimensions, last fastest; one empty text for none.
pub(super) fn labels(dims: &[Dim]) -> Vec<String> {
    texts(dims, |dim, i| dim.labels.text(i))
}

/// As [`labels`], with the names of the dimensions: `n = 5, ke = WCM`.
pub(super) fn coordinates(dims: &[Dim]) -> Vec<String> {
    texts(dims, |dim, i| format!("{} = {}", dim.name, dim.labels.text(i)))
}

pub(super) fn texts(dims: &[Dim], text: impl Fn(&Dim, usize) -> String) -> Vec<String> {
    dims.iter().fold(vec![String::new()], |heads, dim| {
        let pair = |head: &String, i| match head.as_str() {
            "" => text(dim, i),
            _ => format!("{head}, {}", text(dim, i)),
        };
        heads
            .iter()
            .flat_map(|head| (0..dim.len()).map(move |i| (head, i)))
            .map(|(h, i)| pair(h, i))
            .collect()
    })
}

/// The names of the dimensions, for an axis label.
pub(super) fn names(dims: &[Dim]) -> String {
    dims.iter().map(|dim| dim.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// The labels of the one dimension that names a numeric axis.
///
/// # Errors
/// If there is not exactly one, or its labels are not numbers.
pub(super) fn numbers(dims: &[Dim]) -> Result<Vec<f64>, OpError> {
    let [dim] = dims else {
        return Err(OpError::Failed(format!("`x` takes one axis, found {}", dims.len())));
    };
    let parsed = match &dim.labels {
        Labels::Numbers(xs) => Some(xs.clone()),
        Labels::Names(names) => names.iter().map(|name| name.parse().ok()).collect(),
    };
    parsed.ok_or_else(|| {
        let message = format!("the labels of `{}` are not numbers: show it with `bars`", dim.name);
        OpError::Failed(message)
    })
}

/// The value's name for a message.
pub(super) fn called(name: &str) -> String {
    if name.is_empty() { "the value".to_owned() } else { format!("`{name}`") }
}

fn places(array: &Array, name: &str, wanted: &[String]) -> Result<Vec<usize>, OpError> {
    let mut places = Vec::new();
    for axis in wanted {
        let place = array.dim(axis).ok_or_else(|| unknown(array, name, axis))?;
        if places.contains(&place) {
            return Err(given_twice(axis));
        }
        places.push(place);
    }
    Ok(places)
}

fn unknown(array: &Array, name: &str, axis: &str) -> OpError {
    let has: Vec<String> = array.dims.iter().map(|dim| format!("`{}`", dim.name)).collect();
    let has = if has.is_empty() { "nothing".to_owned() } else { has.join(", ") };
    OpError::Failed(format!("{} does not vary over `{axis}`; it varies over {has}", called(name)))
}

fn given_twice(axis: &str) -> OpError {
    OpError::Failed(format!("`{axis}` is given twice"))
}

/// The values with the dimensions in this order; `order` is a permutation.
fn transpose(array: &Array, order: &[usize]) -> Vec<f64> {
    let strides = array.strides();
    order
        .iter()
        .fold(vec![0], |starts: Vec<usize>, &d| {
            let steps = (0..array.dims[d].len()).map(|i| i * strides[d]);
            let steps: Vec<usize> = steps.collect();
            starts.iter().flat_map(|start| steps.iter().map(move |step| start + step)).collect()
        })
        .into_iter()
        .map(|i| array.values[i])
        .collect()
}

#[cfg(test)]
pub(super) mod tests {
    use ivx_op::Gathered;

    use super::*;

    /// A value called `y` over axes of names, with seeds and numbers told by their spelling.
    pub(crate) fn value(dims: &[(&str, &[&str])], values: &[f64]) -> Everything<Array> {
        let dims = dims.iter().map(|(name, labels)| {
            let numbers: Option<Vec<f64>> = labels.iter().map(|l| l.parse().ok()).collect();
            let names = || labels.iter().map(ToString::to_string).collect();
            Dim::new(name, numbers.map_or_else(|| Labels::Names(names()), Labels::Numbers))
        });
        Everything(Gathered {
            dims: dims.collect(),
            values: values.iter().copied().map(Array::scalar).collect(),
            name: "y".to_owned(),
        })
    }

    pub(crate) fn axes(names: &[&str]) -> ivx_op::AxisNames {
        ivx_op::AxisNames(names.iter().map(ToString::to_string).collect())
    }

    #[test]
    fn dimensions_move_to_their_roles() {
        // seed × x × ke, as 100·seed + 10·x + ke.
        let values = [0.0, 1.0, 10.0, 11.0, 100.0, 101.0, 110.0, 111.0];
        let y = value(&[("seed", &["0", "1"]), ("x", &["0", "1"]), ("ke", &["a", "b"])], &values);
        let found = arrange(&y, (&["ke".into()], &["x".into()]), false).unwrap();
        let means: Vec<f64> = found.cells.iter().map(|cell| cell.mean).collect();
        assert_eq!(means, [50.0, 60.0, 51.0, 61.0]);
        assert!(found.over_seed && found.rest.is_empty());

        let by_seed = arrange(&y, (&["seed".into(), "ke".into()], &[]), false).unwrap();
        assert!(!by_seed.over_seed);
        assert_eq!(labels(&by_seed.outer), ["0, a", "0, b", "1, a", "1, b"]);
        assert_eq!(by_seed.rest[0].name, "x");
        assert_eq!(by_seed.cells[2].mean, 1.0);
    }

    #[test]
    fn mistakes_are_named() {
        let check = |y: &Everything<Array>, outer: &[&str], expected: &str| {
            let outer: Vec<String> = outer.iter().map(ToString::to_string).collect();
            let found = arrange(y, (&outer, &[]), false)
                .and_then(|all| all.at_most(0, "name it in `rows`"));
            assert_eq!(found.unwrap_err().to_string(), expected);
        };
        let y = value(&[("ke", &["a"]), ("seed", &["0"])], &[1.0]);
        check(&y, &["kee"], "`y` does not vary over `kee`; it varies over `ke`, `seed`");
        check(&value(&[], &[1.0]), &["ke"], "`y` does not vary over `ke`; it varies over nothing");
        check(&y, &["ke", "ke"], "`ke` is given twice");
        check(
            &y,
            &[],
            "`y` also varies over `ke`: name it in `rows`, reduce it with `mean(.., over: ke)`, \
             or select one label",
        );
        check(&value(&[("seed", &[])], &[]), &[], "`seed` has no labels, so nothing to show");
    }

    #[test]
    fn numeric_axes_need_numbers() {
        let names = Dim::new("ke", Labels::Names(vec!["a".into()]));
        let spelt = Dim::new("n", Labels::Names(vec!["8".into(), "16".into()]));
        assert_eq!(numbers(&[spelt]).unwrap(), [8.0, 16.0]);
        let found = numbers(&[names]).unwrap_err().to_string();
        assert_eq!(found, "the labels of `ke` are not numbers: show it with `bars`");
        assert_eq!(numbers(&[]).unwrap_err().to_string(), "`x` takes one axis, found 0");
    }
}
