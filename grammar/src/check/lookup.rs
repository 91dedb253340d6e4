//! Names: what they stand for, and which are used.

use std::collections::{BTreeMap, BTreeSet};

use ivx_op::{Lit, Role, Ty};

use super::Checker;
use super::expr::At;
use super::look::Seen;
use super::scope::name_of;
use super::value::Val;
use crate::ast::{Item, ItemKind, Name};
use crate::ir::AxisId;
use crate::parse::habit::foreign;
use crate::{Code, Diagnostic, Span, suggest};

/// The experiment at hand, what names are in it, and which are used.
#[derive(Default)]
pub(super) struct Names<'a> {
    /// The scope of the experiment at hand.
    experiment: Option<usize>,
    /// Its `seed` axis.
    seed: Option<AxisId>,
    /// Values of names in it, by where they are declared.
    memo: BTreeMap<Span, Val>,
    /// Names being evaluated, as declared.
    active: Vec<&'a Name>,
    /// The names of each circle of definitions that was reported, by where they are declared.
    circles: BTreeSet<BTreeSet<Span>>,
    /// Names that expressions used, by where they are declared.
    used: BTreeSet<Span>,
    /// What names stood for when they were first evaluated.
    seen: BTreeMap<Span, Seen>,
}

impl<'a> Names<'a> {
    pub(super) fn experiment(&self) -> Option<usize> {
        self.experiment
    }

    pub(super) fn seed(&self) -> Option<AxisId> {
        self.seed
    }

    pub(super) fn set_seed(&mut self, seed: Option<AxisId>) {
        self.seed = seed;
    }

    /// Puts an experiment at hand, whose seeds are not known yet.
    pub(super) fn enter(&mut self, experiment: usize) {
        self.leave(None);
        self.experiment = Some(experiment);
    }

    /// Leaves the experiment at hand, for what has these seeds.
    pub(super) fn leave(&mut self, seed: Option<AxisId>) {
        self.memo.clear();
        (self.experiment, self.seed) = (None, seed);
    }

    /// Begins to evaluate a name.
    pub(super) fn begin(&mut self, declared: &'a Name) {
        self.active.push(declared);
    }

    /// Has evaluated the name that was begun last.
    pub(super) fn end(&mut self) {
        self.active.pop();
    }

    /// Whether a name is being evaluated.
    pub(super) fn is_active(&self, declared: &Name) -> bool {
        self.active.iter().any(|active| active.span == declared.span)
    }

    /// What names stood for, by where they are declared.
    pub(super) fn seen(&self) -> &BTreeMap<Span, Seen> {
        &self.seen
    }

    /// Notes what a name stands for, and what its nodes are called.
    fn see(&mut self, declared: Span, value: &Val, axis: Option<AxisId>, address: String) {
        let value = value.clone();
        let seen = self.seen.entry(declared).or_insert(Seen { value, axis, addresses: Vec::new() });
        seen.addresses.push(address);
    }

    /// Whether an expression used what is declared at a place.
    pub(super) fn is_used(&self, declared: Span) -> bool {
        self.used.contains(&declared)
    }
}

impl<'a> Checker<'a> {
    /// Notes that an expression uses a name.
    pub(super) fn uses(&mut self, at: &At, name: &str) {
        let found = self.scopes.find(at.scope, name).filter(|_| !at.locals.contains_key(name));
        let declared = found.and_then(|(_, item)| name_of(item));
        self.names.used.extend(declared.map(|name| name.span));
    }

    /// Whether an expression used what `scope` declares by a name.
    pub(super) fn is_used(&self, scope: usize, name: &Name) -> bool {
        let item = self.scopes.all[scope].names.get(name.value.as_str());
        let declared = item.and_then(|item| name_of(item));
        declared.is_some_and(|name| self.names.is_used(name.span))
    }

    /// What a name in an expression stands for.
    pub(super) fn used_name(&mut self, at: &At, name: &str, span: Span) -> Val {
        if let Some(local) = at.locals.get(name) {
            return local.clone();
        }
        let Some((scope, item)) = self.scopes.find(at.scope, name) else {
            return match super::maths::constant(name) {
                Some(x) if !self.scopes.lost(at.scope, name) => Val::lit(Lit::Real(x), Ty::Float),
                _ => self.unknown_name(at, name, span),
            };
        };
        self.names.used.extend(name_of(item).map(|name| name.span));
        self.item(scope, item, name, span)
    }

    /// What a name stands for.
    pub(super) fn name(&mut self, at: &At, name: &str, span: Span) -> Val {
        if let Some(local) = at.locals.get(name) {
            return local.clone();
        }
        match self.scopes.find(at.scope, name) {
            Some((scope, item)) => self.item(scope, item, name, span),
            None => self.unknown_name(at, name, span),
        }
    }

    fn unknown_name(&mut self, at: &At, name: &str, span: Span) -> Val {
        if self.scopes.lost(at.scope, name) {
            return Val::Poison;
        }
        if let Some((message, help)) = self.meant_otherwise(name, span) {
            let fault = Diagnostic::new(Code::UnknownName, span, message, "not a value");
            return self.fault(fault.help(help));
        }
        // What is being defined cannot be meant.
        let known = self.scopes.known(at.scope).into_iter();
        let known = known.filter(|known| !self.names.active.iter().any(|own| own.value == *known));
        let help = suggest(name, known.chain(at.locals.keys().map(String::as_str)));
        let message = format!("`{name}` is not known here");
        let fault = Diagnostic::new(Code::UnknownName, span, message, "unknown name");
        self.fault(fault.maybe_help(help))
    }

