//! What a running operation knows besides its arguments: random streams, the only source of
//! randomness, and where it left off.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sha2::{Digest as _, Sha256};

use crate::OpError;

/// What a running operation knows besides its arguments.
#[derive(Clone, Copy, Debug)]
pub struct Ctx<'a> {
    /// The name of the operation.
    pub op: &'static str,
    /// The value of the `seed` axis; 0 without one.
    pub seed: i64,
    /// Which member of an ensemble this is.
    pub member: Option<u64>,
    /// Where what was done so far is kept; nowhere in tests.
    pub progress: Option<&'a dyn Progress>,
}

/// Keeps what a long computation has done so far, so that it can go on after it was stopped or killed, and tells of
/// it.
///
/// A computation that goes on must end in the same bytes as one that was never interrupted.
pub trait Progress: std::fmt::Debug + Sync {
    /// What was kept last of this very computation.
    fn load(&self) -> Option<Vec<u8>>;
    /// Whether it is time to keep something.
    fn due(&self) -> bool;
    /// Keeps this in the place of what was kept before. A failure costs time, not the result.
    fn save(&self, state: Vec<u8>);
    /// Whether the computation is to end now.
    fn stopping(&self) -> bool;
    /// Whether it is time to tell something.
    fn listens(&self) -> bool;
    /// Tells how many of how many steps are done, and how it goes.
    fn tell(&self, done: u64, of: u64, words: &str);
}

impl<'a> Ctx<'a> {
    /// That of a computation which does not keep its progress.
    #[must_use]
    pub const fn new(op: &'static str, seed: i64, member: Option<u64>) -> Self {
        Self { op, seed, member, progress: None }
    }

    /// The same, with a place to keep progress.
    #[must_use]
    pub const fn keeping(self, progress: &'a dyn Progress) -> Self {
        Self { progress: Some(progress), ..self }
    }

    /// What this computation had done when it was interrupted.
    #[must_use]
    pub fn resume(&self) -> Option<Vec<u8>> {
        self.progress?.load()
    }

    /// Keeps what is done so far, if it is time to. Call it between steps that take no more than a second.
    ///
    /// # Errors
    /// If the computation is to end now, which is kept then.
    pub fn checkpoint(&self, state: impl FnOnce() -> Vec<u8>) -> Result<(), OpError> {
        let Some(progress) = self.progress else { return Ok(()) };
        let stopping = progress.stopping();
        if stopping || progress.due() {
            progress.save(state());
        }
        if stopping { Err(OpError::Stopped) } else { Ok(()) }
    }

    /// Tells that `done` of `of` steps are done, and how it goes in a few words, such as `loss 0.31`: they are made
    /// only where somebody listens. It changes no result.
    pub fn tell(&self, done: u64, of: u64, words: impl FnOnce() -> String) {
        if let Some(progress) = self.progress.filter(|progress| progress.listens()) {
            progress.tell(done, of, &words());
        }
    }

    /// A generator for one purpose, told apart by `labels` (such as a stream's name or an index).
    ///
    /// It depends on the seed, the operation, the purpose, the labels and the member, and on
    /// nothing else: so methods compared on one seed see the same draws, and member 3 is the
    /// same whether there are 8 members or 32.
    #[must_use]
    pub fn rng(&self, purpose: &str, labels: &[&str]) -> ChaCha8Rng {
        let mut hash = Sha256::new();
        let mut item = |bytes: &[u8]| {
            hash.update((bytes.len() as u64).to_le_bytes());
            hash.update(bytes);
        };
        item(b"ivx stream 1");
        item(&self.seed.to_le_bytes());
        item(self.op.as_bytes());
        item(purpose.as_bytes());
        item(&self.member.map_or(Vec::new(), |member| member.to_le_bytes().to_vec()));
        for label in labels {
            item(label.as_bytes());
        }
        ChaCha8Rng::from_seed(hash.finalize().into())
    }
}

#[cfg(test)]
mod tests {
    use rand::Rng as _;

    use super::*;

    #[test]
    fn a_stream_depends_on_everything_that_names_it() {
        let ctx = Ctx::new("sample", 0, None);
        let first = |ctx: Ctx, purpose: &str, labels: &[&str]| ctx.rng(purpose, labels).next_u64();
        let mut draws = vec![
            first(ctx, "x", &[]),
            first(ctx, "y", &[]),
            first(ctx, "x", &["test"]),
            first(ctx, "x", &["te", "st"]),
            first(Ctx { seed: 1, ..ctx }, "x", &[]),
            first(Ctx { op: "train", ..ctx }, "x", &[]),
            first(Ctx { member: Some(0), ..ctx }, "x", &[]),
        ];
        assert_eq!(draws[0], first(ctx, "x", &[]));
        draws.sort_unstable();
        draws.dedup();
        assert_eq!(draws.len(), 7);
    }

    /// Is stopped after three steps; keeps and tells every other one.
    #[derive(Debug, Default)]
    struct Kept(std::sync::Mutex<(u64, Vec<u8>, Vec<String>)>);

    impl Progress for Kept {
        fn load(&self) -> Option<Vec<u8>> {
            let kept = &self.0.lock().unwrap().1;
            (!kept.is_empty()).then(|| kept.clone())
        }
        fn due(&self) -> bool {
            self.0.lock().unwrap().0.is_multiple_of(2)
        }
        fn save(&self, state: Vec<u8>) {
            self.0.lock().unwrap().1 = state;
        }
        fn stopping(&self) -> bool {
            let steps = &mut self.0.lock().unwrap().0;
            *steps += 1;
            *steps == 3
        }
        fn listens(&self) -> bool {
            self.due()
        }
        fn tell(&self, done: u64, of: u64, words: &str) {
            self.0.lock().unwrap().2.push(format!("{done} of {of}: {words}"));
        }
    }

    #[test]
    fn who_is_stopped_has_kept_what_was_done() {
        let kept = Kept::default();
        let run = |ctx: Ctx| {
            for t in ctx.resume().map_or(0, |state| state[0])..5 {
                ctx.checkpoint(|| vec![t])?;
                ctx.tell(t.into(), 5, || "well".to_owned());
            }
            Ok(())
        };
        let ctx = Ctx::new("train", 0, None).keeping(&kept);
        assert_eq!(run(ctx), Err(OpError::Stopped));
        // It goes on with the step that was not begun.
        assert_eq!(ctx.resume(), Some(vec![2]));
        assert_eq!(run(ctx), Ok(()));
        assert_eq!(kept.0.lock().unwrap().2, ["1 of 5: well", "2 of 5: well", "4 of 5: well"]);
        assert_eq!(run(Ctx::new("train", 0, None)), Ok(()));
    }

    #[test]
    fn the_first_draw_is_pinned() {
        let ctx = Ctx::new("sample", 3, Some(2));
        assert_eq!(ctx.rng("noise", &["test"]).next_u64(), 3_946_972_691_367_183_514);
    }
}
