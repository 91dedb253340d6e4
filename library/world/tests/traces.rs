//! Compares worlds with traces of those they are made after.
//!
//! Other folders in the same format are read where `IVX_GOLDEN_DIR` (classic control) or
//! `IVX_WORLDS_DIR` (grids of coins) names them.

use std::path::PathBuf;

use ivx_world::{
    Acrobot, Act, Actions, CartPole, Coins, Control, MountainCar, MountainCarContinuous, Pendulum,
};
use serde_json::Value;

#[test]
fn golden_classic_control_moves_as_gymnasium() {
    let folder = folder("IVX_GOLDEN_DIR");
    let path = folder.join("env_classic_control.json");
    if !path.exists() && std::env::var_os("IVX_GOLDEN_DIR").is_some() {
        return;
    }
    let file = read(&path);
    let tolerance = &file["tolerance"]["f64"];
    let close = Close { rtol: number(&tolerance["rtol"]), atol: number(&tolerance["atol"]) };
    let cases = list(&file["cases"]);
    assert!(!cases.is_empty(), "no case to check");
    for case in cases {
        assert_eq!(case["kind"], "gym_trace");
        match case["name"].as_str() {
            Some("CartPole-v1") => follow::<CartPole, 4>(case, &close),
            Some("MountainCar-v0") => follow::<MountainCar, 2>(case, &close),
            Some("MountainCarContinuous-v0") => follow::<MountainCarContinuous, 2>(case, &close),
            Some("Acrobot-v1") => follow::<Acrobot, 4>(case, &close),
            Some("Pendulum-v1") => follow::<Pendulum, 2>(case, &close),
            name => panic!("nothing moves as {name:?}"),
        }
    }
}

/// How near numbers are to be.
struct Close {
    rtol: f64,
    atol: f64,
}

impl Close {
    fn check(&self, place: &str, found: &[f64], expected: &[f64]) {
        let near = |(a, b): (&f64, &f64)| (a - b).abs() <= self.atol + self.rtol * b.abs();
        let near = found.len() == expected.len() && found.iter().zip(expected).all(near);
        assert!(near, "{place}: expected {expected:?}, found {found:?}");
    }
}

/// Follows a trace from its first state on.
fn follow<C: Control<State = [f64; N]>, const N: usize>(case: &Value, close: &Close) {
    let mut state: [f64; N] = numbers(&case["inputs"]["state0"]).try_into().expect("a state");
    let expected = &case["expected"];
    let at = |key: &str, t: usize| -> &Value { &expected[key][t] };
    for (t, action) in list(&case["inputs"]["actions"]).iter().enumerate() {
        let (next, pays, over) = take::<C>(state, action);
        state = next;
        let place = |what: &str| format!("{}, {what}, step {t}", case["name"]);
        close.check(&place("state"), &state, &numbers(at("states", t)));
        let seen: Vec<f64> = C::seen(state).as_ref().iter().map(|x| f64::from(*x)).collect();
        close.check(&place("observation"), &seen, &numbers(at("obs", t)));
        close.check(&place("reward"), &[pays], &[number(at("rewards", t))]);
        assert_eq!(at("terminated", t), over, "{}", place("end"));
        if over {
            break; // What follows an end means nothing.
        }
    }
}

fn take<C: Control>(state: C::State, action: &Value) -> (C::State, f64, bool) {
    match C::does() {
        Actions::Discrete(_) => C::step(state, Act::Index(place(action))),
        Actions::Continuous { .. } => C::step(state, Act::Vector(&[single(action)])),
    }
}

#[test]
fn golden_coins_are_collected_as_in_the_traces() {
    let folder = folder("IVX_WORLDS_DIR").join("coingrid");
    if !folder.exists() && std::env::var_os("IVX_WORLDS_DIR").is_some() {
        return;
    }
    let entries = std::fs::read_dir(&folder);
    let entries = entries.unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let paths = entries.map(|entry| entry.expect("it can be read").path());
    let mut paths: Vec<PathBuf> =
        paths.filter(|path| path.extension().is_some_and(|end| end == "json")).collect();
    paths.sort();
    assert!(!paths.is_empty(), "{} has no trace to check", folder.display());
    for path in paths {
        let file = read(&path);
        assert_eq!(file["format"], "ivx-coingrid-golden-1");
        for (i, episode) in list(&file["episodes"]).iter().enumerate() {
            collect(&format!("{}, episode {i}", path.display()), episode);
        }
    }
}

/// Follows an episode of a grid of coins from its start on, also where no coin is left.
fn collect(name: &str, episode: &Value) {
    const SIDE: usize = 7;
    let start = &episode["init"];
    let cell = |x: &Value, y: &Value| place(y) * SIDE + place(x);
    let mut state = Coins {
        coins: [0; 3],
        walls: Coins::BORDER,
        at: cell(&start["pos"][0], &start["pos"][1]),
        faces: place(&start["dir"]),
    };
    for wall in list(&start["walls"]) {
        state.walls |= 1 << cell(&wall[0], &wall[1]);
    }
    for coin in list(&start["coins"]) {
        state.coins[place(&coin[0])] |= 1 << cell(&coin[1], &coin[2]);
    }
    // The traces have a channel last, we have it first.
    let seen = |state: &Coins| -> Vec<usize> {
        let mut grid = [0; 5 * SIDE * SIDE];
        state.show(&mut grid);
        let ours = |there: usize| there % 5 * SIDE * SIDE + there / 5;
        (0..grid.len()).filter(|there| grid[ours(*there)] == 1).collect()
    };
    let places = |value: &Value| -> Vec<usize> { list(value).iter().map(place).collect() };
    assert_eq!(seen(&state), places(&start["view"]), "{name}, the start");
    for (t, step) in list(&episode["steps"]).iter().enumerate() {
        let collected = state.step(place(&step[0])).map(usize::from);
        let found = (state.at, state.faces, collected.to_vec(), seen(&state));
        let pose = (cell(&step[1], &step[2]), place(&step[3]));
        let expected = (pose.0, pose.1, places(&step[4]), places(&step[5]));
        assert_eq!(found, expected, "{name}, step {t}");
    }
}

/// The folder that a variable names, or our own.
fn folder(variable: &str) -> PathBuf {
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/golden");
    std::env::var_os(variable).map_or_else(|| PathBuf::from(own), PathBuf::from)
}

fn read(path: &PathBuf) -> Value {
    let text = std::fs::read_to_string(path);
    let text = text.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap_or_else(|| panic!("expected a list, found {value}"))
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("expected a number, found {value}"))
}

fn numbers(value: &Value) -> Vec<f64> {
    list(value).iter().map(number).collect()
}

fn place(value: &Value) -> usize {
    let place = value.as_u64().and_then(|place| place.try_into().ok());
    place.unwrap_or_else(|| panic!("expected a place, found {value}"))
}

#[expect(clippy::cast_possible_truncation, reason = "actions have single precision")]
fn single(value: &Value) -> f32 {
    number(value) as f32
}
