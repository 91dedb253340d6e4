//! What training allocates: nothing of size after the first steps, and no more than it says.

#[path = "training/nets.rs"]
mod nets;

use std::sync::atomic::{AtomicIsize, AtomicUsize, Ordering::SeqCst};
use std::sync::{Mutex, MutexGuard, Once, PoisonError};

use ivx_library::artifact::Dataset;
use ivx_library::learner::{Learner as _, MapEstimate, Normal};
use ivx_library::nn::{Mlp, Tanh};
use ivx_op::{Artifact as _, Ctx};
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

/// Counts what is allocated while a test is counting, on its thread.
struct Counter;

impl AllocationTracker for Counter {
    fn allocated(&self, _: usize, size: usize, _: usize, group: AllocationGroupId) {
        if group.as_usize().get() == GROUP.load(SeqCst) {
            LARGEST.fetch_max(size, SeqCst);
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

/// The most bytes that training and encoding a member holds at once, and what it is foreseen to.
fn peak_and_estimate(hidden: &[usize], n: u32) -> (f64, f64) {
    let learner = MapEstimate {
        net: Box::new(Mlp { hidden: hidden.to_vec(), activation: Box::new(Tanh {}) }),
        prior: Box::new(Normal { mean: 0.0, std: 1.0 }),
        noise: 0.1,
        optimiser: nets::optimiser(),
    };
    let data = Dataset {
        x: (0..n).map(f64::from).collect(),
        y: (0..n).map(|i| f64::from(i % 2)).collect(),
    };
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
    (bytes(peak.cast_unsigned() as u64), bytes(learner.memory(16 * u64::from(n))))
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
