//! Lines with fewer places.

/// The line with as few of its places as the method of Douglas and Peucker (1973) leaves, so that none that is left out
/// is farther than `tolerance` from what remains.
///
/// The first and the last place remain.
#[must_use]
pub fn simplified(line: &[[f64; 2]], tolerance: f64) -> Vec<[f64; 2]> {
    let mut kept = vec![false; line.len()];
    let mut parts = vec![(0, line.len().saturating_sub(1))];
    while let Some((from, to)) = parts.pop() {
        if from >= line.len() {
            break;
        }
        (kept[from], kept[to]) = (true, true);
        let off = |i: &usize| apart(line[*i], line[from], line[to]);
        let farthest = (from + 1..to).max_by(|i, j| off(i).total_cmp(&off(j)));
        if let Some(i) = farthest.filter(|i| off(i) > tolerance) {
            parts.extend([(from, i), (i, to)]);
        }
    }
    line.iter().zip(kept).filter(|(_, kept)| *kept).map(|(place, _)| *place).collect()
}

/// How far a place is from what lies between two others.
fn apart(place: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    let minus = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
    let (way, off) = (minus(to, from), minus(place, from));
    let long = way[0] * way[0] + way[1] * way[1];
    let along = if long > 0.0 { (way[0] * off[0] + way[1] * off[1]) / long } else { 0.0 };
    let along = along.clamp(0.0, 1.0);
    (off[0] - along * way[0]).hypot(off[1] - along * way[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_that_tell_nothing_are_left_out() {
        // The third lies 0.2 above the line from the first to the last, and the corner 2 beside it.
        let line = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.2], [4.0, 0.0], [4.0, 2.0]];
        assert_eq!(simplified(&line, 0.05), [line[0], line[1], line[2], line[3], line[4]]);
        assert_eq!(simplified(&line, 0.25), [line[0], line[3], line[4]]);
        assert_eq!(simplified(&line, 5.0), [line[0], line[4]]);
    }

    #[test]
    fn a_ring_keeps_its_corners_and_little_is_as_it_is() {
        let ring = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [0.0, 0.0]];
        let corners = [ring[0], ring[2], ring[3], ring[4], ring[5]];
        assert_eq!(simplified(&ring, 0.1), corners);
        for n in 0..3 {
            assert_eq!(simplified(&ring[..n], 9.0), ring[..n]);
        }
        // What goes beyond the end and back is not on the line.
        let back = [[0.0, 0.0], [3.0, 0.0], [1.0, 0.0]];
        assert_eq!(simplified(&back, 0.1), back);
    }
}
