//! Arrays with named dimensions: what measures are made of.

use serde::{Deserialize, Serialize};

use crate::{Artifact, Data, Gathered, OpError, Shapes, Tensors, label};

/// What stands in the place of a number that could not be computed: not a number, and told from what was computed and is
/// none either.
pub const MISSING: f64 = f64::from_bits(0x7ff8_0000_0000_07a2);

/// Whether a number is [`MISSING`].
#[must_use]
pub fn is_missing(x: f64) -> bool {
    x.to_bits() == MISSING.to_bits()
}

/// Numbers over named dimensions, last dimension fastest. Without dimensions, a scalar.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// The dimensions, outermost first; names are unique.
    pub dims: Vec<Dim>,
    /// One number a coordinate.
    pub values: Vec<f64>,
}

/// One dimension and the labels of its coordinates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Dim {
    /// Its name.
    pub name: String,
    /// Its coordinates.
    pub labels: Labels,
}

/// Most bytes of labels that an array has.
const MOST_OF_LABELS: usize = 95_000_000;

/// The coordinates of a dimension.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Labels {
    /// Numbers, such as the points of a grid.
    Numbers(Vec<f64>),
    /// Names.
    Names(Vec<String>),
}

impl Labels {
    /// `0, …, n − 1`.
    #[must_use]
    pub fn count(n: usize) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "dimensions are far below 2^53")]
        let number = |i| i as f64;
        Self::Numbers((0..n).map(number).collect())
    }

    /// How many coordinates there are.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(xs) => xs.len(),
            Self::Names(names) => names.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The label at `i` as text.
    ///
    /// # Panics
    /// If `i` is out of bounds.
    #[must_use]
    pub fn text(&self, i: usize) -> String {
        match self {
            Self::Numbers(xs) => label(xs[i]),
            Self::Names(names) => names[i].clone(),
        }
    }

    /// How many bytes they take in a file, at most.
    fn written(&self) -> usize {
        match self {
            Self::Numbers(xs) => {
                xs.iter().map(|x| if x.abs() < 1e7 && x.fract() == 0.0 { 11 } else { 26 }).sum()
            }
            Self::Names(names) => names.iter().map(|name| 6 * name.len() + 3).sum(),
        }
    }

    /// The labels at these places, in this order.
    ///
    /// # Panics
    /// If a place is out of bounds.
    #[must_use]
    pub fn pick(&self, places: &[usize]) -> Self {
        match self {
            Self::Numbers(xs) => Self::Numbers(places.iter().map(|&i| xs[i]).collect()),
            Self::Names(names) => Self::Names(places.iter().map(|&i| names[i].clone()).collect()),
        }
    }
}

impl Dim {
    /// A dimension with these coordinates.
    #[must_use]
    pub fn new(name: &str, labels: Labels) -> Self {
        Self { name: name.to_owned(), labels }
    }

    /// How many coordinates it has.
    #[must_use]
    pub fn len(&self) -> usize {
        self.labels.len()
    }

    /// Whether it has none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.labels.is_empty()
    }
}

/// The labels of a place among the values over some dimensions, last one fastest: one for each dimension.
pub fn labels_at<'d>(
    dims: impl IntoIterator<Item = &'d Dim, IntoIter: DoubleEndedIterator>,
    mut place: usize,
) -> Vec<String> {
    let mut labels: Vec<String> = Vec::new();
    for dim in dims.into_iter().rev() {
        labels.push(dim.labels.text(place % dim.len()));
        place /= dim.len();
    }
    labels.reverse();
    labels
}

impl Array {
    /// A number without dimensions.
    #[must_use]
    pub fn scalar(value: f64) -> Self {
        Self { dims: Vec::new(), values: vec![value] }
    }

    /// Numbers over one dimension.
    ///
    /// # Panics
    /// If there are not as many values as coordinates.
    #[must_use]
    pub fn series(dim: Dim, values: Vec<f64>) -> Self {
        assert_eq!(dim.len(), values.len(), "one value a coordinate");
        Self { dims: vec![dim], values }
    }

    /// The numbers at some places of a dimension, in the order of the places.
    ///
    /// # Panics
    /// If there is no such dimension or place.
    #[must_use]
    pub fn picked(&self, d: usize, places: &[usize]) -> Self {
        // The values are blocks of `n` rows of `inner` values; none if another dimension is empty.
        let (n, inner) = (self.dims[d].len(), self.strides()[d]);
        let rows = self.values.chunks((n * inner).max(1)).flat_map(|block| {
            places.iter().flat_map(|&i| block[i * inner..(i + 1) * inner].iter().copied())
        });
        let values = rows.collect();
        let mut dims = self.dims.clone();
        dims[d].labels = dims[d].labels.pick(places);
        Self { dims, values }
    }

