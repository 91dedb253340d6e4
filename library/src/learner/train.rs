//! Training.

use ivx_data::form::{self, form_of_data};
use ivx_data::{Dataset, Form};
use ivx_nn::Model;
use ivx_op::{Args, Ctx, Facts, Literal as _, Needs, One, Op, OpError, Shapes, Wrong, declare};

use super::Learner;
use super::spread::with_std;
use crate::planner::MODES;

declare! {
    /// A model learned from data. An ensemble of learners gives an ensemble of models.
    pub struct Train = "train" @ 4 -> Model {
        /// How to learn.
        learner: Box<dyn Learner>;
        /// The data.
        on: One<Dataset>;
        /// How many updates. Learners of networks need it or `epochs`, and closed-form learners make none.
        steps: u64 = 0, in 0.0.., unit "updates";
        /// How many passes through the data, instead of `steps`; what does not fill a batch is left out of each.
        epochs: u64 = 0, in 0.0.., unit "passes";
    }
    rule learns;
    shapes of_model;
}

/// What the model is of, whether it says a standard deviation, and how many modes it has.
fn of_model(facts: &Facts<'_>) -> Option<Shapes> {
    let form = form_of_data(facts)?;
    let Some(learner) = facts.arg::<Box<dyn Learner>>("learner") else { return Some(form) };
    let mut shapes = with_std(form, learner.says_std());
    shapes.extend(learner.modes().map(|modes| (MODES.to_owned(), modes)));
    Some(shapes)
}

/// The rule that `learner` learns from the data `on`.
fn learner_fits(facts: &Facts<'_>) -> Result<(), Wrong> {
    match (facts.arg::<Box<dyn Learner>>("learner"), form::form(facts, "on")) {
        (Some(learner), Some(form)) => learner.fits(&form).map_err(form::wrong("learner")),
        _ => Ok(()),
    }
}

/// A network that was never updated is none that was learned: whoever wants the initial one says
/// so by `steps: 0`.
fn learns(facts: &Facts<'_>) -> Result<(), Wrong> {
    learner_fits(facts)?;
    let Some(learner) = facts.arg::<Box<dyn Learner>>("learner") else { return Ok(()) };
    let told = |arg: &str| facts.arg::<u64>(arg).unwrap_or_default();
    let wrong = |arg: &'static str, message: &str, help: &str| {
        Err(Wrong { arg, message: message.to_owned(), help: help.to_owned() })
    };
    if facts.is_given("steps") && facts.is_given("epochs") {
        let message = "`steps` are updates and `epochs` are passes: both say how long";
        return wrong("epochs", message, "leave out one of them");
    }
    if learner.makes_networks() && !facts.is_given("steps") && !facts.is_given("epochs") {
        let help =
            "write `steps: 1_000` or `epochs: 40`, or `steps: 0` for the network as it is drawn";
        let message = "this learner makes its updates one by one, and `train` needs `steps`";
        return wrong("steps", message, help);
    }
    for arg in ["steps", "epochs"] {
        if !learner.makes_networks() && told(arg) > 0 {
            let help = format!(
                "leave `{arg}` out; of several learners along an axis, choose it by `match`, with 0 for \
                 this one"
            );
            return wrong(arg, "this learner is in closed form, and makes no steps", &help);
        }
    }
    Ok(())
}

impl Op for Train {
    fn run(&self, ctx: &Ctx) -> Result<Model, OpError> {
        self.learner.fits(&self.on.form).map_err(form::failed)?;
        let steps = match self.epochs {
            0 => self.steps,
            epochs => epochs.saturating_mul(self.learner.updates_in_a_pass(self.on.len())),
        };
        self.learner.train(&self.on, steps, ctx)
    }

    fn needs(args: &Args, shapes: Option<&Shapes>, input_bytes: u64) -> Needs {
        // A learner that holds what was computed cannot be built without it.
        let learner = args.get("learner").map(Box::<dyn Learner>::from_lit);
        let form = shapes.and_then(Form::of).unwrap_or_default();
        let n = input_bytes / (8 * (form.input_len() + form.target_len()) as u64).max(1);
        let training = learner.and_then(Result::ok).map_or(0, |l| l.memory(&form, n));
        Needs { memory: training + input_bytes, ..Needs::default() }
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::Part;

    use super::*;
    use crate::learner::learners;

    /// What a training on 100 pairs takes, in bytes.
    fn memory(learner: &Part) -> u64 {
        let registry = crate::registry();
        let args = Args::from([("learner".into(), registry.complete(learner).into())]);
        let needs = registry.needs("train", &args, None, 1600);
        assert_eq!(needs.threads, 1);
        needs.memory
    }

    #[test]
    fn memory_is_that_of_parameters_and_outputs() {
        assert_eq!(memory(&Part::new("linear_map")), 1600);
        let net = Part::new("mlp").with("hidden", vec![8_i64, 4]);
        let learner = Part::new("map_estimate").with("net", net);
        // 2·8 + 9·4 + 5·1 parameters; 8 + 4 + 1 outputs for each pair.
        // And the pairs in single precision, twice.
        let of_net = 57 * 24 + 13 * 100 * 12 + 1600;
        assert_eq!(memory(&learner), of_net + 1600);
        let ensemble = Part::new("ensemble").with("learner", learner);
        assert_eq!(memory(&ensemble.clone().with("bootstrap", false)), of_net * 5 / 4 + 1600);
        assert_eq!(memory(&ensemble.with("prior_network", false)), of_net + 2 * 1600);
    }

    /// 7 observations in batches of 3 are 2 updates a pass, and one that looks at all of them is one.
    #[test]
    fn epochs_are_passes() {
        let x: Vec<f64> = (0..7).map(f64::from).collect();
        let on = || One(Dataset::pairs(x.clone(), x.clone()));
        let net = Part::new("mlp").with("hidden", vec![2_i64]);
        let trained = |part: &Part, steps, epochs| {
            let learner = learners().build(&crate::registry().complete(part)).unwrap();
            Train { learner, on: on(), steps, epochs }.run(&Ctx::new("train", 0, None)).unwrap()
        };
        let whole = Part::new("map_estimate").with("net", net);
        let some = whole.clone().with("batch", 3_i64);
        let many = Part::new("ensemble").with("learner", some.clone());
        for (part, updates) in [(whole, 1), (some, 2), (many, 2)] {
            assert_eq!(trained(&part, 0, 5), trained(&part, 5 * updates, 0));
            assert_ne!(trained(&part, 0, 5), trained(&part, 5 * updates - 1, 0));
        }
    }

    #[test]
    fn memory_of_a_network_for_images_follows_their_shape() {
        let registry = crate::registry();
        let learner = Part::new("map_estimate")
            .with("net", Part::new("cnn").with("channels", vec![2_i64]).with("hidden", vec![5_i64]))
            .with("loss", Part::new("cross_entropy"))
            .with("batch", 8_i64);
        let args = Args::from([("learner".into(), registry.complete(&learner).into())]);
        let form =
            Form { input: vec![3, 6, 6], target: vec![], classes: Some(4), ..Form::default() };
        // 2·3·9 + 2 of the convolution, 5·32 + 5 and 4·5 + 4; 32 numbers twice, for they are flattened,
        // 5 and 4 of each of 8 images; 109 numbers in each of 100.
        let expected = (56 + 165 + 24) * 24 + (32 + 32 + 5 + 4) * 8 * 12 + 109 * 100 * (8 + 8);
        let needs = registry.needs("train", &args, Some(&form.shapes()), 109 * 100 * 8);
        assert_eq!(needs.memory, expected);
    }
}
