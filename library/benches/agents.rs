//! How many steps a second agents take and learn from, by processor time:
//! `cargo bench -p ivx-library --bench agents -- [NAME] [STEPS]`. And what they come to, as the peers tell it:
//! `-- returns GAME STEPS SEED` for the mean return of the last 50 episodes of learning.
//!
//! The four are those of `benches/agents.sh`, which runs `PyTorch` and JAX beside them. A line each: all of a training
//! after its warm-up, acting, worlds and learning together.

use std::fs;

use ivx_library::agent::{Learn, Learned, Method, Span};
use ivx_op::{Ctx, Lit, Literal as _, Op as _, Part};
use ivx_world::Env;

struct Job {
    name: &'static str,
    how: Part,
    env: Part,
    lanes: usize,
    warm_up: u64,
    steps: u64,
}

#[expect(clippy::print_stdout, reason = "a bench tells what it measured")]
fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|arg| arg != "--bench").collect();
    if let [what, game, steps, seed] = &args[..]
        && what == "returns"
    {
        let [job, ..] = jobs();
        let env = Part::new("minatar").with("game", game.as_str());
        let (job, n) = (Job { env, ..job }, steps.parse().expect("a number of steps"));
        let played = run(&job, n, seed.parse().expect("a seed")).played.values;
        let last = &played[played.len().saturating_sub(50)..];
        println!("dqn {game}, seed {seed}: {:.2}", ivx_math::moments::mean(last));
        return;
    }
    for job in jobs() {
        if args.first().is_some_and(|wanted| !job.name.contains(wanted.as_str())) {
            continue;
        }
        let steps = args.get(1).and_then(|arg| arg.parse().ok()).unwrap_or(job.steps);
        let spent = |steps| {
            let before = processor_time();
            run(&job, steps, 0);
            processor_time() - before
        };
        let warm = if job.warm_up == 0 { 0.0 } else { spent(job.warm_up) };
        #[expect(clippy::cast_precision_loss, reason = "steps are few")]
        let (n, us) = (steps as f64, 1e6);
        let took = (0..3).map(|_| spent(job.warm_up + steps) - warm).fold(f64::INFINITY, f64::min);
        println!(
            "{}: {:.0} env steps/s of CPU, {:.2} us a step",
            job.name,
            n / took,
            took / n * us
        );
    }
}

/// Seconds of the processor that this process took.
fn processor_time() -> f64 {
    let told = fs::read_to_string("/proc/self/schedstat").expect("Linux tells it");
    let ns: f64 = told.split(' ').next().and_then(|ns| ns.parse().ok()).expect("nanoseconds");
    ns * 1e-9
}

fn run(job: &Job, steps: u64, seed: i64) -> Learned {
    let registry = ivx_library::registry();
    let lit = |part: &Part| Lit::Part(registry.complete(part));
    let steps = i64::try_from(steps).expect("few");
    let learn = Learn {
        how: Box::<dyn Method>::from_lit(&lit(&job.how)).expect("a method"),
        r#in: Box::<dyn Env>::from_lit(&lit(&job.env)).expect("a world"),
        r#for: Box::<dyn Span>::from_lit(&lit(&Part::new("steps").with("n", steps)))
            .expect("a span"),
        every: 0,
        trials: 1,
        lanes: job.lanes,
    };
    learn.run(&Ctx::new("learn", seed, None)).expect("it learns")
}

fn jobs() -> [Job; 4] {
    let relu = || Part::new("relu");
    let torso = || {
        Part::new("cnn")
            .with("channels", vec![16_i64])
            .with("kernels", vec![3_i64])
            .with("hidden", vec![128_i64])
            .with("activation", relu())
    };
    let game = |name: &str| Part::new("minatar").with("game", name);
    let ppo = || Part::new("ppo").with("n_steps", 128_i64);
    [
        Job {
            name: "dqn breakout",
            how: Part::new("dqn").with("net", torso()),
            env: game("breakout"),
            lanes: 1,
            warm_up: 5_000,
            steps: 50_000,
        },
        Job {
            name: "ppo cart_pole x64",
            how: ppo(),
            env: Part::new("cart_pole"),
            lanes: 64,
            warm_up: 0,
            steps: 64 * 128 * 20,
        },
        Job {
            name: "ppo breakout x64",
            how: ppo().with("net", torso()).with("shared", true).with("minibatches", 8_i64),
            env: game("breakout"),
            lanes: 64,
            warm_up: 0,
            steps: 64 * 128 * 4,
        },
        Job {
            name: "a2c cart_pole x16",
            how: Part::new("a2c"),
            env: Part::new("cart_pole"),
            lanes: 16,
            warm_up: 0,
            steps: 16 * 5 * 1000,
        },
    ]
}
