//! Rules that declarations carry, and what they know of shapes: at every coordinate.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use ivx_op::{ArgDecl, Args, ByName, Decl, Facts, Shapes, Wrong};

use super::Checker;
use super::expr::At;
use crate::ast;
use crate::ir::{AxisId, Desc, ExprId, ExprKind, Feed, Known, Place};
use crate::{Code, Diagnostic, Span};

impl<'a> Checker<'a> {
    /// What is known of the shapes of a call's result. An error if its arguments do not go together
    /// at some coordinate; the first is reported.
    ///
    /// - `descs`: its descriptions.
    /// - `ports`: what each port takes.
    pub(super) fn go_together(
        &mut self,
        (at, decl, span): (&At, &Decl, Span),
        args: &[(&'a ArgDecl, Option<&'a ast::Expr>)],
        descs: &ByName<Desc>,
        ports: &[(String, Vec<Feed>)],
    ) -> Result<Option<Arc<Known>>, ()> {
        if decl.rule.is_none() && decl.shapes.is_none() {
            return Ok(None);
        }
        let mut fed: Vec<(&str, Vec<Option<Arc<Known>>>)> = Vec::new();
        for (port, feeds) in ports {
            fed.push((port, feeds.iter().map(|feed| self.fed_shapes(feed)).collect()));
        }
        let held = self.held_shapes(descs);
        let mut axes: BTreeSet<AxisId> = descs.values().flat_map(Desc::axes).collect();
        axes.extend(held.values().flat_map(|known| known.axes()));
        axes.extend(fed.iter().flat_map(|(_, all)| all).flatten().flat_map(|known| known.axes()));
        let n = self.program.extent(&axes);
        let each = axes.len() + descs.values().map(Desc::size).sum::<usize>();
        if n > self.budget.max_nodes() || !self.shapes.room(n, 1 + each) {
            // Refused where it is counted, or far too much.
            return Ok(None);
        }
        let over = |feed: &Feed| {
            let expr = self.program.expr(feed.expr);
            self.program.names(&expr.axes).into_iter().chain(expr.dims.clone()).collect()
        };
        let over: BTreeMap<String, Vec<Vec<String>>> = ports
            .iter()
            .map(|(port, feeds)| (port.clone(), feeds.iter().map(over).collect()))
            .collect();
        let seen = |feed: &Feed| {
            let axes = feed.gathered.iter();
            axes.map(|axis| self.program.axis(*axis).name.clone()).collect()
        };
        let seen: BTreeMap<String, Vec<Vec<String>>> = ports
            .iter()
            .map(|(port, feeds)| (port.clone(), feeds.iter().map(seen).collect()))
            .collect();
        let given: Vec<&str> =
            args.iter().filter(|(_, expr)| expr.is_some()).map(|(arg, _)| arg.name).collect();
        let mut results = Vec::new();
        for place in self.program.places(&axes) {
            let value = |desc: &Desc| desc.eval(self.program.axes(), &place).ok();
            let own = descs.iter().map(|(name, desc)| {
                let mut lit = value(desc)?;
                lit.foresee(&|slot| held.get(&slot)?.at(&place).cloned());
                Some((name.clone(), lit))
            });
            let Some(own) = own.collect::<Option<Args>>() else {
                results.push(None);
                continue;
            };
            let shapes = fed.iter().map(|(port, all)| (*port, here(all, &place))).collect();
            let facts =
                Facts { args: &own, given: &given, over: &over, seen: &seen, shapes: &shapes };
            if let Some(Err(wrong)) = decl.rule.map(|rule| rule(&facts)) {
                self.apart_at(&place, wrong, (at, span), args, ports);
                return Err(());
            }
            let shapes = decl.shapes.and_then(|shapes| shapes(&facts));
            results.push(shapes.map(|shapes| self.shapes.one(shapes)));
        }
        Ok(Known::new(self.program.sized(&axes), results))
    }

    /// What is known of the shapes of what parts among descriptions hold, by slot.
    fn held_shapes(&mut self, descs: &ByName<Desc>) -> BTreeMap<usize, Arc<Known>> {
        let mut slots = BTreeSet::new();
        for desc in descs.values() {
            desc.visit(&mut |desc| {
                if let Desc::Held(slot, _) = desc {
                    slots.insert(*slot);
                }
            });
        }
        let known = slots.into_iter().filter_map(|slot| {
            let feed = self.program.held(slot).clone();
            Some((slot, self.fed_shapes(&feed)?))
        });
        known.collect()
    }

    /// A fault: arguments do not go together.
    fn apart_at(
        &mut self,
        place: &Place,
        wrong: Wrong,
        (at, span): (&At, Span),
        args: &[(&'a ArgDecl, Option<&'a ast::Expr>)],
        ports: &[(String, Vec<Feed>)],
    ) {
        let given = args.iter().find(|(arg, _)| arg.name == wrong.arg).and_then(|(_, expr)| *expr);
        let (span, label) = match given {
            Some(expr) => (expr.span, "does not go with the rest".to_owned()),
            None => (span, format!("`{}` is left to its default", wrong.arg)),
        };
        let message = format!("{}{}", wrong.message, self.program.whereabouts(place));
        let fault = Diagnostic::new(Code::Rule, span, message, label).help(wrong.help);
        let fed = ports.iter().find(|(port, _)| port == wrong.arg).map(|(_, feeds)| &feeds[..]);
        let origin = match (given, fed) {
            (_, Some([feed])) => {
                let made = self.made_at(feed.expr, place);
                (!within(made, span)).then(|| (made, "computed here".to_owned()))
            }
            (Some(expr), _) => {
                self.origin(at, expr).map(|(at, by)| (at, format!("set here by {by}")))
            }
            (None, _) => None,
        };
        self.fault(match origin {
            Some((span, label)) => fault.also(span, label),
            None => fault,
        });
    }

    /// Where the value that an expression has at a place is computed, as far as the place tells.
    fn made_at(&self, mut id: ExprId, place: &Place) -> Span {
        let mut place = place.clone();
        loop {
            let next = match &self.program.expr(id).kind {
                ExprKind::Number(_) | ExprKind::Op(_) => None,
                ExprKind::Pick { base, axis, place: coordinate } => {
                    place.insert(*axis, *coordinate);
                    Some(*base)
                }
                ExprKind::Match { axis, arms } => place.get(axis).map(|i| arms[*i]),
                ExprKind::Restrict { base, axis, restricted, places } => {
                    place.extend(place.get(restricted).map(|i| (*axis, places[*i])));
                    Some(*base)
                }
            };
            match next {
                Some(next) => id = next,
                None => return self.program.span(id),
            }
        }
    }
}

/// The shapes at a place.
fn here<'k>(all: &'k [Option<Arc<Known>>], place: &Place) -> Vec<Option<&'k Shapes>> {
    let at = |known: &'k Option<Arc<Known>>| known.as_ref()?.at(place).map(Arc::as_ref);
    all.iter().map(at).collect()
}

/// Whether one span lies in another.
fn within(inner: Span, outer: Span) -> bool {
    inner.file == outer.file && outer.start <= inner.start && inner.end <= outer.end
}
