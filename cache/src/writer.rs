//! What is put into a second store while a run goes on, by threads of its own.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use crate::{Fetched, Objects, Record, Second};

/// So many records may wait, in a few dozen MB; who comes with more waits too.
const N_WAITING: usize = 10_000;

/// Puts records into a second store, each after its object.
///
/// Dropping it leaves what is not put; what is being put ends, or the process does.
#[derive(Debug)]
pub(crate) struct Writer {
    second: Arc<Second>,
    /// Where the bytes are.
    objects: Objects,
    line: Arc<Line>,
    has_threads: bool,
}

#[derive(Debug, Default)]
struct Line {
    state: Mutex<State>,
    came: Condvar,
    went: Condvar,
}

#[derive(Debug, Default)]
struct State {
    waiting: VecDeque<Record>,
    /// How many are being put.
    under_way: usize,
    ended: bool,
}

impl Writer {
    /// - `objects`: the bytes of outputs, without those of the store.
    pub(crate) fn new(second: Arc<Second>, objects: Objects) -> Self {
        Self { second, objects, line: Arc::default(), has_threads: false }
    }

    /// Lets a record be put there soon.
    pub(crate) fn put(&mut self, record: Record) {
        if !self.has_threads {
            self.has_threads = true;
            for _ in 0..self.second.n_at_once() {
                let (second, objects) = (Arc::clone(&self.second), self.objects.clone());
                let line = Arc::clone(&self.line);
                let work = move || while line.take(|record| put(&second, &objects, &record)) {};
                if thread::Builder::new().spawn(work).is_err() {
                    break;
                }
            }
        }
        let full = |state: &mut State| state.waiting.len() >= N_WAITING;
        let state = self.line.went.wait_while(self.line.state(), full);
        state.unwrap_or_else(PoisonError::into_inner).waiting.push_back(record);
        self.line.came.notify_one();
    }

    /// Waits until all is put, but not longer than so; how many records are left.
    pub(crate) fn wait(&self, patience: Duration) -> usize {
        let left = |state: &State| state.waiting.len() + state.under_way;
        let some = |state: &mut State| left(state) > 0;
        let waited = self.line.went.wait_timeout_while(self.line.state(), patience, some);
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        left(&state)
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        let mut state = self.line.state();
        state.ended = true;
        state.waiting.clear();
        self.line.came.notify_all();
    }
}

impl Line {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Does `work` with the next record; whether there was one, or this has ended.
    fn take(&self, work: impl FnOnce(Record)) -> bool {
        let none = |state: &mut State| state.waiting.is_empty() && !state.ended;
        let state = self.came.wait_while(self.state(), none);
        let mut state = state.unwrap_or_else(PoisonError::into_inner);
        let Some(record) = state.waiting.pop_front() else { return false };
        state.under_way += 1;
        drop(state);
        let _done = UnderWay(self);
        work(record);
        true
    }
}

/// A record that is being put, until this is dropped.
struct UnderWay<'a>(&'a Line);

impl Drop for UnderWay<'_> {
    fn drop(&mut self) {
        self.0.state().under_way -= 1;
        self.0.went.notify_all();
    }
}

/// Puts a record there, after its object; not one whose bytes are nowhere.
fn put(second: &Second, objects: &Objects, record: &Record) {
    if record.output.inline.is_none() {
        let _alone = second.alone(&record.output);
        match objects.read(&record.output) {
            Ok(Fetched::Bytes(bytes)) => second.put_object(&record.output.digest, &bytes),
            // The run meets the same, and tells.
            _ if !second.has(&record.output) => return,
            _ => {}
        }
    }
    second.put_record(record);
}
