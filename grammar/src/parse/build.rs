//! pest's pairs to the syntax tree.

use ivx_op::Lit;

use super::parts::{Pair, Parts, end};
use super::{Rule, span};
use crate::ast::{AxisExpr, BinaryOp, Expr, ExprKind, ItemKind, LetParam, Name, TyExpr};
use crate::{Code, Diagnostic, Span, Spanned, literal};

/// The deepest expression: later stages recurse over it.
const DEEPEST: usize = 1000;

/// What was parsed.
pub(super) enum Built {
    Edition(Spanned<String>),
    Item(ItemKind),
}

/// Builds one item.
pub(super) struct Build<'d> {
    file: u32,
    /// Where the text given to pest begins in the file.
    base: usize,
    diagnostics: &'d mut Vec<Diagnostic>,
}

impl<'d> Build<'d> {
    pub(super) fn new(file: u32, base: usize, diagnostics: &'d mut Vec<Diagnostic>) -> Self {
        Self { file, base, diagnostics }
    }

    /// The item of a rule in `item`, save `experiment`.
    pub(super) fn item(&mut self, pair: Pair<'_>) -> Built {
        let rule = pair.as_rule();
        let mut parts = Parts::of(pair);
        Built::Item(match rule {
            Rule::edition => return Built::Edition(self.string(&parts.part())),
            Rule::include => ItemKind::Include { path: self.string(&parts.part()) },
            Rule::uses => {
                let path = self.string(&parts.part());
                let names: Vec<_> = parts.map(|taken| self.taken(taken)).collect();
                ItemKind::Use { path, names: (!names.is_empty()).then_some(names) }
            }
            Rule::profile => {
                let name = self.name(&parts.part());
                let (mut base, mut sets) = (None, Vec::new());
                for part in parts {
                    match part.as_rule() {
                        Rule::name => base = Some(self.name(&part)),
                        _ => sets.push(self.named_value(part, 0)),
                    }
                }
                ItemKind::Profile { name, base, sets }
            }
            Rule::published => {
                let name = self.name(&parts.part());
                ItemKind::Published { name, path: self.string(&parts.part()) }
            }
            Rule::axis => {
                let (name, fields) = self.axis_head(parts.part());
                ItemKind::Axis { name, fields, values: self.axis_values(parts.part()) }
            }
            Rule::valued => {
                let head = parts.part();
                let value = self.expr(parts.part(), 0);
                let (value, on_par, within) = self.claimed(value, &mut parts);
                let mut kind = self.declared(head, value);
                if let ItemKind::Claim { on_par: is_on_par, within: margin, .. } = &mut kind {
                    (*is_on_par, *margin) = (on_par, within);
                }
                kind
            }
            other => unreachable!("{other:?} is not an item"),
        })
    }

    /// The item that `head` begins, with junk for a value up to the end of `item`.
    pub(super) fn begun(&mut self, head: Pair<'_>, item: Span) -> ItemKind {
        let start = self.span(&head).end.min(item.end);
        self.declared(head, Expr { kind: ExprKind::Junk, span: Span { start, ..item } })
    }

    /// The name that is the only meaningful part of `pair`.
    pub(super) fn only_name(&mut self, pair: Pair<'_>) -> Name {
        self.name(&Parts::of(pair).part())
    }

    fn declared(&mut self, head: Pair<'_>, value: Expr) -> ItemKind {
        let rule = head.as_rule();
        let mut parts = Parts::of(head);
        match rule {
            Rule::param_head => {
                let name = self.name(&parts.part());
                ItemKind::Param { name, ty: self.ty(parts.part()), value }
            }
            Rule::axis_head => {
                let name = self.name(&parts.part());
                let fields = parts.next().map(|fields| self.fields(fields)).unwrap_or_default();
                ItemKind::Axis { name, fields, values: AxisExpr::List(value) }
            }
            Rule::let_head => {
                let name = self.name(&parts.part());
                let params = parts
                    .next()
                    .map(|params| Parts::of(params).map(|param| self.let_param(param)).collect());
                ItemKind::Let { name, params, value }
            }
            Rule::measure_head => ItemKind::Measure { name: self.name(&parts.part()), value },
            Rule::figure_head => ItemKind::Figure { name: self.string(&parts.part()), value },
            Rule::table_head => ItemKind::Table { name: self.string(&parts.part()), value },
            Rule::claim_head => {
                let name = self.string(&parts.part());
                let asked = Box::new(self.asked(parts));
                ItemKind::Claim { name, asked, value, on_par: false, within: None }
            }
            other => unreachable!("{other:?} does not begin an item"),
        }
    }

