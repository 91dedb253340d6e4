//! Everything known about one operation or part, as plain data.
//!
//! A [`Decl`] is what [`declare!`](crate::declare) writes; the checker, the reference page
//! and the key are derived from it and from nothing else.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::{RangeFrom, RangeInclusive};

use crate::{Args, Array, Artifact as _, ExternalKind, Lit, Rule, ShapeRule};

/// The type of a description.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ty {
    /// `true` or `false`.
    Bool,
    /// A whole number; it widens to [`Ty::Float`].
    Int,
    /// A real number.
    Float,
    /// A string.
    Str,
    /// A string or a number, which stands as it is written; for arguments only.
    Word,
    /// A record of any fields with plain values; for arguments only.
    Fields,
    /// The name of something outside the spec; for arguments only.
    External(ExternalKind),
    /// A list of one type.
    List(Box<Ty>),
    /// A part of a family, such as `Ke`.
    Part(String),
    /// A function of numbers, with the names of what it is given.
    Function(Vec<String>),
    /// A record, with the types of its fields by name.
    Record(BTreeMap<String, Ty>),
}

impl fmt::Display for Ty {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool => f.write_str("Bool"),
            Self::Int => f.write_str("Int"),
            Self::Float => f.write_str("Float"),
            Self::Str => f.write_str("Str"),
            Self::Word => f.write_str("Word"),
            Self::Fields => f.write_str("Record"),
            Self::External(kind) => write!(f, "{kind}"),
            Self::List(item) => write!(f, "List<{item}>"),
            Self::Part(family) => f.write_str(family),
            Self::Function(inputs) => write!(f, "Function<{}>", inputs.join(", ")),
            Self::Record(fields) => {
                f.write_str("(")?;
                for (i, (name, ty)) in fields.iter().enumerate() {
                    write!(f, "{}{name}: {ty}", if i == 0 { "" } else { ", " })?;
                }
                f.write_str(")")
            }
        }
    }
}

/// One operation or part.
#[derive(Clone, Debug)]
pub struct Decl {
    /// The name a spec calls it by.
    pub name: &'static str,
    /// Rises when its output may change.
    pub version: u32,
    /// The doc comment of its declaration.
    pub docs: &'static str,
    /// What it is.
    pub role: Role,
    /// Whether it draws random numbers, and so varies over `seed`.
    pub stochastic: bool,
    /// Its arguments, in the order of positional use.
    pub args: Vec<ArgDecl>,
    /// What it asks of its arguments together.
    pub rule: Option<Rule>,
    /// What it knows of the shapes of its result; for operations only.
    pub shapes: Option<ShapeRule>,
}

impl Decl {
    /// The family of a part.
    #[must_use]
    pub fn family(&self) -> Option<&'static str> {
        match self.role {
            Role::Part(family) => Some(family),
            _ => None,
        }
    }
}

/// What a declared thing is.
#[derive(Clone, Debug, PartialEq)]
pub enum Role {
    /// A node of the graph, with its result.
    Op(OutDecl),
    /// A value inside an operation's arguments, with its family.
    Part(&'static str),
    /// The coordinates of an axis, with the fields that each has, in order.
    Rows(Vec<(&'static str, Ty)>),
}

/// The result of an operation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutDecl {
    /// The kind of artifact.
    pub artifact: &'static str,
    /// The dimensions inside it.
    pub dims: Dims,
    /// Its fields, where it is a record.
    pub fields: &'static [FieldDecl],
}

/// One field of a record that an operation results in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldDecl {
    /// Its name.
    pub name: &'static str,
    /// Its doc comment.
    pub docs: &'static str,
    /// The kind of artifact.
    pub artifact: &'static str,
    /// The dimensions inside it.
    pub dims: &'static [&'static str],
}

/// How the dimensions inside a result follow from the arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dims {
    /// These.
    Fixed(&'static [&'static str]),
    /// Those of every array argument together, without what the axis arguments name, and with these.
    Union {
        /// Dimensions that take the place of those taken away.
        add: &'static [&'static str],
    },
    /// Those of one argument, without what the axis arguments name, and with these.
    Reduced {
        /// The argument.
        port: &'static str,
        /// Dimensions that take the place of those taken away.
        add: &'static [&'static str],
    },
    /// Those that an argument names.
    Named(&'static str),
}

/// One argument of an operation or part.
#[derive(Clone, Debug, PartialEq)]
pub struct ArgDecl {
    /// The name a spec gives it by.
    pub name: &'static str,
    /// Its doc comment.
    pub docs: &'static str,
    /// What it takes.
    pub kind: ArgKind,
    /// Used where a spec leaves the argument out.
    pub default: Option<Lit>,
    /// Numbers it accepts; for lists, each item.
    pub range: Option<Range>,
    /// What its numbers count or measure.
    pub unit: Option<&'static str>,
    /// Whether it says how to compute and not what, and so is in no key.
    pub how: bool,
}

impl ArgDecl {
    /// Whether a spec may leave it out: it has a default, or is a port that takes none as well.
    #[must_use]
    pub fn is_optional(&self) -> bool {
        let none = matches!(self.kind, ArgKind::Port(Port { takes: Takes::AtMostOne, .. }));
        none || self.default.is_some()
    }

    /// ` mm` behind its numbers; nothing where it has no unit.
    #[must_use]
    pub fn in_unit(&self) -> String {
        self.unit.map(|unit| format!(" {unit}")).unwrap_or_default()
    }
}

