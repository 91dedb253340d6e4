//! A pendulum to be swung up and held.

use std::f64::consts::{PI, TAU};

use ivx_op::declare;

use super::{Act, Actions, Control, Luck, single};

declare! {
    /// A rod that turns about its end, to be swung up and held upright by a torque between -2 and 2 that is too weak
    /// to lift it at once, as `Pendulum-v1` of Gymnasium has it.
    ///
    /// Seen are the cosine and the sine of its angle from upright, and its speed. A step costs the squared angle, a
    /// tenth of the squared speed and a thousandth of the squared torque. No episode ends by itself; each is cut off
    /// after 200 steps.
    pub struct Pendulum = "pendulum" @ 1 {}
}

const GRAVITY: f64 = 10.0;
/// Seconds a step.
const DT: f64 = 0.05;
const STRONGEST: f64 = 2.0;
const FASTEST: f64 = 8.0;

impl Control for Pendulum {
    /// The angle, which counts turns, and its speed.
    type State = [f64; 2];
    type Seen = [f32; 3];

    const LIMIT: u64 = 200;

    fn does() -> Actions {
        Actions::Continuous { low: vec![-2.0], high: vec![2.0] }
    }

    fn start(luck: &mut Luck) -> [f64; 2] {
        [luck.between(-PI, PI), luck.between(-1.0, 1.0)]
    }

    /// The angle moves by the speed that follows; what is paid is of the state that was.
    ///
    /// ```text
    /// ω' = ω + (3/2 g sin θ + 3 τ) dt, within ±8
    /// θ' = θ + ω' dt
    /// ```
    ///
    /// for a rod of mass and length 1.
    fn step([angle, turn]: [f64; 2], act: Act<'_>) -> ([f64; 2], f64, bool) {
        let torque = f64::from(act.vector()[0]).clamp(-STRONGEST, STRONGEST);
        let off = (angle + PI).rem_euclid(TAU) - PI;
        let cost = off * off + 0.1 * turn * turn + 0.001 * torque * torque;

        let turn_change = 1.5 * GRAVITY * angle.sin() + 3.0 * torque;
        let turn = (turn + DT * turn_change).clamp(-FASTEST, FASTEST);
        ([angle + DT * turn, turn], -cost, false)
    }

    fn seen([angle, turn]: [f64; 2]) -> [f32; 3] {
        [angle.cos(), angle.sin(), turn].map(single)
    }

    fn known(seen: &[f32]) -> [f64; 2] {
        let x = |i: usize| f64::from(seen[i]);
        [x(1).atan2(x(0)), x(2)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(state: [f64; 2], torque: f32) -> ([f64; 2], f64) {
        let (next, pays, over) = Pendulum::step(state, Act::Vector(&[torque]));
        assert!(!over);
        (next, pays)
    }

    #[test]
    fn a_torque_turns_it_and_costs() {
        // 3 τ dt = 0.15 τ of speed; −(0.1 · 1 + 0.001 · 4).
        let (next, pays) = step([0.0, 1.0], 2.0);
        assert!((next[1] - 1.3).abs() < 1e-15 && (next[0] - 0.065).abs() < 1e-15);
        assert!((pays + 0.104).abs() < 1e-15);
        assert_eq!(step([0.0, 1.0], 7.0), step([0.0, 1.0], 2.0));
        assert_eq!(step([0.0, 1.0], -7.0), step([0.0, 1.0], -2.0));
        // Sideways gravity gives 15 · 0.05 of speed.
        assert!((step([PI / 2.0, 0.0], 0.0).0[1] - 0.75).abs() < 1e-15);
        assert_eq!(step([PI / 2.0, 7.9], 2.0).0[1], 8.0);
    }

    #[test]
    fn the_cost_is_that_of_the_angle_from_upright_after_any_turns() {
        for angle in [0.5, 0.5 + TAU, 0.5 - 2.0 * TAU] {
            assert!((step([angle, 0.0], 0.0).1 + 0.25).abs() < 1e-12);
        }
        assert!((step([PI + 0.5, 0.0], 0.0).1 + (PI - 0.5).powi(2)).abs() < 1e-12);
    }

    #[test]
    fn energy_is_roughly_kept_without_a_torque() {
        let energy = |[angle, turn]: [f64; 2]| 0.5 * turn * turn + 15.0 * angle.cos();
        let mut state = [2.5, 0.0];
        let had = energy(state);
        for _ in 0..200 {
            state = step(state, 0.0).0;
            assert!((energy(state) - had).abs() < 0.5, "{} is not {had}", energy(state));
        }
    }
}