    /// What a name that nothing declares was probably meant for: a call, or a word of another language.
    fn meant_otherwise(&self, name: &str, span: Span) -> Option<(String, String)> {
        let before = self
            .source
            .text(Span { start: 0, end: span.start, ..span })
            .unwrap_or_default()
            .trim_end_matches([' ', '\t']);
        if before.ends_with("--") {
            let message = format!("`{name}` is not known here, and `--` turns the sign twice");
            return Some((message, "a comment begins with `//`".to_owned()));
        }
        let known = |message: &str, help: &str| Some((message.to_owned(), help.to_owned()));
        match name {
            "True" | "TRUE" | "yes" | "on" => {
                return known(&format!("there is no `{name}`"), "write `true`");
            }
            "False" | "FALSE" | "no" | "off" => {
                return known(&format!("there is no `{name}`"), "write `false`");
            }
            "None" | "none" | "null" | "nil" | "NULL" | "undefined" | "nothing" => {
                return known(
                    &format!("there is no `{name}`: everything has a value"),
                    "leave the argument out for its default, or write the value that is meant",
                );
            }
            "inf" | "Inf" | "Infinity" | "nan" | "NaN" | "NA" => {
                return known(
                    &format!("there is no `{name}`: numbers that are written are finite"),
                    "write a large number, such as `1e300`, or leave the argument out",
                );
            }
            "PI" => return known("there is no `PI`", "write `pi`"),
            _ => {}
        }
        if let Some((message, help)) = foreign(name) {
            return known(message, help);
        }
        let decl = self.library.registry().decl(name)?;
        let what = if matches!(decl.role, Role::Op(_)) { "an operation" } else { "a part" };
        let needed = decl.args.iter().filter(|arg| !arg.is_optional());
        let needed: Vec<String> = needed.map(|arg| format!("{}: ..", arg.name)).collect();
        let message = format!("`{name}` is {what}, which is called");
        Some((message, format!("write `{name}({})`", needed.join(", "))))
    }

    /// What an item stands for, which an expression calls `name`.
    fn item(&mut self, scope: usize, item: &'a Item, name: &str, span: Span) -> Val {
        // An import may have given the name; what is declared is what counts.
        let declared = name_of(item).expect("what is found has a name");
        if let Some(known) = self.names.memo.get(&declared.span) {
            return known.clone();
        }
        if self.names.is_active(declared) {
            return self.circle(declared, (name, span), item.span);
        }
        self.names.begin(declared);
        let inner = At::new(scope, format!("{}/{}", self.owner(scope), declared.value));
        let address = inner.address.clone();
        let value = match &item.kind {
            ItemKind::Param { name, ty, value } => self.param(scope, &name.value, ty, value),
            ItemKind::Axis { name, fields, values } => self
                .declared_axis(scope, (name, fields), values)
                .map_or(Val::Poison, |id| self.axis_value(id)),
            ItemKind::Let { params: None, value, .. } | ItemKind::Measure { value, .. } => {
                self.expr(&inner, value)
            }
            ItemKind::Published { path, .. } => self.published(&inner, scope, path, None),
            ItemKind::Let { params: Some(params), value, .. } => {
                let place = (inner.address, span);
                self.function_itself((scope, declared), params, value, place)
            }
            ItemKind::Experiment { .. } => {
                let message = format!("`{name}` is an experiment");
                let fault = Diagnostic::new(Code::Kind, span, message, "not a value");
                self.fault(fault.help(format!("write `{name}.` and a name that it declares")))
            }
            _ => unreachable!("only these items have names"),
        };
        self.names.end();
        self.names.memo.insert(declared.span, value.clone());
        let axis = match item.kind {
            ItemKind::Axis { .. } => self.axes.declared(scope, &declared.value),
            _ => None,
        };
        self.names.see(declared.span, &value, axis, address);
        value
    }

    /// A fault: a name is needed to define it. Told once, wherever on the circle one begins.
    ///
    /// - `declared`: what is being defined.
    /// - `first`: where its definition stands.
    pub(super) fn circle(
        &mut self,
        declared: &Name,
        (name, span): (&str, Span),
        first: Span,
    ) -> Val {
        let circle = self.names.active.iter().map(|active| active.span);
        let circle = circle.skip_while(|span| *span != declared.span).collect();
        if !self.names.circles.insert(circle) {
            return Val::Poison;
        }
        let message = format!("`{name}` is defined in terms of itself");
        let fault = Diagnostic::new(Code::Recursion, span, message, "again here");
        self.fault(fault.also(first, "defined here"))
    }

    /// What the addresses of a scope's nodes begin with: the experiment at hand, also for what
    /// its file and other files declare.
    fn owner(&self, scope: usize) -> &str {
        &self.scopes.all[self.names.experiment().unwrap_or(scope)].name
    }
}
