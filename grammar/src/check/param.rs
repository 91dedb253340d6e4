//! Parameters: default, then profile, then command line.

use std::collections::BTreeMap;

use ivx_op::{Lit, Ty};

use super::expr::At;
use super::value::{Fit, Val, coerce, fit};
use super::{Checker, Settings};
use crate::ast::{Expr, Item, ItemKind, Name, TyExpr};
use crate::ir::{Desc, Param};
use crate::{Advice, Code, Diagnostic, Span, deviations, suggest};

/// Who sets parameters, and to what.
pub(super) struct Params<'a> {
    settings: &'a Settings,
    /// The profiles in force: the one chosen last, each behind its base.
    profiles: Vec<String>,
    /// Who set each parameter, for messages.
    set_by: BTreeMap<(usize, String), String>,
    /// The value that each parameter has where nobody sets it.
    defaults: BTreeMap<(usize, String), Lit>,
}

impl<'a> Params<'a> {
    pub(super) fn new(settings: &'a Settings) -> Self {
        let (set_by, defaults) = (BTreeMap::new(), BTreeMap::new());
        Self { settings, profiles: Vec::new(), set_by, defaults }
    }

    /// The profile that the command line asks for.
    pub(super) fn asked(&self) -> Option<&'a str> {
        self.settings.profile.as_deref()
    }

    /// Puts profiles in force.
    pub(super) fn choose(&mut self, profiles: Vec<String>) {
        self.profiles = profiles;
    }

    /// Who set a parameter.
    pub(super) fn set_by(&self, scope: usize, name: &str) -> Option<&str> {
        self.set_by.get(&(scope, name.to_owned())).map(String::as_str)
    }
}

