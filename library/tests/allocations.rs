//! What training allocates: nothing of size after the first steps, and no more than it says.

#[path = "training/nets.rs"]
mod nets;

use std::sync::atomic::{AtomicIsize, AtomicUsize, Ordering::SeqCst};
use std::sync::{Mutex, MutexGuard, Once, PoisonError};

use ivx_data::{Dataset, Form};
use ivx_library::agent::tabular::{TabularModel, UniformPolicy};
use ivx_library::agent::{Act, Agent, Learn, Method, Steps, Tabular};
use ivx_library::ke::Wcm;
use ivx_library::learner::{Learner, MapEstimate, Normal};
use ivx_library::planner::{Goals, Imitated, Objective, Planner, Space};
use ivx_nn::{Imitative, Imitators, Mlp, PlanNets, Squared, Tanh};
use ivx_op::{Artifact as _, Ctx, Lit, Literal as _, One, Op as _, Part};
use ivx_world::{Copying, Env, Glyphs, Gridworld, Lanes, Luck, Task};
use nets::{TASKS, Training};
use tracking_allocator::{
    AllocationGroupId, AllocationGroupToken, AllocationRegistry, AllocationTracker, Allocator,
};

#[global_allocator]
static ALLOCATOR: Allocator<std::alloc::System> = Allocator::system();

/// Buffers above so many bytes are to be used again.
const SMALL: usize = 1024;

/// The group that is counted: what other threads free is none of it.
static GROUP: AtomicUsize = AtomicUsize::new(0);
static LIVE: AtomicIsize = AtomicIsize::new(0);
static PEAK: AtomicIsize = AtomicIsize::new(0);
static LARGEST: AtomicUsize = AtomicUsize::new(0);
/// How many buffers above [`SMALL`] there were.
static LARGE: AtomicUsize = AtomicUsize::new(0);
/// How many buffers there were.
static ANY: AtomicUsize = AtomicUsize::new(0);

/// Counts what is allocated while a test is counting, on its thread.
struct Counter;

impl AllocationTracker for Counter {
    fn allocated(&self, _: usize, size: usize, _: usize, group: AllocationGroupId) {
        if group.as_usize().get() == GROUP.load(SeqCst) {
            ANY.fetch_add(1, SeqCst);
            LARGEST.fetch_max(size, SeqCst);
            LARGE.fetch_add(usize::from(size > SMALL), SeqCst);
            let live = LIVE.fetch_add(size.cast_signed(), SeqCst) + size.cast_signed();
            PEAK.fetch_max(live, SeqCst);
        }
    }

    fn deallocated(
        &self,
        _: usize,
        size: usize,
        _: usize,
        source: AllocationGroupId,
        _: AllocationGroupId,
    ) {
        if source.as_usize().get() == GROUP.load(SeqCst) {
            LIVE.fetch_sub(size.cast_signed(), SeqCst);
        }
    }
}

/// What `run` gives, while what it allocates is counted, and nothing else is.
fn counted<R>(run: impl FnOnce() -> R) -> R {
    static START: Once = Once::new();
    static ALONE: Mutex<()> = Mutex::new(());
    let _alone: MutexGuard<'_, ()> = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    START.call_once(|| {
        AllocationRegistry::set_global_tracker(Counter).expect("nothing else counts");
        AllocationRegistry::enable_tracking();
    });
    let mut group = AllocationGroupToken::register().expect("there are few groups");
    GROUP.store(group.id().as_usize().get(), SeqCst);
    LIVE.store(0, SeqCst);
    PEAK.store(0, SeqCst);
    LARGEST.store(0, SeqCst);
    LARGE.store(0, SeqCst);
    ANY.store(0, SeqCst);
    let _guard = group.enter();
    run()
}

