//! The columns of a table: what each is called, and a number for each row.

use std::collections::{BTreeMap, BTreeSet};

use ivx_op::{Dim, OpError, is_missing};

use super::arrange::{Arranged, called, coordinates, labels, names};
use super::interval::Estimate;

/// One column: its head and a cell for each row.
pub(super) struct Column {
    /// Its own among those of the table, once they are told apart.
    pub(super) head: String,
    /// The labels that it is of.
    pub(super) place: String,
    pub(super) over_seed: bool,
    /// Which of its numbers is in bold.
    pub(super) best: Best,
    /// None where there is nothing to show.
    pub(super) cells: Vec<Option<Estimate>>,
}

impl Column {
    /// What its columns are called where each number has one.
    pub(super) fn fields(&self) -> Vec<String> {
        let mut fields = if self.over_seed {
            ["mean", "low", "high"].map(|part| format!("{} {part}", self.head)).to_vec()
        } else {
            vec![self.head.clone()]
        };
        fields.extend(self.lacks().then(|| format!("{} missing", self.head)));
        fields
    }

    /// Whether something that it shows is missing, or what it is made of.
    pub(super) fn lacks(&self) -> bool {
        self.cells.iter().flatten().any(|cell| !cell.lacks.nothing())
    }
}

/// Which number of a column is the best.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Best {
    None,
    Highest,
    Lowest,
}

impl Best {
    pub(super) fn named(name: &str) -> Result<Self, String> {
        match name {
            "none" => Ok(Self::None),
            "highest" => Ok(Self::Highest),
            "lowest" => Ok(Self::Lowest),
            other => Err(format!("{other:?} says not which number is the best")),
        }
    }
}

/// Whether no number of a column is better than that in a row.
pub(super) fn is_best(column: &Column, row: usize) -> bool {
    let means = column.cells.iter().flatten().map(|cell| cell.mean);
    let Some(Estimate { mean, .. }) = column.cells[row] else { return false };
    match column.best {
        Best::None => false,
        Best::Highest => means.fold(f64::NEG_INFINITY, f64::max) == mean,
        Best::Lowest => means.fold(f64::INFINITY, f64::min) == mean,
    }
}

/// Gives values without a name one: `value`, or `value 1`, `value 2` where several have none.
pub(super) fn name_each<'a>(values: impl Iterator<Item = &'a mut Arranged>) {
    let mut unnamed: Vec<&mut Arranged> = values.filter(|value| value.name.is_empty()).collect();
    let several = unnamed.len() > 1;
    for (i, value) in unnamed.iter_mut().enumerate() {
        value.name = if several { format!("value {}", i + 1) } else { "value".to_owned() };
    }
}

/// Gives each column a head that no other column has, and no row: those that had the same are counted.
pub(super) fn tell_apart(columns: &mut [Column], rows: &[Dim]) {
    let mut taken: BTreeSet<String> = rows.iter().map(|dim| dim.name.clone()).collect();
    for column in columns {
        let head = column.head.clone();
        let mut n = 1;
        while taken.contains(&column.head) || column.fields().iter().any(|f| taken.contains(f)) {
            n += 1;
            column.head = format!("{head} ({n})");
        }
        taken.insert(column.head.clone());
        taken.extend(column.fields());
    }
}

/// The rows that all values have in common.
///
/// # Errors
/// If they differ in them, or there are none.
pub(super) fn same_rows(values: &[Arranged]) -> Result<&[Dim], OpError> {
    let Some(first) = values.first() else {
        return Err(OpError::Failed("a table needs a value".to_owned()));
    };
    match values.iter().find(|value| value.outer != first.outer) {
        None => Ok(&first.outer),
        Some(other) => {
            let (a, b, rows) = (called(&first.name), called(&other.name), names(&first.outer));
            Err(OpError::Failed(format!("{a} and {b} differ in the labels of `{rows}`")))
        }
    }
}

/// One column for each label of what each value varies over but rows.
pub(super) fn columns(values: &[Arranged], best: Best) -> Vec<Column> {
    let mut columns = Vec::new();
    for Arranged { name, rest, inner, over_seed, cells, .. } in values {
        let inner = [rest.as_slice(), inner].concat();
        let n = labels(&inner).len();
        for (i, (place, coordinate)) in
            labels(&inner).into_iter().zip(coordinates(&inner)).enumerate()
        {
            let head =
                if inner.is_empty() { name.to_owned() } else { format!("{name}, {coordinate}") };
            let cells = cells.iter().skip(i).step_by(n).map(|cell| Some(*cell)).collect();
            columns.push(Column { head, place, over_seed: *over_seed, best, cells });
        }
    }
    columns
}

/// The columns of a value beside others, such as published numbers: those cells of it that have the labels
/// of a row.
pub(super) fn columns_beside(beside: Arranged, rows: &[Dim]) -> Vec<Column> {
    let known: BTreeMap<Vec<String>, usize> =
        row_labels(&beside.outer).into_iter().zip(0..).collect();
    let places: Vec<Option<usize>> =
        row_labels(rows).iter().map(|row| known.get(row).copied()).collect();
    let mut columns = columns(&[beside], Best::None);
    for column in &mut columns {
        let cell = |place: &Option<usize>| {
            place.and_then(|place| column.cells[place]).filter(|cell| !cell.mean.is_nan())
        };
        column.cells = places.iter().map(cell).collect();
    }
    columns
}

