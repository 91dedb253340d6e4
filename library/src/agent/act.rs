//! Acting in worlds of any kind.

use ivx_data::form::{failed, wrong};
use ivx_data::{End, Field, Kind, Misfit, Rollouts, Trajectories, tell, told_by, world_shapes};
use ivx_math::moments::real;
use ivx_op::{
    Args, Array, Ctx, Dim, Facts, Labels, Literal as _, Needs, One, Op, OpError, Shapes, Wrong,
    declare,
};
use ivx_world::{Env, Spec, Step};

use super::actor::Actor;
use super::agent::Acting;
use super::drive::Drive;
use super::windows::{chosen, listed};

declare! {
    /// Episodes of somebody in a world (Eqn. 2.35).
    ///
    /// Fewer are the first of more. What chance decides in the world is drawn by the seed, the stream and the episode, so
    /// that all who are compared on one seed meet the same luck.
    pub struct Act = "act" @ 2, stochastic -> Rollouts {
        /// Who acts.
        actor: Box<dyn Actor>;
        /// The world.
        r#in: Box<dyn Env>;
        /// How many episodes.
        episodes: usize, in 0.0..=1e6;
        /// After so many steps an episode is cut off; 0 for when the world does.
        limit: u64 = 0, in 0.0..=1e9, unit "steps";
        /// Tells apart draws that must differ on one seed, such as training and test data.
        stream: String = "main";
        /// What is kept of what is seen, where that is not all: fields of the world by name.
        keeps: Vec<String> = Vec::<i64>::new();
    }
    rule acts_and_keeps;
    shapes of_world;
}

/// The rule that `actor` can act in the world `in`.
pub(super) fn acts(facts: &Facts<'_>) -> Result<(), Wrong> {
    match (facts.arg::<Box<dyn Actor>>("actor"), facts.arg::<Box<dyn Env>>("in")) {
        (Some(actor), Some(env)) => {
            let spec = env.spec().map_err(wrong("in"))?;
            actor.fits(&spec).map_err(wrong("actor"))
        }
        _ => Ok(()),
    }
}

/// The rule that somebody acts in a world, and that it shows what is to be kept.
fn acts_and_keeps(facts: &Facts<'_>) -> Result<(), Wrong> {
    acts(facts)?;
    let keeps: Vec<String> = facts.arg("keeps").unwrap_or_default();
    let Some(Ok(spec)) = facts.arg::<Box<dyn Env>>("in").map(|env| env.spec()) else {
        return Ok(());
    };
    kept(&spec, &keeps).map(drop).map_err(wrong("keeps"))
}

/// The places of the fields that are kept.
fn kept(spec: &Spec, keeps: &[String]) -> Result<Vec<usize>, Misfit> {
    match keeps {
        [] => Ok((0..spec.sees.len()).collect()),
        names => {
            if let Some(i) = (1..names.len()).find(|i| names[..*i].contains(&names[*i])) {
                let message = format!("`{}` is kept twice", names[i]);
                return Err(Misfit::new(message, "name it once"));
            }
            chosen(&spec.sees, names)
        }
    }
}

fn of_world(facts: &Facts<'_>) -> Option<Shapes> {
    let spec = facts.arg::<Box<dyn Env>>("in")?.spec().ok()?;
    let keeps = kept(&spec, &facts.arg::<Vec<String>>("keeps")?).ok()?;
    let mut shapes = world_shapes(&fields(&spec, &keeps), &spec.does);
    let actor = facts.arg::<Box<dyn Actor>>("actor")?;
    tell(&mut shapes, &tells(&spec, &*actor));
    Some(shapes)
}

/// The fields in some places, in their order.
fn fields(spec: &Spec, keeps: &[usize]) -> Vec<Field> {
    keeps.iter().map(|i| spec.sees[*i].clone()).collect()
}

/// What is told of a step: by the world, and by who acts.
fn tells(spec: &Spec, actor: &dyn Actor) -> Vec<String> {
    let own = actor.tells().iter().map(|name| (*name).to_owned());
    spec.tells.iter().cloned().chain(own).collect()
}

