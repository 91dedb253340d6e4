//! What agents have learned of others, beside what is true.

use ivx_data::form::failed;
use ivx_data::{Columns, Demonstrations, Rollouts, Values, same_world};
use ivx_math::detect::pearson;
use ivx_nn::Live;
use ivx_op::{Array, Ctx, Dim, Labels, One, Op, OpError, declare};
use ivx_world::{Acts, Env, Luck, Row};

use super::agent::{Acting, Agent, Choice};
use super::demonstrate::seen_before;
use super::features::{cumulants, preferences};
use super::improve::{Improving, Values as Worth};

declare! {
    /// How often an agent is right about what each demonstrator does: the share of steps at which the action that it
    /// thinks best for that demonstrator is the one that was taken (§4.3.3).
    ///
    /// An agent that learned by `itd` or `psi_phi` knows demonstrators by what they are called (Eqn. 4.19, on average over
    /// members); any other says the same of all.
    pub struct Imitation = "imitation" @ 1 -> Array [whose] {
        /// The agent.
        of: One<Agent>;
        /// What was done.
        on: One<Demonstrations>;
    }
}

/// How many steps are looked at together.
const AT_ONCE: usize = 1024;

impl Op for Imitation {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        let (agent, shown) = (&*self.of, &*self.on);
        let own = (&agent.spec.sees[..], &agent.spec.does);
        same_world("the agent knows", own, (shown.paths.seen.fields(), &shown.paths.does))
            .map_err(failed)?;
        let Values::Index(acts) = shown.paths.acts.values(0) else {
            return Err(OpError::Failed("the actions are no places".to_owned()));
        };
        let rows = seen_before(shown);
        let whose = shown.paths.each().zip(&shown.whose);
        let whose: Vec<usize> = whose.flat_map(|((_, _, n, _), k)| vec![*k; n]).collect();
        let mut shares = Vec::new();
        for (k, name) in shown.names.iter().enumerate() {
            let mut actor = guessing(agent, name)?;
            let places: Vec<usize> = (0..rows.len()).filter(|i| whose[*i] == k).collect();
            let mut right = 0;
            for places in places.chunks(AT_ONCE) {
                let mut seen = Columns::zeros(agent.spec.sees.clone(), places.len());
                let each = places.iter().enumerate();
                each.for_each(|(at, i)| seen.set(at, &shown.paths.seen, rows[*i]));
                let mut found = Acts::of(&agent.spec.does, places.len());
                actor.act(&seen, &mut ctx.rng("guess", &[]), &mut found)?;
                let pairs = places.iter().zip(&found.places);
                right += pairs.filter(|(i, found)| acts[**i] as usize == **found).count();
            }
            let of = ivx_math::moments::real;
            shares.push(of(right) / of(places.len()));
        }
        Ok(Array::series(Dim::new("whose", Labels::Names(shown.names.clone())), shares))
    }
}

/// Who does what an agent thinks that a demonstrator does.
fn guessing(agent: &Agent, name: &str) -> Result<Box<dyn Acting>, OpError> {
    match agent.acts {
        Choice::Improved(_) | Choice::Imitated(_) => {
            let whose = super::actor::known(agent, name).map_err(failed)?;
            let values = Worth::imitated(agent, whose);
            Ok(Box::new(Improving::new(vec![vec![values]], Box::new(ivx_math::moments::mean))))
        }
        Choice::Sampled => Ok(Agent { acts: Choice::Likeliest, ..agent.clone() }.open()),
        _ => Ok(agent.open()),
    }
}

declare! {
    /// What each demonstrator prefers, by cumulant, as an agent has learned it (Eqn. 4.7).
    pub struct LearnedPreferences = "learned_preferences" @ 1 -> Array [whose, cumulant] {
        /// An agent that learned by `itd` or `psi_phi`.
        of: One<Agent>;
    }
}

impl Op for LearnedPreferences {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        explains(&self.of)?;
        let weights = (1..=self.of.knows.len()).map(|k| {
            let (.., w) = self.of.nets.array(&preferences(k)).expect("one knows of each");
            w.iter().map(|x| f64::from(*x))
        });
        let values: Vec<f64> = weights.flatten().collect();
        let names = self.of.knows.clone();
        let width = values.len() / names.len();
        let dims = vec![Dim::new("whose", Labels::Names(names)), numbered("cumulant", width)];
        Ok(Array { dims, values })
    }
}

