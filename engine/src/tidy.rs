//! Measures as rows of one number each, as other programs read them.

use std::collections::BTreeSet;

use ivx_op::Labels;
use ivx_op::escape::{csv as quoted, json_name};
use ivx_op::label;
use serde_json::{Map, Value};

use crate::results::{Measure, Results};

/// The columns that every row has.
const OWN: [&str; 3] = ["experiment", "measure", "value"];

/// Measures, one number a row.
#[derive(Clone, Debug, PartialEq)]
pub struct Tidy {
    /// The columns of all axes and dimensions, in order: their names, but none as another column's.
    pub dims: Vec<String>,
    /// The rows, in the order of experiments, measures and coordinates.
    pub rows: Vec<Row>,
}

/// One number of a measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The experiment.
    pub experiment: String,
    /// The measure.
    pub measure: String,
    /// The coordinates of it; none along what it does not vary over.
    pub at: Vec<Option<Coordinate>>,
    /// The number.
    pub value: f64,
}

/// A coordinate of an axis or dimension.
#[derive(Clone, Debug, PartialEq)]
pub enum Coordinate {
    /// Such as a seed.
    Number(f64),
    /// Such as a method.
    Name(String),
}

/// The measures whose names, `experiment/measure`, begin so, one number a row.
#[must_use]
pub fn tidy(results: &Results, name: &str) -> Tidy {
    let named = results.experiments.iter().flat_map(|(experiment, found)| {
        found.measures.iter().map(move |(measure, values)| (experiment, measure, values))
    });
    let wanted: Vec<(&String, &String, &Measure)> =
        named.filter(|(e, m, _)| format!("{e}/{m}").starts_with(name)).collect();
    let dims = wanted.iter().flat_map(|(.., measure)| &measure.dims);
    let dims: Vec<String> =
        dims.map(|dim| dim.name.clone()).collect::<BTreeSet<_>>().into_iter().collect();
    let mut rows = Vec::new();
    for (experiment, name, measure) in wanted {
        for (i, &value) in measure.values.iter().enumerate() {
            let at = dims.iter().map(|dim| coordinate(measure, dim, i)).collect();
            let (experiment, name) = (experiment.clone(), name.clone());
            rows.push(Row { experiment, measure: name, at, value });
        }
    }
    Tidy { dims: columns(&dims), rows }
}

/// A column for each dimension: `axis_` stands before the name of one that is called like a column of every row.
fn columns(dims: &[String]) -> Vec<String> {
    let taken = |name: &String| OWN.contains(&name.as_str()) || dims.contains(name);
    let column = |dim: &String| {
        let mut name = dim.clone();
        while name != *dim && taken(&name) || OWN.contains(&name.as_str()) {
            name.insert_str(0, "axis_");
        }
        name
    };
    dims.iter().map(column).collect()
}

/// A number of JSON, or the name of what is none there.
pub(crate) fn number(x: f64) -> Value {
    json_name(x).map_or_else(|| x.into(), Value::from)
}

/// Where the `i`-th number of a measure lies along a dimension; last dimension fastest.
fn coordinate(measure: &Measure, dim: &str, mut i: usize) -> Option<Coordinate> {
    for own in measure.dims.iter().rev() {
        let place = i % own.len();
        if own.name == dim {
            return Some(match &own.labels {
                Labels::Numbers(numbers) => Coordinate::Number(numbers[place]),
                Labels::Names(names) => Coordinate::Name(names[place].clone()),
            });
        }
        i /= own.len();
    }
    None
}

