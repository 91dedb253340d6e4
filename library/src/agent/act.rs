//! Acting in an environment.

use ivx_data::{Dataset, Episode, Form, Rollouts};
use ivx_math::moments::real;
use ivx_math::policy::pick;
use ivx_op::{Array, Ctx, Dim, Facts, Labels, One, Op, OpError, Shapes, declare};
use ivx_world::{Env, Mdp, world_is_finite};
use rand::RngExt as _;

declare! {
    /// Episodes of a policy in an environment (Eqn. 2.35).
    ///
    /// Fewer are the first of more. Where an episode starts and what chance decides in each of its steps
    /// are draws of their own, so that policies compared on one seed meet the same luck.
    pub struct Act = "act" @ 1, stochastic -> Rollouts {
        /// The probability of each action in each state.
        policy: One<Array>;
        /// The environment.
        r#in: Box<dyn Env>;
        /// How many episodes.
        episodes: usize, in 0.0..=1e6;
        /// After so many steps an episode is cut off.
        limit: usize = 100, in 1.0..=1e6, unit "steps";
        /// Tells apart draws that must differ on one seed, such as training and test data.
        stream: String = "main";
    }
    rule world_is_finite;
    shapes of_env;
}

fn of_env(facts: &Facts<'_>) -> Option<Shapes> {
    let mdp = facts.arg::<Box<dyn Env>>("in")?.finite()?.mdp().ok()?;
    Some(form(mdp.n_states(), mdp.n_actions()).shapes())
}

impl Op for Act {
    fn run(&self, ctx: &Ctx) -> Result<Rollouts, OpError> {
        let mdp = ivx_world::mdp(&*self.r#in)?;
        let policy = mdp.policy(&self.policy)?;
        let mut episodes = Vec::new();
        for i in 0..self.episodes {
            let mut luck = Luck::of(ctx, &self.stream, i);
            let act = |state| &policy[state * mdp.n_actions()..][..mdp.n_actions()];
            episodes.push(episode(&mdp, self.limit, &mut luck, act));
        }
        let actions = mdp.actions.iter().map(|name| (*name).to_owned()).collect();
        Ok(Rollouts { n_states: mdp.n_states(), actions, episodes })
    }
}

/// The streams of one episode.
pub(super) struct Luck {
    start: rand_chacha::ChaCha8Rng,
    actions: rand_chacha::ChaCha8Rng,
    moves: rand_chacha::ChaCha8Rng,
}

impl Luck {
    /// That of episode `i`.
    pub(super) fn of(ctx: &Ctx, stream: &str, i: usize) -> Self {
        let rng = |purpose| ctx.rng(purpose, &[stream, &i.to_string()]);
        Self { start: rng("start"), actions: rng("actions"), moves: rng("moves") }
    }

    /// A first state.
    pub(super) fn start(&mut self, mdp: &Mdp) -> usize {
        pick(&mdp.start, self.start.random())
    }

    /// An action.
    pub(super) fn act(&mut self, policy: &[f64]) -> usize {
        pick(policy, self.actions.random())
    }

    /// The state that follows.
    pub(super) fn step(&mut self, mdp: &Mdp, state: usize, action: usize) -> usize {
        pick(mdp.next(state, action), self.moves.random())
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
        all.rewards.push(mdp.reward(state, action));
        state = luck.step(mdp, state, action);
        all.states.push(state);
    }
    all.ended = mdp.terminal[state];
    all
}

declare! {
    /// What an agent did in each state that it was in (Eqn. 2.23), for a classifier to learn from: inputs
    /// have a 1 for the state, and targets are actions.
    pub struct Demonstrations = "demonstrations" @ 1 -> Dataset {
        /// The episodes.
        of: One<Rollouts>;
    }
    shapes of_rollouts;
}

fn of_rollouts(facts: &Facts<'_>) -> Option<Shapes> {
    facts.shapes("of").cloned()
}

/// A state as a vector, and an action as a class.
pub(super) fn form(n_states: usize, n_actions: usize) -> Form {
    Form { input: vec![n_states], target: Vec::new(), classes: Some(n_actions) }
}

impl Op for Demonstrations {
    fn run(&self, _: &Ctx) -> Result<Dataset, OpError> {
        let Rollouts { n_states, actions, episodes } = &self.of.0;
        let mut data = Dataset { form: form(*n_states, actions.len()), ..Dataset::default() };
        for (state, action) in episodes.iter().flat_map(|e| e.states.iter().zip(&e.actions)) {
            data.x.extend((0..*n_states).map(|s| if s == *state { 1.0 } else { 0.0 }));
            data.y.push(real(*action));
        }
        Ok(data)
    }
}

declare! {
    /// The return of each episode: its rewards, discounted to its start (Eqn. 2.30).
    pub struct Returns = "returns" @ 1 -> Array [episode] {
        /// The episodes.
        of: One<Rollouts>;
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
    }
}

impl Op for Returns {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let of_one = |e: &Episode| e.rewards.iter().rev().fold(0.0, |g, r| r + self.discount * g);
        let values: Vec<f64> = self.of.episodes.iter().map(of_one).collect();
        let numbers = (0..values.len()).map(real).collect();
        Ok(Array::series(Dim::new("episode", Labels::Numbers(numbers)), values))
    }
}