    /// Whether it is what stands in the place of an array that could not be computed.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        self.dims.is_empty() && is_missing(self.values[0])
    }

    /// The arrays side by side: the gathered axes outermost, then the dimensions they share. One that is missing has
    /// those of the others.
    ///
    /// # Errors
    /// If the arrays differ in their dimensions, or an axis bears the name of one.
    pub fn stack(gathered: &Gathered<Self>) -> Result<Self, String> {
        let all = &gathered.values;
        let inner = all.iter().find(|array| !array.is_missing()).or(all.first());
        let inner = inner.map_or(&[][..], |array| &array.dims);
        let outer = |dim: &&Dim| gathered.dims.iter().any(|own| own.name == dim.name);
        if let Some(clash) = inner.iter().find(outer) {
            return Err(format!("`{}` is both an axis and a dimension of the value", clash.name));
        }
        let each = inner.iter().map(Dim::len).product();
        let mut values = Vec::new();
        for array in all {
            if array.dims == inner {
                values.extend_from_slice(&array.values);
            } else if array.is_missing() {
                values.extend(std::iter::repeat_n(MISSING, each));
            } else {
                return Err("the values do not share their dimensions".to_owned());
            }
        }
        Ok(Self { dims: [&gathered.dims, inner].concat(), values })
    }

    /// Gives all arrays the dimensions of the widest, where their labels are the first of its; they are no numbers at the
    /// rest. Where they are not, all stay as they are.
    #[must_use]
    pub fn widened(all: Vec<Self>) -> Vec<Self> {
        let mut widest: Option<Vec<Dim>> = None;
        for array in all.iter().filter(|array| !array.is_missing()) {
            let Some(dims) = widest.take() else {
                widest = Some(array.dims.clone());
                continue;
            };
            match wider(dims, &array.dims) {
                Some(dims) => widest = Some(dims),
                None => return all,
            }
        }
        let Some(widest) = widest else { return all };
        let n = widest.iter().map(Dim::len).product();
        let widen = |array: Self| {
            if array.is_missing() || array.dims == widest {
                return array;
            }
            let values = (0..n).map(|place| array.within(&widest, place)).collect();
            Self { dims: widest.clone(), values }
        };
        all.into_iter().map(widen).collect()
    }

    /// The value at a place of wider dimensions, whose first labels are its own; beyond them, not a number.
    fn within(&self, dims: &[Dim], mut place: usize) -> f64 {
        let (mut own, mut stride) = (0, 1);
        for (dim, wide) in self.dims.iter().zip(dims).rev() {
            let i = place % wide.len();
            if i >= dim.len() {
                return f64::NAN;
            }
            own += i * stride;
            stride *= dim.len();
            place /= wide.len();
        }
        self.values[own]
    }

    /// The place of the dimension called `name`.
    #[must_use]
    pub fn dim(&self, name: &str) -> Option<usize> {
        self.dims.iter().position(|dim| dim.name == name)
    }

    /// How far apart neighbours along each dimension lie in `values`.
    #[must_use]
    pub fn strides(&self) -> Vec<usize> {
        let mut strides = vec![1; self.dims.len()];
        for i in (0..self.dims.len().saturating_sub(1)).rev() {
            strides[i] = strides[i + 1] * self.dims[i + 1].len();
        }
        strides
    }
}

impl Artifact for Array {
    const KIND: &'static str = "Array";

    fn encode(&self) -> Vec<u8> {
        let shape = self.dims.iter().map(Dim::len).collect();
        let values = Data::F64(shape, self.values.clone());
        Tensors { arrays: [("values".to_owned(), values)].into() }.encode(Self::KIND, &self.dims)
    }

    /// Labels lie in the head of a file, which has an end.
    fn is_kept(&self) -> Result<(), OpError> {
        if self.dims.iter().map(|dim| dim.labels.written()).sum::<usize>() < MOST_OF_LABELS {
            return Ok(());
        }
        let told = self.dims.iter().map(|dim| format!("{} along `{}`", dim.len(), dim.name));
        let told: Vec<String> = told.collect();
        let why = format!("an array with {} has more labels than are kept", told.join(" and "));
        Err(OpError::Failed(why))
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, dims) = Tensors::decode::<Vec<Dim>>(Self::KIND, bytes)?;
        let (shape, values) = tensors.f64("values")?;
        (shape == dims.iter().map(Dim::len).collect::<Vec<_>>()).then_some(Self { dims, values })
    }

    fn later(_: &Shapes) -> Option<Self> {
        Some(Self::scalar(f64::NAN))
    }
}

