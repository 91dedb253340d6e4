//! Procgen: games with levels that are drawn, played by their own library.

#[cfg(feature = "procgen")]
mod found;
#[cfg(feature = "procgen")]
#[expect(unsafe_code, reason = "a library with a C interface is called; nothing else here is")]
mod libenv;
#[cfg(feature = "procgen")]
mod play;

use std::path::Path;

use ivx_data::{Field, Kind, Misfit};
use ivx_op::{External, Facts, Foreign, How, OpError, Wrong, declare};
use ivx_world::{Actions, Env, Spec, World};

declare! {
    /// A game of Procgen (Cobbe et al., 2020), played by its own library, where ivx is built with it
    /// (`--features procgen`): `procgen("fruitbot", levels: 200)`. `docs/agents.md` says where the library is had from.
    ///
    /// Seen is `rgb`, three channels of 64 × 64 pixels. There are the 15 actions of Procgen, combinations of keys of which
    /// most games read some. All else is as Procgen has it by default. Each episode is a level of its own, drawn from
    /// those that there are, and depends on nothing but its level and its actions. Procgen shows no picture of the state
    /// in which an episode ends; there the last one is seen once more.
    ///
    /// `fruitbot` (§B.1.4) tells how many fruits, other objects and presents at the end a step has met, of which its
    /// rewards are 1, -4 and 10 each. `pays` makes other tasks of it.
    pub struct Procgen = "procgen" @ 1 {
        /// Which game, in quotes: `bigfish`, `bossfight`, `caveflyer`, `chaser`, `climber`, `coinrun`, `dodgeball`,
        /// `fruitbot`, `heist`, `jumper`, `leaper`, `maze`, `miner`, `ninja`, `plunder` or `starpilot`.
        game: Foreign;
        /// What a fruit pays in `fruitbot`, what another object, and what a present at the end; nothing for what the game
        /// itself pays.
        pays: Vec<f64> = Vec::<f64>::new(), in -1e6..=1e6;
        /// How many levels there are, as Procgen numbers them; with 0 all.
        levels: u64 = 0, in 0.0..=2_147_483_647.0;
        /// The number of the first of them.
        first: u64 = 0, in 0.0..=2_147_483_647.0;
        /// `"easy"` or `"hard"`, as Procgen has it.
        mode: String = "hard";
        /// The folder `procgen/data` of an unpacked wheel of Procgen; by default that which `PROCGEN_DIR` names.
        path: How<String> = "";
    }
    rule game_and_task_are_sound;
}

/// The games, and after how many steps an episode is cut off.
const GAMES: [(&str, u64); 16] = [
    ("bigfish", 6000),
    ("bossfight", 4000),
    ("caveflyer", 1000),
    ("chaser", 1000),
    ("climber", 1000),
    ("coinrun", 1000),
    ("dodgeball", 1000),
    ("fruitbot", 1000),
    ("heist", 1000),
    ("jumper", 1000),
    ("leaper", 500),
    ("maze", 500),
    ("miner", 1000),
    ("ninja", 1000),
    ("plunder", 4000),
    ("starpilot", 1000),
];

/// What is done: keys.
const ACTIONS: [&str; 15] = [
    "LEFT DOWN",
    "LEFT",
    "LEFT UP",
    "DOWN",
    "NONE",
    "UP",
    "RIGHT DOWN",
    "RIGHT",
    "RIGHT UP",
    "D",
    "A",
    "W",
    "S",
    "Q",
    "E",
];

/// How many rows and columns are seen.
const SIDE: usize = 64;

/// How many levels there are.
const LEVELS: u64 = (1 << 31) - 1;

/// What is played, after it was looked at.
#[derive(Debug)]
#[cfg_attr(
    not(any(feature = "procgen", test)),
    expect(dead_code, reason = "nothing is played without the library")
)]
struct Game {
    /// Its place in the list of all.
    place: usize,
    is_hard: bool,
    /// The first level, and how many there are.
    levels: [u32; 2],
    /// What a fruit, another object and a present pay, where that is not what the game pays.
    pays: Option<[f64; 3]>,
}

impl Game {
    fn name(&self) -> &'static str {
        GAMES[self.place].0
    }

    fn limit(&self) -> u64 {
        GAMES[self.place].1
    }

    fn has_fruits(&self) -> bool {
        self.name() == "fruitbot"
    }
}

impl Procgen {
    fn game(&self) -> Result<Game, (&'static str, Misfit)> {
        game(&self.game.0.name, &self.pays, [self.levels, self.first], &self.mode)
    }
}

impl Env for Procgen {
    fn spec(&self) -> Result<Spec, Misfit> {
        let game = self.game().map_err(|(_, misfit)| misfit)?;
        let tells: &[&str] = if game.has_fruits() { &["fruit", "object", "end"] } else { &[] };
        Ok(Spec {
            sees: vec![Field::new("rgb", &[3, SIDE, SIDE], Kind::U8)],
            does: Actions::named(&ACTIONS),
            tells: tells.iter().map(|name| (*name).to_owned()).collect(),
            limit: Some(game.limit()),
        })
    }

    #[cfg(feature = "procgen")]
    fn open(&self) -> Result<Box<dyn World>, OpError> {
        let game = self.game().map_err(|(_, misfit)| OpError::Failed(misfit.message))?;
        let ivx_op::Content::Foreign { told, program } = &self.game.0.content else {
            unreachable!("a world has the content of one")
        };
        let library = found::library(told, program).map_err(OpError::Failed)?;
        Ok(Box::new(play::Playing::new(library, game)))
    }

