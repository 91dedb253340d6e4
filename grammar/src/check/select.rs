//! Selection: `x[ke: "WCM"]`, along axes and along dimensions.

use std::collections::BTreeSet;

use ivx_op::{Array, Artifact, ByName, Lit, Ty};

use super::Checker;
use super::expr::At;
use super::meant::{Meant, labels_help, text};
use super::range::{Ends, Selected};
use super::value::{Val, fold};
use crate::ast::{self, Name};
use crate::ir::{AxisId, Desc, ExprId, ExprKind, Feed};
use crate::{Code, Diagnostic, Span};

impl<'a> Checker<'a> {
    /// What a selection amounts to.
    pub(super) fn select(
        &mut self,
        at: &At,
        base: &'a ast::Expr,
        selected: &'a [(Name, ast::Expr)],
    ) -> Val {
        let mut value = self.expr(at, base);
        for (name, label) in selected {
            value = self.select_one(at, value, name, label);
        }
        value
    }

    fn select_one(&mut self, at: &At, value: Val, name: &'a Name, label: &'a ast::Expr) -> Val {
        let (axes, dims) = match &value {
            Val::Poison => return Val::Poison,
            Val::Desc(desc, _) => (desc.axes(), Vec::new()),
            Val::Artifact(id) => {
                (self.program.expr(*id).axes.clone(), self.program.expr(*id).dims.clone())
            }
        };
        let Some(labels) = self.selected(at, label) else { return Val::Poison };
        if !self.distinct(&axes, name.span) {
            return Val::Poison;
        }
        if name.value.is_empty() {
            return self.unnamed((&axes, &dims), &labels, label.span);
        }
        let named = self.named(at, &name.value, name.span);
        if let Some(axis) = self.among(axes.iter().copied(), named) {
            return match labels {
                Selected::These(labels) => self.select_axis(value, axis, &labels, label.span),
                Selected::Between(ends) => self.restrict_to(value, axis, ends, label.span),
            };
        }
        if let (Val::Artifact(id), true) = (&value, dims.iter().any(|dim| dim == named.name)) {
            return match labels {
                Selected::These(labels) => {
                    self.select_dim(at, *id, named.name, &labels, label.span)
                }
                Selected::Between(ends) => self.select_range(at, *id, named.name, ends, label.span),
            };
        }
        let message = format!("this does not vary over `{}`", name.value);
        let fault = (message, "no such axis or dimension");
        self.not_over(at, named, (&axes, &dims), fault);
        Val::Poison
    }

    /// A fault: a selection does not say along which axis.
    fn unnamed(
        &mut self,
        (axes, dims): (&BTreeSet<AxisId>, &[String]),
        selected: &Selected,
        span: Span,
    ) -> Val {
        let label = match selected {
            Selected::These(label) => label.clone(),
            Selected::Between(Ends { from, to }) => Lit::Real(from.or(*to).unwrap_or_default()),
        };
        let label = &label;
        let known: Vec<String> =
            self.program.names(axes).into_iter().chain(dims.iter().cloned()).collect();
        let all: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
        let has = |axis: &&AxisId| {
            let coords = &self.program.axis(**axis).coords;
            Meant::by(std::slice::from_ref(label), coords).place(label).is_some()
        };
        let written = match axes.iter().find(has).or_else(|| axes.iter().next()) {
            Some(axis) => {
                let axis = self.program.axis(*axis);
                let own = Meant::by(std::slice::from_ref(label), &axis.coords).place(label);
                let coord = own.or(Some(0)).and_then(|place| axis.coords.get(place));
                let coord = coord.map_or_else(String::new, |coord| match &coord.value {
                    number @ (Lit::Int(_) | Lit::Real(_)) => number.to_string(),
                    _ => format!("{:?}", coord.label),
                });
                format!("{}: {coord}", axis.name)
            }
            None => format!("{}: {label}", dims.first().map_or("axis", String::as_str)),
        };
        let help = if known.is_empty() {
            "this varies over nothing, so that there is nothing to select".to_owned()
        } else {
            format!("this varies over {}: write `[{written}]`", all.join(", "))
        };
        let message = "a selection names the axis that it goes along";
        let fault = Diagnostic::new(Code::UnknownAxis, span, message, "along which axis?");
        self.fault(fault.help(help))
    }

