//! Elementwise mathematics, of descriptions and of what is computed; and functions as descriptions.

use std::collections::BTreeMap;
use std::rc::Rc;

use ivx_op::{ByName, Decl, Maths, Ty};

use super::Checker;
use super::call::Written;
use super::expr::{At, is_number};
use super::function::Wanted;
use super::value::{Val, coerce, fit, fold, join};
use crate::ast::{self, LetParam, Name};
use crate::ir::Desc;
use crate::{Code, Diagnostic, Span};

/// The numbers that have names.
pub(super) fn constant(name: &str) -> Option<f64> {
    match name {
        "pi" => Some(std::f64::consts::PI),
        "e" => Some(std::f64::consts::E),
        _ => None,
    }
}

/// The operation that a call means: of two values, the smaller or the larger, where none says over which axis; the
/// highest of some that lie along an axis; and a hyperbolic tangent where it is of something.
pub(super) fn meant<'n>(name: &'n str, args: &Written<'_>) -> &'n str {
    let two = args.len() == 2 && args.iter().all(|(name, _)| name.is_none());
    match name {
        "min" if two => "minimum",
        "max" if two => "maximum",
        "argmin" => "argmin_over",
        "argmax"
            if args
                .iter()
                .any(|(name, _)| name.as_ref().is_some_and(|name| name.value == "over")) =>
        {
            "argmax_over"
        }
        "tanh" if !args.is_empty() => "tanh_of",
        _ => name,
    }
}

