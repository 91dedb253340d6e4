//! Procgen itself, where `PROCGEN_DIR` names the folder `procgen/data` of an unpacked wheel of it.

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::thread;

use ivx_data::{Columns, Values};
use ivx_foreign::Procgen;
use ivx_foreign::procgen::look_up;
use ivx_op::{Content, Ctx, Foreign, How, State};
use ivx_world::{Act, End, Env as _, Lanes, Luck, Row, World};
use serde::Deserialize;
use sha2::{Digest as _, Sha256};

/// How many bytes a picture has.
const PICTURE: usize = 64 * 64 * 3;

fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("PROCGEN_DIR").map(PathBuf::from);
    if folder.is_none() {
        eprintln!("without PROCGEN_DIR, a folder with Procgen's library, nothing is tried here");
    }
    folder
}

fn world(folder: &Path, game: &str) -> Procgen {
    let found = look_up(folder, game).unwrap_or_else(|why| panic!("{game}: {why}"));
    Procgen {
        game: Foreign(found),
        pays: Vec::new(),
        levels: 0,
        first: 0,
        mode: "easy".to_owned(),
        path: How(String::new()),
    }
}

fn again(world: &Procgen) -> Procgen {
    let Procgen { game, pays, levels, first, mode, .. } = world;
    let (game, pays, mode) = (game.clone(), pays.clone(), mode.clone());
    Procgen { game, pays, levels: *levels, first: *first, mode, path: How(String::new()) }
}

/// Recorded runs of a game.
#[derive(Deserialize)]
struct File {
    game: String,
    runs: Vec<Run>,
}

#[derive(Deserialize)]
struct Run {
    options: Options,
    init: Start,
    /// The action, the reward, whether an episode begins, its level, whether the goal of the last one was met, and the
    /// start of the digest of the picture.
    steps: Vec<(usize, f64, u8, u64, u8, String)>,
}

#[derive(Deserialize)]
struct Options {
    mode: u8,
}

#[derive(Deserialize)]
struct Start {
    sha: String,
    level_seed: u64,
}

/// What is recorded of one seed after the other is what is played level by level.
#[test]
fn golden_games_of_procgen() {
    let Some(folder) = folder() else { return };
    for path in recorded() {
        let text = fs::read_to_string(&path).expect("the file can be read");
        let file: File = serde_json::from_str(&text).expect("a file of recorded games");
        let known = world(&folder, &file.game);
        for run in &file.runs {
            let mode = if run.options.mode == 0 { "easy" } else { "hard" };
            replay(run, &Procgen { mode: mode.to_owned(), levels: 1, ..again(&known) })
                .unwrap_or_else(|why| panic!("{}, {mode}: {why}", path.display()));
        }
    }
}

/// The files. Another folder need not have any; the checked-in one must.
fn recorded() -> Vec<PathBuf> {
    let elsewhere = std::env::var_os("IVX_WORLDS_DIR").map(PathBuf::from);
    let checked_in = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/golden");
    let folder = elsewhere.clone().unwrap_or_else(|| checked_in.into()).join("procgen");
    let entries = fs::read_dir(&folder).into_iter().flatten();
    let paths = entries.map(|entry| entry.expect("a file").path());
    let mut files: Vec<PathBuf> =
        paths.filter(|path| path.extension().is_some_and(|end| end == "json")).collect();
    files.sort();
    assert!(elsewhere.is_some() || !files.is_empty(), "{} has no games", folder.display());
    files
}

fn replay(run: &Run, env: &Procgen) -> Result<(), String> {
    let at = |level| Procgen { first: level, ..again(env) };
    let mut now = Now::begin(&at(run.init.level_seed), 7);
    now.check(&run.init.sha).map_err(|why| format!("the start: {why}"))?;
    for (t, (action, reward, first, level, _, sha)) in run.steps.iter().enumerate() {
        let before = now.picture();
        let (paid, end) = now.step(*action);
        if (paid, end != End::No) != (*reward, *first == 1) {
            return Err(format!("step {t}: {paid} and {end:?}, not {reward} and {first}"));
        }
        if *first == 1 {
            if now.picture() != before {
                return Err(format!("step {t}: what is seen at the end is not the last picture"));
            }
            now = Now::begin(&at(*level), 7);
        }
        now.check(sha).map_err(|why| format!("step {t}: {why}"))?;
    }
    Ok(())
}

/// A world, and what is seen of it.
struct Now {
    world: Box<dyn World>,
    seen: Columns,
    told: Vec<f32>,
}