declare! {
    /// How often each action was taken in each state.
    pub struct Visits = "visits" @ 1 -> Array [state, action] {
        /// The episodes.
        of: One<Rollouts>;
    }
}

impl Op for Visits {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let Rollouts { n_states, actions, episodes } = &self.of.0;
        let mut values = vec![0.0; n_states * actions.len()];
        for (state, action) in episodes.iter().flat_map(|e| e.states.iter().zip(&e.actions)) {
            values[state * actions.len() + action] += 1.0;
        }
        Ok(Array { dims: self.of.pairs(), values })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ivx_math::bellman::expected_values;
    use ivx_math::moments::mean;
    use ivx_world::{Chain, GoalWorld};

    const CTX: Ctx = Ctx::new("act", 3, None);

    fn chain() -> Box<dyn Env> {
        Box::new(Chain { cells: 4, slip: 0.1, goal: true })
    }

    fn episodes(right: f64, episodes: usize, limit: usize) -> Rollouts {
        let dims = ivx_world::mdp(&*chain()).unwrap().pairs();
        let policy = One(Array { dims, values: [1.0 - right, right].repeat(4) });
        let stream = "main".to_owned();
        Act { policy, r#in: chain(), episodes, limit, stream }.run(&CTX).unwrap()
    }

    #[test]
    fn fewer_are_the_first_of_more_and_luck_is_common() {
        let (few, many) = (episodes(0.5, 3, 100), episodes(0.5, 8, 100));
        assert_eq!(few.episodes, many.episodes[..3]);
        let starts = |all: &Rollouts| all.episodes.iter().map(|e| e.states[0]).collect::<Vec<_>>();
        assert_eq!(starts(&many), starts(&episodes(1.0, 8, 100)));
        assert!((0..3).all(|s| starts(&episodes(1.0, 40, 100)).contains(&s)));
    }

    #[test]
    fn episodes_end_at_the_goal_or_are_cut_off() {
        for e in episodes(1.0, 20, 100).episodes {
            assert!(e.ended && e.states.last() == Some(&3) && e.rewards.last() == Some(&1.0));
            assert_eq!(e.actions.len(), 3 - e.states[0]);
        }
        let cut = episodes(0.0, 20, 5);
        assert!(cut.episodes.iter().all(|e| !e.ended && e.actions.len() == 5));
    }

    #[test]
    fn chance_is_as_the_environment_says() {
        let all = episodes(0.0, 200, 50);
        let steps = all.episodes.iter().flat_map(|e| e.states.windows(2));
        let stayed: Vec<f64> =
            steps.filter(|w| w[0] > 0).map(|w| f64::from(u8::from(w[0] == w[1]))).collect();
        assert!((mean(&stayed) - 0.1).abs() < 0.05, "{}", mean(&stayed));
    }

    #[test]
    fn what_is_read_off_an_episode() {
        let e = Episode {
            states: vec![1, 0, 1, 2],
            actions: vec![0, 1, 1],
            rewards: vec![1.0, 0.0, 2.0],
            ended: true,
        };
        let actions = vec!["LEFT".to_owned(), "RIGHT".to_owned()];
        let of =
            || One(Rollouts { n_states: 3, actions: actions.clone(), episodes: vec![e.clone()] });
        // 1 + 0 + ¼·2
        assert_eq!(Returns { of: of(), discount: 0.5 }.run(&CTX).unwrap().values, [1.5]);
        assert_eq!(Visits { of: of() }.run(&CTX).unwrap().values, [0.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
        let data = Demonstrations { of: of() }.run(&CTX).unwrap();
        assert_eq!(data.y, [0.0, 1.0, 1.0]);
        assert_eq!(data.x, [0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    }

    #[test]
    fn mean_returns_are_the_values() {
        let r#in = || Box::new(GoalWorld { size: 3, goal: vec![0, 0], trap: vec![2, 2] });
        let mdp = ivx_world::mdp(&*r#in()).unwrap();
        let policy = || One(Array { dims: mdp.pairs(), values: vec![0.25; 36] });
        let q = super::super::PolicyValues { policy: policy(), r#in: r#in(), discount: 0.9 };
        let q = q.run(&CTX).unwrap().values;
        let v = expected_values(&mdp.model(), &[0.25; 36], &q);
        let exact: f64 = v.iter().zip(&mdp.start).map(|(v, p)| v * p).sum();
        let stream = "main".to_owned();
        let all = Act { policy: policy(), r#in: r#in(), episodes: 4000, limit: 200, stream };
        let of = One(all.run(&CTX).unwrap());
        let seen = mean(&Returns { of, discount: 0.9 }.run(&CTX).unwrap().values);
        // The symmetric world is worth 0; a return has a standard deviation below 1.
        assert!(exact.abs() < 1e-12 && seen.abs() < 0.05, "{exact} {seen}");
    }
}
