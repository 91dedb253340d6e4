//! Compares single steps with those of the originals, with all that is inside before and after.

use std::fmt::Debug;
use std::fs;
use std::path::PathBuf;

use serde::Deserialize;
use serde_json::Value;

use super::asterix::{Asterix, Crosser};
use super::board::{Board, Cells, SIDE};
use super::breakout::Breakout;
use super::freeway::{Car, Freeway};
use super::seaquest::{Seaquest, Swimmer};
use super::space_invaders::SpaceInvaders;
use super::{Game, MOVES};
use crate::luck::Luck;

#[derive(Deserialize)]
struct File {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    inputs: Inputs,
    expected: Expected,
}

#[derive(Deserialize)]
struct Inputs {
    steps: Vec<Step>,
}

#[derive(Deserialize)]
struct Step {
    before: Value,
    action: usize,
}

#[derive(Deserialize)]
struct Expected {
    steps: Vec<Outcome>,
}

#[derive(Deserialize)]
struct Outcome {
    reward: f32,
    terminal: bool,
    after: Value,
    /// The row, column and channel of each bit.
    obs_after_nonzero: Vec<[usize; 3]>,
}

#[test]
fn golden_steps_of_minatar() {
    let Some(file) = file() else { return };
    for case in &file.cases {
        match case.name.as_str() {
            "asterix" => check(case, asterix),
            "breakout" => check(case, breakout),
            "freeway" => check(case, freeway),
            "seaquest" => check(case, seaquest),
            "space_invaders" => check(case, space_invaders),
            name => panic!("there is no game {name}"),
        }
    }
}

/// Another folder need not have the file; the checked-in one must.
fn file() -> Option<File> {
    let elsewhere = std::env::var_os("IVX_GOLDEN_DIR").map(PathBuf::from);
    let checked_in = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/golden");
    let path = elsewhere.clone().unwrap_or_else(|| checked_in.into()).join("env_minatar.json");
    if elsewhere.is_some() && !path.exists() {
        return None;
    }
    let text = fs::read_to_string(&path).unwrap();
    Some(serde_json::from_str(&text).unwrap())
}

fn check<G: Game + Debug + PartialEq>(case: &Case, read: fn(&Value) -> G) {
    assert_eq!(case.inputs.steps.len(), case.expected.steps.len());
    for (i, (step, expected)) in case.inputs.steps.iter().zip(&case.expected.steps).enumerate() {
        let place = format!("{}, step {i}", case.name);
        let mut game = read(&step.before);
        let (reward, over) = game.act(MOVES[step.action], &mut Luck::numpy(0));
        assert_eq!((reward, over), (expected.reward, expected.terminal), "{place}");
        assert_eq!(game, read(&expected.after), "{place}");

        let channels = game.n_channels();
        let mut grid = vec![0; channels * SIDE * SIDE];
        game.draw(&mut Board::empty(&mut grid));
        let bit = |place: &usize| grid[place % channels * SIDE * SIDE + place / channels] == 1;
        let bits: Vec<[usize; 3]> = (0..grid.len())
            .filter(bit)
            .map(|place| [place / channels / SIDE, place / channels % SIDE, place % channels])
            .collect();
        assert_eq!(bits, expected.obs_after_nonzero, "{place}");
    }
}

fn asterix(state: &Value) -> Asterix {
    let lane = |entity: &Value| {
        (!entity.is_null()).then(|| Crosser {
            x: int(&entity[0]),
            heading: heading(&entity[2]),
            treasure: flag(&entity[3]),
        })
    };
    let lanes: Vec<Option<Crosser>> = list(&state["entities"]).iter().map(lane).collect();
    Asterix {
        ramping: flag(&state["ramping"]),
        player: (int(&state["player_x"]), int(&state["player_y"])),
        lanes: lanes.try_into().unwrap(),
        spawn_pause: count(&state["spawn_speed"]),
        spawn_wait: count(&state["spawn_timer"]),
        move_pause: count(&state["move_speed"]),
        move_wait: count(&state["move_timer"]),
        ramp_wait: int(&state["ramp_timer"]),
        ramp: count(&state["ramp_index"]),
    }
}