impl Now {
    fn begin(env: &Procgen, seed: u32) -> Self {
        let spec = env.spec().expect("a world");
        let (seen, told) = (Columns::zeros(spec.sees, 1), vec![0.0; spec.tells.len()]);
        let mut now = Self { world: env.open().expect("a world"), seen, told };
        now.again(seed);
        now
    }

    fn again(&mut self, seed: u32) {
        self.world.reset(&mut Luck::numpy(seed), &mut Row::of(&mut self.seen, 0, &mut []));
    }

    fn step(&mut self, action: usize) -> (f64, End) {
        let mut row = Row::of(&mut self.seen, 0, &mut self.told);
        self.world.step(Act::Index(action), &mut Luck::numpy(0), &mut row)
    }

    /// Rows of pixels, as the library writes them.
    fn picture(&self) -> Vec<u8> {
        let Values::U8(seen) = self.seen.values(0) else { panic!("bytes") };
        (0..PICTURE).map(|i| seen[i % 3 * 64 * 64 + i / 3]).collect()
    }

    fn check(&self, sha: &str) -> Result<(), String> {
        let digest = Sha256::digest(self.picture());
        let first = digest[..8].try_into().expect("as many as digits");
        let found = format!("{:016x}", u64::from_be_bytes(first));
        if found == sha { Ok(()) } else { Err(format!("a picture {found} and not {sha}")) }
    }
}

/// A course of level 1 up to its end, where two presents are met: each of these for ten steps, until it is over.
const COURSE: &[u8] = b"NLRNNNRLRRLRLNNRLLRLRNNRNLNLRNNNNNRRRLNNNN";

#[test]
fn what_is_met_is_told_and_paid_for() {
    let Some(folder) = folder() else { return };
    let known = Procgen { levels: 1, first: 1, ..world(&folder, "fruitbot") };
    let task = |pays: &[f64]| Procgen { pays: pays.to_vec(), ..again(&known) };
    let go = |env: &Procgen| {
        let (mut now, mut all) = (Now::begin(env, 0), Vec::new());
        for key in COURSE {
            for _ in 0..10 {
                let (paid, end) = now.step([1, 4, 7]["LNR".find(char::from(*key)).expect("one")]);
                let told: [f32; 3] = now.told[..].try_into().expect("three");
                all.push((paid, told.map(f64::from)));
                if end == End::Terminal {
                    return all;
                }
            }
        }
        panic!("it comes to an end")
    };
    let own = go(&known);
    assert!(own.iter().all(|(paid, [fruits, others, presents])| {
        *paid == fruits - 4.0 * others + 10.0 * presents
    }));
    let met = |i: usize| own.iter().map(|(_, told)| told[i]).sum::<f64>();
    assert!(met(0) > 0.0 && met(1) > 0.0, "{} fruits, {} others", met(0), met(1));
    assert_eq!((own.len(), own.last()), (420, Some(&(20.0, [0.0, 0.0, 2.0]))));
    let other = go(&task(&[0.5, 3.0, -7.0]));
    for ((_, told), (paid, also)) in own.iter().zip(&other) {
        assert_eq!((told, told[0] * 0.5 + told[1] * 3.0 - told[2] * 7.0), (also, *paid));
    }
    assert!(task(&[0.0; 3]).spec().is_ok() && !task(&[0.0; 3]).pays() && task(&[]).pays());
}

#[test]
fn a_limit_is_no_end() {
    let Some(folder) = folder() else { return };
    for (game, limit) in [("maze", 500), ("heist", 1000)] {
        let mut now = Now::begin(&world(&folder, game), 3);
        let ends: Vec<End> = (0..limit).map(|_| now.step(4).1).collect();
        assert!(ends[..limit - 1].iter().all(|end| *end == End::No), "{game}");
        assert_eq!(ends[limit - 1], End::Limit, "{game}");
    }
}

