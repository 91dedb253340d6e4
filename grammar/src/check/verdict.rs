//! How a claim is judged: over pairs of seeds, resamples of them, a share of them, or not over seeds at all.

use std::collections::BTreeSet;

use ivx_op::{Artifact, ByName, Lit, Verdict};

use super::Checker;
use super::behind::Behind;
use super::expr::At;
use crate::ast::BinaryOp;
use crate::ir::{Desc, Expr, ExprId, ExprKind, Judged, Mark, Op};
use crate::{Code, Diagnostic, Span};

/// The method for shares of seeds, which no spec asks for by name.
const BINOMIAL: &str = "binomial";
/// The same, where the share is the right side.
const BINOMIAL_RIGHT: &str = "binomial, right";

/// The method for medians and quantiles.
const QUANTILES: &str = "quantiles";

/// What the operation that judges is given.
struct Sides {
    relation: BinaryOp,
    ids: [ExprId; 2],
    behind: BTreeSet<ExprId>,
    by: String,
}

impl Checker<'_> {
    /// The expression that judges a claim. Marks say what kind of claim it is.
    ///
    /// - `spans`: of the comparison, and of the method asked for.
    pub(super) fn verdict(
        &mut self,
        at: &At,
        (relation, ids): (BinaryOp, [ExprId; 2]),
        spans: (Span, Option<Span>),
        judged: &mut Judged,
    ) -> Option<ExprId> {
        // A side that rests on too few seeds decides nothing, whatever the other rests on.
        let seeds = ids
            .map(|side| self.drawn.n_seeds(&self.program, side))
            .into_iter()
            .filter(|n| *n > 0)
            .min();
        let is_drawn = seeds.is_some()
            || ids.iter().any(|id| self.program.over_seeds(*id) || self.drawn.loses_seeds(*id));
        if !is_drawn {
            judged.marks.insert(Mark::Deterministic);
        }
        if ids.iter().any(|id| self.drawn.chooses_seeds(*id)) {
            judged.marks.insert(Mark::ChosenSeeds);
        }
        let plain = Sides { relation, ids, behind: BTreeSet::new(), by: judged.by.clone() };
        let sides = match self.share(&plain, judged) {
            Some(share) => share,
            None if ids.iter().any(|id| self.drawn.loses_seeds(*id)) => {
                self.behind(plain, judged, spans.0)
            }
            None => plain,
        };
        if let ("wilcoxon", Some(span)) = (judged.by.as_str(), spans.1)
            && (!sides.behind.is_empty() || !is_drawn)
        {
            let message = "signed ranks are of differences, one a seed";
            let fault = Diagnostic::new(Code::Kind, span, message, "there is one number");
            self.fault(fault.help("leave `by` out, or compare without reducing over `seed`"));
            return None;
        }
        let axis_sizes = sides.behind.iter().filter_map(|id| self.program.n_axis_seeds(*id));
        let seeds = seeds.into_iter().chain(axis_sizes).min().unwrap_or(0);
        let seeds = i64::try_from(seeds).expect("axes are bounded");
        let by = if sides.by.is_empty() { "tails".to_owned() } else { sides.by };
        let args = ByName::from([
            ("relation".to_owned(), Desc::Lit(sides.relation.symbol().into())),
            ("confidence".to_owned(), Desc::Lit(Lit::Real(judged.confidence))),
            ("within".to_owned(), Desc::Lit(Lit::Real(judged.margin))),
            ("by".to_owned(), Desc::Lit(Lit::Text(by))),
            ("seeds".to_owned(), Desc::Lit(Lit::Int(seeds))),
            (
                "describes".to_owned(),
                Desc::Lit(Lit::Bool(judged.marks.contains(&Mark::OfTheseSeeds))),
            ),
        ]);
        let [left, right] = sides.ids.map(|id| vec![self.program.everything(id)]);
        // Seeds along an axis are counted here, those inside when they are there; which are missing is seen of both.
        let behind = sides.behind.iter().map(|id| self.program.everything(*id)).collect();
        let ports = [("left", left), ("right", right), ("behind", behind)];
        let ports = ports.map(|(port, feeds)| (port.to_owned(), feeds));
        let op = Op { name: "claim".to_owned(), args, ports: ports.into(), stochastic: false };
        let expr = Expr {
            address: at.address.clone(),
            axes: BTreeSet::new(),
            collected: BTreeSet::new(),
            artifact: Verdict::KIND.to_owned(),
            dims: Vec::new(),
            kind: ExprKind::Op(op),
        };
        Some(self.push(expr, spans.0))
    }

    /// The condition and what its share of seeds is compared with, where a claim compares such a share with what rests
    /// on no seeds and asks for no other method.
    fn share(&self, plain: &Sides, judged: &Judged) -> Option<Sides> {
        let fixed = |id: ExprId| !self.program.over_seeds(id) && !self.drawn.loses_seeds(id);
        let [left, right] = plain.ids;
        let (ids, by) = match (self.share_of_seeds(left), self.share_of_seeds(right)) {
            (Some(condition), _) if fixed(right) => ([condition, right], BINOMIAL),
            (_, Some(condition)) if fixed(left) => ([left, condition], BINOMIAL_RIGHT),
            _ => return None,
        };
        let (relation, by) = (plain.relation, by.to_owned());
        judged.by.is_empty().then(|| Sides { relation, ids, behind: BTreeSet::new(), by })
    }

    /// The sides for each resample of seeds; as they are, and marked, where nothing is known of other seeds.
    fn behind(&mut self, plain: Sides, judged: &mut Judged, span: Span) -> Sides {
        let mut behind = Behind::default();
        let [left, right] = plain.ids.map(|id| self.resampled(id, &mut behind, span));
        if let (Ok(left), Ok(right)) = (left, right) {
            let quantiles = judged.by.is_empty() && !behind.averages;
            let by = if quantiles { QUANTILES.to_owned() } else { plain.by };
            return Sides { ids: [left, right], behind: behind.leaves, by, ..plain };
        }
        judged.marks.insert(Mark::OfTheseSeeds);
        plain
    }
}