/// How much higher the numbers of the one column are that is of the same place; none if there are several.
pub(super) fn difference(ours: &[Column], theirs: &Column) -> Option<Column> {
    let mut alike = ours.iter().filter(|column| column.place == theirs.place);
    let (Some(same), None) = (alike.next(), alike.next()) else { return None };
    let minus = |(a, b): (&Option<Estimate>, &Option<Estimate>)| {
        let (a, b) = ((*a)?, (*b)?.mean);
        let interval = a.interval.map(|(low, high)| (low - b, high - b));
        let lacks = a.lacks;
        Some(Estimate {
            mean: if is_missing(a.mean) { a.mean } else { a.mean - b },
            interval,
            lacks,
        })
    };
    Some(Column {
        head: format!("{} − {}", same.head, theirs.head),
        place: theirs.place.clone(),
        over_seed: same.over_seed,
        best: Best::None,
        cells: same.cells.iter().zip(&theirs.cells).map(minus).collect(),
    })
}

/// The labels of each row: one for each dimension.
pub(super) fn row_labels(rows: &[Dim]) -> Vec<Vec<String>> {
    rows.iter().fold(vec![Vec::new()], |heads, dim| {
        let with =
            |head: &Vec<String>, i| head.iter().cloned().chain([dim.labels.text(i)]).collect();
        heads.iter().flat_map(|head| (0..dim.len()).map(move |i| with(head, i))).collect()
    })
}

#[cfg(test)]
mod tests {
    use ivx_op::Labels;

    use super::super::arrange::arrange;
    use super::super::arrange::tests::value;
    use super::*;

    fn column(best: Best, means: &[f64]) -> Column {
        let cell = |mean: &f64| Some(Estimate { mean: *mean, ..Estimate::default() });
        let place = String::new();
        Column {
            head: "x".into(),
            place,
            over_seed: false,
            best,
            cells: means.iter().map(cell).collect(),
        }
    }

    #[test]
    fn the_best_of_each_column_is_found() {
        let bold = |best, means: &[f64]| {
            let column = column(best, means);
            (0..means.len()).filter(|row| is_best(&column, *row)).collect::<Vec<_>>()
        };
        assert_eq!(bold(Best::Highest, &[1.0, 3.0, f64::NAN, 3.0]), [1, 3]);
        assert_eq!(bold(Best::Lowest, &[1.0, 3.0, -2.0]), [2]);
        assert!(bold(Best::None, &[1.0]).is_empty());
        assert!(Best::named("most").is_err());
    }

    #[test]
    fn every_head_is_its_own() {
        let heads = |heads: &[(&str, bool)]| {
            let mut columns: Vec<Column> = heads
                .iter()
                .map(|(head, over_seed)| Column {
                    head: (*head).into(),
                    over_seed: *over_seed,
                    ..column(Best::None, &[])
                })
                .collect();
            tell_apart(&mut columns, &[Dim::new("ke", Labels::Names(Vec::new()))]);
            let mut fields: Vec<String> = columns.iter().flat_map(Column::fields).collect();
            fields.push("ke".to_owned());
            let n = fields.len();
            fields.sort_unstable();
            fields.dedup();
            assert_eq!(fields.len(), n, "{fields:?}");
            columns.into_iter().map(|column| column.head).collect::<Vec<_>>()
        };
        assert_eq!(heads(&[("a", false), ("b", false)]), ["a", "b"]);
        assert_eq!(
            heads(&[("a", false), ("a", false), ("a (2)", false)]),
            ["a", "a (2)", "a (2) (2)"]
        );
        assert_eq!(
            heads(&[("a mean", false), ("a", true), ("ke", false)]),
            ["a mean", "a (2)", "ke (2)"]
        );
    }

    #[test]
    fn differences_are_of_what_has_the_same_labels() {
        let ke: (&str, &[&str]) = ("ke", &["WCM", "MA"]);
        let seeds: (&str, &[&str]) = ("seed", &["0", "1", "2"]);
        let ours = value(&[ke, seeds], &[1.0, 2.0, 3.0, 5.0, 5.0, 5.0]);
        let ours = arrange(&ours, (&["ke".into()], &[]), false).unwrap();
        let theirs = value(&[("ke", &["MA", "CVaR", "WCM"])], &[4.5, 9.0, f64::NAN]);
        let theirs = arrange(&theirs, (&["ke".into()], &[]), false).unwrap();
        let rows = ours.outer.clone();
        let ours = columns(&[ours], Best::None);
        let theirs = columns_beside(theirs, &rows);
        let found = difference(&ours, &theirs[0]).unwrap();
        assert_eq!(found.head, "y − y");
        let same = Estimate { mean: 0.5, interval: Some((0.5, 0.5)), ..Estimate::default() };
        let found = found.cells.iter().map(|cell| cell.map(|cell| (cell.mean, cell.interval)));
        assert!(found.eq([None, Some((same.mean, same.interval))]));
        let other = value(&[ke, ("task", &["a", "b"])], &[1.0; 4]);
        let other = columns_beside(arrange(&other, (&["ke".into()], &[]), false).unwrap(), &rows);
        assert!(difference(&ours, &other[0]).is_none());
    }
}
