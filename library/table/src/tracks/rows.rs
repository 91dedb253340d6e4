//! The cells of a text, with the places at which they stand.

/// A line that is not blank.
pub(super) struct Row<'a> {
    file: &'a str,
    /// Counted from 1.
    line: usize,
    pub(super) cells: Vec<&'a str>,
}

/// The lines of a text that are not blank.
///
/// # Errors
/// If it is no UTF-8 text.
pub(super) fn rows<'a>(
    file: &'a str,
    bytes: &'a [u8],
    split: impl Fn(&'a str) -> Vec<&'a str>,
) -> Result<Vec<Row<'a>>, String> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let before = bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n');
        format!("`{file}`, line {}: it is not UTF-8 text", before.count() + 1)
    })?;
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    Ok(lines.map(|(i, line)| Row { file, line: i + 1, cells: split(line) }).collect())
}

impl Row<'_> {
    /// What is wrong, behind the place of the line.
    pub(super) fn wrong(&self, why: impl std::fmt::Display) -> String {
        format!("`{}`, line {}: {why}", self.file, self.line)
    }

    /// The finite number in a cell.
    ///
    /// # Errors
    /// If there is none.
    pub(super) fn number(&self, at: usize, column: &str) -> Result<f64, String> {
        let text = self.cells[at].trim();
        let number = text.parse().ok().filter(|x: &f64| x.is_finite());
        number.ok_or_else(|| self.not(at, column, "number"))
    }

    /// The count in a cell, which may be written with a point, such as `780.0`.
    ///
    /// # Errors
    /// If there is none.
    pub(super) fn count(&self, at: usize, column: &str) -> Result<u64, String> {
        /// From here on not all whole numbers are floats.
        const LARGE: f64 = 9_007_199_254_740_992.0;
        let number = self.number(at, column)?;
        if number.fract() != 0.0 || !(0.0..LARGE).contains(&number) {
            return Err(self.not(at, column, "count"));
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "it is a count"
        )]
        Ok(number as u64)
    }

    fn not(&self, at: usize, column: &str, what: &str) -> String {
        let short: String = self.cells[at].trim().chars().take(40).collect();
        format!("`{}`, line {}, column `{column}`: `{short}` is no {what}", self.file, self.line)
    }
}
