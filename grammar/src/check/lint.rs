//! Warnings: what can run, and is probably not what was meant.

use std::collections::{BTreeMap, BTreeSet};

use ivx_op::{Gather, Lit};

use super::Checker;
use super::axis::SEED;
use super::scope::name_of;
use crate::ast::ItemKind;
use crate::ir::{Desc, ExprId, ExprKind, Op};
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
        let mut fed_by: Vec<BTreeSet<ExprId>> = Vec::new();
        let mut faults: BTreeMap<(ExprId, ExprId), Span> = BTreeMap::new();
        for (i, expr) in self.spec.exprs.iter().enumerate() {
            let id = ExprId(u32::try_from(i).expect("expressions are counted"));
            let mut samples = BTreeSet::new();
            match &expr.kind {
                ExprKind::Number(_) => {}
                ExprKind::Pick { base, .. } | ExprKind::Restrict { base, .. } => {
                    samples.clone_from(&fed_by[base.0 as usize]);
                }
                ExprKind::Op(op) => {
                    let decl = self.registry.decl(&op.name);
                    for (name, feeds) in &op.ports {
                        let port = decl.and_then(|decl| decl.arg(name)).map(|arg| &arg.kind);
                        let shows = matches!(port, Some(ivx_op::ArgKind::Port(port)) if port.gather == Gather::Everything);
                        if !shows {
                            samples.extend(
                                feeds.iter().flat_map(|feed| &fed_by[feed.expr.0 as usize]),
                            );
                        }
                    }
                    if let Some(pair) = self.clash(&samples) {
                        faults.entry(pair).or_insert(self.spans[i]);
                        // Said once: what it feeds is silent about it.
                        samples.remove(&pair.1);
                    }
                    if decl.is_some_and(|decl| decl.stochastic) && op.args.contains_key(STREAM) {
                        samples.insert(id);
                    }
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

    /// Two samples of one operation and stream that are not the same expression.
    fn clash(&self, samples: &BTreeSet<ExprId>) -> Option<(ExprId, ExprId)> {
        let op = |id: &ExprId| match &self.spec.expr(*id).kind {
            ExprKind::Op(op) => op,
            _ => unreachable!("only operations sample"),
        };
        let stream = |op: &Op| match op.args.get(STREAM) {
            Some(Desc::Lit(Lit::Text(stream))) => Some(stream.clone()),
            _ => None,
        };
        let samples: Vec<&ExprId> = samples.iter().collect();
        samples.iter().enumerate().find_map(|(i, first)| {
            let a = op(first);
            let same = |b: &Op| {
                a.name == b.name && stream(a).is_some() && stream(a) == stream(b) && a != b
            };
            samples[i + 1..]
                .iter()
                .find(|second| same(op(second)))
                .map(|second| (**first, **second))
        })
    }
}
