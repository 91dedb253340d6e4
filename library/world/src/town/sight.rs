//! What a car in a town can be shown.

use ivx_data::{Field, Kind};
use ivx_op::{Facts, Wrong};
use ivx_town::{Command, N_GOALS, N_STREETS, SIDE};

/// What a car can be shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sight {
    Lidar,
    Velocity,
    Goals,
    Command,
    Streets,
    Expert,
}

const SIGHTS: [(&str, Sight); 6] = [
    ("lidar", Sight::Lidar),
    ("velocity", Sight::Velocity),
    ("goals", Sight::Goals),
    ("command", Sight::Command),
    ("streets", Sight::Streets),
    ("expert", Sight::Expert),
];

impl Sight {
    fn named(name: &str) -> Option<Self> {
        SIGHTS.iter().find(|(own, _)| *own == name).map(|(_, sight)| *sight)
    }

    pub(super) fn field(self, cells: usize) -> Field {
        let (name, _) = SIGHTS.iter().find(|(_, sight)| *sight == self).expect("all have a name");
        match self {
            Self::Lidar => Field::new(name, &[2, cells, cells], Kind::U8),
            Self::Velocity => Field::new(name, &[3], Kind::F32),
            Self::Goals => Field::new(name, &[N_GOALS, 2], Kind::F32),
            Self::Command => Field::new(name, &[COMMANDS.len()], Kind::F32),
            Self::Streets => Field::new(name, &[N_STREETS, cells, cells], Kind::U8),
            Self::Expert => Field::new(name, &[2], Kind::F32),
        }
    }
}

/// The commands, in the order in which they are shown.
pub(super) const COMMANDS: [Command; 4] =
    [Command::Follow, Command::Left, Command::Right, Command::Straight];

/// Those of some names.
pub(super) fn sights(shows: &[String]) -> Vec<Sight> {
    shows.iter().filter_map(|name| Sight::named(name)).collect()
}

/// The rule that what is shown can be, and fills its cells.
pub(super) fn is_seen(facts: &Facts<'_>) -> Result<(), Wrong> {
    let wrong =
        |arg: &'static str, message: String, help: String| Err(Wrong { arg, message, help });
    let shows: Vec<String> = facts.arg("shows").unwrap_or_default();
    let names = SIGHTS.map(|(name, _)| name).join(", ");
    if shows.is_empty() {
        return wrong("shows", "nothing is seen".to_owned(), format!("there are {names}"));
    }
    for (i, name) in shows.iter().enumerate() {
        if Sight::named(name).is_none() {
            let message = format!("a town does not show `{name}`");
            return wrong("shows", message, format!("there are {names}"));
        }
        if shows[..i].contains(name) {
            let message = format!("`{name}` is shown twice");
            return wrong("shows", message, "name it once".to_owned());
        }
    }
    let (Some(reach), Some(cells)) = (facts.arg::<f64>("reach"), facts.arg::<usize>("cells"))
    else {
        return Ok(());
    };
    let whole = bins(reach).is_multiple_of(cells.max(1));
    if shows.iter().any(|name| name == "lidar") && !whole {
        let n = bins(reach);
        let all: Vec<String> = (1..=n)
            .filter(|cells| n.is_multiple_of(*cells))
            .map(|cells| cells.to_string())
            .collect();
        let message = format!("the {n} bins of points within {reach} m do not fill {cells} cells");
        return wrong("cells", message, format!("use one of {}", all.join(", ")));
    }
    Ok(())
}

/// How many bins of half a metre a side of a picture of points has: an even number about the car.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 50 m")]
pub(super) fn bins(reach: f64) -> usize {
    (2 * (reach * 2.0).round() as usize).min(SIDE) / 2 * 2
}
