//! Acting by generalised policy improvement (Theorem 4.1).

use ivx_data::Columns;
use ivx_math::successor::select_action;
use ivx_nn::{Live, Var};
use ivx_op::OpError;
use ivx_world::Acts;
use rand_chacha::ChaCha8Rng;

use super::agent::{Acting, Agent, Choice, look, shared};
use super::features::{policies, preferences};

/// What an agent says that each of some policies is worth.
pub(super) struct Values {
    live: Live,
    /// The names of networks, of each policy one a member.
    nets: Vec<Vec<String>>,
    /// The preferences by which features are valued, where networks put out such and not values.
    by: Option<String>,
    /// Of each row `[K, M, A]`.
    said: Vec<f64>,
}

impl Values {
    /// Of the agent's own task, by each policy that it has values or features of; `None` if it has none.
    pub(super) fn of(agent: &Agent) -> Self {
        let (nets, by) = match agent.acts {
            Choice::Improved(_) => (policies(&agent.nets), Some(preferences(0))),
            Choice::Imitated(k) => return Self::imitated(agent, k),
            _ => (vec![vec!["q".to_owned()]], None),
        };
        Self { live: Live::of(&agent.nets), nets, by, said: Vec::new() }
    }

    /// Of the task of a demonstrator, counted from 1, by its own policy.
    pub(super) fn imitated(agent: &Agent, k: usize) -> Self {
        let all = policies(&agent.nets);
        // Where the agent has features of its own, they come first.
        let nets = vec![all[all.len() - agent.knows.len() + k - 1].clone()];
        let live = Live::of(&agent.nets);
        Self { live, nets, by: Some(preferences(k)), said: Vec::new() }
    }

    /// How many policies there are, and how many members each has.
    pub(super) fn sizes(&self) -> (usize, usize) {
        (self.nets.len(), self.nets[0].len())
    }

    /// What all are worth, of each row `[K, M, A]`.
    pub(super) fn ask(&mut self, seen: &Columns) -> &[f64] {
        let Self { live, nets, by, said } = self;
        live.graph.begin();
        let z = live.graph.still(|| shared(live, look(live, seen)));
        worth(live, nets, by.as_deref(), z, said);
        said
    }
}

/// What policies are worth by some preferences (Eqn. 4.9b), of each row `[K, M, A]`.
///
/// - `nets`: the networks of each policy, of features where there are preferences and else of values.
/// - `z`: what they see.
pub(super) fn worth(
    live: &Live,
    nets: &[Vec<String>],
    by: Option<&str>,
    z: Var,
    said: &mut Vec<f64>,
) {
    let graph = &live.graph;
    let (mut read, width) = (Vec::new(), nets.iter().map(Vec::len).sum::<usize>());
    for (place, name) in nets.iter().flatten().enumerate() {
        let values = graph.still(|| match by {
            Some(w) => graph.contract(live.pass(name, z), live.array(w)),
            None => live.pass(name, z),
        });
        graph.read(values, &mut read);
        let n_actions = graph.shape(values).width();
        said.resize(width * read.len(), 0.0);
        let rows = said.chunks_exact_mut(width * n_actions);
        for (row, values) in rows.zip(read.chunks_exact(n_actions)) {
            let own = row[place * n_actions..].iter_mut().zip(values);
            own.for_each(|(x, value)| *x = f64::from(*value));
        }
    }
}

/// Reduces what members say to one number.
pub(super) type Reduce<'a> = Box<dyn Fn(&[f64]) -> f64 + 'a>;

/// Who takes the action that is worth most by the policy that is worth most after it, where what members say of a policy
/// is reduced to one number (Eqn. 4.23).
pub(super) struct Improving<'a> {
    /// Policies, or several at once; of each what its members say.
    of: Vec<Vec<Values>>,
    reduce: Reduce<'a>,
}

impl<'a> Improving<'a> {
    pub(super) fn new(of: Vec<Vec<Values>>, reduce: Reduce<'a>) -> Self {
        Self { of, reduce }
    }
}

impl Acting for Improving<'_> {
    fn act(&mut self, seen: &Columns, _: &mut ChaCha8Rng, acts: &mut Acts) -> Result<(), OpError> {
        let n = seen.len();
        // Of each row `[K, A]`.
        let mut reduced: Vec<Vec<f64>> = vec![Vec::new(); n];
        for members in &mut self.of {
            let (n_policies, n_own) = members[0].sizes();
            let said: Vec<&[f64]> = members.iter_mut().map(|values| values.ask(seen)).collect();
            let n_actions = said[0].len() / (n * n_policies * n_own);
            for (row, reduced) in reduced.iter_mut().enumerate() {
                for (k, a) in (0..n_policies).flat_map(|k| (0..n_actions).map(move |a| (k, a))) {
                    let at = |m: usize| ((row * n_policies + k) * n_own + m) * n_actions + a;
                    let of = said.iter().flat_map(|said| (0..n_own).map(move |m| said[at(m)]));
                    reduced.push((self.reduce)(&of.collect::<Vec<f64>>()));
                }
            }
        }
        for (place, values) in acts.places.iter_mut().zip(&reduced) {
            *place = best(values, (self.n_policies(), 1), &|said| said[0]);
        }
        Ok(())
    }
}

impl Improving<'_> {
    fn n_policies(&self) -> usize {
        self.of.iter().map(|members| members[0].nets.len()).sum()
    }
}

/// The action that is selected by the values `[K, M, A]` of a row.
pub(super) fn best(values: &[f64], sizes: (usize, usize), reduce: &dyn Fn(&[f64]) -> f64) -> usize {
    select_action(values, sizes, reduce).action
}
