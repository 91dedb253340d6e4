//! The seeds behind what a claim compares: a number made of all of them is made of each resample too.

use std::collections::{BTreeMap, BTreeSet};

use ivx_op::{ArgDecl, ArgKind, ByName, Dims, Gather, Lit, Role, SKIP_MISSING};

use super::Checker;
use super::axis::SEED;
use crate::Span;
use crate::ir::{AxisId, Desc, Expr, ExprId, ExprKind, Feed, Op};

/// The dimension of samples drawn anew.
const RESAMPLE: &str = "resample";

/// Reductions that are made of each resample where it is drawn, so that none of them is kept whole.
const REDUCTIONS: [&str; 8] =
    ["mean", "sum", "share", "median", "iqm", "std", "stderr", "quantile"];

/// What has no distribution that resamples show, where it is made of numbers that are made of seeds: steps, ends and
/// spreads of them.
const BENT: [&str; 25] = [
    "min",
    "max",
    "std",
    "stderr",
    "median",
    "iqm",
    "quantile",
    "sort",
    "less",
    "at_most",
    "greater",
    "at_least",
    "equal",
    "unequal",
    "floor",
    "ceil",
    "round",
    "sign",
    "where",
    "minimum",
    "maximum",
    "argmin_over",
    "argmax_over",
    "lowest",
    "highest",
];

/// What there is no resampling of: a largest or smallest number, or what another operation makes of all seeds.
pub(super) struct OfThese;

/// Expressions with the seeds behind them, and what was resampled for them.
#[derive(Default)]
pub(super) struct Behind {
    done: BTreeMap<ExprId, ExprId>,
    pub(super) leaves: BTreeSet<ExprId>,
    /// Whether seeds vanish in means, or in other reductions than medians and quantiles.
    pub(super) averages: bool,
}

