//! Models of Markov reward processes with values (Example 5.1).

use ivx_data::Dataset;
use ivx_data::form;
use ivx_nn::{Latent, Live, Module, Net, Optimiser, Real as _, Shape, predicted_values};
use ivx_nn::{Layout, WorldModel};
use ivx_op::{Array, Ctx, Dim, Facts, Labels, One, Op, OpError, Part, Wrong, declare};
use ivx_world::Points;

use super::{Training, trained, untrained};

declare! {
    /// A value function and a latent model of a Markov reward process whose states are numbers, learned together from
    /// what some states are worth (Example 5.1): all model-predicted values over 0 to `unroll` steps should be that
    /// (Eqn. 5.11).
    ///
    /// Latent states lie between −1 and 1. One follows another by long short-term memory with as many units, which
    /// sees it from a state of zeros (Eqn. 5.9c).
    pub struct ProcessModel = "process_model" @ 2, stochastic -> WorldModel {
        /// States, and what each is worth.
        on: One<Dataset>;
        /// How many steps `K` it is unrolled.
        unroll: usize = 10, in 0.0..=1e3, unit "steps";
        /// What a reward one step later is worth.
        discount: f64 = 0.9, in 0.0..=1.0;
        /// How many numbers a latent state has.
        latent: usize = 32, in 1.0..=1e4;
        /// The layers of representation, value and reward, up to their last linear maps.
        net: Box<dyn Net> = Part::new("mlp").with("hidden", vec![32_i64]).with("activation", Part::new("elu"));
        /// How the loss is lowered.
        optimiser: Box<dyn Optimiser> = Part::new("adamw")
            .with("lr", Part::new("constant").with("value", 1e-2));
        /// How many states an update looks at; 0 for all.
        batch: usize = 0, in 0.0..;
        /// How many updates.
        steps: u64 = 500, in 0.0..;
    }
    rule of_pairs;
}

fn of_pairs(facts: &Facts<'_>) -> Result<(), Wrong> {
    let form = form::form(facts, "on").unwrap_or_default();
    form::pairs("this operation", &form).map_err(form::wrong("on"))
}

declare! {
    /// The model-predicted values of a `process_model` over 0 to `unroll` steps (Eqns. 5.10a to d): the members of its
    /// implicit ensemble of values, at some states.
    pub struct ProcessValues = "process_values" @ 1 -> Array [k, x] {
        /// The model.
        of: One<WorldModel>;
        /// The states.
        at: Box<dyn Points>;
        /// The most steps.
        unroll: usize = 10, in 0.0..=1e3, unit "steps";
        /// What a reward one step later is worth.
        discount: f64 = 0.9, in 0.0..=1.0;
    }
}

impl Op for ProcessModel {
    fn run(&self, ctx: &Ctx) -> Result<WorldModel, OpError> {
        form::pairs("this operation", &self.on.form).map_err(form::failed)?;
        if self.on.is_empty() {
            return Err(OpError::Failed("there are no states to learn from".to_owned()));
        }
        let latent = self.latent;
        let memory = vec![Module::Lstm { inputs: latent, units: latent }, Module::Last];
        let nets = [("dynamics".to_owned(), Module::Sequence(memory))].into();
        let layout = Layout { n_states: 1, actions: Vec::new(), latent };
        let model =
            untrained((layout, nets), &*self.net, &["representation", "value", "reward"], ctx)?;
        let (optimiser, batch, steps) = (&*self.optimiser, self.batch, self.steps);
        let how = Training { optimiser, batch, steps };
        trained(model, self.on.len(), &how, ctx, |live, places| {
            let graph = &live.graph;
            let column = |of: &[f64]| {
                let values: Vec<f32> = places.iter().map(|i| f32::of(of[*i])).collect();
                graph.input(Shape::vectors(places.len(), 1), &values)
            };
            let (states, targets) = (column(&self.on.x), column(&self.on.y));
            let unroll = (self.unroll, self.discount);
            let members =
                predicted_values(graph, &Latent::of(live), live.body("value"), states, unroll);
            let apart =
                members.into_iter().map(|v| graph.mean(graph.square(graph.sub(v, targets))));
            apart.reduce(|a, b| graph.add(a, b)).expect("there is one over 0 steps")
        })
    }
}

impl Op for ProcessValues {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let live = Live::of(&self.of.nets);
        let graph = &live.graph;
        let value = live.get("value").filter(|_| self.of.layout.actions.is_empty());
        let Some(value) = value else {
            return Err(OpError::Failed("the model is not of a reward process".to_owned()));
        };
        let points = self.at.points()?;
        let states: Vec<f32> = points.iter().map(|x| f32::of(*x)).collect();
        let states = graph.input(Shape::vectors(states.len(), 1), &states);
        let unroll = (self.unroll, self.discount);
        let members =
            graph.still(|| predicted_values(graph, &Latent::of(&live), value, states, unroll));
        let values = members.into_iter().flat_map(|v| graph.value(v)).map(f64::from).collect();
        let steps = Labels::count(self.unroll + 1);
        let x = Labels::Numbers(points);
        Ok(Array { dims: vec![Dim::new("k", steps), Dim::new("x", x)], values })
    }
}
