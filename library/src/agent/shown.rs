//! Steps of demonstrations, to be learned from again and again.

use ivx_data::{Demonstrations, End, Values};
use ivx_nn::{Graph, Shape, Var};
use ivx_op::OpError;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::agent::seen_shape;

/// The steps of demonstrations of which is known what was done next, or that an episode was over then.
#[derive(Debug)]
pub(super) struct Shown<'a> {
    of: &'a Demonstrations,
    steps: Vec<Known>,
}

#[derive(Clone, Copy, Debug)]
struct Known {
    /// The row of what was seen before it.
    row: usize,
    /// What was done, and then; 0 where the episode was over.
    acts: [u32; 2],
    is_last: bool,
    whose: usize,
    episode: usize,
}

/// Some steps, drawn evenly with replacement, those of one demonstrator after those of another.
#[derive(Clone, Debug, Default)]
pub(super) struct Drawn {
    /// The rows of what was seen before each, and after it.
    pub(super) rows: Vec<usize>,
    pub(super) next: Vec<usize>,
    /// What was done, and what next.
    pub(super) acts: Vec<f32>,
    pub(super) next_acts: Vec<f32>,
    /// 1, or 0 where the episode was over.
    pub(super) goes_on: Vec<f32>,
    /// How many there are of each demonstrator.
    pub(super) counts: Vec<usize>,
    /// Which episode each is of.
    pub(super) episodes: Vec<usize>,
}

impl<'a> Shown<'a> {
    /// Those of all demonstrations, of which the last of an episode that was cut off is left out.
    pub(super) fn new(of: &'a Demonstrations) -> Result<Self, OpError> {
        let Values::Index(acts) = of.paths.acts.values(0) else {
            unreachable!("they are discrete")
        };
        let mut steps = Vec::new();
        for (episode, ((seen, done, n, end), &whose)) in of.paths.each().zip(&of.whose).enumerate()
        {
            let is_last = |t: usize| t + 1 == n;
            let known = (0..n).filter(|&t| !is_last(t) || end == End::Terminal).map(|t| Known {
                row: seen + t,
                acts: [acts[done + t], if is_last(t) { 0 } else { acts[done + t + 1] }],
                is_last: is_last(t),
                whose,
                episode,
            });
            steps.extend(known);
        }
        if steps.is_empty() {
            return Err(OpError::Failed("there are no steps to learn from".to_owned()));
        }
        Ok(Self { of, steps })
    }

    /// How many demonstrators there are.
    pub(super) fn n_whose(&self) -> usize {
        self.of.names.len()
    }

    /// Draws `n` steps.
    #[expect(clippy::cast_precision_loss, reason = "actions are few")]
    pub(super) fn draw(&self, n: usize, rng: &mut ChaCha8Rng, drawn: &mut Drawn) {
        let mut places: Vec<usize> =
            (0..n).map(|_| rng.random_range(0..self.steps.len())).collect();
        places.sort_by_key(|place| self.steps[*place].whose);
        let Drawn { rows, next, acts, next_acts, goes_on, counts, episodes } = drawn;
        let each = || places.iter().map(|place| self.steps[*place]);
        rows.clear();
        next.clear();
        acts.clear();
        next_acts.clear();
        goes_on.clear();
        counts.clear();
        episodes.clear();
        episodes.extend(each().map(|step| step.episode));
        rows.extend(each().map(|step| step.row));
        next.extend(each().map(|step| step.row + 1));
        acts.extend(each().map(|step| step.acts[0] as f32));
        next_acts.extend(each().map(|step| step.acts[1] as f32));
        goes_on.extend(each().map(|step| if step.is_last { 0.0 } else { 1.0 }));
        counts.resize(self.of.names.len(), 0);
        each().for_each(|step| counts[step.whose] += 1);
    }

    /// What was seen in some rows, as a network sees it.
    pub(super) fn look(&self, graph: &Graph<f32>, rows: &[usize]) -> Var {
        let seen = &self.of.paths.seen;
        graph.filled(seen_shape(seen.fields(), rows.len()), |out| seen.spread_rows(rows, out))
    }
}

/// One number an item.
pub(super) fn column(graph: &Graph<f32>, values: &[f32]) -> Var {
    graph.input(Shape::vectors(values.len(), 1), values)
}

#[cfg(test)]
mod tests {
    use super::super::strolls;
    use super::*;
    use rand::SeedableRng as _;

    #[test]
    fn what_was_done_next_is_known_but_for_what_was_cut_off() {
        // States 1, 0, 1, 2 by actions 0, 1, 1: one ends, and one is cut off.
        let mut paths = strolls(2).trajectories();
        paths.episodes[1].1 = End::Limit;
        let names = vec!["a".to_owned(), "b".to_owned()];
        let of = Demonstrations { paths, names, whose: vec![1, 0] };
        let shown = Shown::new(&of).unwrap();
        let (mut rng, mut drawn) = (ChaCha8Rng::seed_from_u64(1), Drawn::default());
        shown.draw(500, &mut rng, &mut drawn);
        let first = drawn.counts[0];
        assert_eq!(drawn.counts.iter().sum::<usize>(), 500);
        assert!(drawn.rows[..first].iter().all(|row| [4, 5].contains(row)));
        assert!(drawn.rows[first..].iter().all(|row| [0, 1, 2].contains(row)));
        assert!((150..250).contains(&first), "{first}");
        assert_eq!(drawn.episodes, [vec![1; first], vec![0; 500 - first]].concat());
        for i in 0..500 {
            let step = (drawn.acts[i], drawn.next_acts[i], drawn.goes_on[i]);
            let expected = [(0.0, 1.0, 1.0), (1.0, 1.0, 1.0), (1.0, 0.0, 0.0)][drawn.rows[i] % 4];
            assert_eq!((step, drawn.next[i]), (expected, drawn.rows[i] + 1));
        }
        let graph = Graph::new(ivx_nn::Params::default());
        assert_eq!(graph.value(shown.look(&graph, &[3, 0])), [0.0, 0.0, 1.0, 0.0, 1.0, 0.0]);
    }
}
