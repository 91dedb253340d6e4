//! Calls: functions of the spec, parts and operations.

use std::collections::BTreeMap;

use ivx_op::{ArgDecl, ArgKind, ByName, Decl, ExternalKind, Lit, Maths, Role, Ty};

use super::Checker;
use super::advice::call_help;
use super::expr::At;
use super::value::{Fit, Val, coerce, fit, nothing};
use crate::ast::{self, ItemKind, Name};
use crate::ir::Desc;
use crate::{Advice, Code, Diagnostic, Span, suggest};

/// Arguments as written: a name where one is given, and the expression.
pub(super) type Written<'a> = [(Option<Name>, ast::Expr)];

impl<'a> Checker<'a> {
    /// What a call amounts to.
    pub(super) fn call(
        &mut self,
        at: &At,
        name: &'a Name,
        args: &'a Written<'a>,
        span: Span,
    ) -> Val {
        if name.value == "collect" {
            return self.collect(at, args, span);
        }
        if let Some((scope, item)) = self.scopes.find(at.scope, &name.value)
            && let ItemKind::Let { name: own, params: Some(params), value } = &item.kind
        {
            self.uses(at, &name.value);
            return self.function(at, (scope, own), params, value, args, span);
        }
        let registry = self.library.registry();
        let meant = super::maths::meant(&name.value, args);
        let Some(decl) = registry.decl(meant) else {
            return self.unknown_call(at, name);
        };
        let Some(matched) = self.match_args(decl, args, span) else {
            return Val::Poison;
        };
        if let Some(maths) = Maths::called(decl.name) {
            let given: Vec<&ast::Expr> = matched.iter().filter_map(|(_, expr)| *expr).collect();
            return self.maths(at, (maths, decl), &given, span);
        }
        match &decl.role {
            Role::Part(family) => self.part(at, decl, family, &matched, span),
            Role::Rows(_) => self.part(at, decl, super::axis::ROWS, &matched, span),
            Role::Op(out) => self.op(at, decl, out, &matched, span),
        }
    }

    fn unknown_call(&mut self, at: &At, name: &Name) -> Val {
        if self.scopes.lost(at.scope, &name.value) {
            return Val::Poison;
        }
        let value = self.scopes.find(at.scope, &name.value).is_some();
        let functions = self.scopes.known(at.scope).into_iter().filter(|known| {
            let found = self.scopes.find(at.scope, known);
            matches!(found, Some((_, item)) if matches!(item.kind, ItemKind::Let { params: Some(_), .. }))
        });
        let known: Vec<&str> =
            self.library.registry().decls().map(|decl| decl.name).chain(functions).collect();
        let help = if value {
            Some(format!("`{}` is a value: use it without parentheses", name.value).into())
        } else {
            call_help(&name.value)
                .map(Advice::from)
                .or_else(|| suggest(&name.value, known))
                .or_else(|| Some("`ivx ops` lists what there is".into()))
        };
        let message = format!("no operation, part or function is called `{}`", name.value);
        let fault = Diagnostic::new(Code::UnknownCall, name.span, message, "not known");
        self.fault(fault.maybe_help(help))
    }

