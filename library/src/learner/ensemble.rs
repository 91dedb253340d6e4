//! Deep ensembles (Remark 2.7).

use ivx_data::Misfit;
use ivx_data::{Dataset, Form};
use ivx_nn::Model;
use ivx_op::{Ctx, Facts, MemberCount, OpError, Wrong, declare};
use rand::RngExt as _;

use super::Learner;

declare! {
    /// Independently trained members, told apart by three sources of noise (Remark 2.7).
    ///
    /// Without any of them all members are the same. Member 3 does not depend on how many
    /// members there are.
    pub struct Ensemble = "ensemble" @ 1, stochastic {
        /// What trains each member.
        learner: Box<dyn Learner>;
        /// How many members `K` there are.
        members: MemberCount = 8, in 1.0..;
        /// Whether each member starts from parameters of its own.
        random_init: bool = true;
        /// Whether each member sees its own resample of the data, as many pairs with replacement.
        bootstrap: bool = true;
        /// Whether a fixed random network of its own is added to each member's function
        /// (randomised priors, Osband et al., 2018); only for networks.
        prior_network: bool = true;
        /// What that network's output is multiplied by.
        prior_scale: f64 = 1.0, in 0.0..;
    }
    rule priors_are_of_networks;
}

/// Trains one member, the one that `ctx` names.
impl Learner for Ensemble {
    fn train(&self, data: &Dataset, steps: u64, ctx: &Ctx) -> Result<Model, OpError> {
        let MemberCount = self.members;
        let resampled = self.bootstrap.then(|| resample(data, ctx));
        let data = resampled.as_ref().unwrap_or(data);
        let inner = if self.random_init { *ctx } else { Ctx { member: None, ..*ctx } };
        if !self.prior_network {
            return self.learner.train(data, steps, &inner);
        }
        let prior = (self.prior_scale, ctx);
        self.learner
            .train_with_prior(data, prior, steps, &inner)
            .unwrap_or_else(|| Err(no_network()))
    }

    fn fits(&self, form: &Form) -> Result<(), Misfit> {
        self.learner.fits(form)
    }

    fn memory(&self, form: &Form, n: u64) -> u64 {
        let own = self.learner.memory(form, n);
        // A prior network has parameters and outputs, and none of what else training has.
        let prior = if self.prior_network { own / 4 } else { 0 };
        let observation = 8 * (form.input_len() + form.target_len()) as u64;
        own + prior + if self.bootstrap { n * observation } else { 0 }
    }

    fn updates_in_a_pass(&self, n: usize) -> u64 {
        self.learner.updates_in_a_pass(n)
    }

    fn makes_networks(&self) -> bool {
        self.learner.makes_networks()
    }

    fn says_std(&self) -> bool {
        self.learner.says_std()
    }

    fn modes(&self) -> Option<Vec<usize>> {
        self.learner.modes()
    }
}

/// As many observations, drawn with replacement.
fn resample(data: &Dataset, ctx: &Ctx) -> Dataset {
    let (n, mut rng) = (data.len(), ctx.rng("bootstrap", &[]));
    let places: Vec<_> = (0..n).map(|_| rng.random_range(0..n)).collect();
    data.pick(&places)
}

fn priors_are_of_networks(facts: &Facts<'_>) -> Result<(), Wrong> {
    match (facts.arg::<Box<dyn Learner>>("learner"), facts.arg("prior_network")) {
        (Some(learner), Some(true)) if !learner.takes_prior_network() => {
            let help = "say `prior_network: false`".to_owned();
            Err(Wrong { arg: "prior_network", message: NO_NETWORK.to_owned(), help })
        }
        _ => Ok(()),
    }
}

fn no_network() -> OpError {
    OpError::Failed(NO_NETWORK.to_owned())
}

const NO_NETWORK: &str = "`prior_network: true` needs a learner of networks, such as `map_estimate` without `adversarial`";

#[cfg(test)]
mod tests {
    use ivx_op::{Artifact as _, Part};
    use rayon::prelude::*;

    use super::*;
    use crate::learner::learners;
    use crate::registry;

    const SOURCES: [&str; 3] = ["random_init", "bootstrap", "prior_network"];

    fn ensemble(sources: &[&str]) -> Part {
        let rate = Part::new("linear").with("from", 0.01).with("to", 0.0);
        let inner = Part::new("map_estimate")
            .with("net", Part::new("mlp").with("hidden", vec![16_i64, 16]))
            .with("optimiser", Part::new("adamw").with("lr", rate));
        let part = Part::new("ensemble").with("learner", inner);
        SOURCES.iter().fold(part, |part, source| part.with(source, sources.contains(source)))
    }

    fn member(part: &Part, k: u64, steps: u64) -> Model {
        let learner = learners().build(&registry().complete(part)).unwrap();
        learner.train(&waves(), steps, &Ctx::new("train", 2, Some(k))).unwrap()
    }

    /// Two periods within [-1, 1].
    fn waves() -> Dataset {
        let x: Vec<f64> = (0..25).map(|i| f64::from(i) / 12.0 - 1.0).collect();
        Dataset::pairs(x.clone(), x.iter().map(|x| (6.0 * x).sin()).collect())
    }

