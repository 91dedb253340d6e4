//! How a model of modes learns from plans.

use ivx_data::Dataset;
use ivx_op::{Ctx, OpError};

use super::loss::{chosen_losses, commanded_losses, made_losses, moved_losses};
use super::model::outputs;
use super::{Anchored, Modes, Multimodal};
use crate::descend::{Rule, Turns, descend};
use crate::graph::{Graph, Var};
use crate::live::Live;
use crate::module::Mode;
use crate::network::singles;
use crate::seen::plan_sizes;

/// How a model of modes is trained.
#[derive(Clone, Copy, Debug)]
pub struct ModeTraining<'a> {
    /// How the objective is lowered, and for how long.
    pub rule: Rule<'a>,
    /// How many observations an update looks at; all where there are not more, or it is 0.
    pub batch: usize,
    /// How much the distance of the nearest plan counts beside its probability, where plans are made.
    pub weight: f64,
}

/// The model after updates that lower
///
/// ```text
/// 1/N Σ_i loss_i(θ) + strength/2 ‖θ - centre‖²
/// ```
///
/// where the loss is that of what its modes are, and the second term is the pull of the prior. Progress is kept with `ctx`,
/// and goes on from there.
///
/// # Errors
/// If it is told to end.
///
/// # Panics
/// If there are no data, or they are of another form.
pub fn fit_modes(
    mut model: Multimodal,
    data: &Dataset,
    how: &ModeTraining<'_>,
    ctx: &Ctx,
) -> Result<Multimodal, OpError> {
    let mut live = Live::of(&model.nets);
    let form = &data.form;
    let width = form.input_len();
    let mut turns = Turns::new(data.len(), how.batch);
    let mut dropout = ctx.rng("dropout", &[]);
    let (xs, all) = (singles(&data.x), Shown::of(&model.modes, data));
    let (mut x, mut shown) = (Vec::new(), Shown::default());
    descend(&mut live, &[""], how.rule, ctx, |live, t| {
        x.clear();
        shown.clear();
        for &i in turns.turn(t, ctx) {
            x.extend(&xs[i * width..][..width]);
            shown.add(&all, i, form.target_len());
        }
        dropout.set_stream(t);
        dropout.set_word_pos(0);
        let said = outputs(live, form, &x, &mut Mode::Train(&mut dropout));
        let (steps, _) = plan_sizes("a model of modes", form).expect("data of plans");
        live.graph.mean(shown.losses(&live.graph, said, &model.modes, (steps, how.weight)))
    })?;
    live.put_into(&mut model.nets);
    Ok(model)
}

/// What came, as losses look at it.
#[derive(Default)]
pub(super) struct Shown {
    /// Plans; where anchors are moved, from the nearest on.
    plans: Vec<f32>,
    /// The anchor that is nearest, or the command that is given, where there are such.
    nearest: Vec<usize>,
}

impl Shown {
    pub(super) fn of(modes: &Modes, data: &Dataset) -> Self {
        let len = data.form.target_len();
        let nearest = modes.nearest(data);
        let mut plans = data.y.clone();
        if let Modes::Anchored(Anchored::Moved, anchors) = modes {
            for (plan, k) in plans.chunks_exact_mut(len).zip(&nearest) {
                plan.iter_mut().zip(&anchors[k * len..][..len]).for_each(|(y, a)| *y -= a);
            }
        }
        Self { plans: singles(&plans), nearest }
    }

    fn clear(&mut self) {
        self.plans.clear();
        self.nearest.clear();
    }

    /// Adds observation `i` of others.
    fn add(&mut self, all: &Self, i: usize, len: usize) {
        self.plans.extend(&all.plans[i * len..][..len]);
        self.nearest.extend(all.nearest.get(i));
    }

    /// The loss of each observation.
    pub(super) fn losses(
        &self,
        graph: &Graph<f32>,
        said: Var,
        modes: &Modes,
        (steps, weight): (usize, f64),
    ) -> Var {
        match modes {
            Modes::Made(_) => made_losses(graph, said, (&self.plans, steps), weight),
            Modes::Anchored(Anchored::Moved, _) => {
                moved_losses(graph, said, &self.plans, &self.nearest)
            }
            Modes::Anchored(Anchored::Chosen, _) => chosen_losses(graph, said, &self.nearest),
            Modes::Commanded(_) => commanded_losses(graph, said, &self.plans, &self.nearest),
        }
    }
}
