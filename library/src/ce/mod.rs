//! Certainty equivalents: what a reward that is uncertain by chance is worth (§2.1.1).

mod bcu;
mod eu;
mod lower_mean;
mod mvu;
mod upper_mean;
mod wcu;

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_op::{Parts, Registry, family};

pub use bcu::Bcu;
pub use eu::Eu;
pub use lower_mean::LowerMean;
pub use mvu::Mvu;
pub use upper_mean::UpperMean;
pub use wcu::Wcu;

/// Reduces a distribution over rewards to one number.
pub trait CertaintyEquivalent: Debug + Send + Sync {
    /// The sure reward that is worth as much as drawing `outcomes` with `probabilities`,
    /// which sum to one.
    fn value(&self, outcomes: &[f64], probabilities: &[f64]) -> f64;
}

family!(dyn CertaintyEquivalent, "Ce", table);

fn table() -> &'static Parts<dyn CertaintyEquivalent> {
    static TABLE: LazyLock<Parts<dyn CertaintyEquivalent>> = LazyLock::new(|| {
        Parts::<dyn CertaintyEquivalent>::new()
            .with(|ce: Eu| Box::new(ce))
            .with(|ce: Mvu| Box::new(ce))
            .with(|ce: Wcu| Box::new(ce))
            .with(|ce: Bcu| Box::new(ce))
            .with(|ce: LowerMean| Box::new(ce))
            .with(|ce: UpperMean| Box::new(ce))
    });
    &TABLE
}

/// Adds what this folder declares.
pub(crate) fn register(registry: Registry) -> Registry {
    registry.parts(table())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(outcomes: &[f64], probabilities: &[f64]) -> [f64; 6] {
        let ces: [&dyn CertaintyEquivalent; 6] = [
            &Eu {},
            &Mvu { beta: -0.5 },
            &Wcu {},
            &Bcu {},
            &LowerMean { alpha: 0.5 },
            &UpperMean { alpha: 0.5 },
        ];
        ces.map(|ce| ce.value(outcomes, probabilities))
    }

    #[test]
    fn a_lottery_with_an_impossible_outcome() {
        // Mean 0.25·0 + 0.75·4 = 3, variance 0.25·9 + 0.75·1 = 3;
        // lowest half: 0.25 at 0 and 0.25 at 4; highest half: 4.
        let (xs, ps) = ([-99.0, 0.0, 4.0], [0.0, 0.25, 0.75]);
        assert_eq!(values(&xs, &ps), [3.0, 1.5, 0.0, 4.0, 2.0, 4.0]);
    }

    #[test]
    fn a_sure_reward_is_worth_itself() {
        assert_eq!(values(&[2.5], &[1.0]), [2.5; 6]);
    }

    #[test]
    fn tail_means_run_from_the_extremes_to_the_mean() {
        let (xs, ps) = ([3.0, -1.0, 0.5], [0.25, 0.5, 0.25]);
        assert_eq!(LowerMean { alpha: 1e-9 }.value(&xs, &ps), Wcu {}.value(&xs, &ps));
        assert_eq!(UpperMean { alpha: 1e-9 }.value(&xs, &ps), Bcu {}.value(&xs, &ps));
        assert_eq!(LowerMean { alpha: 1.0 }.value(&xs, &ps), Eu {}.value(&xs, &ps));
        assert_eq!(UpperMean { alpha: 1.0 }.value(&xs, &ps), Eu {}.value(&xs, &ps));
    }
}
