//! Numbers in JSON.

use std::collections::BTreeMap;
use std::fmt;

use ivx_op::{Labels, is_rounded, too_large, vanishes};
use serde::Deserialize as _;
use serde_json::value::RawValue;
use serde_json::{Deserializer, Value, from_str};

use crate::table::listed;

/// The number at a place, to the bit.
///
/// - `field`: names of fields and places in lists, with dots between; empty where the file is the number.
///
/// # Errors
/// What is there instead.
pub fn number(bytes: &[u8], field: &str) -> Result<f64, String> {
    at(bytes, field, |value, place| one(value).map_err(|why| format!("{place} {why}")))
}

/// The labels of each dimension and the numbers, last dimension fastest, of lists and objects in each other.
///
/// - `field`: as for [`number`].
/// - `n_dims`: how deep they lie. Lists have labels from 0, and objects the names of their fields, which all on a
///   level have in common.
///
/// # Errors
/// What is there instead.
pub fn array(bytes: &[u8], field: &str, n_dims: usize) -> Result<(Vec<Labels>, Vec<f64>), String> {
    at(bytes, field, |value, place| {
        let mut found = Found { levels: vec![None; n_dims], numbers: Vec::new() };
        found.add(value, 0, place)?;
        // What is empty ends before its dimensions do.
        let labels = found.levels.into_iter().map(|level| match level {
            None => Labels::count(0),
            Some(Level::List(n)) => Labels::count(n),
            Some(Level::Object(names)) => Labels::Names(names),
        });
        Ok((labels.collect(), found.numbers))
    })
}

/// What a level of lists or objects has.
#[derive(Clone)]
enum Level {
    List(usize),
    Object(Vec<String>),
}

struct Found {
    levels: Vec<Option<Level>>,
    numbers: Vec<f64>,
}

impl Found {
    fn add(&mut self, value: &RawValue, depth: usize, place: &str) -> Result<(), String> {
        let inside = |part: &str| match place {
            "it" => format!("`{part}`"),
            place => format!("`{}.{part}`", place.trim_matches('`')),
        };
        let Some(level) = self.levels.get(depth) else {
            let number = one(value).map_err(|why| {
                let more = matches!(value.get().as_bytes().first(), Some(b'[' | b'{'));
                let help = ": `dims` has a name for each level of lists";
                format!("{place} {why}{}", if more { help } else { "" })
            });
            self.numbers.push(number?);
            return Ok(());
        };
        let level = level.clone();
        if let Some(fields) = fields(value) {
            let names: Vec<String> = fields.iter().map(|(name, _)| name.clone()).collect();
            let mut by_name = BTreeMap::new();
            for (name, value) in fields {
                if by_name.insert(name.clone(), value).is_some() {
                    return Err(format!("{place} has `{name}` twice"));
                }
            }
            let known = match level {
                None => names,
                Some(Level::Object(known)) => {
                    let has = |name: &String| by_name.contains_key(name);
                    if known.len() != by_name.len() || !known.iter().all(has) {
                        let (names, known) = (listed(&names), listed(&known));
                        return Err(format!("{place} has {names}, and those before it {known}"));
                    }
                    known
                }
                Some(Level::List(_)) => {
                    let found = described(value);
                    return Err(format!("{place} is {found}, and those before it are lists"));
                }
            };
            self.levels[depth] = Some(Level::Object(known.clone()));
            for name in known {
                self.add(by_name[&name], depth + 1, &inside(&name))?;
            }
            return Ok(());
        }
        let Ok(items) = from_str::<Vec<&RawValue>>(value.get()) else {
            let missing = self.levels.len() - depth;
            return Err(format!(
                "{place} is {}, and {missing} more of the dimensions are to be found in it",
                described(value)
            ));
        };
        match level {
            Some(Level::List(n)) if n != items.len() => {
                let own = items.len();
                return Err(format!("{place} is a list of {own}, and those before it of {n}"));
            }
            Some(Level::Object(_)) => {
                let found = described(value);
                return Err(format!("{place} is {found}, and those before it are objects"));
            }
            _ => self.levels[depth] = Some(Level::List(items.len())),
        }
        for (i, item) in items.into_iter().enumerate() {
            self.add(item, depth + 1, &inside(&i.to_string()))?;
        }
        Ok(())
    }
}

