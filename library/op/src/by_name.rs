//! A few values by name.

use std::iter::Map;
use std::ops::Index;
use std::slice;
use std::vec;

use serde::{Deserialize, Serialize};

/// A few values by name, in the order of their names, in one piece of memory: a spec has as many
/// as it has calls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    from = "Vec<(String, V)>",
    into = "Vec<(String, V)>",
    bound(serialize = "V: Clone + Serialize")
)]
pub struct ByName<V>(Vec<(String, V)>);

impl<V> ByName<V> {
    /// Nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self(Vec::new())
    }

    /// The value of a name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&V> {
        self.place(name).ok().map(|place| &self.0[place].1)
    }

    /// Whether a name has a value.
    #[must_use]
    pub fn contains_key(&self, name: &str) -> bool {
        self.place(name).is_ok()
    }

    /// Gives a name a value and returns the one that it had. Takes as long as there are values.
    pub fn insert(&mut self, name: String, value: V) -> Option<V> {
        match self.place(&name) {
            Ok(place) => Some(std::mem::replace(&mut self.0[place].1, value)),
            Err(place) => {
                self.0.insert(place, (name, value));
                None
            }
        }
    }

    /// Takes the value of a name.
    pub fn remove(&mut self, name: &str) -> Option<V> {
        self.place(name).ok().map(|place| self.0.remove(place).1)
    }

    /// Keeps what `keep` is true of.
    pub fn retain(&mut self, mut keep: impl FnMut(&String, &mut V) -> bool) {
        self.0.retain_mut(|(name, value)| keep(name, value));
    }

    /// Takes everything.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The names and values, by name.
    pub fn iter(&self) -> Iter<'_, V> {
        self.into_iter()
    }

    /// The names, in their order.
    pub fn keys(&self) -> impl Iterator<Item = &String> {
        self.0.iter().map(|(name, _)| name)
    }

    /// The values, in the order of their names.
    pub fn values(&self) -> impl Iterator<Item = &V> {
        self.0.iter().map(|(_, value)| value)
    }

    /// The same, to be changed.
    pub fn values_mut(&mut self) -> impl Iterator<Item = &mut V> {
        self.0.iter_mut().map(|(_, value)| value)
    }

    fn place(&self, name: &str) -> Result<usize, usize> {
        self.0.binary_search_by(|(own, _)| own.as_str().cmp(name))
    }
}

impl<V> Default for ByName<V> {
    fn default() -> Self {
        Self::new()
    }
}

/// # Panics
/// If the name has no value.
impl<V> Index<&str> for ByName<V> {
    type Output = V;

    fn index(&self, name: &str) -> &V {
        self.get(name).expect("the name has a value")
    }
}

/// The last value of a name counts.
impl<V> FromIterator<(String, V)> for ByName<V> {
    fn from_iter<I: IntoIterator<Item = (String, V)>>(values: I) -> Self {
        let mut values: Vec<(String, V)> = values.into_iter().collect();
        if !values.is_sorted_by(|(a, _), (b, _)| a < b) {
            values.reverse();
            values.sort_by(|(a, _), (b, _)| a.cmp(b));
            values.dedup_by(|(a, _), (b, _)| a == b);
        }
        values.shrink_to_fit();
        Self(values)
    }
}

/// The last value of a name counts.
impl<V> From<Vec<(String, V)>> for ByName<V> {
    fn from(values: Vec<(String, V)>) -> Self {
        values.into_iter().collect()
    }
}

impl<V> From<ByName<V>> for Vec<(String, V)> {
    fn from(values: ByName<V>) -> Self {
        values.0
    }
}

impl<V, const N: usize> From<[(String, V); N]> for ByName<V> {
    fn from(values: [(String, V); N]) -> Self {
        values.into_iter().collect()
    }
}

type Iter<'a, V> = Map<slice::Iter<'a, (String, V)>, fn(&'a (String, V)) -> (&'a String, &'a V)>;

impl<'a, V> IntoIterator for &'a ByName<V> {
    type Item = (&'a String, &'a V);
    type IntoIter = Iter<'a, V>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.iter().map(|(name, value)| (name, value))
    }
}

impl<V> IntoIterator for ByName<V> {
    type Item = (String, V);
    type IntoIter = vec::IntoIter<(String, V)>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_in_order_and_the_last_value_counts() {
        let named = |pairs: &[(&str, i64)]| -> ByName<i64> {
            pairs.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect()
        };
        let mut map = named(&[("b", 1), ("a", 2), ("c", 3), ("b", 4)]);
        assert_eq!(map, named(&[("a", 2), ("b", 4), ("c", 3)]));
        assert_eq!((map["b"], map.contains_key("d")), (4, false));
        assert_eq!(map.insert("b".to_owned(), 5), Some(4));
        assert_eq!(map.insert("aa".to_owned(), 6), None);
        assert_eq!((map.remove("a"), map.remove("a")), (Some(2), None));
        map.retain(|name, _| name != "c");
        assert_eq!((map.get("aa"), map.get("c"), map.len()), (Some(&6), None, 2));
        assert_eq!(map.keys().collect::<Vec<_>>(), ["aa", "b"]);
        assert_eq!(map.into_iter().map(|(_, value)| value).collect::<Vec<_>>(), [6, 5]);
    }
}
