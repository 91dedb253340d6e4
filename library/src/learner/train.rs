//! Training.

use ivx_op::{Args, Ctx, Literal as _, Needs, One, Op, OpError, declare};

use super::Learner;
use super::form::{self, form_of_data, learner_fits};
use crate::artifact::{Dataset, Form, Model};

declare! {
    /// A model learned from data. An ensemble of learners gives an ensemble of models.
    pub struct Train = "train" @ 4 -> Model {
        /// How to learn.
        learner: Box<dyn Learner>;
        /// The data.
        on: One<Dataset>;
        /// How many updates; closed-form learners make none.
        steps: u64 = 0, in 0.0.., unit "updates";
    }
    rule learner_fits;
    shapes form_of_data;
}

impl Op for Train {
    fn run(&self, ctx: &Ctx) -> Result<Model, OpError> {
        self.learner.fits(&self.on.form).map_err(form::failed)?;
        self.learner.train(&self.on, self.steps, ctx)
    }

    fn needs(args: &Args, input_bytes: u64) -> Needs {
        // A learner that holds what was computed cannot be built without it.
        let learner = args.get("learner").map(Box::<dyn Learner>::from_lit);
        let form = Form::default();
        let n = input_bytes / 16;
        let training = learner.and_then(Result::ok).map_or(0, |l| l.memory(&form, n));
        Needs { memory: training + input_bytes, ..Needs::default() }
    }
}

#[cfg(test)]
mod tests {
    use ivx_op::Part;

    use super::*;

    /// What a training on 100 pairs takes, in bytes.
    fn memory(learner: &Part) -> u64 {
        let registry = crate::registry();
        let args = Args::from([("learner".into(), registry.complete(learner).into())]);
        let needs = registry.needs("train", &args, 1600);
        assert_eq!(needs.threads, 1);
        needs.memory
    }

    #[test]
    fn memory_is_that_of_parameters_and_outputs() {
        assert_eq!(memory(&Part::new("linear_map")), 1600);
        let net = Part::new("mlp").with("hidden", vec![8_i64, 4]);
        let learner = Part::new("map_estimate").with("net", net);
        // 2·8 + 9·4 + 5·1 parameters; 8 + 4 + 1 outputs for each pair.
        let of_net = 57 * 24 + 13 * 100 * 12;
        assert_eq!(memory(&learner), of_net + 1600);
        let ensemble = Part::new("ensemble").with("learner", learner);
        assert_eq!(memory(&ensemble.clone().with("bootstrap", false)), of_net * 5 / 4 + 1600);
        assert_eq!(memory(&ensemble.with("prior_network", false)), of_net + 2 * 1600);
    }
}
