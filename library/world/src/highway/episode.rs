//! Traffic as a world: an agent acts in it, sees its nearest cars, and is told what they saw and did.

use ivx_data::{Act, End, Field, Kind, Misfit, Picture};

use super::choices::Choices;
use super::drawn::{Window, picture};
use super::lane::Point;
use super::release::Release;
use super::seen::Sight;
use super::traffic::Traffic;
use crate::env::{Row, Spec, World};
use crate::luck::Luck;

/// Frames a second.
pub(super) const RATE: u64 = 15;

/// What makes a world of traffic: who is there, and what it pays.
pub(super) trait Scene: Send {
    /// What it tells besides of every step, by name.
    const TELLS: &'static [&'static str];

    /// How far apart are things that drivers do: the standard deviations of their angles and of their accelerations.
    const SPREAD: [f64; 2];

    /// Puts cars on the roads, that of the agent first, and says how each other drives: by a number of its style.
    fn begin(&mut self, traffic: &mut Traffic, luck: &mut Luck) -> Vec<usize>;

    /// What a step pays after which traffic is this, and whether the episode is over; and what is told of it.
    fn pays(&mut self, traffic: &Traffic, act: usize, tells: &mut [f32]) -> (f64, bool);

    /// What a picture shows where the agent is at this place.
    fn window(&self, traffic: &Traffic, agent: Point) -> Window;
}

/// How a world of traffic is stepped and seen.
#[derive(Clone, Debug)]
pub(super) struct Terms {
    pub(super) release: &'static Release,
    pub(super) choices: Choices,
    pub(super) sight: Sight,
    /// For how many frames an action is held.
    pub(super) frames: u64,
    /// After how many steps an episode is too long.
    pub(super) limit: u64,
}

impl Terms {
    /// What is seen and told of a scene.
    pub(super) fn spec<S: Scene>(&self) -> Spec {
        let n_others = self.sight.others;
        let shape = [n_others + 1, 4];
        let mut tells: Vec<String> = S::TELLS.iter().map(|name| (*name).to_owned()).collect();
        for other in 1..=n_others {
            tells.extend(OF_OTHERS.map(|what| format!("{other}.{what}")));
            tells.extend((0..4 * (n_others + 1)).map(|i| format!("{other}.saw.{i}")));
            tells.extend(self.tells_acts().then(|| format!("{other}.act")));
        }
        Spec {
            sees: vec![Field::new("cars", &shape, Kind::F32)],
            does: self.choices.actions(),
            tells,
            limit: Some(self.limit),
        }
    }

    /// Whether what others do comes near to something that the agent can do.
    fn tells_acts(&self) -> bool {
        self.choices != Choices::Meta
    }

    /// How many numbers are told of each of the nearest cars.
    fn told_of_each(&self) -> usize {
        OF_OTHERS.len() + 4 * (self.sight.others + 1) + usize::from(self.tells_acts())
    }
}

/// What is told of each of the nearest cars, before what it saw and which action of the agent comes nearest to what it
/// did: its number in the episode, from 1, how it drives, and what it did. All are 0 where there is none.
pub(super) const OF_OTHERS: [&str; 4] = ["car", "style", "steering", "acceleration"];

/// An episode of a scene.
pub(super) struct Episode<S: Scene> {
    pub(super) terms: Terms,
    pub(super) scene: S,
    pub(super) traffic: Traffic,
    /// How the cars drive.
    styles: Vec<usize>,
    /// The cars that the agent sees.
    near: Vec<usize>,
    n_steps: u64,
}

impl<S: Scene> Episode<S> {
    pub(super) fn new(terms: Terms, scene: S, traffic: Traffic) -> Self {
        Self { terms, scene, traffic, styles: Vec::new(), near: Vec::new(), n_steps: 0 }
    }

    fn show(&mut self, row: &mut Row<'_>) {
        let sight = &self.terms.sight;
        self.near = sight.others(&self.traffic, 0);
        let (shown, _) = row.numbers(0).as_chunks_mut::<4>();
        for (to, from) in shown.iter_mut().zip(sight.rows(&self.traffic, 0, &self.near)) {
            *to = from.map(single);
        }
    }

    /// Writes what the nearest cars see and who they are, before they act.
    fn tell_before(&self, told: &mut [f32]) {
        let sight = &self.terms.sight;
        let of_others = told[S::TELLS.len()..].chunks_exact_mut(self.terms.told_of_each());
        for (to, &j) in of_others.zip(&self.near) {
            #[expect(clippy::cast_precision_loss, reason = "a few cars")]
            let who = [j as f32, self.styles[j] as f32];
            to[..2].copy_from_slice(&who);
            let (saw, _) = to[OF_OTHERS.len()..].as_chunks_mut::<4>();
            let near = sight.others(&self.traffic, j);
            for (to, from) in saw.iter_mut().zip(sight.rows(&self.traffic, j, &near)) {
                *to = from.map(single);
            }
        }
    }