    #[test]
    fn every_source_of_diversity_can_be_switched_off() {
        let identical = |sources: &[&str]| {
            let part = ensemble(sources);
            member(&part, 0, 5).encode() == member(&part, 1, 5).encode()
        };
        assert!(identical(&[]));
        for source in SOURCES {
            assert!(!identical(&[source]), "{source} makes no difference");
        }
    }

    #[test]
    fn sources_do_not_disturb_each_other() {
        let arrays = |sources: &[&str], prior: bool| {
            let Model::Net(net) = member(&ensemble(sources), 0, 0) else { unreachable!() };
            let arrays = net
                .nets
                .arrays
                .into_iter()
                .filter(|(name, ..)| name.starts_with("prior.") == prior);
            arrays.collect::<Vec<_>>()
        };
        assert_eq!(arrays(&SOURCES, false), arrays(&["random_init"], false));
        assert_eq!(arrays(&SOURCES, true), arrays(&["prior_network"], true));
        assert_eq!(arrays(&SOURCES, true).len(), 6);
    }

    #[test]
    fn a_member_with_its_prior_survives_the_round_trip() {
        let model = member(&ensemble(&SOURCES), 0, 1);
        assert_eq!(Model::decode(&model.encode()), Some(model));
    }

    /// Five members' spread at 2 to 3 is more than three times that at -1 to 1.
    #[test]
    fn members_agree_where_there_are_data() {
        let models: Vec<_> = (0..5).map(|k| member(&ensemble(&SOURCES), k, 1500)).collect();
        let spread = |from: f64, to: f64| {
            let xs: Vec<_> = (0..=20).map(|i| from + (to - from) * f64::from(i) / 20.0).collect();
            let values: Vec<_> = models.iter().map(|model| model.predict(&xs)).collect();
            let stds = (0..xs.len()).map(|i| {
                let mean = values.iter().map(|v| v[i]).sum::<f64>() / 5.0;
                (values.iter().map(|v| (v[i] - mean).powi(2)).sum::<f64>() / 5.0).sqrt()
            });
            stds.sum::<f64>() / 21.0
        };
        let (inside, outside) = (spread(-1.0, 1.0), spread(2.0, 3.0));
        assert!(outside > 3.0 * inside && inside > 0.0, "{inside} inside, {outside} outside");
    }

    #[test]
    fn a_resample_has_as_many_pairs_and_keeps_them_together() {
        let ctx = Ctx::new("train", 2, Some(0));
        let x: Vec<f64> = (0..40).map(f64::from).collect();
        let data = Dataset::pairs(x.clone(), x.iter().map(|x| -x).collect());
        let mut drawn = resample(&data, &ctx);
        assert!(drawn.x.iter().zip(&drawn.y).all(|(x, y)| *x == -y));
        drawn.x.sort_by(f64::total_cmp);
        drawn.x.dedup();
        // Of 40 pairs a share 1 − 1/e, 25, is expected.
        assert!((18..=32).contains(&drawn.x.len()), "{}", drawn.x.len());
    }

    #[test]
    fn bits_do_not_depend_on_threads() {
        let part = ensemble(&SOURCES);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| -> Vec<_> {
                (0..4_u64).into_par_iter().map(|k| member(&part, k, 50).encode()).collect()
            })
        };
        let serial: Vec<_> = (0..4).map(|k| member(&part, k, 50).encode()).collect();
        assert_eq!(run(1), serial);
        assert_eq!(run(2), serial);
    }

    /// Members of learners that make no networks differ by their resamples, and by what they draw themselves.
    #[test]
    fn learners_of_vectors_have_members_too() {
        for (name, draws) in [("ridge", false), ("knn", false), ("random_forest", true)] {
            let learner = Part::new(name);
            let of = |bootstrap: bool, random_init: bool, k| {
                let part = Part::new("ensemble").with("learner", learner.clone());
                let part = part.with("bootstrap", bootstrap).with("prior_network", false);
                member(&part.with("random_init", random_init), k, 0)
            };
            assert_ne!(of(true, false, 0), of(true, false, 1), "{name}");
            assert_eq!(of(false, false, 0), of(false, false, 1), "{name}");
            assert_eq!(of(false, true, 0) != of(false, true, 1), draws, "{name}");
        }
    }

    #[derive(Debug)]
    struct Zero;

    impl Learner for Zero {
        fn train(&self, _: &Dataset, _: u64, _: &Ctx) -> Result<Model, OpError> {
            Ok(Model::Polynomial(vec![0.0]))
        }
    }

    #[test]
    fn other_learners_have_no_prior_network() {
        let train = |prior_network| {
            let part = Ensemble {
                learner: Box::new(Zero),
                members: MemberCount,
                random_init: true,
                bootstrap: true,
                prior_network,
                prior_scale: 1.0,
            };
            part.train(&waves(), 0, &Ctx::new("train", 0, Some(0)))
        };
        assert_eq!(train(true), Err(no_network()));
        assert_eq!(train(false), Ok(Model::Polynomial(vec![0.0])));
    }
}
