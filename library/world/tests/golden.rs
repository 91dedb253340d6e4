//! Compares games with those recorded of the originals, step by step from the seed alone.

use std::fs;
use std::path::PathBuf;

use ivx_world::{Luck, Play};
use serde::Deserialize;
use sha2::{Digest, Sha256};

/// How many rows there are, and how many columns.
const SIDE: usize = 10;

/// Recorded runs of a game.
#[derive(Deserialize)]
struct File {
    game: String,
    runs: Vec<Run>,
}

/// One run: games after each other with the luck of one seed.
#[derive(Deserialize)]
struct Run {
    seed: u32,
    sticky: f64,
    ramping: bool,
    init: Seen,
    steps: Vec<Step>,
}

#[derive(Deserialize)]
struct Step {
    /// The action chosen.
    a: usize,
    /// That which was taken.
    eff: usize,
    /// The reward.
    r: f32,
    done: bool,
    ramp: Option<u32>,
    #[serde(flatten)]
    seen: Seen,
    /// The next start, if the game is over.
    reset: Option<Seen>,
}

/// What is seen next.
#[derive(Deserialize)]
struct Seen {
    /// What was drawn before.
    draws: Vec<Drawn>,
    /// The places of bits that changed, cell after cell.
    toggles: Vec<usize>,
    /// The start of a digest of all bits.
    sha: String,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Drawn {
    /// Numbers of `[0, 1)`.
    Units(String, Values<f64>),
    /// Whole numbers from the first up to the second, which is excluded.
    Whole(String, u32, u32, Values<u32>),
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum Values<T> {
    One(T),
    Some(Vec<T>),
}

impl<T> Values<T> {
    fn all(&self) -> &[T] {
        match self {
            Self::One(value) => std::slice::from_ref(value),
            Self::Some(values) => values,
        }
    }
}

#[test]
fn golden_games_of_minatar() {
    let mut errors = Vec::new();
    for path in recorded("minatar") {
        let text = fs::read_to_string(&path).expect("the file can be read");
        let file: File = serde_json::from_str(&text).expect("a file of recorded games");
        for run in &file.runs {
            if let Err(error) = replay(&file.game, run) {
                errors.push(format!("{}, seed {}: {error}", path.display(), run.seed));
            }
        }
    }
    assert!(errors.is_empty(), "{} runs differ:\n{}", errors.len(), errors.join("\n"));
}

/// The files of a family of worlds. Another folder need not have each family; the checked-in one must.
fn recorded(family: &str) -> Vec<PathBuf> {
    let elsewhere = std::env::var_os("IVX_WORLDS_DIR").map(PathBuf::from);
    let checked_in = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/golden");
    let folder = elsewhere.clone().unwrap_or_else(|| checked_in.into()).join(family);
    let mut files: Vec<PathBuf> = fs::read_dir(&folder)
        .into_iter()
        .flatten()
        .map(|entry| entry.expect("a file").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "json"))
        .collect();
    files.sort();
    assert!(elsewhere.is_some() || !files.is_empty(), "{} has no games", folder.display());
    files
}

/// Plays a recorded run once more.
fn replay(game: &str, run: &Run) -> Result<(), String> {
    let mut play = Play::of(game, run.sticky, run.ramping).ok_or("there is no such game")?;
    let mut luck = Luck::numpy(run.seed);
    let cells = vec![0; play.n_channels() * SIDE * SIDE];
    let mut replayed = Replayed { recorded: luck.clone(), cells };

    play.restart(&mut luck);
    replayed.check(&run.init, &play, &luck)?;
    for (t, step) in run.steps.iter().enumerate() {
        let (taken, reward, over) = play.act(step.a, &mut luck);
        let found = (taken, reward, over, play.ramp());
        let expected = (step.eff, step.r, step.done, step.ramp);
        if found != expected {
            return Err(format!("step {t}: expected {expected:?}, found {found:?}"));
        }
        replayed.check(&step.seen, &play, &luck).map_err(|error| format!("step {t}: {error}"))?;
        if let Some(reset) = &step.reset {
            play.restart(&mut luck);
            replayed.check(reset, &play, &luck).map_err(|error| format!("after {t}: {error}"))?;
        }
    }
    Ok(())
}

/// What a run has shown so far.
struct Replayed {
    /// Luck from which just the recorded numbers were drawn.
    recorded: Luck,
    /// The bits last seen, cell after cell.
    cells: Vec<u8>,
}

impl Replayed {
    /// Checks what was drawn since, and what is seen now.
    fn check(&mut self, seen: &Seen, play: &Play, luck: &Luck) -> Result<(), String> {
        for drawn in &seen.draws {
            if !self.comes_next(drawn) {
                return Err(format!("{drawn:?} is not what the seed gives next"));
            }
        }
        if self.recorded.clone().bits() != luck.clone().bits() {
            return Err(format!("expected {:?} to be drawn, found others", seen.draws));
        }

        let channels = play.n_channels();
        let mut grid = vec![0; self.cells.len()];
        play.draw(&mut grid);
        // Recorded cell after cell, and not channel after channel.
        let cells: Vec<u8> = (0..grid.len())
            .map(|place| grid[place % channels * SIDE * SIDE + place / channels])
            .collect();
        let changed = |place: &usize| cells[*place] != self.cells[*place];
        let toggles: Vec<usize> = (0..cells.len()).filter(changed).collect();
        if toggles != seen.toggles {
            let named = |places: &[usize]| -> Vec<[usize; 3]> {
                let cells = places.iter().map(|place| (place % channels, place / channels));
                cells.map(|(channel, cell)| [channel, cell / SIDE, cell % SIDE]).collect()
            };
            return Err(format!(
                "expected these channels, rows and columns to change: {:?}, found {:?}",
                named(&seen.toggles),
                named(&toggles)
            ));
        }
        let digest = Sha256::digest(&cells);
        let bytes = digest[..8].try_into().expect("as many as digits");
        let sha = format!("{:016x}", u64::from_be_bytes(bytes));
        if sha != seen.sha {
            return Err(format!("expected bits with digest {}, found {sha}", seen.sha));
        }
        self.cells = cells;
        Ok(())
    }

    /// Whether this is what the seed gives next.
    fn comes_next(&mut self, drawn: &Drawn) -> bool {
        let luck = &mut self.recorded;
        match drawn {
            Drawn::Units(kind, values) => {
                kind == "rand" && values.all().iter().all(|value| *value == luck.unit())
            }
            Drawn::Whole(kind, low, high, values) => {
                let mut next = || low + luck.below(high - low);
                kind == "randint" && values.all().iter().all(|value| *value == next())
            }
        }
    }
}
