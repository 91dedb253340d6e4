//! Observations: inputs and what was seen for each.

use ivx_op::{Artifact, Data, Shapes, Tensors};
use serde::{Deserialize, Serialize};

/// Observations, each an input and a target of the same shapes.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Dataset {
    /// What the inputs and targets are.
    pub form: Form,
    /// Inputs, one after the other, in the order drawn.
    pub x: Vec<f64>,
    /// Targets, as many.
    pub y: Vec<f64>,
}

/// What one observation is. The default is a pair of numbers.
#[derive(Clone, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Form {
    /// The shape of an input: none for a number, `[length]` for a vector, `[steps, length]` for a
    /// sequence, `[channels, rows, columns]` for an image.
    pub input: Vec<usize>,
    /// How many numbers stand behind those of that shape, such as a speed beside an image.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub beside: usize,
    /// The shape of a target.
    pub target: Vec<usize>,
    /// How many classes there are, where targets are indices of classes.
    pub classes: Option<usize>,
    /// What they are called.
    #[serde(default, skip_serializing_if = "Names::are_none")]
    pub names: Names,
}

/// What numbers and classes of observations are called, so that those of one file are not taken for those of another;
/// nothing where they have no names.
#[derive(Clone, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Names {
    /// The numbers of an input, in order.
    pub inputs: Vec<String>,
    /// The classes, in order.
    pub classes: Vec<String>,
}

impl Names {
    /// Whether nothing has a name.
    #[must_use]
    pub fn are_none(&self) -> bool {
        self.inputs.is_empty() && self.classes.is_empty()
    }
}

impl Form {
    /// What the checker knows of it: the shapes of `x` and `y`, and the number of `classes`.
    #[must_use]
    pub fn shapes(&self) -> Shapes {
        let mut shapes = Shapes::from([
            ("x".to_owned(), self.input.clone()),
            ("y".to_owned(), self.target.clone()),
        ]);
        shapes.extend(self.classes.map(|n| ("classes".to_owned(), vec![n])));
        if self.beside > 0 {
            shapes.insert(BESIDE.to_owned(), vec![self.beside]);
        }
        shapes
    }

    /// What is observed, from what the checker knows of it.
    #[must_use]
    pub fn of(shapes: &Shapes) -> Option<Self> {
        let number = |name| match shapes.get(name).map(Vec::as_slice) {
            None => Some(None),
            Some([n]) => Some(Some(*n)),
            Some(_) => None,
        };
        let (classes, beside) = (number("classes")?, number(BESIDE)?.unwrap_or(0));
        let (input, target) = (shapes.get("x")?.clone(), shapes.get("y")?.clone());
        Some(Self { input, beside, target, classes, ..Self::default() })
    }

    /// Whether observations are pairs of numbers.
    #[must_use]
    pub fn is_pairs(&self) -> bool {
        self.input_len() == 1
            && self.input.is_empty()
            && self.target.is_empty()
            && self.classes.is_none()
    }

    /// How many numbers an input has, with those beside.
    #[must_use]
    pub fn input_len(&self) -> usize {
        self.input.iter().product::<usize>() + self.beside
    }

    /// How many numbers a target has.
    #[must_use]
    pub fn target_len(&self) -> usize {
        self.target.iter().product()
    }
}

impl Dataset {
    /// Pairs of numbers.
    #[must_use]
    pub fn pairs(x: Vec<f64>, y: Vec<f64>) -> Self {
        Self { form: Form::default(), x, y }
    }

    /// How many observations there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.y.len() / self.form.target_len().max(1)
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The observations at these places, repetitions included.
    ///
    /// # Panics
    /// If a place is out of bounds.
    #[must_use]
    pub fn pick(&self, places: &[usize]) -> Self {
        let rows = |values: &[f64], width: usize| {
            places.iter().flat_map(|&i| values[i * width..][..width].to_vec()).collect()
        };
        Self {
            x: rows(&self.x, self.form.input_len()),
            y: rows(&self.y, self.form.target_len()),
            form: self.form.clone(),
        }
    }
}

/// What the array of names is called.
const NAMES: &str = "names";

/// What the array of numbers beside inputs is called.
const BESIDE: &str = "beside";

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
fn is_zero(n: &usize) -> bool {
    *n == 0
}

/// Numbers as bytes, if all of them are.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "only whole bytes are kept"
)]
fn bytes(numbers: &[f64]) -> Option<Vec<u8>> {
    let byte = |x: &f64| (f64::from(*x as u8).to_bits() == x.to_bits()).then_some(*x as u8);
    numbers.iter().map(byte).collect()
}

