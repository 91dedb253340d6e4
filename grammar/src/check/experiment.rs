//! Experiments: what they measure, draw and claim.

use std::collections::{BTreeMap, BTreeSet};

use ivx_op::{Artifact, Figure, Lit, Table, Verdict};

use super::Checker;
use super::expr::At;
use super::value::Val;
use crate::ast::{self, ExprKind, ItemKind};
use crate::ir::{Desc, Experiment, Expr, ExprId, Feed, Op, Output};
use crate::{Code, Diagnostic, Span, Spanned};

impl<'a> Checker<'a> {
    /// Checks every experiment, in the order of inclusion.
    pub(super) fn experiments(&mut self) {
        for scope in self.scopes.experiments.clone() {
            self.memo.clear();
            self.experiment = Some(scope);
            self.seed = None;
            self.seed = self.seed_axis(scope);
            let experiment = self.experiment(scope);
            self.spec.experiments.push(experiment);
        }
        self.experiment = None;
    }

    fn seed_axis(&mut self, scope: usize) -> Option<crate::ir::AxisId> {
        let (declared, item) = self.scopes.find(scope, super::axis::SEED)?;
        match &item.kind {
            ItemKind::Axis { name, values } => self.axis(declared, name, values),
            _ => None,
        }
    }

    fn experiment(&mut self, scope: usize) -> Experiment {
        let item = self.scopes.all[scope].item.expect("experiments have items");
        let mut done = Experiment {
            name: self.scopes.all[scope].name.clone(),
            docs: item.docs.clone(),
            ..Experiment::default()
        };
        let mut titles: BTreeMap<(u8, &str), Span> = BTreeMap::new();
        for item in self.scopes.all[scope].items {
            let at = |name: &str| At::new(scope, format!("{}/{name}", done.name));
            let (group, title, value) = match &item.kind {
                ItemKind::Figure { name, value } => (1, name, value),
                ItemKind::Table { name, value } => (2, name, value),
                ItemKind::Claim { name, value } => (3, name, value),
                ItemKind::Measure { name, .. } => {
                    let value = self.name(&at(&name.value), &name.value, name.span);
                    let array = self.array(&at(&name.value), value, item.span);
                    done.measures.extend(
                        array.map(|expr| output(&name.value, &item.docs, expr, String::new())),
                    );
                    continue;
                }
                ItemKind::Param { name, .. } => {
                    if let Val::Desc(Desc::Lit(lit), _) =
                        self.name(&at(&name.value), &name.value, name.span)
                    {
                        done.params.push((name.value.clone(), lit));
                    }
                    continue;
                }
                ItemKind::Let { name, params: None, .. } | ItemKind::Axis { name, .. } => {
                    self.name(&at(&name.value), &name.value, name.span);
                    continue;
                }
                ItemKind::Experiment { name, .. } => {
                    let message = "an experiment cannot hold another";
                    self.fault(Diagnostic::new(
                        Code::Kind,
                        name.span,
                        message,
                        "inside an experiment",
                    ));
                    continue;
                }
                _ => continue,
            };
            if let Some(first) = titles.insert((group, &title.value), title.span) {
                let message = format!("\"{}\" is declared twice", title.value);
                let fault = Diagnostic::new(Code::Shadowing, title.span, message, "declared again");
                self.fault(fault.also(first, "first declared here"));
            }
            let at = at(&title.value);
            let outputs = match group {
                1 => &mut done.figures,
                2 => &mut done.tables,
                _ => &mut done.claims,
            };
            let expr = match group {
                1 => self.rendered(&at, value, Figure::KIND),
                2 => self.rendered(&at, value, Table::KIND),
                _ => self.claim(&at, title, value),
            };
            let source = if group == 3 { self.text(value.span) } else { String::new() };
            outputs.extend(expr.map(|expr| output(&title.value, &item.docs, expr, source)));
        }
        done
    }

