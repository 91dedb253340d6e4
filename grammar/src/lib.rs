//! The ivx language: text to checked program.
//!
//! No input or output here, and nothing fails: every stage returns what it could make of the
//! text, and diagnostics.

extern crate alloc; // what the derived parser names without pest's `std`

pub mod ast;
pub mod check;
mod cursor;
mod deviation;
mod diagnostic;
mod external;
mod format;
pub mod ir;
#[cfg(test)]
mod laws;
mod literal;
mod mention;
mod parse;
mod span;
mod suggest;

pub use cursor::{Around, Cursor, cursor};
pub use deviation::deviations;
pub use diagnostic::{Code, Diagnostic, Label, Severity, article};
pub use external::{Outside, externals, known_as};
pub use format::format;
pub use literal::parse_literal;
pub use mention::{Means, Mention, Sort, declares, mentions, names_at};
pub use parse::{is_name, parse, parse_again};
pub use span::{Span, Spanned};
pub use suggest::{Advice, suggest};
