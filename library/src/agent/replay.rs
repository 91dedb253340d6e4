//! What an agent has seen, to be learned from again.

use ivx_data::{Columns, Field, Kind, Trajectories, Values, packed};
use ivx_nn::{Graph, Real as _, Var};
use ivx_op::State;
use ivx_world::{Act, End, Step};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::agent::seen_shape;

/// What became of the step that a row is of.
const GOES_ON: u8 = 0;
const TERMINAL: u8 = 1;
/// It was cut off, and what was seen last is the row behind it.
const CUT: u8 = 2;
/// The row is no step, but what was seen last.
const LAST: u8 = 3;

/// How many numbers a byte of bits makes.
const BITS: [[f32; 8]; 256] = bits();

const fn bits() -> [[f32; 8]; 256] {
    let mut all = [[0.0; 8]; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut bit = 0;
        while bit < 8 {
            if byte >> bit & 1 == 1 {
                all[byte][bit] = 1.0;
            }
            bit += 1;
        }
        byte += 1;
    }
    all
}

/// The last steps in each lane.
///
/// What is seen before a step and after it is kept once: what follows a row is the row behind it. Bits are kept as
/// bits, and indices and numbers as four bytes.
#[derive(Debug)]
pub(crate) struct Replay {
    sees: Vec<Field>,
    /// How many bytes of a row are what was seen.
    sight: usize,
    /// How many rows a lane keeps.
    rows: usize,
    lanes: Vec<Lane>,
    /// How many steps a target looks ahead.
    n_step: usize,
    discount: f64,
}

/// A ring of rows.
#[derive(Debug)]
struct Lane {
    seen: Vec<u8>,
    acts: Vec<u8>,
    rewards: Vec<u8>,
    ends: Vec<u8>,
    /// How many rows were ever written.
    written: u64,
}

impl Lane {
    fn reward(&self, row: usize) -> f32 {
        let bytes = &self.rewards[4 * row..][..4];
        f32::from_le_bytes(bytes.try_into().expect("four bytes"))
    }
}

/// What the target of a step looks at.
struct Target {
    /// The row of the step, and that of what was seen after the last step that it looks at.
    row: usize,
    after: usize,
    /// How many steps that are.
    span: usize,
    /// What they paid, discounted, and what is left of what follows.
    reward: f32,
    discount: f32,
}

/// Some steps, drawn evenly with replacement.
#[derive(Clone, Debug, Default)]
pub(crate) struct Batch {
    /// The lane and the place of each, and those of what was seen after the last step that its target looks at.
    pub(crate) rows: Vec<(usize, usize)>,
    pub(crate) next: Vec<(usize, usize)>,
    /// How many steps each target looks at.
    pub(crate) spans: Vec<usize>,
    /// What was done.
    pub(crate) acts: Vec<f32>,
    /// What the step itself paid.
    pub(crate) paid: Vec<f32>,
    /// What was paid from there on, discounted.
    pub(crate) rewards: Vec<f32>,
    /// What the worth of what follows weighs: 0 where nothing follows.
    pub(crate) discounts: Vec<f32>,
}

impl Replay {
    /// That of the last `capacity` steps of `lanes` lanes, whose targets look `n_step` steps ahead.
    pub(crate) fn new(
        sees: &[Field],
        (capacity, lanes): (usize, usize),
        (n_step, discount): (usize, f64),
    ) -> Self {
        let sight = sees.iter().map(kept).sum();
        let rows = (capacity / lanes).max(n_step + 2);
        let lane = || Lane {
            seen: Vec::new(),
            acts: Vec::new(),
            rewards: Vec::new(),
            ends: Vec::new(),
            written: 0,
        };
        let lanes = (0..lanes).map(|_| lane()).collect();
        Self { sees: sees.to_vec(), sight, rows, lanes, n_step, discount }
    }

    /// That of all steps of demonstrations, each of which pays `reward`; `n_step` and `discount` as in [`Replay::new`].
    ///
    /// What follows the last step of an episode that did not end is known, as it was seen.
    pub(crate) fn of(paths: &Trajectories, reward: f32, targets: (usize, f64)) -> Self {
        let Values::Index(acts) = paths.acts.values(0) else { panic!("discrete actions") };
        let mut replay = Self::new(paths.seen.fields(), (paths.seen.len(), 1), targets);
        for (seen, done, steps, end) in paths.each() {
            for t in 0..steps {
                let act = u8::try_from(acts[done + t]).expect("fewer than 256 actions");
                let became = match end {
                    _ if t + 1 < steps => GOES_ON,
                    End::Terminal => TERMINAL,
                    End::No | End::Limit => CUT,
                };
                replay.write(0, (&paths.seen, seen + t), (act, reward, became));
                if became == CUT {
                    replay.write(0, (&paths.seen, seen + steps), (0, 0.0, LAST));
                }
            }
        }
        replay
    }