    fn rendered(&mut self, at: &At, value: &'a ast::Expr, kind: &str) -> Option<ExprId> {
        match self.expr(at, value) {
            Val::Poison => None,
            Val::Artifact(id) if self.spec.expr(id).artifact == kind => Some(id),
            other => {
                let message = format!("expected a {kind}, found {}", self.describe(&other));
                let makers = self.registry.decls().filter(
                    |decl| matches!(&decl.role, ivx_op::Role::Op(out) if out.artifact == kind),
                );
                let makers: Vec<_> =
                    makers.take(6).map(|decl| format!("`{}(..)`", decl.name)).collect();
                let fault =
                    Diagnostic::new(Code::Kind, value.span, message, format!("not a {kind}"));
                self.fault(fault.help(format!("a {kind} comes from {}", makers.join(", "))));
                None
            }
        }
    }

    fn claim(
        &mut self,
        at: &At,
        title: &'a Spanned<String>,
        value: &'a ast::Expr,
    ) -> Option<ExprId> {
        let ExprKind::Binary { op, left, right } = &value.kind else {
            if !matches!(value.kind, ExprKind::Junk) {
                let fault = Diagnostic::new(
                    Code::Kind,
                    value.span,
                    "a claim compares two values",
                    "not a comparison",
                );
                self.fault(fault.help("write `left < right`"));
            }
            return None;
        };
        if !op.value.compares() {
            let fault = Diagnostic::new(
                Code::Kind,
                value.span,
                "a claim compares two values",
                "not a comparison",
            );
            self.fault(fault.help("write `left < right`"));
            return None;
        }
        let mut feeds = Vec::new();
        let mut over = Vec::new();
        for (port, side) in [("left", left), ("right", right)] {
            let value = self.expr(at, side);
            let constant = matches!(&value, Val::Desc(desc, _) if desc.axes().is_empty());
            let id = self.array(at, value, side.span)?;
            let expr = self.spec.expr(id);
            let mut gathered: Vec<_> = expr.axes.iter().copied().collect();
            gathered.sort_by_key(|axis| self.spec.axis(*axis).name.clone());
            let mut names: BTreeSet<String> =
                self.names(&expr.axes).into_iter().chain(expr.dims.clone()).collect();
            names.remove(super::axis::SEED);
            over.push((constant, names, side.span, expr.axes.clone()));
            let feed = Feed { expr: id, gathered, labelled: true, name: String::new() };
            feeds.push((port.to_owned(), vec![feed]));
        }
        if !over.iter().any(|(constant, ..)| *constant) && over[0].1 != over[1].1 {
            let (more, less) = if over[0].1.is_subset(&over[1].1) {
                (&over[1], &over[0])
            } else {
                (&over[0], &over[1])
            };
            let lacking: Vec<_> = more.1.difference(&less.1).map(String::as_str).collect();
            let message = format!(
                "one side of the claim varies over `{}`, the other does not",
                lacking.join("`, `")
            );
            let fault = Diagnostic::new(Code::ClaimAxes, less.2, message, "does not vary over it");
            let help = format!(
                "select or reduce on the other side: `mean(x, over: {})`",
                lacking.join(", ")
            );
            self.fault(fault.also(more.2, "varies over it").help(help));
            return None;
        }
        let all = over[0].3.union(&over[1].3).copied().collect();
        if !self.distinct(&all, title.span) {
            return None;
        }
        let args = BTreeMap::from([
            ("relation".to_owned(), Desc::Lit(op.value.symbol().into())),
            ("confidence".to_owned(), Desc::Lit(Lit::Real(0.95))),
        ]);
        let op = Op { name: "claim".to_owned(), args, ports: feeds, stochastic: false };
        let expr = Expr {
            address: at.address.clone(),
            axes: BTreeSet::new(),
            collected: BTreeSet::new(),
            artifact: Verdict::KIND.to_owned(),
            dims: Vec::new(),
            kind: crate::ir::ExprKind::Op(op),
        };
        Some(self.push(expr, value.span))
    }
}

fn output(name: &str, docs: &str, expr: ExprId, source: String) -> Output {
    Output { name: name.to_owned(), docs: docs.to_owned(), expr, source }
}