/// What an argument takes.
#[derive(Clone, Debug, PartialEq)]
pub enum ArgKind {
    /// A description.
    Literal(Ty),
    /// The number of members. Each is a node of its own, so that no node knows it.
    Members,
    /// The name of an axis or dimension, or a list of them.
    Axes,
    /// The name of one axis or dimension whose labels are numbers.
    NumericAxis,
    /// A new name for a dimension of the result, or a list of them.
    Dims,
    /// The field of an axis that vanishes by whose values its coordinates are grouped, as in
    /// `task.scene`. Each group is a node of its own, so that no node knows it.
    Groups,
    /// An artifact.
    Port(Port),
}

/// An argument that takes an artifact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Port {
    /// The kind of artifact.
    pub artifact: &'static str,
    /// What one run sees of a value that varies.
    pub gather: Gather,
    /// How many values it takes.
    pub takes: Takes,
}

/// The argument by which a reduction, a figure or a table leaves out what is missing.
pub const SKIP_MISSING: &str = "skip_missing";

impl Port {
    /// Whether it takes numbers of which some are missing: what shows and judges does, and what reduces if it is told
    /// to leave them out.
    #[must_use]
    pub fn takes_missing(&self, args: &Args) -> bool {
        let skips = args.get(SKIP_MISSING) == Some(&Lit::Bool(true));
        self.artifact == Array::KIND
            && (self.gather == Gather::Everything || self.gather == Gather::Named && skips)
    }
}

/// How many values a port takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Takes {
    /// One.
    One,
    /// One, or none where it is left out.
    AtMostOne,
    /// One, or a list of them.
    Many,
}

/// What one run sees of a value that varies over axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gather {
    /// One coordinate: the operation runs once for each.
    Pointwise,
    /// All members of an ensemble.
    Members,
    /// What `collect(x, over: ..)` put together. Labels do not travel.
    Collected,
    /// What `collect(x, over: ..)` put together, with labels and in the order of declaration; one value
    /// where nothing was.
    Labelled,
    /// The axes that the operation's axis arguments name. Labels do not travel.
    Named,
    /// Everything, with labels and in the order of declaration.
    Everything,
}

impl Gather {
    /// Whether the names and labels of axes travel with the values, and so are in keys.
    #[must_use]
    pub fn is_labelled(self) -> bool {
        matches!(self, Self::Labelled | Self::Everything)
    }

    /// Whether it takes what was collected.
    #[must_use]
    pub fn takes_collections(self) -> bool {
        matches!(self, Self::Collected | Self::Labelled | Self::Everything)
    }
}

/// Numbers an argument accepts, bounds included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The lowest.
    pub low: f64,
    /// The highest; may be infinite.
    pub high: f64,
}

impl From<RangeInclusive<f64>> for Range {
    fn from(range: RangeInclusive<f64>) -> Self {
        Self { low: *range.start(), high: *range.end() }
    }
}

impl From<RangeFrom<f64>> for Range {
    fn from(range: RangeFrom<f64>) -> Self {
        Self { low: range.start, high: f64::INFINITY }
    }
}

impl Range {
    /// Whether `x` lies inside.
    #[must_use]
    pub fn contains(&self, x: f64) -> bool {
        self.low <= x && x <= self.high
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.low, self.high) {
            (low, f64::INFINITY) if low == f64::MIN_POSITIVE => f.write_str("above 0"),
            (low, f64::INFINITY) => write!(f, "at least {low}"),
            (low, high) if low == f64::MIN_POSITIVE => write!(f, "above 0 and at most {high}"),
            (low, high) => write!(f, "from {low} to {high}"),
        }
    }
}

impl Decl {
    /// The argument called `name`.
    #[must_use]
    pub fn arg(&self, name: &str) -> Option<&ArgDecl> {
        self.args.iter().find(|arg| arg.name == name)
    }
}

/// As the reference writes it: `argmax(model: Ensemble<Model>, ke: Ke, ...) -> Decision`.
impl fmt::Display for Decl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}(", self.name)?;
        for (i, arg) in self.args.iter().enumerate() {
            write!(f, "{}{}: {}", if i == 0 { "" } else { ", " }, arg.name, arg.kind)?;
            if let Some(default) = &arg.default {
                write!(f, " = {default}")?;
            } else if arg.is_optional() {
                f.write_str(" = none")?;
            }
        }
        match &self.role {
            Role::Op(out) => write!(f, ") -> {out}"),
            Role::Part(family) => write!(f, ") -> {family}"),
            Role::Rows(fields) => {
                let names: Vec<&str> = fields.iter().map(|(name, _)| *name).collect();
                write!(f, ") -> Rows({})", names.join(", "))
            }
        }
    }
}

impl fmt::Display for OutDecl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.artifact)?;
        match self.dims {
            Dims::Fixed([]) => Ok(()),
            Dims::Fixed(dims) => write!(f, "[{}]", dims.join(", ")),
            Dims::Union { .. } => f.write_str("[..]"),
            Dims::Reduced { port, add: [] } => write!(f, "[those of {port} but over]"),
            Dims::Named(arg) => write!(f, "[{arg}]"),
            Dims::Reduced { add, .. } => write!(f, "[.., {}]", add.join(", ")),
        }
    }
}

impl fmt::Display for ArgKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Literal(ty) => write!(f, "{ty}"),
            Self::Members => f.write_str("Int"),
            Self::Axes | Self::NumericAxis => f.write_str("Axis"),
            Self::Dims => f.write_str("Names"),
            Self::Groups => f.write_str("Field"),
            Self::Port(port) => write!(f, "{port}"),
        }
    }
}

impl fmt::Display for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.gather {
            Gather::Members => write!(f, "Ensemble<{}>", self.artifact),
            Gather::Collected => write!(f, "Collection<{}>", self.artifact),
            Gather::Labelled => write!(f, "{0} or Collection<{0}>", self.artifact),
            _ if self.takes == Takes::Many => write!(f, "List<{}>", self.artifact),
            _ => f.write_str(self.artifact),
        }
    }
}