    fn taken(&mut self, pair: Pair<'_>) -> (Name, Name) {
        let mut parts = Parts::of(pair);
        let theirs = self.name(&parts.part());
        let ours = parts.next().map_or_else(|| theirs.clone(), |ours| self.name(&ours));
        (theirs, ours)
    }

    fn axis_head(&mut self, pair: Pair<'_>) -> (Name, Vec<Name>) {
        let mut parts = Parts::of(pair);
        let name = self.name(&parts.part());
        (name, parts.next().map(|fields| self.fields(fields)).unwrap_or_default())
    }

    fn fields(&mut self, pair: Pair<'_>) -> Vec<Name> {
        Parts::of(pair).map(|name| self.name(&name)).collect()
    }

    fn axis_values(&mut self, pair: Pair<'_>) -> AxisExpr {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let first = parts.part();
        if first.as_rule() == Rule::labelled {
            let labels = Parts::of(first).map(|label| {
                let mut parts = Parts::of(label);
                (self.string(&parts.part()), self.expr(parts.part(), 0))
            });
            return AxisExpr::Labelled(labels.collect(), span);
        }
        let start = self.expr(first, 0);
        match parts.next() {
            Some(end) => AxisExpr::Range(start, self.expr(end, 0)),
            None => AxisExpr::List(start),
        }
    }

    fn let_param(&mut self, pair: Pair<'_>) -> LetParam {
        let mut parts = Parts::of(pair);
        let name = self.name(&parts.part());
        let ty = self.ty(parts.part());
        LetParam { name, ty, default: parts.next().map(|default| self.expr(default, 0)) }
    }

    fn ty(&mut self, pair: Pair<'_>) -> TyExpr {
        let span = self.span(&pair);
        let mut parts = Parts::of(pair);
        let name = self.name(&parts.part());
        TyExpr { name, args: parts.map(|arg| self.ty(arg)).collect(), span }
    }

    /// - `depth`: how many expressions lie around this one.
    pub(super) fn expr(&mut self, pair: Pair<'_>, depth: usize) -> Expr {
        let (whole, mut parts) = (pair.clone(), Parts::of(pair));
        let n = parts.n_left();
        // A chain of operators leans to the left, so that it is as deep as it is long.
        let depth = depth + n / 2 + 1;
        if depth > DEEPEST {
            return self.too_deep(self.span(&whole));
        }
        let first = self.term(parts.part(), depth);
        if n == 1 {
            return first;
        }
        let (mut operands, mut ops) = (vec![first], Vec::<Spanned<BinaryOp>>::new());
        for part in parts {
            if part.as_rule() == Rule::term {
                operands.push(self.term(part, depth));
                continue;
            }
            let op = Spanned { value: binary_op(part.as_str()), span: self.token(&part) };
            while ops.last().is_some_and(|last| binds(last.value) >= binds(op.value)) {
                reduce(&mut operands, &mut ops);
            }
            ops.push(op);
        }
        while !ops.is_empty() {
            reduce(&mut operands, &mut ops);
        }
        operands.pop().expect("an expression has a term")
    }

    fn term(&mut self, pair: Pair<'_>, depth: usize) -> Expr {
        let (whole, mut parts) = (pair.clone(), Parts::of(pair));
        let depth = depth + parts.n_left();
        if depth > DEEPEST {
            return self.too_deep(self.span(&whole));
        }
        let mut minuses = Vec::new();
        let mut primary = parts.part();
        while primary.as_rule() == Rule::minus {
            minuses.push(self.token(&primary));
            primary = parts.part();
        }
        let mut expr = if primary.as_rule() == Rule::number {
            self.number(&primary, minuses.pop())
        } else {
            self.primary(primary, depth)
        };
        for postfix in parts {
            expr = self.postfix(expr, postfix, depth);
        }
        for minus in minuses.into_iter().rev() {
            let span = minus.to(expr.span);
            expr = Expr { kind: ExprKind::Negate(Box::new(expr)), span };
        }
        expr
    }

    /// `.name` or `[axis: label]` behind `base`.
    fn postfix(&mut self, base: Expr, pair: Pair<'_>, depth: usize) -> Expr {
        let (span, rule) = (base.span, pair.as_rule());
        let (base, mut parts) = (Box::new(base), Parts::of(pair));
        if rule == Rule::field {
            let name = self.name(&parts.part());
            return Expr { span: span.to(name.span), kind: ExprKind::Field { base, name } };
        }
        let at = self.each(&mut parts, |build, at| build.selected(at, depth));
        let span = Span { end: self.place(parts.closed), ..span };
        Expr { kind: ExprKind::Select { base, at }, span }
    }

