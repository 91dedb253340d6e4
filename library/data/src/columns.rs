//! Rows of named columns: what is seen in a world, kept of it and learned from, in one representation.

use ivx_op::{Data, State, Tensors};
use serde::{Deserialize, Serialize};

/// What the numbers of a field are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// Numbers in single precision.
    F32,
    /// Bytes, such as the channels of a picture.
    U8,
    /// Bytes that are 0 or 1, which are kept as bits.
    Bit,
    /// One of so many.
    Index(usize),
}

/// One column: its name, and what a row of it is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Field {
    /// Such as `grid`.
    pub name: String,
    /// The shape of a row; none for a number.
    pub shape: Vec<usize>,
    /// What its numbers are.
    pub kind: Kind,
}

impl Field {
    /// A field.
    #[must_use]
    pub fn new(name: &str, shape: &[usize], kind: Kind) -> Self {
        Self { name: name.to_owned(), shape: shape.to_vec(), kind }
    }

    /// How many numbers a row has.
    #[must_use]
    pub fn width(&self) -> usize {
        self.shape.iter().product()
    }

    /// How many numbers a network sees of a row: for one of so many it is as many, with a 1 in its place.
    #[must_use]
    pub fn spread(&self) -> usize {
        match self.kind {
            Kind::Index(n) => self.width() * n,
            Kind::F32 | Kind::U8 | Kind::Bit => self.width(),
        }
    }
}

/// The numbers of a column, row after row.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Of [`Kind::F32`].
    F32(Vec<f32>),
    /// Of [`Kind::U8`] and [`Kind::Bit`].
    U8(Vec<u8>),
    /// Of [`Kind::Index`].
    Index(Vec<u32>),
}

impl Values {
    fn zeros(kind: Kind, len: usize) -> Self {
        match kind {
            Kind::F32 => Self::F32(vec![0.0; len]),
            Kind::U8 | Kind::Bit => Self::U8(vec![0; len]),
            Kind::Index(_) => Self::Index(vec![0; len]),
        }
    }

    fn resize(&mut self, len: usize) {
        match self {
            Self::F32(values) => values.resize(len, 0.0),
            Self::U8(values) => values.resize(len, 0),
            Self::Index(values) => values.resize(len, 0),
        }
    }

    /// Appends those of another column of the same kind.
    fn append(&mut self, others: &Self) {
        match (self, others) {
            (Self::F32(own), Self::F32(others)) => own.extend(others),
            (Self::U8(own), Self::U8(others)) => own.extend(others),
            (Self::Index(own), Self::Index(others)) => own.extend(others),
            _ => panic!("columns of the same fields"),
        }
    }

    /// Copies numbers of another column of the same kind over these.
    fn copy(&mut self, to: usize, from: &Self, at: usize, width: usize) {
        let (to, at) = (to..to + width, at..at + width);
        match (self, from) {
            (Self::F32(own), Self::F32(other)) => own[to].copy_from_slice(&other[at]),
            (Self::U8(own), Self::U8(other)) => own[to].copy_from_slice(&other[at]),
            (Self::Index(own), Self::Index(other)) => own[to].copy_from_slice(&other[at]),
            _ => panic!("columns of the same fields"),
        }
    }
}

/// Up to eight bits as a byte, the first lowest.
#[inline]
#[must_use]
pub fn packed(bits: &[u8]) -> u8 {
    bits.iter().rev().fold(0, |byte, bit| byte << 1 | bit & 1)
}

/// Rows of named columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    fields: Vec<Field>,
    values: Vec<Values>,
    len: usize,
}

impl Columns {
    /// `len` rows of zeros.
    #[must_use]
    pub fn zeros(fields: Vec<Field>, len: usize) -> Self {
        let values = fields.iter().map(|field| Values::zeros(field.kind, len * field.width()));
        Self { values: values.collect(), fields, len }
    }

    /// How many rows there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// What the columns are.
    #[must_use]
    pub fn fields(&self) -> &[Field] {
        &self.fields
    }

    /// The numbers of a column.
    #[must_use]
    pub fn values(&self, column: usize) -> &Values {
        &self.values[column]
    }

    /// The numbers of a column, to be changed, and how many a row has.
    pub fn values_mut(&mut self, column: usize) -> (&mut Values, usize) {
        (&mut self.values[column], self.fields[column].width())
    }

