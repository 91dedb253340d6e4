//! Numbers of a file over named dimensions.

use ivx_op::{Args, Array, Dim, Labels, Lit};

use crate::format::{Format, arrays, extension, table};
use crate::json;
use crate::table::{Cells, Column, Style, Values, Want, listed};

/// What arrays are read from, for messages.
pub const ARRAYS: &str = "`.json`, `.csv`, `.tsv`, `.npy`, `.npz`, `.safetensors` or `.parquet`";

/// Whether arrays are read from a file of this name.
#[must_use]
pub(crate) fn is_read(name: &str) -> bool {
    extension(name) == "json" || Format::of(name).is_some()
}

/// The numbers of a file over dimensions.
///
/// - `text`: what stands between cells of text, and whether the first line of it has names.
/// - `field`: which of them: a place in JSON, a column of a table or an array of an archive; empty for all, or the
///   only one.
/// - `dims`: the names of the dimensions, outermost first.
/// - `labels`: those of dimensions by name, where they are not those that the file has.
///
/// # Errors
/// What is wrong with it.
pub fn array(
    name: &str,
    bytes: &[u8],
    (separator, header): (u8, bool),
    field: &str,
    dims: &[String],
    labels: &Args,
) -> Result<Array, String> {
    let (own, values) = match (extension(name), Format::of(name)) {
        ("json", _) => json::array(bytes, field, dims.len())?,
        (_, Some(Format::Text | Format::Parquet)) => {
            let style = Style { separator, header, cells: Cells::Any };
            columns(name, bytes, style, field, dims)?
        }
        (_, Some(_)) => archived(arrays(name, bytes)?, field, dims)?,
        _ => return Err(format!("its name ends in {ARRAYS}")),
    };
    let mut all = Vec::new();
    for (name, own) in dims.iter().zip(own) {
        let labels = match labels.get(name) {
            None => own,
            Some(given) => said(name, given, own.len())?,
        };
        if let Some(again) = twice(&labels) {
            return Err(format!("two places along `{name}` are labelled `{again}`"));
        }
        all.push(Dim::new(name, labels));
    }
    Ok(Array { dims: all, values })
}

/// The labels that a spec says.
///
/// # Errors
/// If they are none, or not so many.
fn said(name: &str, given: &Lit, n: usize) -> Result<Labels, String> {
    let labels = labels(given)
        .ok_or_else(|| format!("the labels of `{name}` are a list of numbers or of texts"))?;
    if labels.len() != n {
        let said = labels.len();
        return Err(format!("`{name}` has {n} places, and `labels` has {said}"));
    }
    Ok(labels)
}

/// A list of numbers or of texts as labels.
#[must_use]
pub(crate) fn labels(given: &Lit) -> Option<Labels> {
    let Lit::List(items) = given else { return None };
    let numbers: Option<Vec<f64>> = items.iter().map(Lit::as_f64).collect();
    let text = |item: &Lit| match item {
        Lit::Text(text) => Some(text.clone()),
        _ => None,
    };
    let texts = || items.iter().map(text).collect::<Option<Vec<String>>>();
    numbers.map(Labels::Numbers).or_else(|| texts().map(Labels::Names))
}

/// The first label that another place has too.
fn twice(labels: &Labels) -> Option<String> {
    let mut seen = std::collections::BTreeSet::new();
    let texts = (0..labels.len()).map(|i| labels.text(i));
    texts.into_iter().find(|text| !seen.insert(text.clone()))
}

/// Texts as labels: numbers where all are such.
fn read_as(texts: Vec<String>) -> Labels {
    let number = |text: &String| text.parse::<f64>().ok().filter(|x| x.is_finite());
    match texts.iter().map(number).collect::<Option<Vec<f64>>>() {
        Some(numbers) => Labels::Numbers(numbers),
        None => Labels::Names(texts),
    }
}

/// Whether what should be names of columns are numbers, and not their places from 0.
fn are_values(names: &[String]) -> bool {
    let places = names.iter().enumerate().all(|(i, name)| *name == i.to_string());
    !places && names.iter().all(|name| name.parse::<f64>().is_ok())
}

type Read = (Vec<Labels>, Vec<f64>);