impl Checker<'_> {
    /// Whether seeds have vanished in what a value is made of, and it has no seeds of its own.
    fn made_of_lost(&self, id: ExprId) -> bool {
        !self.program.over_seeds(id) && self.drawn.loses_seeds(id)
    }

    /// The condition of which a value is the share of seeds, and of nothing else.
    pub(super) fn share_of_seeds(&self, id: ExprId) -> Option<ExprId> {
        let ExprKind::Op(op) = &self.program.expr(id).kind else { return None };
        let [(_, feeds)] = &op.ports[..] else { return None };
        let ([feed], "share") = (&feeds[..], op.name.as_str()) else { return None };
        let over = Desc::Lit(Lit::List(vec![Lit::Text(match feed.gathered[..] {
            [] => SEED.to_owned(),
            [axis] if self.program.is_seed(axis) => "#0".to_owned(),
            _ => return None,
        })]));
        let plain = op.args.get("over") == Some(&over) && feed.groups.is_none();
        (plain && !self.drawn.loses_seeds(feed.expr)).then_some(feed.expr)
    }

    /// The value for the sample and each resample of seeds.
    ///
    /// # Errors
    /// If it is made of seeds in another way than by a reduction that resampling suits.
    pub(super) fn resampled(
        &mut self,
        id: ExprId,
        behind: &mut Behind,
        span: Span,
    ) -> Result<ExprId, OfThese> {
        if let Some(done) = behind.done.get(&id) {
            return Ok(*done);
        }
        let expr = self.program.expr(id).clone();
        let kind = match (self.drawn.loses_seeds(id), self.program.has_seeds(&expr)) {
            (false, false) => return Ok(id),
            (false, true) => {
                behind.averages = true;
                let gathered = self.program.seed_in(&expr.axes).into_iter().collect();
                ExprKind::Op(Self::drawn_anew(
                    id,
                    gathered,
                    ("", Vec::new(), Lit::Real(0.5), false),
                    behind,
                ))
            }
            (true, _) => self.resampled_kind(&expr, behind, span)?,
        };
        let seed = self.program.seed_in(&expr.axes);
        let mut dims = vec![RESAMPLE.to_owned()];
        dims.extend(seed.map(|_| SEED.to_owned()));
        dims.extend(expr.dims.iter().filter(|dim| *dim != RESAMPLE).cloned());
        let axes = expr.axes.iter().copied().filter(|axis| Some(*axis) != seed).collect();
        let done = self.push(Expr { axes, dims, kind, ..expr }, span);
        behind.done.insert(id, done);
        Ok(done)
    }

    /// The operation that draws the seeds of a value anew and reduces each sample: by its name, along which, `q`, and
    /// whether what is missing is left out.
    fn drawn_anew(
        id: ExprId,
        gathered: Vec<AxisId>,
        (reduction, along, q, skips): (&str, Vec<Lit>, Lit, bool),
        behind: &mut Behind,
    ) -> Op {
        behind.leaves.insert(id);
        let args = [
            ("reduction", Lit::Text(reduction.to_owned())),
            ("along", Lit::List(along)),
            ("q", q),
            (SKIP_MISSING, Lit::Bool(skips)),
        ];
        let args = args.map(|(name, lit)| (name.to_owned(), Desc::Lit(lit)));
        let feed = Feed { gathered, labelled: true, ..Feed::one(id) };
        Op {
            name: RESAMPLE.to_owned(),
            args: ByName::from(args),
            ports: vec![("x".to_owned(), vec![feed])],
            stochastic: false,
        }
    }

    /// A reduction of what varies over seeds and is made of none, as one operation.
    fn reduced_where_drawn(&self, op: &Op, behind: &mut Behind) -> Option<Op> {
        let [(_, feeds)] = &op.ports[..] else { return None };
        let [feed] = &feeds[..] else { return None };
        let suits = REDUCTIONS.contains(&op.name.as_str()) && feed.groups.is_none();
        if !suits || !self.program.over_seeds(feed.expr) || self.drawn.loses_seeds(feed.expr) {
            return None;
        }
        let Some(Desc::Lit(Lit::List(over))) = op.args.get("over") else { return None };
        let along = over.iter().map(|name| {
            let Lit::Text(name) = name else { return name.clone() };
            let place = name.strip_prefix('#').and_then(|place| place.parse::<usize>().ok());
            let axis = place.and_then(|place| feed.gathered.get(place));
            Lit::Text(
                axis.map_or_else(|| name.clone(), |axis| self.program.axis(*axis).name.clone()),
            )
        });
        let along = along.collect();
        let q = match op.args.get("q") {
            Some(Desc::Lit(q)) => q.clone(),
            _ => Lit::Real(0.5),
        };
        behind.averages |= !matches!(op.name.as_str(), "median" | "quantile");
        let seed = self.program.seed_of(feed.expr);
        let mut gathered = feed.gathered.clone();
        gathered.extend(seed.filter(|seed| !feed.gathered.contains(seed)));
        let skips = op.args.get(SKIP_MISSING) == Some(&Desc::Lit(Lit::Bool(true)));
        Some(Self::drawn_anew(feed.expr, gathered, (&op.name, along, q, skips), behind))
    }

    fn resampled_kind(
        &mut self,
        expr: &Expr,
        behind: &mut Behind,
        span: Span,
    ) -> Result<ExprKind, OfThese> {
        match &expr.kind {
            ExprKind::Pick { base, axis, place } if !self.program.is_seed(*axis) => {
                let base = self.resampled(*base, behind, span)?;
                Ok(ExprKind::Pick { base, axis: *axis, place: *place })
            }
            ExprKind::Restrict { base, axis, restricted, places }
                if !self.program.is_seed(*axis) =>
            {
                let (base, places) = (self.resampled(*base, behind, span)?, places.clone());
                Ok(ExprKind::Restrict { base, axis: *axis, restricted: *restricted, places })
            }
            ExprKind::Match { axis, arms } if !self.program.is_seed(*axis) => {
                let mut all = Vec::new();
                for arm in arms {
                    let own = self.resampled(*arm, behind, span)?;
                    if own == *arm {
                        return Err(OfThese);
                    }
                    all.push(own);
                }
                Ok(ExprKind::Match { axis: *axis, arms: all })
            }
            ExprKind::Op(op) => self.resampled_op(expr, op, behind, span).map(ExprKind::Op),
            _ => Err(OfThese),
        }
    }

    fn resampled_op(
        &mut self,
        expr: &Expr,
        op: &Op,
        behind: &mut Behind,
        span: Span,
    ) -> Result<Op, OfThese> {
        let decl = self.library.registry().decl(&op.name).ok_or(OfThese)?;
        let Role::Op(out) = &decl.role else { return Err(OfThese) };
        let (name, loses) = (op.name.as_str(), self.program.loses_here(expr));
        // Of a quantile too far out for resamples: state it as a share.
        let middle = op.args.get("q").is_none_or(|q| *q == Desc::Lit(Lit::Real(0.5)));
        let extreme = loses && (matches!(name, "min" | "max") || name == "quantile" && !middle);
        let mut inputs = op.ports.iter().flat_map(|(_, feeds)| feeds);
        let bent = BENT.contains(&name) && inputs.any(|feed| self.made_of_lost(feed.expr));
        if extreme
            || bent
            || op.stochastic
            || matches!(out.dims, Dims::Fixed(_) | Dims::Named(_))
            || op.args.values().any(Desc::holds)
            || decl.args.iter().any(collects)
        {
            return Err(OfThese);
        }
        if let Some(op) = self.reduced_where_drawn(op, behind) {
            return Ok(op);
        }
        behind.averages |= loses;
        let mut op = op.clone();
        let mut renamed: BTreeMap<String, String> = BTreeMap::new();
        for (_, feeds) in &mut op.ports {
            for feed in feeds {
                if feed.groups.as_ref().is_some_and(|groups| self.program.is_seed(groups.axis)) {
                    return Err(OfThese);
                }
                let kept: Vec<AxisId> = feed
                    .gathered
                    .iter()
                    .copied()
                    .filter(|axis| !self.program.is_seed(*axis))
                    .collect();
                for (i, axis) in feed.gathered.iter().enumerate().filter(|_| !feed.labelled) {
                    let place = kept.iter().position(|own| own == axis);
                    let name = place.map_or_else(|| SEED.to_owned(), |place| format!("#{place}"));
                    renamed.insert(format!("#{i}"), name);
                }
                feed.gathered = kept;
                feed.expr = self.resampled(feed.expr, behind, span)?;
            }
        }
        let axes =
            decl.args.iter().filter(|arg| matches!(arg.kind, ArgKind::Axes | ArgKind::NumericAxis));
        for arg in axes {
            let Some(Desc::Lit(Lit::List(names))) = op.args.get(arg.name) else { continue };
            let own = names.iter().map(|name| match name {
                Lit::Text(text) => Lit::Text(renamed.get(text).unwrap_or(text).clone()),
                other => other.clone(),
            });
            let own = Desc::Lit(Lit::List(own.collect()));
            op.args.insert(arg.name.to_owned(), own);
        }
        Ok(op)
    }
}

/// Whether an argument takes a collection, of which there is one and not one a resample.
fn collects(arg: &ArgDecl) -> bool {
    matches!(&arg.kind, ArgKind::Port(port) if matches!(port.gather, Gather::Collected | Gather::Labelled))
}
