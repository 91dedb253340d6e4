//! What was seen and done, episode after episode.

use ivx_op::{Data, Shapes, Tensors};
use serde::{Deserialize, Serialize};

use crate::{Actions, Columns, End, Field, Kind, Misfit};

/// Episodes of somebody in a world, without what they paid.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectories {
    /// What could be done.
    pub does: Actions,
    /// What was seen: of an episode of `T` steps `T + 1` rows.
    pub seen: Columns,
    /// What was done: of an episode of `T` steps `T` rows.
    pub acts: Columns,
    /// How many steps each episode has, and whether it is over.
    pub episodes: Vec<(usize, End)>,
}

/// What is stored of them besides arrays.
#[derive(Serialize, Deserialize)]
pub(crate) struct Facts {
    does: Actions,
    sees: Vec<Field>,
}

impl Trajectories {
    /// None yet.
    #[must_use]
    pub fn new(sees: Vec<Field>, does: Actions) -> Self {
        let acts = Columns::zeros(vec![does.field()], 0);
        Self { seen: Columns::zeros(sees, 0), acts, does, episodes: Vec::new() }
    }

    /// How many steps there are in all.
    #[must_use]
    pub fn n_steps(&self) -> usize {
        self.acts.len()
    }

    /// Adds all of others of the same kind.
    ///
    /// # Panics
    /// If their fields are others.
    pub fn append(&mut self, others: &Self) {
        self.seen.append(&others.seen);
        self.acts.append(&others.acts);
        self.episodes.extend(&others.episodes);
    }

    /// Of each episode: its first row among what was seen, its first among what was done, its steps and its end.
    pub fn each(&self) -> impl Iterator<Item = (usize, usize, usize, End)> {
        let mut at = (0, 0);
        self.episodes.iter().map(move |&(steps, end)| {
            let (seen, done) = at;
            at = (seen + steps + 1, done + steps);
            (seen, done, steps, end)
        })
    }

    pub(crate) fn facts(&self) -> Facts {
        Facts { does: self.does.clone(), sees: self.seen.fields().to_vec() }
    }

    /// Puts the arrays among others.
    #[expect(clippy::cast_precision_loss, reason = "steps are far below 2^53")]
    pub(crate) fn store(&self, to: &mut Tensors) {
        self.seen.store("seen.", to);
        self.acts.store("", to);
        let n = self.episodes.len();
        let steps = self.episodes.iter().map(|(steps, _)| *steps as f64).collect();
        let ends = self.episodes.iter().map(|(_, end)| *end as u8).collect();
        to.arrays.insert("steps".to_owned(), Data::F64(vec![n], steps));
        to.arrays.insert("ends".to_owned(), Data::U8(vec![n], ends));
    }

    /// Takes them back; `None` if that is something else.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it was a count")]
    pub(crate) fn take(from: &mut Tensors, facts: Facts) -> Option<Self> {
        let ((_, steps), (_, ends)) = (from.f64("steps")?, from.u8("ends")?);
        let ends = ends.into_iter().map(|end| match end {
            0 => Some(End::No),
            1 => Some(End::Terminal),
            2 => Some(End::Limit),
            _ => None,
        });
        let ends: Vec<End> = ends.collect::<Option<_>>()?;
        if ends.len() != steps.len() || steps.iter().any(|n| !(0.0..1e15).contains(n)) {
            return None;
        }
        let episodes: Vec<_> = steps.into_iter().map(|n| n as usize).zip(ends).collect();
        let n = episodes.iter().try_fold(0_usize, |n, (steps, _)| n.checked_add(*steps))?;
        let acts = vec![facts.does.field()];
        Some(Self {
            seen: Columns::take("seen.", from, facts.sees, n.checked_add(episodes.len())?)?,
            acts: Columns::take("", from, acts, n)?,
            does: facts.does,
            episodes,
        })
    }

    /// None yet, of such shapes; `None` if they say nothing of worlds.
    #[must_use]
    pub fn later(shapes: &Shapes) -> Option<Self> {
        let (sees, does) = shown_by(shapes)?;
        Some(Self::new(sees, does))
    }
}

/// `grid [4, 10, 10] with 6 actions`.
fn world_told(sees: &[Field], does: &Actions) -> String {
    let fields: Vec<String> = sees.iter().map(|f| format!("{} {:?}", f.name, f.shape)).collect();
    format!("{} with {}", fields.join(" and "), does.told())
}

/// What is known of such a world before anything is computed: of each field what kind it is, how many there are of an
/// index, and its shape; and how many actions there are, or 0 and how many numbers one has.
#[must_use]
pub fn world_shapes(sees: &[Field], does: &Actions) -> Shapes {
    let mut shapes = Shapes::new();
    for (i, field) in sees.iter().enumerate() {
        let (kind, n) = match field.kind {
            Kind::F32 => (0, 0),
            Kind::U8 => (1, 0),
            Kind::Bit => (2, 0),
            Kind::Index(n) => (3, n),
        };
        let shape = [&[kind, n], &field.shape[..]].concat();
        shapes.insert(format!("sees.{i:03}.{}", field.name), shape);
    }
    let n = match does {
        Actions::Discrete(names) => vec![names.len()],
        Actions::Continuous { low, .. } => vec![0, low.len()],
    };
    shapes.insert("does".to_owned(), n);
    shapes
}

/// Adds what such a world tells of each step besides, by name.
pub fn tell(shapes: &mut Shapes, tells: &[String]) {
    shapes.insert("told".to_owned(), vec![tells.len()]);
    shapes.extend(tells.iter().map(|name| (format!("tells.{name}"), Vec::new())));
}

