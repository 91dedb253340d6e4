//! Parameters: default, then profile, then command line.

use ivx_op::{Lit, Ty};

use super::Checker;
use super::expr::At;
use super::value::{Fit, Val, coerce, fit, nothing};
use crate::ast::{Expr, ItemKind, TyExpr};
use crate::ir::{Desc, Place};
use crate::{Code, Diagnostic, Span, suggest};

/// The profile in which every parameter has its default, unless a spec declares it.
const DEFAULTS: &str = "paper";
/// The profile used where it is declared and no other is asked for.
const USUAL: &str = "quick";

impl<'a> Checker<'a> {
    /// Chooses the profile.
    pub(super) fn profile(&mut self) {
        let items = self.scopes.all.iter().flat_map(|scope| scope.items);
        let declared = items.filter_map(|item| match &item.kind {
            ItemKind::Profile { name, .. } => Some(name.value.as_str()),
            _ => None,
        });
        let declared: Vec<&str> = declared.collect();
        let asked = self.settings.profile.as_deref();
        self.profile = match asked {
            Some(name) if declared.contains(&name) => Some(name.to_owned()),
            None => declared.contains(&USUAL).then(|| USUAL.to_owned()),
            Some(DEFAULTS) => None,
            Some(name) => {
                let help = suggest(name, declared.iter().copied().chain([DEFAULTS]));
                self.unplaced(format!("no profile is called `{name}`"), help);
                None
            }
        };
        self.spec.profile.clone_from(&self.profile);
    }

