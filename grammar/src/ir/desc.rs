//! Descriptions: plain data that may vary over axes, and what they are at a place.

use std::cmp::Ordering;
use std::collections::BTreeSet;

use ivx_op::{Args, ByName, Formula, Held, Lit, Maths, Node, Part, Ty};

use super::{Axis, AxisId, Place, number};
use crate::ast::BinaryOp;

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
    Part(String, ByName<Desc>),
    /// The field of a record.
    Field(Box<Desc>, String),
    /// One description for each coordinate of an axis, in its order.
    Match(AxisId, Vec<Desc>),
    /// An artifact that a part holds: its place in [`Spec::held`], and what it varies over.
    Held(usize, BTreeSet<AxisId>),
    /// Arithmetic, or a comparison.
    Binary(BinaryOp, Box<Desc>, Box<Desc>),
    /// A function of numbers, or of lists of them item by item.
    Maths(Maths, Vec<Desc>),
    /// What the function around it is given, by place.
    Input(usize),
    /// A function of numbers: the names of what it is given, and what it makes of that.
    Function(Vec<String>, Box<Desc>),
    /// Whole numbers widened to reals, wherever the type has reals.
    Widen(Box<Desc>, Ty),
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
            Self::Lit(_) | Self::Axis(_) | Self::Held(..) | Self::Input(_) => {}
            Self::List(items) | Self::Match(_, items) | Self::Maths(_, items) => {
                for item in items {
                    item.visit(see);
                }
            }
            Self::Part(_, args) => args.values().for_each(|arg| arg.visit(see)),
            Self::Binary(_, left, right) => {
                left.visit(see);
                right.visit(see);
            }
            Self::Widen(inner, _) | Self::Field(inner, _) | Self::Function(_, inner) => {
                inner.visit(see);
            }
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
        self.visit(&mut |desc| {
            computes |= matches!(desc, Self::Binary(..) | Self::Maths(..) | Self::Input(_));
        });
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
            Self::Lit(_) | Self::Axis(_) | Self::Held(..) | Self::Input(_) => self.clone(),
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
            Self::Maths(maths, of) => {
                Self::Maths(*maths, of.iter().map(|item| item.change(change)).collect())
            }
            Self::Function(inputs, body) => {
                Self::Function(inputs.clone(), Box::new(body.change(change)))
            }
            Self::Widen(inner, ty) => Self::Widen(Box::new(inner.change(change)), ty.clone()),
        }
    }

    /// What it is at a place that names a coordinate for each of its axes.
    ///
    /// # Errors
    /// If arithmetic has no result, by division by zero, overflow or lists of unequal length; or if it is what a
    /// function is given.
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
                let of = [left.eval(axes, place)?, right.eval(axes, place)?];
                number::each(&of, &|of| number::arithmetic(*op, of[0], of[1]))?
            }
            Self::Maths(maths, of) => {
                let of =
                    of.iter().map(|item| item.eval(axes, place)).collect::<Result<Vec<_>, _>>()?;
                number::maths(*maths, &of)?
            }
            Self::Input(_) => {
                return Err(
                    "what a function that is handed on is given is not known before anything runs"
                        .to_owned(),
                );
            }
            Self::Function(inputs, body) => {
                let (inputs, body) = (inputs.clone(), body.node(axes, place)?);
                Lit::Function(Formula { inputs, body }.into())
            }
            Self::Widen(inner, ty) => widen(inner.eval(axes, place)?, ty),
        })
    }
}

