//! Items that were read before, where an edit left them as they were.

use super::scan;
use crate::Span;
use crate::ast::{Ast, AxisExpr, Expr, ExprKind, Item, ItemKind, Name, TyExpr};

/// A text that parsed without a fault, and what another has of it.
///
/// How an item is read depends on its own text and the token behind it, save for those that hold items or may not stand
/// everywhere: these are read anew.
pub(super) struct Again<'a> {
    text: &'a str,
    /// Those of its items, in order.
    items: Vec<&'a Item>,
    /// So many bytes are the same at the beginning of both.
    head: usize,
    /// From here on the other is as this one from `tail_before` on.
    tail: usize,
    tail_before: usize,
}

impl<'a> Again<'a> {
    pub(super) fn new(before: &'a str, ast: &'a Ast, text: &str) -> Self {
        let (old, new) = (before.as_bytes(), text.as_bytes());
        let head = old.iter().zip(new).take_while(|(old, new)| old == new).count();
        let ends = old[head..].iter().rev().zip(new[head..].iter().rev());
        let n_tail = ends.take_while(|(old, new)| old == new).count();
        let mut items = Vec::new();
        leaves(&ast.items, &mut items);
        let (tail, tail_before) = (text.len() - n_tail, before.len() - n_tail);
        Self { text: before, items, head, tail, tail_before }
    }

    /// What would be read where an item begins in the other text, and where it ends there.
    pub(super) fn item(&self, start: usize, file: u32) -> Option<(Item, usize)> {
        let from = if start >= self.tail { start - self.tail + self.tail_before } else { start };
        let at = self.items.binary_search_by_key(&from, |item| item.span.start as usize).ok()?;
        let before = self.items[at];
        let end = before.span.end as usize;
        let beyond = || scan::token_end(self.text, scan::gap(self.text, end).next);
        if start < self.tail && beyond() >= self.head {
            return None;
        }
        let mut item = Item { docs: String::new(), ..before.clone() };
        let move_span = |span: &mut Span| {
            let moved = |at: u32| {
                u32::try_from(at as usize - from + start).expect("a file is no larger than 4 GiB")
            };
            *span = Span { file, start: moved(span.start), end: moved(span.end) };
        };
        Places(move_span).item(&mut item);
        Some((item, end - from + start))
    }
}

fn leaves<'a>(items: &'a [Item], found: &mut Vec<&'a Item>) {
    for item in items {
        match &item.kind {
            ItemKind::Experiment { items, .. } => leaves(items, found),
            ItemKind::Use { .. } | ItemKind::Include { .. } | ItemKind::Junk { .. } => {}
            _ => found.push(item),
        }
    }
}

/// Does something with each span of an item.
struct Places<F>(F);

impl<F: FnMut(&mut Span)> Places<F> {
    fn item(&mut self, item: &mut Item) {
        self.0(&mut item.span);
        match &mut item.kind {
            ItemKind::Param { name, ty, value } => {
                self.0(&mut name.span);
                self.ty(ty);
                self.expr(value);
            }
            ItemKind::Profile { name, base, sets } => {
                self.0(&mut name.span);
                self.names(base);
                for (name, value) in sets {
                    self.0(&mut name.span);
                    self.expr(value);
                }
            }
            ItemKind::Axis { name, fields, values } => {
                self.0(&mut name.span);
                self.names(fields);
                match values {
                    AxisExpr::Range(first, end) => {
                        self.expr(first);
                        self.expr(end);
                    }
                    AxisExpr::Labelled(labels, span) => {
                        self.0(span);
                        for (label, value) in labels {
                            self.0(&mut label.span);
                            self.expr(value);
                        }
                    }
                    AxisExpr::List(list) => self.expr(list),
                }
            }
            ItemKind::Let { name, params, value } => {
                self.0(&mut name.span);
                for param in params.iter_mut().flatten() {
                    self.0(&mut param.name.span);
                    self.ty(&mut param.ty);
                    param.default.iter_mut().for_each(|default| self.expr(default));
                }
                self.expr(value);
            }
            ItemKind::Measure { name, value }
            | ItemKind::Figure { name, value }
            | ItemKind::Table { name, value } => {
                self.0(&mut name.span);
                self.expr(value);
            }
            ItemKind::Claim { name, asked, value, on_par: _, within } => {
                self.0(&mut name.span);
                asked.at.iter_mut().for_each(|at| self.expr(at));
                self.names(&mut asked.by);
                self.names(&mut asked.family);
                self.expr(value);
                if let Some(within) = within {
                    self.expr(&mut within.margin);
                    self.names(&mut within.why);
                }
            }
            ItemKind::Published { name, path } => {
                self.0(&mut name.span);
                self.0(&mut path.span);
            }
            ItemKind::Use { .. }
            | ItemKind::Include { .. }
            | ItemKind::Experiment { .. }
            | ItemKind::Junk { .. } => unreachable!("read anew"),
        }
    }

    fn names<'n>(&mut self, names: impl IntoIterator<Item = &'n mut Name>) {
        names.into_iter().for_each(|name| self.0(&mut name.span));
    }

    fn ty(&mut self, ty: &mut TyExpr) {
        self.0(&mut ty.span);
        self.0(&mut ty.name.span);
        ty.args.iter_mut().for_each(|arg| self.ty(arg));
    }

    fn expr(&mut self, expr: &mut Expr) {
        self.0(&mut expr.span);
        match &mut expr.kind {
            ExprKind::Bool(_)
            | ExprKind::Int(_)
            | ExprKind::Float(_)
            | ExprKind::Str(_)
            | ExprKind::Name(_)
            | ExprKind::Junk => {}
            ExprKind::List(items) => items.iter_mut().for_each(|item| self.expr(item)),
            ExprKind::Record(fields) => self.args(fields),
            ExprKind::Match { axis, arms } => {
                self.expr(axis);
                for (label, value) in arms {
                    self.0(&mut label.span);
                    self.expr(value);
                }
            }
            ExprKind::Call { name, args } => {
                self.0(&mut name.span);
                self.args(args);
            }
            ExprKind::Select { base, at } => {
                self.expr(base);
                for (name, label) in at {
                    self.0(&mut name.span);
                    self.expr(label);
                }
            }
            ExprKind::Range { from, to } => {
                from.iter_mut().chain(to).for_each(|end| self.expr(end));
            }
            ExprKind::Field { base, name } => {
                self.expr(base);
                self.0(&mut name.span);
            }
            ExprKind::Negate(of) => self.expr(of),
            ExprKind::Binary { op, left, right } => {
                self.expr(left);
                self.0(&mut op.span);
                self.expr(right);
            }
        }
    }

    fn args(&mut self, args: &mut [(Option<Name>, Expr)]) {
        for (name, value) in args {
            self.names(name);
            self.expr(value);
        }
    }
}
