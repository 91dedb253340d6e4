//! Two arrays as one, matched by the names of their dimensions.

use ivx_op::{Array, Dim, MISSING, OpError, is_missing};

use super::resample::RESAMPLE;

/// `join` of the two numbers at every coordinate of either array: the dimensions of the left one,
/// then those only the right one has.
///
/// # Errors
/// If a dimension of both has different labels.
pub(super) fn broadcast(
    left: &Array,
    right: &Array,
    join: impl Fn(f64, f64) -> f64,
) -> Result<Array, OpError> {
    for dim in &left.dims {
        let other = right.dims.iter().find(|other| other.name == dim.name && *other != dim);
        if let Some(other) = other {
            return Err(OpError::Failed(apart(dim, other)));
        }
    }
    let added = right.dims.iter().filter(|dim| left.dim(&dim.name).is_none());
    let dims: Vec<Dim> = left.dims.iter().chain(added).cloned().collect();
    let (lefts, rights) = (spread(left, &dims), spread(right, &dims));
    let values = lefts.iter().zip(&rights).map(|(&l, &r)| {
        let (l, r) = (left.values[l], right.values[r]);
        or_missing(join(l, r), &[l, r])
    });
    Ok(Array { values: values.collect(), dims })
}

/// Why two dimensions of one name are not the same.
fn apart(left: &Dim, right: &Dim) -> String {
    if left.name == RESAMPLE {
        return "the two sides rest on different seeds".to_owned();
    }
    let texts = |dim: &Dim| (0..dim.len()).map(|i| dim.labels.text(i)).collect::<Vec<_>>();
    let (here, there) = (texts(left), texts(right));
    let (n, other) = (here.len(), there.len());
    let first = here.iter().zip(&there).enumerate().find(|(_, (here, there))| here != there);
    let why = match first {
        Some((i, (here, there))) => format!("`{here}` and `{there}` at place {}", i + 1),
        None if n != other => format!("{n} and {other} places"),
        None => "numbers and texts".to_owned(),
    };
    let sorted = |mut texts: Vec<String>| {
        texts.sort_unstable();
        texts
    };
    let name = &left.name;
    let same = if n == other && first.is_some() && sorted(here) == sorted(there) {
        format!("; they are the same in another order, and `[{name}: [..]]` puts them in one")
    } else {
        String::new()
    };
    format!("the two sides have different labels along `{name}`: {why}{same}")
}

/// What is made of some numbers: missing, if it is not a number and one of these is missing.
pub(super) fn or_missing(made: f64, of: &[f64]) -> f64 {
    if made.is_nan() && of.iter().any(|x| is_missing(*x)) { MISSING } else { made }
}

/// The place in `x.values` of every coordinate of `dims`, last dimension fastest.
fn spread(x: &Array, dims: &[Dim]) -> Vec<usize> {
    let strides = x.strides();
    dims.iter().fold(vec![0], |places, dim| {
        let stride = x.dim(&dim.name).map_or(0, |d| strides[d]);
        let along = |place: usize| (0..dim.len()).map(move |i| place + i * stride);
        places.into_iter().flat_map(along).collect()
    })
}

#[cfg(test)]
mod tests {
    use ivx_op::Labels;

    use super::*;

    fn dim(name: &str, labels: &[&str]) -> Dim {
        Dim::new(name, Labels::Names(labels.iter().map(|&label| label.to_owned()).collect()))
    }

    #[test]
    fn dimensions_are_matched_by_name() {
        let (ke, seed) = (dim("ke", &["a", "b"]), dim("seed", &["0", "1", "2"]));
        let left = Array {
            dims: vec![ke.clone(), seed.clone()],
            values: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        };
        // The other order: seed outermost.
        let right = Array {
            dims: vec![seed.clone(), ke.clone()],
            values: vec![10.0, 40.0, 20.0, 50.0, 30.0, 60.0],
        };
        let sum = broadcast(&left, &right, |l, r| l + r).unwrap();
        assert_eq!(sum, Array { values: vec![11.0, 22.0, 33.0, 44.0, 55.0, 66.0], ..left.clone() });

        let by_ke = Array::series(ke.clone(), vec![100.0, 200.0]);
        let difference = broadcast(&by_ke, &left, |l, r| l - r).unwrap();
        assert_eq!(difference.dims, [ke, seed]);
        assert_eq!(difference.values, [99.0, 98.0, 97.0, 196.0, 195.0, 194.0]);
    }

    #[test]
    fn new_dimensions_come_last_and_scalars_go_with_anything() {
        let rows = Array::series(dim("a", &["x", "y"]), vec![1.0, 2.0]);
        let columns = Array::series(dim("b", &["u", "v"]), vec![10.0, 20.0]);
        let table = broadcast(&rows, &columns, |l, r| l + r).unwrap();
        assert_eq!(table.values, [11.0, 21.0, 12.0, 22.0]);
        assert_eq!(broadcast(&Array::scalar(3.0), &rows, |l, r| l * r).unwrap().values, [3.0, 6.0]);
    }

    #[test]
    fn unequal_labels_are_refused() {
        let left = Array::series(dim("a", &["x", "y"]), vec![1.0, 2.0]);
        let check = |right: Dim, why: &str| {
            let right = Array::series(right.clone(), vec![0.0; right.len()]);
            let message = broadcast(&left, &right, |l, r| l + r).unwrap_err().to_string();
            assert_eq!(message, format!("the two sides have different labels along `a`: {why}"));
        };
        check(dim("a", &["x", "z"]), "`y` and `z` at place 2");
        check(
            dim("a", &["y", "x"]),
            "`x` and `y` at place 1; they are the same in another order, and `[a: [..]]` puts them in one",
        );
        check(dim("a", &["x", "y", "z"]), "2 and 3 places");
        let numbers = broadcast(
            &Array::series(dim("a", &["0", "1"]), vec![0.0; 2]),
            &Array::series(Dim::new("a", Labels::count(2)), vec![0.0; 2]),
            |l, r| l + r,
        );
        assert!(numbers.unwrap_err().to_string().ends_with("`a`: numbers and texts"));
    }
}