impl Tidy {
    /// As comma-separated values, with a line of names; what is not there is empty.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let names =
            ["experiment", "measure"].into_iter().chain(self.dims.iter().map(String::as_str));
        let mut text: String = names.map(|name| quoted(name) + ",").collect();
        text += "value\n";
        for row in &self.rows {
            text += &(quoted(&row.experiment) + "," + &quoted(&row.measure) + ",");
            for coordinate in &row.at {
                match coordinate {
                    Some(Coordinate::Number(x)) => text += &label(*x),
                    Some(Coordinate::Name(name)) => text += &quoted(name),
                    None => {}
                }
                text.push(',');
            }
            text += &(label(row.value) + "\n");
        }
        text
    }

    /// As a list of objects; what is not there has no field, and what is no number of JSON is `"NaN"`,
    /// `"Infinity"` or `"-Infinity"`.
    #[must_use]
    pub fn to_json(&self) -> String {
        let object = |row: &Row| {
            let mut object = Map::new();
            object.insert("experiment".to_owned(), row.experiment.clone().into());
            object.insert("measure".to_owned(), row.measure.clone().into());
            for (dim, coordinate) in self.dims.iter().zip(&row.at) {
                if let Some(coordinate) = coordinate {
                    let value = match coordinate {
                        Coordinate::Number(x) => number(*x),
                        Coordinate::Name(name) => Value::from(name.as_str()),
                    };
                    object.insert(dim.clone(), value);
                }
            }
            object.insert("value".to_owned(), number(row.value));
            Value::Object(object)
        };
        let rows: Vec<String> = self.rows.iter().map(|row| object(row).to_string()).collect();
        format!("[\n{}\n]\n", rows.join(",\n"))
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::Dim;

    use super::*;
    use crate::results::ExperimentResults;

    fn results() -> Results {
        let ke = Dim::new("ke", Labels::Names(vec!["a,\"b\"".into(), "c".into()]));
        let seed = Dim::new("seed", Labels::Numbers(vec![0.0, 1.0]));
        let gap = Measure {
            dims: vec![ke, seed],
            values: vec![0.1, 2.0, f64::NAN, -4.0],
            ..Measure::default()
        };
        let alone = Measure { dims: vec![], values: vec![0.5], ..Measure::default() };
        let measures = [("gap".into(), gap), ("alone".into(), alone)].into();
        let experiment = ExperimentResults { measures, ..ExperimentResults::default() };
        Results { experiments: [("e".into(), experiment)].into(), ..Results::default() }
    }

    #[test]
    fn every_number_has_a_row_with_its_coordinates() {
        let csv = tidy(&results(), "").to_csv();
        let expected = "experiment,measure,ke,seed,value\ne,alone,,,0.5\n\
                        e,gap,\"a,\"\"b\"\"\",0,0.1\ne,gap,\"a,\"\"b\"\"\",1,2\n\
                        e,gap,c,0,NaN\ne,gap,c,1,-4\n";
        assert_eq!(csv, expected);
    }

    #[test]
    fn no_axis_takes_the_place_of_another_column() {
        let names = ["value", "axis_value", "experiment", "measure"];
        let dims = names.map(|name| Dim::new(name, Labels::Numbers(vec![7.0])));
        let values = vec![f64::NEG_INFINITY];
        let mut results = results();
        let measures =
            [("m".to_owned(), Measure { dims: dims.into(), values, ..Measure::default() })].into();
        results.experiments =
            [("e".into(), ExperimentResults { measures, ..Default::default() })].into();
        let tidy = tidy(&results, "");
        assert_eq!(tidy.dims, ["axis_value", "axis_experiment", "axis_measure", "axis_axis_value"]);
        let json: Value = serde_json::from_str(&tidy.to_json()).unwrap();
        assert_eq!(json[0].as_object().unwrap().len(), 7);
        assert_eq!(json[0]["value"], "-Infinity");
    }

    #[test]
    fn only_what_is_asked_for_has_columns() {
        let only = tidy(&results(), "e/al");
        assert_eq!((only.dims.len(), only.rows.len()), (0, 1));
        assert_eq!(
            only.to_json(),
            "[\n{\"experiment\":\"e\",\"measure\":\"alone\",\"value\":0.5}\n]\n"
        );
        assert!(tidy(&results(), "").to_json().contains("\"seed\":0.0,\"value\":\"NaN\""));
        assert!(tidy(&results(), "f").rows.is_empty());
    }
}
