//! Rules that declarations carry: whether the arguments of a call go together.

use std::collections::{BTreeMap, BTreeSet};

use ivx_op::{ArgDecl, Args, ByName, Decl, Facts};

use super::Checker;
use super::expr::At;
use crate::ast;
use crate::ir::{AxisId, Desc, ExprId};
use crate::{Code, Diagnostic, Span};

impl<'a> Checker<'a> {
    /// Whether the arguments of a call go together at every coordinate; reports the first at which
    /// they do not.
    ///
    /// - `descs`: its descriptions.
    /// - `fed`: what each port takes.
    pub(super) fn go_together(
        &mut self,
        (at, decl, span): (&At, &Decl, Span),
        args: &[(&'a ArgDecl, Option<&'a ast::Expr>)],
        descs: &ByName<Desc>,
        fed: impl Iterator<Item = (String, Vec<ExprId>)>,
    ) -> bool {
        let Some(rule) = decl.rule else { return true };
        let axes: BTreeSet<AxisId> = descs.values().flat_map(Desc::axes).collect();
        if self.extent(&axes) > self.max_nodes {
            // Refused where it is counted.
            return true;
        }
        let over = |id: ExprId| {
            let expr = self.spec.expr(id);
            self.names(&expr.axes).into_iter().chain(expr.dims.clone()).collect()
        };
        let over: BTreeMap<String, Vec<Vec<String>>> =
            fed.map(|(port, ids)| (port, ids.into_iter().map(over).collect())).collect();
        let wrong = self.places(&axes).find_map(|place| {
            let value = |desc: &Desc| desc.eval(&self.spec.axes, &place).ok();
            let args = descs.iter().map(|(name, desc)| Some((name.clone(), value(desc)?)));
            let args = args.collect::<Option<Args>>()?;
            let wrong = rule(&Facts { args: &args, over: &over }).err()?;
            Some((wrong, self.whereabouts(&place)))
        });
        let Some((wrong, place)) = wrong else { return true };
        let given = args.iter().find(|(arg, _)| arg.name == wrong.arg).and_then(|(_, expr)| *expr);
        let (span, label) = match given {
            Some(expr) => (expr.span, "does not go with the rest".to_owned()),
            None => (span, format!("`{}` is left to its default", wrong.arg)),
        };
        let message = format!("{}{place}", wrong.message);
        let fault = Diagnostic::new(Code::Rule, span, message, label).help(wrong.help);
        let origin = given.and_then(|expr| self.origin(at, expr));
        self.fault(match origin {
            Some((span, by)) => fault.also(span, format!("set here by {by}")),
            None => fault,
        });
        false
    }
}
