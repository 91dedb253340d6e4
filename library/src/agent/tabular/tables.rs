//! Learning with a number for everything, by gradient descent (§C.2.1).

use ivx_data::{Rollouts, Walks};
use ivx_math::moments::real;
use ivx_math::tabular::probabilities;
use ivx_nn::optim::Pull;
use ivx_nn::{Graph, Live, Networks, Optimiser, ParamId, Real as _, Rule, Turns, Var};
use ivx_op::{Array, Ctx, Dim, One, Op, OpError, Part, declare};
use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};

use super::loss::{Steps, expected_sarsa_loss, reward_loss, transition_loss};

macro_rules! tables {
    ($($(#[doc = $doc:literal])+ $ty:ident = $name:literal [$($dim:ident),+] { $($own:tt)* })+) => {$(
        declare! {
            $(#[doc = $doc])+
            pub struct $ty = $name @ 1, stochastic -> Array [$($dim),+] {
                /// The episodes.
                from: One<Rollouts>;
                $($own)*
                /// How the loss is lowered.
                optimiser: Box<dyn Optimiser> = Part::new("adam")
                    .with("lr", Part::new("constant").with("value", 5e-3));
                /// How often it goes through the steps.
                epochs: u64 = 500, in 0.0..;
                /// How many steps an update looks at; 0 for all.
                batch: usize = 128, in 0.0..;
                /// Which member of an ensemble it is, told apart by where it starts (Remark 2.7).
                member: usize = 0, in 0.0..;
                /// And by its own resample of the steps, as many with replacement.
                bootstrap: bool = false;
            }
            rule super::from_is_walked;
        }

        impl $ty {
            fn learning<'a>(&'a self, from: &'a Walks) -> Learning<'a> {
                Learning {
                    from,
                    optimiser: &*self.optimiser,
                    epochs: self.epochs,
                    batch: self.batch,
                    member: self.member,
                    bootstrap: self.bootstrap,
                }
            }
        }
    )+};
}

tables! {
    /// Action values learned by expected SARSA (Eqn. 2.44): `Σ_a' π(a' | s') q(s', a')` is what follows.
    ///
    /// They start from a normal distribution, and an update lowers the mean squared error of a batch of steps,
    /// whose targets have no gradient. What was never tried stays where it started.
    TabularValues = "tabular_values" [state, action] {
        /// The policy whose values they are.
        policy: One<Array>;
        /// What a reward one step later is worth.
        discount: f64 = 0.99, in 0.0..=1.0;
    }

    /// The probabilities of the states that follow each action, learned by maximum likelihood (Eqn. 2.51) as the
    /// logits of a softmax, which start from a normal distribution.
    TabularModel = "tabular_model" [state, action, next] {}

    /// The reward of each action in each state, learned by maximum likelihood with Gaussian noise (Eqn. 2.51) from
    /// a normal distribution on.
    TabularRewards = "tabular_rewards" [state, action] {}
}

impl Op for TabularValues {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        let walks = self.from.walks()?;
        let dims = walks.pairs();
        if self.policy.dims != dims {
            let why = "the policy is not over `state` and `action` of the episodes' environment";
            return Err(OpError::Failed(why.to_owned()));
        }
        let policy = self.policy.values.iter().map(|p| f32::of(*p)).collect();
        let loss = |graph: &Graph<f32>, tables: [ParamId; 2], steps: &Steps<f32>| {
            expected_sarsa_loss(graph, tables, self.discount, steps)
        };
        let shape = [walks.n_states, walks.actions.len()];
        let values = self.learning(&walks).table(shape, policy, ctx, loss)?;
        Ok(Array { dims, values })
    }
}

impl Op for TabularModel {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        let walks = self.from.walks()?;
        let (n, width) = (walks.n_states, walks.actions.len());
        let loss = |graph: &Graph<f32>, [table, _]: [ParamId; 2], steps: &Steps<f32>| {
            transition_loss(graph, table, steps)
        };
        let logits = self.learning(&walks).table([n * width, n], Vec::new(), ctx, loss)?;
        let mut dims = walks.pairs();
        dims.push(Dim::new("next", dims[0].labels.clone()));
        Ok(Array { dims, values: probabilities(&logits, n) })
    }
}

impl Op for TabularRewards {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        let loss = |graph: &Graph<f32>, [table, _]: [ParamId; 2], steps: &Steps<f32>| {
            reward_loss(graph, table, steps)
        };
        let walks = self.from.walks()?;
        let n_pairs = walks.n_states * walks.actions.len();
        let values = self.learning(&walks).table([n_pairs, 1], Vec::new(), ctx, loss)?;
        Ok(Array { dims: walks.pairs(), values })
    }
}

