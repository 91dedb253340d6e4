//! Things by where they are.

#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "cells are numbered within the grid, and casts of what is outside saturate"
)]

/// Most cells of a grid.
const MOST_CELLS: f64 = 1e6;

/// Things with boxes around them, in square cells.
#[derive(Clone, Debug)]
pub(crate) struct Grid<T> {
    corner: [f64; 2],
    side: f64,
    size: [i32; 2],
    /// Where the things of each cell start in `things`, and the number of all.
    starts: Vec<u32>,
    /// Cell by cell; a thing is in all that its box touches.
    things: Vec<T>,
}

impl<T: Clone> Grid<T> {
    /// - `boxed`: least and largest `x` and `y`, as `[x, y, x, y]`, of each thing.
    /// - `side`: of a cell, in metres; cells are larger where they would be too many.
    pub(crate) fn of(boxed: &[([f64; 4], T)], side: f64) -> Self {
        let fold =
            |i: usize, f: fn(f64, f64) -> f64, from| boxed.iter().map(|(b, _)| b[i]).fold(from, f);
        let low = [0, 1].map(|i| fold(i, f64::min, f64::INFINITY));
        let high = [2, 3].map(|i| fold(i, f64::max, f64::NEG_INFINITY));
        if boxed.is_empty() {
            return Self {
                corner: [0.0; 2],
                side,
                size: [0; 2],
                starts: vec![0],
                things: Vec::new(),
            };
        }
        let extent = [0, 1].map(|i| high[i] - low[i] + 1.0);
        let side = side
            .max((extent[0] * extent[1] / MOST_CELLS).sqrt())
            .max(extent[0].max(extent[1]) / MOST_CELLS);
        let size = extent.map(|metres| (metres / side) as i32 + 1);
        let mut grid = Self { corner: low, side, size, starts: Vec::new(), things: Vec::new() };
        let mut cells = vec![Vec::new(); (size[0] as usize) * (size[1] as usize)];
        for (place, (b, _)) in boxed.iter().enumerate() {
            let [from, to] = [grid.cell([b[0], b[1]]), grid.cell([b[2], b[3]])];
            for row in from[1]..=to[1] {
                for column in from[0]..=to[0] {
                    cells[grid.number(column, row)].push(place);
                }
            }
        }
        grid.starts.push(0);
        for places in cells {
            grid.things.extend(places.iter().map(|place| boxed[*place].1.clone()));
            grid.starts.push(u32::try_from(grid.things.len()).expect("maps are smaller"));
        }
        grid
    }

    /// The least and the largest `x` and `y` of its cells.
    pub(crate) fn extent(&self) -> [[f64; 2]; 2] {
        let high = [0, 1].map(|i| self.corner[i] + f64::from(self.size[i]) * self.side);
        [self.corner, high]
    }

    fn number(&self, column: i32, row: i32) -> usize {
        row as usize * self.size[0] as usize + column as usize
    }

    /// The cell of a point, which may be outside.
    fn cell(&self, point: [f64; 2]) -> [i32; 2] {
        [0, 1].map(|i| ((point[i] - self.corner[i]) / self.side).floor() as i32)
    }

    /// What is in the cell of a point.
    pub(crate) fn at(&self, point: [f64; 2]) -> &[T] {
        let [column, row] = self.cell(point);
        let inside = (0..self.size[0]).contains(&column) && (0..self.size[1]).contains(&row);
        if inside { self.of_cell(column, row) } else { &[] }
    }

    fn of_cell(&self, column: i32, row: i32) -> &[T] {
        let cell = self.number(column, row);
        &self.things[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// What is in the cells that a box `[x, y, x, y]` touches; things may come more than once.
    pub(crate) fn within(&self, b: [f64; 4]) -> impl Iterator<Item = &T> {
        let [from, to] = [self.cell([b[0], b[1]]), self.cell([b[2], b[3]])];
        let rows = from[1].max(0)..=to[1].min(self.size[1] - 1);
        rows.flat_map(move |row| {
            let columns = from[0].max(0)..=to[0].min(self.size[0] - 1);
            columns.flat_map(move |column| self.of_cell(column, row))
        })
    }

    /// Shows things in rings of cells around a point, the nearest rings first, until all within the distance that `see`
    /// returned last have been shown.
    pub(crate) fn around<'a>(&'a self, point: [f64; 2], mut see: impl FnMut(&'a T) -> f64) {
        let centre = [0, 1].map(|i| {
            // A point far away starts at the rim, and looks at all.
            self.cell(point)[i].clamp(0, (self.size[i] - 1).max(0))
        });
        let mut within = f64::INFINITY;
        for ring in 0..=self.size[0].max(self.size[1]) {
            let [left, right] = [centre[0] - ring, centre[0] + ring];
            let [top, bottom] = [centre[1] - ring, centre[1] + ring];
            for row in top.max(0)..=bottom.min(self.size[1] - 1) {
                let whole = row == top || row == bottom;
                let stride = if whole || ring == 0 { 1 } else { (right - left) as usize };
                for column in (left..=right).step_by(stride) {
                    if (0..self.size[0]).contains(&column) {
                        for thing in self.of_cell(column, row) {
                            within = see(thing);
                        }
                    }
                }
            }
            // What has not been shown is beyond the nearest side of the square that has been.
            let shown = [0, 1].map(|i| {
                let low = point[i] - self.corner[i] - f64::from(centre[i] - ring) * self.side;
                let high = f64::from(centre[i] + ring + 1) * self.side - point[i] + self.corner[i];
                // Where the square has reached the rim there is nothing beyond.
                let low = if centre[i] - ring <= 0 { f64::INFINITY } else { low };
                let high = if centre[i] + ring >= self.size[i] - 1 { f64::INFINITY } else { high };
                low.min(high)
            });
            if within <= shown[0].min(shown[1]) {
                return;
            }
        }
    }
}
