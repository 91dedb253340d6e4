//! Tests of the replay.

use super::*;
use ivx_nn::Params;
use ivx_world::{Actions, Acts};
use rand::SeedableRng as _;

fn sees() -> Vec<Field> {
    vec![
        Field::new("bits", &[11], Kind::Bit),
        Field::new("speed", &[], Kind::F32),
        Field::new("cell", &[], Kind::Index(3)),
    ]
}

/// What is seen at time `t` of an episode.
fn seen(t: u8) -> Columns {
    let mut seen = Columns::zeros(sees(), 1);
    if let (Values::U8(bits), _) = seen.values_mut(0) {
        bits.iter_mut().enumerate().for_each(|(i, bit)| *bit = u8::from((t >> (i % 8)) & 1 == 1));
    }
    if let (Values::F32(speed), _) = seen.values_mut(1) {
        speed[0] = f32::from(t);
    }
    if let (Values::Index(cell), _) = seen.values_mut(2) {
        cell[0] = u32::from(t % 3);
    }
    seen
}

/// The step at time `t`, which pays `2^t`.
fn step(t: u8, end: End) -> Step {
    let mut acts = Acts::of(&Actions::named(&["a", "b", "c", "d"]), 1);
    acts.places[0] = usize::from(t % 4);
    Step {
        before: seen(t),
        acts,
        rewards: vec![f64::from(t).exp2()],
        after: seen(t + 1),
        ends: vec![end],
        told: Vec::new(),
    }
}

fn looked(replay: &Replay, rows: &[(usize, usize)]) -> Vec<f32> {
    let graph = Graph::new(Params::default());
    graph.value(replay.look(&graph, rows))
}

/// Of each step that can be drawn: when it was, what is paid, what the rest weighs, and when that is.
fn drawn(replay: &Replay) -> Vec<(u8, f32, f32, Option<u8>)> {
    let (mut rng, mut batch) = (ChaCha8Rng::seed_from_u64(1), Batch::default());
    replay.draw(2000, &mut rng, &mut batch);
    let when = |row: (usize, usize)| {
        let time = looked(replay, &[row])[11];
        (0..=u8::MAX).find(|t| f32::from(*t) == time).expect("a time")
    };
    let mut found = Vec::new();
    let (mut along, mut at) = (Vec::new(), 0);
    replay.along(&batch, &mut along);
    for i in 0..batch.rows.len() {
        let t = when(batch.rows[i]);
        let after = &along[at..at + batch.spans[i] - 1];
        assert!(replay.acts(after).eq((t + 1..).map(|t| f32::from(t % 4)).take(after.len())));
        assert_eq!(batch.paid[i], f32::from(t).exp2());
        let paid = (t..).take(batch.spans[i]);
        let paid = paid.map(|u| f32::from(u).exp2() * 0.5_f32.powi((u - t).into()));
        assert_eq!(batch.rewards[i], paid.sum::<f32>());
        at += after.len();
        assert_eq!(batch.acts[i], f32::from(t % 4));
        let next = (batch.discounts[i] > 0.0).then(|| when(batch.next[i]));
        found.push((t, batch.rewards[i], batch.discounts[i], next));
    }
    found.sort_by_key(|(t, ..)| *t);
    found.dedup();
    found
}

#[test]
fn what_was_seen_comes_back_to_the_bit() {
    let mut replay = Replay::new(&sees(), (10, 1), (1, 0.5));
    (0..3).for_each(|t| replay.push(&step(t + 180, End::No)));
    for place in 0..3 {
        let mut expected = vec![0.0; 15];
        seen(180 + u8::try_from(place).unwrap()).spread_all(&mut expected);
        assert_eq!(looked(&replay, &[(0, place)]), expected);
    }
    // Two bytes of bits and two numbers; action, reward and end.
    assert_eq!((replay.sight, Replay::bytes(&sees(), 100)), (10, 1600));
}

#[test]
fn a_target_is_known_once_what_it_looks_at_is() {
    let mut replay = Replay::new(&sees(), (10, 1), (2, 0.5));
    let known = (0..4).map(|t| {
        replay.push(&step(t, End::No));
        replay.has_targets()
    });
    assert!(known.eq([false, false, true, true]));
    let mut replay = Replay::new(&sees(), (10, 1), (2, 0.5));
    replay.push(&step(0, End::Terminal));
    assert!(replay.has_targets());
}

