//! Experiments: what they measure, draw and claim.

use std::collections::BTreeMap;

use ivx_op::{Artifact, Figure, Table};

use super::Checker;
use super::expr::At;
use super::value::Val;
use crate::ast::{self, ItemKind};
use crate::ir::{Claim, Declared, Definition, Desc, Experiment, ExprId, Output, titled};
use crate::{Code, Diagnostic, Span, Spanned, deviations};

/// The titles of figures and tables, by what they are and the files that they name.
type Titles = BTreeMap<(&'static str, String), (String, Span)>;

impl<'a> Checker<'a> {
    /// Checks every experiment, in the order of inclusion.
    pub(super) fn experiments(&mut self) {
        self.outside();
        let mut titles = Titles::new();
        for scope in self.scopes.experiments.clone() {
            self.names.enter(scope);
            let seed = self.seed_axis(scope);
            self.names.set_seed(seed);
            let experiment = self.experiment(scope, &mut titles);
            self.program.push_experiment(experiment);
        }
        self.names.leave(None);
        let files = self.scopes.all.iter().take(self.source.files().len());
        let definitions = files.flat_map(|file| {
            let named =
                |own: Definition| Definition { name: format!("{}.{}", file.name, own.name), ..own };
            file.items.iter().filter_map(definition).map(named)
        });
        self.program.set_definitions(definitions.collect());
    }

    /// Checks what the spec's file declares and no experiment uses, as if it were used where a
    /// `seed` is declared. Nothing of it is kept.
    pub(super) fn unused_declarations(&mut self) {
        let n_exprs = self.program.exprs().len();
        let counted = self.budget.counted();
        let any_seed = self.any_seed();
        self.names.leave(Some(any_seed));
        for item in self.scopes.all[0].items {
            match &item.kind {
                // Not by its name: `seed` means those seeds.
                ItemKind::Axis { name, fields, values } => {
                    self.axis(0, (name, fields), values);
                }
                ItemKind::Let { name, params: None, .. } if !self.is_used(0, name) => {
                    self.name(&At::new(0, name.value.clone()), &name.value, name.span);
                }
                _ => {}
            }
        }
        for scope in [0].into_iter().chain(self.scopes.experiments.clone()) {
            self.uncalled(scope);
        }
        self.names.leave(None);
        self.program.truncate(n_exprs);
        self.budget.forget_since(counted);
    }

    /// Reports what only experiments can hold, where it stands in a file.
    fn outside(&mut self) {
        for item in self.source.files().iter().flat_map(|file| &file.ast.items) {
            let (what, span) = match &item.kind {
                ItemKind::Measure { name, .. } => ("a measure", name.span),
                ItemKind::Figure { name, .. } => ("a figure", name.span),
                ItemKind::Table { name, .. } => ("a table", name.span),
                ItemKind::Claim { name, .. } => ("a claim", name.span),
                _ => continue,
            };
            let message = format!("{what} stands outside of experiments");
            let fault = Diagnostic::new(Code::Syntax, span, message, "no experiment holds it");
            self.fault(fault.help("move it into an experiment"));
        }
    }

    fn seed_axis(&mut self, scope: usize) -> Option<crate::ir::AxisId> {
        let (declared, item) = self.scopes.find(scope, super::axis::SEED)?;
        match &item.kind {
            ItemKind::Axis { name, fields, values } => self.axis(declared, (name, fields), values),
            _ => None,
        }
    }

    /// - `titles`: those of figures and tables so far.
    fn experiment(&mut self, scope: usize, titles: &mut Titles) -> Experiment {
        let item = self.scopes.all[scope].item.expect("experiments have items");
        let name = self.scopes.all[scope].name.clone();
        let (docs, deviations) = deviations(&item.docs);
        let mut done = Experiment { docs, deviations, ..Experiment::default() };
        let mut claims = BTreeMap::new();
        for item in self.scopes.all[scope].items {
            let at = |own: &str| At::new(scope, format!("{name}/{own}"));
            let output = |title: &str, expr: Option<ExprId>, source: String| {
                let (name, docs) = (title.to_owned(), item.docs.clone());
                expr.map(|expr| Output { name, docs, expr, source })
            };
            done.definitions.extend(definition(item));
            match &item.kind {
                ItemKind::Measure { name, value: written } => {
                    let at = at(&name.value);
                    let value = self.name(&at, &name.value, name.span);
                    let expr = self.array(&at, value, written.span);
                    done.measures.extend(output(&name.value, expr, String::new()));
                }
                ItemKind::Param { name, .. } => {
                    let value = self.name(&at(&name.value), &name.value, name.span);
                    if let Val::Desc(Desc::Lit(value), _) = value {
                        let names = (name.value.as_str(), name.value.as_str());
                        done.params.push(self.param_of(scope, names, item, value));
                    }
                }
                ItemKind::Axis { name, .. } => {
                    self.name(&at(&name.value), &name.value, name.span);
                    if let Some(axis) = self.axes.declared(scope, &name.value) {
                        done.axes.push(Declared { axis, docs: item.docs.clone() });
                    }
                }
                ItemKind::Let { name, params: None, .. } | ItemKind::Published { name, .. } => {
                    self.name(&at(&name.value), &name.value, name.span);
                }
                ItemKind::Figure { name, value } => {
                    let at = at(&titled("figure", &name.value));
                    let expr = self.rendered(&at, name, value, Figure::KIND, titles);
                    done.figures.extend(output(&name.value, expr, String::new()));
                }
                ItemKind::Table { name, value } => {
                    let at = at(&titled("table", &name.value));
                    let expr = self.rendered(&at, name, value, Table::KIND, titles);
                    done.tables.extend(output(&name.value, expr, String::new()));
                }
                ItemKind::Claim { name, asked, value, on_par, within } => {
                    if let Some(first) = claims.insert(&name.value, name.span) {
                        self.twice(name, first);
                    }
                    if name.value.trim().is_empty() {
                        let message = "a claim says in words what it tests";
                        let fault = Diagnostic::new(Code::Kind, name.span, message, "no words");
                        self.fault(fault.help("write `claim \"more data help\" : ..`"));
                    }
                    let claimed = self.claim(
                        &at(&titled("claim", &name.value)),
                        (name, asked),
                        (value, *on_par),
                        within.as_deref(),
                    );
                    let mut source = self.source(value.span.to(item.span));
                    let spans = [
                        ("at", asked.at.as_ref().map(|at| at.span)),
                        ("by", asked.by.as_ref().map(|by| by.span)),
                        ("family", asked.family.as_ref().map(|family| family.span)),
                    ];
                    for (word, span) in spans {
                        let given = span.map(|span| format!(" {word} {}", self.source(span)));
                        source.extend(given);
                    }
                    let (expr, judged) = claimed.unzip();
                    let output = output(&name.value, expr, source);
                    let claims = output.zip(judged);
                    done.claims.extend(claims.map(|(output, judged)| Claim { output, judged }));
                }
                _ => {}
            }
        }
        Experiment { name, ..done }
    }

    /// The source text of a stretch on one line, without comments, wherever its lines were broken.
    fn source(&self, span: Span) -> String {
        on_one_line(self.source.text(span).unwrap_or_default())
    }

    fn twice(&mut self, title: &Spanned<String>, first: Span) {
        let message = format!("\"{}\" is declared twice", title.value);
        let fault = Diagnostic::new(Code::Shadowing, title.span, message, "declared again");
        self.fault(fault.also(first, "first declared here").help("give one of them another name"));
    }

    /// A figure or table. Its name is that of a file, and so unique in the whole spec.
    fn rendered(
        &mut self,
        at: &At,
        title: &Spanned<String>,
        value: &'a ast::Expr,
        kind: &'static str,
        titles: &mut Titles,
    ) -> Option<ExprId> {
        if let Some((name, first)) =
            titles.insert((kind, file_key(&title.value)), (title.value.clone(), title.span))
        {
            if name == title.value {
                self.twice(title, first);
            } else {
                let message = format!(
                    "\"{}\" and \"{name}\" would be one file where upper and lower case are one",
                    title.value
                );
                let fault = Diagnostic::new(Code::Shadowing, title.span, message, "names a file");
                self.fault(fault.also(first, "names it too").help("give one of them another name"));
            }
        }
        let fit = |c: char| c.is_alphanumeric() || "._- ".contains(c);
        let empty = title.value.trim_matches(['.', ' ']).is_empty();
        if is_device(&title.value) {
            let message = format!("\"{}\" cannot be the name of a file everywhere", title.value);
            let fault = Diagnostic::new(Code::Kind, title.span, message, "names a device");
            self.fault(fault.help("Windows keeps this name for itself: give it another"));
        } else if !title.value.chars().all(fit) || empty || title.value.len() > MAX_NAME {
            let message = format!("\"{}\" cannot be the name of a file", title.value);
            let fault = Diagnostic::new(Code::Kind, title.span, message, "names a file");
            self.fault(fault.help("use up to 100 letters, digits, `.`, `-`, `_` and spaces"));
        }
        let value_of = self.expr(at, value);
        let varying = match &value_of {
            Val::Poison => return None,
            Val::Artifact(id) if self.program.expr(*id).artifact == kind => {
                let expr = self.program.expr(*id);
                if expr.axes.is_empty() {
                    return Some(*id);
                }
                Some(self.program.names(&expr.axes).join("`, `"))
            }
            _ => None,
        };
        let fault = if let Some(axes) = varying {
            let message = format!("there would be a {kind} for each coordinate of `{axes}`");
            let fault = Diagnostic::new(Code::Kind, value.span, message, "varies");
            fault.help(format!("select one, or do not vary its settings over `{axes}`"))
        } else {
            let message = format!("expected a {kind}, found {}", self.program.describe(&value_of));
            let fault = Diagnostic::new(Code::Kind, value.span, message, format!("not a {kind}"));
            fault.maybe_help(self.library.made_by(kind))
        };
        self.fault(fault);
        None
    }
}

/// What an item gives a name to, if it says something of it.
fn definition(item: &ast::Item) -> Option<Definition> {
    let name = match &item.kind {
        ItemKind::Let { name, params: None, .. } | ItemKind::Published { name, .. } => {
            name.value.clone()
        }
        ItemKind::Let { name, params: Some(params), .. } => {
            let params: Vec<&str> = params.iter().map(|param| &*param.name.value).collect();
            format!("{}({})", name.value, params.join(", "))
        }
        _ => return None,
    };
    let docs = item.docs.clone();
    (!docs.trim().is_empty()).then_some(Definition { name, docs })
}

/// Most bytes of a figure's or table's name.
const MAX_NAME: usize = 100;

/// What two names have in common that are one file where upper and lower case are one.
fn file_key(name: &str) -> String {
    name.chars().flat_map(char::to_uppercase).flat_map(char::to_lowercase).collect()
}

/// Whether Windows opens a device by this name, whatever follows its first point.
fn is_device(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or(name).trim().to_ascii_uppercase();
    let numbered = |word: &str| {
        let number = stem.strip_prefix(word).map(|n| n.chars().collect::<Vec<_>>());
        matches!(number.as_deref(), Some(['0'..='9' | '¹' | '²' | '³']))
    };
    matches!(stem.as_str(), "CON" | "PRN" | "AUX" | "NUL") || numbered("COM") || numbered("LPT")
}

/// A text as it would read without line breaks and comments, so that its layout says nothing.
fn on_one_line(text: &str) -> String {
    let mut whole = String::new();
    for line in text.lines() {
        let line = &line[..comment(line).unwrap_or(line.len())];
        let line = line.split_whitespace().collect::<Vec<_>>().join(" ");
        if line.starts_with([')', ']', '}']) && whole.ends_with(',') {
            whole.pop();
        }
        let joined = whole.ends_with(['(', '[']) || line.starts_with([')', ']']);
        if !whole.is_empty() && !line.is_empty() && !joined {
            whole.push(' ');
        }
        whole += &line;
    }
    whole
}

/// Where a comment begins in a line, if there is one outside of strings.
fn comment(line: &str) -> Option<usize> {
    let (mut quoted, mut escaped) = (false, false);
    line.char_indices().find_map(|(i, c)| {
        if !quoted && line[i..].starts_with("//") {
            return Some(i);
        }
        quoted ^= c == '"' && !escaped;
        escaped = quoted && c == '\\' && !escaped;
        None
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_breaks_leave_no_trace() {
        let check = |text: &str, expected: &str| assert_eq!(on_one_line(text), expected);
        check("a[\n    k: 1]\n    <= f(\n  b,   c)  // why\n\n", "a[k: 1] <= f(b, c)");
        check("a[k: [\n  1,\n  2,   // two\n]]", "a[k: [1, 2]]");
        check("match k {\n  1: a,\n}\n  < b", "match k { 1: a } < b");
        check("a // (\n < b", "a < b");
    }

    #[test]
    fn comments_begin_outside_of_strings() {
        assert_eq!(comment(r#"x["a//b\"//"] < 1.0 // why"#), Some(20));
        assert_eq!(comment(r#"x["a"] < 1.0"#), None);
    }
}
