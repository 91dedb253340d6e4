//! Operations: ports, axes, dimensions, members and seeds.

use std::collections::BTreeSet;

use ivx_op::{
    AnyArtifact, ArgDecl, ArgKind, Array, Artifact, ByName, Decl, Dims, Gather, Lit, OutDecl, Port,
    Takes, Ty,
};

use super::Checker;
use super::expr::At;
use super::named::Named;
use super::value::Val;
use crate::ast::{self, ExprKind, ItemKind};
use crate::ir::{AxisId, Desc, Expr, ExprId, Feed, Op};
use crate::{Code, Diagnostic, Span};

/// Why a comparison is no number where nothing in it is computed.
const KNOWN_CONDITION: &str = "both sides of the comparison are known before anything runs, so that \
                               it is a Bool; of what is computed it would be 1 or 0 at each coordinate";

type Matched<'a> = [(&'a ArgDecl, Option<&'a ast::Expr>)];

/// What a port takes, before the axes it gathers are known.
pub(super) struct Fed<'a> {
    pub(super) port: Port,
    pub(super) name: &'a str,
    pub(super) exprs: Vec<(ExprId, Span, String)>,
}

/// The arguments of an operation.
#[derive(Default)]
struct Given<'a> {
    descs: ByName<Desc>,
    fed: Vec<Fed<'a>>,
    /// The axes that each axis argument names.
    named: Vec<(&'a ArgDecl, Vec<Named<'a>>)>,
    /// The new names that each argument gives to dimensions of the result.
    dims: Vec<(&'a ArgDecl, Vec<String>)>,
    /// The axis and the field that group.
    groups: Option<(Named<'a>, &'a str, Span)>,
    /// How many members the operation itself asks for.
    members: Option<Desc>,
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
        let Some(given) = self.given(&at.inside(decl.name), decl, args) else { return Val::Poison };
        let Given { mut descs, fed, named, dims, groups, members } = given;
        let Ok(members) = self.members_of(&descs, members.as_ref(), span) else {
            return Val::Poison;
        };
        if !self.known_axes(at, decl, &fed, &named) {
            return Val::Poison;
        }
        let taken: Vec<&str> =
            named.iter().flat_map(|(_, names)| names.iter().map(|named| named.name)).collect();
        let mut axes: BTreeSet<AxisId> =
            descs.values().flat_map(Desc::axes).chain(members).collect();
        let mut everything = axes.clone();
        let mut ports = Vec::new();
        // The axes that the first port of several gathers which the axis arguments name.
        let mut along: Option<Vec<AxisId>> = None;
        for feed in &fed {
            let mut feeds = Vec::new();
            for (id, feed_span, name) in &feed.exprs {
                let Some(gathered) = self.gathered(feed.port, *id, &taken, *feed_span) else {
                    return Val::Poison;
                };
                let gathered = beside(feed.port, gathered, &mut along);
                let own = self.program.expr(*id).axes.clone();
                everything.extend(&own);
                axes.extend(own.iter().filter(|axis| !gathered.contains(axis)));
                let labelled = feed.port.gather.is_labelled();
                // What is shown is called by its name; what computes does not know it.
                let shows = feed.port.gather == Gather::Everything;
                let name = if shows { name.clone() } else { String::new() };
                let mut feed = Feed { gathered, labelled, name, ..Feed::one(*id) };
                if let Some((axis, field, span)) = groups
                    && let Some(axis) = self.among(feed.gathered.iter().copied(), axis)
                {
                    let Some(found) = self.grouped(axis, field, span) else { return Val::Poison };
                    axes.insert(found.by);
                    everything.insert(found.by);
                    feed.groups = Some(found);
                }
                feeds.push(feed);
            }
            ports.push((feed.name.to_owned(), feeds));
        }
        let grouped = |feed: &Feed| feed.groups.is_some();
        if let Some((axis, _, span)) = groups
            && !ports.iter().any(|(_, feeds): &(String, Vec<Feed>)| feeds.iter().any(grouped))
        {
            let axis = axis.name;
            let message = format!("`{}` does not gather anything over `{axis}`", decl.name);
            let fault = Diagnostic::new(Code::UnknownAxis, span, message, "groups nothing");
            return self
                .fault(fault.help(format!("only what vanishes is grouped: `over: {axis}`")));
        }
        let stochastic = decl.stochastic || descs.values().any(|desc| self.draws(desc));
        if let (true, Some(seed)) = (stochastic, self.names.seed()) {
            axes.insert(seed);
            everything.insert(seed);
        }
        if !self.distinct(&everything, span) {
            return Val::Poison;
        }
        let reduces = fed.iter().any(|feed| feed.port.gather == Gather::Named);
        for (arg, names) in &named {
            let names = names.iter().map(|named| self.travelling(&fed, &ports, named.name));
            let mut names: Vec<String> = names.collect();
            if reduces {
                names.sort_unstable();
                names.dedup();
            }
            let names = Lit::List(names.into_iter().map(Lit::Text).collect());
            descs.insert(arg.name.to_owned(), Desc::Lit(names));
        }
        for (arg, names) in &dims {
            let names = Lit::List(names.iter().cloned().map(Lit::Text).collect());
            descs.insert(arg.name.to_owned(), Desc::Lit(names));
        }
        let Ok(shapes) = self.go_together((at, decl, span), args, &descs, &ports) else {
            return Val::Poison;
        };
        let dims = self.dims(out.dims, &fed, &taken, &dims);
        if !self.apart(&axes, &dims, span) {
            return Val::Poison;
        }
        let op = Op { name: decl.name.to_owned(), args: descs, ports, stochastic };
        let expr = Expr {
            address: at.address.clone(),
            axes,
            collected: BTreeSet::new(),
            artifact: out.artifact.to_owned(),
            dims,
            kind: crate::ir::ExprKind::Op(op),
        };
        let id = self.push(expr, span);
        self.shapes.note(id, shapes);
        if !matches!(out.dims, Dims::Fixed(_) | Dims::Named(_)) {
            self.inherit_labels(id, fed.iter().flat_map(|feed| &feed.exprs).map(|(id, ..)| *id));
        }
        Val::Artifact(id)
    }

    /// The arguments of an operation, each for itself.
    fn given(&mut self, at: &At, decl: &'a Decl, args: &Matched<'a>) -> Option<Given<'a>> {
        let mut all = Given::default();
        let mut sound = true;
        for (arg, given) in args {
            match (&arg.kind, given) {
                (ArgKind::Groups, None) => {}
                (ArgKind::Groups, Some(expr)) => {
                    all.groups = self.group_name(at, decl, arg, expr);
                    sound &= all.groups.is_some();
                }
                (ArgKind::Port(port), Some(expr)) => {
                    let fed = all.fed.first().map_or(&[][..], |first| &first.exprs);
                    let exprs = match self.own_number(at, *port, expr, fed) {
                        Some(name) => self.is_alone(decl, arg, name, &all.named, expr.span),
                        None => self.fed(at, decl, arg, *port, expr),
                    };
                    sound &= exprs.is_some();
                    let exprs = exprs.unwrap_or_default();
                    all.fed.push(Fed { port: *port, name: arg.name, exprs });
                }
                (ArgKind::Port(port), None) => {
                    all.fed.push(Fed { port: *port, name: arg.name, exprs: Vec::new() });
                }
                (ArgKind::Axes | ArgKind::NumericAxis, given) => {
                    let names = self.axis_names(at, decl, arg, *given);
                    sound &= names.is_some();
                    all.named.push((*arg, names.unwrap_or_default()));
                }
                (ArgKind::Dims, given) => {
                    let names = self.new_dims(at, decl, arg, *given);
                    sound &= names.is_some();
                    all.dims.push((*arg, names.unwrap_or_default()));
                }
                (kind, given) => match self.literal_arg(at, decl, arg, *given) {
                    Some(desc) if *kind == ArgKind::Members => all.members = Some(desc),
                    Some(desc) => drop(all.descs.insert(arg.name.to_owned(), desc)),
                    None => sound = false,
                },
            }
        }
        sound.then_some(all)
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
        let items = self.values_given(decl, arg, port, expr)?;
        let mut fed = Vec::new();
        let mut sound = true;
        for item in items {
            let value = self.expr(at, item);
            let id = self.accepted(at, decl, arg, port, value, item.span);
            sound &= id.is_some();
            fed.extend(id.map(|id| (id, item.span, self.spoken(at, item))));
        }
        sound.then_some(fed)
    }

    /// The values that are written for a port: those of a list where it takes many.
    pub(super) fn values_given(
        &mut self,
        decl: &Decl,
        arg: &ArgDecl,
        port: Port,
        expr: &'a ast::Expr,
    ) -> Option<&'a [ast::Expr]> {
        match (&expr.kind, port.takes) {
            (ExprKind::List(items), Takes::Many) => Some(items),
            (ExprKind::List(items), Takes::AtMostOne) => {
                let n = items.len();
                let message =
                    format!("`{}.{}` takes one {port}, found a list of {n}", decl.name, arg.name);
                let fault = Diagnostic::new(Code::Type, expr.span, message, "a list");
                self.fault(fault.help(match n {
                    0 => format!("leave `{}` out where there is none", arg.name),
                    1 => "write it without brackets".to_owned(),
                    _ => "choose one of them".to_owned(),
                }));
                None
            }
            _ => Some(std::slice::from_ref(expr)),
        }
    }

    /// The expression that a port takes.
    pub(super) fn accepted(
        &mut self,
        at: &At,
        decl: &Decl,
        arg: &ArgDecl,
        port: Port,
        value: Val,
        span: Span,
    ) -> Option<ExprId> {
        let any = port.artifact == AnyArtifact::KIND;
        let number = (any || port.artifact == Array::KIND)
            && matches!(&value, Val::Desc(_, ty) if super::expr::is_number(ty));
        match value {
            Val::Poison => None,
            Val::Artifact(id) if any || self.program.expr(id).artifact == port.artifact => Some(id),
            value if number => self.array(at, value, span),
            other => {
                let found = self.program.describe(&other);
                let message = format!("`{}.{}` takes {port}, found {found}", decl.name, arg.name);
                let fault = Diagnostic::new(Code::Type, span, message, format!("expected {port}"));
                let help = match other {
                    Val::Desc(_, Ty::Bool) if port.artifact == Array::KIND => {
                        Some(KNOWN_CONDITION.to_owned())
                    }
                    _ => self.library.made_by(port.artifact),
                };
                self.fault(fault.maybe_help(help));
                None
            }
        }
    }

    /// The name under which a value travels to figures and tables, which show it: that of the item that it is or is
    /// a part of.
    fn spoken(&mut self, at: &At, expr: &ast::Expr) -> String {
        match &expr.kind {
            ExprKind::Select { base, .. } => self.spoken(at, base),
            // What a reduction leaves of a value is called as that is.
            ExprKind::Call { name, args }
                if self.library.reduces(super::maths::meant(&name.value, args)) =>
            {
                match &args[..] {
                    [(_, first), ..] => self.spoken(at, first),
                    [] => String::new(),
                }
            }
            _ => match self.item_of(at, expr).map(|(_, item)| &item.kind) {
                Some(
                    ItemKind::Let { name, .. }
                    | ItemKind::Measure { name, .. }
                    | ItemKind::Published { name, .. },
                ) => name.value.clone(),
                _ => String::new(),
            },
        }
    }

    /// The field that groups, as `task.scene`: the axis, the field and where.
    fn group_name(
        &mut self,
        at: &At,
        decl: &Decl,
        arg: &ArgDecl,
        expr: &'a ast::Expr,
    ) -> Option<(Named<'a>, &'a str, Span)> {
        let field = match &expr.kind {
            ExprKind::List(items) if items.len() == 1 => &items[0].kind,
            kind => kind,
        };
        if let ExprKind::Field { base, name } = field
            && let Some(axis) = self.axis_name(at, base)
        {
            return Some((axis, &name.value, expr.span));
        }
        let message = format!("`{}.{}` takes the field of an axis", decl.name, arg.name);
        let fault = Diagnostic::new(Code::UnknownAxis, expr.span, message, "not a field");
        self.fault(fault.help("write `by: axis.field`"));
        None
    }

    fn axis_names(
        &mut self,
        at: &At,
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
            let Some(name) = self.axis_name(at, item) else {
                let message =
                    format!("`{}.{}` takes the name of an axis or dimension", decl.name, arg.name);
                let fault = Diagnostic::new(Code::UnknownAxis, item.span, message, "not a name");
                let help = match &item.kind {
                    ExprKind::Str(name) => Some(format!("write it without quotes: `{name}`")),
                    ExprKind::Record(_) => Some("several are a list: `[seed, n]`".to_owned()),
                    _ => Some(format!("write `{}: seed`, or what varies there", arg.name)),
                };
                self.fault(fault.maybe_help(help));
                return None;
            };
            names.push(name);
        }
        if arg.kind == ArgKind::NumericAxis && names.len() != 1 {
            let message =
                format!("`{}.{}` takes one axis, found {}", decl.name, arg.name, names.len());
            self.fault(Diagnostic::new(Code::UnknownAxis, expr.span, message, "expected one"));
            return None;
        }
        Some(names)
    }

    fn dims(
        &self,
        dims: Dims,
        fed: &[Fed<'_>],
        taken: &[&str],
        new: &[(&ArgDecl, Vec<String>)],
    ) -> Vec<String> {
        let of_port = |port: &str| {
            let fed = fed.iter().find(|feed| feed.name == port);
            fed.and_then(|feed| feed.exprs.first())
                .map(|(id, ..)| self.program.expr(*id).dims.clone())
                .unwrap_or_default()
        };
        match dims {
            Dims::Fixed(dims) => dims.iter().map(ToString::to_string).collect(),
            Dims::Named(arg) => {
                let named = new.iter().find(|(own, _)| own.name == arg);
                named.map(|(_, names)| names.clone()).unwrap_or_default()
            }
            Dims::Union { add } => {
                let mut all: Vec<String> = Vec::new();
                for feed in fed {
                    all.extend(
                        of_port(feed.name)
                            .into_iter()
                            .filter(|dim| !all.contains(dim) && !taken.contains(&dim.as_str()))
                            .collect::<Vec<_>>(),
                    );
                }
                all.extend(add.iter().map(ToString::to_string));
                all
            }
            Dims::Reduced { port, add } => {
                let kept = of_port(port).into_iter().filter(|dim| !taken.contains(&dim.as_str()));
                kept.chain(add.iter().map(ToString::to_string)).collect()
            }
        }
    }
}

/// The axes that a port gathers: where they are named, those that the first such port gathers, `along`, too. What is
/// seen beside something else has a place wherever that has one.
fn beside(port: Port, gathered: Vec<AxisId>, along: &mut Option<Vec<AxisId>>) -> Vec<AxisId> {
    match along {
        _ if port.gather != Gather::Named => gathered,
        None => along.insert(gathered).clone(),
        Some(along) if gathered.iter().all(|axis| along.contains(axis)) => along.clone(),
        Some(_) => gathered,
    }
}
