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
                let span = name_of(item).map_or(item.span, |name| name.span);
                // What draws uses the seeds without naming them.
                let seeds = *name == SEED && matches!(item.kind, ItemKind::Axis { .. });
                let used = seeds || self.names.is_used(span);
                if declares_value && !used {
                    unused.push((name, span));
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
        let mut streams: BTreeMap<(&str, &str), Vec<usize>> = BTreeMap::new();
        for (i, expr) in self.program.exprs().iter().enumerate() {
            if let ExprKind::Op(op) = &expr.kind
                && let Some(stream) = stream(op)
            {
                streams.entry(stream).or_default().push(i);
            }
        }
        let mut faults: BTreeMap<(ExprId, ExprId), Span> = BTreeMap::new();
        for samples in streams.values().filter(|samples| samples.len() > 1) {
            self.meet(samples, &mut faults);
        }
        for ((first, second), consumer) in faults {
            let message = "two samples draw the same numbers, and one result depends on both";
            let spans = (self.program.span(first), self.program.span(second));
            let fault = Diagnostic::new(Code::SharedStream, spans.1, message, "draws these again")
                .also(spans.0, "draws numbers")
                .also(consumer, "depends on both");
            self.fault(fault.help("give one of them a stream of its own: `stream: \"test\"`"));
        }
    }

    /// Finds which of the samples of one stream feed one consumer.
    fn meet(&self, samples: &[usize], faults: &mut BTreeMap<(ExprId, ExprId), Span>) {
        let start = samples[0];
        // The first sample that feeds each expression, from the first sample on.
        let mut fed_by: Vec<Option<ExprId>> = Vec::new();
        for (i, expr) in self.program.exprs().iter().enumerate().skip(start) {
            let fed = |id: &ExprId| fed_by.get((id.0 as usize).checked_sub(start)?).copied()?;
            let mut first = None;
            match &expr.kind {
                ExprKind::Number(_) => {}
                ExprKind::Pick { base, .. } | ExprKind::Restrict { base, .. } => first = fed(base),
                // At each coordinate there is one arm: what they draw does not meet.
                ExprKind::Match { arms, .. } => first = arms.iter().find_map(fed),
                ExprKind::Op(op) => {
                    for sample in self.consumed(expr, op).iter().filter_map(fed) {
                        let first = *first.get_or_insert(sample);
                        let kind = |id: ExprId| &self.program.expr(id).kind;
                        if first != sample && kind(first) != kind(sample) {
                            let pair = (first.min(sample), first.max(sample));
                            faults.entry(pair).or_insert(
                                self.program.span(ExprId(
                                    u32::try_from(i).expect("expressions are counted"),
                                )),
                            );
                        }
                    }
                }
            }
            if samples.binary_search(&i).is_ok() {
                first = Some(ExprId(u32::try_from(i).expect("expressions are counted")));
            }
            fed_by.push(first);
        }
    }

    /// What an operation computes with; figures and tables only show.
    fn consumed(&self, expr: &Expr, op: &Op) -> Vec<ExprId> {
        let decl = self.library.registry().decl(&op.name);
        let shows = |name: &str| {
            let port = decl.and_then(|decl| decl.arg(name)).map(|arg| &arg.kind);
            matches!(port, Some(ArgKind::Port(port)) if port.gather == Gather::Everything)
        };
        let shown = op.ports.iter().filter(|(name, _)| shows(name));
        let shown: Vec<ExprId> =
            shown.flat_map(|(_, feeds)| feeds.iter().map(|f| f.expr)).collect();
        let mut inputs = self.program.inputs(expr);
        inputs.retain(|input| !shown.contains(input));
        inputs
    }
}

/// An operation that samples, and the name of its stream.
fn stream(op: &Op) -> Option<(&str, &str)> {
    match op.args.get(STREAM) {
        Some(Desc::Lit(Lit::Text(stream))) if op.stochastic => Some((&op.name, stream)),
        _ => None,
    }
}