/// Dimensions of which both are the first labels, if there are.
fn wider(dims: Vec<Dim>, others: &[Dim]) -> Option<Vec<Dim>> {
    let are_alike = |(dim, other): (&Dim, &Dim)| {
        let first: Vec<usize> = (0..dim.len().min(other.len())).collect();
        dim.name == other.name && dim.labels.pick(&first) == other.labels.pick(&first)
    };
    if dims.len() != others.len() || !dims.iter().zip(others).all(are_alike) {
        return None;
    }
    let pairs = dims.into_iter().zip(others);
    Some(
        pairs
            .map(|(dim, other)| if dim.len() < other.len() { other.clone() } else { dim })
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_room_for_its_labels_is_not_kept() {
        let of = |n: usize| Array { dims: vec![Dim::new("row", Labels::count(n))], values: vec![] };
        assert_eq!(of(1_000_000).is_kept(), Ok(()));
        let why = of(9_000_000).is_kept().unwrap_err().to_string();
        assert_eq!(why, "an array with 9000000 along `row` has more labels than are kept");
    }

    #[test]
    fn stacking_puts_the_axis_outside() {
        let x = Dim::new("x", Labels::Numbers(vec![0.0, 0.5]));
        let ke = Dim::new("ke", Labels::Names(vec!["WCM".into(), "MA".into()]));
        let rows = [vec![1.0, 2.0], vec![3.0, 4.0]];
        let values = rows.map(|row| Array::series(x.clone(), row)).to_vec();
        let stacked =
            Array::stack(&Gathered { dims: vec![ke.clone()], values, name: String::new() });
        let stacked = stacked.expect("the rows share `x`");
        assert_eq!(stacked, Array { dims: vec![ke, x], values: vec![1.0, 2.0, 3.0, 4.0] });
        assert_eq!(stacked.strides(), [2, 1]);
        assert_eq!(Array::decode(&stacked.encode()), Some(stacked));
    }

    #[test]
    fn what_is_narrower_is_no_number_where_others_go_on() {
        let d = Dim::new("d", Labels::Numbers(vec![1.0, 2.0]));
        let dims = |n: usize, m: usize| {
            vec![Dim::new("whose", Labels::count(n)), Dim::new("x", Labels::count(m))]
        };
        let array = |n, m, values: &[f64]| Array { dims: dims(n, m), values: values.to_vec() };
        let stack = |values: Vec<Array>| {
            let values = Array::widened(values);
            Array::stack(&Gathered { dims: vec![d.clone()], values, name: String::new() })
        };
        let both = stack(vec![array(2, 1, &[1.0, 2.0]), array(1, 3, &[3.0, 4.0, 5.0])]).unwrap();
        assert_eq!(both.dims[1..], dims(2, 3)[..]);
        let n = f64::NAN;
        let expected = [1.0, n, n, 2.0, n, n, 3.0, 4.0, 5.0, n, n, n];
        assert!(both.values.iter().zip(expected).all(|(x, y)| x.to_bits() == y.to_bits()));
        // Other labels are other things.
        let mut other = array(1, 2, &[1.0, 2.0]);
        other.dims[1].labels = Labels::Numbers(vec![1.0, 2.0]);
        assert!(stack(vec![array(1, 2, &[1.0, 2.0]), other]).is_err());
    }

    #[test]
    fn what_is_missing_has_the_dimensions_of_the_rest() {
        let x = Dim::new("x", Labels::Numbers(vec![0.0, 0.5]));
        let ke = Dim::new("ke", Labels::Names(vec!["WCM".into(), "MA".into()]));
        let missing = Array::decode(&Array::scalar(MISSING).encode()).expect("it is one");
        let stack = |values: Vec<Array>| {
            Array::stack(&Gathered { dims: vec![ke.clone()], values, name: String::new() }).unwrap()
        };
        let some = stack(vec![missing.clone(), Array::series(x.clone(), vec![1.0, f64::NAN])]);
        assert_eq!(some.dims, [ke.clone(), x]);
        let told: Vec<bool> = some.values.iter().map(|x| is_missing(*x)).collect();
        assert_eq!(told, [true, true, false, false]);
        assert!(stack(vec![missing.clone(), missing]).values.iter().all(|x| is_missing(*x)));
    }

    #[test]
    fn a_scalar_survives_the_round_trip() {
        let scalar = Array::scalar(-0.5);
        assert_eq!(Array::decode(&scalar.encode()), Some(scalar));
    }
}
