//! Implicit ensembles of values: what one model predicts over different numbers of steps (§5.2).

use ivx_math::bellman::{Model, evaluation, optimality};
use ivx_math::moments::real;
use ivx_math::mpv::{
    Rollout, implicit_action_ensemble, implicit_ensemble, independent_rollouts, one_rollout,
};
use ivx_op::{Array, Ctx, Dim, Labels, One, Op, OpError, declare};

declare! {
    /// The model-predicted values over 0 to `n` steps (Eqn. 5.1), by the evaluation of a policy in the model, exactly:
    /// the implicit ensemble of values (Eqn. 5.5). Their standard deviation over `k` is σ-IVE[n], their mean μ-IVE[n]
    /// (Eqns. 5.7 and 5.8).
    ///
    /// The model is numbers, learned or true: how probably each state follows, and what actions pay.
    pub struct ImplicitValues = "implicit_values" @ 1 -> Array [k, state] {
        /// What each state is thought to be worth.
        values: One<Array>;
        /// The probability of each state that may follow.
        transitions: One<Array>;
        /// The reward of each action in each state.
        rewards: One<Array>;
        /// The probability of each action in each state.
        policy: One<Array>;
        /// The most steps.
        n: usize = 5, in 0.0..=1e4, unit "steps";
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
    }
}

declare! {
    /// The same by the best action of each step in the model (Eqn. C.3).
    pub struct ImplicitOptimalValues = "implicit_optimal_values" @ 1 -> Array [k, state] {
        /// What each state is thought to be worth.
        values: One<Array>;
        /// The probability of each state that may follow.
        transitions: One<Array>;
        /// The reward of each action in each state.
        rewards: One<Array>;
        /// The most steps.
        n: usize = 5, in 0.0..=1e4, unit "steps";
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
    }
}

declare! {
    /// The model-predicted values of actions over 1 to `n` steps (Eqn. C.4a): an action first, and then a policy.
    pub struct ImplicitActionValues = "implicit_action_values" @ 1 -> Array [k, state, action] {
        /// What each state is thought to be worth.
        values: One<Array>;
        /// The probability of each state that may follow.
        transitions: One<Array>;
        /// The reward of each action in each state.
        rewards: One<Array>;
        /// The probability of each action in each state.
        policy: One<Array>;
        /// The most steps.
        n: usize = 5, in 1.0..=1e4, unit "steps";
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
    }
}

declare! {
    /// The model-predicted values over 0 to `n` steps by Monte-Carlo rollouts in the model, each the mean of several
    /// draws: by one rollout for all numbers of steps (Eqns. 5.2 and 5.6), or by one for each.
    pub struct SampledValues = "sampled_values" @ 1, stochastic -> Array [k, state] {
        /// What each state is thought to be worth.
        values: One<Array>;
        /// The probability of each state that may follow.
        transitions: One<Array>;
        /// The reward of each action in each state.
        rewards: One<Array>;
        /// The probability of each action in each state.
        policy: One<Array>;
        /// The most steps.
        n: usize = 5, in 0.0..=1e4, unit "steps";
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
        /// How many draws.
        rollouts: usize = 1, in 1.0..=1e6;
        /// Whether each number of steps has rollouts of its own.
        independent: bool = false;
    }
}

/// A model, learned or true, and what is thought of its states.
struct Learned<'a> {
    values: &'a Array,
    transitions: &'a Array,
    rewards: &'a Array,
    /// That no state ends an episode: learned models do not know which do.
    terminal: Vec<bool>,
}

