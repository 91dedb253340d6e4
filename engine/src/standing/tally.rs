//! Verdicts, counted and in words.

use ivx_op::Outcome as Verdict;

/// How many verdicts there are of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Tally {
    pub(super) holds: usize,
    pub(super) fails: usize,
    pub(super) undecided: usize,
    pub(super) describes: usize,
    pub(super) not_run: usize,
}

impl Tally {
    pub(super) fn of(verdicts: impl IntoIterator<Item = Option<Verdict>>) -> Self {
        let mut tally = Self::default();
        for verdict in verdicts {
            let count = match verdict {
                Some(Verdict::Holds) => &mut tally.holds,
                Some(Verdict::Fails) => &mut tally.fails,
                Some(Verdict::Undecided) => &mut tally.undecided,
                Some(Verdict::Describes) => &mut tally.describes,
                None => &mut tally.not_run,
            };
            *count += 1;
        }
        tally
    }

    pub(super) fn all(self) -> usize {
        self.holds + self.fails + self.undecided + self.describes + self.not_run
    }

    /// `3 hold, 1 fails`; empty if there are none.
    pub(super) fn words(self) -> String {
        let counts = [
            (self.holds, "holds", "hold"),
            (self.fails, "fails", "fail"),
            (self.undecided, "undecided", "undecided"),
            (self.describes, "describes its seeds", "describe their seeds"),
        ];
        if self.not_run > 0 && self.not_run == self.all() {
            return "not run".to_owned();
        }
        let said = counts.into_iter().chain([(self.not_run, "not run", "not run")]);
        let said = said.filter(|(n, ..)| *n > 0);
        let said = said.map(|(n, one, many)| format!("{n} {}", if n == 1 { one } else { many }));
        said.collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_are_counted_in_words() {
        let check = |verdicts: &[Option<Verdict>], expected: &str| {
            assert_eq!(Tally::of(verdicts.iter().copied()).words(), expected);
        };
        let (holds, fails) = (Some(Verdict::Holds), Some(Verdict::Fails));
        check(&[], "");
        check(&[None, None], "not run");
        check(&[holds, None, holds, fails], "2 hold, 1 fails, 1 not run");
        check(
            &[Some(Verdict::Describes), Some(Verdict::Undecided)],
            "1 undecided, 1 describes its seeds",
        );
    }
}
