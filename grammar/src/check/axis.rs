//! Axes: their coordinates, evaluated before anything runs.

use std::collections::BTreeSet;

use ivx_op::{Lit, Part, Role, Ty};

use super::Checker;
use super::scope::name_of;
use super::value::{Val, is_record, join, record};
use crate::ast::{AxisExpr, Expr, ExprKind, Name};
use crate::ir::{Axis, AxisId, AxisRole, Coord, Desc, widen};
use crate::{Code, Diagnostic, Span, Spanned};

/// The name of the axis whose value reaches every stochastic operation.
pub(super) const SEED: &str = "seed";
/// The name of the axis that the members of an ensemble make.
pub(super) const MEMBER: &str = "member";

/// The family of what lists the coordinates of axes.
pub(super) const ROWS: &str = "Rows";

impl<'a> Checker<'a> {
    /// The axis that an item declares; `None` if it is faulty.
    pub(super) fn axis(
        &mut self,
        scope: usize,
        (name, fields): (&'a Name, &'a [Name]),
        values: &'a AxisExpr,
    ) -> Option<AxisId> {
        let known = self.axes.declared(scope, &name.value);
        if known.is_some() || self.axes.is_faulty(scope, &name.value) {
            return known;
        }
        let coords = self.coords(scope, (name, fields), values);
        let id = coords.map(|coords| {
            let role = if name.value == SEED { AxisRole::Seed } else { AxisRole::Plain };
            self.program.push_axis(Axis { name: name.value.clone(), role, coords })
        });
        self.axes.declare(scope, &name.value, id);
        id
    }

    /// Seeds where it is not known which there are.
    pub(super) fn any_seed(&mut self) -> AxisId {
        let coord = Coord { label: "0".to_owned(), value: Lit::Int(0) };
        let axis = Axis { name: SEED.to_owned(), role: AxisRole::Seed, coords: vec![coord] };
        let id = self.program.push_axis(axis);
        self.axes.set_any_seed(id);
        id
    }

    /// Whether there is no such axis only because of a fault that was reported.
    pub(super) fn lost_axis(&self, name: &str) -> bool {
        let Some(scope) = self.names.experiment() else { return false };
        match self.scopes.find(scope, name) {
            Some((declared, item)) => {
                name_of(item).is_some_and(|own| self.axes.is_faulty(declared, &own.value))
            }
            None => self.scopes.lost(scope, name),
        }
    }

    /// The axis of an ensemble with so many members; `None` if they are too many.
    pub(super) fn member_axis(&mut self, n: i64, span: Span) -> Option<AxisId> {
        if let Some(known) = self.axes.of_members(n) {
            return Some(known);
        }
        if !self.bounds(0, n, span) {
            return None;
        }
        let coords = (0..n).map(|i| Coord { label: i.to_string(), value: Lit::Int(i) }).collect();
        let id = self.program.push_axis(Axis {
            name: MEMBER.to_owned(),
            role: AxisRole::Member,
            coords,
        });
        self.axes.set_of_members(n, id);
        Some(id)
    }

    /// The axis that an item declares, as the experiment at hand has it: with its own seeds.
    pub(super) fn declared_axis(
        &mut self,
        scope: usize,
        (name, fields): (&'a Name, &'a [Name]),
        values: &'a AxisExpr,
    ) -> Option<AxisId> {
        match self.names.seed() {
            Some(seed) if name.value == SEED => Some(seed),
            _ => self.axis(scope, (name, fields), values),
        }
    }