    #[cfg(not(feature = "procgen"))]
    fn open(&self) -> Result<Box<dyn World>, OpError> {
        Err(OpError::Failed(WITHOUT.to_owned()))
    }

    fn pays(&self) -> bool {
        self.pays.is_empty() || self.pays.iter().any(|pays| *pays != 0.0)
    }
}

/// What is told where ivx is built without Procgen.
#[cfg(not(feature = "procgen"))]
const WITHOUT: &str = "this ivx is built without Procgen: `cargo install --path cli --features procgen` builds one that has it";

/// A game, as the library in a folder has it: what it is called, and which library that is. The folder is none of it.
///
/// # Errors
/// Why there is none.
#[cfg(feature = "procgen")]
pub fn look_up(folder: &Path, name: &str) -> Result<External, String> {
    named(name).map_err(|misfit| format!("{}; {}", misfit.message, misfit.help))?;
    if folder.as_os_str().is_empty() {
        return Err("neither `path` nor `PROCGEN_DIR` says where Procgen lies".to_owned());
    }
    let told = found::look(folder)?;
    Ok(External::foreign(name.to_owned(), &told, folder.to_owned()))
}

/// A game, which there is none of.
///
/// # Errors
/// Why there is none.
#[cfg(not(feature = "procgen"))]
pub fn look_up(_: &Path, _: &str) -> Result<External, String> {
    Err(WITHOUT.to_owned())
}

fn game_and_task_are_sound(facts: &Facts<'_>) -> Result<(), Wrong> {
    let (Some(Foreign(name)), Some(pays), Some(levels), Some(first), Some(mode)) = (
        facts.arg("game"),
        facts.arg::<Vec<f64>>("pays"),
        facts.arg("levels"),
        facts.arg("first"),
        facts.arg::<String>("mode"),
    ) else {
        return Ok(());
    };
    let wrong = |(arg, Misfit { message, help })| Wrong { arg, message, help };
    game(&name.name, &pays, [levels, first], &mode).map(drop).map_err(wrong)
}

/// What is played, or which argument says what cannot be.
fn game(
    name: &str,
    pays: &[f64],
    [levels, first]: [u64; 2],
    mode: &str,
) -> Result<Game, (&'static str, Misfit)> {
    let wrong = |arg, message: String, help: &str| Err((arg, Misfit::new(message, help)));
    let place = named(name).map_err(|misfit| ("game", misfit))?;
    let pays = match *pays {
        [] => None,
        [fruit, object, end] if name == "fruitbot" => Some([fruit, object, end]),
        _ if name == "fruitbot" => {
            let message = format!(
                "a task pays for fruits, other objects and the end, not for {}",
                pays.len()
            );
            return wrong("pays", message, "give three numbers, such as `[1.0, -4.0, 10.0]`");
        }
        _ => {
            let message = format!(
                "what is met in `{name}` is not told, so that nothing else can be paid for it"
            );
            return wrong("pays", message, "leave it out, or play `\"fruitbot\"`");
        }
    };
    let is_hard = match mode {
        "easy" => false,
        "hard" => true,
        _ => {
            let message = format!("no mode is called {mode:?}");
            return wrong("mode", message, "say `\"easy\"` or `\"hard\"`");
        }
    };
    let levels = match (levels, first) {
        (0, 0) => [0, LEVELS],
        (0, _) => {
            let message = "`levels: 0` are all levels, of which none is the first".to_owned();
            return wrong("first", message, "say how many `levels` follow it");
        }
        (n, first) if n + first > LEVELS => {
            let message = format!("the last of {n} levels from {first} on is beyond {LEVELS}");
            return wrong("first", message, "begin with an earlier one");
        }
        (n, first) => [first, n],
    };
    let levels = levels.map(|n| u32::try_from(n).expect("it is below 2³¹"));
    Ok(Game { place, is_hard, levels, pays })
}

/// The place of a game among all.
fn named(name: &str) -> Result<usize, Misfit> {
    GAMES.iter().position(|(known, _)| *known == name).ok_or_else(|| {
        let known: Vec<String> = GAMES.iter().map(|(known, _)| format!("`\"{known}\"`")).collect();
        let message = format!("no game of Procgen is called {name:?}");
        Misfit { message, help: format!("there are {}", known.join(", ")) }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_played_is_refused() {
        let check = |name: &str, pays: &[f64], levels, mode: &str, arg: &str, part: &str| {
            let (found, misfit) = game(name, pays, levels, mode).unwrap_err();
            assert!(found == arg && misfit.message.contains(part), "{found}: {}", misfit.message);
        };
        check("fruitbat", &[], [0, 0], "easy", "game", "no game of Procgen");
        check("coinrun_old", &[], [0, 0], "hard", "game", "no game of Procgen");
        check("fruitbot", &[1.0], [0, 0], "easy", "pays", "not for 1");
        check("maze", &[1.0; 3], [0, 0], "easy", "pays", "is not told");
        check("maze", &[], [0, 0], "memory", "mode", "\"memory\"");
        check("maze", &[], [0, 7], "easy", "first", "none is the first");
        check("maze", &[], [2, LEVELS - 1], "easy", "first", "beyond");
        let all = game("maze", &[], [0, 0], "easy").unwrap();
        assert_eq!((all.levels, all.limit(), all.pays), ([0, 2_147_483_647], 500, None));
        let some = game("fruitbot", &[1.0, 2.0, 3.0], [2, LEVELS - 2], "hard").unwrap();
        assert_eq!((some.levels, some.is_hard), ([2_147_483_645, 2], true));
        assert_eq!(some.pays, Some([1.0, 2.0, 3.0]));
    }
}
