//! What inverse temporal-difference learning recovers of who is known, and what an agent makes of it.

use ivx_data::{Act, Actions, Demonstrations, End, Episode, Field, Kind, Misfit, Walks};
use ivx_library::agent::{Agent, Learn, Learned, Method, Span};
use ivx_math::moments::mean;
use ivx_math::order::max;
use ivx_nn::{Live, Shape};
use ivx_op::{Artifact as _, Ctx, Gathered, Held, Lit, Literal as _, Op as _, OpError, Part};
use ivx_world::{Env, Luck, Row, Spec, World};

const SIDE: usize = 3;
const STATES: usize = SIDE * SIDE;
const ACTIONS: usize = 4;
const DISCOUNT: f64 = 0.9;

/// Nine cells; entering that of the goal pays 1, and it goes on.
#[derive(Debug)]
struct Cells {
    goal: usize,
}

/// Where each action leads: up, right, down, left; walls hold.
fn next(s: usize, a: usize) -> usize {
    match (a, s / SIDE, s % SIDE) {
        (0, 1.., _) => s - SIDE,
        (1, _, ..2) => s + 1,
        (2, ..2, _) => s + SIDE,
        (3, _, 1..) => s - 1,
        _ => s,
    }
}

impl Env for Cells {
    fn spec(&self) -> Result<Spec, Misfit> {
        let sees = vec![Field::new("state", &[], Kind::Index(STATES))];
        let does = Actions::named(&["UP", "RIGHT", "DOWN", "LEFT"]);
        Ok(Spec { sees, does, tells: Vec::new(), limit: Some(20) })
    }

    fn open(&self) -> Result<Box<dyn World>, OpError> {
        Ok(Box::new(Walking { goal: self.goal, at: 0 }))
    }
}

struct Walking {
    goal: usize,
    at: usize,
}

impl World for Walking {
    fn reset(&mut self, luck: &mut Luck, row: &mut Row<'_>) {
        self.at = luck.below(9) as usize;
        row.index(0, self.at);
    }

    fn step(&mut self, act: Act<'_>, _: &mut Luck, row: &mut Row<'_>) -> (f64, End) {
        self.at = next(self.at, act.index());
        row.index(0, self.at);
        (f64::from(u8::from(self.at == self.goal)), End::No)
    }
}

/// What a task pays for each pair.
fn task(goal: usize) -> Vec<f64> {
    let pays = |pair: usize| f64::from(u8::from(next(pair / ACTIONS, pair % ACTIONS) == goal));
    (0..STATES * ACTIONS).map(pays).collect()
}

/// The optimal values of rewards `[S, A]`.
fn optimal(reward: &[f64]) -> Vec<f64> {
    let mut q = vec![0.0; STATES * ACTIONS];
    for _ in 0..500 {
        let best: Vec<f64> = q.chunks(ACTIONS).map(max).collect();
        let after = |pair: usize| best[next(pair / ACTIONS, pair % ACTIONS)];
        q = (0..q.len()).map(|pair| reward[pair] + DISCOUNT * after(pair)).collect();
    }
    q
}

/// By how much each action is worse than the best.
fn advantages(q: &[f64]) -> Vec<f64> {
    q.chunks(ACTIONS).flat_map(|row| row.iter().map(|x| x - max(row))).collect()
}

/// The policy that is a softmax of its own values (Eqn. 4.16), `[S, A]`.
fn softened(reward: &[f64], temperature: f64) -> Vec<f64> {
    let mut q = vec![0.0; STATES * ACTIONS];
    let mut policy = vec![0.25; STATES * ACTIONS];
    for _ in 0..500 {
        let worth = |s: usize| -> f64 {
            let at = s * ACTIONS..(s + 1) * ACTIONS;
            q[at.clone()].iter().zip(&policy[at]).map(|(q, p)| q * p).sum()
        };
        let worth: Vec<f64> = (0..STATES).map(worth).collect();
        let after = |pair: usize| worth[next(pair / ACTIONS, pair % ACTIONS)];
        q = (0..q.len()).map(|pair| reward[pair] + DISCOUNT * after(pair)).collect();
        let weighed = |x: f64| (x / temperature).exp();
        let row = |row: &[f64]| -> Vec<f64> {
            let sum: f64 = row.iter().map(|x| weighed(*x)).sum();
            row.iter().map(|x| weighed(*x) / sum).collect()
        };
        policy = q.chunks(ACTIONS).flat_map(row).collect();
    }
    policy
}