impl<'a> Learned<'a> {
    fn of(values: &'a Array, transitions: &'a Array, rewards: &'a Array) -> Result<Self, OpError> {
        let [state, action] = &rewards.dims[..] else {
            return Err(unfit("rewards", "`state` and `action`"));
        };
        if (state.name.as_str(), action.name.as_str()) != ("state", "action") {
            return Err(unfit("rewards", "`state` and `action`"));
        }
        if values.dims != [state.clone()] {
            return Err(unfit("values", "the states of the rewards"));
        }
        let next = Dim::new("next", state.labels.clone());
        if transitions.dims != [state.clone(), action.clone(), next] {
            return Err(unfit("transitions", "`state`, `action` and `next` as the rewards are"));
        }
        Ok(Self { values, transitions, rewards, terminal: vec![false; state.len()] })
    }

    fn model(&self) -> Model<'_> {
        let (transitions, rewards) = (&self.transitions.values, &self.rewards.values);
        Model { transitions, rewards, terminal: &self.terminal }
    }

    fn policy<'p>(&self, policy: &'p Array) -> Result<&'p [f64], OpError> {
        if policy.dims != self.rewards.dims {
            return Err(unfit("policy", "the states and actions of the rewards"));
        }
        Ok(&policy.values)
    }

    /// The implicit ensemble of the states under a policy: `[n + 1][S]`.
    fn evaluated(&self, policy: &Array, n: usize, discount: f64) -> Result<Vec<Vec<f64>>, OpError> {
        let (model, policy) = (self.model(), self.policy(policy)?);
        let operator = |v: &[f64]| evaluation(&model, policy, discount, v);
        Ok(implicit_ensemble(operator, &self.values.values, n))
    }
}

/// Members from `k` on, each a number for everything that `dims` say.
fn ensemble(members: &[Vec<f64>], first: usize, dims: &[Dim]) -> Array {
    let steps = (first..first + members.len()).map(real).collect();
    let mut all = vec![Dim::new("k", Labels::Numbers(steps))];
    all.extend(dims.iter().cloned());
    Array { dims: all, values: members.concat() }
}

fn unfit(what: &str, over: &str) -> OpError {
    OpError::Failed(format!("the {what} are not over {over}"))
}

impl Op for ImplicitValues {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let learned = Learned::of(&self.values, &self.transitions, &self.rewards)?;
        let members = learned.evaluated(&self.policy, self.n, self.discount)?;
        Ok(ensemble(&members, 0, &self.values.dims))
    }
}

impl Op for ImplicitOptimalValues {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let learned = Learned::of(&self.values, &self.transitions, &self.rewards)?;
        let model = learned.model();
        let operator = |v: &[f64]| optimality(&model, self.discount, v);
        let members = implicit_ensemble(operator, &self.values.values, self.n);
        Ok(ensemble(&members, 0, &self.values.dims))
    }
}

impl Op for ImplicitActionValues {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let learned = Learned::of(&self.values, &self.transitions, &self.rewards)?;
        let states = learned.evaluated(&self.policy, self.n, self.discount)?;
        let members = implicit_action_ensemble(&learned.model(), self.discount, &states);
        Ok(ensemble(&members, 1, &self.rewards.dims))
    }
}

impl Op for SampledValues {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        let learned = Learned::of(&self.values, &self.transitions, &self.rewards)?;
        let (model, policy) = (learned.model(), learned.policy(&self.policy)?);
        let values = &self.values;
        let n_states = values.values.len();
        let mut members = vec![vec![0.0; n_states]; self.n + 1];
        for state in 0..n_states {
            let (values, discount) = (&values.values[..], self.discount);
            let from = Rollout { model, policy, values, discount, state, action: None };
            let mut rng = ctx.rng("rollouts", &[&state.to_string()]);
            for _ in 0..self.rollouts {
                let draw = if self.independent { independent_rollouts } else { one_rollout };
                for (member, value) in members.iter_mut().zip(draw(&from, self.n, &mut rng)) {
                    member[state] += value / real(self.rollouts);
                }
            }
        }
        Ok(ensemble(&members, 0, &values.dims))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CTX: Ctx = Ctx::new("implicit", 1, None);