/// What a world of which that is known tells besides, by name and ordered so; `None` if that is not known.
#[must_use]
pub fn told_by(shapes: &Shapes) -> Option<Vec<String>> {
    shapes.get("told")?;
    Some(shapes.keys().filter_map(|name| name.strip_prefix("tells.")).map(str::to_owned).collect())
}

/// The world of which that is known; what its actions are called, and what bounds them, is not.
#[must_use]
pub fn shown_by(shapes: &Shapes) -> Option<(Vec<Field>, Actions)> {
    let mut sees = Vec::new();
    for (name, shape) in shapes {
        let Some(name) = name.strip_prefix("sees.") else { continue };
        let [kind, n, shape @ ..] = &shape[..] else { return None };
        let kind = [Kind::F32, Kind::U8, Kind::Bit, Kind::Index(*n)].get(*kind).copied()?;
        sees.push(Field::new(name.split_once('.')?.1, shape, kind));
    }
    let does = match shapes.get("does")?[..] {
        [n] => Actions::Discrete((0..n).map(|i| i.to_string()).collect()),
        [0, width] => Actions::Continuous {
            low: vec![f32::NEG_INFINITY; width],
            high: vec![f32::INFINITY; width],
        },
        _ => return None,
    };
    Some((sees, does))
}

/// Whether who knows one world knows another: it shows and takes the same. The words say who it is.
///
/// # Errors
/// If not.
pub fn same_world(
    who: &str,
    (sees, does): (&[Field], &Actions),
    other: (&[Field], &Actions),
) -> Result<(), Misfit> {
    if sees == other.0 && does.told() == other.1.told() {
        return Ok(());
    }
    let (own, other) = (world_told(sees, does), world_told(other.0, other.1));
    let message = format!("{who} {own}, and this world has {other}");
    Err(Misfit::new(message, "choose a world that shows and takes the same"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Act, Values};

    /// Two episodes of 2 and 0 steps, with bits, bytes, a number and an index.
    pub(crate) fn paths() -> Trajectories {
        let sees = vec![
            Field::new("bits", &[3, 3], Kind::Bit),
            Field::new("grid", &[2], Kind::U8),
            Field::new("speed", &[], Kind::F32),
            Field::new("cell", &[], Kind::Index(300)),
        ];
        let mut paths = Trajectories::new(sees, Actions::named(&["left", "right"]));
        paths.seen.resize(4);
        if let (Values::U8(bits), _) = paths.seen.values_mut(0) {
            bits.iter_mut().enumerate().for_each(|(i, bit)| *bit = u8::from(i % 5 == 0));
        }
        if let (Values::U8(grid), _) = paths.seen.values_mut(1) {
            grid.copy_from_slice(&[1, 2, 3, 200, 5, 6, 7, 8]);
        }
        if let (Values::F32(speed), _) = paths.seen.values_mut(2) {
            speed.copy_from_slice(&[0.5, -1.5, f32::MIN, 9.0]);
        }
        if let (Values::Index(cell), _) = paths.seen.values_mut(3) {
            cell.copy_from_slice(&[299, 0, 7, 256]);
        }
        Act::Index(1).append(&mut paths.acts);
        Act::Index(0).append(&mut paths.acts);
        paths.episodes = vec![(2, End::Terminal), (0, End::Limit)];
        paths
    }

    fn back(paths: &Trajectories, facts: Facts) -> Option<Trajectories> {
        let mut tensors = Tensors::default();
        paths.store(&mut tensors);
        Trajectories::take(&mut tensors, facts)
    }

    #[test]
    fn they_survive_the_round_trip_and_what_is_unsound_does_not() {
        let paths = paths();
        assert_eq!(back(&paths, paths.facts()), Some(paths.clone()));
        assert_eq!(
            paths.each().map(|(seen, done, ..)| (seen, done)).collect::<Vec<_>>(),
            [(0, 0), (3, 2)]
        );
        let unsound = |change: &dyn Fn(&mut Trajectories)| {
            let mut other = paths.clone();
            change(&mut other);
            assert_eq!(back(&other, paths.facts()), None);
        };
        unsound(&|paths| paths.episodes[0].0 = 3);
        unsound(&|paths| paths.episodes[0].0 = usize::MAX);
        unsound(&|paths| paths.seen.resize(5));
        unsound(&|paths| Act::Index(0).append(&mut paths.acts));
        unsound(&|paths| {
            let (Values::Index(cell), _) = paths.seen.values_mut(3) else { panic!("an index") };
            cell[0] = 300;
        });
        let fewer = Facts { does: Actions::named(&["left"]), ..paths.facts() };
        assert_eq!(back(&paths, fewer), None);
    }

    #[test]
    fn a_world_is_known_by_its_shapes() {
        let paths = paths();
        let later = Trajectories::later(&world_shapes(paths.seen.fields(), &paths.does)).unwrap();
        let both = |paths: &Trajectories| (paths.seen.fields().to_vec(), paths.does.clone());
        let ((sees, does), (own, _)) = (both(&later), both(&paths));
        same_world("it knows", (&sees, &does), (&own, &paths.does)).unwrap();
        let arm = Actions::Continuous { low: vec![-1.0; 2], high: vec![1.0; 2] };
        let (_, known) = shown_by(&world_shapes(&own, &arm)).unwrap();
        let why = same_world("it knows", (&sees, &does), (&sees, &known)).unwrap_err().message;
        assert!(why.ends_with("with actions of 2 numbers"), "{why}");
    }
}
