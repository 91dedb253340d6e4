//! What is meant: names resolved, types checked, defaults filled, parameters substituted.
//!
//! A [`Spec`] is an arena of expressions, inputs before users. Each says which axes it varies
//! over; expanding it to nodes is left to the engine.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use ivx_op::{Args, Held, Lit, Part};

use crate::ast::BinaryOp;

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
    /// Parameters of files, called `file.param`, by name.
    pub params: Vec<Param>,
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
    pub args: BTreeMap<String, Desc>,
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

/// A description that may vary over axes.
#[derive(Clone, Debug, PartialEq)]
pub enum Desc {
    /// The same everywhere.
    Lit(Lit),
    /// The value of an axis.
    Axis(AxisId),
    /// A list.
    List(Vec<Desc>),
    /// A part; without a name, a record.
    Part(String, BTreeMap<String, Desc>),
    /// The field of a record.
    Field(Box<Desc>, String),
    /// One description for each coordinate of an axis, in its order.
    Match(AxisId, Vec<Desc>),
    /// An artifact that a part holds: its place in [`Spec::held`], and what it varies over.
    Held(usize, BTreeSet<AxisId>),
    /// Arithmetic, or a comparison.
    Binary(BinaryOp, Box<Desc>, Box<Desc>),
    /// Whole numbers widened to reals.
    Widen(Box<Desc>),
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
    /// Its parameters, in the order declared.
    pub params: Vec<Param>,
    /// The axes that it declares, in their order.
    pub axes: Vec<Declared>,
    /// Its measures.
    pub measures: Vec<Output>,
    /// Its figures.
    pub figures: Vec<Output>,
    /// Its tables.
    pub tables: Vec<Output>,
    /// Its claims.
    pub claims: Vec<Output>,
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
}

/// An axis where it is declared.
#[derive(Clone, Debug, PartialEq)]
pub struct Declared {
    /// Which.
    pub axis: AxisId,
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

impl Desc {
    /// The axes it varies over.
    #[must_use]
    pub fn axes(&self) -> BTreeSet<AxisId> {
        let mut axes = BTreeSet::new();
        self.visit(&mut |desc| match desc {
            Self::Axis(axis) | Self::Match(axis, _) => drop(axes.insert(*axis)),
            Self::Held(_, own) => axes.extend(own),
            _ => {}
        });
        axes
    }

    /// Shows it and everything in it to `see`.
    pub fn visit(&self, see: &mut impl FnMut(&Self)) {
        see(self);
        match self {
            Self::Lit(_) | Self::Axis(_) | Self::Held(..) => {}
            Self::List(items) | Self::Match(_, items) => {
                items.iter().for_each(|item| item.visit(see));
            }
            Self::Part(_, args) => args.values().for_each(|arg| arg.visit(see)),
            Self::Binary(_, left, right) => {
                left.visit(see);
                right.visit(see);
            }
            Self::Widen(inner) | Self::Field(inner, _) => inner.visit(see),
        }
    }

    /// Whether a part in it holds something computed.
    #[must_use]
    pub fn holds(&self) -> bool {
        let mut holds = false;
        self.visit(&mut |desc| holds |= matches!(desc, Self::Held(..)));
        holds
    }

    /// Whether there is arithmetic in it, which may have no result.
    #[must_use]
    pub fn computes(&self) -> bool {
        let mut computes = false;
        self.visit(&mut |desc| computes |= matches!(desc, Self::Binary(..)));
        computes
    }

    /// How many values it holds.
    #[must_use]
    pub fn size(&self) -> usize {
        let mut size = 0;
        self.visit(&mut |desc| size += if let Self::Lit(lit) = desc { lit_size(lit) } else { 1 });
        size
    }

    /// The same, with what `change` makes of each description that holds no others, and of each
    /// match.
    #[must_use]
    pub fn change(&self, change: &mut impl FnMut(&Self) -> Option<Self>) -> Self {
        if let Some(changed) = change(self) {
            return changed;
        }
        match self {
            Self::Lit(_) | Self::Axis(_) | Self::Held(..) => self.clone(),
            Self::List(items) => Self::List(items.iter().map(|i| i.change(change)).collect()),
            Self::Match(axis, arms) => {
                Self::Match(*axis, arms.iter().map(|arm| arm.change(change)).collect())
            }
            Self::Part(name, args) => {
                let args = args.iter().map(|(arg, value)| (arg.clone(), value.change(change)));
                Self::Part(name.clone(), args.collect())
            }
            Self::Field(record, name) => Self::Field(Box::new(record.change(change)), name.clone()),
            Self::Binary(op, left, right) => {
                let (left, right) = (left.change(change), right.change(change));
                Self::Binary(*op, Box::new(left), Box::new(right))
            }
            Self::Widen(inner) => Self::Widen(Box::new(inner.change(change))),
        }
    }

