//! From what was written to what is meant.
//!
//! Names are evaluated when they are first used, so that the order of declarations does not
//! matter. A fault gives one diagnostic and `Val::Poison`, which silences what follows from it.

mod advice;
mod axis;
mod behind;
mod call;
mod certain;
mod claim;
mod drawn;
mod evaluate;
mod experiment;
mod expr;
mod external;
mod family;
mod function;
mod gather;
mod group;
mod labels;
mod lint;
mod lookup;
mod meet;
mod member;
mod named;
mod op;
mod param;
mod profile;
mod published;
mod quotient;
mod range;
mod record;
mod rule;
mod scope;
mod select;
mod shape;
mod value;
mod verdict;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use ivx_op::{External, ExternalKind, Lit, Registry};

use crate::ast::{Ast, Name};
use crate::ir::{AxisId, ExprId, ExprKind, Groups, Spec};
use crate::{Code, Diagnostic, Severity, Span};

use scope::Scopes;
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
    pub ast: Ast,
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

/// Most values in the descriptions of one program, counted each time that one is evaluated, and
/// in its axes.
const MAX_VALUES: usize = 5_000_000;

/// After so many faults the rest of a program is not checked.
const MOST_FAULTS: usize = 100;

/// The checked program and what is wrong with it.
///
/// With an error among the diagnostics the program is not fit to run.
#[must_use]
pub fn check(
    project: &Project,
    registry: &Registry,
    settings: &Settings,
) -> (Spec, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let scopes = Scopes::of(project, &mut diagnostics);
    let mut checker = Checker {
        project,
        registry,
        artifacts: function::artifacts(registry),
        scopes,
        spec: Spec::default(),
        diagnostics,
        settings,
        profiles: Vec::new(),
        set_by: BTreeMap::new(),
        defaults: BTreeMap::new(),
        axes: BTreeMap::new(),
        members: BTreeMap::new(),
        restricted: BTreeMap::new(),
        wholes: BTreeMap::new(),
        groups: BTreeMap::new(),
        memo: BTreeMap::new(),
        active: Vec::new(),
        circles: BTreeSet::new(),
        seed: None,
        any_seed: None,
        experiment: None,
        files: BTreeMap::new(),
        used: BTreeSet::new(),
        spans: Vec::new(),
        drawn: Vec::new(),
        published: BTreeMap::new(),
        labels: BTreeMap::new(),
        shapes: shape::Table::default(),
        n_nodes: 0,
        n_values: 0,
        max_nodes: settings.max_nodes.unwrap_or(MAX_NODES),
        n_selected: 0,
        n_steps: 0,
        depth: 0,
        too_deep: false,
        too_large: false,
    };
    checker.profile();
    checker.published_files();
    checker.params();
    checker.experiments();
    checker.unused_declarations();
    if runs(&checker.diagnostics) {
        checker.unused();
        checker.shared_streams();
    }
    let Checker { mut spec, mut diagnostics, shapes, .. } = checker;
    let op = |id: ExprId| {
        let expr = spec.exprs.get(id.0 as usize);
        expr.is_some_and(|expr| matches!(expr.kind, ExprKind::Op(_)))
    };
    spec.shapes = shapes.known(op);
    diagnostics.sort_by(|a, b| {
        let place = |d: &Diagnostic| d.labels.first().map(|label| label.span);
        (place(a), a.code, &a.message).cmp(&(place(b), b.code, &b.message))
    });
    diagnostics.dedup();
    if diagnostics.len() > MOST_FAULTS {
        diagnostics.truncate(MOST_FAULTS);
        let (code, message) =
            (diagnostics[0].code, format!("there is more: the first {MOST_FAULTS} are told"));
        diagnostics.push(Diagnostic { code, message, labels: Vec::new(), help: None });
    }
    (spec, diagnostics)
}

/// Whether a program with these diagnostics can run.
#[must_use]
pub fn runs(diagnostics: &[Diagnostic]) -> bool {
    diagnostics.iter().all(|d| d.code.severity() == Severity::Warning)
}

