//! What drivers do, as a few actions.

use ivx_data::Rollouts;
use ivx_math::kmeans::kmeans;
use ivx_math::moments::{mean, real};
use ivx_op::{Array, Ctx, Dim, Labels, One, Op, OpError, declare};
use rand_chacha::ChaCha8Rng;

declare! {
    /// A few actions that stand for what drivers did (§B.1.1): the centres of k-means (Lloyd, 1982) of the angles of
    /// wheels and the accelerations that a world of traffic told, for the `actions` of such a world. They are ordered by
    /// acceleration.
    ///
    /// Where the thesis is silent, this is our reading: both numbers are divided by their standard deviations first,
    /// since angles are so much smaller than accelerations that without it no action steers.
    pub struct DrivingActions = "driving_actions" @ 1 -> Array [action, command] {
        /// What was experienced on a highway or a roundabout.
        rollouts: One<Rollouts>;
        /// How many actions.
        actions: usize = 9, in 1.0..=1000.0;
        /// From how many draws of first centres the best is taken.
        times: usize = 10, in 1.0..=1000.0;
    }
}

impl Op for DrivingActions {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        let told = told(&self.rollouts);
        if told.len() < self.actions {
            let n = told.len();
            let message = format!(
                "drivers did {n} things, of which there are to be {} centres",
                self.actions
            );
            return Err(OpError::Failed(message));
        }
        let actions = centres(&told, self.actions, self.times, &mut ctx.rng("centres", &[]));
        let commands = Labels::Names(["steering", "acceleration"].map(str::to_owned).to_vec());
        let dims =
            vec![Dim::new("action", Labels::count(self.actions)), Dim::new("command", commands)];
        Ok(Array { dims, values: actions.concat() })
    }
}

/// The angles and accelerations that a world told of its nearest cars.
fn told(rollouts: &Rollouts) -> Vec<[f64; 2]> {
    let places = |what: &str| -> Vec<usize> {
        let ends = format!(".{what}");
        (0..rollouts.tells.len()).filter(|i| rollouts.tells[*i].ends_with(&ends)).collect()
    };
    let [cars, angles, accelerations] = ["car", "steering", "acceleration"].map(places);
    let of_cars = || cars.iter().zip(&angles).zip(&accelerations);
    let steps = rollouts.told.chunks_exact(rollouts.tells.len().max(1));
    let did = |step: &[f32]| -> Vec<[f64; 2]> {
        let there = of_cars().filter(|((car, _), _)| step[**car] > 0.0);
        there
            .map(|((_, angle), acceleration)| [step[*angle], step[*acceleration]].map(f64::from))
            .collect()
    };
    steps.flat_map(did).collect()
}

/// Centres of pairs, in units of their standard deviations, ordered by the second number.
pub(super) fn centres(
    pairs: &[[f64; 2]],
    n: usize,
    times: usize,
    rng: &mut ChaCha8Rng,
) -> Vec<[f64; 2]> {
    let scale = spread(pairs).map(|spread| if spread > 0.0 { spread } else { 1.0 });
    let points: Vec<f64> = pairs.iter().flat_map(|[a, b]| [a / scale[0], b / scale[1]]).collect();
    let found = kmeans((&points, 2), n, times, rng).centres;
    let mut centres: Vec<[f64; 2]> =
        found.as_chunks::<2>().0.iter().map(|[a, b]| [a * scale[0], b * scale[1]]).collect();
    centres.sort_by(|a, b| a[1].total_cmp(&b[1]).then(a[0].total_cmp(&b[0])));
    centres
}

/// The standard deviations of both numbers.
pub(super) fn spread(pairs: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|d| {
        let numbers: Vec<f64> = pairs.iter().map(|pair| pair[d]).collect();
        let middle = mean(&numbers);
        (numbers.iter().map(|x| (x - middle).powi(2)).sum::<f64>() / real(numbers.len())).sqrt()
    })
}

#[cfg(test)]
mod tests {
    use ivx_data::{Actions, Trajectories};
    use rand::SeedableRng as _;

    use super::*;

    #[test]
    fn centres_are_in_both_units() {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let mut pairs = vec![[0.1, 2.0]; 5];
        pairs.extend([[-0.1, 2.0], [0.0, -4.0], [0.0, -6.0]]);
        // Without a scale the last two would be parted before those that steer.
        let found = centres(&pairs, 3, 10, &mut rng);
        let expected = [[0.0, -5.0], [-0.1, 2.0], [0.1, 2.0]];
        let near = found
            .iter()
            .zip(expected)
            .all(|(a, b)| (a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12);
        assert!(near, "{found:?}");
    }

    #[test]
    fn cars_that_there_are_not_did_nothing() {
        let tells = [
            "speed",
            "1.car",
            "1.steering",
            "1.acceleration",
            "2.car",
            "2.steering",
            "2.acceleration",
        ];
        let mut rollouts = Rollouts::new(
            Trajectories::new(Vec::new(), Actions::named(&["0"])),
            tells.map(str::to_owned).to_vec(),
        );
        rollouts.told =
            vec![20.0, 3.0, 0.5, -1.0, 0.0, 9.0, 9.0, 25.0, 1.0, 0.25, 2.0, 7.0, 0.0, 4.0];
        assert_eq!(told(&rollouts), [[0.5, -1.0], [0.25, 2.0], [0.0, 4.0]]);
        let op = |actions| DrivingActions { rollouts: One(rollouts.clone()), actions, times: 3 };
        let ctx = Ctx::new("driving_actions", 0, None);
        let found = op(3).run(&ctx).unwrap();
        assert!(
            found
                .values
                .iter()
                .zip([0.5, -1.0, 0.25, 2.0, 0.0, 4.0])
                .all(|(a, b)| (a - b).abs() < 1e-12)
        );
        assert!(op(4).run(&ctx).is_err());
    }
}
