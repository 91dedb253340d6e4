//! Records and their fields: descriptions, results, and the names of experiments.

use std::collections::{BTreeMap, BTreeSet};

use ivx_op::{ArgKind, ByName, Role, Takes, Ty};

use super::Checker;
use super::expr::At;
use super::value::{Val, fold, record};
use crate::ast::{self, ExprKind, Item, Name};
use crate::ir::{self, Desc, Expr, ExprId, Feed, Op};
use crate::{Code, Diagnostic, Span, suggest};

/// The operation that reads one field of a record.
const FIELD: &str = "field";

impl<'a> Checker<'a> {
    /// `(scene: "Hills", env: hills(0))`.
    pub(super) fn record(
        &mut self,
        at: &At,
        fields: &'a [(Option<Name>, ast::Expr)],
        span: Span,
    ) -> Val {
        let mut seen: BTreeMap<&str, Span> = BTreeMap::new();
        let mut values = Vec::new();
        for (name, expr) in fields {
            let Some(name) = name else {
                let message = "the fields of a record have names";
                let fault = Diagnostic::new(Code::Kind, span, message, "not all have one");
                return self.fault(fault.help(
                    "write `(name: value, ...)`; without names only \
                                              where an axis names them: `axis a(x, y) = ...`",
                ));
            };
            if let Some(first) = seen.insert(&name.value, name.span) {
                let message = format!("the record has `{}` twice", name.value);
                let fault = Diagnostic::new(Code::TwiceGiven, name.span, message, "given again");
                return self.fault(fault.also(first, "first given here"));
            }
            let value = self.expr(at, expr);
            if let Val::Artifact(_) = value {
                let message = "this record holds something computed; a record is a description";
                let fault = Diagnostic::new(Code::NotLiteral, expr.span, message, "computed");
                return self.fault(fault.help("give it a name of its own with `let`"));
            }
            values.push((name.value.clone(), value));
        }
        record(values.into_iter())
    }

    /// `task.env`, `run.success` or `experiment.name`.
    pub(super) fn field(&mut self, at: &At, base: &'a ast::Expr, name: &'a Name) -> Val {
        if let Some(scope) = self.experiment_of(at, base) {
            return self.exported(scope, name);
        }
        if let Some(errors) = self.published_errors(at, base, name) {
            return errors;
        }
        match self.expr(at, base) {
            Val::Poison => Val::Poison,
            Val::Desc(desc, Ty::Record(mut fields)) => match fields.remove(&name.value) {
                Some(ty) => Val::Desc(fold(Desc::Field(Box::new(desc), name.value.clone())), ty),
                None => self.no_field("the record", name, fields.keys().map(String::as_str)),
            },
            Val::Artifact(id) => self.field_of(at, id, name),
            value @ Val::Desc(..) => {
                let described = self.program.describe(&value);
                self.no_field(&described, name, [].into_iter())
            }
        }
    }

    fn field_of(&mut self, at: &At, record: ExprId, name: &Name) -> Val {
        let Expr { artifact, axes, collected, .. } = self.program.expr(record).clone();
        let fields = self.library.registry().fields(&artifact);
        let Some(field) = fields.iter().find(|field| field.name == name.value) else {
            let described = self.program.describe(&Val::Artifact(record));
            return self.no_field(&described, name, fields.iter().map(|field| field.name));
        };
        let dims: Vec<String> = field.dims.iter().map(ToString::to_string).collect();
        if !self.apart(&axes, &dims, name.span) {
            return Val::Poison;
        }
        let feed = Feed::one(record);
        let op = Op {
            name: FIELD.to_owned(),
            args: ByName::from([("name".to_owned(), Desc::Lit(field.name.into()))]),
            ports: vec![("record".to_owned(), vec![feed])],
            stochastic: false,
        };
        let expr = Expr {
            address: at.address_of(field.name),
            axes,
            collected,
            artifact: field.artifact.to_owned(),
            dims,
            kind: ir::ExprKind::Op(op),
        };
        let id = self.push(expr, name.span);
        self.field_shapes(id, record, field.name);
        Val::Artifact(id)
    }

