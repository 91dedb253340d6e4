//! What was written: names not resolved, types not checked. Every node has its span.

use crate::{Span, Spanned};

/// A name as written.
pub type Name = Spanned<String>;

/// One file.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Ast {
    /// `edition "2026"`.
    pub edition: Option<Spanned<String>>,
    /// The items, in order.
    pub items: Vec<Item>,
}

/// One declaration.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// Its doc comment: lines joined with newlines, without `///`. Empty without one.
    pub docs: String,
    /// What it declares.
    pub kind: ItemKind,
    /// From its keyword to its end.
    pub span: Span,
}

/// What an item declares.
#[derive(Clone, Debug, PartialEq)]
pub enum ItemKind {
    /// `use "file.ivx"` or `use "file.ivx" { a, b as c }`.
    Use {
        /// The file, as written.
        path: Spanned<String>,
        /// The names taken, with the names they get; `None` takes all.
        names: Option<Vec<(Name, Name)>>,
    },
    /// `include "file.ivx"`.
    Include {
        /// The file, as written.
        path: Spanned<String>,
    },
    /// `param members: Int = 32`.
    Param {
        /// Its name.
        name: Name,
        /// Its type.
        ty: TyExpr,
        /// Its value unless a profile or the command line sets another.
        value: Expr,
    },
    /// `profile quick { members = 8, steps = 500 }` or `profile desk: quick { steps = 5_000 }`.
    Profile {
        /// Its name.
        name: Name,
        /// The profile whose settings it takes over.
        base: Option<Name>,
        /// What it sets.
        sets: Vec<(Name, Expr)>,
    },
    /// `axis seed = 0..seeds` or `axis task(scene, env) = ...`.
    Axis {
        /// Its name.
        name: Name,
        /// The fields of each coordinate; none where a coordinate has one value.
        fields: Vec<Name>,
        /// Its coordinates.
        values: AxisExpr,
    },
    /// `let data = ...` or `let f(a: Ke, b: Float = 0.5) = ...`.
    Let {
        /// Its name.
        name: Name,
        /// The parameters of a function; `None` for a value.
        params: Option<Vec<LetParam>>,
        /// What it stands for.
        value: Expr,
    },
    /// `experiment name { ... }`.
    Experiment {
        /// Its name.
        name: Name,
        /// The items inside.
        items: Vec<Item>,
    },
    /// `measure optimality_gap = ...`.
    Measure {
        /// Its name.
        name: Name,
        /// Its value.
        value: Expr,
    },
    /// `figure "2.10a" = bars(...)`.
    Figure {
        /// Its name.
        name: Spanned<String>,
        /// Its value.
        value: Expr,
    },
    /// `table "3.3" = table(...)`.
    Table {
        /// Its name.
        name: Spanned<String>,
        /// Its value.
        value: Expr,
    },
    /// `claim "..." : left < right`, `claim "..." at 0.99 by "t" family "F" : left < right` or
    /// `claim "..." : left on par with right within(0.05, "why so much")`.
    Claim {
        /// What is claimed, in words.
        name: Spanned<String>,
        /// How it is judged.
        asked: Box<Asked>,
        /// What is claimed; a comparison unless the author erred. `on par with` is read as `==`.
        value: Expr,
        /// Whether the sides are said to be on par.
        on_par: bool,
        /// The margin of `within(0.05, "why so much")`.
        within: Option<Box<Within>>,
    },
    /// `published t33 from "table_3_3.ron"`.
    Published {
        /// Its name.
        name: Name,
        /// The file, as written.
        path: Spanned<String>,
    },
    /// Text that does not read as an item; it has its own diagnostic.
    Junk {
        /// The names that it seems to declare; `None` if it may be any.
        names: Option<Vec<Name>>,
    },
}

/// A parameter of a `let` function.
#[derive(Clone, Debug, PartialEq)]
pub struct LetParam {
    /// Its name.
    pub name: Name,
    /// Its type.
    pub ty: TyExpr,
    /// Its default.
    pub default: Option<Expr>,
}

/// A type as written: `Int`, `List<Float>`, `Ke`.
#[derive(Clone, Debug, PartialEq)]
pub struct TyExpr {
    /// Its name.
    pub name: Name,
    /// What stands between `<` and `>`.
    pub args: Vec<TyExpr>,
    /// The whole of it.
    pub span: Span,
}