/// How many worlds somebody acts in at once.
const AT_ONCE: usize = 64;

/// How long an episode is thought to be that nobody cuts off.
const LONG: u64 = 1000;

impl Op for Act {
    fn run(&self, ctx: &Ctx) -> Result<Rollouts, OpError> {
        let spec = self.r#in.spec().map_err(failed)?;
        let mut actor = self.actor.open(&spec).map_err(failed)?;
        let keeps = kept(&spec, &self.keeps).map_err(failed)?;
        let tells = tells(&spec, &*self.actor);
        let none = || Trajectories::new(fields(&spec, &keeps), spec.does.clone());
        let mut all = Rollouts::new(none(), tells.clone());
        let stream = format!("act {}", self.stream);
        for first in (0..self.episodes).step_by(AT_ONCE) {
            let worlds = AT_ONCE.min(self.episodes - first);
            let mut each = vec![Rollouts::new(none(), tells.clone()); worlds];
            let turn = (first / AT_ONCE) as u64;
            let limit = (self.limit > 0).then_some(self.limit);
            let drive = Drive { env: &*self.r#in, worlds, luck: (&stream, turn), limit };
            let mut rng = ctx.rng("actions", &[&self.stream, &turn.to_string()]);
            let look = || {
                ctx.tell(first as u64, self.episodes as u64, || format!("{worlds} at once"));
                ctx.checkpoint(Vec::new)
            };
            let see = |lane: usize, step: &Step, actor: &dyn Acting| {
                append(&mut each[lane], &keeps, lane, step);
                actor.tell(lane, &mut each[lane].told);
            };
            drive.run((&mut *actor, &mut rng), ctx, look, see)?;
            for episode in &each {
                all.append(episode);
            }
        }
        Ok(all)
    }

    fn needs(args: &Args, _: Option<&Shapes>, input_bytes: u64) -> Needs {
        let env = args.get("in").and_then(|env| Box::<dyn Env>::from_lit(env).ok());
        let of = |name| args.get(name).and_then(|lit| u64::from_lit(lit).ok()).unwrap_or(0);
        let Some(spec) = env.and_then(|env| env.spec().ok()) else { return Needs::default() };
        let keeps = args.get("keeps").and_then(|keeps| Vec::<String>::from_lit(keeps).ok());
        let Ok(keeps) = kept(&spec, &keeps.unwrap_or_default()) else { return Needs::default() };
        let size = |field: &Field| field.width() * if field.kind == Kind::U8 { 1 } else { 4 };
        let row: usize = keeps.iter().map(|i| size(&spec.sees[*i])).sum();
        let limit = [spec.limit.unwrap_or(LONG), of("limit")];
        let steps = limit.into_iter().filter(|n| *n > 0).min().unwrap_or(LONG);
        // What is kept, and once more while it is written.
        let kept = of("episodes").saturating_mul(steps).saturating_mul(2 * (row as u64 + 16));
        Needs { memory: kept.saturating_add(input_bytes), ..Needs::default() }
    }
}

/// Adds a step of a world to the only episode of some rollouts.
fn append(to: &mut Rollouts, keeps: &[usize], lane: usize, step: &Step) {
    let paths = &mut to.paths;
    if paths.episodes.is_empty() {
        paths.episodes.push((0, End::No));
        paths.seen.push_some(&step.before, keeps, lane);
    }
    paths.seen.push_some(&step.after, keeps, lane);
    step.acts.get(lane).append(&mut paths.acts);
    paths.episodes[0].0 += 1;
    paths.episodes[0].1 = step.ends[lane];
    to.rewards.push(step.rewards[lane]);
    let width = step.told.len() / step.rewards.len();
    to.told.extend(&step.told[lane * width..][..width]);
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
        let of_one = |rewards: &[f64]| rewards.iter().rev().fold(0.0, |g, r| r + self.discount * g);
        let each = self.of.paths.each();
        let each = each.map(|(_, done, steps, _)| of_one(&self.of.rewards[done..done + steps]));
        let values: Vec<f64> = each.collect();
        let numbers = (0..values.len()).map(real).collect();
        Ok(Array::series(Dim::new("episode", Labels::Numbers(numbers)), values))
    }
}

