//! Warnings: what can run, and is probably not what was meant.

use std::collections::BTreeMap;

use ivx_op::{ArgKind, Gather, Lit};

use super::Checker;
use super::axis::SEED;
use super::scope::name_of;
use crate::ast::ItemKind;
use crate::ir::{Desc, Expr, ExprId, ExprKind, Op};
use crate::{Code, Diagnostic, Span};

/// The argument that tells the streams of one sampling operation apart.
const STREAM: &str = "stream";

impl Checker<'_> {
    /// Warns of what an experiment declares and nothing uses.
    ///
    /// Files are read by others: what they declare may be used elsewhere.
    pub(super) fn unused(&mut self) {
        let mut unused: Vec<(&str, Span)> = Vec::new();
        for scope in self.scopes.experiments.clone() {
            for (name, item) in &self.scopes.all[scope].names {
                let declares_value = !matches!(item.kind, ItemKind::Measure { .. });
                let used = *name == SEED || self.used.contains(&(scope, (*name).to_owned()));
                if declares_value && !used {
                    unused.push((name, name_of(item).map_or(item.span, |name| name.span)));
                }
            }
        }
        for (name, span) in unused {
            let message = format!("`{name}` is declared and not used");
            let fault = Diagnostic::new(Code::Unused, span, message, "not used");
            self.fault(fault.help("use it or take it away"));
        }
    }

    /// Warns where two samples that draw the same numbers feed one consumer.
    pub(super) fn shared_streams(&mut self) {
        // What feeds each expression: the first sample of every operation and stream.
        let mut fed_by: Vec<BTreeMap<Stream, ExprId>> = Vec::new();
        let mut faults: BTreeMap<(ExprId, ExprId), Span> = BTreeMap::new();
        for (i, expr) in self.spec.exprs.iter().enumerate() {
            let mut samples: BTreeMap<Stream, ExprId> = BTreeMap::new();
            match &expr.kind {
                ExprKind::Number(_) => {}
                ExprKind::Pick { base, .. } | ExprKind::Restrict { base, .. } => {
                    samples.clone_from(&fed_by[base.0 as usize]);
                }
                // At each coordinate there is one arm: what they draw does not meet.
                ExprKind::Match { arms, .. } => {
                    for arm in arms {
                        for (stream, sample) in &fed_by[arm.0 as usize] {
                            samples.entry(stream.clone()).or_insert(*sample);
                        }
                    }
                }
                ExprKind::Op(op) => {
                    for feed in self.consumed(expr, op) {
                        for (stream, sample) in &fed_by[feed.0 as usize] {
                            let first = *samples.entry(stream.clone()).or_insert(*sample);
                            if first != *sample
                                && self.spec.expr(first).kind != self.spec.expr(*sample).kind
                            {
                                faults
                                    .entry((first.min(*sample), first.max(*sample)))
                                    .or_insert(self.spans[i]);
                            }
                        }
                    }
                    let stream = stream(op);
                    let id = ExprId(u32::try_from(i).expect("expressions are counted"));
                    samples.extend(stream.map(|stream| (stream, id)));
                }
            }
            fed_by.push(samples);
        }
        for ((first, second), consumer) in faults {
            let message = "two samples draw the same numbers, and one result depends on both";
            let spans = (self.spans[first.0 as usize], self.spans[second.0 as usize]);
            let fault = Diagnostic::new(Code::SharedStream, spans.1, message, "draws these again")
                .also(spans.0, "draws numbers")
                .also(consumer, "depends on both");
            self.fault(fault.help("give one of them a stream of its own: `stream: \"test\"`"));
        }
    }

    /// What an operation computes with; figures and tables only show.
    fn consumed(&self, expr: &Expr, op: &Op) -> Vec<ExprId> {
        let decl = self.registry.decl(&op.name);
        let shows = |name: &str| {
            let port = decl.and_then(|decl| decl.arg(name)).map(|arg| &arg.kind);
            matches!(port, Some(ArgKind::Port(port)) if port.gather == Gather::Everything)
        };
        let shown = op.ports.iter().filter(|(name, _)| shows(name));
        let shown: Vec<ExprId> =
            shown.flat_map(|(_, feeds)| feeds.iter().map(|f| f.expr)).collect();
        let mut inputs = self.spec.inputs(expr);
        inputs.retain(|input| !shown.contains(input));
        inputs
    }
}

/// An operation that samples, and the name of its stream.
type Stream = (String, String);

/// The stream of a sampling operation.
fn stream(op: &Op) -> Option<Stream> {
    match op.args.get(STREAM) {
        Some(Desc::Lit(Lit::Text(stream))) if op.stochastic => {
            Some((op.name.clone(), stream.clone()))
        }
        _ => None,
    }
}