#[test]
fn allocations_are_counted() {
    let (live, peak, largest) = counted(|| {
        let mut buffer = vec![1_u8; 5000];
        drop(std::hint::black_box(vec![1_u8; 300]));
        buffer.push(2);
        std::hint::black_box(&buffer);
        (LIVE.load(SeqCst), PEAK.load(SeqCst), LARGEST.load(SeqCst))
    });
    assert_eq!((live, largest), (10_000, 10_000));
    assert_eq!(peak, 15_000, "a buffer that grows is there twice");
}

#[test]
fn steps_after_the_first_allocate_no_buffer_and_nothing_that_stays() {
    for (name, task) in TASKS {
        counted(|| {
            let mut training = Training::new(task(0));
            let first = training.step();
            assert!(LARGEST.load(SeqCst) > SMALL, "{name}: the first step makes its buffers");
            let live = LIVE.load(SeqCst);
            LARGEST.store(0, SeqCst);
            let mut last = first;
            for _ in 0..20 {
                last = training.step();
                assert_eq!(LIVE.load(SeqCst), live, "{name}: memory grows at {}", training.t);
            }
            let largest = LARGEST.load(SeqCst);
            assert!(largest <= SMALL, "{name}: a buffer of {largest} bytes");
            assert!(last < first, "{name} learns nothing: {first} and then {last}");
        });
    }
}

/// Networks as a spec describes them, on batches of their data.
fn described() -> [(Part, Dataset); 3] {
    let list = |parts: Vec<Part>| {
        let parts = parts.into_iter().map(Lit::from).collect();
        Part::new("sequence").with("layers", Lit::List(parts))
    };
    let drawn = |task: &dyn Task| {
        let mut rng = Ctx::new("examples", 0, None).rng("examples", &[]);
        let mut data = Dataset { form: task.form(), ..Dataset::default() };
        for _ in 0..20 {
            let (x, y) = task.draw(&mut rng);
            data.x.extend(x);
            data.y.extend(y);
        }
        data
    };
    let block = Part::new("inverted_residual").with("channels", 300_i64);
    let images = list(vec![
        Part::new("conv").with("channels", 8_i64),
        block,
        Part::new("max_pool"),
        Part::new("flatten"),
        Part::new("layer_norm"),
        Part::new("dropout"),
    ]);
    let sequences = list(vec![Part::new("lstm").with("units", 8_i64), Part::new("gru")]);
    [
        (images, drawn(&Glyphs { noise: 0.1 })),
        (Part::new("impala"), drawn(&Glyphs { noise: 0.1 })),
        (sequences, drawn(&Copying { length: 2, delay: 60, symbols: 3 })),
    ]
}

#[test]
fn more_steps_take_no_more_buffers() {
    let registry = ivx_library::registry();
    for (net, data) in described() {
        let learner = Part::new("map_estimate")
            .with("net", net.clone())
            .with("loss", Part::new("cross_entropy"))
            .with("batch", 8_i64);
        let learner = Lit::from(registry.complete(&learner));
        let learner = Box::<dyn Learner>::from_lit(&learner).expect("it is a learner");
        let large = |steps| {
            counted(|| {
                learner.train(&data, steps, &Ctx::new("train", 0, None)).expect("there are data");
                LARGE.load(SeqCst)
            })
        };
        large(1);
        assert_eq!(large(3), large(9), "{net}");
    }
}

