//! How many steps a second worlds take on one core, with actions drawn evenly and what is seen written after each.

use std::time::Instant;

use ivx_data::Columns;
use ivx_op::Ctx;
use ivx_world::{
    Act, Actions, CartPole, CoinGrid, End, Env, FruitGrid, Highway, Lanes, Luck, Minatar,
    Roundabout, Row,
};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

/// How many steps are timed at once, and how often: the fastest time counts, since others may want the same core.
const STEPS: u32 = 500_000;
const TIMES: u32 = 5;

fn main() {
    for game in ["asterix", "breakout", "freeway", "seaquest", "space_invaders"] {
        let world = Minatar { game: game.to_owned(), sticky: 0.1, ramping: true, limit: 10_000 };
        report(&format!("minatar {game}"), &world);
    }
    report("fruit_grid", &fruits());
    let (pays, limit) = (vec![1.0, 1.0], 120);
    report("coin_grid", &CoinGrid { pays, coins: 2, walls: 0, limit, front_apart: false });
    report_driving();
    for n in [1, 8, 64] {
        let game =
            Minatar { game: "breakout".to_owned(), sticky: 0.1, ramping: true, limit: 10_000 };
        report_lanes("cart_pole", &CartPole {}, n);
        report_lanes("minatar breakout", &game, n);
        report_lanes("fruit_grid", &fruits(), n);
    }
}

fn fruits() -> FruitGrid {
    FruitGrid { pays: vec![1.0, -4.0, 10.0], walls: 5, doors: 0.0, levels: 0, first: 0 }
}

#[expect(clippy::print_stdout, reason = "a benchmark tells what it measured")]
fn report_lanes(name: &str, env: &dyn Env, n: u32) {
    let ctx = Ctx::new("learn", 0, None);
    let mut lanes = Lanes::open(env, n as usize, &ctx, ("learn", 0)).expect("worlds");
    let n_actions = u32::try_from(lanes.spec().does.n_discrete().expect("discrete")).expect("few");
    let mut choices = Luck::from(ChaCha8Rng::seed_from_u64(1));
    let times = (0..TIMES).map(|_| {
        let start = Instant::now();
        for _ in 0..STEPS / n {
            let (_, acts) = lanes.choose();
            acts.places.iter_mut().for_each(|place| *place = choices.below(n_actions) as usize);
            lanes.step().expect("they go on");
            lanes.finished();
        }
        start.elapsed().as_secs_f64()
    });
    let fastest = times.fold(f64::INFINITY, f64::min);
    println!("{n} lanes of {name}: {:.2} M steps/s", f64::from(STEPS) / fastest / 1e6);
}

/// Steps of a second among as many cars as highway-env has by default, and how often as many those of highway-env
/// 1.12.1 are: 3.7 a second on a highway, 34 on a roundabout. Then those of the tasks of the thesis, of 1/5 s.
#[expect(clippy::print_stdout, reason = "a benchmark tells what it measured")]
fn report_driving() {
    let on_highway = |task: &str| Highway {
        task: task.to_owned(),
        actions: None,
        cars: 50,
        lanes: 4,
        lane: 3,
        frames: 3,
        seconds: 40,
        release: "1.12.1".to_owned(),
    };
    let on_roundabout = |task: &str| Roundabout {
        task: task.to_owned(),
        exit: 3,
        actions: None,
        frames: 3,
        seconds: 20,
        release: "1.12.1".to_owned(),
    };
    for (name, theirs, original) in [
        ("highway", 3.7, &on_highway("original") as &dyn Env),
        ("roundabout", 34.0, &on_roundabout("original")),
    ] {
        let ours = steps_per_second(original, STEPS / 100);
        println!("{name}: {:.1} k steps/s, {:.0} times highway-env", ours / 1e3, ours / theirs);
    }
    for task in ["single", "adversarial", "multi"] {
        let ours = steps_per_second(&on_highway(task), STEPS / 100);
        println!("highway {task}: {:.1} k steps/s", ours / 1e3);
    }
    let ours = steps_per_second(&on_roundabout("exit"), STEPS / 100);
    println!("roundabout exit: {:.1} k steps/s", ours / 1e3);
}

#[expect(clippy::print_stdout, reason = "a benchmark tells what it measured")]
fn report(name: &str, env: &dyn Env) {
    println!("{name}: {:.1} M steps/s", steps_per_second(env, STEPS) / 1e6);
}

fn steps_per_second(env: &dyn Env, n_steps: u32) -> f64 {
    let spec = env.spec().expect("a world");
    let Actions::Discrete(names) = &spec.does else { panic!("a world of discrete actions") };
    let n_actions = u32::try_from(names.len()).expect("a few");
    let mut world = env.open().expect("a world");
    let mut seen = Columns::zeros(spec.sees, 1);
    let (mut told, mut length) = (vec![0.0; spec.tells.len()], 0);
    let [mut luck, mut choices] = [0, 1].map(|seed| Luck::from(ChaCha8Rng::seed_from_u64(seed)));

    world.reset(&mut luck, &mut Row::of(&mut seen, 0, &mut told));
    let times = (0..TIMES).map(|_| {
        let start = Instant::now();
        for _ in 0..n_steps {
            let act = Act::Index(choices.below(n_actions) as usize);
            let mut row = Row::of(&mut seen, 0, &mut told);
            let (_, end) = world.step(act, &mut luck, &mut row);
            length += 1;
            if end != End::No || spec.limit.is_some_and(|limit| length >= limit) {
                length = 0;
                world.reset(&mut luck, &mut row);
            }
        }
        start.elapsed().as_secs_f64()
    });
    f64::from(n_steps) / times.fold(f64::INFINITY, f64::min)
}