declare! {
    /// What was told of each step, of one episode after the other.
    pub struct Told = "told" @ 1 -> Array [step] {
        /// The episodes.
        of: One<Rollouts>;
        /// What: a name of what the world tells, or who acts.
        what: String;
    }
    rule is_told;
}

fn is_told(facts: &Facts<'_>) -> Result<(), Wrong> {
    let Some(told) = facts.shapes("of").and_then(told_by) else { return Ok(()) };
    let what: String = facts.arg("what").unwrap_or_default();
    if told.contains(&what) {
        return Ok(());
    }
    let message = format!("nothing tells `{what}`");
    Err(Wrong { arg: "what", message, help: format!("told is {}", listed(&told)) })
}

impl Op for Told {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let tells = &self.of.tells;
        let column = tells.iter().position(|name| *name == self.what).ok_or_else(|| {
            let why = format!("nothing tells `{}`, but {}", self.what, listed(tells));
            OpError::Failed(why)
        })?;
        let rows = self.of.told.chunks_exact(tells.len());
        let values: Vec<f64> = rows.map(|row| f64::from(row[column])).collect();
        Ok(Array::series(Dim::new("step", Labels::count(values.len())), values))
    }
}

declare! {
    /// What a world told of all steps of each episode together, and who acted of theirs: sums, by what they are of.
    pub struct ToldSums = "told_sums" @ 1 -> Array [episode, told] {
        /// The episodes.
        of: One<Rollouts>;
    }
}

impl Op for ToldSums {
    fn run(&self, _: &Ctx) -> Result<Array, OpError> {
        let (told, width) = (&self.of.told, self.of.tells.len());
        let (mut n, mut values) = (0, Vec::new());
        for (_, done, steps, _) in self.of.paths.each() {
            n += 1;
            let mut sums = vec![0.0; width];
            for t in done..done + steps {
                let row = sums.iter_mut().zip(&told[t * width..][..width]);
                row.for_each(|(sum, told)| *sum += f64::from(*told));
            }
            values.extend(sums);
        }
        let numbers = Labels::Numbers((0..n).map(real).collect());
        let by = Labels::Names(self.of.tells.clone());
        Ok(Array { dims: vec![Dim::new("episode", numbers), Dim::new("told", by)], values })
    }
}

#[cfg(test)]
mod tests {
    use super::super::actor::{Random, Tabular};
    use super::super::strolls;
    use super::super::tabular::PolicyValues;
    use super::*;
    use ivx_data::{Values, Walks};
    use ivx_math::bellman::expected_values;
    use ivx_math::moments::mean;
    use ivx_op::Artifact as _;
    use ivx_world::{CartPole, Chain, GoalWorld};

    const CTX: Ctx = Ctx::new("act", 3, None);

    fn chain() -> Box<dyn Env> {
        Box::new(Chain { cells: 4, slip: 0.1, goal: true })
    }