    /// The expression given for each of `names`: positional ones first, then by name.
    pub(super) fn place_args(
        &mut self,
        owner: &str,
        names: &[&str],
        args: &'a Written<'a>,
    ) -> Option<Vec<Option<&'a ast::Expr>>> {
        let mut placed: Vec<Option<&'a ast::Expr>> = vec![None; names.len()];
        // A few names are found faster one by one.
        let places = || names.iter().enumerate().rev().map(|(i, name)| (*name, i));
        let many = (names.len() > 32).then(|| places().collect::<BTreeMap<&str, usize>>());
        let find = |name: &str| match &many {
            Some(many) => many.get(name).copied(),
            None => names.iter().position(|own| *own == name),
        };
        let mut sound = true;
        for (i, (name, expr)) in args.iter().enumerate() {
            let place = match name {
                Some(name) => find(&name.value),
                None => Some(i).filter(|i| *i < names.len()),
            };
            let span = name.as_ref().map_or(expr.span, |name| name.span);
            if self.faults.sated() {
                return None;
            }
            match (place, name) {
                (Some(place), _) if placed[place].is_some() => {
                    let message = format!("`{owner}` is given `{}` twice", names[place]);
                    let fault = Diagnostic::new(Code::TwiceGiven, span, message, "given again");
                    let help =
                        "an argument without a name is counted from the first: name this one";
                    self.fault(if name.is_none() { fault.help(help) } else { fault });
                    sound = false;
                }
                (Some(place), _) => placed[place] = Some(expr),
                (None, Some(name)) => {
                    let message = format!("`{owner}` has no argument `{}`", name.value);
                    let fault =
                        Diagnostic::new(Code::UnknownArgument, span, message, "not an argument");
                    let help = self.library.argument_help(owner, &name.value, names);
                    self.fault(fault.maybe_help(help));
                    sound = false;
                }
                (None, None) => {
                    let last = args.last().map_or(span, |(_, last)| last.span);
                    let message =
                        format!("`{owner}` takes {} arguments, found {}", names.len(), args.len());
                    let label =
                        if args.len() > names.len() + 1 { "too many" } else { "one too many" };
                    let known: Vec<String> = names.iter().map(|own| format!("`{own}`")).collect();
                    let fault =
                        Diagnostic::new(Code::UnknownArgument, span.to(last), message, label);
                    self.fault(match &known[..] {
                        [] => fault.help("leave it out"),
                        known => fault.help(format!("they are {}", known.join(", "))),
                    });
                    return None;
                }
            }
        }
        sound.then_some(placed)
    }

    fn match_args(
        &mut self,
        decl: &'a Decl,
        args: &'a Written<'a>,
        span: Span,
    ) -> Option<Vec<(&'a ArgDecl, Option<&'a ast::Expr>)>> {
        let names: Vec<&str> = decl.args.iter().map(|arg| arg.name).collect();
        let placed = self.place_args(decl.name, &names, args)?;
        let mut complete = true;
        for (arg, given) in decl.args.iter().zip(&placed) {
            if given.is_none() && !arg.is_optional() {
                let message = format!("`{}` needs `{}: {}`", decl.name, arg.name, arg.kind);
                let fault = Diagnostic::new(
                    Code::MissingArgument,
                    span,
                    message,
                    format!("`{}` is left out", arg.name),
                );
                let what = clause(arg.docs);
                let unit = arg.unit.map(|unit| format!(", in {unit}")).unwrap_or_default();
                self.fault(fault.help(format!("write `{}: ...`{unit}: {what}", arg.name)));
                complete = false;
            }
        }
        complete.then(|| decl.args.iter().zip(placed).collect())
    }

    fn part(
        &mut self,
        at: &At,
        decl: &'a Decl,
        family: &str,
        args: &[(&'a ArgDecl, Option<&'a ast::Expr>)],
        span: Span,
    ) -> Val {
        let mut descs = ByName::new();
        let mut sound = true;
        for (arg, given) in args {
            let desc = match (&arg.kind, given) {
                (ArgKind::Port(_), Some(expr)) => self.held(at, decl, arg, expr),
                (ArgKind::Port(_), None) if arg.default.is_none() => continue,
                _ => self.literal_arg(at, decl, arg, *given),
            };
            match desc {
                Some(desc) => {
                    descs.insert(arg.name.to_owned(), desc);
                }
                None => sound = false,
            }
        }
        if sound && self.go_together((at, decl, span), args, &descs, &[]).is_ok() {
            self.bounded(Desc::Part(decl.name.to_owned(), descs), Ty::Part(family.to_owned()), span)
        } else {
            Val::Poison
        }
    }

    /// A description argument, complete; `None` if it is faulty.
    pub(super) fn literal_arg(
        &mut self,
        at: &At,
        decl: &Decl,
        arg: &'a ArgDecl,
        given: Option<&'a ast::Expr>,
    ) -> Option<Desc> {
        let ty = match &arg.kind {
            ArgKind::Literal(ty) => ty.clone(),
            _ => Ty::Int,
        };
        let Some(expr) = given else {
            let default = arg.default.as_ref().expect("missing arguments were reported");
            return Some(Desc::Lit(self.library.registry().complete_lit(default)));
        };
        let value = self.given_to(at, &ty, expr);
        match self.quotient(at, &ty, value, expr) {
            Val::Poison => None,
            value @ Val::Artifact(_) => {
                let message =
                    format!("`{}.{}` must be known before anything runs", decl.name, arg.name);
                let label = format!("computed: {}", self.program.describe(&value));
                let fault = Diagnostic::new(Code::NotLiteral, expr.span, message, label);
                let help = self.library.of_type(&ty);
                self.fault(fault.maybe_help(help));
                None
            }
            Val::Desc(desc, found) => {
                let fits = fit(&ty, &found);
                if fits == Fit::No {
                    let told =
                        if found == nothing() { "nothing".to_owned() } else { found.to_string() };
                    let message = format!("`{}.{}` is {ty}, found {told}", decl.name, arg.name);
                    let fault =
                        Diagnostic::new(Code::Type, expr.span, message, format!("expected {ty}"));
                    let help =
                        self.written_as(&ty, &found, expr).or_else(|| self.library.of_type(&ty));
                    self.fault(fault.maybe_help(help));
                    return None;
                }
                if fits == Fit::Widened && !self.exact(&desc, expr.span) {
                    return None;
                }
                let desc = coerce(desc, fits, &ty);
                if !self.evaluates(&desc, expr.span) {
                    return None;
                }
                let desc = match ExternalKind::of(&ty) {
                    Some(kind) => self.found(decl, arg, kind, &desc, expr)?,
                    None => desc,
                };
                let ranged =
                    if arg.kind == ArgKind::Members { Some((1.0..).into()) } else { arg.range };
                match ranged {
                    Some(range) if !self.in_range(at, decl, arg, range, &desc, expr) => None,
                    _ => Some(desc),
                }
            }
        }
    }

    fn in_range(
        &mut self,
        at: &At,
        decl: &Decl,
        arg: &ArgDecl,
        range: ivx_op::Range,
        desc: &Desc,
        expr: &ast::Expr,
    ) -> bool {
        let bad = self.program.places(&desc.axes()).find_map(|place| {
            let lit = desc.eval(self.program.axes(), &place).expect("was seen to have a value");
            outside(range, &lit).map(|bad| (bad.to_string(), self.program.whereabouts(&place)))
        });
        let Some((bad, place)) = bad else { return true };
        let unit = arg.in_unit();
        let message =
            format!("`{}.{}` must be {range}{unit}, found {bad}{place}", decl.name, arg.name);
        let fault = Diagnostic::new(Code::Range, expr.span, message, "out of range");
        let origin = self.origin(at, expr);
        self.fault(match origin {
            Some((span, by)) => fault.also(span, format!("set here by {by}")),
            None => fault,
        });
        false
    }

    /// Who set the parameter that an expression names.
    pub(super) fn origin(&self, at: &At, expr: &ast::Expr) -> Option<(Span, String)> {
        let ast::ExprKind::Name(name) = &expr.kind else {
            return None;
        };
        let (scope, item) = self.scopes.find(at.scope, name)?;
        let declared = super::scope::name_of(item)?;
        let by = self.params.set_by(scope, &declared.value)?;
        Some((item.span, by.to_owned()))
    }
}

/// The first number outside the range, in lists too.
fn outside(range: ivx_op::Range, lit: &Lit) -> Option<&Lit> {
    match lit {
        Lit::List(items) => items.iter().find_map(|item| outside(range, item)),
        number => number.as_f64().filter(|x| !range.contains(*x)).map(|_| lit),
    }
}

/// The first sentence of docs, to stand within another.
fn clause(docs: &str) -> String {
    let sentence = docs.trim().split(". ").next().unwrap_or_default().trim_end_matches('.');
    let mut chars = sentence.chars();
    match chars.next() {
        Some(first) if chars.clone().next().is_some_and(char::is_lowercase) => {
            first.to_lowercase().chain(chars).collect()
        }
        _ => sentence.to_owned(),
    }
}
