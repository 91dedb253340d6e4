//! Somebody acts in worlds side by side, one episode in each.

use ivx_op::{Ctx, OpError};
use ivx_world::{Env, Lanes, Step};
use rand_chacha::ChaCha8Rng;

use super::agent::Acting;

/// Worlds side by side in which somebody acts.
pub(crate) struct Drive<'a> {
    pub(crate) env: &'a dyn Env,
    /// How many there are.
    pub(crate) worlds: usize,
    /// By which stream of luck, and which episode of it, they go.
    pub(crate) luck: (&'a str, u64),
    /// After how many steps an episode is cut off at the latest.
    pub(crate) limit: Option<u64>,
}

/// How many steps there are between looks whether it is to end.
const LOOKS: u64 = 64;

impl<'a> Drive<'a> {
    /// Lets somebody act in each of the worlds until all episodes are over.
    ///
    /// - `rng`: by what actions are drawn.
    /// - `look`: says whether it is to end before it is done.
    /// - `see`: is shown each step of each world whose episode is not over yet.
    pub(crate) fn run(
        &self,
        (actor, rng): (&mut dyn Acting, &mut ChaCha8Rng),
        ctx: &Ctx<'a>,
        mut look: impl FnMut() -> Result<(), OpError>,
        mut see: impl FnMut(usize, &Step, &dyn Acting),
    ) -> Result<(), OpError> {
        let mut lanes = Lanes::open(self.env, self.worlds, ctx, self.luck)?;
        if let Some(steps) = self.limit {
            lanes.limit(steps);
        }
        actor.begin();
        let mut over: Vec<usize> = Vec::new();
        for t in 0_u64.. {
            if lanes.awake().is_empty() {
                break;
            }
            if t % LOOKS == 0 {
                look()?;
            }
            rng.set_stream(t);
            rng.set_word_pos(0);
            let (seen, acts) = lanes.choose();
            actor.act(seen, rng, acts)?;
            lanes.step()?;
            for lane in lanes.awake() {
                see(*lane, lanes.stepped(), actor);
            }
            over.clear();
            over.extend(lanes.finished().map(|episode| episode.lane));
            lanes.rest(&over);
            actor.rest(&over);
        }
        Ok(())
    }
}
