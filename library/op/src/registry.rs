//! Tables of declared things, by name.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use crate::{
    ArgDecl, ArgError, ArgKind, Args, Artifact, Call, Ctx, Decl, Dims, FieldDecl, Lit, Needs,
    OutDecl, Part, Role, Rule, ShapeRule, Shapes, Ty,
};

/// Implemented by [`declare!`](crate::declare) only.
pub trait Declared: Sized + Send + Sync + 'static {
    /// The name a spec calls it by.
    const NAME: &'static str;
    /// Rises when its output may change.
    const VERSION: u32;
    /// The doc comment.
    const DOCS: &'static str;
    /// Whether it draws random numbers.
    const STOCHASTIC: bool;
    /// What it asks of its arguments together.
    const RULE: Option<Rule>;
    /// What it knows of the shapes of its result.
    const SHAPES: Option<ShapeRule>;
    /// Its arguments, in the order of positional use.
    fn args() -> Vec<ArgDecl>;
    /// Builds it from complete arguments.
    ///
    /// # Errors
    /// If an argument is missing, of another type or does not decode.
    fn build(call: &Call) -> Result<Self, ArgError>;
}

/// What an operation results in; implemented by [`declare!`](crate::declare) only.
pub trait Produces: Declared {
    /// The result.
    type Out: Artifact;
    /// The dimensions inside it.
    const DIMS: Dims;
}

/// A node of the graph.
pub trait Op: Produces {
    /// Computes the result from the arguments, which are the fields of `self`.
    ///
    /// # Errors
    /// If there is no result; the message says why, to the author of the spec.
    fn run(&self, ctx: &Ctx) -> Result<Self::Out, OpError>;

    /// What running it takes, judged by its arguments, the shapes of its result where they are known,
    /// and the bytes of all its inputs.
    #[must_use]
    fn needs(_args: &Args, _shapes: Option<&Shapes>, _input_bytes: u64) -> Needs {
        Needs::default()
    }
}

/// The coordinates of an axis, known before anything runs: `axis task(scene, env) = tasks()`.
pub trait Rows: Declared {
    /// The fields of each coordinate, in order.
    fn fields() -> Vec<(&'static str, Ty)>;
    /// The coordinates: what each is called, and the values of its fields in order.
    fn rows(&self) -> Vec<(String, Vec<Lit>)>;
}

/// Why an operation has no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OpError {
    /// An argument could not be built.
    #[error(transparent)]
    Arg(#[from] ArgError),
    /// The computation has no result.
    #[error("{0}")]
    Failed(String),
    /// The computation was told to end, and kept what it did.
    #[error("it was stopped")]
    Stopped,
}

/// An encoded result.
pub type Bytes = Arc<[u8]>;

/// Labelled rows of values.
type Table = Vec<(String, Vec<Lit>)>;

type List = fn(&Call) -> Result<Table, ArgError>;

type Run = fn(&Call, &Ctx) -> Result<Bytes, OpError>;

type Estimate = fn(&Args, Option<&Shapes>, u64) -> Needs;

/// The operations and parts that specs can use.
#[derive(Default)]
pub struct Registry {
    ops: BTreeMap<&'static str, (Decl, Run, Estimate)>,
    parts: BTreeMap<&'static str, Decl>,
    rows: BTreeMap<&'static str, (Decl, List)>,
}

impl Registry {
    /// Adds an operation.
    ///
    /// # Panics
    /// If the name is taken.
    #[must_use]
    pub fn op<T: Op>(mut self) -> Self {
        let out = OutDecl { artifact: T::Out::KIND, dims: T::DIMS, fields: T::Out::FIELDS };
        let run: Run = |call, ctx| {
            let made = T::build(call)?.run(ctx)?;
            made.is_kept()?;
            Ok(made.encode().into())
        };
        let taken = self.ops.insert(T::NAME, (decl::<T>(Role::Op(out)), run, T::needs));
        assert!(taken.is_none(), "`{}` is declared twice", T::NAME);
        self
    }

