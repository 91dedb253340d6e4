//! Names of axes and dimensions, where these themselves are meant and not their values.

use std::collections::BTreeSet;

use ivx_op::{ArgDecl, Decl, Gather, Port, Takes};

use super::Checker;
use super::expr::At;
use super::scope::name_of;
use crate::ast::{self, ExprKind, Item, ItemKind};
use crate::ir::{AxisId, ExprId};
use crate::{Code, Diagnostic, Span, suggest};

/// The name of an axis or dimension.
#[derive(Clone, Copy)]
pub(super) struct Named<'a> {
    /// The name that the axis was declared by, or that of a dimension.
    pub(super) name: &'a str,
    /// Which axis it is, where a name in scope says so.
    axis: Option<AxisId>,
    /// Whether that name is of an axis with a fault, which was reported.
    lost: bool,
    /// Where it is named.
    pub(super) span: Span,
}

impl<'a> Checker<'a> {
    /// What an expression names.
    pub(super) fn axis_name(&mut self, at: &At, expr: &'a ast::Expr) -> Option<Named<'a>> {
        match (self.item_of(at, expr), &expr.kind) {
            (Some((scope, item)), _) if matches!(item.kind, ItemKind::Axis { .. }) => {
                Some(self.named_by(scope, item, expr.span))
            }
            (_, ExprKind::Name(name)) => {
                Some(Named { name, axis: None, lost: false, span: expr.span })
            }
            _ => None,
        }
    }

    /// What a name means where one of an axis or dimension is expected.
    pub(super) fn named(&mut self, at: &At, name: &'a str, span: Span) -> Named<'a> {
        let found = self.scopes.find(at.scope, name).filter(|_| !at.locals.contains_key(name));
        match found {
            Some((scope, item)) if matches!(item.kind, ItemKind::Axis { .. }) => {
                self.named_by(scope, item, span)
            }
            _ => Named { name, axis: None, lost: false, span },
        }
    }

    /// The dimension that a port which may be left out is given, where nothing else is called so: its own number is
    /// meant.
    ///
    /// - `first`: what the call goes along.
    pub(super) fn own_number(
        &self,
        at: &At,
        port: Port,
        expr: &'a ast::Expr,
        first: &[(ExprId, Span, String)],
    ) -> Option<&'a str> {
        let ExprKind::Name(name) = &expr.kind else { return None };
        let spare = port.takes == Takes::AtMostOne && port.gather == Gather::Named;
        let means_else = at.locals.contains_key(name) || self.scopes.find(at.scope, name).is_some();
        let has = |(id, ..): &(ExprId, Span, String)| self.program.expr(*id).dims.contains(name);
        (spare && !means_else && first.iter().any(has)).then_some(name)
    }

    /// What leaving an argument out feeds, which means the same where a dimension is gone along alone; reports it if
    /// it is not.
    pub(super) fn is_alone<T>(
        &mut self,
        decl: &Decl,
        arg: &ArgDecl,
        name: &str,
        named: &[(&ArgDecl, Vec<Named<'a>>)],
        span: Span,
    ) -> Option<Vec<T>> {
        if named.iter().flat_map(|(_, names)| names).all(|named| named.name == name) {
            return Some(Vec::new());
        }
        let message = format!(
            "`{}.{}` is `{name}`, whose own numbers are read only where it is chosen along nothing else",
            decl.name, arg.name
        );
        let fault = Diagnostic::new(Code::UnknownAxis, span, message, "a dimension");
        self.fault(fault.help(format!("write `over: {name}`, or name an array to read")));
        None
    }

    /// The new names that an argument gives to dimensions; none if one cannot be.
    pub(super) fn new_dims(
        &mut self,
        at: &At,
        decl: &Decl,
        arg: &ArgDecl,
        given: Option<&'a ast::Expr>,
    ) -> Option<Vec<String>> {
        let items = match given.map(|expr| (&expr.kind, expr)) {
            None => &[],
            Some((ExprKind::List(items), _)) => items.as_slice(),
            Some((_, expr)) => std::slice::from_ref(expr),
        };
        let mut names: Vec<String> = Vec::new();
        for item in items {
            let fault = |code, message, label: &str, help: String| {
                Diagnostic::new(code, item.span, message, label).help(help)
            };
            let what = format!("`{}.{}`", decl.name, arg.name);
            let fault = match &item.kind {
                ExprKind::Name(name)
                    if at.locals.contains_key(name)
                        || self.scopes.find(at.scope, name).is_some() =>
                {
                    let message = format!("{what} gives new names, and `{name}` is declared");
                    let help = "give the dimension another name".to_owned();
                    fault(Code::Shadowing, message, "means something else", help)
                }
                ExprKind::Name(name) if names.contains(name) => {
                    let message = format!("{what} has `{name}` twice");
                    let help = "each dimension has a name of its own".to_owned();
                    fault(Code::TwiceGiven, message, "named again", help)
                }
                ExprKind::Name(name) => {
                    names.push(name.clone());
                    continue;
                }
                ExprKind::Str(name) => {
                    let message = format!("{what} takes names of dimensions");
                    let help = format!("write it without quotes: `{name}`");
                    fault(Code::Type, message, "not a name", help)
                }
                _ => {
                    let message = format!("{what} takes names of dimensions");
                    let help = format!("write `{}: [row, column]`", arg.name);
                    fault(Code::Type, message, "not a name", help)
                }
            };
            self.fault(fault);
            return None;
        }
        Some(names)
    }

    fn named_by(&mut self, scope: usize, item: &'a Item, span: Span) -> Named<'a> {
        let ItemKind::Axis { name, fields, values } = &item.kind else {
            unreachable!("only axes are named")
        };
        let axis = self.declared_axis(scope, (name, fields), values);
        Named { name: &name.value, axis, lost: axis.is_none(), span }
    }

    /// The axis that is named, among some: itself, or some of its coordinates.
    pub(super) fn among(
        &self,
        axes: impl IntoIterator<Item = AxisId>,
        named: Named<'_>,
    ) -> Option<AxisId> {
        axes.into_iter().find(|axis| match named.axis {
            Some(own) => self.axes.whole(*axis) == own,
            None => !named.lost && self.program.axis(*axis).name == named.name,
        })
    }

    /// A fault: what is named is no axis and no dimension of a value.
    ///
    /// - `axes`, `dims`: those of the value.
    pub(super) fn not_over(
        &mut self,
        at: &At,
        named: Named<'_>,
        (axes, dims): (&BTreeSet<AxisId>, &[String]),
        (message, label): (String, &str),
    ) {
        if named.lost || self.lost_axis(named.name) {
            return;
        }
        let other = axes.iter().find(|axis| self.program.axis(**axis).name == named.name);
        if let Some(other) = other {
            let name = named.name;
            let message = format!("`{name}` is another axis than the `{name}` of this value");
            let help = self.called(at, *other).map_or_else(
                || "give one of the two axes another name".to_owned(),
                |own| format!("that axis is called `{own}` here"),
            );
            let fault = Diagnostic::new(
                Code::UnknownAxis,
                named.span,
                message,
                "the value does not vary over this one",
            );
            self.fault(fault.help(help));
            return;
        }
        let known: Vec<String> =
            self.program.names(axes).into_iter().chain(dims.iter().cloned()).collect();
        let help = if known.is_empty() {
            Some("it varies over nothing".into())
        } else {
            suggest(named.name, known.iter().map(String::as_str))
        };
        let fault = Diagnostic::new(Code::UnknownAxis, named.span, message, label);
        self.fault(fault.maybe_help(help));
    }

    /// What an axis is called where an expression stands.
    fn called(&self, at: &At, axis: AxisId) -> Option<&'a str> {
        self.scopes.known(at.scope).into_iter().find(|known| {
            let declared = self.scopes.find(at.scope, known);
            let declared = declared.and_then(|(scope, item)| Some((scope, name_of(item)?)));
            declared.is_some_and(|(scope, name)| {
                self.axes.declared(scope, &name.value) == Some(self.axes.whole(axis))
            })
        })
    }
}
