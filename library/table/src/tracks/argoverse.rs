//! Logs of Argoverse 2 (Wilson et al., 2021) as text: a line for each thing at each step of 0.1 s, commas between, and
//! in the first line names, of which `track`, `category`, `step_10hz`, `x` and `y` are needed.

use super::rows::rows;
use super::{Scene, Seen};

const COLUMNS: [&str; 5] = ["track", "category", "step_10hz", "x", "y"];

/// A scene, in which steps are tenths of a second and kinds are categories. Columns that are not needed are not read.
///
/// # Errors
/// What is wrong, with file, line and column; nothing in it is wrong too.
pub fn read(name: &str, bytes: &[u8]) -> Result<Scene, String> {
    let mut seen = Seen::new(name);
    let mut rows = rows(name, bytes, |line| line.split(',').collect())?.into_iter();
    let Some(names) = rows.next() else { return seen.scene() };
    let mut places = [0; COLUMNS.len()];
    for (place, column) in places.iter_mut().zip(COLUMNS) {
        let found = names.cells.iter().position(|cell| cell.trim() == column);
        *place = found.ok_or_else(|| names.wrong(format!("it names no column `{column}`")))?;
    }
    for row in rows {
        let (n, n_columns) = (row.cells.len(), names.cells.len());
        if n != n_columns {
            return Err(row.wrong(format!("{n} values for {n_columns} columns")));
        }
        let count = |i: usize| row.count(places[i], COLUMNS[i]);
        let number = |i: usize| row.number(places[i], COLUMNS[i]);
        let (who, step, point) = (count(0)?, count(2)?, [number(3)?, number(4)?]);
        let category = row.cells[places[1]].trim();
        seen.add(who, category, step, point).map_err(|why| row.wrong(why))?;
    }
    seen.scene()
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: &str = "track,category,length,width,step_10hz,x,y,yaw";

    fn log(rows: &str) -> Result<Scene, String> {
        read("log.csv", format!("{NAMES}\n{rows}").as_bytes())
    }

    #[test]
    fn lines_of_a_log_are_tracks() {
        let scene =
            log("4,BUS,9.0,2.5,7,1.5,-2,0.1\n0,EGO,,,7,0.0,1.0,x\n4,BUS,9,2.5,8,2.5,-2,0\n");
        let scene = scene.unwrap();
        let tracks = scene.tracks.iter().map(|track| (track.who, &*track.kind));
        assert_eq!(tracks.collect::<Vec<_>>(), [(0, "EGO"), (4, "BUS")]);
        let points: Vec<_> = scene.tracks[1].points.clone().into_iter().collect();
        assert_eq!(points, [(7, [1.5, -2.0]), (8, [2.5, -2.0])]);
        // Columns are found by their names.
        let turned = read("log.csv", b"y,x,step_10hz,category,track\n-2,1.5,7,BUS,4").unwrap();
        assert_eq!(turned.tracks[0].points[&7], [1.5, -2.0]);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_place() {
        for (rows, place) in [
            ("0,EGO,1,1,0,1,,0", "line 2, column `y`: `` is no number"),
            ("0,EGO,1,1,0.5,1,1,0", "line 2, column `step_10hz`: `0.5` is no count"),
            ("a,EGO,1,1,0,1,1,0", "line 2, column `track`: `a` is no number"),
            ("0,EGO,1,1,0,1,1", "line 2: 7 values for 8 columns"),
            ("0,EGO,1,1,0,1,1,0\n\n0,EGO,1,1,0,2,1,0", "line 4: number 0 is at step 0 twice"),
            (
                "0,BUS,1,1,0,1,1,0\n0,EGO,1,1,1,1,1,0",
                "line 3: number 0 is of the kind `EGO`, and was of `BUS`",
            ),
        ] {
            assert_eq!(log(rows).unwrap_err(), format!("`log.csv`, {place}"));
        }
        let why = read("log.csv", b"track,category,step_10hz,x\n").unwrap_err();
        assert_eq!(why, "`log.csv`, line 1: it names no column `y`");
        assert_eq!(log("").unwrap_err(), "`log.csv` has no rows");
        assert_eq!(read("log.csv", b"").unwrap_err(), "`log.csv` has no rows");
    }
}
