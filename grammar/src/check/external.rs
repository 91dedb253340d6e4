//! Arguments that name something outside the spec, and words.

use ivx_op::{ArgDecl, Decl, ExternalKind, Lit, Ty};

use super::Checker;
use super::expr::At;
use super::value::{Fit, Val, fit};
use crate::ast::{self, ExprKind};
use crate::external::{known_as, names};
use crate::ir::{AxisId, Desc, Place};
use crate::{Code, Diagnostic, Span};

impl<'a> Checker<'a> {
    /// What is given to an argument. A list of words holds texts and numbers side by side.
    pub(super) fn given_to(&mut self, at: &At, ty: &Ty, expr: &'a ast::Expr) -> Val {
        match (ty, &expr.kind) {
            (Ty::List(item), ExprKind::List(items)) if **item == Ty::Word => {
                self.words(at, items, expr.span)
            }
            _ => self.expr(at, expr),
        }
    }

    fn words(&mut self, at: &At, items: &'a [ast::Expr], span: Span) -> Val {
        let mut descs = Vec::new();
        for item in items {
            match self.expr(at, item) {
                Val::Poison => return Val::Poison,
                Val::Desc(desc, found) if fit(&Ty::Word, &found) != Fit::No => descs.push(desc),
                other => {
                    let found = self.program.describe(&other);
                    let message = format!("a word is text or a number, found {found}");
                    let fault = Diagnostic::new(Code::Type, item.span, message, "no word");
                    let help = matches!(other, Val::Artifact(_)).then(|| {
                        "what is computed reaches a program as a file: `as_file(..)`".to_owned()
                    });
                    return self.fault(fault.maybe_help(help));
                }
            }
        }
        self.bounded(Desc::List(descs), Ty::List(Box::new(Ty::Word)), span)
    }

    /// The description with what its names stand for outside the spec; `None` where one is not
    /// found, which is reported.
    pub(super) fn found(
        &mut self,
        decl: &Decl,
        arg: &ArgDecl,
        kind: ExternalKind,
        desc: &Desc,
        expr: &ast::Expr,
    ) -> Option<Desc> {
        let span = expr.span;
        let file = self.source.file(span);
        let written = names(expr);
        let find = |name: &str| {
            let written = written.iter().find(|written| written.value == name)?;
            file.externals.get(&known_as(kind, written))
        };
        let (mut faults, mut foreign) = (Vec::new(), false);
        let mut changed = desc.change(&mut |desc| match (desc, coordinates_of(desc)) {
            (Desc::Lit(lit), _) => Some(Desc::Lit(look_up(lit, &mut |name| {
                match find(name) {
                    Some(Ok(found)) => return Some(Lit::External(found.clone())),
                    Some(Err(fault)) => faults.push(fault.clone()),
                    None => foreign = true,
                }
                None
            }))),
            (_, Some(axis)) if kind != ExternalKind::Foreign => {
                // Names of coordinates are written where the axis is declared.
                let found = self.axes.declared_in(self.axes.whole(axis));
                let file = found.map(|scope| &self.source.files()[self.scopes.file_of(scope)]);
                let mut find = |name: &str| {
                    match file.and_then(|file| file.externals.get(&(kind, name.to_owned()))) {
                        Some(Ok(found)) => return Some(Lit::External(found.clone())),
                        Some(Err(fault)) => faults.push(fault.clone()),
                        None => foreign = true,
                    }
                    None
                };
                let places = 0..self.program.axis(axis).coords.len();
                let arms = places.map(|place| {
                    let at = Place::from([(axis, place)]);
                    let lit = desc.eval(self.program.axes(), &at).expect("it computes nothing");
                    Desc::Lit(look_up(&lit, &mut find))
                });
                Some(Desc::Match(axis, arms.collect()))
            }
            (Desc::Axis(_) | Desc::Field(..), _) => {
                foreign = true;
                None
            }
            _ => None,
        });
        faults.sort_by_key(|fault: &Diagnostic| fault.labels.first().map(|label| label.span.start));
        faults.dedup();
        if foreign {
            let message =
                format!("`{}.{}` is named where it is used, in quotes", decl.name, arg.name);
            let fault = Diagnostic::new(Code::NotLiteral, span, message, "named elsewhere");
            faults.push(fault.help(
                "write the name here, or in the coordinates of an axis; `match` chooses among several",
            ));
        }
        changed = super::value::fold(changed);
        let sound = faults.is_empty();
        for fault in faults {
            self.faults.add(fault);
        }
        sound.then_some(changed)
    }
}

/// The axis whose coordinates, or a field of which, a description is.
fn coordinates_of(desc: &Desc) -> Option<AxisId> {
    match desc {
        Desc::Axis(axis) => Some(*axis),
        Desc::Field(record, _) => coordinates_of(record),
        _ => None,
    }
}

/// The description with what `find` knows of the names in it.
fn look_up(lit: &Lit, find: &mut impl FnMut(&str) -> Option<Lit>) -> Lit {
    match lit {
        Lit::Text(name) => find(name).unwrap_or_else(|| lit.clone()),
        Lit::List(items) => Lit::List(items.iter().map(|item| look_up(item, find)).collect()),
        other => other.clone(),
    }
}
