//! Expressions: lists, arithmetic.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use ivx_op::{Array, Artifact, ByName, Lit, Ty};

use super::Checker;
use super::maths::items;
use super::value::{Fit, Val, coerce, fit, join, nothing};
use crate::ast::{self, BinaryOp, ExprKind};
use crate::ir::{Desc, Expr, ExprId, Feed};
use crate::{Code, Diagnostic, Span, ir};

/// Where an expression stands.
pub(super) struct At {
    /// The scope that its names belong to.
    pub(super) scope: usize,
    /// The arguments of the `let` function around it.
    pub(super) locals: Rc<BTreeMap<String, Val>>,
    /// What its nodes are called.
    pub(super) address: String,
}

impl At {
    /// In a scope, outside of functions.
    pub(super) fn new(scope: usize, address: String) -> Self {
        Self { scope, locals: Rc::default(), address }
    }

    /// Inside the expression at `self`.
    pub(super) fn inside(&self, name: &str) -> Self {
        Self { scope: self.scope, locals: Rc::clone(&self.locals), address: self.address_of(name) }
    }

    /// What something inside the expression at `self` is called.
    pub(super) fn address_of(&self, name: &str) -> String {
        [&self.address, "/", name].concat()
    }
}

impl<'a> Checker<'a> {
    /// What an expression amounts to.
    pub(super) fn expr(&mut self, at: &At, expr: &'a ast::Expr) -> Val {
        if self.faults.sated() {
            return Val::Poison;
        }
        if !self.enter(expr.span) {
            return Val::Poison;
        }
        let value = self.expr_inside(at, expr);
        self.budget.leave();
        match &value {
            Val::Desc(desc, _) if !self.room(desc.size(), expr.span) => Val::Poison,
            _ => value,
        }
    }

    fn expr_inside(&mut self, at: &At, expr: &'a ast::Expr) -> Val {
        match &expr.kind {
            ExprKind::Bool(b) => Val::lit(Lit::Bool(*b), Ty::Bool),
            ExprKind::Int(n) => Val::lit(Lit::Int(*n), Ty::Int),
            ExprKind::Float(x) => Val::lit(Lit::Real(*x), Ty::Float),
            ExprKind::Str(s) => Val::lit(Lit::Text(s.clone()), Ty::Str),
            ExprKind::List(items) => self.list(at, items, expr.span),
            ExprKind::Name(name) => self.used_name(at, name, expr.span),
            ExprKind::Call { name, args } => self.call(at, name, args, expr.span),
            ExprKind::Select { base, at: selected } => self.select(at, base, selected),
            ExprKind::Range { .. } => unreachable!("the grammar has ranges in selections only"),
            ExprKind::Record(fields) => self.record(at, fields, expr.span),
            ExprKind::Field { base, name } => self.field(at, base, name),
            ExprKind::Match { axis, arms } => self.matching(at, axis, arms, expr.span),
            ExprKind::Negate(inner) => self.negate(at, inner),
            ExprKind::Binary { .. } => self.binary(at, expr),
            ExprKind::Junk => Val::Poison,
        }
    }

    fn list(&mut self, at: &At, items: &'a [ast::Expr], span: Span) -> Val {
        let mut ty = nothing();
        let mut descs = Vec::new();
        for item in items {
            match self.expr(at, item) {
                Val::Desc(desc, found) => {
                    let joined = match &ty {
                        ty if *ty == nothing() => Some(found.clone()),
                        ty => join(ty, &found),
                    };
                    let Some(joined) = joined else {
                        let message = format!(
                            "the items of a list are of one type: {ty} before, {found} here"
                        );
                        return self.fault(Diagnostic::new(
                            Code::Type,
                            item.span,
                            message,
                            format!("expected {ty}"),
                        ));
                    };
                    ty = joined;
                    descs.push((desc, found));
                }
                Val::Artifact(_) => {
                    let message =
                        "this list holds something computed; only ports that take lists do";
                    return self.fault(Diagnostic::new(
                        Code::NotLiteral,
                        item.span,
                        message,
                        "computed",
                    ));
                }
                Val::Poison => return Val::Poison,
            }
        }
        let descs = descs.into_iter().map(|(desc, found)| match fit(&ty, &found) {
            Fit::No => desc,
            fits => coerce(desc, fits, &ty),
        });
        let desc = Desc::List(descs.collect());
        self.bounded(desc, Ty::List(Box::new(ty)), span)
    }

