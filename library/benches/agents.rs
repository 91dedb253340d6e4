//! How many steps a second agents take and learn from, by processor time:
//! `cargo bench -p ivx-library --bench agents -- [NAME] [STEPS]`. And what they come to, as the peers tell it:
//! `-- returns GAME STEPS SEED` for the mean return of the last 50 episodes of learning.
//!
//! They are those of `benches/agents.sh` and `benches/psi_phi.sh`, which run `PyTorch` and JAX beside them. A line each:
//! all of a training after its warm-up, acting, worlds and learning together. A step of `psi_phi` is an update and one of
//! its world, whose action is drawn.

use std::fs;

use ivx_data::{Demonstrations, End, Trajectories, Values};
use ivx_library::agent::{Learn, Learned, Method, Span};
use ivx_op::{Artifact as _, Ctx, Gathered, Held, Lit, Literal as _, Op as _, Part};
use ivx_world::Env;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

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

fn jobs() -> [Job; 5] {
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
        Job {
            name: "psi_phi highway",
            how: psi_phi(),
            env: highway(),
            lanes: 1,
            warm_up: 2_000,
            steps: 100,
        },
    ]
}

fn highway() -> Part {
    Part::new("highway").with("task", "multi")
}

/// As Table B.1 has it, with five others.
fn psi_phi() -> Part {
    let lr = Part::new("constant").with("value", 1e-3);
    let torso = Part::new("mlp").with("hidden", vec![512_i64, 256]);
    let by = Part::new("dqn")
        .with("net", torso.with("activation", Part::new("relu")))
        .with("discount", 1.0)
        .with("n_step", 4_i64)
        .with("batch", 512_i64)
        .with("warm_up", 2_000_i64)
        .with("every", 1_i64)
        .with("target", Part::new("copied").with("every", 100_i64))
        .with("epsilon", Part::new("constant").with("value", 1.0))
        .with("optimiser", Part::new("adam").with("lr", lr));
    Part::new("psi_phi")
        .with("shown", shown(5))
        .with("by", by)
        .with("cumulants", vec![128_i64, 128])
        .with("features", vec![256_i64, 128])
        .with("width", 8_i64)
}

/// What so many others saw and did, drawn evenly: a hundred episodes of forty steps each.
fn shown(n: usize) -> Lit {
    let env = ivx_library::registry().complete(&highway());
    let env = Box::<dyn Env>::from_lit(&Lit::Part(env)).expect("a world");
    let spec = env.spec().expect("it is one");
    let n_actions = spec.does.n_discrete().expect("they are").try_into().expect("few");
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut paths = Trajectories::new(spec.sees, spec.does);
    paths.episodes = vec![(40, End::Limit); 100 * n];
    paths.seen.resize(41 * 100 * n);
    paths.acts.resize(40 * 100 * n);
    let (Values::F32(seen), _) = paths.seen.values_mut(0) else { panic!("it sees numbers") };
    seen.fill_with(|| rng.random_range(-1.0..1.0));
    let (Values::Index(acts), _) = paths.acts.values_mut(0) else { panic!("they are discrete") };
    acts.fill_with(|| rng.random_range(0..n_actions));
    let names = (0..n).map(|k| k.to_string()).collect();
    let whose = (0..100 * n).map(|i| i / 100).collect();
    let shown = Demonstrations { paths, names, whose };
    let values = vec![shown.encode().into()];
    Lit::Held(Held::Value(Gathered { dims: Vec::new(), values, name: String::new() }))
}
