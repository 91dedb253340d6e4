//! What the names in a spec's files mean, as far as its text alone says: for editors.

use std::collections::BTreeMap;

use ivx_op::Registry;

use crate::ast::{AxisExpr, Expr, ExprKind, Item, ItemKind, LetParam, Name};
use crate::check::{Project, Scopes};
use crate::external::children;
use crate::{Span, Spanned};

/// A place that names something.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mention {
    /// Where.
    pub span: Span,
    /// What is meant.
    pub means: Means,
}

/// What is meant by a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Means {
    /// What a file of the spec declares, by where its name stands there.
    Declared(Span, Sort),
    /// An operation, a part or coordinates of the library.
    Library(&'static str),
    /// An argument of one of these.
    Argument(&'static str, &'static str),
    /// A label of the axis that is declared at a place.
    Label(Span, String),
    /// A file, by its path as written.
    File(String),
}

/// What a declared name is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sort {
    /// A parameter of the spec.
    Param,
    /// An axis.
    Axis,
    /// A field of an axis.
    Field,
    /// A value.
    Value,
    /// A function of the spec.
    Function,
    /// A parameter of such a function.
    Local,
    /// A measure.
    Measure,
    /// Published numbers.
    Published,
    /// An experiment.
    Experiment,
    /// A profile.
    Profile,
}

/// Every place in a spec's files that names something which is known, in order of place.
///
/// The text need not be right: what does not read, and names of nothing, are left out.
#[must_use]
pub fn mentions(project: &Project, registry: &Registry) -> Vec<Mention> {
    let scopes = Scopes::of(project, &mut Vec::new());
    let mut found = Vec::new();
    for (scope, own) in scopes.all.iter().enumerate() {
        let locals = BTreeMap::new();
        let mut finder = Finder { project, scopes: &scopes, registry, scope, locals, found };
        own.items.iter().for_each(|item| finder.item(item));
        found = finder.found;
    }
    found.sort_by_key(|mention| mention.span);
    found.dedup();
    found
}

/// What names mean at a place of a file, innermost first: each with where it is declared.
#[must_use]
pub fn names_at(project: &Project, file: u32, at: u32) -> Vec<(String, Span, Sort)> {
    let scopes = Scopes::of(project, &mut Vec::new());
    let holds =
        |item: &Item| item.span.file == file && item.span.start <= at && at <= item.span.end;
    let inner = scopes.all.iter().position(|scope| scope.item.is_some_and(holds));
    let scope = inner.unwrap_or(file as usize);
    let Some(own) = scopes.all.get(scope) else { return Vec::new() };
    let params = own.items.iter().filter(|item| holds(item)).filter_map(|item| match &item.kind {
        ItemKind::Let { params, .. } => params.as_ref(),
        _ => None,
    });
    let params =
        params.flatten().map(|LetParam { name, .. }| (name.value.clone(), name.span, Sort::Local));
    let known = scopes.known(scope).into_iter();
    let known = known.filter_map(|name| {
        let (_, item) = scopes.find(scope, name)?;
        let (declared, sort) = declares(item)?;
        Some((name.to_owned(), declared.span, sort))
    });
    params.chain(known).collect()
}

/// The name that an item gives to a value, and what that is.
#[must_use]
pub fn declares(item: &Item) -> Option<(&Name, Sort)> {
    Some(match &item.kind {
        ItemKind::Param { name, .. } => (name, Sort::Param),
        ItemKind::Axis { name, .. } => (name, Sort::Axis),
        ItemKind::Let { name, params: None, .. } => (name, Sort::Value),
        ItemKind::Let { name, params: Some(_), .. } => (name, Sort::Function),
        ItemKind::Measure { name, .. } => (name, Sort::Measure),
        ItemKind::Published { name, .. } => (name, Sort::Published),
        ItemKind::Experiment { name, .. } => (name, Sort::Experiment),
        _ => return None,
    })
}

struct Finder<'a> {
    project: &'a Project,
    scopes: &'a Scopes<'a>,
    registry: &'a Registry,
    scope: usize,
    /// The parameters of the function around.
    locals: BTreeMap<&'a str, Span>,
    found: Vec<Mention>,
}

impl<'a> Finder<'a> {
    fn add(&mut self, span: Span, means: Means) {
        self.found.push(Mention { span, means });
    }