    /// What it is at a place that names a coordinate for each of its axes.
    ///
    /// # Errors
    /// If arithmetic has no result: division by zero or overflow.
    ///
    /// What a part holds becomes its slot in [`Spec::held`].
    ///
    /// # Panics
    /// If the place lacks an axis, or types were not checked.
    pub fn eval(&self, axes: &[Axis], place: &Place) -> Result<Lit, String> {
        Ok(match self {
            Self::Lit(lit) => lit.clone(),
            Self::Axis(axis) => axes[axis.0 as usize].coords[place[axis]].value.clone(),
            Self::List(items) => Lit::List(
                items.iter().map(|item| item.eval(axes, place)).collect::<Result<_, _>>()?,
            ),
            Self::Field(record, name) => {
                let record = record.eval(axes, place)?;
                record.field(name).expect("checked to have the field").clone()
            }
            Self::Match(axis, arms) => arms[place[axis]].eval(axes, place)?,
            Self::Held(slot, _) => Lit::Held(Held::Slot(*slot)),
            Self::Part(name, args) => {
                let args = args.iter().map(|(arg, v)| Ok((arg.clone(), v.eval(axes, place)?)));
                Lit::Part(Part {
                    name: name.clone(),
                    args: args.collect::<Result<Args, String>>()?,
                })
            }
            Self::Binary(op, left, right) if op.compares() => {
                Lit::Bool(compare(*op, &left.eval(axes, place)?, &right.eval(axes, place)?))
            }
            Self::Binary(op, left, right) => {
                arithmetic(*op, &left.eval(axes, place)?, &right.eval(axes, place)?)?
            }
            Self::Widen(inner) => widen(inner.eval(axes, place)?),
        })
    }
}

fn lit_size(lit: &Lit) -> usize {
    match lit {
        Lit::List(items) => 1 + items.iter().map(lit_size).sum::<usize>(),
        Lit::Part(part) => 1 + part.args.values().map(lit_size).sum::<usize>(),
        _ => 1,
    }
}

/// Whole numbers as reals, in lists too.
#[must_use]
pub fn widen(lit: Lit) -> Lit {
    match lit {
        Lit::Int(_) => lit.as_f64().map_or(lit, Lit::Real),
        Lit::List(items) => Lit::List(items.into_iter().map(widen).collect()),
        other => other,
    }
}

/// Numbers by size, everything else by being the same or not.
fn compare(op: BinaryOp, left: &Lit, right: &Lit) -> bool {
    let order = match (left, right, left.as_f64(), right.as_f64()) {
        (Lit::Int(a), Lit::Int(b), ..) => Some(a.cmp(b)),
        (_, _, Some(a), Some(b)) => a.partial_cmp(&b),
        _ => (left == right).then_some(Ordering::Equal),
    };
    match op {
        BinaryOp::Less => order == Some(Ordering::Less),
        BinaryOp::AtMost => matches!(order, Some(Ordering::Less | Ordering::Equal)),
        BinaryOp::Greater => order == Some(Ordering::Greater),
        BinaryOp::AtLeast => matches!(order, Some(Ordering::Greater | Ordering::Equal)),
        BinaryOp::Equal => order == Some(Ordering::Equal),
        _ => order != Some(Ordering::Equal),
    }
}

fn arithmetic(op: BinaryOp, left: &Lit, right: &Lit) -> Result<Lit, String> {
    if let (Lit::Int(a), Lit::Int(b)) = (left, right) {
        let whole = match op {
            BinaryOp::Add => a.checked_add(*b),
            BinaryOp::Sub => a.checked_sub(*b),
            BinaryOp::Mul => a.checked_mul(*b),
            _ => return real(op, left, right),
        };
        return whole.map(Lit::Int).ok_or_else(|| format!("{a} {} {b} overflows", op.symbol()));
    }
    real(op, left, right)
}

fn real(op: BinaryOp, left: &Lit, right: &Lit) -> Result<Lit, String> {
    let (a, b) = (left.as_f64().expect("a number"), right.as_f64().expect("a number"));
    let value = match op {
        BinaryOp::Add => a + b,
        BinaryOp::Sub => a - b,
        BinaryOp::Mul => a * b,
        BinaryOp::Div => a / b,
        other => unreachable!("`{}` is no arithmetic", other.symbol()),
    };
    let finite = value.is_finite().then_some(Lit::Real(value));
    finite.ok_or_else(|| format!("{left} {} {right} is not finite", op.symbol()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_description_is_evaluated_at_a_place() {
        let coords = [2, 3].map(|n| Coord { label: n.to_string(), value: Lit::Int(n) }).to_vec();
        let axes = [Axis { name: "n".into(), role: AxisRole::Plain, coords }];
        let n = Desc::Axis(AxisId(0));
        let sum = Desc::Binary(BinaryOp::Add, Box::new(n), Box::new(Desc::Lit(Lit::Int(4))));
        let desc = Desc::Widen(Box::new(Desc::List(vec![sum])));
        let place = Place::from([(AxisId(0), 1)]);
        assert_eq!(desc.eval(&axes, &place), Ok(Lit::List(vec![Lit::Real(7.0)])));
        let picked = desc
            .change(&mut |desc| matches!(desc, Desc::Axis(_)).then_some(Desc::Lit(Lit::Int(2))));
        assert!(picked.axes().is_empty());
        assert_eq!(picked.eval(&axes, &Place::new()), Ok(Lit::List(vec![Lit::Real(6.0)])));
    }

    #[test]
    fn arithmetic_without_a_result_is_an_error() {
        let check = |op, a: Lit, b: Lit| arithmetic(op, &a, &b);
        assert_eq!(check(BinaryOp::Sub, 6.into(), 8.into()), Ok(Lit::Int(-2)));
        assert_eq!(check(BinaryOp::Div, 1.into(), 4.into()), Ok(Lit::Real(0.25)));
        assert!(check(BinaryOp::Div, 1.into(), 0.into()).is_err());
        assert!(check(BinaryOp::Mul, i64::MAX.into(), 2.into()).is_err());
    }
}
