//! From what was written to what is meant.
//!
//! Names are evaluated when they are first used, so that the order of declarations does not
//! matter. A fault gives one diagnostic and `Val::Poison`, which silences what follows from it.

mod advice;
mod axes;
mod axis;
mod behind;
mod budget;
mod call;
mod certain;
mod claim;
mod drawn;
mod evaluate;
mod experiment;
mod expr;
mod external;
mod family;
mod faults;
mod function;
mod gather;
mod group;
mod labels;
mod library;
mod lint;
mod look;
mod lookup;
mod maths;
mod meant;
mod meet;
mod member;
mod named;
mod op;
mod param;
mod profile;
mod program;
mod published;
mod quotient;
mod range;
mod record;
mod rule;
mod scope;
mod select;
mod shape;
mod source;
mod value;
mod verdict;

use std::collections::BTreeMap;
use std::sync::Arc;

use ivx_op::{External, ExternalKind, Lit, Registry};

use crate::ast::Ast;
use crate::ir::{ExprId, ExprKind, Spec};
use crate::{Diagnostic, Severity};

use axes::Axes;
use budget::Budget;
use faults::Faults;
use library::Library;
pub use look::{Look, Value, look};
use lookup::Names;
use param::Params;
use program::Program;
pub(crate) use scope::Scopes;
use source::Source;
use value::Val;

/// The files of a spec, the root first.
#[derive(Clone, Debug, Default)]
pub struct Project {
    /// The files; spans name them by their place here.
    pub files: Vec<File>,
}

/// One file, parsed.
#[derive(Clone, Debug, Default)]
pub struct File {
    /// The path as shown to people.
    pub path: String,
    /// The name that its parameters are addressed by.
    pub stem: String,
    /// Its text.
    pub text: String,
    /// Its items.
    pub ast: Arc<Ast>,
    /// The files that its `use` and `include` name, by the path as written.
    pub links: BTreeMap<String, usize>,
    /// The texts of the files that its `published` name, by the path as written.
    pub texts: BTreeMap<String, String>,
    /// What its calls name outside the spec, or why that cannot be used, by kind and name.
    pub externals: BTreeMap<(ExternalKind, String), Result<Arc<External>, Diagnostic>>,
}

/// What the command line says about parameters.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    /// The profile asked for; without one, `quick` where it is declared.
    pub profile: Option<String>,
    /// Parameters set by hand, by address or by a name that is unique.
    pub sets: Vec<(String, Lit)>,
    /// Most coordinates of one axis, and most nodes of one program; [`MAX_NODES`] without.
    pub max_nodes: Option<usize>,
}

/// Most coordinates of one axis, and most nodes of one program, unless settings say otherwise.
pub const MAX_NODES: usize = 1_000_000;

/// The checked program and what is wrong with it.
///
/// With an error among the diagnostics the program is not fit to run.
#[must_use]
pub fn check(
    project: &Project,
    registry: &Registry,
    settings: &Settings,
) -> (Spec, Vec<Diagnostic>) {
    let Look { spec, diagnostics, .. } = checked(project, registry, settings);
    (spec, diagnostics)
}

fn checked(project: &Project, registry: &Registry, settings: &Settings) -> Look {
    let mut diagnostics = Vec::new();
    let scopes = Scopes::of(project, &mut diagnostics);
    let mut faults = Faults::new(diagnostics);
    let source = Source::read(project, &scopes, &mut faults);
    let mut checker = Checker {
        source,
        scopes,
        library: Library::new(registry),
        params: Params::new(settings),
        program: Program::default(),
        axes: Axes::default(),
        names: Names::default(),
        labels: labels::Table::default(),
        shapes: shape::Table::default(),
        drawn: drawn::Table::default(),
        budget: Budget::new(settings.max_nodes.unwrap_or(MAX_NODES)),
        faults,
    };
    checker.profile();
    checker.params();
    checker.experiments();
    checker.unused_declarations();
    if checker.faults.run() {
        checker.unused();
        checker.shared_streams();
    }
    let values = checker.told_values();
    let Checker { program, faults, shapes, .. } = checker;
    let mut spec = program.done();
    let op = |id: ExprId| {
        let expr = spec.exprs.get(id.0 as usize);
        expr.is_some_and(|expr| matches!(expr.kind, ExprKind::Op(_)))
    };
    spec.shapes = shapes.known(op);
    Look { spec, diagnostics: faults.told(), values }
}

/// Whether a program with these diagnostics can run.
#[must_use]
pub fn runs(diagnostics: &[Diagnostic]) -> bool {
    diagnostics.iter().all(|d| d.code.severity() == Severity::Warning)
}

/// What is known while a program is checked. Each field is a type of its own, which alone says what changes it.
struct Checker<'a> {
    // What was given.
    source: Source<'a>,
    scopes: Scopes<'a>,
    library: Library<'a>,
    params: Params<'a>,
    // What is made of it.
    program: Program,
    axes: Axes,
    names: Names<'a>,
    // What is known of its expressions.
    labels: labels::Table,
    shapes: shape::Table,
    drawn: drawn::Table,
    // How much there is of it, and what is wrong with it.
    budget: Budget,
    faults: Faults,
}

impl Checker<'_> {
    /// Notes a fault.
    fn fault(&mut self, diagnostic: Diagnostic) -> Val {
        self.faults.add(diagnostic);
        Val::Poison
    }
}

#[cfg(test)]
mod tests;