/// How a table is learned.
struct Learning<'a> {
    from: &'a Walks,
    optimiser: &'a dyn Optimiser,
    epochs: u64,
    batch: usize,
    member: usize,
    bootstrap: bool,
}

impl Steps<f32> {
    fn of(walks: &Walks) -> Self {
        let mut all = Self::default();
        for e in &walks.episodes {
            for (t, (&action, &reward)) in e.actions.iter().zip(&e.rewards).enumerate() {
                let ends = e.ended && t + 1 == e.actions.len();
                let pair = e.states[t] * walks.actions.len() + action;
                all.states.push(f32::of(real(e.states[t])));
                all.actions.push(f32::of(real(action)));
                all.pairs.push(f32::of(real(pair)));
                all.rewards.push(f32::of(reward));
                all.next.push(f32::of(real(e.states[t + 1])));
                all.goes_on.push(if ends { 0.0 } else { 1.0 });
            }
        }
        all
    }

    fn len(&self) -> usize {
        self.states.len()
    }

    /// Replaces these by those of `all` at some places.
    fn take(&mut self, all: &Self, places: &[usize]) {
        let columns = [
            (&mut self.states, &all.states),
            (&mut self.actions, &all.actions),
            (&mut self.pairs, &all.pairs),
            (&mut self.rewards, &all.rewards),
            (&mut self.next, &all.next),
            (&mut self.goes_on, &all.goes_on),
        ];
        for (own, all) in columns {
            own.clear();
            own.extend(places.iter().map(|place| all[*place]));
        }
    }
}

