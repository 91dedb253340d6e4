//! Two links to be swung up.

use std::f64::consts::{PI, TAU};

use ivx_op::declare;

use super::{Act, Actions, Control, Luck, single};

declare! {
    /// Two links that hang from a hinge and are swung up by a torque between them (Sutton, 1996), as `Acrobot-v1` of
    /// Gymnasium has it, by the equations of Sutton and Barto's book (1998).
    ///
    /// Seen are the cosine and the sine of the first link's angle from hanging and of the second's from the first, and
    /// both speeds. Each step pays -1 until the tip is more than one link above the hinge, where it ends with 0; an
    /// episode is cut off after 500 steps.
    pub struct Acrobot = "acrobot" @ 1 {}
}

const GRAVITY: f64 = 9.8;
/// Seconds a step.
const DT: f64 = 0.2;
const FASTEST: [f64; 2] = [4.0 * PI, 9.0 * PI];

impl Control for Acrobot {
    /// Both angles and their speeds.
    type State = [f64; 4];
    type Seen = [f32; 6];

    const LIMIT: u64 = 500;

    fn does() -> Actions {
        Actions::named(&["CLOCKWISE", "NONE", "COUNTERCLOCKWISE"])
    }

    fn start(luck: &mut Luck) -> [f64; 4] {
        [(); 4].map(|()| luck.between(-0.1, 0.1))
    }

    /// One step of the fourth-order method of Runge and Kutta.
    fn step(state: [f64; 4], act: Act<'_>) -> ([f64; 4], f64, bool) {
        let torque = [-1.0, 0.0, 1.0][act.index()];
        let [first, second, turn1, turn2] = runge_kutta(state, |state| motion(state, torque));
        let next = [
            wrapped(first),
            wrapped(second),
            turn1.clamp(-FASTEST[0], FASTEST[0]),
            turn2.clamp(-FASTEST[1], FASTEST[1]),
        ];
        let over = -next[0].cos() - (next[0] + next[1]).cos() > 1.0;
        (next, if over { 0.0 } else { -1.0 }, over)
    }

    fn seen([first, second, turn1, turn2]: [f64; 4]) -> [f32; 6] {
        [first.cos(), first.sin(), second.cos(), second.sin(), turn1, turn2].map(single)
    }

    fn known(seen: &[f32]) -> [f64; 4] {
        let x = |i: usize| f64::from(seen[i]);
        [x(1).atan2(x(0)), x(3).atan2(x(2)), x(4), x(5)]
    }
}

/// How the state changes a second.
///
/// ```text
/// θ₂'' = (τ + φ₁ d₂/d₁ − φ₂ − ½ θ₁'² sin θ₂) / (5/4 − d₂²/d₁)
/// θ₁'' = −(d₂ θ₂'' + φ₁) / d₁
///
/// d₁ = 7/2 + cos θ₂        φ₁ = −(½ θ₂'² + θ₁' θ₂') sin θ₂ + 3/2 g sin θ₁ + φ₂
/// d₂ = 5/4 + ½ cos θ₂      φ₂ = ½ g sin(θ₁ + θ₂)
/// ```
///
/// These are for links of mass, length and moment of inertia 1 with their centres in the middle.
fn motion([first, second, turn1, turn2]: [f64; 4], torque: f64) -> [f64; 4] {
    let (sin, cos) = second.sin_cos();
    let d1 = 3.5 + cos;
    let d2 = 1.25 + 0.5 * cos;
    let phi2 = 0.5 * GRAVITY * (first + second).sin();
    let phi1 = -(0.5 * turn2 * turn2 + turn1 * turn2) * sin + 1.5 * GRAVITY * first.sin() + phi2;
    let change2 =
        (torque + phi1 * d2 / d1 - phi2 - 0.5 * turn1 * turn1 * sin) / (1.25 - d2 * d2 / d1);
    let change1 = -(d2 * change2 + phi1) / d1;
    [turn1, turn2, change1, change2]
}

fn runge_kutta(state: [f64; 4], change: impl Fn([f64; 4]) -> [f64; 4]) -> [f64; 4] {
    let moved = |by: f64, along: [f64; 4]| -> [f64; 4] {
        std::array::from_fn(|i| state[i] + by * along[i])
    };
    let k1 = change(state);
    let k2 = change(moved(DT / 2.0, k1));
    let k3 = change(moved(DT / 2.0, k2));
    let k4 = change(moved(DT, k3));
    moved(DT / 6.0, std::array::from_fn(|i| k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
}

/// The same angle between −π and π, where both are.
fn wrapped(mut angle: f64) -> f64 {
    while angle > PI {
        angle -= TAU;
    }
    while angle < -PI {
        angle += TAU;
    }
    angle
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_torque_bends_links_that_hang() {
        // d₁ = 9/2, d₂ = 7/4, no φ: θ₂'' = 1 / (5/4 − 49/72) = 72/41, θ₁'' = −(7/4)(72/41)/(9/2) = −28/41.
        assert_eq!(motion([0.0; 4], 0.0), [0.0; 4]);
        let [.., change1, change2] = motion([0.0; 4], 1.0);
        assert!((change2 - 72.0 / 41.0).abs() < 1e-14 && (change1 + 28.0 / 41.0).abs() < 1e-14);
        // Stretched out sideways: φ₂ = ½ g, φ₁ = 2 g, so θ₂'' = g (7/9 − ½) (72/41) = 20/41 g, as gravity says.
        let [.., change1, change2] = motion([PI / 2.0, 0.0, 0.0, 0.0], 0.0);
        assert!((change2 - GRAVITY * 20.0 / 41.0).abs() < 1e-14);
        assert!((change1 + GRAVITY * (35.0 / 41.0 + 2.0) / 4.5).abs() < 1e-14);
    }

    #[test]
    fn energy_is_kept_without_a_torque() {
        let energy = |[first, second, turn1, turn2]: [f64; 4]| {
            0.5 * (3.5 + second.cos()) * turn1 * turn1
                + (1.25 + 0.5 * second.cos()) * turn1 * turn2
                + 0.625 * turn2 * turn2
                - GRAVITY * (1.5 * first.cos() + 0.5 * (first + second).cos())
        };
        let mut state = [0.6, -0.9, 0.4, 1.1];
        let had = energy(state);
        for _ in 0..10 {
            state = Acrobot::step(state, Act::Index(1)).0;
            assert!((energy(state) - had).abs() < 0.02, "{} is not {had}", energy(state));
        }
    }

    #[test]
    fn it_ends_when_the_tip_is_high_enough() {
        // Upright at rest the tip is two links up.
        assert_eq!(Acrobot::step([PI, 0.0, 0.0, 0.0], Act::Index(1)).1, 0.0);
        assert!(Acrobot::step([PI, 0.0, 0.0, 0.0], Act::Index(1)).2);
        // With the first upright and the second sideways it is one link up, and falls.
        let (_, pays, over) = Acrobot::step([PI, PI / 2.0, 0.0, 0.0], Act::Index(1));
        assert_eq!((pays, over), (-1.0, false));
    }

    #[test]
    fn angles_wrap_and_speeds_have_bounds() {
        assert_eq!(wrapped(PI + 0.5), PI + 0.5 - TAU);
        assert_eq!(wrapped(-PI - 0.5), TAU - PI - 0.5);
        assert_eq!([wrapped(PI), wrapped(-PI)], [PI, -PI]);
        let ([.., turn1, turn2], ..) = Acrobot::step([0.0, 0.0, 30.0, 60.0], Act::Index(1));
        assert_eq!([turn1.abs(), turn2.abs()], FASTEST);
    }
}
