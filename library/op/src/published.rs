//! Published numbers: what a paper's table says, as a file.

use std::collections::BTreeSet;
use std::fmt;

use ron::extensions::Extensions;
use serde::Deserialize;

use crate::{Dim, Labels, label as written};

/// Numbers over named dimensions, some of them missing.
#[derive(Clone, Debug, PartialEq)]
pub struct Published {
    /// Where they are published.
    pub source: String,
    /// The dimensions, outermost first; names are unique.
    pub dims: Vec<Dim>,
    /// One number a coordinate, last dimension fastest; none where the paper has none.
    pub values: Vec<Option<f64>>,
    /// Their standard errors, in the same order, where the paper gives any.
    pub errors: Option<Vec<Option<f64>>>,
}

/// A file as written.
#[derive(Deserialize)]
#[serde(rename = "Published", deny_unknown_fields)]
struct File {
    source: String,
    axes: Vec<(String, Vec<Label>)>,
    values: Vec<Option<f64>>,
    errors: Option<Vec<Option<f64>>>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Label {
    Number(f64),
    Name(String),
}

/// A whole number as a real one; none where that could be another.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "it is exact up to 2^53")]
pub fn exact(n: i64) -> Option<f64> {
    (n.unsigned_abs() <= 1 << 53).then_some(n as f64)
}

/// Whether a text is a whole number, without a point or a power of ten, that would be rounded.
#[must_use]
pub fn is_rounded(number: &str) -> bool {
    let digits = number.trim_start_matches(['-', '+']);
    let is_whole = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    is_whole && number.parse().ok().and_then(exact).is_none()
}

/// Whether a number is written that is not 0 and is read as 0.
#[must_use]
pub fn vanishes(number: &str) -> bool {
    let mantissa = number.split(['e', 'E']).next().unwrap_or(number);
    number.parse() == Ok(0.0) && mantissa.bytes().any(|byte| matches!(byte, b'1'..=b'9'))
}

/// What is said of a whole number that would be rounded.
#[must_use]
pub fn too_large(n: impl fmt::Display) -> String {
    format!("holds {n}, which is too large to be exact")
}

/// Whether each whole number of a file is one of the reals that it is read as.
fn rounds_nothing(text: &str) -> Result<(), String> {
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let line = || 1 + text[..text.len() - rest.len()].matches('\n').count();
        let word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '+' | '-');
        let end = match c {
            '"' => {
                let mut is_escaped = false;
                let ends = |c: char| {
                    let ends = c == '"' && !is_escaped;
                    is_escaped = c == '\\' && !is_escaped;
                    ends
                };
                rest[1..].find(ends).map(|end| end + 2)
            }
            '/' if rest.starts_with("//") => rest.find('\n'),
            '/' if rest.starts_with("/*") => rest.find("*/").map(|end| end + 2),
            c if word(c) => {
                let end = rest.find(|c| !word(c)).unwrap_or(rest.len());
                let number = rest[..end].replace('_', "");
                if is_rounded(&number) {
                    return Err(format!("line {}: it {}", line(), too_large(&number)));
                }
                Some(end)
            }
            c => Some(c.len_utf8()),
        };
        rest = &rest[end.unwrap_or(rest.len())..];
    }
    Ok(())
}

/// The numbers of a file.
///
/// # Errors
/// What is wrong with the text, for its author.
pub fn read_published(text: &str) -> Result<Published, String> {
    rounds_nothing(text)?;
    let options = ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
    let File { source, axes, values, errors } = options.from_str(text).map_err(|error| {
        format!("line {}, column {}: {}", error.span.start.line, error.span.start.col, error.code)
    })?;
    let mut names = BTreeSet::new();
    for (name, _) in &axes {
        let letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if name.is_empty()
            || name.starts_with(|c: char| c.is_ascii_digit())
            || !name.chars().all(letter)
        {
            return Err(format!("axis {name:?} is no name of letters, digits and `_`"));
        }
        if name == "seed" {
            return Err("an axis is called `seed`: what is published draws nothing".to_owned());
        }
        if !names.insert(name) {
            return Err(format!("axis `{name}` is there twice"));
        }
    }
    let dims = axes.into_iter().map(|(name, labels)| dim(name, &labels));
    let dims: Vec<Dim> = dims.collect::<Result<_, _>>()?;
    let sizes: Vec<String> = dims.iter().map(|dim| format!("{} {}", dim.len(), dim.name)).collect();
    let n = dims.iter().map(Dim::len).fold(1, usize::saturating_mul);
    for (what, numbers) in [("values", Some(&values)), ("errors", errors.as_ref())] {
        let Some(numbers) = numbers else { continue };
        if numbers.len() != n {
            let of =
                if sizes.is_empty() { String::new() } else { format!(" ({})", sizes.join(" × ")) };
            return Err(format!("there are {} {what} for {n} coordinates{of}", numbers.len()));
        }
        if let Some(odd) = numbers.iter().flatten().find(|x| !x.is_finite()) {
            return Err(format!("one of the {what} is {odd}; write `None` where there is none"));
        }
    }
    if let Some(odd) = errors.iter().flatten().flatten().find(|x| **x < 0.0) {
        return Err(format!("one of the errors is {odd}, and standard errors are at least 0"));
    }
    Ok(Published { source, dims, values, errors })
}