#[test]
fn more_epochs_of_a_table_take_no_more_buffers() {
    let ctx = Ctx::new("tabular", 0, None);
    let world = || Box::new(Gridworld { size: 5, wind: 0.1 });
    let policy = One(UniformPolicy { r#in: world() }.run(&ctx).expect("it is a world"));
    let stream = "main".to_owned();
    let actor = Box::new(Tabular { policy: policy.clone() });
    let act = Act { actor, r#in: world(), episodes: 25, limit: 20, stream, keeps: Vec::new() };
    let from = One(act.run(&ctx).expect("it acts"));
    let large = |epochs| {
        let (batch, member, bootstrap) = (128, 0, false);
        let (from, optimiser) = (from.clone(), nets::optimiser());
        let model = TabularModel { from, optimiser, epochs, batch, member, bootstrap };
        counted(|| {
            model.run(&ctx).expect("there are steps");
            LARGE.load(SeqCst)
        })
    };
    large(1);
    assert_eq!(large(2), large(40));
}

/// The most bytes that training and encoding a member holds at once, and what it is foreseen to.
fn peak_and_estimate(hidden: &[usize], n: u32) -> (f64, f64) {
    let learner = MapEstimate {
        net: Box::new(Mlp { hidden: hidden.to_vec(), activation: Box::new(Tanh {}) }),
        prior: Box::new(Normal { mean: 0.0, std: 1.0 }),
        loss: Box::new(Squared { noise: 0.1 }),
        batch: 0,
        adversarial: 0.0,
        optimiser: nets::optimiser(),
    };
    let x = (0..n).map(f64::from).collect();
    let data = Dataset::pairs(x, (0..n).map(|i| f64::from(i % 2)).collect());
    let run = || {
        let model = learner.train(&data, 3, &Ctx::new("train", 0, None)).expect("there are data");
        std::hint::black_box(model.encode());
    };
    // A thread keeps the room in which it multiplies: that is no member's.
    run();
    let peak = counted(|| {
        run();
        PEAK.load(SeqCst)
    });
    let bytes = |n: u64| f64::from(u32::try_from(n).expect("it is below 4 GB"));
    (bytes(peak.cast_unsigned() as u64), bytes(learner.memory(&Form::default(), u64::from(n))))
}

/// Of parameters and moments, and of activations: now these are the most, now those.
#[test]
fn a_member_takes_no_more_than_it_says() {
    for (hidden, n) in
        [(&[400, 400][..], 10), (&[60, 60], 3000), (&[256, 256], 500), (&[8], 20_000)]
    {
        let (peak, estimate) = peak_and_estimate(hidden, n);
        eprintln!("{hidden:?} on {n} pairs: {peak} bytes at most, {estimate} foreseen");
        let share = peak / estimate;
        assert!((0.6..1.0).contains(&share), "{hidden:?} on {n}: {peak} of {estimate} bytes");
    }
}

/// An agent of one game as it has learned to act.
fn agent(how: &Part, lanes: usize) -> (Agent, Box<dyn Env>) {
    let registry = ivx_library::registry();
    let lit = |part: &Part| Lit::Part(registry.complete(part));
    let game = Part::new("minatar").with("game", "breakout");
    let env = || Box::<dyn Env>::from_lit(&lit(&game)).expect("a world");
    let learn = Learn {
        how: Box::<dyn Method>::from_lit(&lit(how)).expect("a method"),
        r#in: env(),
        r#for: Box::new(Steps { n: 16 }),
        every: 0,
        trials: 1,
        lanes,
    };
    (learn.run(&Ctx::new("learn", 0, None)).expect("it learns").agent, env())
}

#[test]
fn who_acts_asks_for_no_buffer() {
    let torso = Part::new("cnn")
        .with("channels", vec![16_i64])
        .with("kernels", vec![3_i64])
        .with("hidden", vec![128_i64]);
    let shared = Part::new("ppo").with("shared", true).with("n_steps", 8_i64);
    for how in [Part::new("dqn"), shared.with("minibatches", 1_i64)] {
        let (agent, env) = agent(&how.with("net", torso.clone()), 1);
        let ctx = Ctx::new("act", 0, None);
        for lanes in [1, 8] {
            let mut lanes = Lanes::open(&*env, lanes, &ctx, ("evaluate", 0)).expect("worlds");
            let mut actor = agent.open();
            let mut rng = ctx.rng("act", &[]);
            let mut act = |lanes: &mut Lanes<'_>| {
                let (seen, acts) = lanes.choose();
                actor.act(seen, &mut rng, acts).expect("it acts");
            };
            act(&mut lanes);
            let asked = counted(|| {
                (0..100).for_each(|_| act(&mut lanes));
                ANY.load(SeqCst)
            });
            assert_eq!(asked, 0, "of {:?}", agent.acts);
        }
    }
}

/// Plans of three numbers for two problems, worth what they are near to 1.
struct Near(Space);

impl Objective for Near {
    fn rows(&self) -> usize {
        2
    }

    fn len(&self) -> usize {
        3
    }

    fn space(&self) -> &Space {
        &self.0
    }

    fn worth(&mut self, plans: &[f64], _: usize, worth: &mut [f64]) {
        for (plan, worth) in plans.chunks_exact(3).zip(worth) {
            *worth = -plan.iter().map(|x| (x - 1.0).powi(2)).sum::<f64>();
        }
    }

    fn slope(&mut self, plans: &[f64], worth: &mut [f64], slope: &mut [f64]) -> bool {
        self.worth(plans, 1, worth);
        slope.iter_mut().zip(plans).for_each(|(slope, x)| *slope = 2.0 * (1.0 - x));
        true
    }
}

#[test]
fn plans_after_the_first_ask_for_no_buffer() {
    let line = Space::Continuous { low: vec![-2.0; 3], high: vec![2.0; 3] };
    let cases = [
        ("gradient_plan", line.clone()),
        ("cem", line.clone()),
        ("cem", Space::Discrete(3)),
        ("random_shooting", line),
        ("random_shooting", Space::Discrete(3)),
        ("exhaustive", Space::Discrete(12)),
    ];
    for (name, space) in cases {
        let planner = Lit::Part(ivx_library::registry().complete(&Part::new(name)));
        let planner = Box::<dyn Planner>::from_lit(&planner).expect("a planner");
        let (mut of, mut planning) = (Near(space), planner.open());
        let mut luck = Luck::numpy(0);
        let (mut plans, mut worth) = ([0.0; 6], [0.0; 2]);
        let mut plan =
            || planning.plan(&mut of, &mut plans, &mut worth, &mut luck).expect("a plan");
        plan();
        let asked = counted(|| {
            (0..5).for_each(|_| plan());
            ANY.load(SeqCst)
        });
        assert_eq!(asked, 0, "{name}");
    }
}

/// Also where several networks say what plans are worth, by members that are climbed or by a library.
#[test]
fn plans_of_imitative_models_ask_for_no_buffer() {
    let form = Form { input: vec![3], target: vec![4, 2], ..Form::default() };
    let net = Mlp { hidden: vec![8], activation: Box::new(Tanh {}) };
    let nets = PlanNets { net: &net, features: 8, merge: &[8], units: 16, head: &[16, 8] };
    let ctx = Ctx::new("plans", 0, None);
    let drawn = |k: u64| {
        let mut rng = ctx.rng("init", &[&k.to_string()]);
        Imitative::drawn(&nets, &form, &mut rng).expect("it fits")
    };
    let models: Vec<Imitative> = (0..3).map(drawn).collect();
    let mut opened = Imitators::of(&models.iter().collect::<Vec<_>>(), &form);
    opened.see(&[0.5, -0.5, 1.0, 0.0, 0.25, -1.0]);
    for latent in [false, true] {
        for name in ["gradient_plan", "cem"] {
            let part = Lit::Part(ivx_library::registry().complete(&Part::new(name)));
            let mut planning = Box::<dyn Planner>::from_lit(&part).expect("a planner").open();
            let goals = Goals { places: vec![9.0, 1.0, 8.0, 0.0], dims: 2, std: 1.0 };
            let mut of = Imitated::new(&mut opened, &Wcm {}, Some(goals), latent);
            let mut luck = Luck::numpy(0);
            let (mut plans, mut worth) = ([0.0; 16], [0.0; 2]);
            let mut plan = || {
                plans.fill(0.0);
                planning.plan(&mut of, &mut plans, &mut worth, &mut luck).expect("a plan");
            };
            plan();
            let asked = counted(|| {
                (0..5).for_each(|_| plan());
                ANY.load(SeqCst)
            });
            assert_eq!(asked, 0, "{name}, {latent}");
        }
    }
}
