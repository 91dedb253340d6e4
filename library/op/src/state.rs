//! The state of a long computation: one walk over it keeps and restores everything.

use std::collections::BTreeMap;

use crate::{Data, Tensors};

/// What a computation has done so far, while it is kept or restored.
///
/// The computation walks over all that it changes and names each, in the same way whether it is kept or restored:
///
/// ```
/// use ivx_op::State;
///
/// fn walk(state: &mut State, (t, weights): &mut (u64, Vec<f32>)) {
///     state.count("t", t);
///     state.numbers("weights", weights);
/// }
/// let bytes = State::keep(|state| walk(state, &mut (7, vec![0.5])));
/// let mut other = (0, vec![0.0]);
/// assert!(State::restore(&bytes, |state| walk(state, &mut other)));
/// assert_eq!(other, (7, vec![0.5]));
/// ```
#[derive(Debug)]
pub struct State {
    phase: Phase,
    counts: BTreeMap<String, u64>,
    tensors: Tensors,
    within: String,
    fits: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Keep,
    /// Looks whether everything is there, and changes nothing.
    Look,
    Restore,
}

const KIND: &str = "State";

impl State {
    /// What a walk names, as bytes.
    #[must_use]
    pub fn keep(walk: impl FnOnce(&mut Self)) -> Vec<u8> {
        let mut state = Self::new(Phase::Keep, BTreeMap::new(), Tensors::default());
        walk(&mut state);
        state.tensors.encode(KIND, &state.counts)
    }

    /// Gives back to a walk what another named, whether it is of the same computation: if not, nothing is changed. The
    /// walk is taken twice, first to look.
    pub fn restore(bytes: &[u8], mut walk: impl FnMut(&mut Self)) -> bool {
        let Some((tensors, counts)) = Tensors::decode(KIND, bytes) else { return false };
        let mut state = Self::new(Phase::Look, counts, tensors);
        walk(&mut state);
        if state.fits {
            state.phase = Phase::Restore;
            walk(&mut state);
        }
        state.fits
    }

    fn new(phase: Phase, counts: BTreeMap<String, u64>, tensors: Tensors) -> Self {
        Self { phase, counts, tensors, within: String::new(), fits: true }
    }

    /// A part of the state, whose names are its own.
    pub fn within(&mut self, name: &str, walk: impl FnOnce(&mut Self)) {
        let before = self.within.len();
        self.within.push_str(name);
        self.within.push('.');
        walk(self);
        self.within.truncate(before);
    }

    fn named(&self, name: &str) -> String {
        format!("{}{name}", self.within)
    }

    /// A whole number.
    pub fn count(&mut self, name: &str, value: &mut u64) {
        let name = self.named(name);
        match self.phase {
            Phase::Keep => {
                self.counts.insert(name, *value);
            }
            Phase::Look => self.fits &= self.counts.contains_key(&name),
            Phase::Restore => *value = self.counts[&name],
        }
    }

    /// The same of a place.
    ///
    /// # Panics
    /// If it is no place on this machine.
    pub fn place(&mut self, name: &str, value: &mut usize) {
        let mut count = *value as u64;
        self.count(name, &mut count);
        *value = usize::try_from(count).expect("a place in memory");
    }

    /// A real number, to the bit.
    pub fn real(&mut self, name: &str, value: &mut f64) {
        let mut bits = value.to_bits();
        self.count(name, &mut bits);
        *value = f64::from_bits(bits);
    }

    /// Numbers in single precision, as many as there were.
    pub fn numbers(&mut self, name: &str, values: &mut [f32]) {
        let name = self.named(name);
        let found = match self.phase {
            Phase::Keep => {
                let data = Data::F32(vec![values.len()], values.to_vec());
                self.tensors.arrays.insert(name, data);
                return;
            }
            Phase::Look | Phase::Restore => self.tensors.arrays.get(&name),
        };
        match found {
            Some(Data::F32(_, found)) if found.len() == values.len() => {
                if self.phase == Phase::Restore {
                    values.copy_from_slice(found);
                }
            }
            _ => self.fits = false,
        }
    }

    /// Numbers in double precision, however many.
    pub fn reals(&mut self, name: &str, values: &mut Vec<f64>) {
        let name = self.named(name);
        if self.phase == Phase::Keep {
            self.tensors.arrays.insert(name, Data::F64(vec![values.len()], values.clone()));
            return;
        }
        match self.tensors.arrays.get(&name) {
            Some(Data::F64(_, found)) if self.phase == Phase::Restore => values.clone_from(found),
            Some(Data::F64(..)) => {}
            _ => self.fits = false,
        }
    }

    /// Bytes, however many.
    pub fn bytes(&mut self, name: &str, values: &mut Vec<u8>) {
        let name = self.named(name);
        if self.phase == Phase::Keep {
            self.tensors.arrays.insert(name, Data::bytes(values.clone()));
            return;
        }
        match self.tensors.arrays.get_mut(&name) {
            // Taken, since there may be many.
            Some(Data::U8(_, found)) if self.phase == Phase::Restore => {
                *values = std::mem::take(found);
            }
            Some(Data::U8(..)) => {}
            _ => self.fits = false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Debug, PartialEq, Default)]
    struct Work {
        t: u64,
        at: usize,
        best: f64,
        weights: Vec<f32>,
        curve: Vec<f64>,
        seen: Vec<u8>,
    }

    impl Work {
        fn walk(&mut self, state: &mut State) {
            state.count("t", &mut self.t);
            state.within("inner", |state| {
                state.place("at", &mut self.at);
                state.real("best", &mut self.best);
                state.numbers("weights", &mut self.weights);
            });
            state.reals("curve", &mut self.curve);
            state.bytes("seen", &mut self.seen);
        }
    }

    #[test]
    fn a_walk_restores_what_it_kept_or_changes_nothing() {
        let mut work = Work {
            t: 9,
            at: 3,
            best: -0.1,
            weights: vec![1.5, -2.0],
            curve: vec![1.0, 2.0, 3.0],
            seen: vec![7, 8],
        };
        let bytes = State::keep(|state| work.walk(state));
        let mut fresh = Work { weights: vec![0.0; 2], ..Work::default() };
        assert!(State::restore(&bytes, |state| fresh.walk(state)));
        assert_eq!(fresh, work);

        let mut larger = Work { weights: vec![0.0; 3], ..Work::default() };
        let before = larger.clone();
        assert!(!State::restore(&bytes, |state| larger.walk(state)));
        assert!(!State::restore(b"nothing", |state| larger.walk(state)));
        assert_eq!(larger, before);
    }
}
