//! Many models as one.

use std::any::Any;
use std::sync::Arc;

use ivx_data::form;
use ivx_nn::{Fitted, Mixture as EvenMixture, Model};
use ivx_op::{Array, Ctx, Facts, MemberCount, Members, One, Op, OpError, Shapes, declare};

use super::spread::with_std;
use crate::planner::MODES;

declare! {
    /// The even mixture of the members of an ensemble, as one model. Of numbers it is the normal distribution with the
    /// mixture's moments (Lakshminarayanan, Pritzel and Blundell, 2017, §2.4):
    /// `μ = 1/M Σ μ_m` and `σ² = 1/M Σ (σ_m² + μ_m²) − μ²`. Of classes it has the mean of their probabilities.
    ///
    /// So `rmse`, `nll`, `accuracy`, `predict` and `predict_std` are of the ensemble as a whole. Members that say a
    /// standard deviation were trained under `gaussian_nll()`; for others it is `noise`.
    pub struct Mixture = "mixture" @ 1 -> Model {
        /// The members.
        model: Members<Model>;
        /// The standard deviation of the noise under members that say none, which may be computed; 0 where left out.
        noise: Option<One<Array>>;
    }
    shapes of_members;
}

/// What members are of, and a standard deviation; the mean of their predictions has no modes.
fn of_members(facts: &Facts<'_>) -> Option<Shapes> {
    let mut shapes = facts.shapes("model")?.clone();
    shapes.remove(MODES);
    Some(with_std(shapes, true))
}

impl Op for Mixture {
    fn run(&self, _: &Ctx) -> Result<Model, OpError> {
        let form = self.model[0].form().into_owned();
        for other in &self.model[1..] {
            form::same(&form, &other.form()).map_err(form::failed)?;
        }
        let noise = match self.noise.as_deref().map_or(&[0.0][..], |noise| &noise.values) {
            [noise] if *noise >= 0.0 => *noise,
            [noise] => {
                return Err(OpError::Failed(format!("`noise` is {noise}, and no deviation")));
            }
            several => {
                let why = format!("`noise` is {} numbers instead of one", several.len());
                return Err(OpError::Failed(why));
            }
        };
        let function = EvenMixture { members: self.model.to_vec(), noise };
        Ok(Model::Fitted(Fitted { form, function: Arc::new(function) }))
    }
}

declare! {
    /// The members of a `mixture`, or of what `adapt` learned, as an ensemble again.
    pub struct MembersOf = "members_of" @ 1, stochastic -> Model {
        /// The mixture.
        model: One<Model>;
        /// How many members it has.
        members: MemberCount, in 1.0..;
    }
    shapes as_model;
}

/// What they are of is known, and no more: a mixture says a standard deviation where its members may not.
fn as_model(facts: &Facts<'_>) -> Option<Shapes> {
    ivx_data::form::form(facts, "model").map(|form| form.shapes())
}

