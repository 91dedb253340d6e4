//! What worlds are painted with, so that the same things look alike in all of them.

use ivx_data::{Outline, Shape};
use ivx_math::moments::real;

/// Where one can be.
pub(crate) const FLOOR: [u8; 3] = [255, 255, 255];
/// Between the cells of a floor.
pub(crate) const BETWEEN: [u8; 3] = [208, 208, 208];
/// Where nobody comes.
pub(crate) const WALL: [u8; 3] = [112, 112, 112];
/// Who acts, in a world of cells.
pub(crate) const AGENT: [u8; 3] = [34, 34, 34];
/// What ends an episode and pays, costs, or neither.
pub(crate) const PAYS: [u8; 3] = [143, 211, 182];
pub(crate) const COSTS: [u8; 3] = [242, 176, 138];
pub(crate) const ENDS: [u8; 3] = [212, 212, 212];

/// A cell of a grid by its number, row after row from the top left; a cell is a unit wide.
pub(crate) fn cell(number: usize, columns: usize, colour: [u8; 3]) -> Shape {
    Shape { outline: Outline::rectangle(middle(number, columns), [1.0; 2], 0.0), colour }
}

/// The middle of a cell.
pub(crate) fn middle(number: usize, columns: usize) -> [f64; 2] {
    [number % columns, number / columns].map(|place| real(place) + 0.5)
}

/// The floor of so many columns and rows.
pub(crate) fn floor(columns: usize, rows: usize) -> Shape {
    let [width, height] = [columns, rows].map(real);
    let all = Outline::rectangle([width / 2.0, height / 2.0], [width, height], 0.0);
    Shape { outline: all, colour: FLOOR }
}

/// The lines between its cells, and about them.
pub(crate) fn lines(columns: usize, rows: usize) -> impl Iterator<Item = Shape> {
    let [width, height] = [columns, rows].map(real);
    let upright = (0..=columns).map(real).map(move |x| vec![[x, 0.0], [x, height]]);
    let level = (0..=rows).map(real).map(move |y| vec![[0.0, y], [width, y]]);
    let line = |ends| Shape { outline: Outline::Line(ends, 0.03), colour: BETWEEN };
    upright.chain(level).map(line)
}
