//! What is meant: names resolved, types checked, defaults filled, parameters substituted.
//!
//! A [`Spec`] is an arena of expressions, inputs before users. Each says which axes it varies
//! over; expanding it to nodes is left to the engine.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use ivx_op::{ByName, Labels, Lit};

pub(crate) use desc::WHOLE;
pub use desc::{Desc, widen};
pub use shape::Known;

mod desc;
mod number;
mod shape;

/// What the addresses of a figure, table or claim have for a name: `figure "start"`. Names of
/// measures and `let` hold no blank, so that each kind has names of its own.
#[must_use]
pub fn titled(kind: &str, title: &str) -> String {
    format!("{kind} {title:?}")
}

/// The place of an axis in [`Spec::axes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct AxisId(pub u32);

/// The place of an expression in [`Spec::exprs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ExprId(pub u32);

/// A checked program.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Spec {
    /// The profile in force; none when every parameter has its default.
    pub profile: Option<String>,
    /// The axes, members included.
    pub axes: Vec<Axis>,
    /// The expressions, inputs before users.
    pub exprs: Vec<Expr>,
    /// What parts hold, by [`Desc::Held`].
    pub held: Vec<Feed>,
    /// The shapes that results of operations have, as far as they are known.
    pub shapes: BTreeMap<ExprId, Arc<Known>>,
    /// Parameters of files, called `file.param`, by name.
    pub params: Vec<Param>,
    /// What files give names to and say something of, called `file.name`.
    pub definitions: Vec<Definition>,
    /// The experiments, in the order of inclusion.
    pub experiments: Vec<Experiment>,
}

/// A named axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Its name.
    pub name: String,
    /// What it stands for.
    pub role: AxisRole,
    /// Its coordinates, in the order declared.
    pub coords: Vec<Coord>,
}

/// What an axis stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisRole {
    /// Something that the author varies.
    Plain,
    /// Replications: its value reaches every stochastic operation.
    Seed,
    /// The members of an ensemble.
    Member,
}

impl Axis {
    /// Its labels where they travel: numbers if all its coordinates are, and are called as they are.
    /// Whole numbers that reals do not tell apart are names.
    #[must_use]
    pub fn labels(&self) -> Labels {
        let numbers: Option<Vec<f64>> =
            self.coords.iter().map(|coord| coord.value.as_f64()).collect();
        let exact = |value: &Lit| !matches!(value, Lit::Int(n) if ivx_op::exact(*n).is_none());
        let plain = |coord: &Coord| exact(&coord.value) && coord.value.to_string() == coord.label;
        match numbers {
            Some(numbers) if self.coords.iter().all(plain) => Labels::Numbers(numbers),
            _ => Labels::Names(self.coords.iter().map(|coord| coord.label.clone()).collect()),
        }
    }
}

/// One coordinate of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Coord {
    /// What it is called.
    pub label: String,
    /// What it stands for.
    pub value: Lit,
}

/// An expression that is computed.
#[derive(Clone, Debug, PartialEq)]
pub struct Expr {
    /// `experiment/name`, for people.
    pub address: String,
    /// What it varies over, by id.
    pub axes: BTreeSet<AxisId>,
    /// What `collect` put together: a subset of `axes`.
    pub collected: BTreeSet<AxisId>,
    /// The kind of artifact.
    pub artifact: String,
    /// The dimensions inside it.
    pub dims: Vec<String>,
    /// How it is computed.
    pub kind: ExprKind,
}

/// How an expression is computed.
#[derive(Clone, Debug, PartialEq)]
pub enum ExprKind {
    /// A number where an artifact is expected.
    Number(Desc),
    /// An operation.
    Op(Op),
    /// One coordinate of an axis.
    Pick {
        /// Of what.
        base: ExprId,
        /// Along which axis.
        axis: AxisId,
        /// Which coordinate.
        place: usize,
    },
    /// One expression for each coordinate of an axis.
    Match {
        /// The axis.
        axis: AxisId,
        /// The expressions, in the order of the axis.
        arms: Vec<ExprId>,
    },
    /// Some coordinates of an axis, which make an axis of their own.
    Restrict {
        /// Of what.
        base: ExprId,
        /// Along which axis.
        axis: AxisId,
        /// The axis that has only these coordinates.
        restricted: AxisId,
        /// Which coordinates, in the order of `restricted`.
        places: Vec<usize>,
    },
}

/// A call of an operation.
#[derive(Clone, Debug, PartialEq)]
pub struct Op {
    /// The operation.
    pub name: String,
    /// Its descriptions, complete.
    pub args: ByName<Desc>,
    /// Its artifacts, in the order of declaration.
    pub ports: Vec<(String, Vec<Feed>)>,
    /// Whether it draws random numbers.
    pub stochastic: bool,
}

/// What one port takes from an expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Feed {
    /// The expression.
    pub expr: ExprId,
    /// The axes gathered, outermost first; the others are those of the operation.
    pub gathered: Vec<AxisId>,
    /// How the coordinates of one of them are grouped.
    pub groups: Option<Groups>,
    /// Whether names and labels travel; without, coordinates are in the order of their values.
    pub labelled: bool,
    /// What the spec calls it.
    pub name: String,
}

impl Feed {
    /// One value, at the place of the operation.
    #[must_use]
    pub fn one(expr: ExprId) -> Self {
        Self { expr, gathered: Vec::new(), groups: None, labelled: false, name: String::new() }
    }
}