#[test]
fn targets_stop_at_ends_and_reach_beyond_cuts() {
    let mut replay = Replay::new(&sees(), (100, 1), (2, 0.5));
    for (t, end) in [(0, End::No), (1, End::No), (2, End::Terminal)] {
        replay.push(&step(t, end));
    }
    for (t, end) in [(10, End::No), (11, End::Limit), (20, End::No), (21, End::No)] {
        replay.push(&step(t, end));
    }
    let power = |t: u8| f32::from(t).exp2();
    assert_eq!(
        drawn(&replay),
        [
            (0, 1.0 + 0.5 * 2.0, 0.25, Some(2)),
            (1, 2.0 + 0.5 * 4.0, 0.0, None),
            (2, 4.0, 0.0, None),
            (10, power(10) + 0.5 * power(11), 0.25, Some(12)),
            (11, power(11), 0.5, Some(12)),
        ]
    );
    // What follows 20 over two steps is known once there is a third.
    replay.push(&step(22, End::No));
    let last = *drawn(&replay).last().unwrap();
    assert_eq!(last, (20, power(20) + 0.5 * power(21), 0.25, Some(22)));
}

/// As those of Breakout: 400 bits, an action, a reward and an end.
#[test]
fn a_replay_takes_little_more_than_its_bits() {
    let sees = vec![Field::new("grid", &[4, 10, 10], Kind::Bit)];
    let mut replay = Replay::new(&sees, (50_000, 1), (1, 0.9));
    let mut step = step(1, End::No);
    step.before = Columns::zeros(sees.clone(), 1);
    for n in 1..=60_000 {
        replay.push(&step);
        let Lane { seen, acts, rewards, ends, .. } = &replay.lanes[0];
        let held = seen.capacity() + acts.capacity() + rewards.capacity() + ends.capacity();
        let rows = n.clamp(10_000, 50_000);
        assert!(held <= rows * 50 * 13 / 10, "{held} bytes after {n} steps");
    }
    let Lane { seen, acts, rewards, ends, .. } = &replay.lanes[0];
    let held = seen.capacity() + acts.capacity() + rewards.capacity() + ends.capacity();
    assert_eq!((held, Replay::bytes(&sees, 50_000)), (50_000 * 56, 50_000 * 56));
}

#[test]
fn the_oldest_steps_are_forgotten() {
    let mut replay = Replay::new(&sees(), (4, 1), (1, 1.0));
    (0..11).for_each(|t| replay.push(&step(t, End::No)));
    let times: Vec<u8> = drawn(&replay).into_iter().map(|(t, ..)| t).collect();
    assert_eq!((times, replay.len()), (vec![7, 8, 9], 4));
    let bytes = State::keep(|state| replay.state(state));
    let mut other = Replay::new(&sees(), (4, 1), (1, 1.0));
    assert!(State::restore(&bytes, |state| other.state(state)));
    assert_eq!(drawn(&other), drawn(&replay));
}

#[test]
fn demonstrations_pay_the_same_at_each_step() {
    // States 1, 0, 1, 2 by actions 0, 1, 1: one ends, and one is cut off.
    let mut paths = super::super::strolls(2).trajectories();
    paths.episodes[1].1 = End::Limit;
    let replay = Replay::of(&paths, 1.0, (2, 0.5));
    let (mut rng, mut batch) = (ChaCha8Rng::seed_from_u64(1), Batch::default());
    replay.draw(500, &mut rng, &mut batch);
    let mut found: Vec<_> = (0..500)
        .map(|i| {
            let place = |row: (usize, usize)| {
                looked(&replay, &[row]).iter().position(|x| *x == 1.0).expect("a state")
            };
            let next = (batch.discounts[i] > 0.0).then(|| place(batch.next[i]));
            let step = (batch.acts[i], batch.rewards[i], batch.discounts[i], next);
            (batch.rows[i].1, place(batch.rows[i]), step)
        })
        .collect();
    found.sort_by_key(|(row, ..)| *row);
    found.dedup();
    let expected = [
        (0, 1, (0.0, 1.5, 0.25, Some(1))),
        (1, 0, (1.0, 1.5, 0.0, None)),
        (2, 1, (1.0, 1.0, 0.0, None)),
        (3, 1, (0.0, 1.5, 0.25, Some(1))),
        (4, 0, (1.0, 1.5, 0.25, Some(2))),
        (5, 1, (1.0, 1.0, 0.5, Some(2))),
    ];
    assert_eq!(found, expected);
}