/// What `read` makes of the value at a place, of which it is told what it is called.
fn at<T>(
    bytes: &[u8],
    field: &str,
    read: impl FnOnce(&RawValue, &str) -> Result<T, String>,
) -> Result<T, String> {
    let (text, places) = quoted(bytes);
    let mut value: &RawValue = serde_json::from_slice(&text)
        .map_err(|error| format!("it is not JSON: {}", told(&error, &text, &places)))?;
    let mut seen = String::new();
    let called = |seen: &str| if seen.is_empty() { "it".to_owned() } else { format!("`{seen}`") };
    for part in field.split('.').filter(|_| !field.is_empty()) {
        value = inner(value, part).ok_or_else(|| {
            format!("{} is {} and has no `{part}`", called(&seen), described(value))
        })?;
        seen = if seen.is_empty() { part.to_owned() } else { format!("{seen}.{part}") };
    }
    read(value, &called(&seen))
}

/// The fields of an object, in the order of the file.
struct Fields<'a>(Vec<(String, &'a RawValue)>);

impl<'de> serde::Deserialize<'de> for Fields<'de> {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> serde::de::Visitor<'de> for Visitor {
            type Value = Fields<'de>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }
            fn visit_map<A: serde::de::MapAccess<'de>>(
                self,
                mut map: A,
            ) -> Result<Self::Value, A::Error> {
                let mut fields = Vec::new();
                while let Some(field) = map.next_entry()? {
                    fields.push(field);
                }
                Ok(Fields(fields))
            }
        }
        from.deserialize_map(Visitor)
    }
}

fn fields(value: &RawValue) -> Option<Vec<(String, &RawValue)>> {
    let is_object = value.get().starts_with('{');
    let fields = is_object.then(|| Fields::deserialize(&mut Deserializer::from_str(value.get())));
    fields?.ok().map(|Fields(fields)| fields)
}

/// What an object or a list has at a place; of two fields with one name the last, as most readers have it.
fn inner<'a>(value: &'a RawValue, part: &str) -> Option<&'a RawValue> {
    if let Some(fields) = fields(value) {
        return fields.into_iter().rev().find(|(name, _)| name == part).map(|(_, value)| value);
    }
    let items: Vec<&RawValue> = from_str(value.get()).ok()?;
    part.parse().ok().and_then(|i: usize| items.get(i).copied())
}

/// The file with quotes around what is not JSON and Python writes for numbers that JSON lacks, and where these are.
fn quoted(bytes: &[u8]) -> (Vec<u8>, Vec<usize>) {
    let mut out = Vec::with_capacity(bytes.len());
    let mut places = Vec::new();
    let mut rest = bytes;
    let mut in_text = false;
    while let [first, after @ ..] = rest {
        let names = [&b"NaN"[..], b"Infinity", b"-Infinity"];
        let name = names.into_iter().find(|name| !in_text && rest.starts_with(name));
        if let Some(name) = name {
            places.extend([out.len(), out.len() + name.len() + 1]);
            out.extend([b"\"", name, b"\""].concat());
            rest = &rest[name.len()..];
            continue;
        }
        out.push(*first);
        rest = after;
        match (first, rest) {
            (b'"', _) => in_text = !in_text,
            (b'\\', [escaped, after @ ..]) if in_text => {
                out.push(*escaped);
                rest = after;
            }
            _ => {}
        }
    }
    (out, places)
}

/// What is wrong and where in the file, which has no quotes at these places.
fn told(error: &serde_json::Error, text: &[u8], places: &[usize]) -> String {
    let (line, column) = (error.line(), error.column());
    let begin: usize = text.split(|byte| *byte == b'\n').take(line - 1).map(|l| l.len() + 1).sum();
    let added = places.iter().filter(|place| (begin..begin + column).contains(place)).count();
    let why = error.to_string();
    let why = why.split(" at line ").next().unwrap_or_default();
    format!("{why} at line {line}, column {}", column - added)
}

