//! A car in a valley that pushes as much as it likes.

use ivx_op::declare;

use super::mountain_car::{in_valley, is_at, roll};
use super::{Act, Actions, Control, Luck, single};

declare! {
    /// A car that must swing itself out of a valley (Moore, 1990) and pushes with a force between -1 and 1, as
    /// `MountainCarContinuous-v0` of Gymnasium has it.
    ///
    /// Seen are its position and its speed. A step costs a tenth of the squared force; to be at 0.45 pays 100, and
    /// there it ends. An episode is cut off after 999 steps.
    pub struct MountainCarContinuous = "mountain_car_continuous" @ 1 {}
}

const POWER: f64 = 0.0015;
const GOAL: f64 = 0.45;

impl Control for MountainCarContinuous {
    /// Position and speed.
    type State = [f64; 2];
    type Seen = [f32; 2];

    const LIMIT: u64 = 999;

    fn does() -> Actions {
        Actions::Continuous { low: vec![-1.0], high: vec![1.0] }
    }

    fn start(luck: &mut Luck) -> [f64; 2] {
        in_valley(luck)
    }

    /// A force beyond the bounds pushes no more than one within, but costs what it would.
    fn step(state: [f64; 2], act: Act<'_>) -> ([f64; 2], f64, bool) {
        let force = f64::from(act.vector()[0]);
        let next = roll(state, POWER * force.clamp(-1.0, 1.0));
        let over = is_at(GOAL, next);
        (next, if over { 100.0 } else { 0.0 } - 0.1 * force * force, over)
    }

    fn seen(state: [f64; 2]) -> [f32; 2] {
        state.map(single)
    }

    fn known(seen: &[f32]) -> [f64; 2] {
        [0, 1].map(|i| f64::from(seen[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_pushes_and_costs() {
        let bottom = -std::f64::consts::PI / 6.0;
        let step = |state, force| MountainCarContinuous::step(state, Act::Vector(&[force]));
        let speed = |force| step([bottom, 0.0], force).0[1];
        assert!((speed(0.5) - 0.00075).abs() < 1e-15 && (speed(-3.0) + 0.0015).abs() < 1e-15);
        assert_eq!(step([bottom, 0.0], 0.5).1, -0.025);
        // At 0.44 gravity takes 0.0025 cos 1.32 = 0.0006 of the speed.
        let (next, pays, over) = step([0.44, 0.02], -0.5);
        assert!(next[0] > 0.45 && over);
        assert_eq!(pays, 99.975);
        assert!(!step([0.5, -0.01], 0.0).2 && !step([0.43, 0.02], 0.0).2);
    }
}