    /// The axis and the labels of a selection; an empty name, reported by the checker, if it has none.
    fn selected(&mut self, pair: Pair<'_>, depth: usize) -> (Name, Expr) {
        let mut parts = Parts::of(pair).peekable();
        let name = parts.next_if(|part| part.as_rule() == Rule::name).map(|name| self.name(&name));
        let from = parts.next_if(|part| part.as_rule() == Rule::expr);
        let from = from.map(|from| self.expr(from, depth));
        let label = match (parts.next(), from) {
            (Some(dots), from) => {
                let dots = self.token(&dots);
                let to = parts.next().map(|to| self.expr(to, depth));
                let start = from.as_ref().map_or(dots, |from| from.span);
                let span = start.to(to.as_ref().map_or(dots, |to| to.span));
                let (from, to) = (from.map(Box::new), to.map(Box::new));
                Expr { kind: ExprKind::Range { from, to }, span }
            }
            (None, from) => from.expect("the grammar has a label here"),
        };
        let name = name.unwrap_or(Name { value: String::new(), span: label.span });
        (name, label)
    }

    /// A literal number, with the minus before it.
    pub(super) fn number(&mut self, pair: &Pair<'_>, minus: Option<Span>) -> Expr {
        let (mut span, written) = (self.token(pair), pair.as_str());
        if let Some(minus) = minus {
            span = minus.to(span);
        }
        let kind = match literal::number(written, minus.is_some()) {
            Ok(Lit::Int(n)) => ExprKind::Int(n),
            Ok(Lit::Real(x)) => ExprKind::Float(x),
            Ok(other) => unreachable!("{other} is no number"),
            Err((message, help)) => {
                let label = if message.ends_with("large") { "too large" } else { "no such number" };
                self.diagnostics
                    .push(Diagnostic::new(Code::Number, span, message, label).help(help));
                ExprKind::Junk
            }
        };
        Expr { kind, span }
    }

    fn primary(&mut self, pair: Pair<'_>, depth: usize) -> Expr {
        let token = self.token(&pair);
        let (kind, end) = match pair.as_rule() {
            Rule::bool => (ExprKind::Bool(pair.as_str() == "true"), token.end),
            Rule::string => (ExprKind::Str(self.string(&pair).value), token.end),
            Rule::list => {
                let mut parts = Parts::of(pair);
                let items = self.each(&mut parts, |build, item| build.expr(item, depth));
                (ExprKind::List(items), self.place(parts.closed))
            }
            Rule::parens => {
                let mut parts = Parts::of(pair);
                let mut fields: Vec<_> =
                    parts.by_ref().map(|field| self.arg(field, depth)).collect();
                let end = self.place(parts.closed);
                if let [(None, _)] = &fields[..] {
                    let (_, inner) = fields.pop().expect("there is one");
                    return Expr { span: Span { end, ..token }, ..inner };
                }
                (ExprKind::Record(fields), end)
            }
            Rule::matching => self.matching(pair, depth),
            Rule::named => {
                let mut parts = Parts::of(pair);
                let name = self.name(&parts.part());
                let args = self.each(&mut parts, |build, arg| build.arg(arg, depth));
                if parts.closed == 0 {
                    return Expr { span: name.span, kind: ExprKind::Name(name.value) };
                }
                (ExprKind::Call { name, args }, self.place(parts.closed))
            }
            other => unreachable!("{other:?} is not a primary expression"),
        };
        Expr { kind, span: Span { end, ..token } }
    }

    /// A match, and where it ends.
    fn matching(&mut self, pair: Pair<'_>, depth: usize) -> (ExprKind, u32) {
        let mut parts = Parts::of(pair);
        let name = parts.part();
        let span = self.span(&name);
        let mut names = Parts::of(name);
        let mut axis = Expr { kind: ExprKind::Name(names.part().as_str().to_owned()), span };
        for field in names {
            let name = self.name(&Parts::of(field).part());
            axis = Expr { kind: ExprKind::Field { base: Box::new(axis), name }, span };
        }
        let arms = parts.by_ref().map(|arm| {
            let mut parts = Parts::of(arm);
            let label = parts.part();
            let label = if label.as_rule() == Rule::string {
                self.string(&label)
            } else {
                let (number, minus) = if label.as_rule() == Rule::minus {
                    (parts.part(), Some(self.token(&label)))
                } else {
                    (label, None)
                };
                let number = self.number(&number, minus);
                let value = match number.kind {
                    ExprKind::Int(n) => n.to_string(),
                    ExprKind::Float(x) => format!("{x:?}"),
                    _ => String::new(),
                };
                Spanned { value, span: number.span }
            };
            (label, self.expr(parts.part(), depth))
        });
        let arms = arms.collect();
        (ExprKind::Match { axis: Box::new(axis), arms }, self.place(parts.closed))
    }