/// `n` rows of two columns, one after the other in each.
fn interleaved(one: &[f64], other: &[f64], n: usize) -> Vec<f64> {
    let rows = |values: &[f64], i: usize| {
        let width = values.len() / n;
        values[i * width..][..width].to_vec()
    };
    (0..n).flat_map(|i| [rows(one, i), rows(other, i)].concat()).collect()
}

impl Artifact for Dataset {
    const KIND: &'static str = "Dataset";

    fn encode(&self) -> Vec<u8> {
        let column = |item: &[usize], values: &[f64]| {
            let shape = [self.len()].iter().chain(item).copied().collect();
            Data::F64(shape, values.to_vec())
        };
        let rows = self.x.chunks_exact(self.form.input_len().max(1));
        let (x, beside): (Vec<&[f64]>, Vec<&[f64]>) =
            rows.map(|row| row.split_at(row.len() - self.form.beside)).unzip();
        let (x, y) = (x.concat(), column(&self.form.target, &self.y));
        // Pictures are mostly of bytes, an eighth of what numbers take.
        let x = match bytes(&x) {
            Some(bytes) if self.form.input.len() == 3 => {
                Data::U8([&[self.len()], &self.form.input[..]].concat(), bytes)
            }
            _ => column(&self.form.input, &x),
        };
        let mut tensors = Tensors { arrays: [("x".to_owned(), x), ("y".to_owned(), y)].into() };
        if self.form.beside > 0 {
            let beside = column(&[self.form.beside], &beside.concat());
            tensors.arrays.insert(BESIDE.to_owned(), beside);
        }
        if !self.form.names.are_none() {
            let names = ron::to_string(&self.form.names).expect("names are plain data");
            tensors.arrays.insert(NAMES.to_owned(), Data::bytes(names.into_bytes()));
        }
        tensors.encode(Self::KIND, &self.form.classes)
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        let (mut tensors, classes) = Tensors::decode(Self::KIND, bytes)?;
        let (of_x, x) = match tensors.arrays.get("x") {
            Some(Data::U8(..)) => {
                let (shape, bytes) = tensors.u8("x")?;
                (shape, bytes.into_iter().map(f64::from).collect())
            }
            _ => tensors.f64("x")?,
        };
        let (of_y, y) = tensors.f64("y")?;
        let ((n, input), (m, target)) = (of_x.split_first()?, of_y.split_first()?);
        let names = if tensors.arrays.contains_key(NAMES) {
            ron::de::from_bytes(&tensors.u8(NAMES)?.1).ok()?
        } else {
            Names::default()
        };
        let (input, target) = (input.to_vec(), target.to_vec());
        let (x, beside) = if tensors.arrays.contains_key(BESIDE) {
            let (shape, beside) = tensors.f64(BESIDE)?;
            let [rows, width] = shape[..] else { return None };
            if rows != *n || width == 0 {
                return None;
            }
            (interleaved(&x, &beside, *n), width)
        } else {
            (x, 0)
        };
        let form = Form { input, beside, target, classes, names };
        (n == m).then_some(Self { form, x, y })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn survives_the_round_trip() {
        let pairs = Dataset::pairs(vec![0.5, -1.0], vec![2.0, 3.0]);
        let form =
            Form { input: vec![1, 1, 2], target: vec![], classes: Some(4), ..Form::default() };
        let images =
            Dataset { form, x: vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0], y: vec![3.0, 0.0, 1.0] };
        let mut named = images.clone();
        named.form.names =
            Names { inputs: vec!["a".into(), "b,\n".into()], classes: vec!["é\"".into()] };
        let mut driven = images.clone();
        driven.form = Form { input: vec![1, 1, 1], beside: 1, ..images.form.clone() };
        let mut shaded = images.clone();
        shaded.x[1] = 0.5;
        let mut signed = images.clone();
        signed.x[0] = -0.0;
        for data in [&pairs, &images, &named, &driven, &shaded, &signed, &Dataset::default()] {
            assert_eq!(Dataset::decode(&data.encode()).as_ref(), Some(data));
        }
        assert_eq!(driven.pick(&[1]).x, [2.0, 3.0]);
        for data in [&pairs, &images, &driven] {
            assert_eq!(Form::of(&data.form.shapes()).as_ref(), Some(&data.form));
        }
        assert_eq!(pairs.pick(&[1, 1]).y, [3.0, 3.0]);
        let picked = images.pick(&[2, 0]);
        assert_eq!((picked.x, picked.y), (vec![4.0, 5.0, 0.0, 1.0], vec![1.0, 3.0]));
    }
}