/// Whatever was played before, and whatever is played beside it.
#[test]
fn an_episode_is_known_by_its_luck_and_its_actions() {
    let Some(folder) = folder() else { return };
    let games = ["fruitbot", "maze", "coinrun", "starpilot"];
    let play = |now: &mut Now, seed: u32| -> Vec<(f64, Vec<u8>)> {
        now.again(seed);
        let mut draws = Luck::numpy(seed);
        let mut all = vec![(0.0, now.picture())];
        loop {
            let (paid, end) = now.step(draws.below(15) as usize);
            all.push((paid, now.picture()));
            if end != End::No || all.len() > 150 {
                return all;
            }
        }
    };
    let alone: Vec<_> = games
        .map(|game| (0..3).map(|s| play(&mut Now::begin(&world(&folder, game), s), s)).collect())
        .into_iter()
        .collect::<Vec<Vec<_>>>();
    assert!(alone.iter().flatten().all(|all| all.len() > 5 && all[0].1 != all[all.len() - 1].1));
    thread::scope(|scope| {
        for turn in 0..4 {
            let (alone, folder) = (&alone, &folder);
            scope.spawn(move || {
                let mut worlds = games.map(|game| Now::begin(&world(folder, game), 9));
                for i in 0..12 {
                    let (game, seed) = ((i + turn) % 4, (i / 4 + turn) % 3);
                    let seeded = u32::try_from(seed).expect("small");
                    assert!(play(&mut worlds[game], seeded) == alone[game][seed], "{game}, {seed}");
                }
            });
        }
    });
}

#[test]
fn levels_are_those_that_are_asked_for() {
    let Some(folder) = folder() else { return };
    let known = world(&folder, "fruitbot");
    let starts = |levels, first, seeds: std::ops::Range<u32>| -> BTreeSet<Vec<u8>> {
        let mut now = Now::begin(&Procgen { levels, first, ..again(&known) }, 0);
        let starts = seeds.map(|seed| {
            now.again(seed);
            now.picture()
        });
        starts.collect()
    };
    let few = starts(3, 10, 0..30);
    assert_eq!(
        few,
        [10, 11, 12].map(|level| starts(1, level, 5..6)).into_iter().flatten().collect()
    );
    assert_eq!((few.len(), starts(0, 0, 0..20).len()), (3, 20));
    assert_eq!(starts(3, 13, 0..30).intersection(&few).count(), 0);
}

#[test]
fn an_unfinished_episode_is_taken_again_to_the_same_bits() {
    let Some(folder) = folder() else { return };
    let (env, ctx) = (world(&folder, "fruitbot"), Ctx::new("learn", 5, None));
    let open = || Lanes::open(&env, 2, &ctx, ("learn", 0)).expect("worlds");
    let go = |lanes: &mut Lanes<'_>, t: usize| {
        lanes.choose().1.places.fill([7, 4, 1][t / 8 % 3]);
        lanes.step().expect("they go on");
        lanes.finished().count()
    };
    let mut one = open();
    let n: usize = (0..300).map(|t| go(&mut one, t)).sum();
    assert!(n > 1, "{n} episodes are over");
    let bytes = State::keep(|state| one.state(state));
    let mut other = open();
    assert!(State::restore(&bytes, |state| other.state(state)));
    other.catch_up().expect("they are as they were");
    for t in 300..400 {
        assert!(other.seen() == one.seen(), "step {t}");
        go(&mut one, t);
        go(&mut other, t);
    }
}

#[test]
fn what_is_not_known_is_not_called() {
    let Some(folder) = folder() else { return };
    let why = |folder: &Path, game: &str| look_up(folder, game).expect_err("it is refused");
    assert!(why(&folder, "fruitbat").contains("no game of Procgen is called \"fruitbat\""));
    let other = tempfile::tempdir().expect("a folder");
    let path = other.path();
    assert!(why(path, "maze").contains("has no `prebuilt/libenv.so`"));
    fs::write(path.join("libenv.so"), b"\x7fELF").expect("it can be written");
    assert!(why(path, "maze").contains("is none of Procgen 0.10.7"));
    fs::remove_file(path.join("libenv.so")).expect("it is there");
    let library = ["prebuilt/libenv.so", "libenv.so"].map(|name| folder.join(name));
    let library = library.into_iter().find(|path| path.exists()).expect("it is there");
    symlink(library, path.join("libenv.so")).expect("a link");
    assert!(why(path, "maze").contains("assets"));
    fs::create_dir(path.join("assets")).expect("a folder");
    assert!(why(path, "maze").contains("are not the pictures"));
    // Where it lies is none of its name.
    fs::remove_dir(path.join("assets")).expect("it is empty");
    symlink(folder.join("assets"), path.join("assets")).expect("a link");
    let (here, there) =
        (look_up(&folder, "maze").expect("known"), look_up(path, "maze").expect("known"));
    assert_eq!((here.to_string(), here.digest), (there.to_string(), there.digest));
    assert_ne!(here.content, there.content);
    let mut changed = world(&folder, "maze");
    let Content::Foreign { told, .. } = &mut changed.game.0.content else { panic!("a world") };
    *told = told.replace("Python", "Snake").into();
    let why = changed.open().err().expect("it is refused").to_string();
    assert!(why.contains("is not what it was when the spec was read"), "{why}");
}