impl Desc {
    /// What a function makes of what it is given, at a place.
    fn node(&self, axes: &[Axis], place: &Place) -> Result<Node, String> {
        let node = |desc: &Self| desc.node(axes, place);
        Ok(match self {
            Self::Input(i) => Node::Input(*i),
            Self::Widen(inner, _) if inner.is_given() => node(inner)?,
            Self::Match(axis, arms) => node(&arms[place[axis]])?,
            Self::Maths(maths, of) if self.is_given() => {
                Node::Of(*maths, of.iter().map(node).collect::<Result<_, _>>()?)
            }
            Self::Binary(op, left, right) if self.is_given() => {
                let (left, right) = (node(left)?, node(right)?);
                match op {
                    BinaryOp::Add => Node::Of(Maths::Add, vec![left, right]),
                    BinaryOp::Sub => Node::Of(Maths::Sub, vec![left, right]),
                    BinaryOp::Mul => Node::Of(Maths::Mul, vec![left, right]),
                    BinaryOp::Div => Node::Of(Maths::Div, vec![left, right]),
                    BinaryOp::Less => Node::Of(Maths::Less, vec![left, right]),
                    BinaryOp::AtMost => Node::Of(Maths::AtMost, vec![left, right]),
                    BinaryOp::Greater => Node::Of(Maths::Less, vec![right, left]),
                    BinaryOp::AtLeast => Node::Of(Maths::AtMost, vec![right, left]),
                    BinaryOp::Equal => Node::Of(Maths::Equal, vec![left, right]),
                    BinaryOp::Unequal => {
                        let equal = Node::Of(Maths::Equal, vec![left, right]);
                        Node::Of(Maths::Sub, vec![Node::Number(1.0), equal])
                    }
                }
            }
            known => match known.eval(axes, place)? {
                Lit::Bool(holds) => Node::Number(f64::from(u8::from(holds))),
                lit => match (number::inexact(&lit), lit.as_f64()) {
                    (None, Some(x)) => Node::Number(x),
                    _ => {
                        return Err(format!(
                            "{lit} is no number, which is all that a function makes"
                        ));
                    }
                },
            },
        })
    }

    /// Whether there is something in it that a function is given.
    pub(crate) fn is_given(&self) -> bool {
        let mut given = false;
        self.visit(&mut |desc| given |= matches!(desc, Self::Input(_)));
        given
    }
}

fn lit_size(lit: &Lit) -> usize {
    match lit {
        Lit::List(items) => 1 + items.iter().map(lit_size).sum::<usize>(),
        Lit::Part(part) => 1 + part.args.values().map(lit_size).sum::<usize>(),
        _ => 1,
    }
}

/// A real number as the whole one that it is.
fn narrowed(value: Lit) -> Lit {
    match value {
        #[expect(clippy::cast_possible_truncation, reason = "only what is whole and small")]
        Lit::Real(x) if x.fract() == 0.0 && x.abs() < WHOLE => Lit::Int(x as i64),
        other => other,
    }
}

/// Up to here every whole number is a Float.
pub(crate) const WHOLE: f64 = 9_007_199_254_740_992.0;

/// The value with whole numbers as reals where the type, which it fits, has reals, and the reverse for what is whole.
#[must_use]
pub fn widen(value: Lit, ty: &Ty) -> Lit {
    match (value, ty) {
        (value @ Lit::Int(_), Ty::Float) => value.as_f64().map_or(value, Lit::Real),
        (value @ Lit::Real(_), Ty::Int) => narrowed(value),
        (Lit::List(items), Ty::List(item)) => {
            Lit::List(items.into_iter().map(|value| widen(value, item)).collect())
        }
        (Lit::Part(record), Ty::Record(fields)) => {
            let args = record.args.into_iter().map(|(name, value)| {
                let value = widen(value, &fields[&name]);
                (name, value)
            });
            Lit::Part(Part { name: record.name, args: args.collect() })
        }
        (Lit::Function(formula), Ty::Function(inputs)) => formula
            .given(inputs)
            .map_or(Lit::Function(formula), |given| Lit::Function(given.into())),
        (value, _) => value,
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

#[cfg(test)]
mod tests {
    use super::super::{AxisRole, Coord};
    use super::*;

    #[test]
    fn a_description_is_evaluated_at_a_place() {
        let coords = [2, 3].map(|n| Coord { label: n.to_string(), value: Lit::Int(n) }).to_vec();
        let axes = [Axis { name: "n".into(), role: AxisRole::Plain, coords }];
        let n = Desc::Axis(AxisId(0));
        let sum = Desc::Binary(BinaryOp::Add, Box::new(n), Box::new(Desc::Lit(Lit::Int(4))));
        let reals = Ty::List(Box::new(Ty::Float));
        let desc = Desc::Widen(Box::new(Desc::List(vec![sum])), reals);
        let place = Place::from([(AxisId(0), 1)]);
        assert_eq!(desc.eval(&axes, &place), Ok(Lit::List(vec![Lit::Real(7.0)])));
        let picked = desc
            .change(&mut |desc| matches!(desc, Desc::Axis(_)).then_some(Desc::Lit(Lit::Int(2))));
        assert!(picked.axes().is_empty());
        assert_eq!(picked.eval(&axes, &Place::new()), Ok(Lit::List(vec![Lit::Real(6.0)])));
    }
}
