//! Episodes that never come to some states.

use ivx_data::{Episode, Rollouts, Walks};
use ivx_op::{Ctx, Facts, One, Op, OpError, Shapes, declare};

declare! {
    /// Episodes without the steps from and to some states, such as those that should stay out of the training
    /// distribution (§C.1.2). What lies before and behind them are episodes of their own, that were cut off.
    pub struct WithoutStates = "without_states" @ 2 -> Rollouts {
        /// The episodes.
        of: One<Rollouts>;
        /// The states, by number.
        states: Vec<usize>, in 0.0..;
    }
    rule super::of_is_walked;
    shapes of_episodes;
}

fn of_episodes(facts: &Facts<'_>) -> Option<Shapes> {
    facts.shapes("of").cloned()
}

impl Op for WithoutStates {
    fn run(&self, _: &Ctx) -> Result<Rollouts, OpError> {
        let Walks { n_states, actions, episodes } = self.of.walks()?;
        if let Some(state) = self.states.iter().find(|state| **state >= n_states) {
            return Err(OpError::Failed(format!("there is no state {state} among {n_states}")));
        }
        let pieces = episodes.iter().flat_map(|episode| pieces(episode, &self.states));
        Ok(Walks { n_states, actions, episodes: pieces.collect() }.into())
    }
}

/// The longest parts of an episode of at least a step that have none of these states.
fn pieces(episode: &Episode, without: &[usize]) -> Vec<Episode> {
    let last = episode.states.len() - 1;
    let mut pieces = Vec::new();
    let mut from = 0;
    for (t, state) in episode.states.iter().enumerate() {
        let is_out = without.contains(state);
        if !is_out && t < last {
            continue;
        }
        let to = if is_out { t } else { t + 1 };
        if to > from + 1 {
            pieces.push(Episode {
                states: episode.states[from..to].to_vec(),
                actions: episode.actions[from..to - 1].to_vec(),
                rewards: episode.rewards[from..to - 1].to_vec(),
                ended: episode.ended && !is_out,
            });
        }
        from = t + 1;
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_episode_is_cut_where_it_comes_to_such_a_state() {
        let episode = Episode {
            states: vec![1, 2, 0, 3, 1, 2, 0],
            actions: vec![0, 1, 2, 3, 4, 5],
            rewards: vec![0.0, 0.1, 0.2, 0.3, 0.4, 0.5],
            ended: true,
        };
        let piece = |states: &[usize], actions: &[usize], rewards: &[f64]| Episode {
            states: states.to_vec(),
            actions: actions.to_vec(),
            rewards: rewards.to_vec(),
            ended: false,
        };
        let expected = [piece(&[1, 2], &[0], &[0.0]), piece(&[3, 1, 2], &[3, 4], &[0.3, 0.4])];
        assert_eq!(pieces(&episode, &[0]), expected);
        assert_eq!(pieces(&episode, &[]), std::slice::from_ref(&episode));
        assert_eq!(pieces(&episode, &[7]), std::slice::from_ref(&episode));
        assert_eq!(
            pieces(&episode, &[1, 3])[1],
            Episode { ended: true, ..piece(&[2, 0], &[5], &[0.5]) }
        );
        assert!(pieces(&Episode { states: vec![1], ..Episode::default() }, &[0]).is_empty());
    }
}