    /// Adds the parts of a family.
    ///
    /// # Panics
    /// If a name is taken.
    #[must_use]
    pub fn parts<T: ?Sized>(mut self, table: &Parts<T>) -> Self {
        for (decl, _) in table.entries.values() {
            let taken = self.parts.insert(decl.name, decl.clone());
            assert!(taken.is_none(), "`{}` is declared twice", decl.name);
        }
        self
    }

    /// Adds coordinates that axes can be declared from.
    ///
    /// # Panics
    /// If the name is taken.
    #[must_use]
    pub fn rows<T: Rows>(mut self) -> Self {
        let list: List = |call| Ok(T::build(call)?.rows());
        let taken = self.rows.insert(T::NAME, (decl::<T>(Role::Rows(T::fields())), list));
        assert!(taken.is_none(), "`{}` is declared twice", T::NAME);
        self
    }

    /// The declaration of an operation, a part or coordinates.
    #[must_use]
    pub fn decl(&self, name: &str) -> Option<&Decl> {
        let op = self.ops.get(name).map(|(decl, ..)| decl);
        op.or_else(|| self.parts.get(name)).or_else(|| self.rows.get(name).map(|(decl, _)| decl))
    }

    /// All declarations, operations first, by name.
    pub fn decls(&self) -> impl Iterator<Item = &Decl> {
        let rows = self.rows.values().map(|(decl, _)| decl);
        self.ops.values().map(|(decl, ..)| decl).chain(self.parts.values()).chain(rows)
    }

    /// Whether there is an operation of this name, and it results in a kind of artifact.
    #[must_use]
    pub fn results_in(&self, name: &str, artifact: &str) -> bool {
        let decl = self.ops.get(name).map(|(decl, ..)| decl);
        decl.is_some_and(|decl| matches!(&decl.role, Role::Op(out) if out.artifact == artifact))
    }

    /// The fields of a kind of artifact; none if it is no record.
    #[must_use]
    pub fn fields(&self, artifact: &str) -> &'static [FieldDecl] {
        let mut outs = self.ops.values().filter_map(|(decl, ..)| match &decl.role {
            Role::Op(out) if out.artifact == artifact => Some(out.fields),
            _ => None,
        });
        outs.next().unwrap_or_default()
    }

    /// The coordinates that a complete description stands for; `None` if it stands for none.
    ///
    /// # Errors
    /// If an argument cannot be built.
    #[must_use]
    pub fn list(&self, part: &Part) -> Option<Result<Table, ArgError>> {
        let (_, list) = self.rows.get(part.name.as_str())?;
        Some(list(&Call { args: part.args.clone(), ports: BTreeMap::new() }))
    }

    /// Runs an operation; `ctx.op` must be its name.
    ///
    /// # Errors
    /// If the operation fails.
    ///
    /// # Panics
    /// If there is no such operation: the checker saw to it that there is.
    pub fn run(&self, name: &str, call: &Call, ctx: &Ctx) -> Result<Bytes, OpError> {
        let (_, run, _) = self.ops.get(name).expect("checked programs name known operations");
        run(call, ctx)
    }

    /// What running an operation takes, judged by its arguments, the shapes of its result where they are
    /// known, and the bytes of all its inputs.
    #[must_use]
    pub fn needs(
        &self,
        name: &str,
        args: &Args,
        shapes: Option<&Shapes>,
        input_bytes: u64,
    ) -> Needs {
        let estimate = self.ops.get(name).map(|(.., estimate)| estimate(args, shapes, input_bytes));
        estimate.unwrap_or_default()
    }

    /// The part with defaults filled in, at every depth.
    #[must_use]
    pub fn complete(&self, part: &Part) -> Part {
        let Some(decl) = self.decl(&part.name) else { return part.clone() };
        let mut args = Args::new();
        for arg in &decl.args {
            if let Some(value) = part.args.get(arg.name).or(arg.default.as_ref()) {
                args.insert(arg.name.to_owned(), self.complete_lit(value));
            }
        }
        Part { name: part.name.clone(), args }
    }

    /// The description with the defaults of every part filled in.
    #[must_use]
    pub fn complete_lit(&self, lit: &Lit) -> Lit {
        match lit {
            Lit::Part(part) => Lit::Part(self.complete(part)),
            Lit::List(items) => Lit::List(items.iter().map(|i| self.complete_lit(i)).collect()),
            other => other.clone(),
        }
    }