impl<'a> Checker<'a> {
    /// Evaluates every parameter, and reports what is set but not declared.
    pub(super) fn params(&mut self) {
        let mut params = Vec::new();
        let mut known: Vec<(String, &'a str)> = Vec::new();
        let mut places: BTreeMap<String, Span> = BTreeMap::new();
        for scope in 0..self.scopes.all.len() {
            let names: Vec<_> = self.scopes.all[scope].names.values().copied().collect();
            for item in names {
                let ItemKind::Param { name, .. } = &item.kind else {
                    continue;
                };
                let address = format!("{}.{}", self.scopes.all[scope].name, name.value);
                if let Some(first) = places.insert(address.clone(), name.span) {
                    let message = format!("two parameters have the address `{address}`");
                    let fault = Diagnostic::new(Code::Shadowing, name.span, message, "and here");
                    let help = "give one of the files, or of the parameters, another name";
                    self.fault(fault.also(first, "here").help(help));
                }
                let value = self.name(&At::new(scope, String::new()), &name.value, name.span);
                if let (Val::Desc(Desc::Lit(value), _), true) =
                    (value, scope < self.source.files().len())
                {
                    let param = self.param_of(scope, (&name.value, &address), item, value);
                    params.push(param);
                }
                known.push((address, &name.value));
            }
            self.profiles(scope);
        }
        self.program.set_params(params);
        for (set, _) in &self.params.settings.sets {
            let matching = known.iter().filter(|(address, name)| address == set || name == set);
            let matching: Vec<_> = matching.map(|(address, _)| address.as_str()).collect();
            match matching[..] {
                [_] => {}
                [] if self.lost_parameter(set) => {}
                [] => {
                    let all = known.iter().flat_map(|(address, name)| [address.as_str(), *name]);
                    self.unplaced(format!("no parameter is called `{set}`"), suggest(set, all));
                }
                _ => {
                    let help = format!("say which: {}", matching.join(", "));
                    let message = format!("several parameters are called `{set}`");
                    self.unplaced(message, Some(help.into()));
                }
            }
        }
    }

    /// Reports what the profiles of a scope say twice, or of no parameter.
    fn profiles(&mut self, scope: usize) {
        let mut profiles: BTreeMap<&str, Span> = BTreeMap::new();
        for item in self.scopes.all[scope].items {
            let ItemKind::Profile { name: profile, sets, .. } = &item.kind else {
                continue;
            };
            if let Some(first) = profiles.insert(&profile.value, profile.span) {
                self.fault(super::scope::twice(&profile.value, profile.span, first));
            }
            let mut given: BTreeMap<&str, Span> = BTreeMap::new();
            for (name, _) in sets {
                if let Some(first) = given.insert(&name.value, name.span) {
                    let message = format!("`{}` is set twice", name.value);
                    let fault = Diagnostic::new(Code::TwiceGiven, name.span, message, "set again");
                    self.fault(fault.also(first, "first set here"));
                }
                self.known_parameter(scope, &profile.value, name);
            }
        }
    }

    fn known_parameter(&mut self, scope: usize, profile: &str, name: &Name) {
        let here = &self.scopes.all[scope].names;
        let declares = |item: &&Item| matches!(item.kind, ItemKind::Param { .. });
        if self.faults.sated()
            || here.get(name.value.as_str()).is_some_and(declares)
            || self.scopes.lost(scope, &name.value)
        {
            return;
        }
        let params = here.iter().filter(|(_, item)| declares(item));
        let help = suggest(&name.value, params.map(|(param, _)| *param));
        let message =
            format!("profile `{profile}` sets `{}`, which is no parameter here", name.value);
        let fault =
            Diagnostic::new(Code::UnknownParameter, name.span, message, "not declared here");
        self.fault(fault.maybe_help(help));
    }

    /// Whether a name or an address is of no parameter only because of a fault that was reported.
    fn lost_parameter(&self, set: &str) -> bool {
        let name = set.rsplit_once('.').map_or(set, |(_, name)| name);
        (0..self.scopes.all.len()).any(|scope| self.scopes.lost(scope, name))
    }

    pub(super) fn unplaced(&mut self, message: String, help: Option<Advice>) {
        let (code, labels) = (Code::UnknownParameter, Vec::new());
        let fault = Diagnostic { code, message, labels, help: None, instead: None };
        self.fault(fault.maybe_help(help));
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
        let by_hand = self.params.settings.sets.iter().rev();
        let by_hand = by_hand.clone().find(|(set, _)| *set == address || (set == name && unique()));
        let by_hand = by_hand.map(|(_, lit)| lit.clone());
        let Some(ty) = self.ty(ty) else { return Val::Poison };
        // Every value that a parameter can get is checked, whichever it gets.
        let at = At::new(scope, String::new());
        let value = self.known_before(scope, default);
        let value = self.quotient(&at, &ty, value, default);
        let mut chosen = self.typed(name, &ty, value, default.span, "default");
        if let Val::Desc(Desc::Lit(default), _) = &chosen.0 {
            self.params.defaults.insert((scope, name.to_owned()), default.clone());
        }
        let mut nearest = None;
        let sets = self.scopes.all[scope].sets.get(name).cloned().unwrap_or_default();
        for (profile, expr) in sets {
            let by = format!("profile `{profile}`");
            let value = self.known_before(scope, expr);
            let value = self.quotient(&at, &ty, value, expr);
            let value = self.typed(name, &ty, value, expr.span, &by);
            let in_force = self.params.profiles.iter().position(|known| known == profile);
            if in_force > nearest {
                (chosen, nearest) = (value, in_force);
            }
        }
        if let Some(lit) = by_hand {
            let value = Val::lit(lit.clone(), self.library.type_of(&lit));
            chosen = self.typed(name, &ty, value, default.span, "`--set`");
        }
        let (value, by) = chosen;
        self.params.set_by.insert((scope, name.to_owned()), by);
        value
    }

    /// A parameter that was evaluated, as it is known outside.
    ///
    /// - `names`: its own, and that to bear.
    pub(super) fn param_of(
        &self,
        scope: usize,
        (name, known_as): (&str, &str),
        item: &Item,
        value: Lit,
    ) -> Param {
        let place = (scope, name.to_owned());
        let (docs, deviations) = deviations(&item.docs);
        Param {
            name: known_as.to_owned(),
            docs,
            by: self.params.set_by.get(&place).cloned().unwrap_or_default(),
            default: self.params.defaults.get(&place).unwrap_or(&value).clone(),
            value,
            deviations,
        }
    }

    /// A value as the parameter's type asks for it, and who set it.
    fn typed(&mut self, name: &str, ty: &Ty, value: Val, span: Span, by: &str) -> (Val, String) {
        let by = by.to_owned();
        let Val::Desc(desc, found) = value else { return (Val::Poison, by) };
        let fits = fit(ty, &found);
        if fits == Fit::No {
            let message = format!("`{name}` is {ty}, but its value by {by} is {found}");
            let fault = Diagnostic::new(Code::Type, span, message, format!("expected {ty}"));
            let help = self.library.of_type(ty);
            return (self.fault(fault.maybe_help(help)), by);
        }
        if fits == Fit::Widened && !self.exact(&desc, span) {
            return (Val::Poison, by);
        }
        (Val::Desc(coerce(desc, fits, ty), ty.clone()), by)
    }

    /// The value of an expression that mentions no axis and computes nothing.
    pub(super) fn known_before(&mut self, scope: usize, expr: &'a Expr) -> Val {
        match self.expr(&At::new(scope, String::new()), expr) {
            Val::Desc(desc, ty) if desc.axes().is_empty() && !desc.holds() => {
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

    /// The type that was written.
    pub(super) fn ty(&mut self, written: &TyExpr) -> Option<Ty> {
        match (written.name.value.as_str(), &written.args[..]) {
            ("Bool", []) => Some(Ty::Bool),
            ("Int", []) => Some(Ty::Int),
            ("Float", []) => Some(Ty::Float),
            ("Str", []) => Some(Ty::Str),
            ("List", [item]) => self.ty(item).map(|item| Ty::List(Box::new(item))),
            (family, []) if self.library.families().contains(&family) => {
                Some(Ty::Part(family.to_owned()))
            }
            (name, _) => {
                let families = self.library.families();
                let known = families.iter().copied().chain(["Bool", "Int", "Float", "Str", "List"]);
                let help = suggest(name, known).or_else(|| {
                    Some(
                        "write `Bool`, `Int`, `Float`, `Str`, `List<..>` or a family of parts"
                            .into(),
                    )
                });
                let message = format!("no type is written `{name}` here");
                let fault = Diagnostic::new(Code::Type, written.span, message, "unknown type");
                self.fault(fault.maybe_help(help));
                None
            }
        }
    }
}