    fn dims() -> [Dim; 3] {
        let numbers = || Labels::Numbers(vec![0.0, 1.0]);
        let actions = Labels::Names(vec!["STAY".into(), "GO".into()]);
        [Dim::new("state", numbers()), Dim::new("action", actions), Dim::new("next", numbers())]
    }

    /// Two states; GO goes to the other. To stay in the second pays 1.
    struct Given {
        values: One<Array>,
        transitions: One<Array>,
        rewards: One<Array>,
        policy: One<Array>,
    }

    fn given() -> Given {
        let [state, action, next] = dims();
        let table = |values: [f64; 4]| {
            One(Array { dims: vec![state.clone(), action.clone()], values: values.to_vec() })
        };
        let transitions = vec![1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
        Given {
            values: One(Array::series(state.clone(), vec![2.0, 4.0])),
            transitions: One(Array {
                dims: vec![state.clone(), action.clone(), next],
                values: transitions,
            }),
            rewards: table([0.0, 0.0, 1.0, 0.0]),
            policy: table([0.5, 0.5, 1.0, 0.0]),
        }
    }

    fn implicit(n: usize) -> Array {
        let Given { values, transitions, rewards, policy } = given();
        let op = ImplicitValues { values, transitions, rewards, policy, n, discount: 0.5 };
        op.run(&CTX).unwrap()
    }

    #[test]
    fn members_by_hand() {
        // v^1: ½(½·2 + ½·4) = 1.5 and 1 + ½·4 = 3; v^2: ½(½·1.5 + ½·3) and 1 + ½·3.
        assert_eq!(implicit(2).values, [2.0, 4.0, 1.5, 3.0, 1.125, 2.5]);
        // After no step it is the value; after many, that of the policy in the model: 2/3 and 2.
        assert_eq!(implicit(0).values, [2.0, 4.0]);
        let late = implicit(60).values;
        assert!((late[120] - 2.0 / 3.0).abs() < 1e-12 && (late[121] - 2.0).abs() < 1e-12);
    }

    #[test]
    fn optimal_and_action_members_by_hand() {
        let Given { values, transitions, rewards, .. } = given();
        let op = ImplicitOptimalValues { values, transitions, rewards, n: 1, discount: 0.5 };
        assert_eq!(op.run(&CTX).unwrap().values, [2.0, 4.0, 2.0, 3.0]);

        let Given { values, transitions, rewards, policy } = given();
        let op = ImplicitActionValues { values, transitions, rewards, policy, n: 2, discount: 0.5 };
        let found = op.run(&CTX).unwrap();
        assert_eq!(
            found.dims.iter().map(|d| d.name.as_str()).collect::<Vec<_>>(),
            ["k", "state", "action"]
        );
        assert_eq!(found.dims[0].labels, Labels::Numbers(vec![1.0, 2.0]));
        assert_eq!(found.values, [1.0, 2.0, 3.0, 1.0, 0.75, 1.5, 2.5, 0.75]);
    }

    #[test]
    fn rollouts_come_to_the_exact_members() {
        let exact = implicit(3).values;
        for independent in [false, true] {
            let Given { values, transitions, rewards, policy } = given();
            let (n, discount, rollouts) = (3, 0.5, 4000);
            let op = SampledValues {
                values,
                transitions,
                rewards,
                policy,
                n,
                discount,
                rollouts,
                independent,
            };
            let found = op.run(&CTX).unwrap().values;
            let apart = found.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // The standard deviation of a draw is below 1.
            assert!(apart < 0.06, "{apart}");
        }
    }

    #[test]
    fn what_is_over_something_else_is_refused() {
        let Given { values, transitions, rewards, policy } = given();
        let swapped = ImplicitValues {
            values,
            transitions: rewards.clone(),
            rewards: transitions,
            policy,
            n: 1,
            discount: 0.5,
        };
        let why = swapped.run(&CTX).unwrap_err().to_string();
        assert_eq!(why, "the rewards are not over `state` and `action`");
    }
}
