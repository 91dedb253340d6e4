//! The expert of a world that shows what it would do.

use ivx_data::{Columns, Misfit, Values};
use ivx_op::{OpError, declare};
use ivx_world::{Acts, Spec};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::Actor;
use crate::agent::agent::Acting;

declare! {
    /// The rule-based expert of a `town` that shows `expert`: it does that.
    pub struct Autopilot = "autopilot" @ 1 {
        /// How often it does anything else instead: an action that is drawn evenly between its bounds.
        noise: f64 = 0.0, in 0.0..=1.0;
    }
}

/// The field in which a world shows what its expert would do.
const EXPERT: &str = "expert";

impl Actor for Autopilot {
    fn fits(&self, spec: &Spec) -> Result<(), Misfit> {
        place(spec).map(drop)
    }

    fn open(&self, spec: &Spec) -> Result<Box<dyn Acting + '_>, Misfit> {
        let (field, bounds) = place(spec)?;
        Ok(Box::new(Following { field, bounds, noise: self.noise }))
    }
}

/// The place of the expert's action among what is seen, and the bounds of actions.
fn place(spec: &Spec) -> Result<(usize, Vec<[f32; 2]>), Misfit> {
    let ivx_data::Actions::Continuous { low, high } = &spec.does else {
        let message = "the expert drives by numbers, and this world has discrete actions";
        return Err(Misfit::new(message.to_owned(), "use a `town` or `carnovel`"));
    };
    let found = spec.sees.iter().position(|f| f.name == EXPERT && f.width() == low.len());
    let field = found.ok_or_else(|| {
        let message = "this world does not show what an expert would do";
        Misfit::new(message.to_owned(), "add \"expert\" to what a `town` or `carnovel` shows")
    })?;
    Ok((field, low.iter().zip(high).map(|(low, high)| [*low, *high]).collect()))
}

struct Following {
    field: usize,
    bounds: Vec<[f32; 2]>,
    noise: f64,
}

impl Acting for Following {
    fn act(
        &mut self,
        seen: &Columns,
        rng: &mut ChaCha8Rng,
        acts: &mut Acts,
    ) -> Result<(), OpError> {
        let Values::F32(expert) = seen.values(self.field) else {
            return Err(OpError::Failed("what the expert does are no numbers".to_owned()));
        };
        acts.vectors.copy_from_slice(expert);
        if self.noise > 0.0 {
            for own in acts.vectors.chunks_exact_mut(self.bounds.len()) {
                if rng.random::<f64>() < self.noise {
                    for (act, [low, high]) in own.iter_mut().zip(&self.bounds) {
                        *act = low + (high - low) * rng.random::<f32>();
                    }
                }
            }
        }
        Ok(())
    }
}
