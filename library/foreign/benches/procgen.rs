//! How many steps a second Procgen takes on one core, with actions drawn evenly, and how long an episode takes to begin.
//! `PROCGEN_DIR=../procgen/data cargo bench -p ivx-foreign --features procgen --bench procgen`.

use std::path::Path;
use std::time::Instant;

use ivx_foreign::Procgen;
use ivx_foreign::procgen::look_up;
use ivx_op::{Ctx, Foreign, How};
use ivx_world::{Env as _, Lanes, Luck};

/// For how many seconds steps are counted, how often: the best counts, since others may want the same core.
const SECONDS: f64 = 0.5;
const TIMES: u32 = 6;

#[expect(clippy::print_stdout, reason = "a bench tells what it measured")]
fn main() {
    let Some(folder) = std::env::var_os("PROCGEN_DIR") else {
        println!("without PROCGEN_DIR, a folder with Procgen's library, nothing is measured");
        return;
    };
    let begun = Instant::now();
    for game in ["fruitbot", "maze", "coinrun", "heist", "bigfish"] {
        let found = look_up(Path::new(&folder), game).unwrap_or_else(|why| panic!("{game}: {why}"));
        if game == "fruitbot" {
            println!("looked up in {:.2} s", begun.elapsed().as_secs_f64());
        }
        for mode in ["easy", "hard"] {
            let world = Procgen {
                game: Foreign(found.clone()),
                pays: Vec::new(),
                levels: 0,
                first: 0,
                mode: mode.to_owned(),
                path: How(String::new()),
            };
            let (steps, length) = steps_per_second(&world);
            let begins = 1e6 * seconds_to_begin(&world);
            println!(
                "{game} {mode}: {steps:.0} steps/s in episodes of {length:.0}, {begins:.0} µs to begin one"
            );
        }
    }
}

/// Steps a second in one episode after the other, and how many steps one has.
fn steps_per_second(world: &Procgen) -> (f64, f64) {
    let ctx = Ctx::new("learn", 0, None);
    let mut lanes = Lanes::open(world, 1, &ctx, ("learn", 0)).expect("a world");
    let (mut draws, mut all, mut episodes) = (Luck::numpy(0), 0.0, 0.0);
    let times = (0..TIMES).map(|_| {
        let (start, mut steps) = (Instant::now(), 0.0);
        while start.elapsed().as_secs_f64() < SECONDS {
            lanes.choose().1.places[0] = draws.below(15) as usize;
            lanes.step().expect("it goes on");
            steps += 1.0;
            lanes.finished().for_each(|_| episodes += 1.0);
        }
        all += steps;
        steps / start.elapsed().as_secs_f64()
    });
    let best = times.fold(0.0, f64::max);
    (best, all / f64::max(episodes, 1.0))
}

fn seconds_to_begin(world: &Procgen) -> f64 {
    let spec = world.spec().expect("a world");
    let mut seen = ivx_data::Columns::zeros(spec.sees, 1);
    let (mut one, mut luck) = (world.open().expect("a world"), Luck::numpy(0));
    let times = (0..TIMES).map(|_| {
        let start = Instant::now();
        (0..50).for_each(|_| one.reset(&mut luck, &mut ivx_world::Row::of(&mut seen, 0, &mut [])));
        start.elapsed().as_secs_f64() / 50.0
    });
    times.fold(f64::INFINITY, f64::min)
}
