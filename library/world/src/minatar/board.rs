//! Boards of ten by ten cells.

/// How many rows there are, and how many columns.
pub(super) const SIDE: usize = 10;

/// The last row, and the last column.
pub(super) const LAST: i32 = 9;

/// Whether a column, or a row, is one of the board.
pub(super) fn on_board(x: i32) -> bool {
    (0..=LAST).contains(&x)
}

/// The channels of a board, row after row.
pub(super) struct Board<'a>(&'a mut [u8]);

impl<'a> Board<'a> {
    /// A board without any mark.
    pub(super) fn empty(grid: &'a mut [u8]) -> Self {
        grid.fill(0);
        Self(grid)
    }

    /// Marks a cell in a channel, unless it is beyond an edge.
    pub(super) fn mark(&mut self, channel: usize, x: i32, y: i32) {
        if let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y))
            && x < SIDE
            && y < SIDE
        {
            self.0[(channel * SIDE + y) * SIDE + x] = 1;
        }
    }

    /// Marks cells in a channel.
    pub(super) fn mark_all(&mut self, channel: usize, cells: Cells) {
        let plane = &mut self.0[channel * SIDE * SIDE..][..SIDE * SIDE];
        let mut left = cells.0;
        while left != 0 {
            plane[left.trailing_zeros() as usize] = 1;
            left &= left - 1;
        }
    }
}

/// Some of the cells of a board: a bit for each, row after row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Cells(u128);

impl Cells {
    /// None.
    pub(super) const NONE: Self = Self(0);

    /// Those of a column.
    pub(super) const fn column(x: u32) -> Self {
        let mut cells = 0;
        let mut y = 0;
        while y < 10 {
            cells |= 1 << (10 * y + x);
            y += 1;
        }
        Self(cells)
    }

    /// Those of a row.
    pub(super) const fn row(y: u32) -> Self {
        Self(0b11_1111_1111 << (10 * y))
    }

    /// Those of either.
    pub(super) const fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Those of both.
    pub(super) const fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// Those that are not of another.
    pub(super) const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// A single one.
    pub(super) fn cell(x: i32, y: i32) -> Self {
        debug_assert!(on_board(x) && on_board(y), "a cell of the board");
        Self(1 << (10 * y + x))
    }

    /// Whether a cell is one of them.
    pub(super) fn has(self, x: i32, y: i32) -> bool {
        !self.and(Self::cell(x, y)).is_empty()
    }

    /// Whether there are none.
    pub(super) const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// How many there are.
    pub(super) const fn count(self) -> u32 {
        self.0.count_ones()
    }

    /// All a row further down; those of the last row are lost.
    pub(super) const fn down(self) -> Self {
        Self((self.without(Self::row(9)).0) << 10)
    }

    /// All a row further down, and those of the last row in the first.
    pub(super) const fn rolled_down(self) -> Self {
        Self(self.down().0 | self.and(Self::row(9)).0 >> 90)
    }

    /// All a row further up; those of the first row are lost.
    pub(super) const fn up(self) -> Self {
        Self(self.0 >> 10)
    }

    /// All a column to the left; those of the first column are lost.
    pub(super) const fn left(self) -> Self {
        Self(self.without(Self::column(0)).0 >> 1)
    }

    /// All a column to the right; those of the last column are lost.
    pub(super) const fn right(self) -> Self {
        Self(self.without(Self::column(9)).0 << 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_move_and_are_lost_beyond_the_edges() {
        let corners = [(0, 0), (9, 0), (0, 9), (9, 9)];
        let cells = |of: &[(i32, i32)]| {
            of.iter().fold(Cells::NONE, |all, (x, y)| all.or(Cells::cell(*x, *y)))
        };
        let all = cells(&corners);
        assert_eq!(all.down(), cells(&[(0, 1), (9, 1)]));
        assert_eq!(all.rolled_down(), cells(&[(0, 1), (9, 1), (0, 0), (9, 0)]));
        assert_eq!(all.up(), cells(&[(0, 8), (9, 8)]));
        assert_eq!(all.left(), cells(&[(8, 0), (8, 9)]));
        assert_eq!(all.right(), cells(&[(1, 0), (1, 9)]));
        assert_eq!((all.count(), all.and(Cells::row(9)).count()), (4, 2));
        assert_eq!(all.without(Cells::column(0)), cells(&[(9, 0), (9, 9)]));
    }

    #[test]
    fn marks_beyond_the_edges_are_not_made() {
        let mut grid = [7; 200];
        let mut board = Board::empty(&mut grid);
        for (x, y) in [(-1, 3), (10, 3), (3, -1), (3, 10), (2, 4)] {
            board.mark(0, x, y);
        }
        board.mark_all(1, Cells::cell(9, 9));
        let marked: Vec<usize> = (0..200).filter(|place| grid[*place] == 1).collect();
        assert_eq!(marked, [42, 199]);
    }
}
