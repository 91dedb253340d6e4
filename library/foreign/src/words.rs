//! How a program ended, and what it said last.

use std::os::unix::process::ExitStatusExt as _;
use std::process::ExitStatus;

use crate::group::signal_name;

/// How much of the end of what a program says is shown when it fails.
pub const TAIL: usize = 4096;
/// How many of its last lines.
const TAIL_LINES: usize = 20;

/// How a program ended.
#[must_use]
pub fn how(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("ended with exit code {code}"),
        (_, Some(signal)) => format!("was killed by signal {signal}{}", signal_name(signal)),
        _ => "ended in an unknown way".to_owned(),
    }
}

/// The last lines of what was said, as a terminal shows them.
#[must_use]
pub fn tail(said: &[u8]) -> String {
    let text = String::from_utf8_lossy(&said[said.len().saturating_sub(TAIL)..]);
    let lines: Vec<String> = text.trim_end().split('\n').map(played).collect();
    let lines = if lines.iter().all(String::is_empty) { &[] } else { &lines[..] };
    let last = &lines[lines.len().saturating_sub(TAIL_LINES)..];
    last.iter().map(|line| format!("    {line}")).collect::<Vec<_>>().join("\n")
}

/// A line as it looks in the end: bars of progress write over what they wrote. What steers terminals otherwise
/// is left out.
fn played(line: &str) -> String {
    let mut shown: Vec<char> = Vec::new();
    let mut at = 0_usize;
    let mut chars = line.chars().peekable();
    while let Some(c) = chars.next() {
        match c {
            '\r' => at = 0,
            '\u{8}' => at = at.saturating_sub(1),
            '\u{1b}' => match chars.next() {
                Some('[') => {
                    let is_inside = |c: &char| !('@'..='~').contains(c);
                    let of: String = std::iter::from_fn(|| chars.next_if(is_inside)).collect();
                    match (chars.next(), &*of) {
                        (Some('K'), "" | "0") => shown.truncate(at),
                        (Some('K'), "2") => shown.clear(),
                        _ => {}
                    }
                }
                // A title of the window, until a bell or another escape.
                Some(']') => while chars.next_if(|c| !matches!(c, '\u{7}' | '\u{1b}')).is_some() {},
                _ => {}
            },
            c if c.is_control() && c != '\t' => {}
            c => {
                shown.resize(shown.len().max(at + 1), ' ');
                shown[at] = c;
                at += 1;
            }
        }
    }
    shown.into_iter().collect::<String>().trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_shown_as_terminals_show_them() {
        let check = |line: &str, expected: &str| assert_eq!(played(line), expected, "{line:?}");
        check("10 %\r20 %\rdone", "done");
        check("long line\rno", "nong line");
        check("windows\r", "windows");
        check("half\r\u{1b}[Kall", "all");
        check("ab\u{8}c", "ac");
        check("\u{1b}[1;31mred\u{1b}[0m \u{1b}]0;title\u{7}x\u{1b}", "red x");
        check("a\u{1b}[2Kb", " b");
        check("a\tb\u{0}", "a\tb");
    }

    #[test]
    fn no_more_than_the_end_is_shown() {
        let said: Vec<String> = (0..1000).map(|i| format!("line {i}")).collect();
        let shown = tail(said.join("\n").as_bytes());
        assert_eq!(shown.lines().count(), TAIL_LINES);
        assert!(shown.starts_with("    line 980\n") && shown.ends_with("line 999"));
    }
}
