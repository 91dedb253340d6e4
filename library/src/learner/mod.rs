//! How models are learned from data.

mod boosted_trees;
mod distilled;
mod ensemble;
mod features;
mod imitative;
mod infer;
mod knn;
mod linear;
mod logistic;
mod map_estimate;
mod mc_dropout;
mod mixture;
mod modes;
mod predict;
mod predictions;
mod prior;
mod random_forest;
mod ridge;
mod scaled;
pub(crate) mod spread;
mod targets;
mod train;

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_data::Misfit;
use ivx_data::{Dataset, Form};
use ivx_nn::Model;
use ivx_op::{Ctx, OpError, Parts, Registry, family};

pub use boosted_trees::BoostedTrees;
pub use distilled::Distilled;
pub use ensemble::Ensemble;
pub use features::{Features, Polynomial};
pub use imitative::Imitative;
pub use infer::{
    Infer, Inference, LinearBayes, LogEvidence, PosteriorDensity, PosteriorStd, PredictiveMean,
    PredictiveStd,
};
pub use knn::Knn;
pub use linear::{LinearMap, LinearMle};
pub use logistic::Logistic;
pub use map_estimate::MapEstimate;
pub use mc_dropout::McDropout;
pub use mixture::{MembersOf, Mixture};
pub use modes::{Cil, CoverNet, Mtp, MultiPath};
pub use predict::{Predict, PredictStd};
pub use predictions::{ClassProbabilities, Predictions};
pub use prior::{Flat, Laplace, Normal, Prior};
pub use random_forest::RandomForest;
pub use ridge::Ridge;
pub use scaled::Scaled;
pub use train::Train;

/// Learns a model from data.
pub trait Learner: Debug + Send + Sync {
    /// The model after `steps` updates; closed-form learners have no use for `steps`.
    ///
    /// # Errors
    /// If the data admit no model; the message says why.
    fn train(&self, data: &Dataset, steps: u64, ctx: &Ctx) -> Result<Model, OpError>;

    /// The same where a fixed network of the learner's own architecture is added to the function:
    /// how many times, and whose stream `prior` it is drawn from. None where models are not networks.
    fn train_with_prior(
        &self,
        _data: &Dataset,
        _prior: (f64, &Ctx),
        _steps: u64,
        _ctx: &Ctx,
    ) -> Option<Result<Model, OpError>> {
        None
    }

    /// Whether it learns from observations of a form.
    ///
    /// # Errors
    /// Why not.
    fn fits(&self, form: &Form) -> Result<(), Misfit> {
        ivx_data::form::pairs("this learner", form)
    }

    /// Roughly how many bytes of memory training takes on so many observations, besides these;
    /// closed-form learners take next to none.
    fn memory(&self, _form: &Form, _n: u64) -> u64 {
        0
    }

    /// How many updates it makes in a pass through so many observations.
    fn updates_in_a_pass(&self, _n: usize) -> u64 {
        1
    }

    /// Whether its models are networks.
    fn makes_networks(&self) -> bool {
        false
    }

    /// Whether a fixed network can be added to what it learns.
    fn takes_prior_network(&self) -> bool {
        false
    }

    /// Whether its models say the standard deviation of each target.
    fn says_std(&self) -> bool {
        false
    }

    /// How many modes its models have, as a shape: nothing inside where that is not known yet. None of models without.
    fn modes(&self) -> Option<Vec<usize>> {
        None
    }
}

family!(dyn Learner, "Learner", learners);

fn learners() -> &'static Parts<dyn Learner> {
    static TABLE: LazyLock<Parts<dyn Learner>> = LazyLock::new(|| {
        Parts::<dyn Learner>::new()
            .with(|learner: LinearMle| Box::new(learner))
            .with(|learner: LinearMap| Box::new(learner))
            .with(|learner: MapEstimate| Box::new(learner))
            .with(|learner: Ensemble| Box::new(learner))
            .with(|learner: Scaled| Box::new(learner))
            .with(|learner: Imitative| Box::new(learner))
            .with(|learner: Mtp| Box::new(learner))
            .with(|learner: MultiPath| Box::new(learner))
            .with(|learner: Cil| Box::new(learner))
            .with(|learner: CoverNet| Box::new(learner))
            .with(|learner: Ridge| Box::new(learner))
            .with(|learner: Logistic| Box::new(learner))
            .with(|learner: Knn| Box::new(learner))
            .with(|learner: RandomForest| Box::new(learner))
            .with(|learner: BoostedTrees| Box::new(learner))
    });
    &TABLE
}

/// Adds what this folder declares.
pub(crate) fn register(registry: Registry) -> Registry {
    registry
        .parts(learners())
        .parts(features::table())
        .parts(prior::table())
        .parts(infer::table())
        .op::<Train>()
        .op::<McDropout>()
        .op::<Distilled>()
        .op::<Mixture>()
        .op::<MembersOf>()
        .op::<Predict>()
        .op::<PredictStd>()
        .op::<Predictions>()
        .op::<ClassProbabilities>()
        .op::<Infer>()
        .op::<PredictiveMean>()
        .op::<PredictiveStd>()
        .op::<PosteriorDensity>()
        .op::<PosteriorStd>()
        .op::<LogEvidence>()
}

#[cfg(test)]
mod tests {
    use ivx_op::{Array, Artifact as _, Bytes, Call, Gathered, Lit, Part};

    use super::*;

    /// Runs an operation by name, its defaults filled in as the checker does.
    fn run(op: &'static str, args: &[(&str, Lit)], ports: &[(&str, &Bytes)]) -> Bytes {
        let registry = crate::registry();
        let mut call = Call::default();
        for arg in &registry.decl(op).unwrap().args {
            let given = args.iter().find(|(name, _)| *name == arg.name);
            if let Some(lit) = given.map(|(_, lit)| lit).or(arg.default.as_ref()) {
                call.args.insert(arg.name.to_owned(), registry.complete_lit(lit));
            }
        }
        for (name, bytes) in ports {
            let values = vec![Bytes::clone(bytes)];
            let one = Gathered { dims: vec![], values, name: String::new() };
            call.ports.insert((*name).to_owned(), vec![one]);
        }
        registry.run(op, &call, &Ctx::new(op, 0, None)).unwrap()
    }

    #[test]
    fn a_study_runs_by_name_on_defaults() {
        // Within the data: beyond them the highest prediction is an extrapolation.
        let grid = || Part::new("grid").with("low", -0.8).with("high", 0.8).with("points", 101);
        let features = Part::new("polynomial").with("degree", 20);
        let curve = || Part::new("sinusoids");
        let data = run("sample", &[("reward", curve().into()), ("n", 25.into())], &[]);

        let learner = Part::new("linear_map").with("features", features.clone());
        let model = run("train", &[("learner", learner.into())], &[("on", &data)]);
        let among = [("ke", Part::new("wcm").into()), ("among", grid().into())];
        let decision = run("argmax", &among, &[("model", &model)]);
        let regret = run("regret", &[("under", curve().into())], &[("decision", &decision)]);
        let regret = Array::decode(&regret).unwrap().values[0];
        assert!((0.0..0.3).contains(&regret), "{regret}");

        let bayes = Part::new("linear_bayes").with("features", features);
        let posterior = run("infer", &[("model", bayes.into())], &[("on", &data)]);
        let at = [("at", grid().into())];
        let mean = run("predictive_mean", &at, &[("posterior", &posterior)]);
        // The most probable model is the mean one.
        assert_eq!(mean, run("predict", &at, &[("model", &model)]));
    }
}
