//! Seaquest (Young & Tian, 2019).
//!
//! A submarine of two cells shoots fish and enemy submarines, for a reward of 1 each, and picks up divers, of whom it
//! holds six. Enemy submarines shoot back. Oxygen is used up under water and refilled at the surface, where one diver
//! is set down; with six divers all are, and what is left of the oxygen is paid: 1 for each cell of its gauge. Each
//! time there come more enemies from then on, and faster ones.
//!
//! The game is over when an enemy or a bullet hits the front of the submarine, when there is no oxygen left, or when
//! it comes up without a diver. Trails tell where things were before.

use std::mem;

use super::board::{Board, LAST, on_board};
use super::{Game, Move};
use crate::luck::Luck;

const OXYGEN: i32 = 200;
const CELLS: i32 = 10;
const CREW: i32 = 6;
const SHOT_PAUSE: u32 = 5;
const ENEMY_SHOT_PAUSE: u32 = 10;
const ENEMY_MOVE_PAUSE: u32 = 5;
const LEAST_MOVE_PAUSE: u32 = 2;
const DIVER_MOVE_PAUSE: u32 = 5;
const ENEMY_PAUSE: u32 = 20;
const DIVER_PAUSE: u32 = 30;

/// The game.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Seaquest {
    pub(super) ramping: bool,
    pub(super) oxygen: i32,
    /// How many divers are on board.
    pub(super) crew: i32,
    /// The front of the submarine. It is under way to the right or the left; its bullets are, too.
    pub(super) sub: Swimmer,
    pub(super) bullets: Vec<Swimmer>,
    pub(super) enemy_bullets: Vec<Swimmer>,
    pub(super) fish: Vec<Swimmer>,
    pub(super) enemy_subs: Vec<Swimmer>,
    pub(super) divers: Vec<Swimmer>,
    /// How many frames there are between two enemies.
    pub(super) enemy_pause: u32,
    /// How many are left of them.
    pub(super) enemy_wait: u32,
    /// How many are left until a diver comes.
    pub(super) diver_wait: u32,
    /// How many frames enemies wait between moves.
    pub(super) move_pause: u32,
    /// How many frames are left until the player may shoot.
    pub(super) shot_wait: u32,
    /// Whether it is at the surface since the step before.
    pub(super) surfaced: bool,
    /// How often it became more difficult.
    pub(super) ramp: u32,
}

/// Whatever moves to the left or right.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Swimmer {
    pub(super) x: i32,
    pub(super) y: i32,
    /// -1 to the left, 1 to the right.
    pub(super) heading: i32,
    /// How many frames it waits until it moves.
    pub(super) wait: u32,
    /// And until it shoots.
    pub(super) shot_wait: u32,
}

impl Swimmer {
    fn is_at(&self, other: &Self) -> bool {
        (self.x, self.y) == (other.x, other.y)
    }

    /// Comes in at an edge.
    fn entering(rightwards: bool, y: i32) -> Self {
        let (x, heading) = if rightwards { (0, 1) } else { (LAST, -1) };
        Self { x, y, heading, ..Self::default() }
    }

    /// Moves once it has waited, and waits `pause` frames from then on: whether it did.
    fn swims(&mut self, pause: u32) -> bool {
        if self.wait > 0 {
            self.wait -= 1;
            return false;
        }
        self.wait = pause;
        self.x += self.heading;
        true
    }
}

impl Seaquest {
    pub(super) fn new(ramping: bool) -> Self {
        Self {
            ramping,
            oxygen: OXYGEN,
            crew: 0,
            sub: Swimmer { x: 5, y: 0, heading: -1, ..Swimmer::default() },
            bullets: Vec::new(),
            enemy_bullets: Vec::new(),
            fish: Vec::new(),
            enemy_subs: Vec::new(),
            divers: Vec::new(),
            enemy_pause: ENEMY_PAUSE,
            enemy_wait: ENEMY_PAUSE,
            diver_wait: DIVER_PAUSE,
            move_pause: ENEMY_MOVE_PAUSE,
            shot_wait: 0,
            surfaced: true,
            ramp: 0,
        }
    }

