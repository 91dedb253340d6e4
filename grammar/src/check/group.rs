//! Groups of coordinates: `by: task.scene`.

use std::collections::BTreeMap;

use ivx_op::Lit;

use super::Checker;
use super::axis::{SEED, label};
use crate::ir::{Axis, AxisId, AxisRole, Coord, Groups};
use crate::{Code, Diagnostic, Span, suggest};

impl Checker<'_> {
    /// The axis whose coordinates are the groups that the values of a field make of another.
    pub(super) fn grouped(&mut self, axis: AxisId, field: &str, span: Span) -> Option<Groups> {
        if let Some(known) = self.axes.groups(axis, field) {
            return Some(known.clone());
        }
        let own = self.program.axis(axis);
        let values: Option<Vec<Lit>> =
            own.coords.iter().map(|coord| coord.value.field(field).cloned()).collect();
        let Some(values) = values else {
            let fields = match &own.coords[0].value {
                Lit::Part(part) if part.name.is_empty() => part.args.keys().cloned().collect(),
                _ => Vec::new(),
            };
            let message = format!("axis `{}` has no field `{field}`", own.name);
            let fault = Diagnostic::new(Code::UnknownName, span, message, "no such field");
            self.fault(fault.maybe_help(suggest(field, fields.iter().map(String::as_str))));
            return None;
        };
        if values.iter().any(|value| matches!(value, Lit::List(_) | Lit::Part(_))) {
            let message = format!("`{}.{field}` is neither text nor a number", own.name);
            self.fault(Diagnostic::new(Code::Kind, span, message, "cannot name groups"));
            return None;
        }
        if field == SEED {
            let message = format!("the groups of `{}.{field}` are no replications", own.name);
            let fault = Diagnostic::new(Code::Axis, span, message, "would pass for the seed axis");
            self.fault(fault.help("give the field another name, such as `run`"));
            return None;
        }
        let mut coords: Vec<Coord> = Vec::new();
        let mut places: Vec<Vec<usize>> = Vec::new();
        let mut groups: BTreeMap<String, usize> = BTreeMap::new();
        for (place, value) in values.into_iter().enumerate() {
            let label = label(&value);
            let group = *groups.entry(label.clone()).or_insert(coords.len());
            if group == coords.len() {
                coords.push(Coord { label, value });
                places.push(Vec::new());
            }
            places[group].push(place);
        }
        let by =
            self.program.push_axis(Axis { name: field.to_owned(), role: AxisRole::Plain, coords });
        let groups = Groups { axis, by, places };
        self.axes.set_groups(field, groups.clone());
        Some(groups)
    }
}
