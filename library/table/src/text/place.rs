//! Lines of a file, where one is to be told. The reader counts them as it goes, blank ones not.

/// The first byte of the record that begins at `at` or behind what ends the line before.
fn skipped(bytes: &[u8], at: usize) -> usize {
    let rest = bytes.get(at..).unwrap_or_default();
    let ends = |byte: &u8| matches!(byte, b'\n' | b'\r');
    at + rest.iter().take_while(|byte| ends(byte)).count()
}

/// The line of the record that begins at `at` or behind blank lines, from 1.
pub(super) fn line_of(bytes: &[u8], at: usize) -> usize {
    line_at(bytes, skipped(bytes, at))
}

/// The line that a byte stands on, from 1, whatever ends lines.
pub(super) fn line_at(bytes: &[u8], at: usize) -> usize {
    let before = bytes.get(..at).unwrap_or(bytes);
    let new = before.split(|byte| *byte == b'\n').count() - 1;
    let alone = |pair: &[u8]| pair[0] == b'\r' && pair[1] != b'\n';
    let returns = before.windows(2).filter(|pair| alone(pair)).count();
    let last = before.last() == Some(&b'\r') && bytes.get(at) != Some(&b'\n');
    1 + new + returns + usize::from(last)
}

/// The blank line that stands before the record that begins at `at` or behind it; none if none does.
pub(super) fn blank_before(bytes: &[u8], at: usize) -> Option<usize> {
    // The second half of what ended the line before.
    let split = at > 0 && bytes[at - 1] == b'\r' && bytes.get(at) == Some(&b'\n');
    let at = at + usize::from(split);
    matches!(bytes.get(at), Some(b'\n' | b'\r')).then(|| line_at(bytes, at))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_counted_whatever_ends_them() {
        for (text, at, line) in
            [("a\nb\nc", 4, 3), ("a\r\nb\r\nc", 6, 3), ("a\rb\rc", 4, 3), ("a\n\n\nb", 2, 4)]
        {
            assert_eq!(line_of(text.as_bytes(), at), line, "{text:?}");
        }
        assert_eq!(
            [b"a\n\nb".as_slice(), b"a\r\n\r\nb"].map(|text| blank_before(text, 2)),
            [Some(2); 2]
        );
        assert_eq!([b"a\r\nb".as_slice(), b"a\nb"].map(|text| blank_before(text, 2)), [None; 2]);
    }
}
