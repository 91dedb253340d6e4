//! Models that move in a latent space.

use ivx_data::{Actions, Columns, Misfit, NOT_FINITE, Values, finite};
use ivx_nn::{Latent, Live, Shape, WorldModel};
use ivx_op::{One, declare};
use ivx_world::Spec;

use super::{Simulating, Simulator};

declare! {
    /// A latent world model, unrolled along a plan (Eqns. 2.66, 2.67): its rewards, and by a model that has values what the
    /// last state is worth, which a `partial_model` is. One that has none foretells rewards alone.
    pub struct LatentModel = "latent" @ 1 {
        /// The model.
        model: One<WorldModel>;
    }
}

impl Simulator for LatentModel {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        let layout = &self.model.layout;
        let help = "use a model of episodes in this world";
        let (Some((n, n_actions)), Actions::Discrete(names)) =
            (finite(&spec.sees, &spec.does), &spec.does)
        else {
            let message = NOT_FINITE.replace("these episodes are", "this world is");
            return Err(Misfit::new(message.replace("of a world that is ", ""), help));
        };
        if (layout.n_states, &layout.actions) != (n, names) {
            let (of, own) = (layout.n_states, layout.actions.len());
            let message = format!(
                "the model is of {of} states and {own} actions, and this world has {n} and {n_actions}"
            );
            return Err(Misfit::new(message, help));
        }
        Ok(())
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Simulating + '_>, Misfit> {
        self.fits(spec)?;
        let live = Live::of(&self.model.nets);
        let start = Vec::with_capacity(self.model.layout.latent);
        Ok(Box::new(Unrolling { live, of: &self.model, start, read: Vec::new() }))
    }
}

struct Unrolling<'a> {
    live: Live,
    of: &'a WorldModel,
    /// The latent state in which plans begin.
    start: Vec<f32>,
    read: Vec<f32>,
}

impl Simulating for Unrolling<'_> {
    fn n_members(&self) -> usize {
        1
    }

    fn begin(&mut self, seen: &Columns, row: usize) {
        let Values::Index(states) = seen.values(0) else { unreachable!("the world is finite") };
        let (graph, n_states) = (&self.live.graph, self.of.layout.n_states);
        graph.begin();
        let start = graph.still(|| {
            let x = graph.filled(Shape::vectors(1, n_states), |out| {
                out.fill(0.0);
                out[states[row] as usize] = 1.0;
            });
            Latent::of(&self.live).representation.of(graph, x)
        });
        graph.read(start, &mut self.start);
    }

    fn returns(&mut self, plans: &[f64], n: usize, discount: f64, returns: &mut [f64]) {
        let Self { live, of, start, read } = self;
        let (graph, nets, horizon) = (&live.graph, Latent::of(live), plans.len() / n);
        let (latent, n_actions) = (start.len(), of.layout.actions.len());
        returns.fill(0.0);
        let mut gain = |weight: f64, read: &[f32]| {
            let each = returns.iter_mut().zip(read);
            each.for_each(|(sum, x)| *sum += weight * f64::from(*x));
        };
        let mut weight = 1.0;
        graph.begin();
        graph.still(|| {
            let mut z = graph.filled(Shape::vectors(n, latent), |out| {
                out.chunks_exact_mut(latent).for_each(|out| out.copy_from_slice(start));
            });
            for t in 0..horizon {
                let act = graph.filled(Shape::vectors(n, n_actions), |out| {
                    out.fill(0.0);
                    for (out, plan) in out.chunks_exact_mut(n_actions).zip(plans.chunks(horizon)) {
                        out[place(plan[t])] = 1.0;
                    }
                });
                let step = graph.concat(&[z, act]);
                graph.read(nets.reward.of(graph, step), read);
                gain(weight, read);
                weight *= discount;
                z = nets.dynamics.of(graph, step);
            }
            if let Some(value) = live.get("value") {
                graph.read(value.of(graph, z), read);
                gain(weight, read);
            }
        });
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is a place")]
fn place(x: f64) -> usize {
    x as usize
}