/// How soft they are who are shown.
const TEMPERATURE: f64 = 0.5;

/// What they do who seek these goals: every step with every one after it, as often as they take them.
fn shown(goals: &[usize]) -> Demonstrations {
    let (mut episodes, mut whose) = (Vec::new(), Vec::new());
    for (k, goal) in goals.iter().enumerate() {
        let policy = softened(&task(*goal), TEMPERATURE);
        for pair in 0..STATES * ACTIONS {
            let (s, a) = (pair / ACTIONS, pair % ACTIONS);
            for then in 0..ACTIONS {
                let after = next(s, a);
                let probability = policy[pair] * policy[after * ACTIONS + then];
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a count"
                )]
                let n = (2000.0 * probability).round() as usize;
                let states = vec![s, after, next(after, then)];
                let (actions, rewards) = (vec![a, then], vec![0.0; 2]);
                let episode = Episode { states, actions, rewards, ended: false };
                episodes.extend(vec![episode; n]);
                whose.extend(vec![k; n]);
            }
        }
    }
    let actions = ["UP", "RIGHT", "DOWN", "LEFT"].map(str::to_owned).to_vec();
    let paths = Walks { n_states: STATES, actions, episodes }.trajectories();
    let names = goals.iter().map(|goal| format!("to {goal}")).collect();
    Demonstrations { paths, names, whose }
}

fn held(shown: &Demonstrations) -> Lit {
    let values = vec![shown.encode().into()];
    Lit::Held(Held::Value(Gathered { dims: Vec::new(), values, name: String::new() }))
}

fn learn(how: &Part, goal: usize, (counted, n): (&str, i64)) -> Learned {
    let registry = ivx_library::registry();
    let lit = |part: &Part| Lit::Part(registry.complete(part));
    let op = Learn {
        how: Box::<dyn Method>::from_lit(&lit(how)).expect("a method"),
        r#in: Box::new(Cells { goal }),
        r#for: Box::<dyn Span>::from_lit(&lit(&Part::new(counted).with("n", n))).expect("a span"),
        every: 0,
        trials: 20,
        lanes: 1,
    };
    op.run(&Ctx::new("learn", 1, None)).expect("it learns")
}

fn itd(shown: &Demonstrations) -> Part {
    let rate = Part::new("linear").with("from", 3e-3).with("to", 1e-5);
    Part::new("itd")
        .with("shown", held(shown))
        .with("width", 2_i64)
        .with("sparsity", 1e-4)
        .with("discount", DISCOUNT)
        .with("batch", 256_i64)
        .with("target", Part::new("copied").with("every", 20_i64))
        .with("optimiser", Part::new("adam").with("lr", rate))
}

/// The rewards of every pair that an agent infers for a demonstrator, counted from 1 (Eqn. 4.20).
fn inferred(agent: &Agent, k: usize) -> Vec<f64> {
    let live = Live::of(&agent.nets);
    let states: Vec<f32> =
        (0..STATES * STATES).map(|i| if i % (STATES + 1) == 0 { 1.0 } else { 0.0 }).collect();
    let x = live.graph.input(Shape::vectors(STATES, STATES), &states);
    let phi = live.pass("phi", live.pass("torso", x));
    let paid = live.graph.contract(phi, live.array(&format!("w.{k}")));
    live.graph.value(paid).into_iter().map(f64::from).collect()
}

/// The correlation of two, and how much the second grows with the first.
fn alike(x: &[f64], y: &[f64]) -> (f64, f64) {
    let (mx, my) = (mean(x), mean(y));
    let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
        x.iter().zip(y).map(|(x, y)| of(x - mx, y - my)).sum()
    };
    let (xy, xx, yy) = (sum(&|x, y| x * y), sum(&|x, _| x * x), sum(&|_, y| y * y));
    (xy / (xx * yy).sqrt(), xy / xx)
}