    /// An enemy enters, unless others come towards it in its row.
    fn spawn_enemy(&mut self, luck: &mut Luck) {
        let rightwards = luck.unit() < 0.5;
        let shoots = luck.unit() < 1.0 / 3.0;
        let enemy = Swimmer {
            wait: self.move_pause,
            shot_wait: if shoots { ENEMY_SHOT_PAUSE } else { 0 },
            ..Swimmer::entering(rightwards, row(luck))
        };
        let comes_towards = |other: &Swimmer| other.y == enemy.y && other.heading != enemy.heading;
        if self.fish.iter().chain(&self.enemy_subs).any(comes_towards) {
            return;
        }
        if shoots { &mut self.enemy_subs } else { &mut self.fish }.push(enemy);
    }

    fn spawn_diver(&mut self, luck: &mut Luck) {
        let rightwards = luck.unit() < 0.5;
        let entering = Swimmer::entering(rightwards, row(luck));
        self.divers.push(Swimmer { wait: DIVER_MOVE_PAUSE, ..entering });
    }

    fn steer(&mut self, chosen: Move) {
        if chosen == Move::Fire && self.shot_wait == 0 {
            self.shot_wait = SHOT_PAUSE;
            self.bullets.push(self.sub);
        }
        if chosen.across() != 0 {
            self.sub.heading = chosen.across();
            self.sub.x = (self.sub.x + chosen.across()).clamp(0, LAST);
        }
        self.sub.y = (self.sub.y + chosen.down()).clamp(0, LAST - 1);
    }

    fn move_bullets(&mut self, frame: &mut Frame) {
        for_each_from_last(&mut self.bullets, |bullet| {
            bullet.x += bullet.heading;
            let hit = takes(&mut self.fish, bullet) || takes(&mut self.enemy_subs, bullet);
            if hit {
                frame.reward += 1;
            }
            !hit && on_board(bullet.x)
        });
    }

    fn move_divers(&mut self) {
        for_each_from_last(&mut self.divers, |diver| {
            let mut boards = diver.is_at(&self.sub) && self.crew < CREW;
            if !boards && diver.swims(DIVER_MOVE_PAUSE) {
                boards = diver.is_at(&self.sub) && self.crew < CREW;
            }
            self.crew += i32::from(boards);
            !boards && on_board(diver.x)
        });
    }

    fn move_enemy_subs(&mut self, frame: &mut Frame) {
        for_each_from_last(&mut self.enemy_subs, |enemy| {
            let stays = frame.attack(enemy, self.move_pause, &self.sub, &mut self.bullets);
            // Even one that was just shot may shoot.
            if enemy.shot_wait == 0 {
                enemy.shot_wait = ENEMY_SHOT_PAUSE;
                self.enemy_bullets.push(Swimmer { wait: 0, shot_wait: 0, ..*enemy });
            } else {
                enemy.shot_wait -= 1;
            }
            stays
        });
    }

    fn move_enemy_bullets(&mut self, frame: &mut Frame) {
        for_each_from_last(&mut self.enemy_bullets, |bullet| {
            frame.over |= bullet.is_at(&self.sub);
            bullet.x += bullet.heading;
            frame.over |= bullet.is_at(&self.sub);
            on_board(bullet.x)
        });
    }

    fn move_fish(&mut self, frame: &mut Frame) {
        for_each_from_last(&mut self.fish, |enemy| {
            frame.attack(enemy, self.move_pause, &self.sub, &mut self.bullets)
        });
    }

