//! A pole to be balanced on a cart.

use ivx_op::declare;

use super::{Act, Actions, Control, Luck, single};

declare! {
    /// A pole to be balanced on a cart (Barto, Sutton and Anderson, 1983), without friction, as `CartPole-v1` of
    /// Gymnasium has it. The cart is pushed to the left or to the right.
    ///
    /// Seen are the cart's position and speed, the pole's angle from upright and its speed. Each step pays 1, that too
    /// after which the pole leans by more than 12° or the cart is farther than 2.4 from the middle: there it ends.
    /// An episode is cut off after 500 steps.
    pub struct CartPole = "cart_pole" @ 1 {}
}

const GRAVITY: f64 = 9.8;
const POLE_MASS: f64 = 0.1;
const TOTAL_MASS: f64 = 1.0 + POLE_MASS;
/// Half of the pole.
const LENGTH: f64 = 0.5;
const FORCE: f64 = 10.0;
/// Seconds a step.
const DT: f64 = 0.02;
const FARTHEST: f64 = 2.4;
const STEEPEST: f64 = 12.0 * std::f64::consts::PI / 180.0;

impl Control for CartPole {
    /// Position, its speed, angle, its speed.
    type State = [f64; 4];
    type Seen = [f32; 4];

    const LIMIT: u64 = 500;

    fn does() -> Actions {
        Actions::named(&["LEFT", "RIGHT"])
    }

    fn start(luck: &mut Luck) -> [f64; 4] {
        [(); 4].map(|()| luck.between(-0.05, 0.05))
    }

    /// One step of Euler's method: positions move by the speeds that were.
    ///
    /// ```text
    /// u = (F + m l θ'² sin θ) / M
    /// θ'' = (g sin θ − u cos θ) / (l (4/3 − m cos² θ / M))
    /// x'' = u − m l θ'' cos θ / M
    /// ```
    ///
    /// for a pole of mass `m` and length `2l`, a mass `M` of both and the force `F`.
    fn step([x, v, angle, turn]: [f64; 4], act: Act<'_>) -> ([f64; 4], f64, bool) {
        let force = if act.index() == 1 { FORCE } else { -FORCE };
        let (sin, cos) = angle.sin_cos();
        let u = (force + POLE_MASS * LENGTH * turn * turn * sin) / TOTAL_MASS;
        let inertia = LENGTH * (4.0 / 3.0 - POLE_MASS * cos * cos / TOTAL_MASS);
        let turn_change = (GRAVITY * sin - u * cos) / inertia;
        let v_change = u - POLE_MASS * LENGTH * turn_change * cos / TOTAL_MASS;

        let next = [x + DT * v, v + DT * v_change, angle + DT * turn, turn + DT * turn_change];
        (next, 1.0, next[0].abs() > FARTHEST || next[2].abs() > STEEPEST)
    }

    fn seen(state: [f64; 4]) -> [f32; 4] {
        state.map(single)
    }

    fn known(seen: &[f32]) -> [f64; 4] {
        [0, 1, 2, 3].map(|i| f64::from(seen[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_push_moves_the_cart_and_tips_the_pole() {
        // u = 10 / 1.1 = 100/11; θ'' = −(100/11) / (½ (4/3 − 1/11)) = −600/41; x'' = 100/11 + 600/(22 · 41) = 400/41.
        let (next, pays, over) = CartPole::step([0.0; 4], Act::Index(1));
        let expected = [0.0, 8.0 / 41.0, 0.0, -12.0 / 41.0];
        assert!(next.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{next:?}");
        assert_eq!((pays, over), (1.0, false));
        // Left is the mirror of right.
        let (left, ..) = CartPole::step([0.3, -0.2, 0.1, 0.4], Act::Index(0));
        let (right, ..) = CartPole::step([-0.3, 0.2, -0.1, -0.4], Act::Index(1));
        assert_eq!(left, right.map(|x| -x));
    }

    #[test]
    fn it_ends_beyond_the_bounds_and_pays_for_that_step_too() {
        let end = |state| {
            let (_, pays, over) = CartPole::step(state, Act::Index(1));
            assert_eq!(pays, 1.0);
            over
        };
        // Euler's method moves positions by the speed that was: 2.39 + 0.02 is too far, 2.37 + 0.02 is not.
        assert!(end([2.39, 1.0, 0.0, 0.0]) && !end([2.37, 1.0, 0.0, 0.0]));
        assert!(end([-2.39, -1.0, 0.0, 0.0]) && !end([-2.39, 1.0, 0.0, 0.0]));
        // 12° are 0.2094.
        assert!(end([0.0, 0.0, 0.2, 0.5]) && !end([0.0, 0.0, 0.2, 0.4]));
        assert!(end([0.0, 0.0, -0.2, -0.5]) && !end([0.0, 0.0, -0.2, 0.5]));
    }

    #[test]
    fn energy_changes_by_what_the_push_does() {
        // E = ½ M v² + m l v ω cos θ + ⅔ m l² ω² + m g l cos θ changes by F v a second.
        let energy = |[_, v, angle, turn]: [f64; 4]| {
            let ml = POLE_MASS * LENGTH;
            0.5 * TOTAL_MASS * v * v
                + ml * v * turn * angle.cos()
                + ml * LENGTH * turn * turn * 2.0 / 3.0
                + ml * GRAVITY * angle.cos()
        };
        // A slow state, so that what Euler's method adds, of the order of DT, is small; that part is the same when
        // the push is turned around but for its sign.
        let state = [0.1, 0.5, 0.15, -0.8];
        let change = |act| energy(CartPole::step(state, Act::Index(act)).0) - energy(state);
        let work = (change(1) - change(0)) / (2.0 * DT);
        assert!((work - FORCE * 0.5).abs() < 0.05, "{work}");
    }
}