/// Columns: one of them, or all as a second dimension.
fn columns(
    name: &str,
    bytes: &[u8],
    style: Style,
    field: &str,
    dims: &[String],
) -> Result<Read, String> {
    let rows = dims.first().map_or("", String::as_str);
    let mut labelled = None;
    let mut wanted = |names: &[String]| {
        // The column that is called as the rows are, or the first without a name.
        let is_label = |(i, name): (usize, &String)| name == rows || i == 0 && name.is_empty();
        let found = names.iter().enumerate().position(is_label);
        labelled = found.map(|i| names[i].clone()).filter(|own| own != field || field.is_empty());
        if style.header && labelled.is_none() && are_values(names) {
            return Err(format!(
                "the first line, which names columns, holds numbers: say `header: false` if they are values, and if they \
                 are labels call the first column `{rows}`"
            ));
        }
        let own = |name: &String| labelled.as_ref() != Some(name);
        let values: Vec<&String> = names.iter().filter(|name| own(name)).collect();
        match (dims.len(), field, values.len()) {
            (1, "", 1) | (2, "", _) => {}
            (1, "", _) => {
                return Err(format!(
                    "`field` says which of its columns: {}; two names in `dims` take all",
                    listed(names)
                ));
            }
            (1, field, _) if values.iter().any(|name| *name == field) => {}
            (1, field, _) => {
                return Err(format!("it has no column `{field}`; it has {}", listed(names)));
            }
            (2, ..) => return Err("one column has one dimension, and `dims` has two".to_owned()),
            (n, ..) => return Err(format!("a table has 1 or 2 dimensions, and `dims` has {n}")),
        }
        let want = |name: &String| match () {
            () if labelled.as_ref() == Some(name) => Want::Texts,
            () if field.is_empty() || name == field => Want::Numbers,
            () => Want::Nothing,
        };
        Ok(names.iter().map(want).collect())
    };
    let table = table(name, bytes, style, &mut wanted)?;
    let (labels, values): (Vec<Column>, Vec<Column>) =
        table.columns.into_iter().partition(|column| labelled.as_ref() == Some(&column.name));
    let n = values.first().and_then(|column| column.len).unwrap_or_default();
    let mut own = match labels.into_iter().next().map(|column| column.values) {
        None => vec![Labels::count(n)],
        Some(Values::Numbers(numbers)) => vec![Labels::Numbers(numbers)],
        Some(Values::Texts(texts, at)) => {
            vec![read_as(at.into_iter().map(|at| texts[at as usize].clone()).collect())]
        }
    };
    if dims.len() == 2 {
        own.push(read_as(values.iter().map(|column| column.name.clone()).collect()));
    }
    let numbers = values.iter().map(|column| match &column.values {
        Values::Numbers(numbers) if column.item.is_empty() => Ok(&numbers[..]),
        _ => Err(format!("`{}` holds no numbers", column.name)),
    });
    let numbers: Vec<&[f64]> = numbers.collect::<Result<_, String>>()?;
    let values = (0..n).flat_map(|row| numbers.iter().map(move |column| column[row])).collect();
    Ok((own, values))
}

