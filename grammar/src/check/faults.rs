//! What is wrong with a program, as far as it was found.

use std::collections::BTreeSet;

use crate::{Code, Diagnostic};

/// After so many faults the rest of a program is not checked.
const MOST_FAULTS: usize = 100;

/// The faults found so far.
pub(super) struct Faults {
    diagnostics: Vec<Diagnostic>,
    /// The codes of what is said once.
    said: BTreeSet<Code>,
}

impl Faults {
    /// Those that were found before.
    pub(super) fn new(diagnostics: Vec<Diagnostic>) -> Self {
        Self { diagnostics, said: BTreeSet::new() }
    }

    /// Notes a fault.
    pub(super) fn add(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// Notes a fault unless one of its code was noted so.
    pub(super) fn add_once(&mut self, diagnostic: Diagnostic) {
        if self.said.insert(diagnostic.code) {
            self.add(diagnostic);
        }
    }

    /// Whether so much is wrong that more is not looked for.
    pub(super) fn sated(&self) -> bool {
        self.diagnostics.len() > MOST_FAULTS
    }

    /// Whether the program can run so far.
    pub(super) fn run(&self) -> bool {
        super::runs(&self.diagnostics)
    }

    /// The faults in the order of the text, each once.
    pub(super) fn told(self) -> Vec<Diagnostic> {
        let mut diagnostics = self.diagnostics;
        diagnostics.sort_by(|a, b| {
            let place = |d: &Diagnostic| d.labels.first().map(|label| label.span);
            (place(a), a.code, &a.message).cmp(&(place(b), b.code, &b.message))
        });
        diagnostics.dedup();
        if diagnostics.len() > MOST_FAULTS {
            diagnostics.truncate(MOST_FAULTS);
            let (code, message) =
                (diagnostics[0].code, format!("there is more: the first {MOST_FAULTS} are told"));
            diagnostics.push(Diagnostic {
                code,
                message,
                labels: Vec::new(),
                help: None,
                instead: None,
            });
        }
        diagnostics
    }
}
