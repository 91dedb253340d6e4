//! Arguments: how the fields of a declared struct are filled for one run.

use std::collections::BTreeMap;
use std::ops::Deref;
use std::sync::Arc;

use crate::{
    ArgKind, Args, Array, Artifact, Dim, Gather, Held, Lit, Port, Shapes, Takes, Ty, labels_at,
};

/// What one run, or one part, is built from.
#[derive(Clone, Debug, Default)]
pub struct Call {
    /// Descriptions, complete.
    pub args: Args,
    /// Encoded artifacts by port; several where the port took a list.
    pub ports: BTreeMap<String, Vec<Gathered<Arc<[u8]>>>>,
}

/// The values of one port argument, laid out over the axes it gathered.
#[derive(Clone, Debug, PartialEq)]
pub struct Gathered<T> {
    /// The axes gathered, outermost first; none for a single value.
    pub dims: Vec<Dim>,
    /// The values, last axis fastest.
    pub values: Vec<T>,
    /// What the spec calls the value, for legends and column heads; empty where labels do not travel.
    pub name: String,
}

/// Why an argument could not be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ArgError {
    /// An argument without default was left out.
    #[error("needs a value for `{0}`")]
    Missing(&'static str),
    /// An argument has the wrong type.
    #[error("expects {expected}, found {found}")]
    Type {
        /// The type declared.
        expected: Ty,
        /// The value given.
        found: Lit,
    },
    /// A part of this name is not in the family.
    #[error("no {family} is called `{name}`")]
    NoSuchPart {
        /// The family.
        family: &'static str,
        /// The name given.
        name: String,
    },
    /// Bytes that do not decode.
    #[error("the value of `{0}` does not decode")]
    Decode(&'static str),
}

/// A type that can be a field of a declared struct.
pub trait Arg: Sized {
    /// Whether it says how to compute and not what.
    const HOW: bool = false;
    /// What it takes, for the declaration.
    fn kind() -> ArgKind;
    /// Reads it from a call.
    ///
    /// # Errors
    /// If the argument is missing, of another type or does not decode.
    fn take(call: &Call, name: &'static str) -> Result<Self, ArgError>;
}

/// A type that a description can be read as.
pub trait Literal: Sized {
    /// The type in the language.
    fn ty() -> Ty;
    /// Reads it from a complete description.
    ///
    /// # Errors
    /// If the description has another type, or a part in it cannot be built.
    fn from_lit(lit: &Lit) -> Result<Self, ArgError>;
}

impl<T: Literal> Arg for T {
    fn kind() -> ArgKind {
        ArgKind::Literal(T::ty())
    }
    fn take(call: &Call, name: &'static str) -> Result<Self, ArgError> {
        T::from_lit(call.args.get(name).ok_or(ArgError::Missing(name))?)
    }
}

fn mismatch<T: Literal>(lit: &Lit) -> ArgError {
    ArgError::Type { expected: T::ty(), found: lit.clone() }
}

macro_rules! literal {
    ($($rust:ty: $ty:ident from $variant:ident($x:ident) => $value:expr;)+) => {$(
        impl Literal for $rust {
            fn ty() -> Ty {
                Ty::$ty
            }
            fn from_lit(lit: &Lit) -> Result<Self, ArgError> {
                match lit {
                    Lit::$variant($x) => $value.ok_or_else(|| mismatch::<Self>(lit)),
                    _ => Err(mismatch::<Self>(lit)),
                }
            }
        }
    )+};
}

literal! {
    bool: Bool from Bool(b) => Some(*b);
    i64: Int from Int(n) => Some(*n);
    u64: Int from Int(n) => u64::try_from(*n).ok();
    usize: Int from Int(n) => usize::try_from(*n).ok();
    f64: Float from Real(x) => Some(*x);
    String: Str from Text(s) => Some(s.clone());
}

impl<T: Literal> Literal for Vec<T> {
    fn ty() -> Ty {
        Ty::List(Box::new(T::ty()))
    }
    fn from_lit(lit: &Lit) -> Result<Self, ArgError> {
        let Lit::List(items) = lit else { return Err(mismatch::<Self>(lit)) };
        items.iter().map(T::from_lit).collect()
    }
}

/// A description that says how to compute and not what: a limit, a number of threads. It can change
/// no result, and so is in no key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct How<T>(pub T);

impl<T> Deref for How<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T: Literal> Arg for How<T> {
    const HOW: bool = true;
    fn kind() -> ArgKind {
        ArgKind::Literal(T::ty())
    }
    fn take(call: &Call, name: &'static str) -> Result<Self, ArgError> {
        T::take(call, name).map(Self)
    }
}

/// The number of members of an ensemble. It expands to nodes before anything runs,
/// and so carries no value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemberCount;

impl Arg for MemberCount {
    fn kind() -> ArgKind {
        ArgKind::Members
    }
    fn take(_: &Call, _: &'static str) -> Result<Self, ArgError> {
        Ok(Self)
    }
}

/// The field by which the coordinates of an axis that vanishes are grouped. It expands to nodes
/// before anything runs, and so carries no value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GroupBy;

impl Arg for GroupBy {
    fn kind() -> ArgKind {
        ArgKind::Groups
    }
    fn take(_: &Call, _: &'static str) -> Result<Self, ArgError> {
        Ok(Self)
    }
}

/// Names of axes or dimensions, as the gathered values bear them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AxisNames(pub Vec<String>);

impl Arg for AxisNames {
    fn kind() -> ArgKind {
        ArgKind::Axes
    }
    fn take(call: &Call, name: &'static str) -> Result<Self, ArgError> {
        Vec::take(call, name).map(Self)
    }
}

/// Names that dimensions of the result get; an operation says by [`Dims::Named`](crate::Dims::Named) that it has them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DimNames(pub Vec<String>);

impl Arg for DimNames {
    fn kind() -> ArgKind {
        ArgKind::Dims
    }
    fn take(call: &Call, name: &'static str) -> Result<Self, ArgError> {
        Vec::take(call, name).map(Self)
    }
}

/// The name of one axis or dimension whose labels are numbers, as the gathered values bear it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NumericAxis(pub String);

impl Arg for NumericAxis {
    fn kind() -> ArgKind {
        ArgKind::NumericAxis
    }
    fn take(call: &Call, name: &'static str) -> Result<Self, ArgError> {
        let AxisNames(names) = AxisNames::take(call, name)?;
        names.into_iter().next().map(Self).ok_or(ArgError::Missing(name))
    }
}

/// A port that sees one value at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct One<A>(pub A);

impl<A> Deref for One<A> {
    type Target = A;
    fn deref(&self) -> &A {
        &self.0
    }
}

/// A port that sees all members of an ensemble, in member order; never empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Members<A>(pub Vec<A>);

impl<A> Deref for Members<A> {
    type Target = [A];
    fn deref(&self) -> &[A] {
        &self.0
    }
}

/// A port that sees what `collect(x, over: ..)` put together.
#[derive(Clone, Debug, PartialEq)]
pub struct Collected<A>(pub Gathered<A>);

/// A port that sees what `collect(x, over: ..)` put together with the labels of its axes, in the order of
/// declaration. Of what was not collected it sees one value, which has none.
///
/// The names of the axes and their labels are in the key, the name of the value is not.
#[derive(Clone, Debug, PartialEq)]
pub struct Labelled<A>(pub Gathered<A>);

impl<A> Labelled<A> {
    /// The names of the axes that were collected, outermost first.
    pub fn axes(&self) -> impl Iterator<Item = &str> {
        self.0.dims.iter().map(|dim| dim.name.as_str())
    }

    /// Each value with its labels, one for each axis.
    pub fn each(&self) -> impl Iterator<Item = (Vec<String>, &A)> {
        let places = self.0.values.iter().enumerate();
        places.map(|(i, value)| (labels_at(&self.0.dims, i), value))
    }
}

/// A port that sees its value over the axes which the axis arguments name.
#[derive(Clone, Debug, PartialEq)]
pub struct Named<A>(pub Gathered<A>);

/// A port that sees its value over everything it varies over, with labels.
#[derive(Clone, Debug, PartialEq)]
pub struct Everything<A>(pub Gathered<A>);

/// A port that takes one value or a list of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Many<P>(pub Vec<P>);

/// A wrapper that makes a port of an artifact.
pub trait PortType: Sized {
    /// The kind of artifact.
    const ARTIFACT: &'static str;
    /// What one run sees.
    const GATHER: Gather;
    /// Decodes one argument.
    fn decode(gathered: &Gathered<Arc<[u8]>>) -> Option<Self>;
    /// What stands for one before it is computed.
    fn later(shapes: &Shapes) -> Option<Self>;
}

/// What a port was given.
enum Fed {
    Values(Gathered<Arc<[u8]>>),
    Later(Arc<Shapes>),
}

impl Fed {
    fn decode<P: PortType>(&self) -> Option<P> {
        match self {
            Self::Values(gathered) => P::decode(gathered),
            Self::Later(shapes) => P::later(shapes),
        }
    }
}

/// What was given to a port: of an operation among the ports, of a part among the arguments.
fn fed(call: &Call, name: &'static str) -> Result<Vec<Fed>, ArgError> {
    let value = |lit: &Lit| match (lit, lit.as_f64()) {
        (Lit::Held(Held::Value(gathered)), _) => Ok(Fed::Values(gathered.clone())),
        (Lit::Held(Held::Later(shapes)), _) => Ok(Fed::Later(Arc::clone(shapes))),
        (_, Some(number)) => {
            let values = vec![Array::scalar(number).encode().into()];
            Ok(Fed::Values(Gathered { dims: Vec::new(), values, name: String::new() }))
        }
        _ => Err(ArgError::Decode(name)),
    };
    match (call.ports.get(name), call.args.get(name)) {
        (Some(values), _) => Ok(values.iter().cloned().map(Fed::Values).collect()),
        (None, Some(Lit::List(items))) => items.iter().map(value).collect(),
        (None, Some(lit)) => Ok(vec![value(lit)?]),
        (None, None) => Err(ArgError::Missing(name)),
    }
}

fn decode_all<A: Artifact>(gathered: &Gathered<Arc<[u8]>>) -> Option<Gathered<A>> {
    let values = gathered.values.iter().map(|bytes| A::decode(bytes)).collect::<Option<_>>()?;
    Some(Gathered { dims: gathered.dims.clone(), values, name: gathered.name.clone() })
}

macro_rules! port {
    ($($wrapper:ident: $gather:ident, $from:expr;)+) => {$(
        impl<A: Artifact> PortType for $wrapper<A> {
            const ARTIFACT: &'static str = A::KIND;
            const GATHER: Gather = Gather::$gather;
            fn decode(gathered: &Gathered<Arc<[u8]>>) -> Option<Self> {
                let convert: fn(Gathered<A>) -> Option<Self> = $from;
                decode_all(gathered).and_then(convert)
            }
            fn later(shapes: &Shapes) -> Option<Self> {
                let convert: fn(Gathered<A>) -> Option<Self> = $from;
                let (dims, values) = (Vec::new(), vec![A::later(shapes)?]);
                convert(Gathered { dims, values, name: String::new() })
            }
        }

        impl<A: Artifact> Arg for $wrapper<A> {
            fn kind() -> ArgKind {
                ArgKind::Port(Port { artifact: Self::ARTIFACT, gather: Self::GATHER, takes: Takes::One })
            }
            fn take(call: &Call, name: &'static str) -> Result<Self, ArgError> {
                fed(call, name)?.first().and_then(Fed::decode).ok_or(ArgError::Decode(name))
            }
        }

        /// A port that may be left out.
        impl<A: Artifact> Arg for Option<$wrapper<A>> {
            fn kind() -> ArgKind {
                let takes = Takes::AtMostOne;
                let (artifact, gather) = ($wrapper::<A>::ARTIFACT, $wrapper::<A>::GATHER);
                ArgKind::Port(Port { artifact, gather, takes })
            }
            fn take(call: &Call, name: &'static str) -> Result<Self, ArgError> {
                match fed(call, name) {
                    Err(ArgError::Missing(_)) => Ok(None),
                    fed => {
                        let one = |fed: &Fed| fed.decode().ok_or(ArgError::Decode(name));
                        fed?.first().map(one).transpose()
                    }
                }
            }
        }
    )+};
}

port! {
    One: Pointwise, |mut all| all.values.pop().map(Self);
    Members: Members, |all| (!all.values.is_empty()).then_some(Self(all.values));
    Collected: Collected, |all| Some(Self(all));
    Labelled: Labelled, |all| Some(Self(all));
    Named: Named, |all| Some(Self(all));
    Everything: Everything, |all| Some(Self(all));
}

impl<P: PortType> Arg for Many<P> {
    fn kind() -> ArgKind {
        ArgKind::Port(Port { artifact: P::ARTIFACT, gather: P::GATHER, takes: Takes::Many })
    }
    fn take(call: &Call, name: &'static str) -> Result<Self, ArgError> {
        let decoded = fed(call, name)?.iter().map(Fed::decode).collect::<Option<_>>();
        decoded.map(Self).ok_or(ArgError::Decode(name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Labels;

    #[test]
    fn each_value_of_a_collection_has_a_label_an_axis() {
        let names = |names: &[&str]| Labels::Names(names.iter().map(ToString::to_string).collect());
        let dims = vec![
            Dim::new("colour", names(&["red", "green"])),
            Dim::new("n", Labels::Numbers(vec![0.5, 2.0, 1.0])),
        ];
        let values = vec!['a', 'b', 'c', 'd', 'e', 'f'];
        let all = Labelled(Gathered { dims, values, name: String::new() });
        assert!(all.axes().eq(["colour", "n"]));
        let told: Vec<String> = all.each().map(|(at, x)| format!("{x} {}", at.join(" "))).collect();
        let expected = ["a red 0.5", "b red 2", "c red 1", "d green 0.5", "e green 2", "f green 1"];
        assert_eq!(told, expected);

        let one = Labelled(Gathered { dims: vec![], values: vec!['a'], name: String::new() });
        assert!(one.each().eq([(vec![], &'a')]));
    }
}