fn numbered(name: &str, n: usize) -> Dim {
    Dim::new(name, Labels::Numbers((1..=n).map(ivx_math::moments::real).collect()))
}

/// Whether an agent has cumulants.
fn explains(agent: &Agent) -> Result<(), OpError> {
    let message = "the agent has no cumulants: use one that learned by `itd` or `psi_phi`";
    let fails = || OpError::Failed(message.to_owned());
    matches!(agent.acts, Choice::Improved(_) | Choice::Imitated(_)).then_some(()).ok_or_else(fails)
}

declare! {
    /// How well the cumulants of an agent are what a world tells of each step, such as coins of each colour: the size of
    /// the correlation over steps, of the cumulant that each is matched with. No two are matched with one, and the sum is
    /// the highest that can be.
    ///
    /// Of what never changed, or has no cumulant left, it is 0.
    pub struct MatchedCumulants = "matched_cumulants" @ 1 -> Array [told] {
        /// An agent that learned by `itd` or `psi_phi`.
        of: One<Agent>;
        /// Episodes.
        on: One<Rollouts>;
    }
}

impl Op for MatchedCumulants {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        explains(&self.of)?;
        let (agent, on) = (&*self.of, &*self.on);
        let own = (&agent.spec.sees[..], &agent.spec.does);
        same_world("the agent knows", own, (on.paths.seen.fields(), &on.paths.does))
            .map_err(failed)?;
        let Values::Index(acts) = on.paths.acts.values(0) else { unreachable!("the agent's are") };
        let live = Live::of(&agent.nets);
        let rows: Vec<usize> =
            on.paths.each().flat_map(|(seen, _, steps, _)| seen..seen + steps).collect();
        let mut phi: Vec<f64> = Vec::new();
        for (rows, acts) in rows.chunks(AT_ONCE).zip(acts.chunks(AT_ONCE)) {
            let mut seen = Columns::zeros(agent.spec.sees.clone(), rows.len());
            rows.iter().enumerate().for_each(|(at, row)| seen.set(at, &on.paths.seen, *row));
            let acts: Vec<usize> = acts.iter().map(|act| *act as usize).collect();
            live.graph.begin();
            let found = cumulants(&live, &seen, &acts);
            phi.extend(live.graph.value(found).into_iter().map(f64::from));
        }
        let n = rows.len().max(1);
        let (width, told) = (phi.len() / n, on.tells.len());
        let column = |of: &[f64], i: usize, width: usize| -> Vec<f64> {
            of.iter().skip(i).step_by(width).copied().collect()
        };
        let facts: Vec<f64> = on.told.iter().map(|x| f64::from(*x)).collect();
        let sizes: Vec<Vec<f64>> = (0..told)
            .map(|j| {
                let fact = column(&facts, j, told);
                (0..width).map(|i| size(&column(&phi, i, width), &fact)).collect()
            })
            .collect();
        let told = Dim::new("told", Labels::Names(on.tells.clone()));
        Ok(Array::series(told, matched(&sizes)))
    }
}

declare! {
    /// What an agent thinks that entering each cell of a world's grid means, cumulant by cumulant (Figs. 4.7, B.6): the
    /// mean over the ways into a cell at the start of an episode, the first of those in which `evaluate` lets an agent
    /// act on the same seed, which `scene` shows. Cells that nothing enters are 0.
    ///
    /// The thesis has a number a square and does not say of which action; that the square is entered is ours.
    pub struct CumulantMap = "cumulant_map" @ 1, stochastic -> Array [cumulant, row, column] {
        /// An agent that learned by `itd` or `psi_phi`.
        of: One<Agent>;
        /// The world.
        r#in: Box<dyn Env>;
    }
}

