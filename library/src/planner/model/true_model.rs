//! The world itself.

use ivx_data::{Act, Actions, Columns, Misfit};
use ivx_op::declare;
use ivx_world::{Env, Foresight, Spec};

use super::{Simulating, Simulator};

declare! {
    /// The world itself, in which what follows is known from what is seen: one of classic control, or one that is finite.
    /// Where chance decides, a plan returns what it does on average.
    pub struct TrueModel = "true_model" @ 1 {
        /// The world, which may be another than that which is acted in, if it shows and takes the same.
        of: Box<dyn Env>;
    }
}

impl Simulator for TrueModel {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        self.of.spec()?.same(spec)?;
        self.of.foresight().map(drop)
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Simulating + '_>, Misfit> {
        self.of.spec()?.same(spec)?;
        let foresight = self.of.foresight()?;
        let width = match &spec.does {
            Actions::Discrete(_) => 0,
            Actions::Continuous { low, .. } => low.len(),
        };
        let (place, act) = (vec![0.0; foresight.width()], vec![0.0; width]);
        Ok(Box::new(Foreseen { foresight, act, place, stands: Vec::new(), states: Vec::new() }))
    }
}

struct Foreseen {
    foresight: Box<dyn Foresight>,
    /// An action of real numbers; none of discrete ones.
    act: Vec<f32>,
    /// Where plans begin.
    place: Vec<f64>,
    /// Where the last plan was before each of its steps.
    states: Vec<f64>,
    /// How it stood by then.
    stands: Vec<Standing>,
}

#[derive(Clone, Copy)]
struct Standing {
    /// What was returned.
    gained: f64,
    /// What a reward is worth from here.
    weight: f64,
    over: bool,
}

impl Simulating for Foreseen {
    fn n_members(&self) -> usize {
        1
    }

    fn begin(&mut self, seen: &Columns, row: usize) {
        self.foresight.place(seen, row, &mut self.place);
    }

    fn returns(&mut self, plans: &[f64], n: usize, discount: f64, returns: &mut [f64]) {
        let (len, width) = (plans.len() / n, self.act.len().max(1));
        let (horizon, size) = (len / width, self.place.len());
        self.states.resize((horizon + 1) * size, 0.0);
        self.states[..size].copy_from_slice(&self.place);
        let start = Standing { gained: 0.0, weight: 1.0, over: false };
        self.stands.resize(horizon + 1, start);
        self.stands[0] = start;
        for (i, plan) in plans.chunks_exact(len).enumerate() {
            // Steps that are those of the plan before are not taken again.
            let before = if i > 0 { &plans[(i - 1) * len..][..len] } else { &[] };
            let same = plan.iter().zip(before).take_while(|(a, b)| a == b).count() / width;
            for t in same..horizon {
                let mut stands = self.stands[t];
                self.states.copy_within(t * size..(t + 1) * size, (t + 1) * size);
                if !stands.over {
                    let (pays, over) = self.step(&plan[t * width..][..width], t + 1);
                    let Standing { gained, weight, .. } = stands;
                    stands = Standing {
                        gained: gained + weight * pays,
                        weight: weight * discount,
                        over,
                    };
                }
                self.stands[t + 1] = stands;
            }
            returns[i] = self.stands[horizon].gained;
        }
    }
}

impl Foreseen {
    /// Takes an action from the state at `at`, which becomes what follows.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "worlds take single precision, and a place is one"
    )]
    fn step(&mut self, numbers: &[f64], at: usize) -> (f64, bool) {
        let size = self.place.len();
        let state = &mut self.states[at * size..][..size];
        let act = if self.act.is_empty() {
            Act::Index(numbers[0] as usize)
        } else {
            self.act.iter_mut().zip(numbers).for_each(|(act, x)| *act = *x as f32);
            Act::Vector(&self.act)
        };
        self.foresight.step(state, act)
    }
}