    /// Uses oxygen up, or comes up to the surface.
    fn breathe(&mut self, frame: &mut Frame) {
        frame.over |= self.oxygen < 0;
        if self.sub.y > 0 {
            self.oxygen -= 1;
            self.surfaced = false;
        } else if !self.surfaced && self.crew == 0 {
            frame.over = true;
        } else if !self.surfaced {
            self.surfaced = true;
            if self.crew == CREW {
                frame.reward += self.gauge();
                self.crew = 0;
            } else {
                self.crew -= 1;
            }
            self.oxygen = OXYGEN;
            if self.ramping && (self.enemy_pause > 1 || self.move_pause > LEAST_MOVE_PAUSE) {
                self.become_harder();
            }
        }
    }

    fn become_harder(&mut self) {
        if self.move_pause > LEAST_MOVE_PAUSE && self.ramp % 2 == 1 {
            self.move_pause -= 1;
        }
        if self.enemy_pause > 1 {
            self.enemy_pause -= 1;
        }
        self.ramp += 1;
    }

    /// How many cells the gauge of oxygen has; fewer than none when it has run out.
    fn gauge(&self) -> i32 {
        (self.oxygen * CELLS).div_euclid(OXYGEN)
    }
}

/// What a frame comes to.
#[derive(Default)]
struct Frame {
    reward: i32,
    over: bool,
}

impl Frame {
    /// An enemy swims, and may ram the player or run into a bullet: whether it stays.
    fn attack(
        &mut self,
        enemy: &mut Swimmer,
        pause: u32,
        sub: &Swimmer,
        bullets: &mut Vec<Swimmer>,
    ) -> bool {
        self.over |= enemy.is_at(sub);
        if !enemy.swims(pause) {
            return true;
        }
        self.over |= enemy.is_at(sub);
        let hit = takes(bullets, enemy);
        self.reward += i32::from(hit);
        !hit && on_board(enemy.x)
    }
}

/// The row in which something enters.
fn row(luck: &mut Luck) -> i32 {
    i32::try_from(1 + luck.below(8)).expect("one of eight")
}

/// Takes the first out that is where `hit` is: whether there was one.
fn takes(from: &mut Vec<Swimmer>, hit: &Swimmer) -> bool {
    let place = from.iter().position(|one| one.is_at(hit));
    place.is_some_and(|place| {
        from.remove(place);
        true
    })
}

/// Goes through all from the last to the first, and takes out those that do not stay.
///
/// As in the original it is by its value that one is taken out: of two that are the same in everything the first one
/// goes, and the other is met twice.
fn for_each_from_last(all: &mut Vec<Swimmer>, mut stays: impl FnMut(&mut Swimmer) -> bool) {
    for at in (0..all.len()).rev() {
        if !stays(&mut all[at]) {
            let same = all.iter().position(|one| *one == all[at]).expect("itself at least");
            all.remove(same);
        }
    }
}

impl Game for Seaquest {
    fn n_channels(&self) -> usize {
        10
    }

    fn reset(&mut self, _: &mut Luck) {
        let cleared = |all: &mut Vec<Swimmer>| {
            all.clear();
            mem::take(all)
        };
        *self = Self {
            bullets: cleared(&mut self.bullets),
            enemy_bullets: cleared(&mut self.enemy_bullets),
            fish: cleared(&mut self.fish),
            enemy_subs: cleared(&mut self.enemy_subs),
            divers: cleared(&mut self.divers),
            ..Self::new(self.ramping)
        };
    }

    fn act(&mut self, chosen: Move, luck: &mut Luck) -> (f32, bool) {
        if self.enemy_wait == 0 {
            self.spawn_enemy(luck);
            self.enemy_wait = self.enemy_pause;
        }
        if self.diver_wait == 0 {
            self.spawn_diver(luck);
            self.diver_wait = DIVER_PAUSE;
        }
        self.steer(chosen);
        let mut frame = Frame::default();
        self.move_bullets(&mut frame);
        self.move_divers();
        self.move_enemy_subs(&mut frame);
        self.move_enemy_bullets(&mut frame);
        self.move_fish(&mut frame);
        self.enemy_wait -= 1;
        self.diver_wait -= 1;
        self.shot_wait = self.shot_wait.saturating_sub(1);
        self.breathe(&mut frame);
        #[expect(clippy::cast_precision_loss, reason = "there are a few enemies at most")]
        let reward = frame.reward as f32;
        (reward, frame.over)
    }