/// What a claim asks of its verdict.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Asked {
    /// The confidence of `at 0.99`.
    pub at: Option<Expr>,
    /// The method of `by "t"`.
    pub by: Option<Spanned<String>>,
    /// The claims with which it is corrected, of `family "F"`.
    pub family: Option<Spanned<String>>,
}

/// `within(0.05, "why so much")`.
#[derive(Clone, Debug, PartialEq)]
pub struct Within {
    /// How much.
    pub margin: Expr,
    /// Why so much, in words.
    pub why: Option<Spanned<String>>,
}

/// The coordinates of an axis.
#[derive(Clone, Debug, PartialEq)]
pub enum AxisExpr {
    /// `a..b`, without `b`.
    Range(Expr, Expr),
    /// `{ "WCM": wcm(), "MA": ma() }`.
    Labelled(Vec<(Spanned<String>, Expr)>, Span),
    /// Anything else: an expression that must be a list.
    List(Expr),
}

/// An expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Expr {
    /// What it is.
    pub kind: ExprKind,
    /// Where it stands.
    pub span: Span,
}

/// What an expression is.
#[derive(Clone, Debug, PartialEq)]
pub enum ExprKind {
    /// `true`.
    Bool(bool),
    /// `10_000`.
    Int(i64),
    /// `4e-4`.
    Float(f64),
    /// `"text"`, unescaped.
    Str(String),
    /// `[a, b]`.
    List(Vec<Expr>),
    /// `(scene: "Hills", env: hills(0))`; without names `("Hills", hills(0))`, for the fields of an
    /// axis in their order.
    Record(Vec<(Option<Name>, Expr)>),
    /// `match method { "IVE": a, "EVE": b }`.
    Match {
        /// The axis: a name, or the field of an experiment.
        axis: Box<Expr>,
        /// What stands for the value at each label.
        arms: Vec<(Spanned<String>, Expr)>,
    },
    /// `model`.
    Name(String),
    /// `argmax(model, ke: ke)`.
    Call {
        /// What is called.
        name: Name,
        /// The arguments in the order written; without a name the positional ones.
        args: Vec<(Option<Name>, Expr)>,
    },
    /// `gap[ke: "WCM", seed: 0]`.
    Select {
        /// What is selected from.
        base: Box<Expr>,
        /// Axis or dimension, and the label or list of labels.
        at: Vec<(Name, Expr)>,
    },
    /// `2..10`, `..10` or `2..`, in a selection: the labels from the first on, below the last.
    Range {
        /// The first; from the lowest on where there is none.
        from: Option<Box<Expr>>,
        /// What all are below; to the highest where there is none.
        to: Option<Box<Expr>>,
    },
    /// `task.env`.
    Field {
        /// The record.
        base: Box<Expr>,
        /// The field.
        name: Name,
    },
    /// `-x`.
    Negate(Box<Expr>),
    /// `a + b`, `a < b`.
    Binary {
        /// The operator, with its place.
        op: Spanned<BinaryOp>,
        /// Its left side.
        left: Box<Expr>,
        /// Its right side.
        right: Box<Expr>,
    },
    /// Text that does not read as an expression; it has its own diagnostic.
    Junk,
}

/// An operator between two expressions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BinaryOp {
    /// `+`
    Add,
    /// `-`
    Sub,
    /// `*`
    Mul,
    /// `/`
    Div,
    /// `<`
    Less,
    /// `<=`
    AtMost,
    /// `>`
    Greater,
    /// `>=`
    AtLeast,
    /// `==`
    Equal,
    /// `!=`
    Unequal,
}

impl BinaryOp {
    /// The operator as written.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Add => "+",
            Self::Sub => "-",
            Self::Mul => "*",
            Self::Div => "/",
            Self::Less => "<",
            Self::AtMost => "<=",
            Self::Greater => ">",
            Self::AtLeast => ">=",
            Self::Equal => "==",
            Self::Unequal => "!=",
        }
    }

    /// Whether it compares.
    #[must_use]
    pub fn compares(self) -> bool {
        !matches!(self, Self::Add | Self::Sub | Self::Mul | Self::Div)
    }
}