/// How the coordinates of an axis fall into groups, each a coordinate of another.
#[derive(Clone, Debug, PartialEq)]
pub struct Groups {
    /// The axis that vanishes.
    pub axis: AxisId,
    /// The axis of the groups.
    pub by: AxisId,
    /// The places along the first, for each coordinate of the second.
    pub places: Vec<Vec<usize>>,
}

/// A place on some axes.
pub type Place = BTreeMap<AxisId, usize>;

/// One experiment.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Experiment {
    /// Its name.
    pub name: String,
    /// Its doc comment.
    pub docs: String,
    /// How it differs from its source, in its author's words.
    pub deviations: Vec<String>,
    /// Its parameters, in the order declared.
    pub params: Vec<Param>,
    /// The axes that it declares, in their order.
    pub axes: Vec<Declared>,
    /// What it gives names to and says something of, in the order declared.
    pub definitions: Vec<Definition>,
    /// Its measures.
    pub measures: Vec<Output>,
    /// Its figures.
    pub figures: Vec<Output>,
    /// Its tables.
    pub tables: Vec<Output>,
    /// Its claims.
    pub claims: Vec<Claim>,
}

/// A claim.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    /// Its words, and its verdict.
    pub output: Output,
    /// How it is judged.
    pub judged: Judged,
}

/// How a claim is judged, and what kind of claim it is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Judged {
    /// How often intervals such as its own hold the truth.
    pub confidence: f64,
    /// The method asked for; empty for the default.
    pub by: String,
    /// By how much its sides may differ, or one be worse.
    pub margin: f64,
    /// Why so much, in words.
    pub why: String,
    /// The claims with which it is corrected; none for those of its experiment.
    pub family: Option<String>,
    /// What a reader is to know of it.
    pub marks: BTreeSet<Mark>,
}

/// What a reader is to know of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mark {
    /// Nothing that it compares is drawn: there is no chance in its verdict.
    Deterministic,
    /// It is true whatever comes out.
    CannotFail,
    /// It is about a largest or smallest number over seeds, or another of which nothing is known but from these seeds.
    OfTheseSeeds,
    /// It rests on some seeds that the spec names: what they were drawn for is the same for all others.
    ChosenSeeds,
    /// It has a margin over seeds, and does not say why.
    MarginUnsaid,
}

/// A parameter, as profile and settings have it.
#[derive(Clone, Debug, PartialEq)]
pub struct Param {
    /// Its name.
    pub name: String,
    /// Its doc comment.
    pub docs: String,
    /// Its value.
    pub value: Lit,
    /// Who set it: the default, a profile or the command line.
    pub by: String,
    /// The value that it has where nobody sets it.
    pub default: Lit,
    /// How it differs from its source, in its author's words.
    pub deviations: Vec<String>,
}

/// An axis where it is declared.
#[derive(Clone, Debug, PartialEq)]
pub struct Declared {
    /// Which.
    pub axis: AxisId,
    /// Its doc comment.
    pub docs: String,
}

/// A `let` or `published` with a doc comment.
#[derive(Clone, Debug, PartialEq)]
pub struct Definition {
    /// Its name, and in parentheses what it is a function of.
    pub name: String,
    /// Its doc comment.
    pub docs: String,
}

/// Something an experiment gives out.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// Its name, or the claim in words.
    pub name: String,
    /// Its doc comment.
    pub docs: String,
    /// Its value.
    pub expr: ExprId,
    /// The source text of its value.
    pub source: String,
}

impl Spec {
    /// The axis.
    ///
    /// # Panics
    /// If the id is of another spec.
    #[must_use]
    pub fn axis(&self, id: AxisId) -> &Axis {
        &self.axes[id.0 as usize]
    }

    /// The expression.
    ///
    /// # Panics
    /// If the id is of another spec.
    #[must_use]
    pub fn expr(&self, id: ExprId) -> &Expr {
        &self.exprs[id.0 as usize]
    }

    /// The expressions that one is computed from.
    #[must_use]
    pub fn inputs(&self, expr: &Expr) -> Vec<ExprId> {
        match &expr.kind {
            ExprKind::Number(_) => Vec::new(),
            ExprKind::Pick { base, .. } | ExprKind::Restrict { base, .. } => vec![*base],
            ExprKind::Match { arms, .. } => arms.clone(),
            ExprKind::Op(op) => {
                let mut inputs: Vec<ExprId> =
                    op.ports.iter().flat_map(|(_, feeds)| feeds.iter().map(|f| f.expr)).collect();
                for desc in op.args.values() {
                    desc.visit(&mut |desc| {
                        if let Desc::Held(slot, _) = desc {
                            inputs.push(self.held[*slot].expr);
                        }
                    });
                }
                inputs
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_numbers_where_all_are_and_stay_apart() {
        let check = |coords: &[(&str, Lit)], expected: Labels| {
            let coords = coords
                .iter()
                .map(|(label, value)| Coord { label: (*label).to_owned(), value: value.clone() });
            let (name, role) = ("n".to_owned(), AxisRole::Plain);
            assert_eq!(Axis { name, role, coords: coords.collect() }.labels(), expected);
        };
        let names = |names: &[&str]| Labels::Names(names.iter().map(ToString::to_string).collect());
        check(&[("1", 1.into()), ("0.5", 0.5.into())], Labels::Numbers(vec![1.0, 0.5]));
        check(&[("1", 1.into()), ("half", 0.5.into())], names(&["1", "half"]));
        let large = ["9007199254740992", "9007199254740993"];
        let coords = large.map(|label| (label, Lit::Int(label.parse().expect("a whole number"))));
        check(&coords, names(&large));
    }
}