/// In how many states the best action by what is inferred of a demonstrator is the best for what it seeks; and how its
/// advantages are like those of the truth, in units of the temperature.
fn recovered(agent: &Agent, (k, goal): (usize, usize)) -> (usize, f64, f64) {
    let (truth, found) = (optimal(&task(goal)), optimal(&inferred(agent, k)));
    let (truth, found) = (advantages(&truth), advantages(&found));
    let is_best = |s: &usize| {
        let row = &found[s * ACTIONS..][..ACTIONS];
        let best = ivx_math::order::argmax(row).expect("numbers");
        truth[s * ACTIONS + best] > -1e-9
    };
    let truth: Vec<f64> = truth.iter().map(|x| x / TEMPERATURE).collect();
    let (correlation, slope) = alike(&truth, &found);
    ((0..STATES).filter(is_best).count(), correlation, slope)
}

/// Theorem 4.2 on a process of nine states: what is inferred of each of two demonstrators is what it is paid, but for a
/// potential.
#[test]
fn rewards_are_recovered_whose_best_policy_is_the_demonstrators() {
    let goals = [0, 5];
    let agent = learn(&itd(&shown(&goals)), 0, ("updates", 6000)).agent;
    for (k, goal) in (1..).zip(goals) {
        let (right, correlation, slope) = recovered(&agent, (k, goal));
        eprintln!(
            "demonstrator {k}: {right} of 9 states, correlation {correlation:.4}, slope {slope:.3}"
        );
        assert!(right == STATES && correlation > 0.95 && (slope - 1.0).abs() < 0.2);
    }
    // What is inferred of one is not what the other is paid.
    let (_, correlation, _) = recovered(&agent, (2, goals[0]));
    assert!(correlation < 0.5, "{correlation}");
}

/// An agent that was shown two ways learns a third that is theirs together.
#[test]
fn an_agent_learns_by_acting_and_from_others() {
    let by = Part::new("dqn")
        .with("net", Part::new("mlp").with("hidden", vec![64_i64]))
        .with("discount", DISCOUNT)
        .with("n_step", 3_i64)
        .with("warm_up", 100_i64)
        .with("every", 2_i64)
        .with("explore", 1000_i64)
        .with("target", Part::new("copied").with("every", 50_i64))
        .with("optimiser", Part::new("adam").with("lr", Part::new("constant").with("value", 2e-3)));
    let how = Part::new("psi_phi").with("shown", held(&shown(&[0, 5]))).with("by", by);
    let run = learn(&how, 8, ("steps", 3000));
    // From anywhere the corner takes at most four steps, and staying there pays in each.
    let got = mean(&run.returns.values);
    eprintln!("psi_phi: {got} of 20 at most, losses {:?}", run.losses.values);
    assert!(got > 16.0, "{got}");
    // Going on from it without a step is to be as good, and not to begin anew.
    let values = vec![run.agent.encode().into()];
    let from = Held::Value(Gathered { dims: Vec::new(), values, name: String::new() });
    let after = learn(&how.clone().with("from", Lit::Held(from)), 8, ("steps", 10)).agent;
    assert!(after.nets.arrays == run.agent.nets.arrays);
    assert!(run.agent.encode() == Agent::decode(&run.agent.encode()).expect("it is").encode());
    // Its own steps as demonstrations do no harm here, and add to what is cloned.
    let own = learn(&how.with("appended", true), 8, ("steps", 3000));
    let (got, cloned) = (mean(&own.returns.values), |run: &Learned| column(run, "acts"));
    eprintln!("psi_phi of its own steps, too: {got} of 20 at most");
    assert!(got > 16.0 && cloned(&own) > cloned(&run), "{got}");
}

/// The mean of a part of the losses.
fn column(run: &Learned, part: &str) -> f64 {
    let width = run.losses.dims[1].len();
    let at = (0..width).find(|i| run.losses.dims[1].labels.text(*i) == part).expect("a part");
    let known = run.losses.values.iter().skip(at).step_by(width).copied();
    mean(&known.filter(|x| x.is_finite()).collect::<Vec<_>>())
}
