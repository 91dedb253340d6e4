//! Targets: numbers, or the classes that labels stand for.

use std::collections::BTreeMap;

use ivx_op::label;

use crate::table::{Column, Table, Values, listed};

/// What targets are.
#[derive(Clone, Debug, PartialEq)]
pub enum Classes {
    /// Numbers.
    None,
    /// Indices of so many classes.
    Indices(usize),
    /// Labels of classes, which are counted in order: by size where all are numbers, else by their letters.
    Sorted,
    /// These labels, counted in this order.
    Listed(Vec<String>),
}

/// Most classes that there may be.
const MOST: usize = 1_000_000;

/// What the targets of a table are.
pub(crate) struct Targets {
    /// The shape of one.
    pub(crate) shape: Vec<usize>,
    /// All of them.
    pub(crate) y: Vec<f64>,
    /// How many classes there are.
    pub(crate) classes: Option<usize>,
    /// What they are called; nothing where they are indices.
    pub(crate) labels: Vec<String>,
}

/// The targets of a table.
///
/// - `places`: those of the columns that are targets.
///
/// # Errors
/// If they are not what they are said to be.
pub(crate) fn classed(
    table: &Table,
    places: &[usize],
    classes: &Classes,
) -> Result<Targets, String> {
    let columns: Vec<&Column> = places.iter().map(|i| &table.columns[*i]).collect();
    match (classes, &columns[..]) {
        (Classes::Sorted | Classes::Listed(_), [one]) => {
            let (y, labels) = labelled(one, classes)?;
            let classes = Some(several(labels.len())?);
            Ok(Targets { shape: Vec::new(), y, classes, labels })
        }
        (Classes::Sorted | Classes::Listed(_), _) => {
            Err("labels of classes are one target, and here are several".to_owned())
        }
        _ => {
            let (shape, y) = numbers(&columns)?;
            let n = match classes {
                Classes::Indices(n) => Some(several(*n)?),
                _ => None,
            };
            if let Some(n) = n {
                #[expect(clippy::cast_precision_loss, reason = "classes are few")]
                let foreign = |y: &&f64| y.fract() != 0.0 || **y < 0.0 || **y >= n as f64;
                if let Some(y) = y.iter().find(foreign) {
                    return Err(format!("{y} is no index of {n} classes"));
                }
            }
            Ok(Targets { shape, y, classes: n, labels: Vec::new() })
        }
    }
}

/// A number of classes that can be told apart.
fn several(n: usize) -> Result<usize, String> {
    if n < 2 {
        return Err(format!("its targets are of {n} class, and there is nothing to tell apart"));
    }
    Ok(n)
}

/// The targets as numbers, several side by side.
fn numbers(columns: &[&Column]) -> Result<(Vec<usize>, Vec<f64>), String> {
    let mut each: Vec<&[f64]> = Vec::new();
    for column in columns {
        let (name, shape) = (&column.name, column.shape());
        match &column.values {
            Values::Numbers(_) if column.item.len() > if columns.len() == 1 { 2 } else { 0 } => {
                return Err(format!("`{name}` is an array a data set has, and not {shape:?}"));
            }
            Values::Numbers(numbers) => each.push(numbers),
            Values::Texts(..) => {
                return Err(format!("`{name}` holds texts: `labels: true` makes classes of them"));
            }
        }
    }
    if let ([column], [only]) = (columns, &each[..]) {
        let item = if column.item == [1] { Vec::new() } else { column.item.clone() };
        return Ok((item, only.to_vec()));
    }
    let n = each.first().map_or(0, |first| first.len());
    let y = (0..n).flat_map(|row| each.iter().map(move |own| own[row])).collect();
    Ok((vec![each.len()], y))
}

/// The index of the class of each observation, and what the classes are called.
fn labelled(column: &Column, classes: &Classes) -> Result<(Vec<f64>, Vec<String>), String> {
    if !column.item.is_empty() && column.item != [1] {
        let (name, shape) = (&column.name, column.shape());
        return Err(format!("`{name}` is of the shape {shape:?}: a label is one number or text"));
    }
    let (texts, at) = match &column.values {
        Values::Texts(texts, at) => (texts.clone(), at.clone()),
        Values::Numbers(numbers) => told_apart(numbers),
    };
    let labels = match classes {
        Classes::Listed(labels) => labels.clone(),
        _ => in_order(&texts),
    };
    if labels.len() > MOST {
        return Err(format!("it has {} classes, which are too many", labels.len()));
    }
    let by_text: BTreeMap<&str, usize> =
        labels.iter().enumerate().map(|(i, label)| (label.as_str(), i)).collect();
    let by_number: BTreeMap<u64, usize> =
        labels.iter().enumerate().filter_map(|(i, label)| Some((number(label)?, i))).collect();
    let class = |text: &String| {
        let by_number = || number(text).and_then(|number| by_number.get(&number));
        by_text.get(text.as_str()).or_else(by_number).copied()
    };
    let class: Vec<Option<usize>> = texts.iter().map(class).collect();
    let indices = at.iter().enumerate().map(|(row, place)| {
        let place = *place as usize;
        #[expect(clippy::cast_precision_loss, reason = "classes are few")]
        class[place].map(|class| class as f64).ok_or_else(|| {
            let text: String = texts[place].chars().take(40).collect();
            let (row, name) = (row + 1, &column.name);
            format!(
                "observation {row} has `{text}` in `{name}`, which is none of {}",
                listed(&labels)
            )
        })
    });
    let indices = indices.collect::<Result<_, _>>()?;
    // Numbers are the same however they are written.
    let plain = |text: String| number(&text).map_or(text, |bits| label(f64::from_bits(bits)));
    Ok((indices, labels.into_iter().map(plain).collect()))
}

/// The different numbers as texts, and for each number which it is.
fn told_apart(numbers: &[f64]) -> (Vec<String>, Vec<u32>) {
    let (mut known, mut texts) = (BTreeMap::new(), Vec::new());
    let mut at = Vec::with_capacity(numbers.len());
    for x in numbers {
        at.push(*known.entry((x + 0.0).to_bits()).or_insert_with(|| {
            texts.push(label(x + 0.0));
            u32::try_from(texts.len() - 1).expect("a file has few numbers")
        }));
    }
    (texts, at)
}

/// What tells a number from others, if the text is one.
fn number(text: &str) -> Option<u64> {
    text.parse::<f64>().ok().filter(|x| x.is_finite()).map(|x| (x + 0.0).to_bits())
}

/// The labels in order, each once: numbers that are written in two ways are one.
fn in_order(texts: &[String]) -> Vec<String> {
    let numbers: Option<Vec<(f64, &String)>> =
        texts.iter().map(|text| Some((f64::from_bits(number(text)?), text))).collect();
    let Some(mut numbers) = numbers else {
        let mut texts = texts.to_vec();
        texts.sort_unstable();
        return texts;
    };
    numbers.sort_by(|a, b| a.0.total_cmp(&b.0));
    numbers.dedup_by(|a, b| a.0 == b.0);
    numbers.into_iter().map(|(_, text)| text.clone()).collect()
}
