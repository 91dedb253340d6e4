//! A table as observations.

use std::collections::{BTreeMap, BTreeSet};

use ivx_data::{Dataset, Form, Names};

use crate::classes::{Classes, Targets, classed};
use crate::fill::{blank, fill, finite};
use crate::format::{Format, table};
use crate::missing::Gaps;
use crate::table::{Cells, Column, Style, Table, Values, Want, listed};

/// What of a table is an input and what a target.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The inputs, in this order; none for all columns that are no target.
    pub inputs: Vec<String>,
    /// Columns that are no inputs, where `inputs` names none.
    pub except: Vec<String>,
    /// The targets, in this order.
    pub targets: Vec<String>,
    /// The inputs of texts, each of which becomes as many numbers as it has different texts.
    pub one_hot: Vec<String>,
    /// The texts that such inputs may have, whether the file has them or not; by default those of the file.
    pub categories: BTreeMap<String, Vec<String>>,
    /// What the targets are.
    pub classes: Classes,
    /// What is done with gaps.
    pub gaps: Gaps,
}

/// Most numbers that a data set may have: a few texts can stand for many.
const MOST: usize = 1 << 28;

/// Rows that are put together at once.
const BLOCK: usize = 512;

/// Most different texts of an input.
const MOST_TEXTS: usize = 4096;

/// The observations of a file.
///
/// # Errors
/// What is wrong with it.
pub fn dataset(
    name: &str,
    bytes: &[u8],
    (separator, header): (u8, bool),
    choice: &Choice,
) -> Result<Dataset, String> {
    let cells = if choice.gaps == Gaps::Refused { Cells::Finite } else { Cells::Gaps };
    let style = Style { separator, header, cells };
    let mut inputs = Vec::new();
    let columns = table(name, bytes, style, &mut |names| {
        inputs = choice.inputs_of(names)?;
        Ok(choice.wants(names, &inputs))
    });
    let mut columns = columns.map_err(with_a_way)?;
    // All that is chosen is read.
    let read = columns.columns.iter().enumerate();
    let read: BTreeMap<&str, usize> = read.map(|(i, own)| (own.name.as_str(), i)).collect();
    let take = |names: &[String]| -> Vec<usize> {
        names.iter().filter_map(|name| read.get(name.as_str()).copied()).collect()
    };
    let (inputs, targets) = (take(&inputs), take(&choice.targets));
    even(&columns)?;
    blank(&mut columns, &choice.classes);
    fill(&mut columns, &targets, choice.gaps)?;
    finite(&columns)?;
    complete(&mut columns, &choice.categories)?;
    let Targets { shape: target, y, classes, labels } =
        classed(&columns, &targets, &choice.classes)?;
    let (input, x) = side_by_side(&columns, &inputs, &choice.one_hot)?;
    // Names of arrays tell files apart as often as what is in them, and places are no names.
    let have_names = header && matches!(Format::of(name), Some(Format::Text | Format::Parquet));
    let has_texts = inputs.iter().any(|i| matches!(columns.columns[*i].values, Values::Texts(..)));
    let inputs = if has_texts || have_names && inputs.len() > 1 {
        inputs.iter().flat_map(|i| names_of(&columns.columns[*i])).collect()
    } else {
        Vec::new()
    };
    let names = Names { inputs, classes: labels };
    Ok(Dataset { form: Form { input, beside: 0, target, classes, names }, x, y })
}

/// Says what makes numbers of texts, where that is what is wrong.
fn with_a_way(why: String) -> String {
    let way = "`labels: true` makes classes of a target's texts, and `one_hot: [..]` numbers of an input's";
    if why.ends_with("is no number") { format!("{why}: {way}") } else { why }
}

/// What the numbers are called that a column makes.
fn names_of(column: &Column) -> Vec<String> {
    let name = &column.name;
    match &column.values {
        Values::Texts(texts, _) => {
            present(texts).into_iter().map(|text| format!("{name}={text}")).collect()
        }
        Values::Numbers(_) => match column.item.iter().product::<usize>() {
            1 => vec![name.clone()],
            n => (0..n).map(|i| format!("{name}.{i}")).collect(),
        },
    }
}

/// Adds the texts that inputs may have and the file has not.
fn complete(table: &mut Table, categories: &BTreeMap<String, Vec<String>>) -> Result<(), String> {
    for column in &mut table.columns {
        let Values::Texts(texts, _) = &mut column.values else { continue };
        let Some(known) = categories.get(&column.name) else { continue };
        if let Some(other) = texts.iter().find(|text| !text.is_empty() && !known.contains(text)) {
            let (name, known) = (&column.name, listed(known));
            return Err(format!("`{name}` has the text `{other}`, which is none of {known}"));
        }
        let lacking: Vec<String> =
            known.iter().filter(|text| !texts.contains(text)).cloned().collect();
        texts.extend(lacking);
    }
    Ok(())
}

impl Choice {
    /// The inputs of a table with these columns.
    ///
    /// # Errors
    /// If something is named that the table has not, or nothing is left.
    pub fn inputs_of(&self, names: &[String]) -> Result<Vec<String>, String> {
        let known: BTreeSet<&String> = names.iter().collect();
        let inputs = self.inputs.iter().chain(&self.except);
        let mut named = self.targets.iter().chain(inputs).chain(&self.one_hot);
        if let Some(missing) = named.find(|name| !known.contains(name)) {
            return Err(format!("it has no column `{missing}`; it has {}", listed(names)));
        }
        let inputs = if self.inputs.is_empty() {
            let others: BTreeSet<&String> = self.targets.iter().chain(&self.except).collect();
            names.iter().filter(|name| !others.contains(name)).cloned().collect()
        } else {
            self.inputs.clone()
        };
        if inputs.is_empty() && !self.except.is_empty() {
            return Err("`except` leaves no input of it: an input is a column too".to_owned());
        }
        if inputs.is_empty() {
            return Err("it has nothing but its targets: an input is a column too".to_owned());
        }
        let stray = self.one_hot.iter().find(|name| !inputs.contains(name));
        match stray {
            Some(stray) if self.except.contains(stray) => {
                Err(format!("`{stray}` is of no input: `except` leaves it out"))
            }
            Some(stray) => Err(format!("`{stray}` is of no input: name it in `inputs` too")),
            None => Ok(inputs),
        }
    }