    /// Lets there be so many rows, of which new ones are zeros.
    pub fn resize(&mut self, len: usize) {
        for (field, values) in self.fields.iter().zip(&mut self.values) {
            values.resize(len * field.width());
        }
        self.len = len;
    }

    /// Adds a row of other rows of the same fields.
    ///
    /// # Panics
    /// If there is no such row, or the fields are others.
    pub fn push(&mut self, from: &Self, at: usize) {
        self.resize(self.len + 1);
        self.set(self.len - 1, from, at);
    }

    /// Adds a row of others, of which these are the fields in some places.
    ///
    /// # Panics
    /// If there is no such row, or the fields are others.
    pub fn push_some(&mut self, from: &Self, fields: &[usize], at: usize) {
        self.resize(self.len + 1);
        let last = self.len - 1;
        let own = self.fields.iter().zip(&mut self.values);
        for ((field, own), place) in own.zip(fields) {
            let width = field.width();
            own.copy(last * width, &from.values[*place], at * width, width);
        }
    }

    /// Adds all rows of others of the same fields.
    ///
    /// # Panics
    /// If the fields are others.
    pub fn append(&mut self, others: &Self) {
        self.values.iter_mut().zip(&others.values).for_each(|(own, other)| own.append(other));
        self.len += others.len;
    }

    /// Puts the columns among arrays, under a prefix and their names: bits eight in a byte, and indices in four.
    pub(crate) fn store(&self, prefix: &str, to: &mut Tensors) {
        for (field, values) in self.fields.iter().zip(&self.values) {
            let shape = || [&[self.len], &field.shape[..]].concat();
            let data = match values {
                Values::F32(values) => Data::F32(shape(), values.clone()),
                Values::U8(bits) if field.kind == Kind::Bit => {
                    Data::bytes(bits.chunks(8).map(packed).collect())
                }
                Values::U8(values) => Data::U8(shape(), values.clone()),
                Values::Index(values) => {
                    Data::bytes(values.iter().flat_map(|x| x.to_le_bytes()).collect())
                }
            };
            to.arrays.insert(format!("{prefix}{}", field.name), data);
        }
    }

    /// Takes `len` rows of such columns back; `None` if that is something else.
    pub(crate) fn take(
        prefix: &str,
        from: &mut Tensors,
        fields: Vec<Field>,
        len: usize,
    ) -> Option<Self> {
        let mut values = Vec::new();
        for field in &fields {
            let width = field.shape.iter().try_fold(1_usize, |all, n| all.checked_mul(*n))?;
            let n = len.checked_mul(width)?;
            let data = from.arrays.remove(&format!("{prefix}{}", field.name))?;
            values.push(match (field.kind, data) {
                (Kind::F32, Data::F32(_, numbers)) if numbers.len() == n => Values::F32(numbers),
                (Kind::U8, Data::U8(_, bytes)) if bytes.len() == n => Values::U8(bytes),
                (Kind::Bit, Data::U8(_, bytes)) if bytes.len() == n.div_ceil(8) => {
                    Values::U8((0..n).map(|i| bytes[i / 8] >> (i % 8) & 1).collect())
                }
                (Kind::Index(most), Data::U8(_, bytes))
                    if n.checked_mul(4) == Some(bytes.len()) =>
                {
                    let (words, _) = bytes.as_chunks::<4>();
                    let places: Vec<u32> = words.iter().map(|w| u32::from_le_bytes(*w)).collect();
                    if places.iter().any(|place| *place as usize >= most) {
                        return None;
                    }
                    Values::Index(places)
                }
                _ => return None,
            });
        }
        Some(Self { fields, values, len })
    }

    /// Replaces a row by one of other rows of the same fields.
    ///
    /// # Panics
    /// If there is no such row, or the fields are others.
    pub fn set(&mut self, row: usize, from: &Self, at: usize) {
        let fields = self.fields.iter().zip(self.values.iter_mut().zip(&from.values));
        for (field, (own, other)) in fields {
            let width = field.width();
            own.copy(row * width, other, at * width, width);
        }
    }

    /// Walks over all numbers, of as many rows as there are.
    pub fn state(&mut self, state: &mut State) {
        for (field, values) in self.fields.iter().zip(&mut self.values) {
            match values {
                Values::F32(values) => state.numbers(&field.name, values),
                Values::U8(values) => state.bytes(&field.name, values),
                Values::Index(values) => {
                    let mut bytes = values.iter().flat_map(|x| x.to_le_bytes()).collect();
                    state.bytes(&field.name, &mut bytes);
                    let (words, _) = bytes.as_chunks::<4>();
                    let words = values.iter_mut().zip(words);
                    words.for_each(|(x, word)| *x = u32::from_le_bytes(*word));
                }
            }
        }
    }

