//! How cars follow plans (Assumption 3.1, Eqn. 3.12).

use ivx_data::form::told;
use ivx_data::{Columns, Field, Form, Kind, Misfit, Values};
use ivx_nn::Real as _;
use ivx_town::{DT, Follower, Pose};
use ivx_world::{Acts, Spec};

use crate::agent::windows::{chosen, form};

/// The field of how fast the car is.
const SPEED: &str = "velocity";
/// How many steps ahead the car steers to.
const AHEAD: usize = 5;

/// What somebody sees who drives by plans.
#[derive(Clone, Debug)]
pub(crate) struct Eyes {
    /// The fields that models see, in their order.
    order: Vec<usize>,
    speed: usize,
    width: usize,
}

impl Eyes {
    /// Those of a world in which plans can be driven.
    ///
    /// # Errors
    /// Why they cannot.
    pub(crate) fn of(spec: &Spec, sees: &[String]) -> Result<Self, Misfit> {
        let order = chosen(&spec.sees, sees)?;
        if spec.does.field().width() != 2 || spec.does.n_discrete().is_ok() {
            let message =
                "plans are followed by a pedal and a steering wheel, which this world has not";
            return Err(Misfit::new(message.to_owned(), "use a `town` or `carnovel`"));
        }
        let is_speed = |f: &Field| f.name == SPEED && f.width() > 0 && f.kind == Kind::F32;
        let speed = spec.sees.iter().position(is_speed).ok_or_else(|| {
            let message = "the world does not show how fast the car is".to_owned();
            Misfit::new(message, "use a world that shows `velocity`, forward first")
        })?;
        let width = order.iter().map(|i| spec.sees[*i].spread()).sum();
        Ok(Self { order, speed, width })
    }

    /// Whether models of observations of a form, if that is known, make plans of what is seen here.
    ///
    /// # Errors
    /// Why not.
    pub(crate) fn fit(&self, spec: &Spec, of: &Form, every: usize) -> Result<(), Misfit> {
        // Of a model that is still to be computed the shapes of data are known, if any.
        let [steps, dims] = of.target[..] else { return Ok(()) };
        let own = form(&spec.sees, &self.order, [steps, dims]);
        if (&of.input, of.beside) != (&own.input, own.beside) {
            let message = format!("the models see {}, and in this world {}", told(of), told(&own));
            return Err(Misfit::new(
                message,
                "let `sees` be as in the `windows` they learned from",
            ));
        }
        if steps * every < AHEAD {
            let message = format!("plans end before the {AHEAD} steps that the car looks ahead");
            return Err(Misfit::new(message, "let plans be longer"));
        }
        Ok(())
    }

    /// What models see in some lanes, one after the other.
    pub(crate) fn look(&self, seen: &Columns, lanes: &[usize], into: &mut Vec<f32>) {
        into.resize(lanes.len() * self.width, 0.0);
        for (lane, row) in lanes.iter().zip(into.chunks_exact_mut(self.width)) {
            let mut rest = row;
            for &field in &self.order {
                let (own, others) = rest.split_at_mut(seen.fields()[field].spread());
                seen.spread(field, *lane, own);
                rest = others;
            }
        }
    }
}

/// Cars side by side that follow plans.
#[derive(Debug)]
pub(crate) struct Wheels {
    /// How many steps of the world are between the places of a plan.
    every: usize,
    followers: Vec<Follower>,
    /// The lanes that go on.
    awake: Vec<usize>,
    age: usize,
}

impl Wheels {
    pub(crate) fn new(every: usize) -> Self {
        Self { every, followers: Vec::new(), awake: Vec::new(), age: 0 }
    }

    pub(crate) fn begin(&mut self) {
        self.age = 0;
    }

    /// The lanes that go on, of so many.
    pub(crate) fn awake(&mut self, lanes: usize) -> &[usize] {
        if self.age == 0 {
            self.followers = vec![Follower::default(); lanes];
            self.awake = (0..lanes).collect();
        }
        &self.awake
    }

    /// Lets lanes rest whose drives are over.
    pub(crate) fn rest(&mut self, lanes: &[usize]) {
        self.awake.retain(|lane| !lanes.contains(lane));
    }