impl<'a> Checker<'a> {
    /// What a function of numbers amounts to: a description, if all that it is given are.
    pub(super) fn maths(
        &mut self,
        at: &At,
        (maths, decl): (Maths, &'a Decl),
        given: &[&'a ast::Expr],
        span: Span,
    ) -> Val {
        let at = at.inside(maths.name());
        let values: Vec<(Val, Span)> =
            given.iter().map(|expr| (self.expr(&at, expr), expr.span)).collect();
        let told: Vec<(&Val, Span)> = values.iter().map(|(value, span)| (value, *span)).collect();
        if told.iter().any(|(value, _)| matches!(value, Val::Poison)) || self.needs_given(&told) {
            return Val::Poison;
        }
        let known = values.iter().all(|(value, _)| matches!(value, Val::Desc(..)));
        if known {
            self.known_maths(maths, decl, values, span)
        } else {
            self.computed(&at, maths, decl, values, span)
        }
    }

    fn computed(
        &mut self,
        at: &At,
        maths: Maths,
        decl: &'a Decl,
        values: Vec<(Val, Span)>,
        span: Span,
    ) -> Val {
        let mut ports = Vec::new();
        for (arg, (value, span)) in decl.args.iter().zip(values) {
            match self.array(at, value, span) {
                Some(id) => ports.push((arg.name, id)),
                None => return Val::Poison,
            }
        }
        self.builtin(at, maths.name(), ByName::new(), ports, span)
    }

    fn known_maths(
        &mut self,
        maths: Maths,
        decl: &Decl,
        values: Vec<(Val, Span)>,
        span: Span,
    ) -> Val {
        let mut of = Vec::new();
        for (arg, (value, span)) in decl.args.iter().zip(values) {
            let Val::Desc(desc, ty) = value else { unreachable!("all are known") };
            let condition = maths == Maths::Where && of.is_empty();
            let fits = match &ty {
                Ty::Bool => condition,
                Ty::Str => maths == Maths::Where && !condition,
                ty => !condition && is_number(items(ty)),
            };
            if !fits {
                let wanted = if condition { "a condition" } else { "a number" };
                let message = format!("`{}.{}` is {wanted}, found {ty}", decl.name, arg.name);
                let label = format!("expected {wanted}");
                return self.fault(Diagnostic::new(Code::Type, span, message, label));
            }
            of.push((desc, ty));
        }
        let ty = if maths == Maths::Where {
            let Some(ty) = join(&of[1].1, &of[2].1) else {
                let message =
                    format!("`where` gives {} or {}, which are not of one type", of[1].1, of[2].1);
                return self.fault(Diagnostic::new(Code::Type, span, message, "of two types"));
            };
            for (desc, own) in &mut of[1..] {
                *desc = coerce(desc.clone(), fit(&ty, own), &ty);
            }
            ty
        } else {
            let whole = of.iter().all(|(_, ty)| *items(ty) == Ty::Int);
            let item = match maths {
                Maths::Floor | Maths::Ceil | Maths::Round => Ty::Int,
                Maths::Abs | Maths::Sign | Maths::Minimum | Maths::Maximum | Maths::Clip
                    if whole =>
                {
                    Ty::Int
                }
                _ => Ty::Float,
            };
            let listed = of.iter().map(|(_, ty)| ty).find(|ty| matches!(ty, Ty::List(_)));
            listed.map_or(item.clone(), |ty| of_items(ty, item))
        };
        let constant = of.iter().all(|(desc, _)| matches!(desc, Desc::Lit(_)));
        let desc = Desc::Maths(maths, of.into_iter().map(|(desc, _)| desc).collect());
        if constant {
            self.evaluate(&desc, span).map_or(Val::Poison, |lit| Val::lit(lit, ty))
        } else {
            Val::Desc(desc, ty)
        }
    }

    /// A function of the spec as a description, for what takes functions of numbers.
    pub(super) fn function_itself(
        &mut self,
        (scope, name): (usize, &'a Name),
        params: &'a [LetParam],
        body: &'a ast::Expr,
        (address, span): (String, Span),
    ) -> Val {
        let (mut locals, mut inputs) = (BTreeMap::new(), Vec::new());
        for param in params {
            let value = if let Some(default) = &param.default {
                let value = self.expr(&At::new(scope, address.clone()), default);
                self.argument_of(param, value, default.span)
            } else {
                let Some(wanted) = self.wanted(&param.ty) else { return Val::Poison };
                if !matches!(wanted, Wanted::Desc(Ty::Float) | Wanted::Scalar) {
                    let ty = self.source.text(param.ty.span).unwrap_or_default().to_owned();
                    let message =
                        format!("`{}` takes a {ty}, and so is called where it is used", name.value);
                    let fault =
                        Diagnostic::new(Code::Kind, span, message, "called without arguments");
                    let fault =
                        fault.also(param.name.span, "only functions of `Float` are passed on");
                    return self.fault(fault.help(format!("write `{}(...)`", name.value)));
                }
                inputs.push(param.name.value.clone());
                Val::Desc(Desc::Input(inputs.len() - 1), Ty::Float)
            };
            locals.insert(param.name.value.clone(), value);
        }
        let value = self.expr(&At { scope, locals: Rc::new(locals), address }, body);
        match value {
            Val::Poison => Val::Poison,
            Val::Desc(desc, ty) if is_number(&ty) || ty == Ty::Bool => {
                let function = fold(Desc::Function(inputs.clone(), Box::new(desc)));
                Val::Desc(function, Ty::Function(inputs))
            }
            other => {
                let message = format!(
                    "`{}` makes {} and no number",
                    name.value,
                    self.program.describe(&other)
                );
                let fault = Diagnostic::new(Code::Kind, span, message, "called without arguments");
                self.fault(fault.help(format!("write `{}(...)`", name.value)))
            }
        }
    }
}

/// The type of what lists of lists hold.
pub(super) fn items(ty: &Ty) -> &Ty {
    match ty {
        Ty::List(item) => items(item),
        other => other,
    }
}

/// The type with another one in its innermost lists.
fn of_items(ty: &Ty, item: Ty) -> Ty {
    match ty {
        Ty::List(inner) => Ty::List(Box::new(of_items(inner, item))),
        _ => item,
    }
}

/// The type of arithmetic on numbers, or on lists of them; none if it is not defined.
pub(super) fn arithmetic_type(a: &Ty, b: &Ty, whole: bool) -> Option<Ty> {
    if !is_number(items(a)) || !is_number(items(b)) {
        return None;
    }
    let item =
        if whole && *items(a) == Ty::Int && *items(b) == Ty::Int { Ty::Int } else { Ty::Float };
    Some(if matches!(a, Ty::List(_)) { of_items(a, item) } else { of_items(b, item) })
}
