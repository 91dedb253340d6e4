//! Named columns, whatever file they come from.

/// Columns of equal length, in the order of the file.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Table {
    /// The columns that were asked for.
    pub columns: Vec<Column>,
}

/// What a file has under one name.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// The name.
    pub name: String,
    /// How many rows there are; none where an array is a single number.
    pub len: Option<usize>,
    /// The shape of one row: none for a number.
    pub item: Vec<usize>,
    /// What the rows hold, one after the other.
    pub values: Values,
}

/// What a column holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Numbers, last dimension fastest. What is missing is not a number.
    Numbers(Vec<f64>),
    /// Texts: the different ones in the order of their first appearance, and for each row which it is.
    /// What is missing is empty.
    Texts(Vec<String>, Vec<u32>),
}

/// What is wanted of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Want {
    /// Nothing.
    Nothing,
    /// Its numbers.
    Numbers,
    /// Its texts, where it has such.
    Texts,
}

/// Which numbers a column of text may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cells {
    /// Finite ones: anything else is an error.
    Finite,
    /// Finite ones and gaps, which are read as what is not a number.
    Gaps,
    /// All, with what is not finite as programs write it.
    Any,
}

/// How a file of text is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style {
    /// What stands between its cells.
    pub separator: u8,
    /// Whether its first line has the names of columns; without, they are called by their places from 0.
    pub header: bool,
    /// Which numbers it may hold.
    pub cells: Cells,
}

/// Says what is wanted of each column, by the names of all.
pub type Choose<'a> = dyn FnMut(&[String]) -> Result<Vec<Want>, String> + 'a;

impl Column {
    /// The shape of all rows.
    #[must_use]
    pub fn shape(&self) -> Vec<usize> {
        self.len.iter().chain(&self.item).copied().collect()
    }
}

/// `a`, `b` and `c`, for messages; the first few of many.
#[must_use]
pub(crate) fn listed(names: &[String]) -> String {
    let few = names.iter().take(12).map(|name| format!("`{name}`"));
    let few: Vec<String> = few.collect();
    let rest = names.len() - few.len();
    match rest {
        0 => few.join(", "),
        _ => format!("{} and {rest} more", few.join(", ")),
    }
}
