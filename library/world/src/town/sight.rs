//! What a car in a town can be shown.

use ivx_data::{Field, Kind};
use ivx_op::{Facts, Wrong};
use ivx_town::{
    Body, Command, Controls, Drive, Lidar, N_GOALS, N_STREETS, SIDE, Town, autopilot, command,
    picture, scan, streets,
};

use crate::env::Row;

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

    /// Shows it in a field of what is seen.
    ///
    /// - `reach`: metres that pictures reach to each side, and `cells` of one.
    pub(super) fn show(
        self,
        town: &Town,
        drive: &Drive,
        (reach, cells): (f64, usize),
        row: &mut Row<'_>,
        field: usize,
    ) {
        let pose = &drive.ego.pose;
        let cars = || -> Vec<Body> {
            drive.traffic.cars.iter().map(|car| Body::car(car.pose, [0.0, 0.0])).collect()
        };
        let put = |to: &mut [f32], from: &[f64]| {
            to.iter_mut().zip(from).for_each(|(to, x)| *to = single(*x));
        };
        match self {
            Self::Lidar => {
                let points = scan(&Lidar::default(), &town.relief, pose, &cars());
                pooled(&picture(&points, SPLIT), (bins(reach), cells), row.bytes(field));
            }
            Self::Velocity => {
                let speed = drive.ego.speed;
                let (sin, cos) = pose.pitch.sin_cos();
                put(row.numbers(field), &[speed * cos, 0.0, speed * sin]);
            }
            Self::Goals => put(row.numbers(field), drive.goals().as_flattened()),
            Self::Command => {
                let told = command(&town.network, &drive.route, drive.at);
                put(row.numbers(field), &COMMANDS.map(|own| f64::from(u8::from(own == told))));
            }
            Self::Streets => streets(town, pose, &cars(), (reach, cells), row.bytes(field)),
            Self::Expert => {
                let Controls { throttle, brake, steer } = autopilot(drive, 0.0, &mut || 0.0);
                put(row.numbers(field), &[throttle - brake, steer]);
            }
        }
    }
}

/// Height up to which points are on the ground, from the sensor.
const SPLIT: f32 = -2.45;

/// The most of each square of bins, of so many a side about the car.
fn pooled(whole: &[u8], (bins, cells): (usize, usize), seen: &mut [u8]) {
    let (first, pool) = ((SIDE - bins) / 2, bins / cells);
    seen.fill(0);
    for y in 0..bins {
        for x in 0..bins {
            for channel in 0..2 {
                let n = whole[((first + y) * SIDE + first + x) * 2 + channel];
                let cell = &mut seen[(channel * cells + y / pool) * cells + x / pool];
                *cell = (*cell).max(n);
            }
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "what is seen is of single precision")]
pub(super) fn single(x: f64) -> f32 {
    x as f32
}

/// The commands, in the order in which they are shown.
const COMMANDS: [Command; 4] = [Command::Follow, Command::Left, Command::Right, Command::Straight];

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
fn bins(reach: f64) -> usize {
    (2 * (reach * 2.0).round() as usize).min(SIDE) / 2 * 2
}
