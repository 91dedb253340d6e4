//! Dropout as a posterior sampler.

use ivx_nn::{ArrayOf, Fitted, Model, NetModel, Networks, PRIOR, joined};
use ivx_op::{Ctx, Facts, MemberCount, One, Op, OpError, Shapes, declare};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

declare! {
    /// Members drawn from one network by dropout (Gal and Ghahramani, 2016): each leaves out numbers
    /// of its own, the same for every input, and so is one function.
    ///
    /// They are an ensemble as that of `ensemble`, at the price of one training. The network has `dropout`
    /// layers; what is kept is scaled up as in training.
    pub struct McDropout = "mc_dropout" @ 1, stochastic -> Model {
        /// The network.
        model: One<Model>;
        /// How many members `K` there are.
        members: MemberCount = 8, in 1.0..;
    }
    shapes as_model;
}

fn as_model(facts: &Facts<'_>) -> Option<Shapes> {
    facts.shapes("model").cloned()
}

impl Op for McDropout {
    fn run(&self, ctx: &Ctx) -> Result<Model, OpError> {
        let MemberCount = self.members;
        let mut rng = ctx.rng("masks", &[]);
        drawn(&self.model, &mut rng).ok_or_else(no_dropout)
    }
}

/// A member drawn from a network, or from that inside of what looks at one; none without dropout.
fn drawn(model: &Model, rng: &mut ChaCha8Rng) -> Option<Model> {
    match model {
        Model::Net(net) => {
            let nets = masked(&net.nets, rng)?;
            Some(Model::Net(NetModel { nets, ..net.clone() }))
        }
        Model::Fitted(Fitted { form, function }) => {
            let function = function
                .around(&mut |model| drawn(model, rng))
                .or_else(|| function.rewired(&mut |nets| masked(nets, rng)))?;
            Some(Model::Fitted(Fitted { form: form.clone(), function }))
        }
        Model::Polynomial(_) => None,
    }
}

/// Networks of which numbers are left out, the same for every input; none without dropout.
///
/// A prior network is a fixed function, of which nothing is left out.
fn masked(nets: &Networks, rng: &mut ChaCha8Rng) -> Option<Networks> {
    let mut masked = nets.clone();
    masked.modules.values_mut().for_each(|module| *module = module.masked());
    let mut any = false;
    for (name, module) in &nets.modules {
        let rates = module.dropout_rates();
        any |= !rates.is_empty() && name != PRIOR;
        let masks = masked.modules[name].arrays().into_iter().filter(ArrayOf::is_mask);
        for (mask, rate) in masks.zip(rates).collect::<Vec<_>>() {
            let n = mask.shape.iter().product();
            #[expect(clippy::cast_possible_truncation, reason = "networks are of single precision")]
            let kept = (1.0 / (1.0 - rate)) as f32;
            let mut draw = || if rng.random::<f64>() < rate { 0.0 } else { kept };
            let values: Vec<f32> = if name == PRIOR {
                vec![1.0; n]
            } else {
                std::iter::repeat_with(&mut draw).take(n).collect()
            };
            masked.put((joined(name, &mask.name), mask.shape, values));
        }
    }
    any.then_some(masked)
}

fn no_dropout() -> OpError {
    let why = "the model has no `dropout` layer to draw members by";
    OpError::Failed(why.to_owned())
}

#[cfg(test)]
mod tests {
    use ivx_op::{Lit, Part};

    use super::*;
    use crate::learner::learners;
    use crate::registry;
    use ivx_data::Dataset;
    use ivx_math::moments::{mean, std};
    use ivx_math::standard::Scale;
    use ivx_nn::Scaled;
    use std::sync::Arc;

    fn trained(rate: f64, steps: u64) -> Model {
        let dense = Part::new("dense").with("units", 64_i64).with("activation", Part::new("relu"));
        let dropout = Part::new("dropout").with("rate", rate);
        let layers: Vec<Lit> = vec![dense.into(), dropout.into()];
        let net = Part::new("sequence").with("layers", Lit::List(layers));
        let rate = Part::new("linear").with("from", 0.01).with("to", 0.0);
        let optimiser = Part::new("adam").with("lr", rate);
        let part = Part::new("map_estimate").with("net", net).with("optimiser", optimiser);
        let learner = learners().build(&registry().complete(&part)).unwrap();
        let x: Vec<f64> = (0..41).map(|i| f64::from(i) / 20.0 - 1.0).collect();
        let data = Dataset::pairs(x.clone(), x.iter().map(|x| (3.0 * x).sin()).collect());
        learner.train(&data, steps, &Ctx::new("train", 0, None)).unwrap()
    }

    fn member(model: &Model, k: u64) -> Result<Model, OpError> {
        let sample = McDropout { model: One(model.clone()), members: MemberCount };
        sample.run(&Ctx::new("mc_dropout", 0, Some(k)))
    }

    #[test]
    fn members_differ_and_their_mean_is_the_network() {
        let model = trained(0.1, 500);
        let at = [-0.5, 0.5, 3.0];
        let members: Vec<Vec<f64>> =
            (0..400).map(|k| member(&model, k).unwrap().predict(&at)).collect();
        let of = |i: usize| members.iter().map(|values| values[i]).collect::<Vec<f64>>();
        for (i, whole) in model.predict(&at).into_iter().enumerate() {
            // Behind the dropout the network is linear, so that its mean is exact but for sampling.
            let spread = std(&of(i));
            assert!(spread > 1e-3);
            assert!((mean(&of(i)) - whole).abs() < 4.0 * spread / 20.0, "at {}", at[i]);
        }
        assert!(std(&of(2)) > 2.0 * std(&of(1)), "less is known far from the data");
        assert_eq!(member(&model, 3), member(&model, 3));
    }

    #[test]
    fn nothing_is_left_out_at_rate_0() {
        let model = trained(0.0, 3);
        let at = [0.1, 0.2];
        assert_eq!(member(&model, 5).unwrap().predict(&at), model.predict(&at));
    }

    #[test]
    fn members_of_a_scaled_network_are_those_of_it() {
        let (net, x) = (trained(0.1, 50), Scale { means: vec![1.0], stds: vec![2.0] });
        let y = Scale { means: vec![10.0], stds: vec![5.0] };
        let function = Arc::new(Scaled { model: net.clone(), x, y });
        let scaled = Model::Fitted(Fitted { form: net.form().into_owned(), function });
        let (own, inner) = (member(&scaled, 2).unwrap(), member(&net, 2).unwrap());
        assert_eq!(own.predict(&[2.0]), [10.0 + 5.0 * inner.predict(&[0.5])[0]]);
    }

    #[test]
    fn others_have_no_members() {
        let why = member(&Model::Polynomial(vec![1.0]), 0).unwrap_err().to_string();
        assert_eq!(why, "the model has no `dropout` layer to draw members by");
        let drawn = member(&trained(0.1, 0), 0).unwrap();
        assert!(member(&drawn, 1).is_err(), "what is left out is drawn once");
    }
}