    fn no_field<'k>(
        &mut self,
        of: &str,
        name: &Name,
        known: impl Iterator<Item = &'k str> + Clone,
    ) -> Val {
        let message = format!("{of} has no field `{}`", name.value);
        let label = if known.clone().next().is_none() { "not a record" } else { "no such field" };
        let all: Vec<String> = known.clone().map(|field| format!("`{field}`")).collect();
        let help = suggest(&name.value, known)
            .or_else(|| (!all.is_empty()).then(|| format!("it has {}", all.join(", ")).into()));
        let fault = Diagnostic::new(Code::UnknownName, name.span, message, label);
        self.fault(fault.maybe_help(help))
    }

    /// The scope of the experiment that an expression names.
    fn experiment_of(&mut self, at: &At, expr: &ast::Expr) -> Option<usize> {
        let ExprKind::Name(name) = &expr.kind else { return None };
        if at.locals.contains_key(name) {
            return None;
        }
        let (file, item) = self.scopes.find(at.scope, name)?;
        self.scopes.experiment(file, item)
    }

    /// A name of another experiment.
    fn exported(&mut self, scope: usize, name: &'a Name) -> Val {
        let here = &self.scopes.all[scope];
        if !here.names.contains_key(name.value.as_str()) {
            if self.scopes.lost(scope, &name.value) {
                return Val::Poison;
            }
            let message = format!("experiment `{}` declares no `{}`", here.name, name.value);
            let help = suggest(&name.value, here.names.keys().copied());
            let fault =
                Diagnostic::new(Code::UnknownName, name.span, message, "not declared there");
            return self.fault(fault.maybe_help(help));
        }
        self.uses(&At::new(scope, String::new()), &name.value);
        self.name(&At::new(scope, String::new()), &name.value, name.span)
    }

    /// The item that a name, or the name of an experiment's, means.
    pub(super) fn item_of(&mut self, at: &At, expr: &ast::Expr) -> Option<(usize, &'a Item)> {
        match &expr.kind {
            ExprKind::Name(name) if !at.locals.contains_key(name) => {
                self.scopes.find(at.scope, name)
            }
            ExprKind::Field { base, name } => {
                let scope = self.experiment_of(at, base)?;
                let item = self.scopes.all[scope].names.get(name.value.as_str());
                item.map(|item| (scope, *item))
            }
            _ => None,
        }
    }

    /// What a part holds: a description where a number is given, else what is computed.
    pub(super) fn held(
        &mut self,
        at: &At,
        decl: &'a ivx_op::Decl,
        arg: &'a ivx_op::ArgDecl,
        expr: &'a ast::Expr,
    ) -> Option<Desc> {
        let ArgKind::Port(port) = arg.kind else { unreachable!("only ports are held") };
        debug_assert!(!matches!(decl.role, Role::Op(_)), "operations have ports of their own");
        let list = port.takes == Takes::Many && matches!(expr.kind, ExprKind::List(_));
        let items = self.values_given(decl, arg, port, expr)?;
        let mut descs = Vec::new();
        for item in items {
            let value = self.expr(at, item);
            if let Val::Desc(desc, ty @ (Ty::Int | Ty::Float)) = &value
                && port.artifact == "Array"
            {
                let fits = super::value::fit(&Ty::Float, ty);
                let widened = super::value::coerce(desc.clone(), fits, &Ty::Float);
                descs.push(self.evaluates(&widened, item.span).then_some(fold(widened))?);
                continue;
            }
            let id = self.accepted(at, decl, arg, port, value, item.span)?;
            let gathered = self.gathered(port, id, &[], item.span)?;
            let own = self.program.expr(id).axes.iter().copied();
            let axes: BTreeSet<_> = own.filter(|axis| !gathered.contains(axis)).collect();
            let labelled = port.gather.is_labelled();
            let feed = Feed { gathered, labelled, ..Feed::one(id) };
            descs.push(self.program.hold(feed, axes));
        }
        if list { Some(Desc::List(descs)) } else { descs.pop() }
    }
}