/// What is known while a program is checked.
struct Checker<'a> {
    project: &'a Project,
    registry: &'a Registry,
    /// The kinds of artifact there are.
    artifacts: BTreeSet<&'a str>,
    scopes: Scopes<'a>,
    spec: Spec,
    diagnostics: Vec<Diagnostic>,
    settings: &'a Settings,
    /// The profiles in force: the one chosen last, each behind its base.
    profiles: Vec<String>,
    /// Who set each parameter, for messages.
    set_by: BTreeMap<(usize, String), String>,
    /// The value that each parameter has where nobody sets it.
    defaults: BTreeMap<(usize, String), Lit>,
    /// Axes by declaration.
    axes: BTreeMap<(usize, String), Option<AxisId>>,
    /// Member axes by the number of members.
    members: BTreeMap<i64, AxisId>,
    /// Restricted axes by the axis and the places kept.
    restricted: BTreeMap<(AxisId, Vec<usize>), AxisId>,
    /// The axes that restricted ones are some coordinates of.
    wholes: BTreeMap<AxisId, AxisId>,
    /// Groups of coordinates by the axis and its field.
    groups: BTreeMap<(AxisId, String), Groups>,
    /// Values of names in the experiment at hand, by where they are declared.
    memo: BTreeMap<Span, Val>,
    /// Names being evaluated, as declared.
    active: Vec<&'a Name>,
    /// The names of each circle of definitions that was reported, by where they are declared.
    circles: BTreeSet<BTreeSet<Span>>,
    /// The `seed` axis of the experiment at hand.
    seed: Option<AxisId>,
    /// The `seed` axis of what no experiment uses: which seeds there are is not known.
    any_seed: Option<AxisId>,
    /// The scope of the experiment at hand.
    experiment: Option<usize>,
    /// Figures and tables so far, by what they are and their names.
    files: BTreeMap<(&'static str, String), (String, Span)>,
    /// Names that expressions used, by where they are declared.
    used: BTreeSet<Span>,
    /// Where each expression of the program stands.
    spans: Vec<Span>,
    /// The random numbers upstream of expressions, as far as they were asked for.
    drawn: Vec<drawn::Drawn>,
    /// Published numbers, by the file that names them and the path as written.
    published: BTreeMap<(usize, String), ivx_op::Published>,
    /// Labels along dimensions of values, where they are known.
    labels: BTreeMap<(ExprId, String), ivx_op::Labels>,
    /// Shapes of values, where they are known.
    shapes: shape::Table,
    /// Nodes so far, and the most there may be.
    n_nodes: usize,
    /// Values of expressions so far, selections too.
    n_selected: usize,
    max_nodes: usize,
    /// Values of descriptions so far.
    n_values: usize,
    /// Expressions evaluated so far, and how deep the one at hand is.
    n_steps: usize,
    depth: usize,
    /// Whether definitions nest too deeply; said once.
    too_deep: bool,
    /// Whether the program outgrew what can be run; said once.
    too_large: bool,
}

impl Checker<'_> {
    /// Notes a fault.
    fn fault(&mut self, diagnostic: Diagnostic) -> Val {
        self.diagnostics.push(diagnostic);
        Val::Poison
    }

    /// Whether so much is wrong that more is not looked for.
    fn sated(&self) -> bool {
        self.diagnostics.len() > MOST_FAULTS
    }

    /// Whether there is room for so many more values; says once if not.
    fn room(&mut self, n: usize, span: Span) -> bool {
        self.n_values = self.n_values.saturating_add(n);
        if self.n_values > MAX_VALUES && !std::mem::replace(&mut self.too_large, true) {
            let message = format!("the lists, parts and axes hold more than {MAX_VALUES} values");
            self.fault(Diagnostic::new(Code::TooLarge, span, message, "too many here"));
        }
        self.n_values <= MAX_VALUES
    }

    /// How many coordinates some axes have together.
    fn extent(&self, axes: &BTreeSet<AxisId>) -> usize {
        let sizes = axes.iter().map(|axis| self.spec.axis(*axis).coords.len());
        sizes.fold(1, usize::saturating_mul)
    }

    /// The names of axes, for messages.
    fn names(&self, axes: &BTreeSet<AxisId>) -> Vec<String> {
        axes.iter().map(|axis| self.spec.axis(*axis).name.clone()).collect()
    }

    /// Says once that the program is too large.
    fn outgrown(&mut self, message: String, span: Span) {
        let fault = Diagnostic::new(Code::TooLarge, span, message, "too large");
        if !std::mem::replace(&mut self.too_large, true) {
            self.fault(fault);
        }
    }

    /// Says once that the program has more nodes, or an axis more coordinates, than asked for.
    fn too_many(&mut self, message: String, span: Span) {
        let label = format!("at most {} can be run", self.max_nodes);
        let fault = Diagnostic::new(Code::TooLarge, span, message, label);
        if !std::mem::replace(&mut self.too_large, true) {
            self.fault(fault.help("`--max-nodes` raises the limit"));
        }
    }
}

#[cfg(test)]
mod tests;