impl Learning<'_> {
    /// A table of this shape after training on the steps of the episodes. The loss is told where it lies, and where
    /// the rows `given` do, which are not learned.
    fn table(
        &self,
        shape: [usize; 2],
        given: Vec<f32>,
        ctx: &Ctx,
        loss: impl Fn(&Graph<f32>, [ParamId; 2], &Steps<f32>) -> Var,
    ) -> Result<Vec<f64>, OpError> {
        let member = self.member.to_string();
        let mut all = Steps::of(self.from);
        let n = all.len();
        if n == 0 {
            return Err(OpError::Failed("there are no steps to learn from".to_owned()));
        }
        if self.bootstrap {
            let mut rng = ctx.rng("bootstrap", &[&member]);
            let places: Vec<usize> = (0..n).map(|_| rng.random_range(0..n)).collect();
            let mut resampled = Steps::default();
            resampled.take(&all, &places);
            all = resampled;
        }
        let mut init = ctx.rng("init", &[&member]);
        let start = (0..shape[0] * shape[1]).map(|_| StandardNormal.sample(&mut init)).collect();
        let rows = vec![given.len() / shape[1], shape[1]];
        let arrays =
            vec![("given".to_owned(), rows, given), ("table".to_owned(), shape.to_vec(), start)];
        let mut live = Live::of(&Networks { arrays, ..Networks::default() });
        let place = |name| live.group(&[name])[0];
        let tables = [place("table"), place("given")];

        let mut turns = Turns::new(n, self.batch);
        let steps = self.epochs.saturating_mul(turns.in_a_pass());
        let rule = Rule { optimiser: self.optimiser, pull: Pull::NONE, steps };
        let mut shown = Steps::default();
        ivx_nn::descend(&mut live, &["table"], rule, ctx, |live, t| {
            if turns.are_whole() {
                return loss(&live.graph, tables, &all);
            }
            shown.take(&all, turns.turn(t, ctx));
            loss(&live.graph, tables, &shown)
        })?;
        let params = live.graph.params();
        let values: Vec<f64> = params.value(tables[0]).iter().map(|x| f64::from(*x)).collect();
        if values.iter().any(|x| !x.is_finite()) {
            let message = format!("it diverged within {steps} updates: lower the learning rate");
            return Err(OpError::Failed(message));
        }
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{PolicyValues, UniformPolicy, walked};
    use super::*;
    use ivx_math::bellman::expected_values;
    use ivx_math::tabular::{Transition, most_likely, transition_counts};
    use ivx_nn::{Adam, Constant, Linear, Schedule};
    use ivx_world::{Chain, Env};

    const CTX: Ctx = Ctx::new("tabular", 3, None);

    fn chain() -> Box<dyn Env> {
        Box::new(Chain { cells: 4, slip: 0.25, goal: true })
    }

    fn even() -> One<Array> {
        One(UniformPolicy { r#in: chain() }.run(&CTX).unwrap())
    }

    fn walks(episodes: usize) -> One<Rollouts> {
        One(walked(even(), chain(), (episodes, "main")))
    }

    fn adam(lr: Box<dyn Schedule>) -> Box<dyn Optimiser> {
        Box::new(Adam { lr, beta1: 0.9, beta2: 0.999, eps: 1e-8 })
    }

    fn falling() -> Box<dyn Optimiser> {
        adam(Box::new(Linear { from: 0.05, to: 0.0 }))
    }

    fn values(from: One<Rollouts>, epochs: u64, member: usize, bootstrap: bool) -> Vec<f64> {
        let (policy, discount, batch, optimiser) = (even(), 0.9, 64, falling());
        let op =
            TabularValues { from, policy, discount, optimiser, epochs, batch, member, bootstrap };
        op.run(&CTX).unwrap().values
    }

    fn model(from: One<Rollouts>, epochs: u64) -> Vec<f64> {
        let (batch, member, bootstrap, optimiser) = (64, 0, false, falling());
        TabularModel { from, optimiser, epochs, batch, member, bootstrap }.run(&CTX).unwrap().values
    }

    fn most(errors: impl Iterator<Item = f64>) -> f64 {
        errors.map(f64::abs).fold(0.0, f64::max)
    }

    #[test]
    fn expected_sarsa_finds_the_values_of_the_policy() {
        let mdp = ivx_world::mdp(&*chain()).unwrap();
        let truth = PolicyValues { policy: even(), r#in: chain(), discount: 0.9 };
        let truth = truth.run(&CTX).unwrap().values;
        let apart = |epochs| {
            let found = values(walks(400), epochs, 0, false);
            let states = |q: &[f64]| expected_values(&mdp.model(), &even().0.values, q);
            most(states(&found).iter().zip(states(&truth)).take(3).map(|(a, b)| a - b))
        };
        let (before, after) = (apart(0), apart(100));
        assert!(before > 0.5 && after < 0.05, "{before} {after}");
    }

    #[test]
    fn the_likeliest_model_is_found() {
        let from = walks(200);
        let walks = from.walks().unwrap();
        let steps = walks.episodes.iter().flat_map(|e| {
            (0..e.actions.len()).map(|t| Transition {
                state: e.states[t],
                action: e.actions[t],
                reward: e.rewards[t],
                next: e.states[t + 1],
                ended: false,
            })
        });
        let counts = transition_counts((4, 2), &steps.collect::<Vec<_>>());
        let before = model(from.clone(), 0);
        let likeliest = most_likely(&counts, &before, 4);
        let after = model(from, 300);
        let apart = most(after.iter().zip(&likeliest).take(24).map(|(a, b)| a - b));
        assert!(apart < 0.02, "{apart}");
        // From the goal nothing was ever tried.
        assert_eq!(after[24..], before[24..]);
    }

    #[test]
    fn rewards_are_what_was_received_on_average() {
        let (from, optimiser) = (walks(200), falling());
        let op =
            TabularRewards { from, optimiser, epochs: 100, batch: 0, member: 0, bootstrap: false };
        let found = op.run(&CTX).unwrap().values;
        let expected = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        assert!(most(found.iter().zip(expected).map(|(a, b)| a - b)) < 0.01, "{found:?}");
    }

    #[test]
    fn members_differ_by_where_they_start_and_what_they_see() {
        assert_ne!(values(walks(5), 0, 0, true), values(walks(5), 0, 1, true));
        assert_eq!(values(walks(5), 0, 1, true), values(walks(5), 0, 1, false));
        assert_ne!(values(walks(5), 3, 1, true), values(walks(5), 3, 1, false));
        assert_eq!(values(walks(5), 3, 1, true), values(walks(5), 3, 1, true));
    }

    #[test]
    fn what_cannot_be_learned_says_so() {
        let lr = Box::new(Constant { value: f64::MAX });
        let optimiser = adam(lr);
        let (batch, member, bootstrap, epochs) = (0, 0, false, 5);
        let op = TabularRewards { from: walks(5), optimiser, epochs, batch, member, bootstrap };
        assert!(op.run(&CTX).unwrap_err().to_string().contains("diverged"));
        let none = walks(0).0;
        let optimiser = falling();
        let op = TabularRewards { from: One(none), optimiser, epochs, batch, member, bootstrap };
        assert_eq!(op.run(&CTX).unwrap_err().to_string(), "there are no steps to learn from");
    }
}