    /// How many numbers a network sees of a row.
    #[must_use]
    pub fn width(&self) -> usize {
        self.fields.iter().map(Field::spread).sum()
    }

    /// All rows as a network sees them, column after column in each, written into `out`.
    ///
    /// # Panics
    /// If `out` is not as long.
    pub fn spread_all(&self, out: &mut [f32]) {
        if let [Values::U8(bytes)] = &self.values[..] {
            assert_eq!(out.len(), bytes.len(), "as many numbers as there are");
            out.iter_mut().zip(bytes).for_each(|(out, x)| *out = f32::from(*x));
            return;
        }
        for (row, out) in out.chunks_exact_mut(self.width()).enumerate() {
            self.spread_row(row, out);
        }
    }

    /// Some rows likewise, one after the other.
    ///
    /// # Panics
    /// If there is no such row, or `out` is not as long.
    pub fn spread_rows(&self, rows: &[usize], out: &mut [f32]) {
        for (&row, out) in rows.iter().zip(out.chunks_exact_mut(self.width())) {
            self.spread_row(row, out);
        }
    }

    fn spread_row(&self, row: usize, mut out: &mut [f32]) {
        for (column, field) in self.fields.iter().enumerate() {
            let (own, rest) = out.split_at_mut(field.spread());
            self.spread(column, row, own);
            out = rest;
        }
    }

    /// The numbers of a row of a column as a network sees them, written into `out`: one of so many has a 1 in its
    /// place.
    ///
    /// # Panics
    /// If there is no such row, or `out` is not as long as [`Field::spread`] says.
    pub fn spread(&self, column: usize, row: usize, out: &mut [f32]) {
        let field = &self.fields[column];
        let at = row * field.width()..(row + 1) * field.width();
        match &self.values[column] {
            Values::F32(values) => out.copy_from_slice(&values[at]),
            Values::U8(values) => {
                assert_eq!(out.len(), at.len(), "as many numbers as the field has");
                out.iter_mut().zip(&values[at]).for_each(|(out, x)| *out = f32::from(*x));
            }
            Values::Index(values) => {
                let Kind::Index(n) = field.kind else { panic!("an index is of so many") };
                out.fill(0.0);
                let rows = out.chunks_exact_mut(n).zip(&values[at]);
                rows.for_each(|(out, i)| out[*i as usize] = 1.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_copied_whole_and_seen_by_networks() {
        let fields = || {
            vec![
                Field::new("grid", &[2, 2], Kind::U8),
                Field::new("speed", &[], Kind::F32),
                Field::new("cell", &[], Kind::Index(3)),
            ]
        };
        let mut one = Columns::zeros(fields(), 2);
        let (Values::U8(grid), 4) = one.values_mut(0) else { panic!("four bytes a row") };
        grid[4..].copy_from_slice(&[1, 0, 7, 0]);
        let (Values::F32(speed), 1) = one.values_mut(1) else { panic!("a number a row") };
        speed[1] = 2.5;
        let (Values::Index(cell), 1) = one.values_mut(2) else { panic!("an index a row") };
        cell[1] = 2;
        let mut other = Columns::zeros(fields(), 3);
        other.set(0, &one, 1);
        assert_eq!((other.len(), other.is_empty()), (3, false));
        let seen = |column: usize, row| {
            let mut out = vec![9.0; other.fields()[column].spread()];
            other.spread(column, row, &mut out);
            out
        };
        assert_eq!(seen(0, 0), [1.0, 0.0, 7.0, 0.0]);
        assert_eq!((seen(1, 0), seen(2, 0)), (vec![2.5], vec![0.0, 0.0, 1.0]));
        assert_eq!((seen(1, 2), seen(2, 2)), (vec![0.0], vec![1.0, 0.0, 0.0]));
        let mut all = vec![9.0; 3 * other.width()];
        other.spread_all(&mut all);
        assert_eq!(all[..8], [1.0, 0.0, 7.0, 0.0, 2.5, 0.0, 0.0, 1.0]);
        assert_eq!(all[16..], [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    }
}