impl Op for MembersOf {
    fn run(&self, ctx: &Ctx) -> Result<Model, OpError> {
        let MemberCount = self.members;
        let of: Option<&EvenMixture> = match &*self.model {
            Model::Fitted(fitted) => (&*fitted.function as &dyn Any).downcast_ref(),
            _ => None,
        };
        let of = of.ok_or_else(|| OpError::Failed("the model is no mixture of models".into()))?;
        let k = ctx.member.and_then(|k| usize::try_from(k).ok()).unwrap_or_default();
        of.members.get(k).cloned().ok_or_else(|| {
            let n = of.members.len();
            OpError::Failed(format!("there is no member {} of {n}: ask for {n} members", k + 1))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::learner::PredictStd;
    use crate::metric::{Accuracy, Nll, Rmse};
    use ivx_data::{Dataset, Form};
    use ivx_nn::{Curve, Head, Module, NetModel};
    use ivx_op::Artifact as _;
    use ivx_world::Grid;

    const CTX: Ctx = Ctx::new("mixture", 0, None);

    /// A network that puts out its biases, whatever it is shown.
    fn constant(outputs: &[f32], form: &Form, head: Head) -> Model {
        let n = outputs.len();
        let module = Module::Dense { inputs: 1, outputs: n, curve: Curve::Identity };
        let arrays = vec![
            ("bias".into(), vec![n], outputs.to_vec()),
            ("weight".into(), vec![1, n], vec![0.0; n]),
        ];
        Model::Net(NetModel::new(module, form.clone(), head, 0.0, arrays))
    }

    fn mixed(members: Vec<Model>, noise: f64) -> One<Model> {
        let mixture = Mixture { model: Members(members), noise: Some(One(Array::scalar(noise))) }
            .run(&CTX)
            .unwrap();
        assert_eq!(Model::decode(&mixture.encode()).as_ref(), Some(&mixture));
        One(mixture)
    }

    fn close(found: Result<Array, OpError>, expected: f64) {
        let found = found.unwrap().values[0];
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }

    /// Means 1 and 5 with standard deviations 1 and 3: μ = 3 and σ² = (1 + 9)/2 + (1 + 25)/2 − 9 = 9.
    #[test]
    fn two_normals_by_hand() {
        let form = Form::default();
        let of = |mean: f32, std: f32| constant(&[mean, std.ln()], &form, Head::Gaussian);
        let mixture = mixed(vec![of(1.0, 1.0), of(5.0, 3.0)], 100.0);
        let at = Box::new(Grid { low: 0.0, high: 1.0, points: 2 });
        let std = PredictStd { model: mixture.clone(), at }.run(&CTX);
        close(std, 3.0);
        assert!(mixture.predict(&[0.3])[0] - 3.0 < 1e-6);
        // Of 0 and of 6, each 3 = σ away: ln(3 √(2π)) + ½. The error is 3.
        let on = One(Dataset::pairs(vec![0.0, 1.0], vec![0.0, 6.0]));
        let expected = (3.0 * std::f64::consts::TAU.sqrt()).ln() + 0.5;
        close(Nll { model: mixture.clone(), on: on.clone() }.run(&CTX), expected);
        close(Rmse { model: mixture, on: on.clone() }.run(&CTX), 3.0);
        // One alone: 1 and 5 away from the mean 1, by its own standard deviation 1.
        let expected = std::f64::consts::TAU.sqrt().ln() + (1.0 + 25.0) / 4.0;
        close(Nll { model: One(of(1.0, 1.0)), on: on.clone() }.run(&CTX), expected);
        close(Rmse { model: One(of(1.0, 1.0)), on }.run(&CTX), 13.0_f64.sqrt());
    }

    /// Of vectors the numbers add up, and the mean is over observations.
    #[test]
    fn numbers_of_a_target_add_up() {
        let form = Form { target: vec![2], ..Form::default() };
        let model = constant(&[0.0, 1.0, 0.0, 2.0_f32.ln()], &form, Head::Gaussian);
        let on = One(Dataset { form, x: vec![0.0], y: vec![2.0, 5.0] });
        let log_2_pi = std::f64::consts::TAU.ln();
        let expected = log_2_pi + 2.0_f64.ln() + 0.5 * (4.0 + 4.0);
        close(Nll { model: One(model), on }.run(&CTX), expected);
    }

    #[test]
    fn members_without_spread_have_the_noise_and_one_is_itself() {
        // Lines 0 and 2x at 1: μ = 1, σ² = 0.25 + 1.
        let lines = vec![Model::Polynomial(vec![0.0]), Model::Polynomial(vec![0.0, 2.0])];
        let at = || Box::new(Grid { low: 1.0, high: 2.0, points: 2 });
        close(PredictStd { model: mixed(lines.clone(), 0.5), at: at() }.run(&CTX), 1.25_f64.sqrt());
        let alone = mixed(lines[1..].to_vec(), 0.5);
        close(PredictStd { model: alone.clone(), at: at() }.run(&CTX), 0.5);
        assert_eq!(alone.predict(&[3.0]), [6.0]);
        let why = PredictStd { model: One(lines[0].clone()), at: at() }.run(&CTX).unwrap_err();
        assert!(why.to_string().starts_with("the model says no standard deviation"), "{why}");
        let on = One(Dataset::pairs(vec![0.0], vec![0.0]));
        let why = Nll { model: mixed(lines, 0.0), on }.run(&CTX).unwrap_err().to_string();
        assert_eq!(why, "the standard deviation of observation 0 is 0: give the members noise");
    }

    /// Probabilities ¾ and ¼ have the mean ½, where logits ln 3 and −2 ln 3 would have one below.
    #[test]
    fn probabilities_of_classes_are_averaged() {
        let form = Form { classes: Some(2), ..Form::default() };
        let two = |second: f32| constant(&[second], &form, Head::Logits);
        let three = 3.0_f32.ln();
        let mixture = mixed(vec![two(three), two(-three)], 0.0);
        assert!((mixture.class_shares(&[0.0])[1] - 0.5).abs() < 1e-6);
        let mixture = mixed(vec![two(three), two(three), two(-2.0 * three)], 0.0);
        // (¾ + ¾ + 1/10)/3 = 8/15.
        let on = One(Dataset { form: form.clone(), x: vec![0.0], y: vec![1.0] });
        close(Nll { model: mixture.clone(), on: on.clone() }.run(&CTX), -(8.0_f64 / 15.0).ln());
        close(Accuracy { model: mixture, on }.run(&CTX), 1.0);
    }
}
