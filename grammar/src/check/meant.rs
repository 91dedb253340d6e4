//! Which coordinates of an axis labels mean.

use std::collections::{BTreeMap, BTreeSet};

use ivx_op::Lit;

use crate::ir::Coord;
use crate::{Advice, suggest};

/// The places along an axis that some labels mean.
pub(super) struct Meant {
    by_label: BTreeMap<String, usize>,
    by_value: BTreeMap<Key, Vec<(usize, Lit)>>,
}

/// What values are looked up by; numbers by the bits of the nearest real.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Key {
    Bool(bool),
    Number(u64),
}

impl Meant {
    /// In one pass over the coordinates.
    pub(super) fn by(labels: &[Lit], coords: &[Coord]) -> Self {
        let wanted: BTreeSet<String> = labels.iter().map(text).collect();
        let values: BTreeSet<Key> = labels.iter().filter_map(key).collect();
        let mut meant = Self { by_label: BTreeMap::new(), by_value: BTreeMap::new() };
        for (place, Coord { label, value }) in coords.iter().enumerate() {
            if wanted.contains(label) {
                meant.by_label.entry(label.clone()).or_insert(place);
            }
            if let Some(key) = key(value).filter(|key| values.contains(key)) {
                meant.by_value.entry(key).or_default().push((place, value.clone()));
            }
        }
        meant
    }

    /// The first place that a label means: a text its label, a number its value.
    pub(super) fn place(&self, label: &Lit) -> Option<usize> {
        match label {
            Lit::Text(text) => self.by_label.get(text).copied(),
            number => self.valued(number).next(),
        }
    }

    /// Another place that a number may mean, by its value or by its label.
    pub(super) fn ambiguous(&self, label: &Lit, place: usize) -> Option<usize> {
        if matches!(label, Lit::Text(_)) {
            return None;
        }
        let labelled = self.by_label.get(&text(label)).copied();
        self.valued(label).chain(labelled).filter(|other| *other != place).min()
    }

    /// The places of a value, in order. Whole numbers equal only themselves.
    fn valued<'l>(&'l self, wanted: &'l Lit) -> impl Iterator<Item = usize> + 'l {
        let known = key(wanted).and_then(|key| self.by_value.get(&key)).into_iter().flatten();
        let same = move |value: &Lit| match (value, wanted) {
            (Lit::Int(a), Lit::Int(b)) => a == b,
            _ => true,
        };
        known.filter(move |(_, value)| same(value)).map(|(place, _)| *place)
    }
}

/// Which labels there are: a number is no misspelling of another.
pub(super) fn labels_help(label: &Lit, coords: &[Coord]) -> Option<Advice> {
    let numeric = coords.iter().all(|coord| coord.label.parse::<f64>().is_ok());
    let known = || coords.iter().map(|coord| coord.label.as_str());
    if !numeric && matches!(label, Lit::Text(_)) {
        return suggest(&text(label), known());
    }
    let show = |label: &str| if numeric { format!("`{label}`") } else { format!("`{label:?}`") };
    let shown: Vec<String> = match coords {
        [] => return None,
        [first @ .., last] if coords.len() > MOST_LABELS => {
            let first = first.iter().take(MOST_LABELS - 2).map(|coord| show(&coord.label));
            first.chain(["..".to_owned(), show(&last.label)]).collect()
        }
        all => all.iter().map(|coord| show(&coord.label)).collect(),
    };
    Some(format!("its labels are {}", shown.join(", ")).into())
}

/// At most so many labels are listed.
const MOST_LABELS: usize = 12;

/// What a coordinate that a label names is called.
pub(super) fn text(label: &Lit) -> String {
    if let Lit::Text(text) = label { text.clone() } else { label.to_string() }
}

/// What a value is looked up by; none if it is neither a number nor a truth value.
fn key(value: &Lit) -> Option<Key> {
    match value {
        Lit::Bool(b) => Some(Key::Bool(*b)),
        // Adding 0 makes 0 of -0, which it equals.
        number => number.as_f64().map(|x| Key::Number((x + 0.0).to_bits())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_mean_the_first_place_of_their_name_or_value() {
        let coords = |values: &[(&str, Lit)]| -> Vec<Coord> {
            let coord = |(label, value): &(&str, Lit)| Coord {
                label: (*label).to_owned(),
                value: value.clone(),
            };
            values.iter().map(coord).collect()
        };
        let large = 1_i64 << 53;
        let axis = coords(&[
            ("2", 7.into()),
            ("zero", Lit::Real(-0.0)),
            ("half", 0.5.into()),
            ("7", 2.0.into()),
            ("large", large.into()),
            ("larger", (large + 1).into()),
            ("yes", Lit::Bool(true)),
        ]);
        let check = |label: Lit, place: Option<usize>, other: Option<usize>| {
            // Among other labels, and alone.
            for labels in [vec!["half".into(), label.clone(), 2.into()], vec![label.clone()]] {
                let meant = Meant::by(&labels, &axis);
                assert_eq!(meant.place(&label), place, "{label}");
                let found = place.and_then(|place| meant.ambiguous(&label, place));
                assert_eq!(found, other, "{label}");
            }
        };
        check("7".into(), Some(3), None);
        check(7.into(), Some(0), Some(3));
        check(2.into(), Some(3), Some(0));
        check(0.into(), Some(1), None);
        check(0.5.into(), Some(2), None);
        check((large + 1).into(), Some(5), None);
        check(large.into(), Some(4), None);
        check(Lit::Bool(true), Some(6), None);
        check("true".into(), None, None);
        check(3.into(), None, None);
    }
}