    fn act(actor: Box<dyn Actor>, r#in: Box<dyn Env>, episodes: usize, limit: u64) -> Rollouts {
        let (stream, keeps) = ("main".to_owned(), Vec::new());
        Act { actor, r#in, episodes, limit, stream, keeps }.run(&CTX).unwrap()
    }

    fn episodes(right: f64, episodes: usize, limit: u64) -> Walks {
        let dims = ivx_world::mdp(&*chain()).unwrap().pairs();
        let policy = One(Array { dims, values: [1.0 - right, right].repeat(4) });
        act(Box::new(Tabular { policy }), chain(), episodes, limit).walks().unwrap()
    }

    #[test]
    fn fewer_are_the_first_of_more_and_luck_is_common() {
        let (few, many) = (episodes(0.5, 70, 100), episodes(0.5, 140, 100));
        assert_eq!(few.episodes, many.episodes[..70]);
        assert_ne!(many.episodes[..6], many.episodes[64..70]);
        let starts = |all: &Walks| all.episodes.iter().map(|e| e.states[0]).collect::<Vec<_>>();
        assert_eq!(starts(&many), starts(&episodes(1.0, 140, 100)));
        assert!((0..3).all(|s| starts(&episodes(1.0, 40, 100)).contains(&s)));
    }

    #[test]
    fn episodes_end_at_the_goal_or_are_cut_off() {
        for e in episodes(1.0, 20, 100).episodes {
            assert!(e.ended && e.states.last() == Some(&3) && e.rewards.last() == Some(&1.0));
            assert!(e.actions.len() >= 3 - e.states[0]);
        }
        let cut = episodes(0.0, 20, 5);
        assert!(cut.episodes.iter().all(|e| !e.ended && e.actions.len() == 5));
        assert!(episodes(0.0, 1, 0).episodes[0].actions.len() == 1000, "the world's own limit");
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
    fn worlds_of_any_kind_are_acted_in_to_their_ends() {
        let pole = || Box::new(CartPole {}) as Box<dyn Env>;
        let all = act(Box::new(Random {}), pole(), 5, 30);
        assert_eq!(Rollouts::decode(&all.encode()), Some(all.clone()));
        let Values::F32(seen) = all.paths.seen.values(0) else { panic!("numbers") };
        for (from, _, steps, end) in all.paths.each() {
            // A pole that has fallen lies where nobody saw it fall before.
            let fallen = |row: usize| {
                let row = &seen[4 * row..][..4];
                row[0].abs() > 2.4 || row[2].abs() > 0.209_439_51
            };
            assert_eq!(end == End::Terminal, fallen(from + steps));
            assert!((from..from + steps).all(|row| !fallen(row)));
            assert!(end == End::Terminal || steps == 30);
        }
        assert_eq!(all.rewards, vec![1.0; all.paths.n_steps()]);
    }

    #[test]
    fn returns_by_hand() {
        let of = One(Rollouts::from(strolls(2)));
        // 1 + 0 + ¼·2
        assert_eq!(Returns { of, discount: 0.5 }.run(&CTX).unwrap().values, [1.5, 1.5]);
    }

    #[test]
    fn what_is_told_is_summed_by_hand() {
        let mut of = Rollouts::from(strolls(2));
        of.tells = vec!["a".to_owned(), "b".to_owned()];
        of.told = (0..12_u8).map(f32::from).collect();
        let told = Told { of: One(of.clone()), what: "b".to_owned() }.run(&CTX).unwrap();
        assert_eq!(told.values, [1.0, 3.0, 5.0, 7.0, 9.0, 11.0]);
        let sums = ToldSums { of: One(of) }.run(&CTX).unwrap();
        // 0 + 2 + 4, 1 + 3 + 5, and 6 more for each of three steps.
        assert_eq!(sums.values, [6.0, 9.0, 24.0, 27.0]);
    }

    #[test]
    fn mean_returns_are_the_values() {
        let r#in = || Box::new(GoalWorld { size: 3, goal: vec![0, 0], trap: vec![2, 2] });
        let mdp = ivx_world::mdp(&*r#in()).unwrap();
        let policy = || One(Array { dims: mdp.pairs(), values: vec![0.25; 36] });
        let q = PolicyValues { policy: policy(), r#in: r#in(), discount: 0.9 };
        let q = q.run(&CTX).unwrap().values;
        let v = expected_values(&mdp.model(), &[0.25; 36], &q);
        let exact: f64 = v.iter().zip(&mdp.start).map(|(v, p)| v * p).sum();
        let all = act(Box::new(Tabular { policy: policy() }), r#in(), 4000, 200);
        let seen = mean(&Returns { of: One(all), discount: 0.9 }.run(&CTX).unwrap().values);
        // The symmetric world is worth 0; a return has a standard deviation below 1.
        assert!(exact.abs() < 1e-12 && seen.abs() < 0.05, "{exact} {seen}");
    }
}