/// One array of several.
fn archived(mut all: Vec<Column>, field: &str, dims: &[String]) -> Result<Read, String> {
    let names: Vec<String> = all.iter().map(|column| column.name.clone()).collect();
    let others: Vec<usize> = (0..all.len()).filter(|i| !dims.contains(&names[*i])).collect();
    let place = match (field, &others[..]) {
        ("", [one]) => *one,
        ("", _) if names.len() == 1 => 0,
        ("", _) => {
            return Err(format!("`field` says which of its arrays: {}", listed(&names)));
        }
        (field, _) => names
            .iter()
            .position(|name| name == field)
            .ok_or_else(|| format!("it has no array `{field}`; it has {}", listed(&names)))?,
    };
    let Column { name, len, item, values } = all.remove(place);
    let shape: Vec<usize> = len.into_iter().chain(item).collect();
    let called = if name.is_empty() { "it".to_owned() } else { format!("`{name}`") };
    let Values::Numbers(numbers) = values else { return Err(format!("{called} holds texts")) };
    if shape.len() != dims.len() {
        let n = dims.len();
        return Err(format!("{called} is of the shape {shape:?}, and `dims` has {n}"));
    }
    // An array that is called as a dimension holds its labels.
    let labels = dims.iter().zip(&shape).map(|(dim, n)| {
        let column = all.iter().find(|column| column.name == *dim);
        let Some(column) = column else { return Ok(Labels::count(*n)) };
        if column.shape() != [*n] {
            let shape = column.shape();
            return Err(format!("`{dim}` is of the shape {shape:?}, and labels {n} places"));
        }
        Ok(match &column.values {
            Values::Numbers(numbers) => Labels::Numbers(numbers.clone()),
            Values::Texts(texts, at) => {
                Labels::Names(at.iter().map(|at| texts[*at as usize].clone()).collect())
            }
        })
    });
    Ok((labels.collect::<Result<_, String>>()?, numbers))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::npz;

    fn read(name: &str, text: &[u8], field: &str, dims: &[&str]) -> Result<Array, String> {
        let dims: Vec<String> = dims.iter().map(ToString::to_string).collect();
        array(name, text, (b',', true), field, &dims, &Args::new())
    }

    fn names(names: &[&str]) -> Labels {
        Labels::Names(names.iter().map(ToString::to_string).collect())
    }

    fn check(found: Result<Array, String>, labels: &[Labels], values: &[f64]) {
        let found = found.unwrap();
        assert_eq!(found.values, values);
        assert!(found.dims.iter().map(|dim| &dim.labels).eq(labels), "{:?}", found.dims);
    }

    #[test]
    fn columns_are_curves_and_matrices() {
        let text = b"epoch,loss,acc\n1,0.5,0.25\n5,nan,inf\n";
        let at = Labels::Numbers(vec![1.0, 5.0]);
        let both = [at.clone(), names(&["loss", "acc"])];
        let found = read("a.csv", text, "", &["epoch", "what"]).unwrap();
        assert!(found.dims.iter().map(|dim| &dim.labels).eq(&both));
        assert!(found.values[2].is_nan() && found.values[3] == f64::INFINITY);
        let acc = read("a.csv", text, "acc", &["epoch"]);
        check(acc, &[at], &[0.25, f64::INFINITY]);
        check(read("a.csv", text, "epoch", &["row"]), &[Labels::count(2)], &[1.0, 5.0]);
        // As pandas writes a confusion matrix.
        let text = b",cat,dog\ncat,5,1\ndog,0,7\n";
        let both = [names(&["cat", "dog"]), names(&["cat", "dog"])];
        check(read("m.csv", text, "", &["actual", "predicted"]), &both, &[5.0, 1.0, 0.0, 7.0]);
        check(read("m.csv", b"v\n1\n2\n", "", &["i"]), &[Labels::count(2)], &[1.0, 2.0]);
        let text = b"0,1\n5,1\n2,7\n";
        let both = [Labels::count(2), Labels::count(2)];
        check(read("m.csv", text, "", &["a", "b"]), &both, &[5.0, 1.0, 2.0, 7.0]);
    }

    #[test]
    fn arrays_have_the_labels_that_lie_beside_them() {
        let x = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let file = npz::write(&[("q", &[2, 3], &x), ("state", &[2], &[10.0, 20.0])]);
        let at = [Labels::Numbers(vec![10.0, 20.0]), Labels::count(3)];
        check(read("q.npz", &file, "", &["state", "action"]), &at, &x);
        check(read("q.npz", &file, "state", &["i"]), &[Labels::count(2)], &[10.0, 20.0]);
        let said = [("action".to_owned(), Lit::from(vec!["l".into(), "r".into(), Lit::from("u")]))];
        let dims = ["state", "action"].map(str::to_owned);
        let found =
            array("q.npz", &file, (b',', true), "q", &dims, &said.into_iter().collect()).unwrap();
        assert_eq!(found.dims[1].labels, names(&["l", "r", "u"]));
        let npy = crate::npy::write("|u1", &[2], [3, 4].into_iter());
        check(read("a.npy", &npy, "", &["i"]), &[Labels::count(2)], &[3.0, 4.0]);
    }

    #[test]
    fn what_is_there_instead_is_told() {
        let check = |found: Result<Array, String>, expected: &str| {
            let why = found.unwrap_err();
            assert!(why.contains(expected), "{why}");
        };
        let text = b"epoch,loss,acc\n1,0.5,0.25\n1,2,3\n";
        check(read("a.csv", text, "", &["epoch"]), "`field` says which of its columns");
        check(read("a.csv", text, "los", &["epoch"]), "no column `los`; it has `epoch`, `loss`");
        check(read("a.csv", text, "", &["a", "b", "c"]), "1 or 2 dimensions");
        check(read("a.csv", text, "loss", &["epoch"]), "two places along `epoch` are labelled `1`");
        check(read("a.csv", b"a\n1\n\n2\n", "", &["i"]), "line 3 has no value");
        check(read("a.csv", b"a\nx\n", "", &["i"]), "line 2, column `a`: `x` is no number");
        check(read("a.txt", b"", "", &["i"]), "its name ends in");
        let file = npz::write(&[("q", &[2], &[1.0, 2.0]), ("i", &[1], &[10.0])]);
        check(read("q.npz", &file, "", &["i"]), "`i` is of the shape [1], and labels 2 places");
        check(read("q.npz", &file, "q", &["i", "j"]), "`q` is of the shape [2], and `dims` has 2");
        check(read("q.npz", &file, "z", &["i"]), "no array `z`");
        check(read("q.npz", &file, "", &["z"]), "`field` says which of its arrays: `i`, `q`");
        let labels = [("i".to_owned(), Lit::from(vec![1.0, 2.0]))].into_iter().collect();
        let dims = ["i".to_owned()];
        check(array("a.json", b"[1]", (b',', true), "", &dims, &labels), "`i` has 1 places");
    }

    /// What `np.savetxt(.., delimiter=",")` writes has no names.
    #[test]
    fn numbers_are_no_names() {
        let why = read("a.csv", b"0.5\n0.4\n0.3\n", "", &["i"]).unwrap_err();
        assert!(why.contains("say `header: false`"), "{why}");
        assert!(read("a.csv", b"5,1\n0,7\n", "", &["actual", "predicted"]).is_err());
        let dims = ["i".to_owned(), "j".to_owned()];
        let all = array("a.csv", b"5,1\n0,7\n", (b',', false), "", &dims, &Args::new()).unwrap();
        assert_eq!(
            (all.values, all.dims[1].labels.text(1)),
            (vec![5.0, 1.0, 0.0, 7.0], "1".into())
        );
        // Places are names, and a column of labels says that the others are too.
        assert_eq!(read("a.csv", b"0,1\n5,7\n", "", &["i", "j"]).unwrap().values, [5.0, 7.0]);
        assert_eq!(read("a.csv", b"i,0.5\n3,7\n", "", &["i", "j"]).unwrap().values, [7.0]);
    }
}
