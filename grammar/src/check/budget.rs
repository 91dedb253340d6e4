//! How much of everything a program may have, so that each check ends, and soon.

use super::Checker;
use crate::{Code, Diagnostic, Span};

/// Most values in the descriptions of one program, counted each time that one is evaluated, and
/// in its axes.
const MAX_VALUES: usize = 5_000_000;
/// Most expressions evaluated for one program: functions that call others often end here.
const MAX_STEPS: usize = 5_000_000;
/// Most expressions inside each other, through names and functions.
const MAX_DEPTH: usize = 400;

/// What a program has so far of what is bounded.
pub(super) struct Budget {
    counted: Counted,
    max_nodes: usize,
    /// Values of descriptions.
    n_values: usize,
    /// Expressions evaluated, and how deep the one at hand is.
    n_steps: usize,
    depth: usize,
}

/// What the expressions of a program come to.
#[derive(Clone, Copy, Default)]
pub(super) struct Counted {
    n_nodes: usize,
    /// Values of expressions, selections too.
    n_selected: usize,
}

impl Budget {
    /// Nothing yet.
    ///
    /// - `max_nodes`: the most nodes, and coordinates of one axis.
    pub(super) fn new(max_nodes: usize) -> Self {
        Self { counted: Counted::default(), max_nodes, n_values: 0, n_steps: 0, depth: 0 }
    }

    pub(super) fn max_nodes(&self) -> usize {
        self.max_nodes
    }

    /// What is counted so far.
    pub(super) fn counted(&self) -> Counted {
        self.counted
    }

    /// Forgets what was counted since.
    pub(super) fn forget_since(&mut self, counted: Counted) {
        self.counted = counted;
    }

    /// Counts an expression with so many values; whether there is room for it.
    pub(super) fn add(&mut self, extent: usize, is_node: bool) -> bool {
        let Counted { n_nodes, n_selected } = &mut self.counted;
        if is_node {
            *n_nodes = n_nodes.saturating_add(extent);
        }
        // Selections are no nodes, but not free.
        *n_selected = n_selected.saturating_add(extent);
        *n_nodes <= self.max_nodes && *n_selected / 16 <= self.max_nodes
    }

    /// Goes out of an expression.
    pub(super) fn leave(&mut self) {
        self.depth -= 1;
    }
}

impl Checker<'_> {
    /// Goes into an expression; says once if there are too many, or too many inside each other, and stays outside.
    pub(super) fn enter(&mut self, span: Span) -> bool {
        self.budget.n_steps += 1;
        if self.budget.n_steps > MAX_STEPS {
            self.outgrown(
                "the functions of this program call each other too often".to_owned(),
                span,
            );
            return false;
        }
        if self.budget.depth == MAX_DEPTH {
            let message = format!("definitions nest more than {MAX_DEPTH} deep");
            let fault = Diagnostic::new(Code::Nesting, span, message, "too deep");
            let help = "shorten the chain of definitions that leads here";
            self.faults.add_once(fault.help(help));
            return false;
        }
        self.budget.depth += 1;
        true
    }

    /// Whether there is room for so many more values; says once if not.
    pub(super) fn room(&mut self, n: usize, span: Span) -> bool {
        self.budget.n_values = self.budget.n_values.saturating_add(n);
        let fits = self.budget.n_values <= MAX_VALUES;
        if !fits {
            let message = format!("the lists, parts and axes hold more than {MAX_VALUES} values");
            self.faults.add_once(Diagnostic::new(Code::TooLarge, span, message, "too many here"));
        }
        fits
    }

    /// Says once that the program is too large.
    pub(super) fn outgrown(&mut self, message: String, span: Span) {
        self.faults.add_once(Diagnostic::new(Code::TooLarge, span, message, "too large"));
    }

    /// Says once that the program has more nodes, or an axis more coordinates, than asked for.
    pub(super) fn too_many(&mut self, message: String, span: Span) {
        let label = format!("at most {} can be run", self.budget.max_nodes);
        let fault = Diagnostic::new(Code::TooLarge, span, message, label);
        self.faults.add_once(fault.help("`--max-nodes` raises the limit"));
    }
}