    fn select_axis(&mut self, value: Val, axis: AxisId, label: &Lit, span: Span) -> Val {
        let labels = if let Lit::List(labels) = label {
            labels.as_slice()
        } else {
            std::slice::from_ref(label)
        };
        if labels.is_empty() {
            return self.fault(Diagnostic::new(
                Code::UnknownLabel,
                span,
                "no label is selected",
                "an empty list",
            ));
        }
        let one = !matches!(label, Lit::List(_));
        if self.axes.are_any(axis) {
            // Each label may be one of the seeds, and several of them are again any.
            return if one { self.pick(value, axis, 0, span) } else { value };
        }
        let (mut places, mut seen) = (Vec::new(), BTreeSet::new());
        let meant = Meant::by(labels, &self.program.axis(axis).coords);
        for label in labels {
            let coords = &self.program.axis(axis).coords;
            let found = meant.place(label);
            if let Some((first, other)) = found.and_then(|i| Some((i, meant.ambiguous(label, i)?)))
            {
                let [first, other] = [first, other].map(|i| &coords[i].label);
                let message = format!("`{label}` may mean {first:?} and {other:?}");
                let fault =
                    Diagnostic::new(Code::UnknownLabel, span, message, "a label or a value");
                let help = format!("write the label in quotes: `{first:?}` or `{other:?}`");
                return self.fault(fault.help(help));
            }
            let Some(place) = found else {
                let help = labels_help(label, coords);
                let message =
                    format!("axis `{}` has no label {label}", self.program.axis(axis).name);
                let fault = Diagnostic::new(Code::UnknownLabel, span, message, "no such label");
                return self.fault(fault.maybe_help(help));
            };
            if !seen.insert(place) {
                let message = format!("label {label} is selected twice");
                return self.fault(Diagnostic::new(Code::TwiceGiven, span, message, "given again"));
            }
            places.push(place);
        }
        if one {
            return self.pick(value, axis, places[0], span);
        }
        self.restrict(value, axis, places, span)
    }

    /// One coordinate of an axis.
    fn pick(&mut self, value: Val, axis: AxisId, place: usize, span: Span) -> Val {
        match value {
            Val::Desc(desc, ty) => Val::Desc(fold(self.pick_desc(&desc, axis, place, span)), ty),
            Val::Artifact(base) => Val::Artifact(self.pick_expr(base, axis, place, span)),
            Val::Poison => Val::Poison,
        }
    }

    fn pick_expr(&mut self, base: ExprId, axis: AxisId, place: usize, span: Span) -> ExprId {
        let mut expr = self.program.expr(base).clone();
        expr.axes.remove(&axis);
        expr.collected.remove(&axis);
        expr.kind = ExprKind::Pick { base, axis, place };
        let id = self.push(expr, span);
        self.inherit_labels(id, [base]);
        id
    }

    fn pick_desc(&mut self, desc: &Desc, axis: AxisId, place: usize, span: Span) -> Desc {
        desc.change(&mut |desc| match desc {
            Desc::Axis(own) if *own == axis => {
                Some(Desc::Lit(self.program.axis(axis).coords[place].value.clone()))
            }
            Desc::Match(own, arms) if *own == axis => {
                Some(self.pick_desc(&arms[place], axis, place, span))
            }
            Desc::Held(slot, axes) if axes.contains(&axis) => {
                let feed = self.program.held(*slot).clone();
                let picked = self.pick_expr(feed.expr, axis, place, span);
                let axes = axes.iter().copied().filter(|own| *own != axis).collect();
                Some(self.program.hold(Feed { expr: picked, ..feed }, axes))
            }
            _ => None,
        })
    }

    /// Some coordinates of an axis.
    pub(super) fn restrict(
        &mut self,
        value: Val,
        axis: AxisId,
        places: Vec<usize>,
        span: Span,
    ) -> Val {
        let kept = Kept {
            axis,
            restricted: self.axes.restricted(&mut self.program, axis, &places),
            places,
        };
        match value {
            Val::Desc(desc, ty) => Val::Desc(self.restrict_desc(&desc, &kept, span), ty),
            Val::Artifact(base) => Val::Artifact(self.restrict_expr(base, &kept, span)),
            Val::Poison => Val::Poison,
        }
    }

    fn restrict_expr(&mut self, base: ExprId, kept: &Kept, span: Span) -> ExprId {
        let Kept { axis, restricted, places } = kept.clone();
        let mut expr = self.program.expr(base).clone();
        expr.axes.remove(&axis);
        expr.axes.insert(restricted);
        if expr.collected.remove(&axis) {
            expr.collected.insert(restricted);
        }
        expr.kind = ExprKind::Restrict { base, axis, restricted, places };
        let id = self.push(expr, span);
        self.inherit_labels(id, [base]);
        id
    }

