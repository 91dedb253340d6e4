//! Seaquest (Young & Tian, 2019).
//!
//! A submarine of two cells shoots fish and enemy submarines, for a reward of 1 each, and picks up divers, of whom it
//! holds six. Enemy submarines shoot back. Oxygen is used up under water and refilled at the surface, where one diver
//! is set down; with six divers all are, and what is left of the oxygen is paid: 1 for each cell of its gauge. Each time
//! there come more enemies from then on, and faster ones. The game is over when an enemy or its bullet hits the front of the submarine,
//! when there is no oxygen left, or when it comes up without a diver. Trails tell where things were before.

use super::board::{Board, LAST, on_board};
use super::{Game, Move};
use crate::luck::Luck;

const OXYGEN: i32 = 200;
const CELLS: i32 = 10;
const CREW: i32 = 6;
const SHOT_PAUSE: u32 = 5;
const ENEMY_SHOT_PAUSE: u32 = 10;
const ENEMY_MOVE_PAUSE: u32 = 5;
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

    /// Moves the player's bullets: the reward for what they hit.
    fn move_bullets(&mut self) -> f32 {
        let mut reward = 0.0;
        for_each_from_last(&mut self.bullets, |bullet| {
            bullet.x += bullet.heading;
            let hit = on_board(bullet.x)
                && (takes(&mut self.fish, bullet) || takes(&mut self.enemy_subs, bullet));
            reward += if hit { 1.0 } else { 0.0 };
            !hit && on_board(bullet.x)
        });
        reward
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

    /// Moves enemy submarines, which shoot: the reward for those that run into a bullet, and whether one hits the player.
    fn move_enemy_subs(&mut self) -> (f32, bool) {
        let (mut reward, mut over) = (0.0, false);
        for_each_from_last(&mut self.enemy_subs, |enemy| {
            over |= enemy.is_at(&self.sub);
            let mut stays = true;
            if enemy.swims(self.move_pause) {
                over |= enemy.is_at(&self.sub);
                if !on_board(enemy.x) {
                    stays = false;
                } else if !enemy.is_at(&self.sub) && takes(&mut self.bullets, enemy) {
                    reward += 1.0;
                    stays = false;
                }
            }
            if enemy.shot_wait == 0 {
                enemy.shot_wait = ENEMY_SHOT_PAUSE;
                self.enemy_bullets.push(Swimmer { wait: 0, shot_wait: 0, ..*enemy });
            } else {
                enemy.shot_wait -= 1;
            }
            stays
        });
        (reward, over)
    }

    fn move_enemy_bullets(&mut self) -> bool {
        let mut over = false;
        for_each_from_last(&mut self.enemy_bullets, |bullet| {
            over |= bullet.is_at(&self.sub);
            bullet.x += bullet.heading;
            over |= bullet.is_at(&self.sub);
            on_board(bullet.x)
        });
        over
    }

    fn move_fish(&mut self) -> (f32, bool) {
        let (mut reward, mut over) = (0.0, false);
        for_each_from_last(&mut self.fish, |enemy| {
            over |= enemy.is_at(&self.sub);
            let mut stays = true;
            if enemy.swims(self.move_pause) {
                over |= enemy.is_at(&self.sub);
                if !on_board(enemy.x) {
                    stays = false;
                } else if !enemy.is_at(&self.sub) && takes(&mut self.bullets, enemy) {
                    reward += 1.0;
                    stays = false;
                }
            }
            stays
        });
        (reward, over)
    }

    /// Breathes: the reward for coming up, and whether that or the lack of oxygen ends the game.
    fn breathe(&mut self) -> (f32, bool) {
        let out = self.oxygen < 0;
        if self.sub.y > 0 {
            self.oxygen -= 1;
            self.surfaced = false;
            return (0.0, out);
        }
        if self.surfaced {
            return (0.0, out);
        }
        if self.crew == 0 {
            return (0.0, true);
        }
        self.surfaced = true;
        let mut reward = 0.0;
        if self.crew == CREW {
            reward = f32::from(u8::try_from(self.gauge()).unwrap_or(0));
            self.crew = 0;
        } else {
            self.crew -= 1;
        }
        self.oxygen = OXYGEN;
        if self.ramping && (self.enemy_pause > 1 || self.move_pause > 2) {
            self.become_harder();
        }
        (reward, out)
    }

    fn become_harder(&mut self) {
        if self.move_pause > 2 && self.ramp % 2 == 1 {
            self.move_pause -= 1;
        }
        if self.enemy_pause > 1 {
            self.enemy_pause -= 1;
        }
        self.ramp += 1;
    }

    fn gauge(&self) -> i32 {
        (self.oxygen * CELLS).div_euclid(OXYGEN)
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

/// Goes through all from the last to the first, and takes those out of which `stays` is false.
fn for_each_from_last(all: &mut Vec<Swimmer>, mut stays: impl FnMut(&mut Swimmer) -> bool) {
    for at in (0..all.len()).rev() {
        if at >= all.len() {
            break;
        }
        if !stays(&mut all[at]) {
            let place = all.iter().position(|one| *one == all[at]).expect("at least this");
            all.remove(place);
        }
    }
}

impl Game for Seaquest {
    fn n_channels(&self) -> usize {
        10
    }

    fn reset(&mut self, _: &mut Luck) {
        *self = Self::new(self.ramping);
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
        let mut reward = self.move_bullets();
        self.move_divers();
        let (pays, rammed) = self.move_enemy_subs();
        reward += pays;
        let shot = self.move_enemy_bullets();
        let (pays, bitten) = self.move_fish();
        reward += pays;
        self.enemy_wait -= 1;
        self.diver_wait -= 1;
        self.shot_wait = self.shot_wait.saturating_sub(1);
        let (pays, choked) = self.breathe();
        (reward + pays, rammed || shot || bitten || choked)
    }

    fn draw(&self, board: &mut Board<'_>) {
        board.mark(0, self.sub.x, self.sub.y);
        board.mark(1, self.sub.x - self.sub.heading, self.sub.y);
        for x in 0..self.gauge() {
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