    /// The number of members that a part or something inside it asks for.
    #[must_use]
    pub fn member_count(&self, lit: &Lit) -> Option<(String, i64)> {
        match lit {
            Lit::List(items) => items.iter().find_map(|item| self.member_count(item)),
            Lit::Part(part) => {
                let decl = self.parts.get(part.name.as_str())?;
                let own = decl.args.iter().find(|arg| arg.kind == ArgKind::Members);
                match own.and_then(|arg| part.args.get(arg.name)) {
                    Some(Lit::Int(n)) => Some((part.name.clone(), *n)),
                    _ => part.args.values().find_map(|value| self.member_count(value)),
                }
            }
            _ => None,
        }
    }
}

fn decl<T: Declared>(role: Role) -> Decl {
    Decl {
        name: T::NAME,
        version: T::VERSION,
        docs: T::DOCS,
        role,
        stochastic: T::STOCHASTIC,
        args: T::args(),
        rule: T::RULE,
        shapes: T::SHAPES,
    }
}

type Build<T> = Box<dyn Fn(&Call) -> Result<Box<T>, ArgError> + Send + Sync>;

/// A family of parts; implemented by [`family!`](crate::family) only.
pub trait Family {
    /// The name of the family, as in `Ke`.
    const NAME: &'static str;
}

/// The parts of one family, by name.
pub struct Parts<T: ?Sized> {
    entries: BTreeMap<&'static str, (Decl, Build<T>)>,
    further: OnceLock<Box<Parts<T>>>,
}

impl<T: Family + ?Sized + 'static> Default for Parts<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Family + ?Sized + 'static> Parts<T> {
    /// An empty family. Name the type: `Parts::<dyn KnowledgeEquivalent>::new()`.
    #[must_use]
    pub fn new() -> Self {
        Self { entries: BTreeMap::new(), further: OnceLock::new() }
    }

    /// The parts of the family that a crate has which uses that of the family: one crate can add such, where it
    /// registers them.
    pub fn further(&self, table: impl FnOnce() -> Self) -> &Self {
        self.further.get_or_init(|| Box::new(table()))
    }

    /// Adds a part; `wrap` is `|part| Box::new(part)`.
    ///
    /// # Panics
    /// If the name is taken.
    #[must_use]
    pub fn with<D: Declared>(mut self, wrap: fn(D) -> Box<T>) -> Self {
        let build: Build<T> = Box::new(move |call| D::build(call).map(wrap));
        let taken = self.entries.insert(D::NAME, (decl::<D>(Role::Part(T::NAME)), build));
        assert!(taken.is_none(), "`{}` is declared twice", D::NAME);
        self
    }

