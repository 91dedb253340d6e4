//! Imitative models of plans (§3.1).

use std::sync::Arc;

use ivx_data::{Dataset, Form, Misfit};
use ivx_nn::{
    Fitted, Imitative as Network, Model, Net, Optimiser, PlanNets, PlanTraining, Rule, Turns,
    fit_plans,
};
use ivx_op::{Ctx, OpError, Part, declare};

use super::{Learner, Prior};

declare! {
    /// An imitative model (Eqns. 3.2 to 3.4, Fig. 3.3): how probable a plan is for who was imitated, where something is
    /// seen; the maximum a posteriori estimate by gradient descent.
    ///
    /// ```text
    /// ln q(a | s) = Σ_t ln N(a_t; a_{t-1} + δ_t, diag σ_t²),  (δ_t, σ_t) = f(h_t),  h_t = GRU(a_{t-1}, h_{t-1}),  a_0 = 0
    /// ```
    ///
    /// It learns from data whose targets are plans `[steps, dims]` of places, seen from where they begin. The state that
    /// the cell begins with is made of the input, by `net` and a linear map, and of the numbers beside it. `σ` is
    /// `ln(1 + e^z) + 0.001` of what the network puts out. What such a model predicts is the plan of its means.
    pub struct Imitative = "imitative" @ 1, stochastic {
        /// What sees an input, up to the last linear map.
        net: Box<dyn Net> = Part::new("mobilenet_v2");
        /// How many numbers that map ends in.
        features: usize = 128, in 1.0..=1e6;
        /// Widths of the hidden layers that make a state of these and of the numbers beside an input.
        merge: Vec<usize> = vec![64_i64, 64], in 1.0..=1e6;
        /// How many numbers a state has.
        hidden: usize = 64, in 1.0..=1e6;
        /// Widths of the hidden layers that say where the next place is.
        head: Vec<usize> = vec![64_i64, 32], in 1.0..=1e6;
        /// The prior over each parameter.
        prior: Box<dyn Prior> = Part::new("normal");
        /// How the objective is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("adam");
        /// How many observations an update looks at; 0 for all.
        batch: usize = 0, in 0.0..;
        /// The standard deviation of the noise that is added to the places of plans in every update.
        noise: f64 = 0.01, in 0.0..;
    }
}

impl Imitative {
    fn nets(&self) -> PlanNets<'_> {
        let Self { features, merge, hidden, head, .. } = self;
        PlanNets { net: &*self.net, features: *features, merge, units: *hidden, head }
    }
}

impl Learner for Imitative {
    fn train(&self, data: &Dataset, steps: u64, ctx: &Ctx) -> Result<Model, OpError> {
        let failed = |misfit: Misfit| OpError::Failed(misfit.message);
        if data.is_empty() {
            return Err(OpError::Failed("there are no data to train on".to_owned()));
        }
        let initial = Network::drawn(&self.nets(), &data.form, &mut ctx.rng("init", &[]));
        #[expect(clippy::cast_precision_loss, reason = "data count far below 2^53")]
        let pull = self.prior.pull(1.0, data.len() as f64);
        let rule = Rule { optimiser: &*self.optimiser, pull, steps };
        let how = PlanTraining { rule, batch: self.batch, noise: self.noise };
        let model = fit_plans(initial.map_err(failed)?, data, &how, ctx)?;
        if !model.networks().are_finite() {
            let message =
                format!("training diverged within {steps} steps: lower the learning rate");
            return Err(OpError::Failed(message));
        }
        Ok(Model::Fitted(Fitted { form: data.form.clone(), function: Arc::new(model) }))
    }

    fn fits(&self, form: &Form) -> Result<(), Misfit> {
        self.nets().modules(form).map(drop)
    }

    fn memory(&self, form: &Form, n: u64) -> u64 {
        let Ok(modules) = self.nets().modules(form) else { return 0 };
        let params: u64 = modules.values().map(ivx_nn::Module::n_params).sum();
        let at_once = if self.batch == 0 { n } else { n.min(self.batch as u64) };
        let steps = form.target.first().copied().unwrap_or(1) as u64;
        let of_step = self.hidden * 8 + self.head.iter().sum::<usize>();
        let outputs = modules["see"].n_outputs(&form.input) + steps * of_step as u64;
        let data = n.saturating_mul(4 * (form.input_len() + form.target_len()) as u64);
        // A parameter, its gradient, two running averages and two copies; an output, its gradient and a temporary.
        (params * 24).saturating_add(outputs.saturating_mul(at_once * 12)).saturating_add(data)
    }

    fn updates_in_a_pass(&self, n: usize) -> u64 {
        if n == 0 { 1 } else { Turns::new(n, self.batch).in_a_pass() }
    }

    fn makes_networks(&self) -> bool {
        true
    }
}