    fn restrict_desc(&mut self, desc: &Desc, kept: &Kept, span: Span) -> Desc {
        let Kept { axis, restricted, places } = kept;
        desc.change(&mut |desc| match desc {
            Desc::Axis(own) if own == axis => Some(Desc::Axis(*restricted)),
            Desc::Match(own, arms) if own == axis => {
                // Inside an arm the axis has one value.
                let arms = places.iter().map(|&i| self.pick_desc(&arms[i], *axis, i, span));
                Some(Desc::Match(*restricted, arms.collect()))
            }
            Desc::Held(slot, axes) if axes.contains(axis) => {
                let feed = self.program.held(*slot).clone();
                let expr = self.restrict_expr(feed.expr, kept, span);
                let axes = axes.iter().map(|own| if own == axis { *restricted } else { *own });
                let axes = axes.collect();
                Some(self.program.hold(Feed { expr, ..feed }, axes))
            }
            _ => None,
        })
    }

    /// Coordinates of a dimension inside the value; which there are is known when it is computed.
    pub(super) fn select_dim(
        &mut self,
        at: &At,
        id: ExprId,
        dim: &str,
        label: &Lit,
        span: Span,
    ) -> Val {
        if self.program.expr(id).artifact != Array::KIND {
            let message = format!("`{dim}` lies inside a {}", self.program.expr(id).artifact);
            return self.fault(Diagnostic::new(Code::Kind, span, message, "cannot be selected"));
        }
        let one = !matches!(label, Lit::List(_));
        let labels =
            if let Lit::List(labels) = label { labels.clone() } else { vec![label.clone()] };
        let number = |lit: Lit| match lit.as_f64() {
            Some(x) => Lit::Text(x.to_string()),
            None => lit,
        };
        let labels: Vec<Lit> = labels.into_iter().map(number).collect();
        let mut seen = BTreeSet::new();
        if let Some(again) = labels.iter().find(|label| !seen.insert(text(label))) {
            let message = format!("label {again} is selected twice");
            return self.fault(Diagnostic::new(Code::TwiceGiven, span, message, "given again"));
        }
        let args = ByName::from([
            ("dim".to_owned(), Desc::Lit(dim.into())),
            ("at".to_owned(), Desc::Lit(Lit::List(labels.clone()))),
            ("keep".to_owned(), Desc::Lit(Lit::Bool(!one))),
        ]);
        let selected = self.builtin(at, "select", args, vec![("x", id)], span);
        if let Val::Artifact(selected) = selected {
            if !self.known_labels((id, selected), dim, &labels, span) {
                return Val::Poison;
            }
            if one {
                let mut dims = self.program.expr(selected).dims.clone();
                dims.retain(|own| own != dim);
                self.program.set_dims(selected, dims);
                self.labels.forget(selected, dim);
            }
        }
        selected
    }

    pub(super) fn known_before_at(&mut self, at: &At, expr: &'a ast::Expr) -> Val {
        match self.expr(at, expr) {
            Val::Desc(desc, ty) if desc.axes().is_empty() && !desc.holds() => {
                let scalar = |ty: &Ty| matches!(ty, Ty::Int | Ty::Float | Ty::Str | Ty::Bool);
                let fits = scalar(&ty)
                    || matches!(&ty, Ty::List(item) if scalar(item) || **item == super::value::nothing());
                if !fits {
                    let message = format!("a label is a string or a number, found {ty}");
                    return self.fault(Diagnostic::new(
                        Code::Type,
                        expr.span,
                        message,
                        "not a label",
                    ));
                }
                self.evaluate(&desc, expr.span).map_or(Val::Poison, |lit| Val::lit(lit, ty))
            }
            Val::Poison => Val::Poison,
            _ => {
                let message = "a label must be known before anything runs";
                self.fault(Diagnostic::new(
                    Code::NotLiteral,
                    expr.span,
                    message,
                    "varies or is computed",
                ))
            }
        }
    }
}

/// Some coordinates of an axis, which make one of their own.
#[derive(Clone)]
struct Kept {
    axis: AxisId,
    restricted: AxisId,
    /// Their places along `axis`, in the order of `restricted`.
    places: Vec<usize>,
}