    fn negate(&mut self, at: &At, inner: &'a ast::Expr) -> Val {
        match self.expr(at, inner) {
            Val::Poison => Val::Poison,
            Val::Artifact(id) if self.program.expr(id).artifact == Array::KIND => {
                self.builtin(at, "neg", ByName::new(), vec![("x", id)], inner.span)
            }
            Val::Desc(desc, ty) if is_number(items(&ty)) => {
                let whole = *items(&ty) == Ty::Int;
                let zero = Desc::Lit(if whole { Lit::Int(0) } else { Lit::Real(0.0) });
                self.arithmetic(BinaryOp::Sub, zero, desc, ty, inner.span)
            }
            other => {
                let message = format!("{} has no negative", self.program.describe(&other));
                self.fault(Diagnostic::new(Code::Type, inner.span, message, "expected a number"))
            }
        }
    }

    /// Arithmetic, leftmost first: chains of operators are long, and are not nested.
    fn binary(&mut self, at: &At, expr: &'a ast::Expr) -> Val {
        let mut chain = Vec::new();
        let mut first = expr;
        while let ExprKind::Binary { op, left, right } = &first.kind {
            chain.push((op.value, right));
            first = left;
        }
        let (mut value, mut span) = (self.expr(at, first), first.span);
        for (op, right) in chain.into_iter().rev() {
            let other = self.expr(at, right);
            value = self.combine(at, op, (value, span), (other, right.span));
            span = span.to(right.span);
        }
        value
    }

    fn combine(&mut self, at: &At, op: BinaryOp, left: (Val, Span), right: (Val, Span)) -> Val {
        let ((a, a_span), (b, b_span)) = (left, right);
        if let (Val::Desc(a, a_ty), Val::Desc(b, b_ty)) = (&a, &b) {
            let (numbers, span) = (is_number(a_ty) && is_number(b_ty), a_span.to(b_span));
            let alike = matches!(op, BinaryOp::Equal | BinaryOp::Unequal)
                && (fit(a_ty, b_ty) != Fit::No || fit(b_ty, a_ty) != Fit::No)
                && !a.holds()
                && !b.holds();
            if op.compares() && (numbers || alike) {
                let ty = join(a_ty, b_ty).unwrap_or(Ty::Float);
                let [a, b] = [(a, a_ty), (b, b_ty)]
                    .map(|(side, own)| coerce(side.clone(), fit(&ty, own), &ty));
                return self.arithmetic(op, a, b, Ty::Bool, span);
            }
            if !numbers && op.compares() && !is_number(a_ty) && !is_number(b_ty)
                || !numbers && matches!(op, BinaryOp::Equal | BinaryOp::Unequal)
            {
                let symbol = op.symbol();
                let message = format!("`{symbol}` is not defined for {a_ty} and {b_ty}");
                return self.fault(Diagnostic::new(Code::Type, span, message, "do not combine"));
            }
            let ty = super::maths::arithmetic_type(a_ty, b_ty, op != BinaryOp::Div);
            let Some(ty) = ty.filter(|_| !op.compares()) else {
                let (odd, span) = if is_number(a_ty) { (b_ty, b_span) } else { (a_ty, a_span) };
                let message = format!("expected a number or an array, found {odd}");
                let fault = Diagnostic::new(Code::Type, span, message, "not a number");
                let help = match odd {
                    Ty::Bool => {
                        Some("`where(condition, 1.0, 0.0)` makes a number of it".to_owned())
                    }
                    Ty::List(_) if op.compares() => Some(
                        "numbers are compared; for each of several declare an axis, `axis a = [..]`, and write `a`"
                            .to_owned(),
                    ),
                    Ty::Function(_) => Some("a function is called: `f(...)`".to_owned()),
                    _ => None,
                };
                return self.fault(fault.maybe_help(help));
            };
            return self.arithmetic(op, a.clone(), b.clone(), ty, a_span.to(b_span));
        }
        if self.needs_given(&[(&a, a_span), (&b, b_span)]) {
            return Val::Poison;
        }
        let name = match op {
            BinaryOp::Add => "add",
            BinaryOp::Sub => "sub",
            BinaryOp::Mul => "mul",
            BinaryOp::Div => "div",
            BinaryOp::Less => "less",
            BinaryOp::AtMost => "at_most",
            BinaryOp::Greater => "greater",
            BinaryOp::AtLeast => "at_least",
            BinaryOp::Equal => "equal",
            BinaryOp::Unequal => "unequal",
        };
        let mut ports = Vec::new();
        for (port, value, span) in [("left", a, a_span), ("right", b, b_span)] {
            match self.array(at, value, span) {
                Some(id) => ports.push((port, id)),
                None => return Val::Poison,
            }
        }
        self.builtin(at, name, ByName::new(), ports, a_span.to(b_span))
    }

