//! Published numbers: files beside a spec.

use ivx_op::{Dim, Labels, Lit};

use super::Checker;
use super::expr::At;
use super::value::Val;
use crate::ast::{self, ExprKind, ItemKind, Name};
use crate::ir::Desc;
use crate::{Code, Diagnostic, Spanned};

/// The field of published numbers that has their standard errors.
const ERRORS: &str = "errors";

impl<'a> Checker<'a> {
    /// The numbers of a file, or their standard errors.
    ///
    /// - `errors`: where a spec asks for standard errors.
    pub(super) fn published(
        &mut self,
        at: &At,
        scope: usize,
        path: &Spanned<String>,
        errors: Option<&Name>,
    ) -> Val {
        // What cannot be read was reported.
        let Some(found) = self.source.published(self.scopes.file_of(scope), &path.value) else {
            return Val::Poison;
        };
        let Some(numbers) = errors.map_or(Some(&found.values), |_| found.errors.as_ref()) else {
            let span = errors.map_or(path.span, |name| name.span);
            let message = format!("`{}` has no standard errors", path.value);
            let fault = Diagnostic::new(Code::UnknownName, span, message, "not published");
            return self.fault(fault.also(path.span, "published here"));
        };
        let dims: Vec<String> = found.dims.iter().map(|dim| dim.name.clone()).collect();
        let missing = (0_i64..).zip(numbers).filter(|(_, number)| number.is_none());
        let args = [
            ("dims", Lit::List(dims.iter().cloned().map(Lit::Text).collect())),
            ("labels", Lit::List(found.dims.iter().map(labels).collect())),
            ("numeric", Lit::List(found.dims.iter().map(numeric).collect())),
            ("values", Lit::from(numbers.iter().map(|x| x.unwrap_or(0.0)).collect::<Vec<_>>())),
            ("missing", Lit::from(missing.map(|(place, _)| place).collect::<Vec<_>>())),
        ];
        let args = args.into_iter().map(|(name, lit)| (name.to_owned(), Desc::Lit(lit))).collect();
        let known = found.dims.clone();
        let value = self.builtin(at, "published", args, Vec::new(), path.span);
        if let Val::Artifact(id) = value {
            self.program.set_dims(id, dims);
            self.labels.note(id, known);
        }
        value
    }

    /// `t.errors` where `t` is published.
    pub(super) fn published_errors(
        &mut self,
        at: &At,
        base: &'a ast::Expr,
        field: &'a Name,
    ) -> Option<Val> {
        let ExprKind::Name(name) = &base.kind else { return None };
        if field.value != ERRORS || at.locals.contains_key(name) {
            return None;
        }
        let (scope, item) = self.scopes.find(at.scope, name)?;
        let ItemKind::Published { path, .. } = &item.kind else { return None };
        self.uses(at, name);
        Some(self.published(&at.inside(ERRORS), scope, path, Some(field)))
    }
}

fn labels(dim: &Dim) -> Lit {
    Lit::List((0..dim.len()).map(|i| Lit::Text(dim.labels.text(i))).collect())
}

fn numeric(dim: &Dim) -> Lit {
    Lit::Bool(matches!(dim.labels, Labels::Numbers(_)))
}