    /// Evaluates every parameter, and reports what is set but not declared.
    pub(super) fn params(&mut self) {
        let mut known: Vec<(String, &'a str)> = Vec::new();
        for scope in 0..self.scopes.all.len() {
            let names: Vec<_> = self.scopes.all[scope].names.values().copied().collect();
            for item in names {
                let ItemKind::Param { name, .. } = &item.kind else {
                    continue;
                };
                let address = format!("{}.{}", self.scopes.all[scope].name, name.value);
                let value = self.name(&At::new(scope, String::new()), &name.value, name.span);
                if let (Val::Desc(Desc::Lit(lit), _), true) =
                    (value, scope < self.project.files.len())
                {
                    self.spec.params.insert(address.clone(), lit);
                }
                known.push((address, &name.value));
            }
            self.unknown_in_profiles(scope);
        }
        for (set, _) in &self.settings.sets {
            let matching = known.iter().filter(|(address, name)| address == set || name == set);
            let matching: Vec<_> = matching.map(|(address, _)| address.as_str()).collect();
            match matching[..] {
                [_] => {}
                [] => {
                    let all = known.iter().flat_map(|(address, name)| [address.as_str(), *name]);
                    self.unplaced(format!("no parameter is called `{set}`"), suggest(set, all));
                }
                _ => {
                    let help = format!("say which: {}", matching.join(", "));
                    self.unplaced(format!("several parameters are called `{set}`"), Some(help));
                }
            }
        }
    }

    fn unknown_in_profiles(&mut self, scope: usize) {
        for item in self.scopes.all[scope].items {
            let ItemKind::Profile { name: profile, sets } = &item.kind else {
                continue;
            };
            for (name, _) in sets {
                let here = &self.scopes.all[scope].names;
                if matches!(here.get(name.value.as_str()), Some(item) if matches!(item.kind, ItemKind::Param { .. }))
                {
                    continue;
                }
                let params =
                    here.iter().filter(|(_, item)| matches!(item.kind, ItemKind::Param { .. }));
                let help = suggest(&name.value, params.map(|(name, _)| *name));
                let message = format!(
                    "profile `{}` sets `{}`, which is no parameter here",
                    profile.value, name.value
                );
                let fault = Diagnostic::new(
                    Code::UnknownParameter,
                    name.span,
                    message,
                    "not declared here",
                );
                self.fault(fault.maybe_help(help));
            }
        }
    }

    fn unplaced(&mut self, message: String, help: Option<String>) {
        self.fault(Diagnostic { code: Code::UnknownParameter, message, labels: Vec::new(), help });
    }

    /// The value of one parameter.
    pub(super) fn param(
        &mut self,
        scope: usize,
        name: &'a str,
        ty: &'a TyExpr,
        default: &'a Expr,
    ) -> Val {
        let address = format!("{}.{name}", self.scopes.all[scope].name);
        let unique = || {
            let declares =
                |items: &&'a crate::ast::Item| matches!(items.kind, ItemKind::Param { .. });
            self.scopes.all.iter().filter(|s| s.names.get(name).is_some_and(declares)).count() == 1
        };
        let by_hand = self.settings.sets.iter().rev();
        let by_hand = by_hand.clone().find(|(set, _)| *set == address || (set == name && unique()));
        let in_profile = self.profile.clone().and_then(|profile| {
            let sets = self.scopes.all[scope].profile(&profile)?;
            sets.iter().rev().find(|(set, _)| set.value == name).map(|(_, expr)| (profile, expr))
        });
        let (value, by, span) = match (by_hand, in_profile) {
            (Some((_, lit)), _) => {
                (Val::lit(lit.clone(), self.type_of(lit)), "`--set`".to_owned(), default.span)
            }
            (None, Some((profile, expr))) => {
                (self.known_before(scope, expr), format!("profile `{profile}`"), expr.span)
            }
            (None, None) => (self.known_before(scope, default), "default".to_owned(), default.span),
        };
        let Some(ty) = self.ty(ty) else {
            return Val::Poison;
        };
        let Val::Desc(desc, found) = value else {
            return Val::Poison;
        };
        let fits = fit(&ty, &found);
        if fits == Fit::No {
            let message = format!("`{name}` is {ty}, but its value by {by} is {found}");
            let fault = Diagnostic::new(Code::Type, span, message, format!("expected {ty}"));
            let help = self.of_type(&ty);
            return self.fault(fault.maybe_help(help));
        }
        self.set_by.insert((scope, name.to_owned()), by);
        Val::Desc(coerce(desc, fits), ty)
    }

    /// The value of an expression that mentions no axis and computes nothing.
    pub(super) fn known_before(&mut self, scope: usize, expr: &'a Expr) -> Val {
        match self.expr(&At::new(scope, String::new()), expr) {
            Val::Desc(desc, ty) if desc.axes().is_empty() => {
                self.evaluate(&desc, expr.span).map_or(Val::Poison, |lit| Val::lit(lit, ty))
            }
            Val::Poison => Val::Poison,
            _ => {
                let message = "this must be known before anything runs";
                let fault =
                    Diagnostic::new(Code::NotLiteral, expr.span, message, "varies or is computed");
                self.fault(fault.help("use numbers, strings, parts and parameters only"))
            }
        }
    }

    /// The value of a description that does not vary.
    pub(super) fn evaluate(&mut self, desc: &Desc, span: Span) -> Option<Lit> {
        match desc.eval(&self.spec.axes, &Place::new()) {
            Ok(lit) => Some(lit),
            Err(why) => {
                self.fault(Diagnostic::new(Code::Number, span, why, "has no value"));
                None
            }
        }
    }

    /// The type that was written.
    pub(super) fn ty(&mut self, written: &TyExpr) -> Option<Ty> {
        let families = self.registry.decls().filter_map(|decl| match decl.role {
            ivx_op::Role::Part(family) => Some(family),
            ivx_op::Role::Op(_) => None,
        });
        let families: Vec<&str> = families.collect();
        match (written.name.value.as_str(), &written.args[..]) {
            ("Bool", []) => Some(Ty::Bool),
            ("Int", []) => Some(Ty::Int),
            ("Float", []) => Some(Ty::Float),
            ("Str", []) => Some(Ty::Str),
            ("List", [item]) => self.ty(item).map(|item| Ty::List(Box::new(item))),
            (family, []) if families.contains(&family) => Some(Ty::Part(family.to_owned())),
            (name, _) => {
                let known = families.iter().copied().chain(["Bool", "Int", "Float", "Str", "List"]);
                let help = suggest(name, known).or_else(|| {
                    Some(
                        "write `Bool`, `Int`, `Float`, `Str`, `List<..>` or a family of parts"
                            .to_owned(),
                    )
                });
                let message = format!("no type is written `{name}` here");
                let fault = Diagnostic::new(Code::Type, written.span, message, "unknown type");
                self.fault(fault.maybe_help(help));
                None
            }
        }
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
            Lit::Part(part) => match self.registry.decl(&part.name).map(|decl| &decl.role) {
                Some(ivx_op::Role::Part(family)) => Ty::Part((*family).to_owned()),
                _ => nothing(),
            },
        }
    }
}