    fn coords(
        &mut self,
        scope: usize,
        (name, fields): (&'a Name, &'a [Name]),
        values: &'a AxisExpr,
    ) -> Option<Vec<Coord>> {
        let coords = match values {
            AxisExpr::Range(low, high) => {
                let coords = self.range(scope, low, high)?;
                self.fieldless((name, fields), low.span.to(high.span))?;
                coords
            }
            AxisExpr::Labelled(entries, _) => self.labelled(scope, fields, entries)?,
            AxisExpr::List(Expr { kind: ExprKind::List(items), .. })
                if !fields.is_empty() && items.iter().any(is_row) =>
            {
                self.unlabelled(scope, fields, items)?
            }
            AxisExpr::List(list) => {
                let Val::Desc(Desc::Lit(lit), ty) = self.known_before(scope, list) else {
                    return None;
                };
                match lit {
                    Lit::List(items) => {
                        self.fielded((name, fields), &items, list.span)?;
                        items
                            .into_iter()
                            .map(|value| Coord { label: label(&value), value })
                            .collect()
                    }
                    Lit::Part(part) if ty == Ty::Part(ROWS.to_owned()) => {
                        self.rows(&part, fields, list.span)?
                    }
                    _ => {
                        let message = format!("axis `{}` needs a list, found {ty}", name.value);
                        let fault = Diagnostic::new(Code::Axis, list.span, message, "not a list");
                        let help = match lit {
                            Lit::Int(n) if n > 0 => format!(
                                "write `0..{n}` for 0 to {}, or `[{n}]` for one value",
                                n - 1
                            ),
                            _ => "write `[a, b]`, `a..b` or `{ \"label\": value, ... }`".to_owned(),
                        };
                        self.fault(fault.help(help));
                        return None;
                    }
                }
            }
        };
        let mut labels = BTreeSet::new();
        if let Some(again) = coords.iter().find(|coord| !labels.insert(&coord.label)) {
            let message = format!("axis `{}` has `{}` twice", name.value, again.label);
            self.fault(Diagnostic::new(Code::Axis, name.span, message, "labels must differ"));
            return None;
        }
        if coords.is_empty() {
            let message = format!("axis `{}` has no coordinates", name.value);
            self.fault(Diagnostic::new(Code::Axis, name.span, message, "nothing to vary over"));
            return None;
        }
        if let (SEED, Some(odd)) =
            (name.value.as_str(), coords.iter().find(|c| !matches!(c.value, Lit::Int(_))))
        {
            let message = format!("seeds are whole numbers, found {}", odd.value);
            self.fault(Diagnostic::new(Code::Axis, name.span, message, "not a whole number"));
            return None;
        }
        let mut seeds = BTreeSet::new();
        let again = |coord: &&Coord| match &coord.value {
            Lit::Int(seed) => !seeds.insert(*seed),
            _ => false,
        };
        if let (SEED, Some(again)) = (name.value.as_str(), coords.iter().find(again)) {
            let message = format!("axis `{SEED}` has the value {} twice", again.value);
            let label = "the same numbers would pass for others";
            self.fault(Diagnostic::new(Code::Axis, name.span, message, label));
            return None;
        }
        Some(coords)
    }