    /// How many bytes one takes.
    pub(crate) fn bytes(sees: &[Field], capacity: usize) -> u64 {
        (capacity * (sees.iter().map(kept).sum::<usize>() + 1 + 4 + 1)) as u64
    }

    /// How many steps are kept, about.
    pub(crate) fn len(&self) -> u64 {
        self.lanes.iter().map(|lane| lane.written.min(self.rows as u64)).sum()
    }

    /// Adds a step of every lane.
    pub(crate) fn push(&mut self, step: &Step) {
        for lane in 0..self.lanes.len() {
            let Act::Index(act) = step.acts.get(lane) else { panic!("discrete actions") };
            let act = u8::try_from(act).expect("fewer than 256 actions");
            let end = match step.ends[lane] {
                End::No => GOES_ON,
                End::Terminal => TERMINAL,
                End::Limit => CUT,
            };
            self.write(lane, (&step.before, lane), (act, f32::of(step.rewards[lane]), end));
            if end == CUT {
                self.write(lane, (&step.after, lane), (0, 0.0, LAST));
            }
        }
    }

    fn write(
        &mut self,
        lane: usize,
        (seen, row): (&Columns, usize),
        (act, reward, end): (u8, f32, u8),
    ) {
        let (sight, rows) = (self.sight, self.rows);
        let lane = &mut self.lanes[lane];
        let place = usize::try_from(lane.written % rows as u64).expect("a place in memory");
        if lane.ends.len() == place && place < rows {
            grow(&mut lane.seen, sight, rows);
            grow(&mut lane.rewards, 4, rows);
            grow(&mut lane.acts, 1, rows);
            grow(&mut lane.ends, 1, rows);
            lane.seen.resize((place + 1) * sight, 0);
            lane.acts.push(0);
            lane.rewards.resize(4 * (place + 1), 0);
            lane.ends.push(0);
        }
        pack(seen, row, &mut lane.seen[place * sight..][..sight]);
        lane.acts[place] = act;
        lane.rewards[4 * place..][..4].copy_from_slice(&reward.to_le_bytes());
        lane.ends[place] = end;
        lane.written += 1;
    }

    /// Whether there is a step whose target is known.
    pub(crate) fn has_targets(&self) -> bool {
        self.lanes.iter().any(|lane| {
            let kept = lane.written.min(self.rows as u64);
            (lane.written - kept..lane.written).any(|at| self.target(lane, at).is_some())
        })
    }

    /// Draws steps whose targets are known, evenly and with replacement.
    ///
    /// # Panics
    /// If there are none.
    pub(crate) fn draw(&self, n: usize, rng: &mut ChaCha8Rng, batch: &mut Batch) {
        let Batch { rows, next, spans, acts, paid, rewards, discounts } = batch;
        rows.clear();
        next.clear();
        spans.clear();
        acts.clear();
        paid.clear();
        rewards.clear();
        discounts.clear();
        let total = self.len();
        let mut tries = 0_u64;
        while rows.len() < n {
            tries += 1;
            assert!(tries < 1000 * (n as u64 + 1000), "there are steps to learn from");
            let mut drawn = rng.random_range(0..total);
            let kept = |lane: &Lane| lane.written.min(self.rows as u64);
            let lane = self.lanes.iter().position(|lane| {
                let here = drawn < kept(lane);
                drawn -= if here { 0 } else { kept(lane) };
                here
            });
            let lane = lane.expect("fewer than all");
            let of = &self.lanes[lane];
            let Some(target) = self.target(of, of.written - kept(of) + drawn) else { continue };
            let Target { row, after, span, reward, discount } = target;
            rows.push((lane, row));
            next.push((lane, after));
            spans.push(span);
            acts.push(f32::from(of.acts[row]));
            paid.push(of.reward(row));
            rewards.push(reward);
            discounts.push(discount);
        }
    }

    /// That of row `at` of all that a lane ever wrote. None if it is no step, or not known yet.
    fn target(&self, lane: &Lane, at: u64) -> Option<Target> {
        let place = |at: u64| usize::try_from(at % self.rows as u64).expect("a place in memory");
        let (mut sum, mut weight) = (0.0, 1.0);
        for i in 0..self.n_step {
            let row = at + i as u64;
            let now = place(row);
            if row >= lane.written {
                return None;
            }
            match lane.ends[now] {
                // The end of a path that was cut off counts as far as it went.
                LAST if i == 0 => return None,
                LAST => break,
                end => {
                    sum += weight * f64::from(lane.reward(now));
                    weight *= self.discount;
                    let of = |after, weight| Target {
                        row: place(at),
                        after,
                        span: i + 1,
                        reward: f32::of(sum),
                        discount: f32::of(weight),
                    };
                    if end == TERMINAL {
                        return Some(of(now, 0.0));
                    }
                    if end == CUT || i + 1 == self.n_step {
                        return (row + 1 < lane.written).then(|| of(place(row + 1), weight));
                    }
                }
            }
        }
        None
    }

