//! Worlds of Gymnasium itself, where `IVX_PYTHON` names a Python that has it.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use ivx_data::{Field, Kind, Values};
use ivx_foreign::{Gymnasium, look_up};
use ivx_op::{Ctx, Fields, Foreign, How, Part};
use ivx_world::{Actions, End, Env as _, Lanes, Luck};
use serde_json::{Value, json};

/// What Gymnasium does by itself: seeds and actions of one episode after the other, as JSON on standard input.
const PLAIN: &str = r#"
import json, sys
import gymnasium, numpy as np
asked = json.load(sys.stdin)
world = gymnasium.make(asked["name"], **asked["kwargs"])
for episode in asked["episodes"]:
    observation, _ = world.reset(seed=episode["seed"])
    said = [[np.asarray(observation).tolist(), 0.0, 0]]
    for action in episode["actions"]:
        action = action if isinstance(action, int) else np.array(action, world.action_space.dtype)
        observation, reward, terminal, cut, _ = world.step(action)
        said.append([np.asarray(observation).tolist(), float(reward), 1 if terminal else 2 if cut else 0])
    print(json.dumps(said))
"#;

const CTX: Ctx = Ctx::new("learn", 5, None);
const LANES: usize = 3;

fn python() -> Option<PathBuf> {
    let python = std::env::var_os("IVX_PYTHON").map(PathBuf::from);
    if python.is_none() {
        eprintln!("without IVX_PYTHON, a Python that has gymnasium, nothing is tried here");
    }
    python
}

fn world(name: &str, kwargs: Part) -> Option<Gymnasium> {
    let python = python()?;
    let found = look_up(&python, name, &kwargs.args, 60.0);
    Some(Gymnasium {
        name: Foreign(found.unwrap_or_else(|why| panic!("{name}: {why}"))),
        kwargs: Fields(kwargs.args),
        python: How("python3".to_owned()),
        time_limit: How(60.0),
    })
}

/// What one lane saw in its episodes: seeds, actions, and observations, rewards and ends.
#[derive(Default)]
struct Episode {
    seed: u32,
    actions: Vec<Value>,
    said: Vec<(Vec<f32>, f64, u8)>,
}

fn row(values: &Values, width: usize, lane: usize) -> Vec<f32> {
    let at = lane * width..(lane + 1) * width;
    match values {
        Values::F32(values) => values[at].to_vec(),
        Values::U8(values) => values[at].iter().map(|x| f32::from(*x)).collect(),
        Values::Index(values) => {
            values[at].iter().map(|x| f32::from(u16::try_from(*x).expect("few"))).collect()
        }
    }
}

/// Some steps of every lane, with actions drawn evenly.
fn walk(world: &Gymnasium, steps: usize) -> Vec<Episode> {
    let spec = world.spec().expect("a world");
    let width = spec.sees[0].width();
    let mut lanes = Lanes::open(world, LANES, &CTX, ("learn", 0)).expect("worlds");
    let mut draws = Luck::numpy(1);
    let begin = |lane: usize, episode: u64, lanes: &Lanes<'_>| Episode {
        seed: Luck::of(&CTX, "learn", lane as u64, episode).bits() >> 1,
        actions: Vec::new(),
        said: vec![(row(lanes.seen().values(0), width, lane), 0.0, 0)],
    };
    let mut open: Vec<(u64, Episode)> = (0..LANES).map(|i| (0, begin(i, 0, &lanes))).collect();
    let mut all = Vec::new();
    for _ in 0..steps {
        let acts = lanes.choose().1;
        match &spec.does {
            Actions::Discrete(names) => {
                let n = u32::try_from(names.len()).expect("few");
                acts.places.iter_mut().for_each(|place| *place = draws.below(n) as usize);
                let places = acts.places.iter().zip(&mut open);
                places.for_each(|(place, (_, episode))| episode.actions.push(json!(place)));
            }
            Actions::Continuous { low, high } => {
                for (i, x) in acts.vectors.iter_mut().enumerate() {
                    let at = i % low.len();
                    #[expect(clippy::cast_possible_truncation, reason = "actions are single")]
                    let drawn = draws.between(low[at].into(), high[at].into()) as f32;
                    *x = drawn;
                }
                let vectors = acts.vectors.chunks(low.len()).zip(&mut open);
                vectors.for_each(|(vector, (_, episode))| episode.actions.push(json!(vector)));
            }
        }
        let step = lanes.step().expect("they go on");
        let mut ended = Vec::new();
        for (lane, (_, episode)) in open.iter_mut().enumerate() {
            let end = match step.ends[lane] {
                End::No => 0,
                End::Terminal => 1,
                End::Limit => 2,
            };
            let after = row(step.after.values(0), width, lane);
            episode.said.push((after, step.rewards[lane], end));
            ended.push(end > 0);
        }
        for lane in (0..LANES).filter(|lane| ended[*lane]) {
            let next = open[lane].0 + 1;
            let done = std::mem::replace(&mut open[lane], (next, begin(lane, next, &lanes)));
            all.push(done.1);
        }
    }
    all.extend(open.into_iter().map(|(_, episode)| episode));
    all
}

