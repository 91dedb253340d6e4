//! How many steps a second worlds of Gymnasium take through the bridge, with actions drawn evenly: by the clock, and by
//! processor time of both processes. `IVX_PYTHON=python cargo bench -p ivx-foreign -- [NAME]`.
//!
//! `bridge.py` beside it runs Gymnasium's own vector environments alike; `benches/agents.sh` runs both in turn.

use std::fs;
use std::path::Path;
use std::time::Instant;

use ivx_foreign::{Gymnasium, look_up};
use ivx_op::{Args, Ctx, Fields, Foreign, How};
use ivx_world::{Actions, Lanes, Luck};

/// For how many seconds steps are counted, how often: the best counts, since others may want the same cores.
const SECONDS: f64 = 0.5;
const TIMES: u32 = 12;

#[expect(clippy::print_stdout, reason = "a bench tells what it measured")]
fn main() {
    let Some(python) = std::env::var_os("IVX_PYTHON") else {
        println!("without IVX_PYTHON, a Python that has gymnasium, nothing is measured");
        return;
    };
    let args: Vec<String> = std::env::args().skip(1).filter(|arg| arg != "--bench").collect();
    let name = args.first().map_or("CartPole-v1", String::as_str);
    let found = look_up(Path::new(&python), name, &Args::new(), 60.0);
    let world = Gymnasium {
        name: Foreign(found.unwrap_or_else(|why| panic!("{name}: {why}"))),
        kwargs: Fields::default(),
        python: How("python3".to_owned()),
        time_limit: How(60.0),
    };
    for n in [1, 8, 64] {
        let (clock, processor) = measure(&world, n);
        println!("{name} bridge x{n}: {clock:.0} steps/s, {processor:.0} steps/s of CPU");
    }
}

/// Steps a second, by the clock and by processor time.
fn measure(world: &Gymnasium, n: u32) -> (f64, f64) {
    let ctx = Ctx::new("learn", 0, None);
    let mut lanes = Lanes::open(world, n as usize, &ctx, ("learn", 0)).expect("worlds");
    let mut draws = Luck::numpy(0);
    let mut step = |lanes: &mut Lanes<'_>| {
        let n_actions = match &lanes.spec().does {
            Actions::Discrete(names) => u32::try_from(names.len()).expect("few"),
            Actions::Continuous { .. } => 0,
        };
        let acts = lanes.choose().1;
        acts.places.iter_mut().for_each(|place| *place = draws.below(n_actions) as usize);
        lanes.step().expect("they go on");
        lanes.finished();
    };
    (0..100).for_each(|_| step(&mut lanes));
    let times = (0..TIMES).map(|_| {
        let (start, before) = (Instant::now(), processor_time());
        let mut steps = 0.0;
        while start.elapsed().as_secs_f64() < SECONDS {
            (0..20).for_each(|_| step(&mut lanes));
            steps += 20.0 * f64::from(n);
        }
        (steps / start.elapsed().as_secs_f64(), steps / (processor_time() - before))
    });
    times.fold((0.0, 0.0), |best, one| (best.0.max(one.0), best.1.max(one.1)))
}

/// Seconds of the processor that this process and those that it started took.
fn processor_time() -> f64 {
    let of = |id: &str| {
        let told = fs::read_to_string(Path::new("/proc").join(id).join("schedstat"));
        let ns = told.ok().and_then(|told| told.split(' ').next()?.parse::<f64>().ok());
        ns.unwrap_or_default() * 1e-9
    };
    let children = fs::read_to_string("/proc/thread-self/children").expect("Linux tells it");
    of("self") + children.split_whitespace().map(of).sum::<f64>()
}