/// The dimension; its labels are numbers if all are.
fn dim(name: String, labels: &[Label]) -> Result<Dim, String> {
    let text = |label: &Label| match label {
        Label::Number(x) => written(*x),
        Label::Name(name) => name.clone(),
    };
    let texts: Vec<String> = labels.iter().map(text).collect();
    if texts.is_empty() {
        return Err(format!("axis `{name}` has no labels"));
    }
    let mut seen = BTreeSet::new();
    if let Some(again) = texts.iter().find(|label| !seen.insert(label.as_str())) {
        return Err(format!("axis `{name}` has the label `{again}` twice"));
    }
    let number = |label: &Label| if let Label::Number(x) = label { Some(*x) } else { None };
    let labels = match labels.iter().map(number).collect::<Option<Vec<f64>>>() {
        Some(numbers) if numbers.iter().all(|x| x.is_finite()) => Labels::Numbers(numbers),
        Some(_) => return Err(format!("a label of axis `{name}` is not finite")),
        None => Labels::Names(texts),
    };
    Ok(Dim { name, labels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_labels_and_may_be_missing() {
        let text = r#"(
            source: "Table 1",
            axes: [("method", ["A", "B"]), ("n", [5, 0.5])],
            values: [0.1, None, 3, -4.5],
            errors: [0.0, None, None, 2],
        )"#;
        let read = read_published(text).unwrap();
        let names = Labels::Names(vec!["A".into(), "B".into()]);
        let dims = vec![Dim::new("method", names), Dim::new("n", Labels::Numbers(vec![5.0, 0.5]))];
        assert_eq!((read.source.as_str(), read.dims), ("Table 1", dims));
        assert_eq!(read.values, [Some(0.1), None, Some(3.0), Some(-4.5)]);
        assert_eq!(read.errors, Some(vec![Some(0.0), None, None, Some(2.0)]));
        let scalar = read_published(r#"(source: "p. 3", axes: [], values: [7.0])"#).unwrap();
        assert_eq!((scalar.dims, scalar.values, scalar.errors), (vec![], vec![Some(7.0)], None));
        let mixed = r#"(source: "", axes: [("a", ["x", 2])], values: [1, 2])"#;
        let labels = Labels::Names(vec!["x".into(), "2".into()]);
        assert_eq!(read_published(mixed).unwrap().dims[0].labels, labels);
    }

    #[test]
    fn numbers_are_read_to_the_bit() {
        let mut bits = 1_u64;
        for _ in 0..5_000 {
            bits = bits
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let x = f64::from_bits(bits);
            if !x.is_finite() {
                continue;
            }
            for text in [format!("{x:?}"), format!("{x:e}")] {
                let read = format!("(source: \"\", axes: [(\"a\", [{text}])], values: [{text}])");
                let read = read_published(&read).unwrap();
                assert_eq!(read.values[0].unwrap().to_bits(), x.to_bits(), "{text}");
                assert_eq!(read.dims[0].labels, Labels::Numbers(vec![x]), "{text}");
            }
        }
        let read = |x: &str| read_published(&format!("(source: \"\", axes: [], values: [{x}])"));
        assert_eq!(read("9007199254740992").unwrap().values, [Some(9_007_199_254_740_992.0)]);
        for odd in ["9007199254740993", "-9007199254740993", "18446744073709551615"] {
            let why = read(odd).unwrap_err();
            assert!(why.contains(&format!("{odd}, which is too large to be exact")), "{why}");
        }
        assert_eq!(read("9007199254740993.0").unwrap().values, [Some(9_007_199_254_740_992.0)]);
        assert!(read("\"1\"").is_err());
    }

    #[test]
    fn many_labels_are_told_apart() {
        let n = 200_000;
        let mut labels: Vec<String> = (0..n).map(|i| format!("\"label {i}\"")).collect();
        let text = |labels: &[String]| {
            let values = "1,".repeat(labels.len());
            format!("(source: \"\", axes: [(\"a\", [{}])], values: [{values}])", labels.join(","))
        };
        assert_eq!(read_published(&text(&labels)).unwrap().dims[0].len(), n);
        labels.push(labels[n - 1].clone());
        let twice = format!("axis `a` has the label `label {}` twice", n - 1);
        assert_eq!(read_published(&text(&labels)), Err(twice));
    }

    #[test]
    fn what_is_wrong_is_told() {
        let check = |rest: &str, expected: &str| {
            let why = read_published(&format!("(source: \"\", {rest})")).unwrap_err();
            assert_eq!(why, expected);
        };
        check(
            "axes: [(\"a b\", [1])], values: [1]",
            "axis \"a b\" is no name of letters, digits and `_`",
        );
        check("axes: [(\"a\", [1]), (\"a\", [1])], values: [1]", "axis `a` is there twice");
        check("axes: [(\"a\", [])], values: []", "axis `a` has no labels");
        check("axes: [(\"a\", [1, 1.0])], values: [1, 2]", "axis `a` has the label `1` twice");
        check("axes: [(\"a\", [inf])], values: [1]", "a label of axis `a` is not finite");
        check(
            "axes: [(\"seed\", [1])], values: [1]",
            "an axis is called `seed`: what is published draws nothing",
        );
        check(
            "axes: [(\"a\", [1, 2]), (\"b\", [3])], values: [1]",
            "there are 1 values for 2 coordinates (2 a × 1 b)",
        );
        check("axes: [], values: [1], errors: []", "there are 0 errors for 1 coordinates");
        check(
            "axes: [], values: [NaN]",
            "one of the values is NaN; write `None` where there is none",
        );
        check(
            "axes: [], values: [1], errors: [-1]",
            "one of the errors is -1, and standard errors are at least 0",
        );
        let why = read_published("(source: \"\",\n axes: [], value: [1])").unwrap_err();
        assert!(why.starts_with("line 2, column 1") && why.contains("value"), "{why}");
        assert!(read_published("").is_err());
    }
}
