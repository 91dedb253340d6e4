//! Pedestrians of ETH (Pellegrini et al., 2009) and UCY (Lerner et al., 2007), as both are passed on together: a line for
//! each of them at each time with frame, number, x and y, tabs or blanks between, and no names.

use super::rows::rows;
use super::{Scene, Seen};

const COLUMNS: [&str; 4] = ["frame", "pedestrian", "x", "y"];

/// A scene, in which steps are frames. Nothing is said of kinds.
///
/// # Errors
/// What is wrong, with file, line and column; nothing in it is wrong too.
pub fn read(name: &str, bytes: &[u8]) -> Result<Scene, String> {
    let mut seen = Seen::new(name);
    for row in rows(name, bytes, |line| line.split_whitespace().collect())? {
        if row.cells.len() != COLUMNS.len() {
            let n = row.cells.len();
            return Err(row.wrong(format!("{n} numbers in the place of {}", COLUMNS.join(", "))));
        }
        let count = |i: usize| row.count(i, COLUMNS[i]);
        let number = |i: usize| row.number(i, COLUMNS[i]);
        let (frame, who, point) = (count(0)?, count(1)?, [number(2)?, number(3)?]);
        seen.add(who, "", frame, point).map_err(|why| row.wrong(why))?;
    }
    seen.scene()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_a_scene_are_tracks() {
        let text = "780\t2.0\t8.5\t3.25\r\n790\t1.0\t-1\t4e-1\n\n790 2 9.5 3.0";
        let scene = read("eth.txt", text.as_bytes()).unwrap();
        let points = |who: usize| scene.tracks[who].points.clone().into_iter().collect::<Vec<_>>();
        assert_eq!(scene.tracks.iter().map(|track| track.who).collect::<Vec<_>>(), [1, 2]);
        assert_eq!(points(0), [(790, [-1.0, 0.4])]);
        assert_eq!(points(1), [(780, [8.5, 3.25]), (790, [9.5, 3.0])]);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_place() {
        for (text, place) in [
            ("0 1 2 3\n0 2 a 3", "`f.txt`, line 2, column `x`: `a` is no number"),
            ("\n0 1 2 NaN", "`f.txt`, line 2, column `y`: `NaN` is no number"),
            ("0.5 1 2 3", "`f.txt`, line 1, column `frame`: `0.5` is no count"),
            ("0 -1 2 3", "`f.txt`, line 1, column `pedestrian`: `-1` is no count"),
            ("0 1 2", "`f.txt`, line 1: 3 numbers in the place of frame, pedestrian, x, y"),
            ("0 1 2 3\n0 1.0 2 3", "`f.txt`, line 2: number 1 is at step 0 twice"),
            ("\n", "`f.txt` has no rows"),
        ] {
            assert_eq!(read("f.txt", text.as_bytes()).unwrap_err(), place);
        }
        let why = read("f.txt", b"0 1 2 3\n0 2 \xff 3").unwrap_err();
        assert_eq!(why, "`f.txt`, line 2: it is not UTF-8 text");
    }
}