    fn range(&mut self, scope: usize, low: &'a Expr, high: &'a Expr) -> Option<Vec<Coord>> {
        let mut bound = |expr: &'a Expr| -> Option<i64> {
            match self.known_before(scope, expr) {
                Val::Desc(Desc::Lit(Lit::Int(n)), _) => Some(n),
                Val::Poison => None,
                _ => {
                    let message = "the bounds of a range are whole numbers";
                    self.fault(Diagnostic::new(
                        Code::Axis,
                        expr.span,
                        message,
                        "not a whole number",
                    ));
                    None
                }
            }
        };
        let (low_n, high_n) = (bound(low)?, bound(high)?);
        if !self.bounds(low_n, high_n, low.span.to(high.span)) {
            return None;
        }
        Some((low_n..high_n).map(|i| Coord { label: i.to_string(), value: Lit::Int(i) }).collect())
    }

    /// Whether an axis can have the whole numbers from `low` to `high`; reports it if not.
    fn bounds(&mut self, low: i64, high: i64, span: Span) -> bool {
        let n = usize::try_from(high.saturating_sub(low).max(0)).unwrap_or(usize::MAX);
        if n > self.budget.max_nodes() {
            self.too_many(format!("the axis has {n} coordinates"), span);
            return false;
        }
        self.room(n, span)
    }

    /// Whether an axis of what is no record has no fields; reports it if it does.
    fn fieldless(&mut self, (name, fields): (&Name, &[Name]), span: Span) -> Option<()> {
        let [first, ..] = fields else { return Some(()) };
        let message = format!("axis `{}` has fields, but its coordinates have none", name.value);
        let fault = Diagnostic::new(Code::Axis, span, message, "no records");
        let fault = fault.also(first.span, "the fields");
        self.fault(fault.help("write `{ \"label\": (value, value), ... }`"));
        None
    }

    /// Whether listed coordinates have the fields of their axis; reports it if not.
    fn fielded(&mut self, axis: (&Name, &[Name]), items: &[Lit], span: Span) -> Option<()> {
        let (_, fields) = axis;
        if fields.is_empty() || items.iter().all(|item| has_fields(item, fields)) {
            return Some(());
        }
        match items.iter().find(|item| matches!(item, Lit::Part(part) if part.name.is_empty())) {
            None => self.fieldless(axis, span),
            Some(odd) => {
                let found = self.library.type_of(odd).to_string();
                self.not_these(fields, &found, span);
                None
            }
        }
    }

    /// Records in a list, which are their own labels.
    fn unlabelled(
        &mut self,
        scope: usize,
        fields: &'a [Name],
        items: &'a [Expr],
    ) -> Option<Vec<Coord>> {
        let values = items.iter().map(|item| (self.row(scope, fields, item), item.span));
        let values: Vec<_> = values.collect();
        let values = self.alike(values)?.into_iter();
        Some(values.map(|value| Coord { label: label(&value), value }).collect())
    }

    fn labelled(
        &mut self,
        scope: usize,
        fields: &'a [Name],
        entries: &'a [(Spanned<String>, Expr)],
    ) -> Option<Vec<Coord>> {
        let values = entries.iter().map(|(_, expr)| {
            let value = if fields.is_empty() {
                self.known_before(scope, expr)
            } else {
                self.row(scope, fields, expr)
            };
            (value, expr.span)
        });
        let values: Vec<_> = values.collect();
        let coords = entries.iter().zip(self.alike(values)?);
        let coords = coords.map(|((label, _), value)| Coord { label: label.value.clone(), value });
        Some(coords.collect())
    }

    /// The values of coordinates, of one type.
    fn alike(&mut self, values: Vec<(Val, Span)>) -> Option<Vec<Lit>> {
        let typed = values.into_iter().map(|(value, span)| match value {
            Val::Desc(Desc::Lit(lit), ty) => Some((lit, ty, span)),
            _ => None,
        });
        let typed: Vec<(Lit, Ty, Span)> = typed.collect::<Option<_>>()?;
        let mut joined = typed.first()?.1.clone();
        for (_, ty, span) in &typed {
            let Some(both) = join(&joined, ty) else {
                let message =
                    format!("the values of an axis are of one type: {joined} before, {ty} here");
                self.fault(Diagnostic::new(
                    Code::Type,
                    *span,
                    message,
                    format!("expected {joined}"),
                ));
                return None;
            };
            joined = both;
        }
        Some(typed.into_iter().map(|(value, ..)| widen(value, &joined)).collect())
    }

    /// The record of one coordinate: `("Hills", hills(0))` or `(scene: "Hills", env: hills(0))`.
    fn row(&mut self, scope: usize, fields: &'a [Name], expr: &'a Expr) -> Val {
        let names: Vec<&str> = fields.iter().map(|field| field.value.as_str()).collect();
        let (found, span) = match &expr.kind {
            ExprKind::Record(items) if items.iter().all(|(name, _)| name.is_none()) => {
                let values = items.iter().map(|(_, item)| self.known_before(scope, item));
                let values: Vec<Val> = values.collect();
                if values.iter().any(|value| matches!(value, Val::Poison)) {
                    return Val::Poison;
                }
                if values.len() == names.len() {
                    return record(names.iter().map(ToString::to_string).zip(values));
                }
                (format!("{} values", values.len()), expr.span)
            }
            _ => match self.known_before(scope, expr) {
                Val::Desc(desc, Ty::Record(own))
                    if own.len() == names.len()
                        && names.iter().all(|name| own.contains_key(*name)) =>
                {
                    return Val::Desc(desc, Ty::Record(own));
                }
                Val::Poison => return Val::Poison,
                value if names.len() == 1 && !is_record(&value) => {
                    return record([(names[0].to_owned(), value)].into_iter());
                }
                value => (self.program.describe(&value), expr.span),
            },
        };
        self.not_these(fields, &found, span)
    }

    fn not_these(&mut self, fields: &[Name], found: &str, span: Span) -> Val {
        let names: Vec<&str> = fields.iter().map(|field| field.value.as_str()).collect();
        let message = format!("a coordinate of this axis is ({}), found {found}", names.join(", "));
        self.fault(Diagnostic::new(Code::Axis, span, message, "not these fields"))
    }

    /// The coordinates that the library lists, with the names that the axis gives to their fields.
    fn rows(&mut self, part: &Part, fields: &[Name], span: Span) -> Option<Vec<Coord>> {
        let decl = self.library.registry().decl(&part.name)?;
        let Role::Rows(own) = &decl.role else { return None };
        if !fields.is_empty() && fields.len() != own.len() {
            let listed: Vec<&str> = own.iter().map(|(name, _)| *name).collect();
            let message = format!("`{}` lists ({})", part.name, listed.join(", "));
            let label = format!("{} fields", own.len());
            let fault = Diagnostic::new(Code::Axis, span, message, label);
            self.fault(fault.also(fields[0].span, format!("{} here", fields.len())));
            return None;
        }
        let name = |i: usize| fields.get(i).map_or(own[i].0, |field| field.value.as_str());
        let rows = self.library.registry().list(part)?;
        let rows = match rows {
            Ok(rows) => rows,
            Err(error) => {
                let message = format!("`{}` {error}", part.name);
                self.fault(Diagnostic::new(Code::Axis, span, message, "cannot be listed"));
                return None;
            }
        };
        let coords = rows.into_iter().map(|(label, values)| {
            let values = values.iter().map(|value| self.library.registry().complete_lit(value));
            let args = values.enumerate().map(|(i, value)| (name(i).to_owned(), value));
            Coord { label, value: Lit::Part(Part { name: String::new(), args: args.collect() }) }
        });
        Some(coords.collect())
    }

    /// What stands for an axis in expressions: its value at each coordinate.
    pub(super) fn axis_value(&self, id: AxisId) -> Val {
        let mut types =
            self.program.axis(id).coords.iter().map(|coord| self.library.type_of(&coord.value));
        let first = types.next().expect("axes have coordinates");
        // The lists of the first may be empty.
        Val::Desc(Desc::Axis(id), types.fold(first, |ty, other| join(&ty, &other).unwrap_or(ty)))
    }
}

/// Whether a coordinate is written as a record, with names or without.
fn is_row(item: &Expr) -> bool {
    matches!(item.kind, ExprKind::Record(_))
}

/// Whether a value is a record of these fields.
fn has_fields(value: &Lit, fields: &[Name]) -> bool {
    let Lit::Part(part) = value else { return false };
    part.name.is_empty()
        && part.args.len() == fields.len()
        && fields.iter().all(|field| part.args.contains_key(&field.value))
}

/// What a coordinate is called that has no label of its own.
pub(super) fn label(value: &Lit) -> String {
    if let Lit::Text(text) = value { text.clone() } else { value.to_string() }
}