    /// The item that a name means here.
    fn find(&self, name: &str) -> Option<&'a Item> {
        self.scopes.find(self.scope, name).map(|(_, item)| item)
    }

    fn name(&mut self, name: &str, span: Span) {
        if let Some(local) = self.locals.get(name) {
            self.add(span, Means::Declared(*local, Sort::Local));
        } else if let Some((declared, sort)) = self.find(name).and_then(declares) {
            self.add(span, Means::Declared(declared.span, sort));
        }
    }

    fn item(&mut self, item: &'a Item) {
        if let Some((name, sort)) = declares(item) {
            self.add(name.span, Means::Declared(name.span, sort));
        }
        match &item.kind {
            ItemKind::Use { path, names } => {
                self.file(path);
                let from = self.project.files.get(item.span.file as usize);
                let from = from.and_then(|file| file.links.get(&path.value));
                for (original, new) in names.iter().flatten() {
                    let theirs = from.and_then(|from| self.scopes.find(*from, &original.value));
                    if let Some((declared, sort)) = theirs.and_then(|(_, item)| declares(item)) {
                        self.add(original.span, Means::Declared(declared.span, sort));
                        self.add(new.span, Means::Declared(declared.span, sort));
                    }
                }
            }
            ItemKind::Include { path } | ItemKind::Published { path, .. } => self.file(path),
            ItemKind::Param { value, .. }
            | ItemKind::Measure { value, .. }
            | ItemKind::Figure { value, .. }
            | ItemKind::Table { value, .. } => self.expr(value),
            ItemKind::Profile { name, base, sets } => self.profile(name, base.as_ref(), sets),
            ItemKind::Axis { name, fields, values } => {
                for field in fields {
                    self.add(field.span, Means::Declared(field.span, Sort::Field));
                }
                self.axis(name, values);
            }
            ItemKind::Let { params, value, .. } => {
                for LetParam { name, default, .. } in params.iter().flatten() {
                    self.add(name.span, Means::Declared(name.span, Sort::Local));
                    if let Some(default) = default {
                        self.expr(default);
                    }
                    self.locals.insert(&name.value, name.span);
                }
                self.expr(value);
                self.locals.clear();
            }
            ItemKind::Claim { asked, value, within, .. } => {
                if let Some(at) = &asked.at {
                    self.expr(at);
                }
                self.expr(value);
                if let Some(within) = within {
                    self.expr(&within.margin);
                }
            }
            ItemKind::Experiment { .. } | ItemKind::Junk { .. } => {}
        }
    }

    fn file(&mut self, path: &Spanned<String>) {
        self.add(path.span, Means::File(path.value.clone()));
    }

    fn profile(&mut self, name: &'a Name, base: Option<&'a Name>, sets: &'a [(Name, Expr)]) {
        self.add(name.span, Means::Declared(name.span, Sort::Profile));
        let around = self.scopes.file_of(self.scope);
        let mut items = self.scopes.all[self.scope].items.iter();
        let mut outer = self.scopes.all[around].items.iter();
        if let Some(base) = base {
            let same = |item: &'a Item| match &item.kind {
                ItemKind::Profile { name, .. } if name.value == base.value => Some(name.span),
                _ => None,
            };
            if let Some(declared) = items.find_map(same).or_else(|| outer.find_map(same)) {
                self.add(base.span, Means::Declared(declared, Sort::Profile));
            }
        }
        for (param, value) in sets {
            self.name(&param.value, param.span);
            self.expr(value);
        }
    }

    fn axis(&mut self, name: &'a Name, values: &'a AxisExpr) {
        let label = |text: &str| Means::Label(name.span, text.to_owned());
        match values {
            AxisExpr::Range(low, high) => [low, high].into_iter().for_each(|end| self.expr(end)),
            AxisExpr::Labelled(values, _) => {
                for (text, value) in values {
                    self.add(text.span, label(&text.value));
                    self.expr(value);
                }
            }
            AxisExpr::List(Expr { kind: ExprKind::List(items), .. }) => {
                for item in items {
                    match &item.kind {
                        ExprKind::Str(text) => self.add(item.span, label(text)),
                        _ => self.expr(item),
                    }
                }
            }
            AxisExpr::List(list) => self.expr(list),
        }
    }

    /// Along operators, which are long chains, without going deeper.
    fn expr(&mut self, expr: &'a Expr) {
        let mut todo = vec![expr];
        while let Some(expr) = todo.pop() {
            match &expr.kind {
                ExprKind::Name(name) => self.name(name, expr.span),
                ExprKind::Call { name, args } => {
                    self.call(name, args);
                    children(expr, &mut todo);
                }
                ExprKind::Select { base, at } => {
                    todo.push(base);
                    for (axis, label) in at {
                        self.name(&axis.value, axis.span);
                        self.labels(&axis.value, label, &mut todo);
                    }
                }
                ExprKind::Match { axis, arms } => {
                    todo.push(axis);
                    let declared = match &axis.kind {
                        ExprKind::Name(name) => self.axis_of(name),
                        _ => None,
                    };
                    for (label, arm) in arms {
                        if let Some(axis) = declared {
                            self.add(label.span, Means::Label(axis, label.value.clone()));
                        }
                        todo.push(arm);
                    }
                }
                ExprKind::Field { base, name } => {
                    self.field(base, name);
                    children(expr, &mut todo);
                }
                _ => children(expr, &mut todo),
            }
        }
    }

    fn call(&mut self, name: &'a Name, args: &'a [(Option<Name>, Expr)]) {
        let given = args.iter().filter_map(|(name, _)| name.as_ref());
        if let Some(Item { kind: ItemKind::Let { name: own, params: Some(params), .. }, .. }) =
            self.find(&name.value)
        {
            self.add(name.span, Means::Declared(own.span, Sort::Function));
            for given in given {
                let param = params.iter().find(|param| param.name.value == given.value);
                if let Some(param) = param {
                    self.add(given.span, Means::Declared(param.name.span, Sort::Local));
                }
            }
        } else if let Some(decl) = self.registry.decl(&name.value) {
            self.add(name.span, Means::Library(decl.name));
            for given in given {
                if let Some(arg) = decl.arg(&given.value) {
                    self.add(given.span, Means::Argument(decl.name, arg.name));
                }
            }
        }
    }

    /// The axis that a name means here, by where it is declared.
    fn axis_of(&self, name: &str) -> Option<Span> {
        if self.locals.contains_key(name) {
            return None;
        }
        let (declared, sort) = declares(self.find(name)?)?;
        (sort == Sort::Axis).then_some(declared.span)
    }

    /// The labels that a selection along an axis names; what else it says is left to do.
    fn labels(&mut self, axis: &str, label: &'a Expr, todo: &mut Vec<&'a Expr>) {
        let declared = self.axis_of(axis);
        let items = match &label.kind {
            ExprKind::List(items) => items.as_slice(),
            _ => std::slice::from_ref(label),
        };
        for item in items {
            match (&item.kind, declared) {
                (ExprKind::Str(text), Some(axis)) => {
                    self.add(item.span, Means::Label(axis, text.clone()));
                }
                _ => todo.push(item),
            }
        }
    }

    fn field(&mut self, base: &'a Expr, name: &'a Name) {
        let ExprKind::Name(of) = &base.kind else { return };
        let inside: &[Item] = match self.find(of).map(|item| &item.kind) {
            Some(ItemKind::Axis { fields, .. }) => {
                if let Some(field) = fields.iter().find(|field| field.value == name.value) {
                    self.add(name.span, Means::Declared(field.span, Sort::Field));
                }
                return;
            }
            Some(ItemKind::Experiment { items, .. }) => items,
            _ => return,
        };
        let own = inside.iter().filter_map(declares).find(|(own, _)| own.value == name.value);
        if let Some((own, sort)) = own {
            self.add(name.span, Means::Declared(own.span, sort));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::File;
    use crate::parse;
    use std::fmt::Write as _;

    /// What each mention of a file means: `text → where it is declared, or what it is`.
    fn told(text: &str) -> String {
        let (ast, _) = parse(text, 0);
        let file =
            File { text: text.to_owned(), ast: ast.into(), stem: "a".into(), ..File::default() };
        let project = Project { files: vec![file] };
        let mut told = String::new();
        let line = |span: Span| text[..span.start as usize].matches('\n').count() + 1;
        for Mention { span, means } in mentions(&project, &Registry::default()) {
            let word = &text[span.start as usize..span.end as usize];
            let means = match means {
                Means::Declared(at, sort) => format!("{sort:?} of line {}", line(at)),
                Means::Label(at, _) => format!("label of line {}", line(at)),
                other => format!("{other:?}"),
            };
            writeln!(told, "{}: {word} → {means}", line(span)).expect("a string takes it");
        }
        told
    }

    #[test]
    fn names_mean_what_is_declared_around_them() {
        let text = r#"edition "2026"
param n: Int = 2
axis task(scene, level) = [("a", 1)]
let f(x: Int, n2: Int = n) = x + n2
experiment e {
    axis k = { "A": 1, "B": n }
    profile quick { n = 1 }
    profile smoke: quick { n = 1 }
    measure m = f(k, n2: task.level)[k: ["A", "C"]]
    claim "c" : match k { "A": m, "B": e.m } < nothing
    let broken =
}
"#;
        let expected = r#"2: n → Param of line 2
3: task → Axis of line 3
3: scene → Field of line 3
3: level → Field of line 3
4: f → Function of line 4
4: x → Local of line 4
4: n2 → Local of line 4
4: n → Param of line 2
4: x → Local of line 4
4: n2 → Local of line 4
5: e → Experiment of line 5
6: k → Axis of line 6
6: "A" → label of line 6
6: "B" → label of line 6
6: n → Param of line 2
7: quick → Profile of line 7
7: n → Param of line 2
8: smoke → Profile of line 8
8: quick → Profile of line 7
8: n → Param of line 2
9: m → Measure of line 9
9: f → Function of line 4
9: k → Axis of line 6
9: n2 → Local of line 4
9: task → Axis of line 3
9: level → Field of line 3
9: k → Axis of line 6
9: "A" → label of line 6
9: "C" → label of line 6
10: k → Axis of line 6
10: "A" → label of line 6
10: m → Measure of line 9
10: "B" → label of line 6
10: e → Experiment of line 5
10: m → Measure of line 9
11: broken → Value of line 11
"#;
        assert_eq!(told(text), expected);
    }
}