fn breakout(state: &Value) -> Breakout {
    Breakout {
        paddle: int(&state["pos"]),
        ball: (int(&state["ball_x"]), int(&state["ball_y"])),
        trail: (int(&state["last_x"]), int(&state["last_y"])),
        heading: [(-1, -1), (1, -1), (1, 1), (-1, 1)][count(&state["ball_dir"]) as usize],
        bricks: cells(&state["brick_map"]),
        struck: flag(&state["strike"]),
    }
}

fn freeway(state: &Value) -> Freeway {
    let car = |car: &Value| Car {
        x: int(&car[0]),
        wait: count(&car[2]),
        pause: int(&car[3]).unsigned_abs(),
        heading: int(&car[3]).signum(),
    };
    let cars: Vec<Car> = list(&state["cars"]).iter().map(car).collect();
    Freeway {
        cars: cars.try_into().unwrap(),
        chicken: int(&state["pos"]),
        rest: count(&state["move_timer"]),
        left: count(&state["terminate_timer"]),
    }
}

fn seaquest(state: &Value) -> Seaquest {
    let swimmers = |name: &str| {
        let swimmer = |one: &Value| Swimmer {
            x: int(&one[0]),
            y: int(&one[1]),
            heading: heading(&one[2]),
            wait: one.get(3).map_or(0, count),
            shot_wait: one.get(4).map_or(0, count),
        };
        list(&state[name]).iter().map(swimmer).collect()
    };
    Seaquest {
        ramping: flag(&state["ramping"]),
        oxygen: int(&state["oxygen"]),
        crew: int(&state["diver_count"]),
        sub: Swimmer {
            x: int(&state["sub_x"]),
            y: int(&state["sub_y"]),
            heading: heading(&state["sub_or"]),
            ..Swimmer::default()
        },
        bullets: swimmers("f_bullets"),
        enemy_bullets: swimmers("e_bullets"),
        fish: swimmers("e_fish"),
        enemy_subs: swimmers("e_subs"),
        divers: swimmers("divers"),
        enemy_pause: count(&state["e_spawn_speed"]),
        enemy_wait: count(&state["e_spawn_timer"]),
        diver_wait: count(&state["d_spawn_timer"]),
        move_pause: count(&state["move_speed"]),
        shot_wait: count(&state["shot_timer"]),
        surfaced: flag(&state["surface"]),
        ramp: count(&state["ramp_index"]),
    }
}

fn space_invaders(state: &Value) -> SpaceInvaders {
    SpaceInvaders {
        ramping: flag(&state["ramping"]),
        cannon: int(&state["pos"]),
        bullets: cells(&state["f_bullet_map"]),
        alien_bullets: cells(&state["e_bullet_map"]),
        aliens: cells(&state["alien_map"]),
        rightwards: int(&state["alien_dir"]) > 0,
        move_pause: count(&state["enemy_move_interval"]),
        move_wait: count(&state["alien_move_timer"]),
        alien_shot_wait: count(&state["alien_shot_timer"]),
        shot_wait: count(&state["shot_timer"]),
        ramp: count(&state["ramp_index"]),
    }
}

fn int(value: &Value) -> i32 {
    value.as_i64().unwrap().try_into().unwrap()
}

fn count(value: &Value) -> u32 {
    int(value).try_into().unwrap()
}

fn flag(value: &Value) -> bool {
    value.as_bool().unwrap()
}

fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap()
}

/// To the right if true.
fn heading(value: &Value) -> i32 {
    if flag(value) { 1 } else { -1 }
}

/// Cells from their rows and columns.
fn cells(map: &Value) -> Cells {
    let cell = |one: &Value| Cells::cell(int(&one[1]), int(&one[0]));
    list(&map["nz"]).iter().map(cell).fold(Cells::NONE, Cells::or)
}
