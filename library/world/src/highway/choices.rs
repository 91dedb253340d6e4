//! What an agent can do in traffic.

use std::f64::consts::FRAC_PI_2;

use ivx_data::{Actions, Misfit};
use ivx_op::Array;

use super::steering::Meta;
use super::traffic::Traffic;

/// The actions of an agent.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Choices {
    /// To tell a pilot what to do.
    Meta,
    /// To hold the wheels and the pedals: angles in radians, and accelerations in m/s².
    Held(Vec<[f64; 2]>),
}

impl Choices {
    /// Pairs of an angle and an acceleration: an array of one row for each.
    pub(super) fn of(array: &Array) -> Result<Self, Misfit> {
        let help = "give what `driving_actions(..)` makes: a row for each action, with the angle of the wheels \
                    in radians and the acceleration in m/s²";
        let wrong = |message: String| Misfit::new(message, help);
        let sizes: Vec<usize> = array.dims.iter().map(ivx_op::Dim::len).collect();
        let &[n, 2] = &sizes[..] else {
            return Err(wrong(format!("actions are pairs, and the array has the shape {sizes:?}")));
        };
        if n == 0 {
            return Err(wrong("there are no actions".to_owned()));
        }
        let (pairs, _) = array.values.as_chunks::<2>();
        let strange = |pair: &&[f64; 2]| !(pair[0].abs() < FRAC_PI_2 && pair[1].is_finite());
        if let Some([angle, acceleration]) = pairs.iter().find(strange) {
            return Err(wrong(format!(
                "{angle} and {acceleration} are no angle of wheels and no acceleration"
            )));
        }
        Ok(Self::Held(pairs.to_vec()))
    }

    pub(super) fn actions(&self) -> Actions {
        match self {
            Self::Meta => Actions::named(&Meta::NAMES),
            Self::Held(pairs) => {
                Actions::Discrete((0..pairs.len()).map(|i| i.to_string()).collect())
            }
        }
    }

    /// That which comes nearest to what a driver did, an angle and an acceleration, where both are divided by `spread`:
    /// the first of equals. A pilot is told nothing of the kind.
    pub(super) fn nearest(&self, did: [f64; 2], spread: [f64; 2]) -> Option<usize> {
        let Self::Held(pairs) = self else { return None };
        let far = |pair: &[f64; 2]| -> f64 {
            [0, 1].map(|d| ((pair[d] - did[d]) / spread[d]).powi(2)).iter().sum()
        };
        let far: Vec<f64> = pairs.iter().map(far).collect();
        (0..far.len()).min_by(|a, b| far[*a].total_cmp(&far[*b]))
    }

    /// Lets the agent's car do one of them.
    pub(super) fn take(&self, act: usize, traffic: &mut Traffic) {
        let car = &mut traffic.vehicles[0];
        match self {
            Self::Meta => car.tell(Meta::ALL[act], &traffic.network),
            Self::Held(pairs) => [car.steering, car.acceleration] = pairs[act],
        }
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::{Dim, Labels};

    use super::*;

    #[test]
    fn actions_are_pairs() {
        let array = |n, width, values| {
            let dims = vec![
                Dim::new("action", Labels::count(n)),
                Dim::new("command", Labels::count(width)),
            ];
            Choices::of(&Array { dims, values })
        };
        let choices = array(2, 2, vec![0.1, -3.0, 0.0, 2.0]).unwrap();
        assert_eq!(choices, Choices::Held(vec![[0.1, -3.0], [0.0, 2.0]]));
        assert_eq!(choices.actions(), Actions::named(&["0", "1"]));
        // 2² + 2.6² is less than 3² + 2.4², and 0.2² + 2.6² is more than 0.3² + 2.4².
        assert_eq!(choices.nearest([0.3, -0.4], [0.1, 1.0]), Some(0));
        assert_eq!(choices.nearest([0.3, -0.4], [1.0, 1.0]), Some(1));
        assert_eq!(choices.nearest([0.05, -0.5], [1.0, 1.0]), Some(0));
        assert_eq!(Choices::Meta.nearest([0.0, 0.0], [1.0, 1.0]), None);
        assert!(array(1, 3, vec![0.0; 3]).is_err() && array(0, 2, vec![]).is_err());
        assert!(array(1, 2, vec![1.6, 0.0]).is_err() && array(1, 2, vec![0.0, f64::NAN]).is_err());
    }
}
