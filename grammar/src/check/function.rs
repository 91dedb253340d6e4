//! Functions of a spec: pure, put in the place of their calls.

use std::collections::BTreeMap;
use std::rc::Rc;

use ivx_op::{Array, Artifact, Ty};

use super::Checker;
use super::call::Written;
use super::expr::{At, is_number};
use super::value::{Fit, Val, coerce, fit};
use crate::ast::{self, ItemKind, LetParam, Name, TyExpr};
use crate::ir::AxisRole;
use crate::{Code, Diagnostic, Span};

/// The type of numbers that are computed.
const SCALAR: &str = "Scalar";
/// The type of what varies over the members of an ensemble.
const ENSEMBLE: &str = "Ensemble";

/// Up to so many bytes a value is told as it is written.
const MOST_TOLD: usize = 40;

/// What the parameter of a function takes.
pub(super) enum Wanted {
    /// A description.
    Desc(Ty),
    /// One number, computed or not.
    Scalar,
    /// Something computed of this kind.
    Artifact(String),
    /// All members of an ensemble of this kind.
    Ensemble(String),
}

impl<'a> Checker<'a> {
    /// What the call of a function amounts to.
    pub(super) fn function(
        &mut self,
        at: &At,
        (scope, name): (usize, &'a Name),
        params: &'a [LetParam],
        body: &'a ast::Expr,
        args: &'a Written<'a>,
        span: Span,
    ) -> Val {
        if self.names.is_active(name) {
            return self.circle(name, (&name.value, span), name.span);
        }
        let names: Vec<&str> = params.iter().map(|param| param.name.value.as_str()).collect();
        let Some(mut given) = self.place_args(&name.value, &names, args) else {
            return Val::Poison;
        };
        let mut locals = BTreeMap::new();
        for (param, given) in params.iter().zip(&mut given) {
            let (value, value_span) = match (given.take(), &param.default) {
                (Some(expr), _) => (self.expr(at, expr), expr.span),
                (None, Some(default)) => {
                    (self.expr(&At::new(scope, at.address.clone()), default), default.span)
                }
                (None, None) => {
                    let wanted = self.written(&param.ty);
                    let message =
                        format!("`{}` needs `{}: {wanted}`", name.value, param.name.value);
                    let fault = Diagnostic::new(Code::MissingArgument, span, message, "left out");
                    return self.fault(fault.also(param.name.span, "declared here"));
                }
            };
            let value = self.argument_of(param, value, value_span);
            if matches!(value, Val::Poison) {
                return value;
            }
            locals.insert(param.name.value.clone(), value);
        }
        self.names.begin(name);
        let inner = At { scope, locals: Rc::new(locals), address: at.address_of(&name.value) };
        let value = self.expr(&inner, body);
        self.names.end();
        value
    }

    /// A value as the parameter of a function asks for it.
    pub(super) fn argument_of(&mut self, param: &'a LetParam, value: Val, span: Span) -> Val {
        let Some(wanted) = self.wanted(&param.ty) else { return Val::Poison };
        let expr = if let Val::Artifact(id) = value { Some(self.program.expr(id)) } else { None };
        let member = |expr: &crate::ir::Expr| {
            expr.axes.iter().any(|axis| self.program.axis(*axis).role == AxisRole::Member)
        };
        match (value, &wanted, expr) {
            (Val::Poison, ..) => Val::Poison,
            (Val::Desc(desc, found), Wanted::Desc(ty), _) if fit(ty, &found) != Fit::No => {
                Val::Desc(coerce(desc, fit(ty, &found), ty), ty.clone())
            }
            (Val::Desc(desc, ty), Wanted::Scalar, _) if is_number(&ty) => Val::Desc(desc, ty),
            (value, Wanted::Scalar, Some(expr))
                if expr.artifact == Array::KIND && expr.dims.is_empty() =>
            {
                value
            }
            (value, Wanted::Artifact(kind), Some(expr)) if expr.artifact == *kind => value,
            (value, Wanted::Ensemble(kind), Some(expr))
                if expr.artifact == *kind && member(expr) =>
            {
                value
            }
            (value, ..) => {
                let (wanted, found) = (self.written(&param.ty), self.program.describe(&value));
                let message = format!("`{}` is {wanted}, found {found}", param.name.value);
                let label = format!("expected {wanted}");
                self.fault(Diagnostic::new(Code::Type, span, message, label))
            }
        }
    }

    /// Whether what a function will be given meets what is computed, or faulty; reports the first.
    pub(super) fn needs_given(&mut self, values: &[(&Val, Span)]) -> bool {
        let given =
            |(value, _): &(&Val, Span)| matches!(value, Val::Desc(desc, _) if desc.is_given());
        if !values.iter().any(given) {
            return false;
        }
        if values.iter().any(|(value, _)| matches!(value, Val::Poison)) {
            return true;
        }
        let computed = values.iter().find(|(value, _)| matches!(value, Val::Artifact(_)));
        let Some((_, span)) = computed else { return false };
        let text = self.source.text(*span).filter(|text| text.len() <= MOST_TOLD);
        let what = text.map_or_else(|| "this".to_owned(), |text| format!("`{text}`"));
        let message = format!(
            "{what} is computed, and a function that is handed on uses only what is known before anything runs"
        );
        let fault = Diagnostic::new(Code::NotLiteral, *span, message, "computed");
        self.fault(fault.help("write the number itself, or call the function where it is used"));
        true
    }

    /// What a type that was written asks for.
    pub(super) fn wanted(&mut self, written: &TyExpr) -> Option<Wanted> {
        let kinds = self.library.kinds();
        let name = written.name.value.as_str();
        Some(match &written.args[..] {
            [] if name == SCALAR => Wanted::Scalar,
            [] if kinds.contains(name) => Wanted::Artifact(name.to_owned()),
            [inner] if name == ENSEMBLE && inner.args.is_empty() => {
                if !kinds.contains(inner.name.value.as_str()) {
                    let message = format!("nothing computed is a `{}`", inner.name.value);
                    let known = kinds.iter().copied();
                    let help = crate::suggest(&inner.name.value, known);
                    let fault = Diagnostic::new(Code::Type, inner.span, message, "unknown type");
                    self.fault(fault.maybe_help(help));
                    return None;
                }
                Wanted::Ensemble(inner.name.value.clone())
            }
            _ => Wanted::Desc(self.ty(written)?),
        })
    }

    /// A type as it was written.
    fn written(&self, ty: &TyExpr) -> String {
        self.source.text(ty.span).unwrap_or_default().to_owned()
    }

    /// Checks the function bodies of a scope that nothing calls, as far as can be without knowing
    /// the arguments: the names in it, and what does not depend on them.
    pub(super) fn uncalled(&mut self, scope: usize) {
        for item in self.scopes.all[scope].items {
            let ItemKind::Let { name, params: Some(params), value } = &item.kind else { continue };
            if self.is_used(scope, name) {
                continue;
            }
            let mut locals = BTreeMap::new();
            for param in params {
                self.wanted(&param.ty);
                if let Some(default) = &param.default {
                    let at = At::new(scope, name.value.clone());
                    let given = self.expr(&at, default);
                    self.argument_of(param, given, default.span);
                }
                locals.insert(param.name.value.clone(), Val::Poison);
            }
            let at = At { scope, locals: Rc::new(locals), address: name.value.clone() };
            self.expr(&at, value);
        }
    }
}