/// The number, to the bit; what JSON has no numbers for is a text. A whole number that would be rounded is none.
fn one(value: &RawValue) -> Result<f64, String> {
    let text = value.get();
    match text {
        "\"NaN\"" => return Ok(f64::NAN),
        "\"Infinity\"" | "\"inf\"" => return Ok(f64::INFINITY),
        "\"-Infinity\"" | "\"-inf\"" => return Ok(f64::NEG_INFINITY),
        _ => {}
    }
    let is_number = text.starts_with(|c: char| c == '-' || c.is_ascii_digit());
    match text.parse::<f64>() {
        Ok(_) if is_number && vanishes(text) => {
            Err(format!("holds {text}, which is so small that it would be 0"))
        }
        Ok(_) if is_rounded(text) => Err(too_large(text)),
        Ok(x) if is_number && x.is_finite() => Ok(x),
        Ok(_) if is_number => Err(format!("holds {text}, which is too large for a number")),
        _ => Err(format!("is {} and no number", described(value))),
    }
}

fn described(value: &RawValue) -> String {
    match from_str(value.get()).unwrap_or_default() {
        Value::Null => "null".to_owned(),
        Value::Bool(_) => "true or false".to_owned(),
        Value::Number(_) => "a number".to_owned(),
        Value::String(_) => "text".to_owned(),
        Value::Array(items) => format!("a list of {}", items.len()),
        Value::Object(fields) => {
            let names: Vec<&str> = fields.keys().take(8).map(String::as_str).collect();
            format!("an object of {}", names.join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::npz::tests::random_numbers;

    #[test]
    fn every_number_comes_back() {
        for x in random_numbers(5_000) {
            let text = ivx_op::escape::json_name(x)
                .map_or_else(|| serde_json::json!(x).to_string(), |name| format!("{name:?}"));
            let back = number(text.as_bytes(), "").unwrap();
            assert!(back.to_bits() == x.to_bits() || back.is_nan() && x.is_nan(), "{x:e}: {text}");
        }
    }

    fn names(names: &[&str]) -> Labels {
        Labels::Names(names.iter().map(ToString::to_string).collect())
    }

    #[test]
    fn lists_and_objects_are_dimensions() {
        let check = |text: &str, field: &str, n, labels: Vec<Labels>, numbers: &[f64]| {
            let found = array(text.as_bytes(), field, n);
            assert_eq!(found, Ok((labels, numbers.to_vec())), "{text}");
        };
        check("[1, 2.5]", "", 1, vec![Labels::count(2)], &[1.0, 2.5]);
        check("{\"a\": {\"b\": [3]}}", "a.b", 1, vec![Labels::count(1)], &[3.0]);
        let two = || vec![Labels::count(2), Labels::count(2)];
        check("[[1, 2], [3, 4]]", "", 2, two(), &[1.0, 2.0, 3.0, 4.0]);
        let named = vec![names(&["val", "train"]), Labels::count(2)];
        check("{\"val\": [1, 2], \"train\": [3, 4]}", "", 2, named, &[1.0, 2.0, 3.0, 4.0]);
        let each = vec![Labels::count(2), names(&["loss", "acc"])];
        let text = "[{\"loss\": 1, \"acc\": 2}, {\"acc\": 4, \"loss\": 3}]";
        check(text, "", 2, each, &[1.0, 2.0, 3.0, 4.0]);
        check("[]", "", 2, vec![Labels::count(0), Labels::count(0)], &[]);
        check("7", "", 0, vec![], &[7.0]);
        let (_, odd) = array(b"[NaN, -Infinity, \"Infinity\"]", "", 1).unwrap();
        assert!(odd[0].is_nan() && odd[1..] == [f64::NEG_INFINITY, f64::INFINITY]);
    }

    #[test]
    fn what_is_uneven_is_told() {
        let check = |text: &str, n, expected: &str| {
            assert_eq!(array(text.as_bytes(), "", n), Err(expected.to_owned()));
        };
        check("[1, null]", 1, "`1` is null and no number");
        check("[[1, 2], [3]]", 2, "`1` is a list of 1, and those before it of 2");
        check(
            "[[1]]",
            1,
            "`0` is a list of 1 and no number: `dims` has a name for each level of lists",
        );
        check("[1]", 2, "`0` is a number, and 1 more of the dimensions are to be found in it");
        check("[{\"a\": 1}, {\"b\": 1}]", 2, "`1` has `b`, and those before it `a`");
        check("[{\"a\": 1}, [1]]", 2, "`1` is a list of 1, and those before it are objects");
        check("{\"a\": 1, \"a\": 2}", 1, "it has `a` twice");
        let deep = "[".repeat(100_000);
        assert!(array(deep.as_bytes(), "", 3).unwrap_err().contains("not JSON"));
    }
}
