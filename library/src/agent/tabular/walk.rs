//! Walking through a finite world.

use ivx_data::Episode;
use ivx_math::policy::pick;
use ivx_op::Ctx;
use ivx_world::Mdp;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

/// What chance decides in one episode of learning.
pub(super) struct Luck {
    world: ivx_world::Luck,
    actions: ChaCha8Rng,
}

impl Luck {
    /// That of episode `i`, in the same worlds as whoever learns in one.
    pub(super) fn of(ctx: &Ctx, i: usize) -> Self {
        let world = ivx_world::Luck::of(ctx, "learn", 0, i as u64);
        Self { world, actions: ctx.rng("actions", &[&i.to_string()]) }
    }

    /// A first state.
    pub(super) fn start(&mut self, mdp: &Mdp) -> usize {
        self.world.pick(&mdp.start)
    }

    /// An action.
    pub(super) fn act(&mut self, policy: &[f64]) -> usize {
        pick(policy, self.actions.random())
    }

    /// The state that follows.
    pub(super) fn step(&mut self, mdp: &Mdp, state: usize, action: usize) -> usize {
        self.world.pick(mdp.next(state, action))
    }
}

/// One episode of at most `limit` steps.
pub(super) fn episode<'a>(
    mdp: &Mdp,
    limit: usize,
    luck: &mut Luck,
    policy: impl Fn(usize) -> &'a [f64],
) -> Episode {
    let mut state = luck.start(mdp);
    let mut all = Episode { states: vec![state], ..Episode::default() };
    while !mdp.terminal[state] && all.actions.len() < limit {
        let action = luck.act(policy(state));
        all.actions.push(action);
        let next = luck.step(mdp, state, action);
        all.rewards.push(mdp.paid(state, action, next));
        all.states.push(next);
        state = next;
    }
    all.ended = mdp.terminal[state];
    all
}