    fn wants(&self, names: &[String], inputs: &[String]) -> Vec<Want> {
        let labelled = matches!(self.classes, Classes::Sorted | Classes::Listed(_));
        let inputs: BTreeSet<&String> = inputs.iter().collect();
        let want = |name: &String| match (self.targets.contains(name), inputs.contains(name)) {
            (true, false) if labelled => Want::Texts,
            (_, true) if self.one_hot.contains(name) => Want::Texts,
            (false, false) => Want::Nothing,
            _ => Want::Numbers,
        };
        names.iter().map(want).collect()
    }
}

/// Whether all columns have as many rows.
fn even(table: &Table) -> Result<(), String> {
    for column in &table.columns {
        let Some(n) = column.len else {
            return Err(format!("`{}` is a single number, and no column", column.name));
        };
        if column.item.contains(&0) {
            let shape = column.shape();
            return Err(format!("`{}` is an array a data set has, and not {shape:?}", column.name));
        }
        let first = &table.columns[0];
        if first.len != Some(n) {
            let m = first.len.unwrap_or_default();
            return Err(format!("there are {m} of `{}` and {n} of `{}`", first.name, column.name));
        }
    }
    Ok(())
}

/// The shape of one input, and all inputs.
fn side_by_side(
    table: &Table,
    inputs: &[usize],
    one_hot: &[String],
) -> Result<(Vec<usize>, Vec<f64>), String> {
    let columns = inputs.iter().map(|i| &table.columns[*i]);
    let columns = columns.map(|column| Ok((column, width(column, one_hot)?)));
    let columns: Vec<(&Column, usize)> = columns.collect::<Result<_, String>>()?;
    if let [(column, _)] = columns[..]
        && let Values::Numbers(numbers) = &column.values
    {
        if column.item.len() > 3 {
            let (name, shape) = (&column.name, column.shape());
            return Err(format!("`{name}` is an array a data set has, and not {shape:?}"));
        }
        // A column of a matrix is one number an observation.
        let item = if column.item == [1] { Vec::new() } else { column.item.clone() };
        return Ok((item, numbers.clone()));
    }
    if let Some((odd, _)) = columns.iter().find(|(column, _)| column.item.len() > 1) {
        let (name, shape) = (&odd.name, odd.shape());
        return Err(format!(
            "`{name}` is of the shape {shape:?}, and stands beside other inputs, which is for vectors and numbers"
        ));
    }
    let all: usize = columns.iter().map(|(_, width)| width).sum();
    let n = columns.first().and_then(|(column, _)| column.len).unwrap_or_default();
    if all.checked_mul(n).is_none_or(|size| size > MOST) {
        return Err(format!("{n} observations of {all} numbers are more than a data set has"));
    }
    let mut x = vec![0.0; all * n];
    let orders: Vec<Vec<usize>> = columns.iter().map(|(column, _)| places(column)).collect();
    // Some rows at a time, which stay in the cache of the processor.
    for (block, rows) in x.chunks_mut(all * BLOCK).enumerate() {
        let mut from = 0;
        for ((column, width), order) in columns.iter().zip(&orders) {
            let rows = rows.chunks_mut(all).map(|row| &mut row[from..from + width]);
            match &column.values {
                Values::Numbers(numbers) => {
                    let numbers = numbers[block * BLOCK * width..].chunks(*width);
                    rows.zip(numbers).for_each(|(row, own)| row.copy_from_slice(own));
                }
                Values::Texts(_, at) => {
                    let at = &at[block * BLOCK..];
                    rows.zip(at).for_each(|(row, place)| row[order[*place as usize]] = 1.0);
                }
            }
            from += width;
        }
    }
    Ok((vec![all], x))
}

/// How many numbers of an input a column makes.
fn width(column: &Column, one_hot: &[String]) -> Result<usize, String> {
    let name = &column.name;
    match &column.values {
        Values::Numbers(_) if one_hot.contains(name) => {
            Err(format!("`{name}` holds numbers: `one_hot` is for texts"))
        }
        Values::Numbers(_) => Ok(column.item.iter().product::<usize>().max(1)),
        Values::Texts(texts, _) if !one_hot.contains(name) => {
            let first = texts.iter().find(|text| !text.is_empty()).map_or("", String::as_str);
            Err(format!("`{name}` holds texts such as {first:?}: name it in `one_hot`"))
        }
        Values::Texts(texts, _) => match present(texts).len() {
            n if n > MOST_TEXTS => Err(format!(
                "`{name}` has {n} different texts, which are too many for numbers of their own"
            )),
            n => Ok(n.max(1)),
        },
    }
}

/// The different texts, in order. An empty one is a gap.
fn present(texts: &[String]) -> Vec<&String> {
    let mut sorted: Vec<&String> = texts.iter().filter(|text| !text.is_empty()).collect();
    sorted.sort_unstable();
    sorted
}

/// The place of each text of a column among all of them in order.
fn places(column: &Column) -> Vec<usize> {
    let Values::Texts(texts, _) = &column.values else { return Vec::new() };
    let sorted = present(texts);
    texts.iter().map(|text| sorted.binary_search(&text).unwrap_or_default()).collect()
}

#[cfg(test)]
mod tests;
