//! Operations: ports, axes, dimensions, members and seeds.

use std::collections::{BTreeMap, BTreeSet};

use ivx_op::{ArgDecl, ArgKind, Array, Artifact, Decl, Dims, Gather, Lit, OutDecl, Port};

use super::Checker;
use super::call::Written;
use super::expr::At;
use super::value::Val;
use crate::ast::{self, ExprKind};
use crate::ir::{AxisId, AxisRole, Desc, Expr, ExprId, Feed, Op};
use crate::{Code, Diagnostic, Span, suggest};

/// The name of an axis as written, and where.
type Named<'a> = (&'a str, Span);

type Matched<'a> = [(&'a ArgDecl, Option<&'a ast::Expr>)];

/// What a port takes, before the axes it gathers are known.
struct Fed<'a> {
    port: Port,
    name: &'a str,
    exprs: Vec<(ExprId, Span, String)>,
}

impl<'a> Checker<'a> {
    /// What the call of an operation amounts to.
    pub(super) fn op(
        &mut self,
        at: &At,
        decl: &'a Decl,
        out: &OutDecl,
        args: &Matched<'a>,
        span: Span,
    ) -> Val {
        let inner = at.inside(decl.name);
        let mut descs = BTreeMap::new();
        let mut fed: Vec<Fed<'_>> = Vec::new();
        let mut named: Vec<(&ArgDecl, Vec<Named<'a>>)> = Vec::new();
        let mut sound = true;
        for (arg, given) in args {
            match (&arg.kind, given) {
                (ArgKind::Port(port), Some(expr)) => match self.fed(&inner, decl, arg, *port, expr)
                {
                    Some(exprs) => fed.push(Fed { port: *port, name: arg.name, exprs }),
                    None => sound = false,
                },
                (ArgKind::Port(port), None) => {
                    fed.push(Fed { port: *port, name: arg.name, exprs: Vec::new() });
                }
                (ArgKind::Axes, given) => match self.axis_names(decl, arg, *given) {
                    Some(names) => named.push((*arg, names)),
                    None => sound = false,
                },
                _ => match self.literal_arg(&inner, decl, arg, *given) {
                    Some(desc) => {
                        descs.insert(arg.name.to_owned(), desc);
                    }
                    None => sound = false,
                },
            }
        }
        let members = self.members_of(&descs, span);
        let (true, Ok(members)) = (sound, members) else {
            return Val::Poison;
        };
        if !self.known_axes(decl, &fed, &named) {
            return Val::Poison;
        }
        let taken: Vec<&str> =
            named.iter().flat_map(|(_, names)| names.iter().map(|(name, _)| *name)).collect();
        let mut axes: BTreeSet<AxisId> =
            descs.values().flat_map(Desc::axes).chain(members).collect();
        let mut everything = axes.clone();
        let mut ports = Vec::new();
        for feed in &fed {
            let mut feeds = Vec::new();
            for (id, feed_span, name) in &feed.exprs {
                let Some(gathered) = self.gathered(feed.port, *id, &taken, *feed_span) else {
                    return Val::Poison;
                };
                let own = self.spec.expr(*id).axes.clone();
                everything.extend(&own);
                axes.extend(own.iter().filter(|axis| !gathered.contains(axis)));
                let labelled = feed.port.gather == Gather::Everything;
                let name = if labelled { name.clone() } else { String::new() };
                feeds.push(Feed { expr: *id, gathered, labelled, name });
            }
            ports.push((feed.name.to_owned(), feeds));
        }
        let stochastic = decl.stochastic || descs.values().any(|desc| self.draws(desc));
        if let (true, Some(seed)) = (stochastic, self.seed) {
            axes.insert(seed);
            everything.insert(seed);
        }
        if !self.distinct(&everything, span) {
            return Val::Poison;
        }
        for (arg, names) in &named {
            let names =
                names.iter().map(|(name, _)| Lit::Text(self.travelling(&fed, &ports, name)));
            descs.insert(arg.name.to_owned(), Desc::Lit(Lit::List(names.collect())));
        }
        let dims = self.dims(out.dims, &fed, &taken);
        let op = Op { name: decl.name.to_owned(), args: descs, ports, stochastic };
        let expr = Expr {
            address: at.address.clone(),
            axes,
            collected: BTreeSet::new(),
            artifact: out.artifact.to_owned(),
            dims,
            kind: crate::ir::ExprKind::Op(op),
        };
        Val::Artifact(self.push(expr, span))
    }

    /// The expressions given to a port.
    fn fed(
        &mut self,
        at: &At,
        decl: &Decl,
        arg: &ArgDecl,
        port: Port,
        expr: &'a ast::Expr,
    ) -> Option<Vec<(ExprId, Span, String)>> {
        let items = match &expr.kind {
            ExprKind::List(items) if port.list => items.as_slice(),
            _ => std::slice::from_ref(expr),
        };
        let mut fed = Vec::new();
        let mut sound = true;
        for item in items {
            let value = self.expr(at, item);
            let number = port.artifact == Array::KIND
                && matches!(&value, Val::Desc(_, ty) if super::expr::is_number(ty));
            let id = match value {
                Val::Poison => None,
                Val::Artifact(id) if self.spec.expr(id).artifact == port.artifact => Some(id),
                value if number => self.array(at, value, item.span),
                other => {
                    let message = format!(
                        "`{}.{}` takes {port}, found {}",
                        decl.name,
                        arg.name,
                        self.describe(&other)
                    );
                    let fault =
                        Diagnostic::new(Code::Type, item.span, message, format!("expected {port}"));
                    let help = self.made_by(port.artifact);
                    self.fault(fault.maybe_help(help));
                    None
                }
            };
            sound &= id.is_some();
            fed.extend(id.map(|id| (id, item.span, self.text(item.span))));
        }
        sound.then_some(fed)
    }

    /// The operations that result in a kind of artifact, as advice.
    fn made_by(&self, artifact: &str) -> Option<String> {
        let makes =
            |decl: &&Decl| matches!(&decl.role, ivx_op::Role::Op(out) if out.artifact == artifact);
        let makers: Vec<_> = self
            .registry
            .decls()
            .filter(makes)
            .take(6)
            .map(|d| format!("`{}(..)`", d.name))
            .collect();
        (!makers.is_empty()).then(|| format!("a {artifact} comes from {}", makers.join(", ")))
    }

    /// The source text of a stretch, on one line.
    pub(super) fn text(&self, span: Span) -> String {
        let text = &self.project.files[span.file as usize].text;
        let text = text.get(span.start as usize..span.end as usize).unwrap_or_default();
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    fn axis_names(
        &mut self,
        decl: &Decl,
        arg: &ArgDecl,
        given: Option<&'a ast::Expr>,
    ) -> Option<Vec<Named<'a>>> {
        let Some(expr) = given else {
            return Some(Vec::new());
        };
        let items = if let ExprKind::List(items) = &expr.kind {
            items.as_slice()
        } else {
            std::slice::from_ref(expr)
        };
        let mut names = Vec::new();
        for item in items {
            let ExprKind::Name(name) = &item.kind else {
                let message =
                    format!("`{}.{}` takes the name of an axis or dimension", decl.name, arg.name);
                self.fault(Diagnostic::new(Code::UnknownAxis, item.span, message, "not a name"));
                return None;
            };
            names.push((name.as_str(), item.span));
        }
        Some(names)
    }

    /// Whether every axis named is one that some gathering port varies over; reports it if not.
    fn known_axes(
        &mut self,
        decl: &Decl,
        fed: &[Fed<'_>],
        named: &[(&ArgDecl, Vec<Named<'a>>)],
    ) -> bool {
        let gathers =
            |feed: &&Fed<'_>| matches!(feed.port.gather, Gather::Named | Gather::Everything);
        let mut known = Vec::new();
        for (id, _, _) in fed.iter().filter(gathers).flat_map(|feed| &feed.exprs) {
            let expr = self.spec.expr(*id);
            known.extend(self.names(&expr.axes).into_iter().chain(expr.dims.clone()));
        }
        let mut sound = true;
        for (name, span) in named.iter().flat_map(|(_, names)| names) {
            if known.iter().any(|known| known == name) {
                continue;
            }
            let message = format!("`{}` has nothing that varies over `{name}`", decl.name);
            let fault =
                Diagnostic::new(Code::UnknownAxis, *span, message, "no axis or dimension of it");
            let help = if known.is_empty() {
                Some("its values vary over nothing".to_owned())
            } else {
                suggest(name, known.iter().map(String::as_str))
            };
            self.fault(fault.maybe_help(help));
            sound = false;
        }
        sound
    }

    /// The axes that a port gathers of a value, outermost first.
    fn gathered(
        &mut self,
        port: Port,
        id: ExprId,
        taken: &[&str],
        span: Span,
    ) -> Option<Vec<AxisId>> {
        let expr = self.spec.expr(id);
        let by_name = |checker: &Self, mut axes: Vec<AxisId>| {
            axes.sort_by_key(|axis| checker.spec.axis(*axis).name.clone());
            axes
        };
        if !expr.collected.is_empty()
            && !matches!(port.gather, Gather::Collected | Gather::Everything)
        {
            let over = self.names(&expr.collected).join(", ");
            let message = format!(
                "this is a collection over {over}, where one {} is expected",
                port.artifact
            );
            self.fault(Diagnostic::new(Code::Kind, span, message, "a collection"));
            return None;
        }
        match port.gather {
            Gather::Pointwise => Some(Vec::new()),
            Gather::Everything => Some(by_name(self, expr.axes.iter().copied().collect())),
            Gather::Collected if expr.collected.is_empty() => {
                let message = format!("expected a collection of {}, found one", port.artifact);
                let fault = Diagnostic::new(Code::Kind, span, message, "not a collection");
                self.fault(fault.help("write `collect(x, over: axis)`"));
                None
            }
            Gather::Collected => Some(by_name(self, expr.collected.iter().copied().collect())),
            Gather::Named => {
                let axes = expr.axes.iter().copied();
                let named = taken
                    .iter()
                    .filter_map(|name| axes.clone().find(|a| self.spec.axis(*a).name == *name));
                Some(named.collect())
            }
            Gather::Members => {
                let member =
                    expr.axes.iter().find(|axis| self.spec.axis(**axis).role == AxisRole::Member);
                if let Some(member) = member {
                    return Some(vec![*member]);
                }
                let message = format!("expected an ensemble, found one {}", port.artifact);
                let fault = Diagnostic::new(Code::Kind, span, message, format!("expected {port}"));
                self.fault(
                    fault.help("an ensemble comes from `train(ensemble(.., members: K), ..)`"),
                );
                None
            }
        }
    }

    /// The name under which an axis reaches the operation: its own where labels travel, else its
    /// place among the gathered.
    fn travelling(&self, fed: &[Fed<'_>], ports: &[(String, Vec<Feed>)], name: &str) -> String {
        for (feed, (_, feeds)) in fed.iter().zip(ports) {
            if feed.port.gather != Gather::Named {
                continue;
            }
            for feed in feeds {
                if let Some(i) =
                    feed.gathered.iter().position(|axis| self.spec.axis(*axis).name == name)
                {
                    return format!("#{i}");
                }
            }
        }
        name.to_owned()
    }

    fn dims(&self, dims: Dims, fed: &[Fed<'_>], taken: &[&str]) -> Vec<String> {
        let of_port = |port: &str| {
            let fed = fed.iter().find(|feed| feed.name == port);
            fed.and_then(|feed| feed.exprs.first())
                .map(|(id, ..)| self.spec.expr(*id).dims.clone())
                .unwrap_or_default()
        };
        match dims {
            Dims::Fixed(dims) => dims.iter().map(ToString::to_string).collect(),
            Dims::Union => {
                let mut all: Vec<String> = Vec::new();
                for feed in fed {
                    all.extend(
                        of_port(feed.name)
                            .into_iter()
                            .filter(|dim| !all.contains(dim))
                            .collect::<Vec<_>>(),
                    );
                }
                all
            }
            Dims::Reduced { port, add } => {
                let kept = of_port(port).into_iter().filter(|dim| !taken.contains(&dim.as_str()));
                kept.chain(add.iter().map(ToString::to_string)).collect()
            }
        }
    }

    /// The member axis that descriptions ask for.
    fn members_of(
        &mut self,
        descs: &BTreeMap<String, Desc>,
        span: Span,
    ) -> Result<Option<AxisId>, ()> {
        let mut counts: Vec<Option<i64>> = Vec::new();
        for desc in descs.values() {
            let mut lits: Vec<Lit> = Vec::new();
            let mut axes = BTreeSet::new();
            desc.visit(&mut |desc| match desc {
                Desc::Lit(lit) => lits.push(lit.clone()),
                Desc::Axis(axis) => {
                    axes.insert(*axis);
                }
                Desc::Part(name, args) => {
                    let decl = self.registry.decl(name);
                    let own = decl
                        .and_then(|decl| decl.args.iter().find(|arg| arg.kind == ArgKind::Members));
                    if let Some(desc) = own.and_then(|arg| args.get(arg.name)) {
                        counts.push(if let Desc::Lit(Lit::Int(n)) = desc {
                            Some(*n)
                        } else {
                            None
                        });
                    }
                }
                _ => {}
            });
            counts.extend(
                lits.iter().filter_map(|lit| self.registry.member_count(lit)).map(|(_, n)| Some(n)),
            );
            for axis in axes {
                let coords = &self.spec.axis(axis).coords;
                let each: Vec<_> = coords
                    .iter()
                    .map(|c| self.registry.member_count(&c.value).map(|(_, n)| n))
                    .collect();
                if each.iter().any(Option::is_some) {
                    counts.extend(each);
                }
            }
        }
        counts.dedup();
        match counts[..] {
            [] => Ok(None),
            [Some(n)] => Ok(Some(self.member_axis(n))),
            _ => {
                let message = "the number of members must be the same everywhere";
                let fault = Diagnostic::new(
                    Code::Dimensions,
                    span,
                    message,
                    "ensembles of several sizes meet",
                );
                self.fault(fault.help("train the largest ensemble and select members from it"));
                Err(())
            }
        }
    }

    /// Whether a part in a description draws random numbers.
    fn draws(&self, desc: &Desc) -> bool {
        let stochastic = |name: &str| self.registry.decl(name).is_some_and(|decl| decl.stochastic);
        let mut draws = false;
        desc.visit(&mut |desc| {
            draws |= match desc {
                Desc::Lit(lit) => any_part(lit, &stochastic),
                Desc::Part(name, _) => stochastic(name),
                Desc::Axis(axis) => {
                    self.spec.axis(*axis).coords.iter().any(|c| any_part(&c.value, &stochastic))
                }
                _ => false,
            }
        });
        draws
    }

    /// `collect(x, over: axis)`: the value with the axis put together, for ports that take
    /// collections.
    pub(super) fn collect(&mut self, at: &At, args: &'a Written<'a>, span: Span) -> Val {
        let [(None, base), (Some(over), axis)] = args else {
            let fault = Diagnostic::new(
                Code::MissingArgument,
                span,
                "`collect` takes a value and an axis",
                "incomplete",
            );
            return self.fault(fault.help("write `collect(x, over: axis)`"));
        };
        let ExprKind::Name(name) = &axis.kind else {
            let message = "`collect.over` takes the name of an axis";
            return self.fault(Diagnostic::new(
                Code::UnknownAxis,
                axis.span,
                message,
                "not a name",
            ));
        };
        if over.value != "over" {
            let message = format!("`collect` has no argument `{}`", over.value);
            let fault =
                Diagnostic::new(Code::UnknownArgument, over.span, message, "not an argument");
            return self.fault(fault.help("write `collect(x, over: axis)`"));
        }
        let value = self.expr(at, base);
        let Val::Artifact(id) = value else {
            if matches!(value, Val::Poison) {
                return value;
            }
            let message =
                format!("only what is computed is collected, found {}", self.describe(&value));
            return self.fault(Diagnostic::new(Code::Kind, base.span, message, "a description"));
        };
        let mut expr = self.spec.expr(id).clone();
        let Some(axis_id) =
            expr.axes.iter().copied().find(|axis| self.spec.axis(*axis).name == *name)
        else {
            let known = self.names(&expr.axes);
            let message = format!("this does not vary over `{name}`");
            let fault = Diagnostic::new(Code::UnknownAxis, axis.span, message, "no such axis");
            return self.fault(fault.maybe_help(suggest(name, known.iter().map(String::as_str))));
        };
        expr.collected.insert(axis_id);
        Val::Artifact(self.push(expr, span))
    }
}

fn any_part(lit: &Lit, wanted: &impl Fn(&str) -> bool) -> bool {
    match lit {
        Lit::Part(part) => {
            wanted(&part.name) || part.args.values().any(|arg| any_part(arg, wanted))
        }
        Lit::List(items) => items.iter().any(|item| any_part(item, wanted)),
        _ => false,
    }
}
