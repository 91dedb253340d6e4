//! What was told some time before something happened (§3.3, Fig. 3.9).

use ivx_data::{Rollouts, told_by};
use ivx_math::moments::real;
use ivx_op::{Array, Ctx, Dim, Facts, Labels, MISSING, One, Op, OpError, Wrong, declare, record};

use super::windows::listed;

record! {
    /// What was told some time before each episode's end, and whether that was an accident.
    pub struct Scenes = "Scenes" {
        /// 1 of an episode in which it happened, 0 of one that ended well, and missing of any other.
        happened: Array [episode];
        /// What was told then, by what it is.
        told: Array [episode, told];
    }
}

declare! {
    /// A scene of each episode: what was told so many steps before something happened first, and where it did not, before the
    /// end that shows that it went well. Episodes of which neither is true, or that are shorter, have none.
    pub struct FindScenes = "scenes" @ 1 -> Scenes {
        /// The episodes, of a world that tells what happens.
        of: One<Rollouts>;
        /// What is to be foretold: what is told above 0 when it happens.
        event: String = "infraction";
        /// What is told above 0 where an episode ended well.
        well: String = "success";
        /// How many steps before; 80 are 4 seconds in a town.
        before: usize = 80, in 0.0..=1e9;
    }
    rule is_told;
}

fn is_told(facts: &Facts<'_>) -> Result<(), Wrong> {
    let Some(told) = facts.shapes("of").and_then(told_by) else { return Ok(()) };
    for arg in ["event", "well"] {
        let name: String = facts.arg(arg).unwrap_or_default();
        if !told.contains(&name) {
            let message = format!("the world tells no `{name}`");
            return Err(Wrong { arg, message, help: format!("it tells {}", listed(&told)) });
        }
    }
    Ok(())
}

impl Op for FindScenes {
    fn run(&self, _: &Ctx) -> Result<Scenes, OpError> {
        let (of, width) = (&*self.of, self.of.tells.len());
        let column = |name: &String| {
            let why = || format!("the world tells no `{name}`, but {}", listed(&of.tells));
            of.tells.iter().position(|told| told == name).ok_or_else(|| OpError::Failed(why()))
        };
        let (event, well) = (column(&self.event)?, column(&self.well)?);
        let (mut happened, mut told) = (Vec::new(), Vec::new());
        for (_, done, steps, _) in of.paths.each() {
            let row = |t: usize| &of.told[(done + t) * width..][..width];
            let first = |column: usize| (0..steps).find(|t| row(*t)[column] > 0.0);
            let end = first(event).map(|t| (1.0, t)).or_else(|| first(well).map(|t| (0.0, t)));
            let scene = end.and_then(|(it, t)| Some((it, t.checked_sub(self.before)?)));
            if let Some((it, t)) = scene {
                happened.push(it);
                told.extend(row(t).iter().map(|x| f64::from(*x)));
            } else {
                happened.push(MISSING);
                told.extend(std::iter::repeat_n(MISSING, width));
            }
        }
        let numbers = (0..happened.len()).map(real).collect();
        let episode = Dim::new("episode", Labels::Numbers(numbers));
        let by = Dim::new("told", Labels::Names(of.tells.clone()));
        Ok(Scenes {
            told: Array { dims: vec![episode.clone(), by], values: told },
            happened: Array::series(episode, happened),
        })
    }
}

#[cfg(test)]
mod tests {
    use ivx_data::{Actions, End, Trajectories};
    use ivx_op::is_missing;

    use super::*;

    /// An accident at step 3, a good end at step 4, one that is neither, and an accident too early.
    fn driven() -> Rollouts {
        let mut paths = Trajectories::new(Vec::new(), Actions::Discrete(vec!["go".to_owned()]));
        paths.episodes =
            vec![(4, End::Terminal), (5, End::Terminal), (3, End::Limit), (2, End::Terminal)];
        paths.seen.resize(18);
        paths.acts.resize(14);
        let mut all =
            Rollouts::new(paths, ["v", "infraction", "success"].map(str::to_owned).to_vec());
        all.rewards = vec![0.0; 14];
        let row = |v: f32, bad: bool, good: bool| {
            [v, f32::from(u8::from(bad)), f32::from(u8::from(good))]
        };
        let told: Vec<[f32; 3]> = [
            (0..4_u8).map(|t| row(f32::from(t), t == 3, false)).collect::<Vec<_>>(),
            (0..5_u8).map(|t| row(10.0 + f32::from(t), false, t == 4)).collect(),
            (0..3).map(|_| row(20.0, false, false)).collect(),
            (0..2).map(|t| row(30.0, t == 1, false)).collect(),
        ]
        .concat();
        all.told = told.concat();
        all
    }

    #[test]
    fn a_scene_is_so_many_steps_before_what_happened() {
        let op = |event: &str| FindScenes {
            of: One(driven()),
            event: event.to_owned(),
            well: "success".to_owned(),
            before: 2,
        };
        let found = op("infraction").run(&Ctx::new("scenes", 0, None)).unwrap();
        assert_eq!(found.happened.values[..2], [1.0, 0.0]);
        assert!(found.happened.values[2..].iter().all(|x| is_missing(*x)));
        assert_eq!((found.told.values[0], found.told.values[3]), (1.0, 12.0));
        let why = op("crash").run(&Ctx::new("scenes", 0, None)).unwrap_err().to_string();
        assert_eq!(why, "the world tells no `crash`, but `v`, `infraction`, `success`");
    }
}
