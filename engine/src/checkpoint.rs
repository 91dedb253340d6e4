//! Where one node keeps its progress, and whom it tells of it.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use ivx_cache::{Checkpoints, Digest};
use ivx_op::Progress;

use crate::stop::Stop;

/// How much longer a node computes than it takes to keep its state, at least.
const WORTH: u32 = 50;

/// How often a node tells of itself.
const TELL: Duration = Duration::from_millis(250);

/// How a node goes about its progress.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace<'a> {
    /// How much time lies between two states that are kept, at least.
    pub(crate) every: Duration,
    /// How long it may compute.
    pub(crate) limit: Option<Duration>,
    /// Whether it is to end.
    pub(crate) stop: &'a Stop,
}

/// What a node tells: how many of how many steps are done, and how it goes.
pub(crate) type Tell<'a> = &'a (dyn Fn(u64, u64, &str) + Sync);

/// The progress of one node: kept under its key, the platform and the build, so that no other
/// computation takes it for its own.
pub(crate) struct Checkpoint<'a> {
    store: Checkpoints,
    key: Digest,
    platform: &'a str,
    build: &'a str,
    pace: Pace<'a>,
    tell: Tell<'a>,
    began: Instant,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    /// Whether something was asked for or kept; most nodes are too short for that.
    used: bool,
    /// How long the node computed before this process took it up.
    before: Duration,
    /// When the next state is kept.
    due: Instant,
    /// When the one at hand was asked for.
    asked: Instant,
    told: Instant,
}

impl<'a> Checkpoint<'a> {
    /// That of a node that begins now.
    pub(crate) fn new(
        store: Checkpoints,
        key: Digest,
        (platform, build): (&'a str, &'a str),
        pace: Pace<'a>,
        tell: Tell<'a>,
    ) -> Self {
        let began = Instant::now();
        let (due, before) = (began + pace.every, Duration::ZERO);
        let state = State { used: false, before, due, asked: began, told: began };
        Self { store, key, platform, build, pace, tell, began, state: Mutex::new(state) }
    }

    /// How long the node has computed, in this process and before.
    pub(crate) fn elapsed(&self) -> Duration {
        self.state().before + self.began.elapsed()
    }

    /// Whether it has computed for as long as it may.
    pub(crate) fn is_over(&self) -> bool {
        self.pace.limit.is_some_and(|limit| self.began.elapsed() >= limit)
    }

    /// Forgets what was kept: the node has its result.
    pub(crate) fn remove(&self) {
        if self.state().used {
            self.store.remove(&self.name());
        }
    }

    /// What it is kept under. Who asks uses it.
    fn name(&self) -> Digest {
        self.state().used = true;
        let Self { key, platform, build, .. } = self;
        Digest::of(format!("{key} {platform} {build}").as_bytes())
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl std::fmt::Debug for Checkpoint<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Checkpoint").field("key", &self.key).field("pace", &self.pace).finish()
    }
}

impl Progress for Checkpoint<'_> {
    fn load(&self) -> Option<Vec<u8>> {
        let kept = self.store.load(&self.name())?;
        let (millis, state) = kept.split_first_chunk::<8>()?;
        self.state().before = Duration::from_millis(u64::from_le_bytes(*millis));
        Some(state.to_vec())
    }

    fn due(&self) -> bool {
        let (now, mut state) = (Instant::now(), self.state());
        state.asked = now;
        now >= state.due
    }

    fn save(&self, state: Vec<u8>) {
        let millis = u64::try_from(self.elapsed().as_millis()).unwrap_or(u64::MAX);
        let kept = [&millis.to_le_bytes()[..], &state].concat();
        // A full disk will be told of when the result is written.
        self.store.save(&self.name(), &kept).ok();
        let mut state = self.state();
        let worth = state.asked.elapsed() * WORTH;
        // Without an interval, every step is asked for.
        let wait =
            if self.pace.every.is_zero() { Duration::ZERO } else { self.pace.every.max(worth) };
        state.due = Instant::now() + wait;
    }

    fn stopping(&self) -> bool {
        self.pace.stop.asked() || self.is_over()
    }

    fn listens(&self) -> bool {
        let (now, mut state) = (Instant::now(), self.state());
        let is_time = now - state.told >= TELL;
        if is_time {
            state.told = now;
        }
        is_time
    }

    fn tell(&self, done: u64, of: u64, words: &str) {
        (self.tell)(done, of, words);
    }
}

#[cfg(test)]
mod tests {
    use std::thread::sleep;

    use ivx_cache::Cache;

    use super::*;

    fn with<T>(every: Duration, limit: Option<Duration>, work: impl Fn(&Checkpoint) -> T) -> T {
        let root = tempfile::tempdir().unwrap();
        let cache = Cache::open(root.path(), "here").unwrap();
        let stop = Stop::default();
        let pace = Pace { every, limit, stop: &stop };
        let key = Digest::of(b"key");
        work(&Checkpoint::new(cache.checkpoints(), key, ("here", "now"), pace, &|_, _, _| {}))
    }

    #[test]
    fn what_was_computed_before_counts() {
        with(Duration::ZERO, None, |first| {
            sleep(Duration::from_millis(30));
            first.save(b"state".to_vec());
            let next = Checkpoint::new(
                first.store.clone(),
                first.key,
                (first.platform, first.build),
                first.pace,
                first.tell,
            );
            assert_eq!(next.load().as_deref(), Some(&b"state"[..]));
            assert!(next.elapsed() >= Duration::from_millis(30), "{:?}", next.elapsed());
            next.remove();
            assert_eq!(next.load(), None);
        });
    }

    #[test]
    fn what_costs_much_to_keep_is_kept_seldom() {
        with(Duration::from_millis(1), None, |node| {
            node.due();
            sleep(Duration::from_millis(20));
            node.save(Vec::new());
            let wait = node.state().due - Instant::now();
            assert!(wait >= Duration::from_millis(900), "{wait:?}");
            assert!(!node.due());
        });
        with(Duration::ZERO, None, |node| {
            node.save(Vec::new());
            assert!(node.due());
        });
        with(Duration::from_mins(1), None, |node| {
            node.save(Vec::new());
            assert!(node.state().due - Instant::now() > Duration::from_secs(50));
        });
    }

    #[test]
    fn a_node_ends_at_its_limit_or_when_the_run_does() {
        with(Duration::ZERO, Some(Duration::ZERO), |node| assert!(node.stopping()));
        with(Duration::ZERO, Some(Duration::from_mins(1)), |node| {
            assert!(!node.stopping() && !node.is_over());
            node.pace.stop.ask();
            assert!(node.stopping() && !node.is_over());
        });
    }
}