/// What Gymnasium says of the same episodes.
fn check(name: &str, kwargs: Part, steps: usize, sees: &Field) {
    let Some(world) = world(name, kwargs) else { return };
    assert_eq!(&world.spec().expect("a world").sees[0], sees);
    let found = walk(&world, steps);
    let Value::Object(told) = serde_json::from_str(&told(&world)).expect("JSON") else {
        panic!("an object")
    };
    let episodes: Vec<Value> = found
        .iter()
        .map(|episode| json!({"seed": episode.seed, "actions": episode.actions}))
        .collect();
    let asked = json!({"name": name, "kwargs": told["kwargs"], "episodes": episodes});
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("asked.json");
    fs::write(&path, asked.to_string()).expect("it can be written");
    let mut plain = Command::new(python().expect("it is there"));
    plain.args(["-c", PLAIN]).stdin(fs::File::open(&path).expect("it is there"));
    let plain = plain.output().expect("it runs");
    assert!(plain.status.success(), "{}", String::from_utf8_lossy(&plain.stderr));
    let plain = String::from_utf8(plain.stdout).expect("text");
    assert_eq!(plain.lines().count(), found.len());
    let ends: usize =
        found.iter().filter(|episode| episode.said.last().is_some_and(|s| s.2 > 0)).count();
    assert!(ends > 3, "{name}: {ends} episodes ended");
    for (line, episode) in plain.lines().zip(found) {
        let expected: Vec<(Value, f64, u8)> = serde_json::from_str(line).expect("JSON");
        let flat = |value: Value| -> Vec<f32> {
            let text = value.to_string().replace(['[', ']'], "");
            text.split(',').map(|x| x.parse().expect("a number")).collect()
        };
        let expected: Vec<_> = expected.into_iter().map(|(o, r, e)| (flat(o), r, e)).collect();
        assert_eq!(episode.said, expected, "{name}");
    }
}

fn told(world: &Gymnasium) -> String {
    let ivx_op::Content::Foreign { told, .. } = &world.name.0.content else { panic!("a world") };
    told.to_string()
}

#[test]
fn what_is_seen_is_what_gymnasium_shows() {
    let seen = |shape: &[usize], kind| Field::new("observation", shape, kind);
    check("CartPole-v1", Part::default(), 300, &seen(&[4], Kind::F32));
    let sutton = Part::default().with("sutton_barto_reward", true);
    check("CartPole-v1", sutton, 200, &seen(&[4], Kind::F32));
    let frozen = Part::default().with("map_name", "4x4").with("is_slippery", true);
    check("FrozenLake-v1", frozen, 200, &seen(&[], Kind::Index(16)));
    check("Pendulum-v1", Part::default(), 450, &seen(&[3], Kind::F32));
    let short = Part::default().with("max_episode_steps", 7_i64);
    check("MountainCar-v0", short, 30, &seen(&[2], Kind::F32));
}

#[test]
fn what_is_told_has_all_versions() {
    let Some(world) = world("CartPole-v1", Part::default()) else { return };
    let told = told(&world);
    for part in [
        "\"python\": \"CPython 3.",
        "\"numpy\": \"",
        "\"gymnasium\": \"",
        "\"distribution\": \"gymnasium ",
    ] {
        assert!(told.contains(part), "{told}");
    }
    assert!(told.contains("gymnasium.envs.classic_control.cartpole:CartPoleEnv"), "{told}");
    let why = |name: &str, kwargs: Part| {
        let python = python().expect("it is there");
        look_up(&python, name, &kwargs.args, 60.0).expect_err("there is none")
    };
    assert!(why("CartPoll-v1", Part::default()).contains("CartPole"));
    let other = Part::default().with("no_such_thing", 1_i64);
    assert!(why("CartPole-v1", other).contains("no_such_thing"));
}
