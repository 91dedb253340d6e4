//! Which axes a port gathers, and `collect`.

use std::collections::{BTreeMap, BTreeSet};

use ivx_op::{ArgDecl, ArgKind, Decl, Gather, Labels, Port};

use super::Checker;
use super::call::Written;
use super::expr::At;
use super::named::Named;
use super::op::Fed;
use super::value::Val;
use crate::ir::{AxisId, AxisRole, ExprId, Feed};
use crate::{Code, Diagnostic, Span};

impl<'a> Checker<'a> {
    /// Whether every axis named is one that some gathering port varies over; reports it if not.
    pub(super) fn known_axes(
        &mut self,
        at: &At,
        decl: &Decl,
        fed: &[Fed<'_>],
        named: &[(&ArgDecl, Vec<Named<'a>>)],
    ) -> bool {
        let gathers =
            |feed: &&Fed<'_>| matches!(feed.port.gather, Gather::Named | Gather::Everything);
        let (mut axes, mut dims) = (BTreeSet::new(), Vec::new());
        for (id, _, _) in fed.iter().filter(gathers).flat_map(|feed| &feed.exprs) {
            let expr = self.program.expr(*id);
            axes.extend(&expr.axes);
            dims.extend(expr.dims.clone());
        }
        let mut sound = true;
        for named in named.iter().flat_map(|(_, names)| names) {
            let known = dims.iter().any(|dim| dim == named.name)
                || self.among(axes.iter().copied(), *named).is_some();
            if !known {
                sound = false;
                let message =
                    format!("`{}` has nothing that varies over `{}`", decl.name, named.name);
                let fault = (message, "no axis or dimension of it");
                self.not_over(at, *named, (&axes, &dims), fault);
            }
        }
        sound && self.shown(decl, fed, named)
    }

    /// Whether everything that is shown varies over the axes that say how; reports it if not.
    ///
    /// What may be left out is asked for the axes that may not.
    fn shown(
        &mut self,
        decl: &Decl,
        fed: &[Fed<'_>],
        named: &[(&ArgDecl, Vec<Named<'a>>)],
    ) -> bool {
        let shown = fed.iter().filter(|feed| feed.port.gather == Gather::Everything);
        if shown.clone().next().is_some() && !self.named_once(decl, named) {
            return false;
        }
        for feed in shown {
            let spare = decl.arg(feed.name).is_some_and(ivx_op::ArgDecl::is_optional);
            let asked = named.iter().filter(|(arg, _)| !(spare && arg.default.is_some()));
            for (arg, named) in asked.flat_map(|(arg, all)| all.iter().map(move |n| (arg, n))) {
                let lacks = feed.exprs.iter().find(|(id, ..)| {
                    let expr = self.program.expr(*id);
                    !expr.dims.iter().any(|dim| dim == named.name)
                        && self.among(expr.axes.iter().copied(), *named).is_none()
                });
                let Some((id, span, _)) = lacks else { continue };
                let axis = named.name;
                let message = format!("`{}.{}` is `{axis}`, which this lacks", decl.name, arg.name);
                let label = format!("does not vary over `{axis}`");
                let over = self.program.expr(*id);
                let over = [self.program.names(&over.axes), over.dims.clone()].concat();
                let help = if over.is_empty() {
                    "it varies over nothing: leave it out, or show it by itself".to_owned()
                } else {
                    format!("it varies over `{}`", over.join("`, `"))
                };
                let fault = Diagnostic::new(Code::UnknownAxis, *span, message, label);
                let fault = fault.also(named.span, "asked for here");
                self.fault(fault.help(help));
                return false;
            }
        }
        self.aligned(decl, fed, named) && self.numeric(fed, named)
    }

    /// Whether what has no place of its own has the same labels along the axes that need one;
    /// reports it if not.
    fn aligned(
        &mut self,
        decl: &Decl,
        fed: &[Fed<'_>],
        named: &[(&ArgDecl, Vec<Named<'a>>)],
    ) -> bool {
        let needed = |name: &str| decl.arg(name).is_some_and(|arg| !arg.is_optional());
        let shown = fed.iter().filter(|feed| feed.port.gather == Gather::Everything);
        let shown: Vec<_> = shown
            .filter(|feed| needed(feed.name))
            .flat_map(|feed| feed.exprs.iter().map(|(id, span, _)| (*id, *span)))
            .collect();
        let named = named.iter().filter(|(arg, _)| arg.default.is_none());
        let names: Vec<&str> = named.flat_map(|(_, all)| all.iter().map(|n| n.name)).collect();
        shown
            .iter()
            .skip(1)
            .all(|other| names.iter().all(|name| self.same_labels(name, shown[0], *other)))
    }

    /// Whether the labels of axes are numbers where they must be, as far as is known; reports it if
    /// not.
    fn numeric(&mut self, fed: &[Fed<'_>], named: &[(&ArgDecl, Vec<Named<'a>>)]) -> bool {
        let numeric = named.iter().filter(|(arg, _)| arg.kind == ArgKind::NumericAxis);
        for named in numeric.flat_map(|(_, names)| names) {
            for (id, ..) in fed.iter().flat_map(|feed| &feed.exprs) {
                let Some(Labels::Names(names)) = self.labels_along(*id, named.name) else {
                    continue;
                };
                let Some(odd) = names.iter().find(|name| name.parse::<f64>().is_err()) else {
                    continue;
                };
                let message = format!("the labels of `{}` are not numbers: {odd:?}", named.name);
                let fault =
                    Diagnostic::new(Code::Axis, named.span, message, "numbers are shown here");
                self.fault(fault.help("show an axis of names by `bars`, or name it in `by`"));
                return false;
            }
        }
        true
    }

    /// Whether each axis has one place in what is shown; reports it if not.
    fn named_once(&mut self, decl: &Decl, named: &[(&ArgDecl, Vec<Named<'a>>)]) -> bool {
        let mut first: BTreeMap<&str, Span> = BTreeMap::new();
        for named in named.iter().flat_map(|(_, names)| names) {
            if let Some(first) = first.insert(named.name, named.span) {
                let message = format!("`{}` is given `{}` twice", decl.name, named.name);
                let fault = Diagnostic::new(Code::TwiceGiven, named.span, message, "given again");
                self.fault(fault.also(first, "first given here"));
                return false;
            }
        }
        true
    }

    /// The axes that a port gathers of a value, outermost first.
    pub(super) fn gathered(
        &mut self,
        port: Port,
        id: ExprId,
        taken: &[&str],
        span: Span,
    ) -> Option<Vec<AxisId>> {
        let expr = self.program.expr(id);
        let by_name = |checker: &Self, mut axes: Vec<AxisId>| {
            axes.sort_by_key(|axis| checker.program.axis(*axis).name.clone());
            axes
        };
        if !expr.collected.is_empty() && !port.gather.takes_collections() {
            let over = self.program.names(&expr.collected).join(", ");
            let message = format!(
                "this is a collection over {over}, where one {} is expected",
                port.artifact
            );
            self.fault(Diagnostic::new(Code::Kind, span, message, "a collection"));
            return None;
        }
        match port.gather {
            Gather::Pointwise => Some(Vec::new()),
            Gather::Everything => Some(by_name(self, expr.axes.iter().copied().collect())),
            Gather::Collected if expr.collected.is_empty() => {
                let message = format!("expected a collection of {}, found one", port.artifact);
                let fault = Diagnostic::new(Code::Kind, span, message, "not a collection");
                self.fault(fault.help("write `collect(x, over: axis)`"));
                None
            }
            Gather::Collected | Gather::Labelled => {
                Some(by_name(self, expr.collected.iter().copied().collect()))
            }
            Gather::Named => {
                let named = |axis: &AxisId| taken.contains(&self.program.axis(*axis).name.as_str());
                Some(by_name(self, expr.axes.iter().copied().filter(named).collect()))
            }
            Gather::Members => {
                let member = expr
                    .axes
                    .iter()
                    .find(|axis| self.program.axis(**axis).role == AxisRole::Member);
                if let Some(member) = member {
                    return Some(vec![*member]);
                }
                let message = format!("expected an ensemble, found one {}", port.artifact);
                let fault = Diagnostic::new(Code::Kind, span, message, format!("expected {port}"));
                self.fault(
                    fault.help("an ensemble comes from `train(ensemble(.., members: K), ..)`"),
                );
                None
            }
        }
    }

    /// The name under which an axis reaches the operation: its own where labels travel, else its
    /// place among the gathered.
    pub(super) fn travelling(
        &self,
        fed: &[Fed<'_>],
        ports: &[(String, Vec<Feed>)],
        name: &str,
    ) -> String {
        for (feed, (_, feeds)) in fed.iter().zip(ports) {
            if feed.port.gather != Gather::Named {
                continue;
            }
            for feed in feeds {
                if let Some(i) =
                    feed.gathered.iter().position(|axis| self.program.axis(*axis).name == name)
                {
                    return format!("#{i}");
                }
            }
        }
        name.to_owned()
    }

    /// `collect(x, over: axis)`: the value with the axis put together, for ports that take
    /// collections.
    pub(super) fn collect(&mut self, at: &At, args: &'a Written<'a>, span: Span) -> Val {
        let [(None, base), (Some(over), axis)] = args else {
            let fault = Diagnostic::new(
                Code::MissingArgument,
                span,
                "`collect` takes a value and an axis",
                "incomplete",
            );
            return self.fault(fault.help("write `collect(x, over: axis)`"));
        };
        let Some(named) = self.axis_name(at, axis) else {
            let message = "`collect.over` takes the name of an axis";
            return self.fault(Diagnostic::new(
                Code::UnknownAxis,
                axis.span,
                message,
                "not a name",
            ));
        };
        if over.value != "over" {
            let message = format!("`collect` has no argument `{}`", over.value);
            let fault =
                Diagnostic::new(Code::UnknownArgument, over.span, message, "not an argument");
            return self.fault(fault.help("write `collect(x, over: axis)`"));
        }
        let value = self.expr(at, base);
        let Val::Artifact(id) = value else {
            if matches!(value, Val::Poison) {
                return value;
            }
            let message = format!(
                "only what is computed is collected, found {}",
                self.program.describe(&value)
            );
            return self.fault(Diagnostic::new(Code::Kind, base.span, message, "a description"));
        };
        let mut expr = self.program.expr(id).clone();
        let Some(axis) = self.among(expr.axes.iter().copied(), named) else {
            let message = format!("this does not vary over `{}`", named.name);
            self.not_over(at, named, (&expr.axes, &[]), (message, "no such axis"));
            return Val::Poison;
        };
        expr.collected.insert(axis);
        let collected = self.push(expr, span);
        self.shapes.same(collected, id);
        Val::Artifact(collected)
    }
}
