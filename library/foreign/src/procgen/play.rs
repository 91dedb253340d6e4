//! Levels of Procgen, one after the other.

use ivx_world::{Act, End, Luck, Row, World};

use super::Game;
use super::libenv::{PICTURE, Ready, Running};

/// A game that is played, each episode a level that begins afresh.
pub(super) struct Playing {
    library: Ready,
    game: Game,
    running: Option<Running>,
    /// How many steps the episode has had.
    length: u64,
    /// What was seen last, channel by channel.
    seen: Vec<u8>,
}

impl Playing {
    pub(super) fn new(library: Ready, game: Game) -> Self {
        Self { library, game, running: None, length: 0, seen: vec![0; PICTURE] }
    }
}

impl World for Playing {
    fn reset(&mut self, luck: &mut Luck, row: &mut Row<'_>) {
        let [first, n] = self.game.levels;
        // One that was played before leaves nothing behind.
        let running = Running::begin(self.library, &self.game, first + luck.below(n));
        by_channel(running.picture(), &mut self.seen);
        self.running = Some(running);
        self.length = 0;
        row.bytes(0).copy_from_slice(&self.seen);
        row.told().fill(0.0);
    }

    fn step(&mut self, act: Act<'_>, _: &mut Luck, row: &mut Row<'_>) -> (f64, End) {
        let running = self.running.as_mut().expect("an episode has begun");
        running.act(act.index());
        self.length += 1;
        let end = match running.is_over() {
            false => End::No,
            // The library ends an episode at the limit as it ends any other.
            true if self.length == self.game.limit() && !running.is_complete() => End::Limit,
            true => End::Terminal,
        };
        if end == End::No {
            by_channel(running.picture(), &mut self.seen);
        }
        row.bytes(0).copy_from_slice(&self.seen);
        let reward = f64::from(running.reward());
        if !self.game.has_fruits() {
            return (reward, end);
        }
        let met = met(running.reward(), running.is_complete());
        row.told().copy_from_slice(&met);
        let pays = |pays: [f64; 3]| pays.iter().zip(met).map(|(pays, n)| pays * f64::from(n)).sum();
        (self.game.pays.map_or(reward, pays), end)
    }
}

/// Rows of pixels as rows of each channel.
fn by_channel(picture: &[u8; PICTURE], seen: &mut [u8]) {
    let (pixels, _) = picture.as_chunks::<3>();
    for (i, channel) in seen.chunks_exact_mut(pixels.len()).enumerate() {
        channel.iter_mut().zip(pixels).for_each(|(byte, pixel)| *byte = pixel[i]);
    }
}

/// How many fruits, other objects and presents a step of `FruitBot` has met, of which it pays 1, -4 and 10 for each:
/// the fewest that pay so much. Presents lie side by side in the last row, and who comes there may meet two.
fn met(reward: f32, is_complete: bool) -> [f32; 3] {
    let presents: &[f32] = if is_complete { &[1.0, 2.0, 3.0] } else { &[0.0] };
    let all = presents.iter().map(|presents| {
        let rest = reward - 10.0 * presents;
        let objects = (-rest / 4.0).ceil().max(0.0);
        [rest + 4.0 * objects, objects, *presents]
    });
    all.min_by(|a, b| a.iter().sum::<f32>().total_cmp(&b.iter().sum())).expect("there is one")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rewards_tell_what_was_met() {
        let check = |reward, is_complete, expected: [f32; 3]| {
            assert_eq!(met(reward, is_complete), expected, "{reward}");
        };
        check(0.0, false, [0.0, 0.0, 0.0]);
        check(2.0, false, [2.0, 0.0, 0.0]);
        check(-4.0, false, [0.0, 1.0, 0.0]);
        check(-3.0, false, [1.0, 1.0, 0.0]);
        check(-8.0, false, [0.0, 2.0, 0.0]);
        check(10.0, true, [0.0, 0.0, 1.0]);
        check(20.0, true, [0.0, 0.0, 2.0]);
        check(11.0, true, [1.0, 0.0, 1.0]);
        check(16.0, true, [0.0, 1.0, 2.0]);
        check(7.0, true, [1.0, 1.0, 1.0]);
    }

    #[test]
    fn channels_come_first() {
        let mut picture = [0; PICTURE];
        picture[..6].copy_from_slice(&[1, 2, 3, 4, 5, 6]);
        picture[PICTURE - 1] = 9;
        let mut seen = vec![7; PICTURE];
        by_channel(&picture, &mut seen);
        assert_eq!(
            (&seen[..3], &seen[4096..4098], &seen[8192..8194]),
            (&[1, 4, 0][..], &[2, 5][..], &[3, 6][..])
        );
        assert_eq!(seen[PICTURE - 1], 9);
    }
}
