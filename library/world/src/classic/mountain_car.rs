//! A car in a valley, pushed one way or the other.

use ivx_op::declare;

use super::{Act, Actions, Control, Luck, single};

declare! {
    /// A car that is too weak to drive out of a valley and must swing itself up (Moore, 1990), as `MountainCar-v0` of
    /// Gymnasium has it. It pushes to the left, to the right, or not at all.
    ///
    /// Seen are its position and its speed. Each step pays -1 until the car is at 0.5, where it ends; an episode is cut
    /// off after 200 steps.
    pub struct MountainCar = "mountain_car" @ 1 {}
}

const FORCE: f64 = 0.001;
const GRAVITY: f64 = 0.0025;
const FASTEST: f64 = 0.07;
const LEFT_END: f64 = -1.2;
const RIGHT_END: f64 = 0.6;
const GOAL: f64 = 0.5;

impl Control for MountainCar {
    /// Position and speed.
    type State = [f64; 2];
    type Seen = [f32; 2];

    const LIMIT: u64 = 200;

    fn does() -> Actions {
        Actions::named(&["LEFT", "NONE", "RIGHT"])
    }

    fn start(luck: &mut Luck) -> [f64; 2] {
        in_valley(luck)
    }

    fn step(state: [f64; 2], act: Act<'_>) -> ([f64; 2], f64, bool) {
        let push = [-FORCE, 0.0, FORCE][act.index()];
        let next = roll(state, push);
        (next, -1.0, is_at(GOAL, next))
    }

    fn seen(state: [f64; 2]) -> [f32; 2] {
        state.map(single)
    }

    fn known(seen: &[f32]) -> [f64; 2] {
        [0, 1].map(|i| f64::from(seen[i]))
    }
}

/// Somewhere at the bottom, at rest.
pub(super) fn in_valley(luck: &mut Luck) -> [f64; 2] {
    [luck.between(-0.6, -0.4), 0.0]
}

/// A step in the valley, whose height is as `sin 3x`. At the left end is a wall.
///
/// ```text
/// v' = v + push − 0.0025 cos 3x, within ±0.07
/// x' = x + v', within [−1.2, 0.6]
/// ```
pub(super) fn roll([x, v]: [f64; 2], push: f64) -> [f64; 2] {
    let v = (v + push - GRAVITY * (3.0 * x).cos()).clamp(-FASTEST, FASTEST);
    let x = (x + v).clamp(LEFT_END, RIGHT_END);
    [x, if x == LEFT_END { v.max(0.0) } else { v }]
}

/// Whether the car is at a place or beyond it, and not on its way back.
pub(super) fn is_at(place: f64, [x, v]: [f64; 2]) -> bool {
    x >= place && v >= 0.0
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn the_valley_pulls_to_its_bottom() {
        let step = |state, act| MountainCar::step(state, Act::Index(act)).0;
        let close = |a: [f64; 2], b: [f64; 2]| (0..2).all(|i| (a[i] - b[i]).abs() < 1e-15);
        // At the bottom, −π/6, only pushes move it; at 0 gravity alone slows it down by 0.0025.
        let bottom = -PI / 6.0;
        assert!(close(step([bottom, 0.0], 1), [bottom, 0.0]));
        assert!(close(step([bottom, 0.0], 0), [bottom - 0.001, -0.001]));
        assert!(close(step([bottom, 0.0], 2), [bottom + 0.001, 0.001]));
        assert!(close(step([0.0, 0.05], 1), [0.0475, 0.0475]));
    }

    #[test]
    fn speeds_and_places_have_bounds() {
        let step = |state, act| MountainCar::step(state, Act::Index(act)).0;
        // cos 3x is −1 at −π/3.
        assert_eq!(step([-PI / 3.0, 0.07], 2), [-PI / 3.0 + 0.07, 0.07]);
        assert_eq!(step([0.0, -0.07], 0), [-0.07, -0.07]);
        // The wall on the left stops it; the end on the right only holds it.
        assert_eq!(step([-1.19, -0.05], 0), [-1.2, 0.0]);
        assert_eq!(step([0.59, 0.07], 2), [0.6, 0.07]);
    }

    #[test]
    fn it_ends_at_the_goal() {
        let end = |state| MountainCar::step(state, Act::Index(2));
        assert_eq!(end([0.49, 0.03]).1, -1.0);
        assert!(end([0.49, 0.03]).2);
        assert!(!end([0.42, 0.07]).2);
        assert!(!end([0.59, -0.03]).2);
    }
}