    /// What `read` makes of each of the parts that are left.
    fn each<T>(
        &mut self,
        parts: &mut Parts<'_>,
        read: impl Fn(&mut Self, Pair<'_>) -> T,
    ) -> Vec<T> {
        // Behind each stands a comma or the bracket that closes.
        let mut all = Vec::with_capacity(parts.n_pairs() / 2);
        all.extend(parts.map(|part| read(self, part)));
        all
    }

    fn arg(&mut self, pair: Pair<'_>, depth: usize) -> (Option<Name>, Expr) {
        let mut parts = Parts::of(pair);
        let first = parts.part();
        if first.as_rule() == Rule::name {
            (Some(self.name(&first)), self.expr(parts.part(), depth))
        } else {
            (None, self.expr(first, depth))
        }
    }

    /// `name: value` or `name = value`.
    fn named_value(&mut self, pair: Pair<'_>, depth: usize) -> (Name, Expr) {
        let mut parts = Parts::of(pair);
        (self.name(&parts.part()), self.expr(parts.part(), depth))
    }

    pub(super) fn name(&self, pair: &Pair<'_>) -> Name {
        Name { value: pair.as_str().to_owned(), span: self.token(pair) }
    }

    pub(super) fn string(&self, pair: &Pair<'_>) -> Spanned<String> {
        let quoted = pair.as_str();
        let inner = &quoted[1..quoted.len() - 1];
        let value = if inner.contains('\\') { unescaped(inner) } else { inner.to_owned() };
        Spanned { value, span: self.token(pair) }
    }

    fn too_deep(&mut self, span: Span) -> Expr {
        let message = format!("an expression is deeper than {DEEPEST} operators and brackets");
        let fault = Diagnostic::new(Code::Syntax, span, message, "too deep")
            .help("give its parts names with `let`");
        self.diagnostics.push(fault);
        Expr { kind: ExprKind::Junk, span }
    }

    /// From the first token of a pair to its last.
    pub(super) fn span(&self, pair: &Pair<'_>) -> Span {
        span(self.file, self.base + pair.as_span().start(), self.base + end(pair))
    }

    /// Where a pair stands that is one token, or begins with one: the gap behind its last is in it.
    fn token(&self, pair: &Pair<'_>) -> Span {
        let place = pair.as_span();
        span(self.file, self.base + place.start(), self.base + place.end())
    }

    /// A place in the file.
    fn place(&self, place: usize) -> u32 {
        span(self.file, self.base, self.base + place).end
    }
}

/// What stands between the quotes of a string, read.
fn unescaped(inner: &str) -> String {
    let mut value = String::with_capacity(inner.len());
    let mut chars = inner.chars();
    while let Some(c) = chars.next() {
        value.push(match (c, if c == '\\' { chars.next() } else { None }) {
            (_, Some('n')) => '\n',
            (_, Some('t')) => '\t',
            (_, Some(escaped)) => escaped,
            (plain, None) => plain,
        });
    }
    value
}

/// Joins the last two operands with the last operator.
fn reduce(operands: &mut Vec<Expr>, ops: &mut Vec<Spanned<BinaryOp>>) {
    let message = "between two operands stands an operator";
    let (right, left) = (operands.pop().expect(message), operands.pop().expect(message));
    let op = ops.pop().expect(message);
    let span = left.span.to(right.span);
    let kind = ExprKind::Binary { op, left: Box::new(left), right: Box::new(right) };
    operands.push(Expr { kind, span });
}

/// How tightly an operator binds.
fn binds(op: BinaryOp) -> u8 {
    match op {
        BinaryOp::Mul | BinaryOp::Div => 2,
        BinaryOp::Add | BinaryOp::Sub => 1,
        _ => 0,
    }
}

fn binary_op(symbol: &str) -> BinaryOp {
    match symbol {
        "+" => BinaryOp::Add,
        "-" => BinaryOp::Sub,
        "*" => BinaryOp::Mul,
        "/" => BinaryOp::Div,
        "<" => BinaryOp::Less,
        "<=" => BinaryOp::AtMost,
        ">" => BinaryOp::Greater,
        ">=" => BinaryOp::AtLeast,
        "==" => BinaryOp::Equal,
        "!=" => BinaryOp::Unequal,
        other => unreachable!("`{other}` is not an operator"),
    }
}