impl Op for CumulantMap {
    fn run(&self, ctx: &Ctx) -> Result<Array, OpError> {
        explains(&self.of)?;
        let spec = self.r#in.spec().map_err(failed)?;
        self.of.spec.same(&spec).map_err(failed)?;
        let mut world = self.r#in.open()?;
        let (mut seen, mut told) = (Columns::zeros(spec.sees, 1), vec![0.0; spec.tells.len()]);
        world.reset(&mut Luck::of(ctx, "evaluate", 0, 0), &mut Row::of(&mut seen, 0, &mut told));
        let Some(entries) = world.entries() else {
            return Err(OpError::Failed(
                "this world is no grid of cells that are entered".to_owned(),
            ));
        };
        let live = Live::of(&self.of.nets);
        live.graph.begin();
        let phi = live.graph.value(cumulants(&live, &entries.seen, &entries.acts));
        let (n, [rows, columns]) = (entries.acts.len(), entries.sides);
        let width = phi.len() / n;
        let mut values = vec![0.0; width * rows * columns];
        for (cell, phi) in entries.cells.iter().zip(phi.chunks_exact(width)) {
            let ways = entries.cells.iter().filter(|other| *other == cell).count();
            for (i, x) in phi.iter().enumerate() {
                values[i * rows * columns + cell] += f64::from(*x) / ivx_math::moments::real(ways);
            }
        }
        let dims =
            vec![numbered("cumulant", width), numbered("row", rows), numbered("column", columns)];
        Ok(Array { dims, values })
    }
}

/// The size of a correlation; 0 where one of the two never changes.
fn size(x: &[f64], y: &[f64]) -> f64 {
    let found = pearson(x, y);
    if found.is_nan() { 0.0 } else { found.abs() }
}

/// Of each row its number in the column that it is matched with, where the sum of these is the highest; 0 without one
/// (Kuhn, 1955).
fn matched(sizes: &[Vec<f64>]) -> Vec<f64> {
    let rows = sizes.len();
    // A row without a column has one of its own, which is worth nothing.
    let columns = sizes.first().map_or(0, Vec::len) + rows;
    let cost = |row: usize, column: usize| -sizes[row].get(column).copied().unwrap_or(0.0);
    // Rows and columns are counted from 1; column 0 is where a row waits.
    let (mut of_row, mut of_column) = (vec![0.0; rows + 1], vec![0.0; columns + 1]);
    let (mut taken, mut before) = (vec![0; columns + 1], vec![0; columns + 1]);
    for row in 1..=rows {
        taken[0] = row;
        let (mut at, mut least) = (0, vec![f64::INFINITY; columns + 1]);
        let mut seen = vec![false; columns + 1];
        while taken[at] != 0 {
            seen[at] = true;
            let (own, mut step, mut next) = (taken[at], f64::INFINITY, 0);
            for column in (1..=columns).filter(|column| !seen[*column]) {
                let left = cost(own - 1, column - 1) - of_row[own] - of_column[column];
                if left < least[column] {
                    (least[column], before[column]) = (left, at);
                }
                if least[column] < step {
                    (step, next) = (least[column], column);
                }
            }
            for column in 0..=columns {
                if seen[column] {
                    of_row[taken[column]] += step;
                    of_column[column] -= step;
                } else {
                    least[column] -= step;
                }
            }
            at = next;
        }
        while at != 0 {
            taken[at] = taken[before[at]];
            at = before[at];
        }
    }
    let mut found = vec![0.0; rows];
    for column in (1..=columns).filter(|column| taken[*column] != 0) {
        found[taken[column] - 1] = -cost(taken[column] - 1, column - 1);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_match_is_that_of_all_together() {
        // The first row would take the first column, which the second needs more.
        assert_eq!(matched(&[vec![0.9, 0.8], vec![0.9, 0.1]]), [0.8, 0.9]);
        assert_eq!(matched(&[vec![0.3], vec![0.5], vec![0.4]]), [0.0, 0.5, 0.0]);
        assert_eq!(matched(&[]), [0.0; 0]);
        // Many of both.
        let big: Vec<Vec<f64>> =
            (0..60).map(|i| (0..90).map(|j| f64::from((i * 7 + j * 13) % 97)).collect()).collect();
        let sum: f64 = matched(&big).iter().sum();
        assert!(sum > 60.0 * 90.0, "{sum}");
    }

    #[test]
    fn correlations_by_hand() {
        assert_eq!(size(&[1.0, 2.0, 3.0], &[-2.0, -4.0, -6.0]), 1.0);
        assert_eq!(size(&[1.0, 1.0], &[0.0, 1.0]), 0.0);
        // Deviations (-1, 1, -1, 1)/2 and (-1, 3, -1, -1)/4: 1 over √(1 · ¾).
        let found = size(&[0.0, 1.0, 0.0, 1.0], &[0.0, 1.0, 0.0, 0.0]);
        assert!((found - (1.0_f64 / 3.0).sqrt()).abs() < 1e-15, "{found}");
    }
}