    fn arithmetic(&mut self, op: BinaryOp, a: Desc, b: Desc, ty: Ty, span: Span) -> Val {
        let constant = matches!((&a, &b), (Desc::Lit(_), Desc::Lit(_)));
        let desc = Desc::Binary(op, Box::new(a), Box::new(b));
        if constant {
            self.evaluate(&desc, span).map_or(Val::Poison, |lit| Val::lit(lit, ty))
        } else {
            Val::Desc(desc, ty)
        }
    }

    /// The expression where an array is expected; a number becomes a scalar.
    pub(super) fn array(&mut self, at: &At, value: Val, span: Span) -> Option<ExprId> {
        match value {
            Val::Poison => None,
            Val::Artifact(id) if self.program.expr(id).artifact == Array::KIND => Some(id),
            Val::Desc(desc, ty)
                if is_number(&ty)
                    && !(self.distinct(&desc.axes(), span)
                        && self.evaluates(&desc, span)
                        && self.is_exact(&desc, span)) =>
            {
                None
            }
            Val::Desc(desc, ty) if is_number(&ty) => Some(self.push(
                Expr {
                    address: at.address.clone(),
                    axes: desc.axes(),
                    collected: BTreeSet::new(),
                    artifact: Array::KIND.to_owned(),
                    dims: Vec::new(),
                    kind: ir::ExprKind::Number(desc),
                },
                span,
            )),
            other => {
                let message = format!(
                    "expected a number or an array, found {}",
                    self.program.describe(&other)
                );
                self.fault(Diagnostic::new(Code::Type, span, message, "not a number"));
                None
            }
        }
    }

    /// A call of an operation that the language itself needs; its ports are pointwise arrays.
    pub(super) fn builtin(
        &mut self,
        at: &At,
        name: &str,
        args: ByName<Desc>,
        ports: Vec<(&str, ExprId)>,
        span: Span,
    ) -> Val {
        let mut axes: BTreeSet<_> = args.values().flat_map(Desc::axes).collect();
        let mut dims: Vec<String> = Vec::new();
        for (_, id) in &ports {
            let expr = self.program.expr(*id);
            axes.extend(&expr.axes);
            dims.extend(
                expr.dims.iter().filter(|dim| !dims.contains(dim)).cloned().collect::<Vec<_>>(),
            );
        }
        if !self.distinct(&axes, span) || !self.apart(&axes, &dims, span) {
            return Val::Poison;
        }
        let inputs: Vec<ExprId> = ports.iter().map(|(_, id)| *id).collect();
        let alike = inputs.windows(2).all(|pair| {
            dims.iter().all(|dim| self.same_labels(dim, (pair[0], span), (pair[1], span)))
        });
        if !alike {
            return Val::Poison;
        }
        let ports =
            ports.into_iter().map(|(port, id)| (port.to_owned(), vec![Feed::one(id)])).collect();
        let op = ir::Op { name: name.to_owned(), args, ports, stochastic: false };
        let id = self.push(
            Expr {
                address: at.address_of(name),
                axes,
                collected: BTreeSet::new(),
                artifact: Array::KIND.to_owned(),
                dims,
                kind: ir::ExprKind::Op(op),
            },
            span,
        );
        self.inherit_labels(id, inputs);
        Val::Artifact(id)
    }

    /// Adds an expression to the program.
    pub(super) fn push(&mut self, expr: Expr, span: Span) -> ExprId {
        let extent = self.program.extent(&expr.axes);
        let is_node = matches!(expr.kind, ir::ExprKind::Op(_) | ir::ExprKind::Number(_));
        if !self.budget.add(extent, is_node) {
            let sizes = expr.axes.iter().map(|axis| {
                let axis = self.program.axis(*axis);
                format!("{} {}", axis.coords.len(), axis.name)
            });
            let sizes: Vec<_> = sizes.collect();
            let each = match &sizes[..] {
                [] => String::new(),
                sizes => format!(", with this one for each of {}", sizes.join(" × ")),
            };
            self.too_many(
                format!("the program has more than {} nodes{each}", self.budget.max_nodes()),
                span,
            );
        }
        let id = self.program.push(expr, span);
        self.pass_shapes(id);
        id
    }
}

/// Whether a type is that of numbers.
pub(super) fn is_number(ty: &Ty) -> bool {
    matches!(ty, Ty::Int | Ty::Float)
}