    /// The rows of the steps that the targets of some steps look at after these, those of one step after the other.
    pub(crate) fn along(&self, batch: &Batch, rows: &mut Vec<(usize, usize)>) {
        rows.clear();
        for ((lane, row), span) in batch.rows.iter().zip(&batch.spans) {
            rows.extend((1..*span).map(|i| (*lane, (row + i) % self.rows)));
        }
    }

    /// What was done in some rows.
    pub(crate) fn acts(&self, rows: &[(usize, usize)]) -> impl Iterator<Item = f32> {
        rows.iter().map(|(lane, row)| f32::from(self.lanes[*lane].acts[*row]))
    }

    /// What was seen in some rows, as a network sees it.
    pub(crate) fn look(&self, graph: &Graph<f32>, rows: &[(usize, usize)]) -> Var {
        graph.filled(seen_shape(&self.sees, rows.len()), |out| {
            let width = out.len() / rows.len();
            for (out, (lane, place)) in out.chunks_exact_mut(width).zip(rows) {
                unpack(&self.sees, &self.lanes[*lane].seen[place * self.sight..], out);
            }
        })
    }

    /// Walks over all rows.
    pub(crate) fn state(&mut self, state: &mut State) {
        for (i, lane) in self.lanes.iter_mut().enumerate() {
            state.within(&i.to_string(), |state| {
                state.count("written", &mut lane.written);
                state.bytes("seen", &mut lane.seen);
                state.bytes("acts", &mut lane.acts);
                state.bytes("rewards", &mut lane.rewards);
                state.bytes("ends", &mut lane.ends);
            });
        }
    }
}

/// Makes room for one more row of `width` bytes of at most `rows`: an eighth more at a time, since a replay fills memory.
fn grow(bytes: &mut Vec<u8>, width: usize, rows: usize) {
    if bytes.capacity() < bytes.len() + width {
        let more = (bytes.len() / width / 8).max(1024).min(rows - bytes.len() / width);
        bytes.reserve_exact(more * width);
    }
}

/// How many bytes are kept of a field.
fn kept(field: &Field) -> usize {
    match field.kind {
        Kind::F32 | Kind::Index(_) => 4 * field.width(),
        Kind::U8 => field.width(),
        Kind::Bit => field.width().div_ceil(8),
    }
}

fn pack(seen: &Columns, row: usize, mut out: &mut [u8]) {
    for (column, field) in seen.fields().iter().enumerate() {
        let (own, rest) = out.split_at_mut(kept(field));
        let at = row * field.width()..(row + 1) * field.width();
        match seen.values(column) {
            Values::F32(xs) => words(own, xs[at].iter().map(|x| x.to_le_bytes())),
            Values::Index(xs) => words(own, xs[at].iter().map(|x| x.to_le_bytes())),
            Values::U8(xs) if field.kind == Kind::Bit => {
                for (byte, bits) in own.iter_mut().zip(xs[at].chunks(8)) {
                    *byte = packed(bits);
                }
            }
            Values::U8(xs) => own.copy_from_slice(&xs[at]),
        }
        out = rest;
    }
}

fn words(out: &mut [u8], words: impl Iterator<Item = [u8; 4]>) {
    let (slots, _) = out.as_chunks_mut::<4>();
    slots.iter_mut().zip(words).for_each(|(slot, word)| *slot = word);
}

fn unpack(sees: &[Field], mut bytes: &[u8], mut out: &mut [f32]) {
    for field in sees {
        let ((own, more), (numbers, rest)) =
            (bytes.split_at(kept(field)), out.split_at_mut(field.spread()));
        match field.kind {
            Kind::F32 => {
                let (words, _) = own.as_chunks::<4>();
                numbers.iter_mut().zip(words).for_each(|(x, word)| *x = f32::from_le_bytes(*word));
            }
            Kind::U8 => numbers.iter_mut().zip(own).for_each(|(x, byte)| *x = f32::from(*byte)),
            Kind::Bit => {
                for (numbers, byte) in numbers.chunks_mut(8).zip(own) {
                    numbers.copy_from_slice(&BITS[usize::from(*byte)][..numbers.len()]);
                }
            }
            Kind::Index(n) => {
                let (words, _) = own.as_chunks::<4>();
                for (numbers, word) in numbers.chunks_exact_mut(n).zip(words) {
                    numbers.fill(0.0);
                    numbers[u32::from_le_bytes(*word) as usize] = 1.0;
                }
            }
        }
        (bytes, out) = (more, rest);
    }
}

#[cfg(test)]
mod tests;
