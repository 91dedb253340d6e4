//! Knowledge equivalents: what a reward that is uncertain by ignorance is worth (§2.1.2).

mod bcm;
mod cvar;
mod ma;
mod mean_std;
mod mvm;
mod wcm;

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_op::{Parts, Registry, family};

pub use bcm::Bcm;
pub use cvar::Cvar;
pub use ma::Ma;
pub use mean_std::MeanStd;
pub use mvm::Mvm;
pub use wcm::Wcm;

/// Reduces what several models say to one number.
///
/// Weights are the posterior probabilities of the models: they sum to one, and a model
/// of weight zero has no say.
pub trait KnowledgeEquivalent: Debug + Send + Sync {
    /// The sure score that is worth as much as `scores`, one a model.
    fn reduce(&self, scores: &[f64], weights: &[f64]) -> f64;

    /// Writes the derivative of [`reduce`](Self::reduce) by each score; where there is none, a
    /// subgradient: among equal models, the first is charged.
    fn slope(&self, scores: &[f64], weights: &[f64], slope: &mut [f64]);

    /// The same as numbers of their own.
    fn gradient(&self, scores: &[f64], weights: &[f64]) -> Vec<f64> {
        let mut slope = vec![0.0; scores.len()];
        self.slope(scores, weights, &mut slope);
        slope
    }
}

family!(dyn KnowledgeEquivalent, "Ke", table);

fn table() -> &'static Parts<dyn KnowledgeEquivalent> {
    static TABLE: LazyLock<Parts<dyn KnowledgeEquivalent>> = LazyLock::new(|| {
        Parts::<dyn KnowledgeEquivalent>::new()
            .with(|ke: Ma| Box::new(ke))
            .with(|ke: Mvm| Box::new(ke))
            .with(|ke: Wcm| Box::new(ke))
            .with(|ke: Bcm| Box::new(ke))
            .with(|ke: Cvar| Box::new(ke))
            .with(|ke: MeanStd| Box::new(ke))
    });
    &TABLE
}

/// Adds what this folder declares.
pub(crate) fn register(registry: Registry) -> Registry {
    registry.parts(table())
}

#[cfg(test)]
mod tests {
    use ivx_op::Ctx;
    use rand::RngExt as _;

    use super::*;

    fn each(check: impl Fn(&dyn KnowledgeEquivalent)) {
        let kes: [&dyn KnowledgeEquivalent; 6] = [
            &Ma {},
            &Mvm { xi: -0.5 },
            &Wcm {},
            &Bcm {},
            &Cvar { alpha: 0.4 },
            &MeanStd { beta: -1.0 },
        ];
        for ke in kes {
            check(ke);
        }
    }

    /// Five scores and weights, the fourth of weight zero; 50 times.
    fn beliefs() -> impl Iterator<Item = (Vec<f64>, Vec<f64>)> {
        let mut rng = Ctx::new("test", 0, None).rng("beliefs", &[]);
        (0..50).map(move |_| {
            let scores = (0..5).map(|_| rng.random::<f64>() * 4.0 - 2.0).collect();
            let mut weights: Vec<f64> = (0..5).map(|_| rng.random()).collect();
            weights[3] = 0.0;
            let total: f64 = weights.iter().sum();
            (scores, weights.iter().map(|w| w / total).collect())
        })
    }

    #[test]
    fn three_models_of_unequal_weight() {
        // μ = 0.5·1 + 0.25·3 + 0.25·(−1) = 1; var = 0.25·4 + 0.25·4 = 2;
        // lowest 0.4 of the mass: 0.25 at −1 and 0.15 at 1, mean −0.25.
        let (scores, weights) = ([1.0, 3.0, -1.0, 99.0], [0.5, 0.25, 0.25, 0.0]);
        let check = |ke: &dyn KnowledgeEquivalent, expected: f64| {
            let found = ke.reduce(&scores, &weights);
            assert!((found - expected).abs() < 1e-15, "{ke:?}: {found}, not {expected}");
        };
        check(&Ma {}, 1.0);
        check(&Mvm { xi: -0.5 }, 0.0);
        check(&Wcm {}, -1.0);
        check(&Bcm {}, 3.0);
        check(&Cvar { alpha: 0.4 }, -0.25);
        check(&MeanStd { beta: 2.0 }, 1.0 + 2.0 * 2.0_f64.sqrt());
    }

    #[test]
    fn gradients_are_finite_differences() {
        for (scores, weights) in beliefs() {
            each(|ke| {
                let gradient = ke.gradient(&scores, &weights);
                for i in 0..scores.len() {
                    let moved = |by: f64| {
                        let mut scores = scores.clone();
                        scores[i] += by;
                        ke.reduce(&scores, &weights)
                    };
                    let difference = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                    assert!((difference - gradient[i]).abs() < 1e-6, "{ke:?} at {scores:?}[{i}]");
                }
            });
        }
    }

    #[test]
    fn certainty_leaves_the_score_as_it_is() {
        each(|ke| {
            assert_eq!(ke.reduce(&[0.5, 0.5], &[0.5, 0.5]), 0.5, "{ke:?}");
            assert_eq!(ke.reduce(&[0.5, 8.0], &[1.0, 0.0]), 0.5, "{ke:?}");
        });
    }

    #[test]
    fn a_model_that_fails_shows_through() {
        each(|ke| assert!(ke.reduce(&[f64::NAN, 0.5], &[0.5, 0.5]).is_nan(), "{ke:?}"));
        each(|ke| assert!(ke.reduce(&[0.5, f64::NAN], &[0.5, 0.5]).is_nan(), "{ke:?}"));
    }

    #[test]
    fn cvar_runs_from_the_worst_case_to_the_average() {
        for (scores, weights) in beliefs() {
            let cvar = |alpha| Cvar { alpha }.reduce(&scores, &weights);
            assert_eq!(cvar(1e-9), Wcm {}.reduce(&scores, &weights));
            assert!((cvar(1.0) - Ma {}.reduce(&scores, &weights)).abs() < 1e-14);
            assert!(cvar(0.2) <= cvar(0.6));
        }
    }

    #[test]
    fn equal_models_charge_the_first() {
        let (scores, weights) = ([9.0, 1.0, 1.0], [0.0, 0.5, 0.5]);
        assert_eq!(Wcm {}.gradient(&scores, &weights), [0.0, 1.0, 0.0]);
        assert_eq!(Bcm {}.gradient(&scores, &weights), [0.0, 1.0, 0.0]);
        assert_eq!(Cvar { alpha: 0.5 }.gradient(&scores, &weights), [0.0, 1.0, 0.0]);
        assert_eq!(MeanStd { beta: 1.0 }.gradient(&[1.0, 1.0], &[0.5, 0.5]), [0.5, 0.5]);
    }
}