    /// Writes what they did then.
    fn tell_commands(&self, told: &mut [f32]) {
        let width = self.terms.told_of_each();
        for (to, &j) in told[S::TELLS.len()..].chunks_exact_mut(width).zip(&self.near) {
            let car = &self.traffic.vehicles[j];
            let did = [car.steering, car.acceleration];
            to[2..4].copy_from_slice(&did.map(single));
            if let Some(act) = self.terms.choices.nearest(did, S::SPREAD) {
                #[expect(clippy::cast_precision_loss, reason = "a few actions")]
                let act = act as f32;
                to[width - 1] = act;
            }
        }
    }
}

impl<S: Scene> World for Episode<S> {
    fn reset(&mut self, luck: &mut Luck, row: &mut Row<'_>) {
        self.n_steps = 0;
        self.traffic.vehicles.clear();
        self.styles = self.scene.begin(&mut self.traffic, luck);
        self.show(row);
        row.told().fill(0.0);
    }

    fn step(&mut self, act: Act<'_>, _: &mut Luck, row: &mut Row<'_>) -> (f64, End) {
        let told = row.told();
        told.fill(0.0);
        self.tell_before(told);
        self.terms.choices.take(act.index(), &mut self.traffic);
        for frame in 0..self.terms.frames {
            self.traffic.frame();
            if frame == 0 {
                self.tell_commands(told);
            }
        }
        self.n_steps += 1;
        let (pays, over) = self.scene.pays(&self.traffic, act.index(), &mut told[..S::TELLS.len()]);
        let late = self.terms.release.ends_in_time && self.n_steps >= self.terms.limit;
        self.show(row);
        (pays, if over || late { End::Terminal } else { End::No })
    }

    fn draw(&self) -> Option<Picture> {
        let agent = self.traffic.vehicles.first()?;
        Some(picture(&self.traffic, self.scene.window(&self.traffic, agent.at)))
    }
}

#[expect(clippy::cast_possible_truncation, reason = "what is seen has single precision")]
pub(super) fn single(number: f64) -> f32 {
    number as f32
}

/// The release of a version's name.
pub(super) fn release(version: &str) -> Result<&'static Release, Misfit> {
    let message = || format!("highway-env {version} is not replayed");
    Release::of(version).ok_or_else(|| Misfit::new(message(), "say `\"1.1\"` or `\"1.12.1\"`"))
}

#[cfg(test)]
mod tests {
    use ivx_data::{Columns, Outline, Values};

    use super::*;
    use crate::env::Env;
    use crate::{Highway, Roundabout};

    fn on_highway(task: &str, release: &str) -> Highway {
        let (task, release) = (task.to_owned(), release.to_owned());
        Highway { task, actions: None, cars: 12, lanes: 4, lane: 3, frames: 3, seconds: 8, release }
    }

    fn on_roundabout(task: &str, release: &str) -> Roundabout {
        let (task, release) = (task.to_owned(), release.to_owned());
        Roundabout { task, exit: 3, actions: None, frames: 3, seconds: 8, release }
    }

    /// What is seen, told and paid over an episode in which one action is taken always.
    fn episode(
        world: &mut dyn World,
        spec: &Spec,
        act: usize,
        seed: u32,
    ) -> Vec<(Vec<f32>, Vec<f32>, f64, End)> {
        let mut seen = Columns::zeros(spec.sees.clone(), 1);
        let (mut luck, mut told) = (Luck::numpy(seed), vec![7.0; spec.tells.len()]);
        world.reset(&mut luck, &mut Row::of(&mut seen, 0, &mut told));
        let mut all: Vec<(Vec<f32>, Vec<f32>, f64, End)> = Vec::new();
        let numbers = |seen: &Columns| {
            let Values::F32(numbers) = seen.values(0) else { panic!("numbers") };
            numbers.clone()
        };
        all.push((numbers(&seen), told.clone(), 0.0, End::No));
        while all.last().is_some_and(|step| step.3 == End::No) && all.len() <= 40 {
            let (pays, end) =
                world.step(Act::Index(act), &mut luck, &mut Row::of(&mut seen, 0, &mut told));
            all.push((numbers(&seen), told.clone(), pays, end));
        }
        all
    }

    #[test]
    fn worlds_start_afresh() {
        let envs: [&dyn Env; 5] = [
            &on_highway("single", "1.1"),
            &on_highway("multi", "1.12.1"),
            &on_highway("original", "1.1"),
            &on_roundabout("exit", "1.1"),
            &on_roundabout("original", "1.12.1"),
        ];
        for env in envs {
            let spec = env.spec().unwrap();
            let mut world = env.open().unwrap();
            let first = episode(&mut *world, &spec, 1, 5);
            assert!(first[0].1.iter().all(|told| *told == 0.0));
            assert_ne!(episode(&mut *world, &spec, 3, 6), first);
            assert_eq!(episode(&mut *world, &spec, 1, 5), first);
        }
    }