    fn draw(&self, board: &mut Board<'_>) {
        board.mark(0, self.sub.x, self.sub.y);
        board.mark(1, self.sub.x - self.sub.heading, self.sub.y);
        // Fewer than none are counted from the other end.
        let gauge = self.gauge();
        for x in 0..if gauge < 0 { CELLS + gauge } else { gauge } {
            board.mark(7, x, LAST);
        }
        for x in 0..self.crew {
            board.mark(8, LAST - 1 - x, LAST);
        }
        for bullet in &self.bullets {
            board.mark(2, bullet.x, bullet.y);
        }
        for bullet in &self.enemy_bullets {
            board.mark(4, bullet.x, bullet.y);
        }
        for (channel, all) in [(5, &self.fish), (6, &self.enemy_subs), (9, &self.divers)] {
            for one in all {
                board.mark(channel, one.x, one.y);
                board.mark(3, one.x - one.heading, one.y);
            }
        }
    }

    fn ramp(&self) -> Option<u32> {
        Some(self.ramp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Right below the surface, with a bar of oxygen that is not quite full.
    fn submerged(crew: i32, oxygen: i32) -> Seaquest {
        let mut game = Seaquest { crew, oxygen, surfaced: false, ..Seaquest::new(true) };
        game.sub.y = 1;
        game
    }

    #[test]
    fn coming_up_with_six_divers_pays_the_gauge_of_oxygen() {
        let mut luck = Luck::numpy(0);
        // 119 of 200 are five cells of ten, and not quite six.
        for (crew, oxygen, pays, left) in [(6, 119, 5.0, 0), (6, 200, 10.0, 0), (5, 119, 0.0, 4)] {
            let mut game = submerged(crew, oxygen);
            assert_eq!(game.act(Move::Up, &mut luck), (pays, false));
            assert_eq!((game.crew, game.oxygen, game.surfaced), (left, OXYGEN, true));
            assert_eq!((game.ramp, game.enemy_pause), (1, ENEMY_PAUSE - 1));
            // Staying there is nothing new.
            assert_eq!(game.act(Move::Up, &mut luck), (0.0, false));
            assert_eq!((game.crew, game.oxygen, game.ramp), (left, OXYGEN, 1));
        }
        assert_eq!(submerged(0, 119).act(Move::Up, &mut luck), (0.0, true));
    }

    #[test]
    fn a_seventh_diver_stays_outside() {
        let mut game = submerged(5, OXYGEN);
        game.divers = vec![Swimmer { wait: 3, ..game.sub }; 2];
        game.act(Move::Stay, &mut Luck::numpy(0));
        assert_eq!((game.crew, game.divers.len()), (6, 1));
    }

    #[test]
    fn the_game_is_over_when_the_oxygen_has_run_out() {
        let mut game = submerged(1, 1);
        let over: Vec<bool> = (0..3).map(|_| game.act(Move::Stay, &mut Luck::numpy(0)).1).collect();
        assert_eq!(over, [false, false, true]);
    }

    #[test]
    fn of_two_that_are_the_same_the_other_is_met_twice() {
        let at = |x| Swimmer { x, ..Swimmer::default() };
        let mut all = vec![at(1), at(2), at(1)];
        let mut met = Vec::new();
        for_each_from_last(&mut all, |one| {
            met.push(one.x);
            met.len() > 1
        });
        assert_eq!(met, [1, 1, 2]);
        assert_eq!(all, [at(2), at(1)]);
    }
}