    /// Steers each lane that goes on to where it should be a quarter of a second ahead, at the mean speed of its plan to the
    /// first place.
    ///
    /// - `plans`: `[lanes, steps, 2]`, ahead and to the right.
    pub(crate) fn follow(&mut self, eyes: &Eyes, seen: &Columns, plans: &[f64], acts: &mut Acts) {
        let Values::F32(speeds) = seen.values(eyes.speed) else {
            unreachable!("speeds are numbers")
        };
        let width = speeds.len() / seen.len();
        let plans = plans.chunks_exact(plans.len() / self.awake.len().max(1));
        for (lane, plan) in self.awake.iter().zip(plans) {
            #[expect(clippy::cast_precision_loss, reason = "steps are few")]
            let target = plan[0].hypot(plan[1]) / (self.every as f64 * DT);
            let speed = f64::from(speeds[lane * width]);
            let follower = &mut self.followers[*lane];
            let does =
                follower.follow(&Pose::default(), speed, target, along(plan, AHEAD, self.every));
            let act = &mut acts.vectors[2 * lane..][..2];
            act.copy_from_slice(&[does.throttle - does.brake, does.steer].map(f32::of));
        }
        self.age += 1;
    }
}

/// Where a plan is after some steps of the world: on a cubic curve through its places (Catmull and Rom, 1974), which begins
/// where the car is and as it heads, and in the end at the last of them.
fn along(plan: &[f64], step: usize, every: usize) -> [f64; 2] {
    let n = plan.len() / 2;
    let place = |i: usize| if i == 0 { [0.0; 2] } else { [plan[2 * i - 2], plan[2 * i - 1]] };
    let (before, rest) = (step / every, step % every);
    if before >= n {
        return place(n);
    }
    let between = |i: usize, j: usize| [0, 1].map(|d| place(j)[d] - place(i)[d]);
    let slope = |i: usize| match i {
        0 => [between(0, 1)[0].hypot(between(0, 1)[1]), 0.0],
        // That of the parabola through the last three.
        i if i == n => [0, 1].map(|d| {
            let before = if n < 2 { between(n - 1, n).map(|x| 2.0 * x) } else { between(n - 2, n) };
            2.0 * between(n - 1, n)[d] - 0.5 * before[d]
        }),
        i => between(i - 1, i + 1).map(|x| 0.5 * x),
    };
    #[expect(clippy::cast_precision_loss, reason = "steps are few")]
    let share = rest as f64 / every as f64;
    let (square, cube) = (share.powi(2), share.powi(3));
    let weights = [
        2.0 * cube - 3.0 * square + 1.0,
        cube - 2.0 * square + share,
        3.0 * square - 2.0 * cube,
        cube - square,
    ];
    let parts = [place(before), slope(before), place(before + 1), slope(before + 1)];
    [0, 1].map(|d| weights.iter().zip(parts).map(|(weight, part)| weight * part[d]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_is_followed_on_a_curve_through_its_places() {
        let straight = [4.0, 0.0, 8.0, 0.0];
        for (step, x) in [(0, 0.0), (5, 1.0), (20, 4.0), (30, 6.0), (40, 8.0), (55, 8.0)] {
            let [ahead, aside] = along(&straight, step, 20);
            assert!((ahead - x).abs() < 1e-12 && aside == 0.0, "{step}: {ahead}");
        }
        // A quarter of a circle of 6 m in two places: at once it bends little, and it is nowhere far off, and where the car steers to hardly.
        let on = |turn: f64| [6.0 * turn.sin(), 6.0 * (1.0 - turn.cos())];
        let quarter = std::f64::consts::FRAC_PI_2;
        let bend = [on(0.5 * quarter), on(quarter)].concat();
        assert_eq!(along(&bend, 20, 20), on(0.5 * quarter));
        for step in 0..=40_u32 {
            let [ahead, aside] = along(&bend, step as usize, 20);
            let off = (ahead.hypot(aside - 6.0) - 6.0).abs();
            assert!(off < if step <= 5 { 0.05 } else { 0.15 }, "{step}: {off}");
        }
        let lines = [on(0.5 * quarter)[0] / 2.0, on(0.5 * quarter)[1] / 2.0];
        assert!((lines[0].hypot(lines[1] - 6.0) - 6.0).abs() > 0.4, "straight lines cut it");
    }
}
