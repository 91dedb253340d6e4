//! Steps a second of a drive with a hundred cars about, and with what the laser sees of them at every step.

#![expect(clippy::print_stdout, reason = "a benchmark says what it measured")]

use std::hint::black_box;
use std::time::Instant;

use ivx_town::{Body, Lidar, autopilot, drive, picture, scan, tasks, town, town_map, town_names};

fn main() {
    let mut state = 7_u64;
    let mut draw = move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        f64::from(u32::try_from(state >> 32).expect("it has 32 bits")) / 4_294_967_296.0
    };
    for name in town_names() {
        let start = Instant::now();
        let town = town(town_map(name).expect("it is ours"));
        println!("{name}: measured in {:.2} s", start.elapsed().as_secs_f64());
        let route = tasks().into_iter().find(|task| task.town == name);
        let ends = route.map_or_else(
            || {
                let lane = |k: usize| {
                    (0..town.network.lanes.len())
                        .filter(|lane| town.network.is_driven(*lane))
                        .nth(k)
                };
                [10, 40].map(|k| {
                    town.network.pose(town.network.start(lane(k).expect("it has as many")))
                })
            },
            |task| [task.origin, task.destination],
        );
        for sees in [false, true] {
            let mut drive =
                drive(&town, &ends[0], &ends[1], 100, &mut draw).expect("there is a route");
            let start = Instant::now();
            let n_steps = 3_000;
            for _ in 0..n_steps {
                let controls = autopilot(&drive, 0.0, &mut draw);
                black_box(drive.step(&town, &controls, &mut draw));
                if sees {
                    let cars: Vec<Body> = drive.traffic.bodies().collect();
                    let points = scan(&Lidar::default(), &town.relief, &drive.ego.pose, &cars);
                    black_box(picture(&points, -2.4));
                }
            }
            let speed = f64::from(n_steps) / start.elapsed().as_secs_f64();
            let what = if sees { "with what it sees" } else { "blind" };
            println!(
                "{name}: {speed:.0} steps a second {what}, {:.0} times real time",
                speed / 20.0
            );
        }
    }
}
