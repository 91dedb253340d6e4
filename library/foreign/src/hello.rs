//! What a program says of its world before anything is done in it.

use std::collections::BTreeSet;

use ivx_data::{Field, Kind};
use ivx_world::{Actions, Spec};
use serde::Deserialize;

/// Most bytes of it.
pub(crate) const MOST_SAID: usize = 1 << 20;
/// Most fields, and most numbers in a row of them.
const MOST_FIELDS: usize = 256;
const MOST_NUMBERS: usize = 1 << 24;
/// Most actions to choose from, or numbers in one.
const MOST_ACTIONS: usize = 1 << 16;

/// Either why there is no world, or what it is.
#[derive(Deserialize)]
#[serde(untagged)]
enum Said {
    Refused { refused: String },
    World { sees: Vec<Seen>, actions: Done, limit: Option<u64> },
}

#[derive(Deserialize)]
struct Seen {
    name: String,
    shape: Vec<usize>,
    kind: String,
    n: usize,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Done {
    Discrete { discrete: usize },
    Continuous { low: Vec<f32>, high: Vec<f32> },
}

/// What the world shows and takes.
///
/// # Errors
/// Why there is none, or that it is none which could be shown here.
pub(crate) fn spec(said: &str) -> Result<Spec, String> {
    let said = serde_json::from_str(said).map_err(|error| {
        let start: String = said.chars().take(80).collect();
        format!("said what is no description of a world ({error}): {start:?}")
    })?;
    let (sees, does, limit) = match said {
        Said::Refused { refused } => return Err(refused),
        Said::World { sees, actions, limit } => (sees, actions, limit),
    };
    if sees.is_empty() || sees.len() > MOST_FIELDS {
        return Err(format!("shows {} fields, not 1 to {MOST_FIELDS}", sees.len()));
    }
    let names: BTreeSet<&str> = sees.iter().map(|field| &*field.name).collect();
    if names.len() < sees.len() {
        return Err("shows two fields of one name".to_owned());
    }
    let sees = sees.iter().map(field).collect::<Result<Vec<_>, _>>()?;
    if sees.iter().map(Field::spread).sum::<usize>() > MOST_NUMBERS {
        return Err(format!("shows more than {MOST_NUMBERS} numbers at once"));
    }
    if limit == Some(0) {
        return Err("has episodes without steps".to_owned());
    }
    Ok(Spec { sees, does: does.actions()?, tells: Vec::new(), limit })
}

fn field(seen: &Seen) -> Result<Field, String> {
    let wrong = |what: &str| Err(format!("shows `{}`, which {what}", seen.name));
    let kind = match &*seen.kind {
        "f32" => Kind::F32,
        "u8" => Kind::U8,
        "bit" => Kind::Bit,
        "index" if (1..=MOST_NUMBERS).contains(&seen.n) => Kind::Index(seen.n),
        _ => return wrong(&format!("is one of {} {}", seen.n, seen.kind)),
    };
    let width = seen.shape.iter().try_fold(1_usize, |width, n| width.checked_mul(*n));
    match width {
        Some(1..=MOST_NUMBERS) => Ok(Field::new(&seen.name, &seen.shape, kind)),
        _ => wrong(&format!("has the shape {:?}", seen.shape)),
    }
}

impl Done {
    fn actions(self) -> Result<Actions, String> {
        match self {
            Self::Discrete { discrete: n @ 1..=MOST_ACTIONS } => {
                Ok(Actions::Discrete((0..n).map(|i| i.to_string()).collect()))
            }
            Self::Discrete { discrete: n } => Err(format!("has {n} actions")),
            Self::Continuous { low, high } => {
                let bounded =
                    |(low, high): (&f32, &f32)| low.is_finite() && high.is_finite() && low <= high;
                let alike = low.len() == high.len() && (1..=MOST_ACTIONS).contains(&low.len());
                if !alike || !low.iter().zip(&high).all(bounded) {
                    return Err("has actions without bounds".to_owned());
                }
                Ok(Actions::Continuous { low, high })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_world_is_what_is_said_of_it() {
        let said = r#"{"sees": [{"name": "a", "shape": [2, 3], "kind": "u8", "n": 0},
            {"name": "b", "shape": [], "kind": "index", "n": 7}],
            "actions": {"low": [-1.0, 0.0], "high": [1.0, 0.5]}, "limit": 200, "more": 1}"#;
        let expected = Spec {
            sees: vec![Field::new("a", &[2, 3], Kind::U8), Field::new("b", &[], Kind::Index(7))],
            does: Actions::Continuous { low: vec![-1.0, 0.0], high: vec![1.0, 0.5] },
            tells: Vec::new(),
            limit: Some(200),
        };
        assert_eq!(spec(said), Ok(expected));
    }

    #[test]
    fn what_is_no_world_is_refused() {
        let check = |said: &str, part: &str| {
            let why = spec(said).unwrap_err();
            assert!(why.contains(part), "{said}: {why}");
        };
        let world = |sees: &str, actions: &str| {
            format!(r#"{{"sees": [{sees}], "actions": {actions}, "limit": null}}"#)
        };
        let field = |shape: &str, kind: &str, n: u64| {
            format!(r#"{{"name": "a", "shape": {shape}, "kind": "{kind}", "n": {n}}}"#)
        };
        let two = r#"{"discrete": 2}"#;
        check(r#"{"refused": "no such world"}"#, "no such world");
        check("Traceback", "no description of a world");
        check(&world("", two), "0 fields");
        check(&world(&field("[4]", "f64", 0), two), "0 f64");
        check(&world(&field("[0]", "f32", 0), two), "shape [0]");
        check(&world(&field("[4294967296, 4294967296]", "u8", 0), two), "shape");
        check(&world(&field("[]", "index", 1 << 60), two), "one of");
        let many = field("[]", "index", 1 << 24);
        check(&world(&[&*many, &many.replace("\"a\"", "\"b\"")].join(","), two), "numbers");
        check(&world(&[&*many, &many].join(","), two), "one name");
        let seen = field("[4]", "f32", 0);
        check(&world(&seen, r#"{"discrete": 0}"#), "0 actions");
        check(&world(&seen, r#"{"low": [0.0], "high": []}"#), "bounds");
        check(&world(&seen, r#"{"low": [1e300], "high": [1e301]}"#), "bounds");
        check(&world(&seen, r#"{"low": [1.0], "high": [0.0]}"#), "bounds");
    }
}
