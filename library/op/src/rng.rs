//! Random streams: the only source of randomness.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sha2::{Digest as _, Sha256};

/// What a running operation knows besides its arguments.
#[derive(Clone, Copy, Debug)]
pub struct Ctx {
    /// The name of the operation.
    pub op: &'static str,
    /// The value of the `seed` axis; 0 without one.
    pub seed: i64,
    /// Which member of an ensemble this is.
    pub member: Option<u64>,
}

impl Ctx {
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
        let ctx = Ctx { op: "sample", seed: 0, member: None };
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

    #[test]
    fn the_first_draw_is_pinned() {
        let ctx = Ctx { op: "sample", seed: 3, member: Some(2) };
        assert_eq!(ctx.rng("noise", &["test"]).next_u64(), 3_946_972_691_367_183_514);
    }
}
