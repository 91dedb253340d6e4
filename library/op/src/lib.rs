//! What an operation is: the contract between the language, the engine and the library.
//!
//! Operations are nodes of the graph, parts are values inside an operation's arguments.
//! Each is one [`declare!`]; everything else is derived from it.

mod arg;
mod array;
mod artifact;
mod by_name;
mod decl;
mod declare;
pub mod escape;
mod external;
mod function;
mod holm;
mod lit;
mod maths;
mod needs;
mod published;
mod record;
mod registry;
mod rendered;
mod rng;
mod rule;
mod shown;
mod state;
mod verdict;

pub use arg::{
    Arg, ArgError, AxisNames, Call, Collected, DimNames, Everything, Gathered, GroupBy, How,
    Labelled, Literal, Many, MemberCount, Members, Named, NumericAxis, One, PortType,
};
pub use array::{Array, Dim, Labels, MISSING, is_missing, labels_at};
pub use artifact::{
    Artifact, Data, Numbers, Tensors, distance, half, kind_of, read_numbers, read_tensors,
};
pub use by_name::ByName;
pub use decl::{
    ArgDecl, ArgKind, Decl, Dims, FieldDecl, Gather, OutDecl, Port, Range, Role, SKIP_MISSING,
    Takes, Ty,
};
pub use declare::field_name;
pub use external::{
    Content, External, ExternalKind, Fields, File, Foreign, Program, Variable, Word,
};
pub use function::{Formula, Function, Inputs, Node, Number};
pub use holm::holm;
pub use lit::{Args, Held, Lit, Part};
pub use maths::Maths;
pub use needs::Needs;
pub use published::{Published, exact, is_rounded, read_published, too_large, vanishes};
pub use record::{AnyArtifact, AnyRecord};
pub use registry::{Bytes, Declared, Family, Op, OpError, Parts, Produces, Registry, Rows};
pub use rendered::{Figure, Table};
pub use rng::{Ctx, Progress};
pub use rule::{Facts, Rule, ShapeRule, Shapes, Wrong};
pub use shown::{label, shown, shown_roughly, shown_to, shown_to_decimals, shown_together};
pub use state::State;
pub use verdict::{Finding, Outcome, Verdict};
