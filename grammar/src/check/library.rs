//! What the library declares, and what can be asked of it whatever the spec.

use std::collections::BTreeSet;

use ivx_op::{ArgDecl, ArgKind, Decl, Gather, Lit, Registry, Role, Ty};

use super::axis::ROWS;
use super::value::nothing;
use crate::article;

/// The operations and parts that a spec can use.
pub(super) struct Library<'a> {
    registry: &'a Registry,
    /// The kinds of artifact that operations take and result in.
    kinds: BTreeSet<&'a str>,
}

impl<'a> Library<'a> {
    pub(super) fn new(registry: &'a Registry) -> Self {
        let mut kinds = BTreeSet::new();
        for decl in registry.decls() {
            if let Role::Op(out) = &decl.role {
                kinds.insert(out.artifact);
                kinds.extend(out.fields.iter().map(|field| field.artifact));
            }
            kinds.extend(decl.args.iter().filter_map(|arg| match &arg.kind {
                ArgKind::Port(port) => Some(port.artifact),
                _ => None,
            }));
        }
        Self { registry, kinds }
    }

    pub(super) fn registry(&self) -> &'a Registry {
        self.registry
    }

    /// Whether an operation makes fewer numbers of an array, or takes the place of axes of it.
    pub(super) fn reduces(&self, name: &str) -> bool {
        let named = |arg: &ArgDecl| matches!(&arg.kind, ArgKind::Port(port) if port.gather == Gather::Named);
        self.registry.decl(name).is_some_and(|decl| decl.args.first().is_some_and(named))
    }

    /// The kinds of artifact there are.
    pub(super) fn kinds(&self) -> &BTreeSet<&'a str> {
        &self.kinds
    }

    /// The families of parts, once for each part.
    pub(super) fn families(&self) -> Vec<&'a str> {
        let families = self.registry.decls().filter_map(|decl| match decl.role {
            Role::Part(family) => Some(family),
            Role::Op(_) | Role::Rows(_) => None,
        });
        families.collect()
    }

    /// The parts of a family.
    pub(super) fn parts(&self, family: &str) -> Vec<&'a Decl> {
        let own = |decl: &&Decl| matches!(decl.role, Role::Part(own) if own == family);
        self.registry.decls().filter(own).collect()
    }

    /// The type of a complete description.
    pub(super) fn type_of(&self, lit: &Lit) -> Ty {
        match lit {
            Lit::Bool(_) => Ty::Bool,
            Lit::Int(_) => Ty::Int,
            Lit::Real(_) => Ty::Float,
            Lit::Text(_) => Ty::Str,
            Lit::List(items) => {
                Ty::List(Box::new(items.first().map_or_else(nothing, |i| self.type_of(i))))
            }
            Lit::Part(part) if part.name.is_empty() => Ty::Record(
                part.args.iter().map(|(name, lit)| (name.clone(), self.type_of(lit))).collect(),
            ),
            Lit::Held(_) | Lit::External(_) => nothing(),
            Lit::Function(formula) => Ty::Function(formula.inputs.clone()),
            Lit::Part(part) => match self.registry.decl(&part.name).map(|decl| &decl.role) {
                Some(Role::Part(family)) => Ty::Part((*family).to_owned()),
                Some(Role::Rows(_)) => Ty::Part(ROWS.to_owned()),
                _ => nothing(),
            },
        }
    }

    /// What a type asks for, as advice.
    pub(super) fn of_type(&self, ty: &Ty) -> Option<String> {
        let family = match ty {
            Ty::Bool => return Some("write `true` or `false`".to_owned()),
            Ty::Int => return Some("write a whole number, such as `10`".to_owned()),
            Ty::Float => return Some("write a number, such as `0.5`".to_owned()),
            Ty::Str => return Some("write text in quotes, such as `\"text\"`".to_owned()),
            Ty::List(item) => return Some(format!("write a list of {item}, such as `[a, b]`")),
            Ty::Part(family) => family,
            Ty::Word => return Some("write text in quotes, or a number".to_owned()),
            Ty::Fields => {
                return Some("write a record, such as `(name: \"text\", n: 3)`".to_owned());
            }
            Ty::External(_) => return Some("write its name in quotes".to_owned()),
            Ty::Function(inputs) => {
                let inputs: Vec<String> =
                    inputs.iter().map(|input| format!("{input}: Float")).collect();
                let inputs = inputs.join(", ");
                return Some(format!("write `let f({inputs}) = ..`, and `f` here"));
            }
            Ty::Record(_) => return None,
        };
        let parts = self.parts(family).into_iter();
        let parts: Vec<_> = parts.take(8).map(|decl| format!("`{}()`", decl.name)).collect();
        (!parts.is_empty()).then(|| format!("{} {family} is {}", article(family), parts.join(", ")))
    }

    /// The operations that result in a kind of artifact, as advice.
    pub(super) fn made_by(&self, artifact: &str) -> Option<String> {
        let makes = |decl: &&Decl| matches!(&decl.role, Role::Op(out) if out.artifact == artifact);
        let makers = self.registry.decls().filter(makes).take(6);
        let makers: Vec<_> = makers.map(|decl| format!("`{}(..)`", decl.name)).collect();
        (!makers.is_empty())
            .then(|| format!("{} {artifact} comes from {}", article(artifact), makers.join(", ")))
    }
}