    /// The agent is where its window has it: 20 m from the left on a highway, and at (2, 45) about the roundabout.
    #[test]
    fn pictures_are_taken_about_the_agent() {
        let first = |env: &dyn Env, acts: usize| {
            let spec = env.spec().unwrap();
            let mut world = env.open().unwrap();
            assert!(env.is_drawn() && world.draw().is_none());
            let mut seen = Columns::zeros(spec.sees.clone(), 1);
            let (mut luck, mut told) = (Luck::numpy(1), vec![0.0; spec.tells.len()]);
            world.reset(&mut luck, &mut Row::of(&mut seen, 0, &mut told));
            for _ in 0..acts {
                world.step(Act::Index(2), &mut luck, &mut Row::of(&mut seen, 0, &mut told));
            }
            let picture = world.draw().unwrap();
            let Outline::Polygon(car) = &picture.shapes.last().unwrap().outline else {
                panic!("a car")
            };
            let middle = [0, 1].map(|d| car.iter().map(|corner| corner[d]).sum::<f64>() / 4.0);
            (picture.size, middle)
        };
        for acts in [0, 3] {
            let (size, [x, y]) = first(&on_highway("multi", "1.1"), acts);
            assert_eq!(size, [100.0, 20.0]);
            assert!((x - 20.0).abs() < 1e-9 && (3.0..17.0).contains(&y), "{x} {y}");
        }
        let (size, [x, y]) = first(&on_roundabout("exit", "1.1"), 0);
        assert_eq!(size, [120.0; 2]);
        assert!((x - 62.0).abs() < 1e-9 && (y - 105.0).abs() < 1e-9, "{x} {y}");
        // It is kept within 50 m of the middle of what is shown.
        let scene = on_roundabout("exit", "1.1");
        let traffic = Traffic::new(super::super::roads::roundabout(), Release::of("1.1").unwrap());
        let window = |at| scene.terms().unwrap().1.window(&traffic, at);
        assert_eq!(window([0.0, 80.0]), Window { low: [-60.0, -30.0], size: [120.0; 2] });
    }

    /// In the release of 2021 an episode is over in time; in the later one it is cut off by who counts.
    #[test]
    fn time_ends_an_episode_or_cuts_it_off() {
        for (release, end) in [("1.1", End::Terminal), ("1.12.1", End::No)] {
            let env = Highway { cars: 0, ..on_highway("adversarial", release) };
            let spec = env.spec().unwrap();
            assert_eq!(spec.limit, Some(40));
            // Nearly straight on.
            let steps = episode(&mut *env.open().unwrap(), &spec, 4, 1);
            assert_eq!((steps.len(), steps[40].3), (41, end));
            // A second is an action of the original.
            assert_eq!(on_highway("original", release).spec().unwrap().limit, Some(8));
        }
    }

    /// Who is nearest is told with what it saw and did.
    #[test]
    fn the_nearest_are_told() {
        let env = on_highway("multi", "1.1");
        let spec = env.spec().unwrap();
        assert_eq!(spec.tells.len(), 4 + 5 * (4 + 24 + 1));
        let place = |name: &str| spec.tells.iter().position(|tell| tell == name).unwrap();
        let [car, style, steering, saw, act] =
            ["1.car", "1.style", "1.steering", "1.saw.0", "1.act"].map(place);
        let steps = episode(&mut *env.open().unwrap(), &spec, 4, 2);
        let (mut steered, mut acts) = (false, std::collections::BTreeSet::new());
        for (before, after) in steps.iter().zip(&steps[1..]) {
            let ((seen, ..), (_, told, ..)) = (before, after);
            if told[car] == 0.0 {
                continue;
            }
            assert!(told[car] <= 12.0 && told[style] < 5.0);
            // Its place across is the agent's and how far it is from there, and so is its speed.
            let of = |i: usize| (seen[i] + seen[4 + i] - told[saw + i]).abs() < 1e-6;
            assert!(of(1) && of(2) && of(3), "{seen:?} {told:?}");
            steered |= told[4..].chunks_exact(29).any(|other| other[2].abs() > 0.05);
            assert!(told[steering + 1].abs() <= 6.0);
            assert!(told[act] < 9.0 && (told[act] != 0.0 || told[steering + 1] < -2.0));
            acts.extend(told[4..].chunks_exact(29).map(|other| other[28].to_bits()));
        }
        assert!(steered && acts.len() > 3);
        // Of a pilot's words there is none that a driver follows.
        let spec = on_highway("original", "1.1").spec().unwrap();
        assert_eq!(spec.tells.len(), 4 + 5 * (4 + 24));
    }

    #[test]
    fn what_there_is_not_is_refused() {
        assert!(on_highway("double", "1.1").spec().is_err());
        assert!(on_highway("multi", "1.2").open().is_err());
        assert!(on_roundabout("entry", "1.1").spec().is_err());
    }
}
