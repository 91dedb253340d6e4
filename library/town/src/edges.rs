//! The edges of roads as lines.

use std::collections::BTreeMap;

use crate::kerbs::Kerb;

/// A centimetre: what is nearer is at one place.
type At = [i64; 2];

/// Kerbs as lines from above: those that touch are one, up to where others meet them.
///
/// Lines that have an end come before rings, whose first place is their last.
#[must_use]
pub fn edges(kerbs: &[Kerb]) -> Vec<Vec<[f64; 2]>> {
    let mut touching: BTreeMap<At, Vec<usize>> = BTreeMap::new();
    for (i, [a, b]) in kerbs.iter().enumerate().filter(|(_, [a, b])| at(a) != at(b)) {
        touching.entry(at(a)).or_default().push(i);
        touching.entry(at(b)).or_default().push(i);
    }
    let is_end = |place: &[f64; 3]| touching.get(&at(place)).is_some_and(|all| all.len() != 2);
    let from_ends = (0..kerbs.len()).flat_map(|i| [(i, 0), (i, 1)]);
    let from_ends = from_ends.filter(|(i, end)| is_end(&kerbs[*i][*end]));
    let begins: Vec<(usize, usize)> = from_ends.chain((0..kerbs.len()).map(|i| (i, 0))).collect();
    let mut used: Vec<bool> = kerbs.iter().map(|[a, b]| at(a) == at(b)).collect();
    let mut lines = Vec::new();
    for (mut i, end) in begins {
        if used[i] {
            continue;
        }
        let flat = |[x, y, _]: [f64; 3]| [x, y];
        let mut line = vec![flat(kerbs[i][end])];
        let mut last = kerbs[i][1 - end];
        loop {
            used[i] = true;
            line.push(flat(last));
            let next = touching[&at(&last)].iter().find(|next| !used[**next]);
            let Some(&next) = next.filter(|_| !is_end(&last)) else { break };
            let [a, b] = kerbs[next];
            last = if at(&a) == at(&last) { b } else { a };
            i = next;
        }
        lines.push(line);
    }
    lines
}

#[expect(clippy::cast_possible_truncation, reason = "towns are far smaller")]
fn at([x, y, _]: &[f64; 3]) -> At {
    [x, y].map(|along| (along * 100.0).round() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ground, kerbs, town_map};

    #[test]
    fn what_touches_is_one_line() {
        let kerb = |[a, b]: [[f64; 2]; 2]| [[a[0], a[1], 0.0], [b[0], b[1], 7.0]];
        let lines =
            |all: &[[[f64; 2]; 2]]| edges(&all.iter().copied().map(kerb).collect::<Vec<_>>());
        // The second is the other way round, and the third is no longer than a point.
        let found = lines(&[
            [[1.0, 0.0], [2.0, 0.0]],
            [[1.001, 0.0], [0.0, 0.0]],
            [[2.0, 0.0], [2.0, 0.001]],
            [[2.0, 0.0], [3.0, 1.0]],
        ]);
        assert_eq!(found, [[[0.0, 0.0], [1.001, 0.0], [2.0, 0.0], [3.0, 1.0]]]);
        // Three that meet remain three.
        let fork = [[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [2.0, 1.0]], [[1.0, 0.0], [2.0, -1.0]]];
        assert_eq!(lines(&fork).len(), 3);
        let ring = [[[0.0, 0.0], [1.0, 0.0]], [[1.0, 1.0], [1.0, 0.0]], [[1.0, 1.0], [0.0, 0.0]]];
        assert_eq!(lines(&ring), [[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]]]);
    }

    #[test]
    fn a_town_has_few_lines_as_long_as_its_kerbs() {
        let map = town_map("Town01").unwrap();
        let kerbs = kerbs(&map, &ground(&map));
        let long = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let flat = |[x, y, _]: [f64; 3]| [x, y];
        let metres: f64 = kerbs.iter().map(|[a, b]| long(&flat(*a), &flat(*b))).sum();
        let lines = edges(&kerbs);
        let joined: f64 = lines
            .iter()
            .flat_map(|line| line.windows(2))
            .map(|pair| long(&pair[0], &pair[1]))
            .sum();
        assert!((metres - joined).abs() < 1.0, "{metres} {joined}");
        assert!(lines.len() * 10 < kerbs.len(), "{} of {}", lines.len(), kerbs.len());
    }
}
