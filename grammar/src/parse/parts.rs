//! The parts of pest's pairs.

use super::Rule;

pub(super) type Pair<'t> = pest::iterators::Pair<'t, Rule>;

/// The byte after the last token of `pair`: its own span goes on over the gap behind that.
pub(super) fn end(pair: &Pair<'_>) -> usize {
    let mut last = pair.clone();
    while let Some(inner) = last.clone().into_inner().rfind(|pair| pair.as_rule() != Rule::line) {
        last = inner;
    }
    last.as_span().end()
}

/// The parts of a pair that mean something: no punctuation.
pub(super) struct Parts<'t> {
    pairs: pest::iterators::Pairs<'t, Rule>,
    /// Where the last closing bracket ended that was passed over; 0 before.
    pub(super) closed: usize,
}

impl<'t> Parts<'t> {
    pub(super) fn of(pair: Pair<'t>) -> Self {
        Self { pairs: pair.into_inner(), closed: 0 }
    }

    /// The next part, where the grammar has one.
    pub(super) fn part(&mut self) -> Pair<'t> {
        self.next().expect("the grammar has a part here")
    }

    /// How many pairs there are still, punctuation too.
    pub(super) fn n_pairs(&self) -> usize {
        self.pairs.len()
    }

    /// How many parts there are still.
    pub(super) fn n_left(&self) -> usize {
        match self.pairs.len() {
            1 => 1,
            _ => self.pairs.clone().filter(|pair| means_something(pair.as_rule())).count(),
        }
    }
}

impl<'t> Iterator for Parts<'t> {
    type Item = Pair<'t>;

    fn next(&mut self) -> Option<Pair<'t>> {
        loop {
            let pair = self.pairs.next()?;
            match pair.as_rule() {
                Rule::rparen | Rule::rbracket | Rule::rbrace | Rule::rangle => {
                    self.closed = pair.as_span().end();
                }
                rule if means_something(rule) => return Some(pair),
                _ => {}
            }
        }
    }
}

fn means_something(rule: Rule) -> bool {
    !matches!(
        rule,
        Rule::line
            | Rule::lparen
            | Rule::rparen
            | Rule::lbracket
            | Rule::rbracket
            | Rule::lbrace
            | Rule::rbrace
            | Rule::langle
            | Rule::rangle
            | Rule::comma
            | Rule::colon
            | Rule::equals
            | Rule::dot
            | Rule::dots
            | Rule::as_word
            | Rule::match_word
            | Rule::within_word
            | Rule::at_word
            | Rule::by_word
            | Rule::family_word
            | Rule::on_word
            | Rule::par_word
            | Rule::with_word
            | Rule::from_word
    )
}
