//! Data drawn from a reward curve.

use ivx_data::{Dataset, Form};
use ivx_op::{Ctx, Facts, Op, OpError, Part, Shapes, declare};
use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};

use super::{Region, Reward};

declare! {
    /// Actions drawn uniformly from a region, and their rewards with Gaussian noise (Eqn. 2.17a).
    ///
    /// Fewer pairs are the first of more, whatever the noise.
    pub struct Sample = "sample" @ 2, stochastic -> Dataset {
        /// The reward curve.
        reward: Box<dyn Reward>;
        /// How many pairs.
        n: usize, in 0.0..=1e7;
        /// Standard deviation of the noise.
        noise: f64 = 0.1, in 0.0..;
        /// Where actions come from.
        from: Box<dyn Region> = Part::new("interval").with("low", -1.0).with("high", 1.0);
        /// Tells apart draws that must differ on one seed, such as training and test data.
        stream: String = "main";
    }
    shapes pairs;
}

#[expect(clippy::unnecessary_wraps, reason = "shapes may not be known")]
fn pairs(_: &Facts<'_>) -> Option<Shapes> {
    Some(Form::default().shapes())
}

impl Op for Sample {
    fn run(&self, ctx: &Ctx) -> Result<Dataset, OpError> {
        let intervals = self.from.intervals()?;
        let length: f64 = intervals.iter().map(|(low, high)| high - low).sum();
        let mut inputs = ctx.rng("inputs", &[&self.stream]);
        let mut noise = ctx.rng("noise", &[&self.stream]);

        let mut data = Dataset::default();
        for _ in 0..self.n {
            let x = place(&intervals, inputs.random::<f64>() * length);
            let deviation: f64 = StandardNormal.sample(&mut noise);
            data.x.push(x);
            data.y.push(self.reward.mean(x) + self.noise * deviation);
        }
        Ok(data)
    }
}

/// The number at `distance` from the start of the first interval, gaps not counted.
fn place(intervals: &[(f64, f64)], mut distance: f64) -> f64 {
    for (low, high) in intervals {
        if distance <= high - low {
            return low + distance;
        }
        distance -= high - low;
    }
    intervals.last().expect("a region has an interval").1
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use ivx_op::{Args, Artifact as _, Data, read_tensors};

    use super::super::{Interval, Intervals, Sinusoids};
    use super::*;
    use ivx_math::moments::{mean, std};

    const CTX: Ctx = Ctx::new("sample", 0, None);

    fn sample(n: usize) -> Sample {
        Sample {
            reward: Box::new(Sinusoids {}),
            n,
            noise: 0.1,
            from: Box::new(Interval { low: -1.0, high: 1.0 }),
            stream: "main".into(),
        }
    }

    #[test]
    fn fewer_pairs_are_the_first_of_more() {
        let (few, many) = (sample(5).run(&CTX).unwrap(), sample(50).run(&CTX).unwrap());
        assert_eq!((&few.x[..], &few.y[..]), (&many.x[..5], &many.y[..5]));
        let other = Sample { stream: "test".into(), ..sample(5) }.run(&CTX).unwrap();
        assert_ne!(few.x, other.x);
        let louder = Sample { noise: 0.2, ..sample(5) }.run(&CTX).unwrap();
        assert_eq!(few.x, louder.x);
    }

    #[test]
    fn inputs_are_uniform_and_noise_is_normal() {
        let data = sample(20_000).run(&CTX).unwrap();
        assert!(mean(&data.x).abs() < 0.02);
        assert!((std(&data.x) - 3.0_f64.sqrt().recip()).abs() < 0.01);
        let clean = data.x.iter().map(|&x| Sinusoids {}.mean(x));
        let noise: Vec<f64> = data.y.iter().zip(clean).map(|(y, r)| y - r).collect();
        assert!(mean(&noise).abs() < 0.003 && (std(&noise) - 0.1).abs() < 0.003);
    }

    #[test]
    fn shapes_are_those_of_one_pair() {
        let data = sample(3).run(&CTX).unwrap().encode();
        let (tensors, _) = read_tensors(&data).unwrap();
        let of_one = tensors.arrays.into_iter().map(|(name, data)| match data {
            Data::F64(shape, _) if shape[0] == 3 => (name, shape[1..].to_vec()),
            data => panic!("not three numbers: {data:?}"),
        });
        let args = Args::new();
        let (over, shapes) = (BTreeMap::new(), BTreeMap::new());
        let facts = Facts { args: &args, given: &[], over: &over, seen: &over, shapes: &shapes };
        assert_eq!(pairs(&facts), Some(of_one.collect()));
    }

    #[test]
    fn gaps_are_skipped_in_proportion() {
        let part = |low, high| Box::new(Interval { low, high }) as _;
        let from = Box::new(Intervals { parts: vec![part(-1.0, 0.0), part(2.0, 5.0)] });
        let data = Sample { from, ..sample(4000) }.run(&CTX).unwrap();
        let left = data.x.iter().filter(|x| (-1.0..=0.0).contains(*x)).count();
        let right = data.x.iter().filter(|x| (2.0..=5.0).contains(*x)).count();
        assert_eq!(left + right, 4000);
        assert!((900..1100).contains(&left), "{left}");
    }
}
