//! What chance decides in a world.

use std::f64::consts::TAU;

use ivx_op::Ctx;
use rand::Rng as _;
use rand_chacha::ChaCha8Rng;

use crate::twister::MersenneTwister;

/// A stream of random numbers for one world.
#[derive(Clone, Debug)]
pub struct Luck(Source);

#[derive(Clone, Debug)]
enum Source {
    ChaCha(Box<ChaCha8Rng>),
    Twister(Box<MersenneTwister>),
}

impl Luck {
    /// That of an episode of a lane of worlds on a stream. It does not depend on who acts or learns, so that all meet
    /// the same worlds on one seed.
    #[must_use]
    pub fn of(ctx: &Ctx<'_>, stream: &str, lane: u64, episode: u64) -> Self {
        let world = Ctx { op: "world", member: None, ..*ctx };
        Self::from(world.rng(stream, &[&lane.to_string(), &episode.to_string()]))
    }

    /// As `NumPy`'s `RandomState(seed)` has it, for worlds that are compared with those of Python.
    #[must_use]
    pub fn numpy(seed: u32) -> Self {
        Self(Source::Twister(Box::new(MersenneTwister::new(seed))))
    }

    /// 32 random bits.
    #[inline]
    pub fn bits(&mut self) -> u32 {
        match &mut self.0 {
            Source::ChaCha(rng) => rng.next_u32(),
            Source::Twister(rng) => rng.bits(),
        }
    }

    /// A number of `[0, 1)` with 53 random bits.
    #[inline]
    pub fn unit(&mut self) -> f64 {
        let (high, low) = (self.bits() >> 5, self.bits() >> 6);
        (f64::from(high) * 67_108_864.0 + f64::from(low)) / 9_007_199_254_740_992.0
    }

    /// A number of `[low, high)`.
    #[inline]
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A number of the standard normal distribution, by the method of Box and Muller (1958).
    #[inline]
    pub fn normal(&mut self) -> f64 {
        let (size, turn) = (1.0 - self.unit(), self.unit());
        (-2.0 * size.ln()).sqrt() * (TAU * turn).cos()
    }

    /// One of `0..n`, evenly: bits of the mask of `n - 1` are drawn until they are below `n`.
    ///
    /// # Panics
    /// If `n` is 0.
    #[inline]
    pub fn below(&mut self, n: u32) -> u32 {
        let most = n.checked_sub(1).expect("one of some");
        if most == 0 {
            return 0;
        }
        let mask = u32::MAX >> most.leading_zeros();
        loop {
            let drawn = self.bits() & mask;
            if drawn <= most {
                return drawn;
            }
        }
    }

    /// The place of one of `weights`, which sum to one.
    pub fn pick(&mut self, weights: &[f64]) -> usize {
        ivx_math::policy::pick(weights, self.unit())
    }
}

impl From<ChaCha8Rng> for Luck {
    fn from(rng: ChaCha8Rng) -> Self {
        Self(Source::ChaCha(Box::new(rng)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luck_is_of_the_seed_the_stream_the_lane_and_the_episode_alone() {
        let first =
            |ctx: &Ctx<'_>, stream, lane, episode| Luck::of(ctx, stream, lane, episode).bits();
        let ctx = Ctx::new("learn", 3, Some(1));
        let draws = [
            first(&ctx, "learn", 0, 0),
            first(&ctx, "evaluate", 0, 0),
            first(&ctx, "learn", 1, 0),
            first(&ctx, "learn", 0, 1),
            first(&Ctx { seed: 4, ..ctx }, "learn", 0, 0),
        ];
        assert_eq!(draws[0], first(&Ctx::new("act", 3, None), "learn", 0, 0));
        assert!((1..5).all(|i| !draws[..i].contains(&draws[i])), "{draws:?}");
    }

    #[test]
    fn numbers_are_as_those_of_numpy() {
        // RandomState(1100): randint(2), rand(), rand()
        let mut luck = Luck::numpy(1100);
        assert_eq!(luck.below(2), 0);
        assert_eq!([luck.unit(), luck.unit()], [0.896_083_366_058_368_2, 0.576_073_224_043_575_2]);
        assert_eq!(luck.below(1), 0);
    }

    #[test]
    fn normal_numbers_have_the_moments_and_tails_of_the_normal_distribution() {
        let mut luck = Luck::numpy(5);
        let drawn: Vec<f64> = (0..100_000).map(|_| luck.normal()).collect();
        let mean = |of: &dyn Fn(f64) -> f64| drawn.iter().map(|x| of(*x)).sum::<f64>() / 1e5;
        // Their standard errors are 0.003, 0.004, 0.03 and 0.0007.
        assert!(mean(&|x| x).abs() < 0.015);
        assert!((mean(&|x| x * x) - 1.0).abs() < 0.02);
        assert!((mean(&|x| x.powi(4)) - 3.0).abs() < 0.15);
        assert!((mean(&|x| f64::from(u8::from(x > 1.644_853_6))) - 0.05).abs() < 0.0035);
    }
}