    /// What the parts are called, in order.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.entries.keys().copied()
    }

    /// Builds a complete part.
    ///
    /// # Errors
    /// If the part is not in the family or an argument cannot be built.
    pub fn build(&self, part: &Part) -> Result<Box<T>, ArgError> {
        let missing = || ArgError::NoSuchPart { family: T::NAME, name: part.name.clone() };
        let Some((_, build)) = self.entries.get(part.name.as_str()) else {
            return self.further.get().ok_or_else(missing)?.build(part);
        };
        build(&Call { args: part.args.clone(), ports: BTreeMap::new() })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use super::*;
    use crate::{Array, MemberCount, One, declare, family};

    trait Shape: std::fmt::Debug + Send + Sync {
        fn area(&self) -> f64;
    }

    declare! {
        /// A square.
        struct Square = "square" @ 1 {
            /// Its side.
            side: f64 = 2.0, in 0.0..=10.0, unit "mm";
        }
    }

    impl Shape for Square {
        fn area(&self) -> f64 {
            self.side * self.side
        }
    }

    declare! {
        /// Many of one shape.
        struct Several = "several" @ 2 {
            /// Which.
            shape: Box<dyn Shape> = Part::new("square");
            /// How many.
            members: MemberCount = 3;
        }
    }

    impl Shape for Several {
        fn area(&self) -> f64 {
            let MemberCount = self.members;
            self.shape.area()
        }
    }

    fn shapes() -> &'static Parts<dyn Shape> {
        static TABLE: LazyLock<Parts<dyn Shape>> = LazyLock::new(|| {
            Parts::<dyn Shape>::new().with(|x: Square| Box::new(x)).with(|x: Several| Box::new(x))
        });
        &TABLE
    }

    family!(dyn Shape, "Shape", shapes);

    declare! {
        /// The area times a factor.
        struct Area = "area" @ 1 -> Array [like factor] {
            /// Of what.
            shape: Box<dyn Shape>;
            /// The factor.
            factor: One<Array>;
        }
    }

    impl Op for Area {
        fn run(&self, _: &Ctx) -> Result<Array, OpError> {
            let values = self.factor.values.iter().map(|x| x * self.shape.area()).collect();
            Ok(Array { dims: self.factor.dims.clone(), values })
        }
    }

    declare! {
        /// A number, or another one where that is given.
        struct Instead = "instead" @ 1 -> Array {
            /// The number.
            of: One<Array>;
            /// The other one.
            other: Option<One<Array>>;
        }
    }

    impl Op for Instead {
        fn run(&self, _: &Ctx) -> Result<Array, OpError> {
            Ok(self.other.as_ref().unwrap_or(&self.of).0.clone())
        }
    }

    #[test]
    fn a_port_may_be_left_out() {
        let registry = Registry::default().op::<Instead>();
        let one = |x: f64| crate::Gathered {
            dims: vec![],
            values: vec![Bytes::from(Array::scalar(x).encode())],
            name: String::new(),
        };
        let run = |ports: Vec<(&str, Vec<crate::Gathered<Bytes>>)>| {
            let ports = ports.into_iter().map(|(name, fed)| (name.to_owned(), fed)).collect();
            let call = Call { args: Args::new(), ports };
            let out = registry.run("instead", &call, &Ctx::new("instead", 0, None));
            out.map(|bytes| Array::decode(&bytes).expect("is one").values[0])
        };
        assert_eq!(run(vec![("of", vec![one(1.0)]), ("other", vec![one(2.0)])]), Ok(2.0));
        assert_eq!(run(vec![("of", vec![one(1.0)]), ("other", vec![])]), Ok(1.0));
        assert_eq!(run(vec![("of", vec![one(1.0)])]), Ok(1.0));
        // What is given and does not decode is not left out.
        let bad = crate::Gathered { values: vec![Bytes::from(*b"?")], ..one(0.0) };
        let failed = run(vec![("of", vec![one(1.0)]), ("other", vec![bad])]);
        assert_eq!(failed, Err(OpError::Arg(ArgError::Decode("other"))));
        assert_eq!(run(vec![]), Err(OpError::Arg(ArgError::Missing("of"))));
        let decl = registry.decl("instead").expect("registered");
        assert_eq!(decl.to_string(), "instead(of: Array, other: Array = none) -> Array");
        assert_eq!([decl.args[0].is_optional(), decl.args[1].is_optional()], [false, true]);
    }

    #[test]
    fn a_declared_operation_runs_with_its_parts() {
        let registry = Registry::default().op::<Area>().parts(shapes());
        let part = registry.complete(&Part::new("several"));
        assert_eq!(part.to_string(), "several(members: 3, shape: square(side: 2.0))");
        assert_eq!(registry.member_count(&part.clone().into()), Some(("several".into(), 3)));

        let factor = crate::Gathered {
            dims: vec![],
            values: vec![Bytes::from(Array::scalar(1.5).encode())],
            name: String::new(),
        };
        let call = Call {
            args: [("shape".to_owned(), part.into())].into(),
            ports: [("factor".to_owned(), vec![factor])].into(),
        };
        let ctx = Ctx::new("area", 0, None);
        let out = registry.run("area", &call, &ctx).expect("runs");
        assert_eq!(Array::decode(&out), Some(Array::scalar(6.0)));
        let side = &registry.decl("square").expect("registered").args[0];
        assert_eq!((side.unit, side.in_unit().as_str()), (Some("mm"), " mm"));
        let decl = registry.decl("area").expect("registered");
        assert_eq!(
            decl.to_string(),
            "area(shape: Shape, factor: Array) -> Array[those of factor but over]"
        );
    }
}
