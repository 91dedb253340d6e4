//! What all planners have in common, on problems with known answers.

use ivx_op::{Array, Ctx, Dim, Labels, Lit, Literal as _, One, Part};

use super::*;

fn luck() -> Luck {
    Luck::of(&Ctx::new("plan", 0, None), "test", 0, 0)
}

pub(crate) fn planner(part: &Part) -> Box<dyn Planner> {
    let part = crate::registry().complete(part);
    Box::<dyn Planner>::from_lit(&Lit::Part(part)).expect("a planner")
}

fn cem() -> Box<dyn Planner> {
    planner(&Part::new("cem").with("samples", 200_i64).with("rounds", 20_i64))
}

fn shooting(samples: i64) -> Box<dyn Planner> {
    planner(&Part::new("random_shooting").with("samples", samples))
}

fn climbing(steps: i64, rate: f64) -> Box<dyn Planner> {
    planner(&Part::new("gradient_plan").with("steps", steps).with("rate", rate))
}

fn library(plans: &[f64], len: usize) -> TrajectoryLibrary {
    let dims = vec![
        Dim::new("plan", Labels::count(plans.len() / len)),
        Dim::new("step", Labels::count(len)),
    ];
    TrajectoryLibrary { plans: One(Array { dims, values: plans.to_vec() }) }
}

/// `sign · (−Σ_i (x_i − c_i)² − ½ Σ_i (x_i − c_i)(x_{i+1} − c_{i+1}))`, best at `c` of each problem if the sign is 1.
struct Bowl {
    space: Space,
    best: Vec<Vec<f64>>,
    sign: f64,
    asked: usize,
}

impl Bowl {
    fn new(space: Space, best: &[&[f64]]) -> Self {
        Self { space, best: best.iter().map(|row| row.to_vec()).collect(), sign: 1.0, asked: 0 }
    }

    fn between(low: f64, high: f64, best: &[&[f64]]) -> Self {
        let n = best[0].len();
        Self::new(Space::Continuous { low: vec![low; n], high: vec![high; n] }, best)
    }

    fn at(&self, row: usize, plan: &[f64]) -> f64 {
        let off: Vec<f64> = plan.iter().zip(&self.best[row]).map(|(x, c)| x - c).collect();
        let squares: f64 = off.iter().map(|x| x * x).sum();
        let pairs: f64 = off.windows(2).map(|pair| pair[0] * pair[1]).sum();
        self.sign * (-squares - 0.5 * pairs)
    }
}

impl Objective for Bowl {
    fn rows(&self) -> usize {
        self.best.len()
    }

    fn len(&self) -> usize {
        self.best[0].len()
    }

    fn space(&self) -> &Space {
        &self.space
    }

    fn worth(&mut self, plans: &[f64], n: usize, worth: &mut [f64]) {
        self.asked += worth.len();
        for (i, (plan, worth)) in plans.chunks_exact(self.len()).zip(worth).enumerate() {
            *worth = self.at(i / n, plan);
        }
    }

    fn slope(&mut self, plans: &[f64], worth: &mut [f64], slope: &mut [f64]) -> bool {
        self.worth(plans, 1, worth);
        let n = self.len();
        for (row, best) in self.best.iter().enumerate() {
            let off = |i: usize| plans[row * n + i] - best[i];
            for i in 0..n {
                let before = if i > 0 { off(i - 1) } else { 0.0 };
                let after = if i + 1 < n { off(i + 1) } else { 0.0 };
                slope[row * n + i] = self.sign * (-2.0 * off(i) - 0.5 * (before + after));
            }
        }
        true
    }
}

/// `Σ_i table[i][x_i]`, NaN where that is more than `most`.
struct Table {
    space: Space,
    each: Vec<Vec<f64>>,
    most: f64,
}

impl Objective for Table {
    fn rows(&self) -> usize {
        1
    }

    fn len(&self) -> usize {
        self.each.len()
    }

    fn space(&self) -> &Space {
        &self.space
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "they are places")]
    fn worth(&mut self, plans: &[f64], _: usize, worth: &mut [f64]) {
        for (plan, worth) in plans.chunks_exact(self.len()).zip(worth) {
            let sum = plan.iter().zip(&self.each).map(|(x, row)| row[*x as usize]).sum();
            *worth = if sum > self.most { f64::NAN } else { sum };
        }
    }

    fn slope(&mut self, _: &[f64], _: &mut [f64], _: &mut [f64]) -> bool {
        false
    }
}

fn table(most: f64) -> Table {
    let each = vec![
        vec![0.5, -1.0, 0.25],
        vec![0.0, 3.0, 2.5],
        vec![1.0, 1.5, -4.0],
        vec![-2.0, -3.0, -1.0],
    ];
    Table { space: Space::Discrete(3), each, most }
}

/// The plan that is found from a start, for each problem, and its worth.
fn found(
    planner: &dyn Planner,
    of: &mut dyn Objective,
    start: &[f64],
) -> Result<(Vec<f64>, Vec<f64>), OpError> {
    planner.fits(of.space(), of.len()).expect("it fits");
    let (mut plans, mut worth) = (start.repeat(of.rows()), vec![0.0; of.rows()]);
    planner.open().plan(of, &mut plans, &mut worth, &mut luck())?;
    Ok((plans, worth))
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn all_agree_on_a_quadratic() {
    let bests: [&[f64]; 2] = [&[0.5, -0.25, 0.75], &[-0.5, 0.0, 0.125]];
    // Plans in steps of ¼, among which only the first best is.
    let steps: Vec<f64> = (-4..=4).map(|i| f64::from(i) / 4.0).collect();
    let pairs = steps.iter().flat_map(|x| steps.iter().map(move |y| [*x, *y]));
    let plans: Vec<f64> =
        pairs.flat_map(|[x, y]| steps.iter().flat_map(move |z| [x, y, *z])).collect();
    let ways: [(Box<dyn Planner>, f64); 4] = [
        (climbing(300, 0.05), 1e-3),
        (cem(), 1e-3),
        (shooting(100_000), 0.06),
        (Box::new(library(&plans, 3)), 0.125),
    ];
    for (planner, tolerance) in &ways {
        let mut of = Bowl::between(-1.0, 1.0, &bests);
        let (plans, worth) = found(&**planner, &mut of, &[0.9; 3]).unwrap();
        assert!(apart(&plans, &bests.concat()) <= *tolerance, "{planner:?}: {plans:?}");
        let own = [of.at(0, &plans[..3]), of.at(1, &plans[3..])];
        assert_eq!(worth, own, "{planner:?}");

        // Seeking the worst instead of the best would end in a corner.
        let mut wrong = Bowl { sign: -1.0, ..Bowl::between(-1.0, 1.0, &bests) };
        let (plans, _) = found(&**planner, &mut wrong, &[0.9; 3]).unwrap();
        assert!(apart(&plans, &bests.concat()) > 0.3, "{planner:?}: {plans:?}");
    }
}

#[test]
fn an_optimum_beyond_the_bounds_is_met_at_them() {
    for planner in [climbing(200, 0.05), cem()] {
        let (plans, _) =
            found(&*planner, &mut Bowl::between(-1.0, 1.0, &[&[3.0, 2.0]]), &[0.0; 2]).unwrap();
        assert_eq!(plans, [1.0, 1.0], "{planner:?}");
    }
    // Without bounds it is met where it is, from a start that is near enough for what is drawn about it.
    let open =
        || Space::Continuous { low: vec![f64::NEG_INFINITY; 2], high: vec![f64::INFINITY; 2] };
    for (planner, tolerance) in [(climbing(500, 0.1), 1e-3), (cem(), 1e-3), (shooting(30_000), 0.1)]
    {
        let (plans, _) =
            found(&*planner, &mut Bowl::new(open(), &[&[3.0, 2.0]]), &[2.0; 2]).unwrap();
        assert!(apart(&plans, &[3.0, 2.0]) < tolerance, "{planner:?}: {plans:?}");
    }
}

#[test]
fn all_agree_on_discrete_plans() {
    // 0.5 + 3 + 1.5 − 1.
    let ways: [Box<dyn Planner>; 3] = [planner(&Part::new("exhaustive")), cem(), shooting(2000)];
    for planner in &ways {
        let (plan, worth) = found(&**planner, &mut table(9.0), &[0.0; 4]).unwrap();
        assert_eq!((&plan[..], &worth[..]), (&[0.0, 1.0, 1.0, 2.0][..], &[4.0][..]), "{planner:?}");
        // What is not a number is not chosen: the next best has 0.25 in the place of 0.5, or 2.5 in that of 3.
        let (plan, worth) = found(&**planner, &mut table(3.9), &[0.0; 4]).unwrap();
        assert_eq!(
            (&plan[..], &worth[..]),
            (&[2.0, 1.0, 1.0, 2.0][..], &[3.75][..]),
            "{planner:?}"
        );
        // Where nothing is a number, there is no plan.
        let why = found(&**planner, &mut table(-99.0), &[0.0; 4]).unwrap_err().to_string();
        assert_eq!(why, "no plan that was tried for problem 0 is worth a number");
    }
    let given = library(&[2.0, 2.0, 2.0, 2.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0], 4);
    let (plan, worth) = found(&given, &mut table(9.0), &[0.0; 4]).unwrap();
    assert_eq!((&plan[..], &worth[..]), (&[1.0, 1.0, 1.0, 0.0][..], &[1.5][..]));
}

#[test]
fn the_first_of_equals_is_found() {
    let mut flat = Table { space: Space::Discrete(2), each: vec![vec![1.0, 1.0]; 12], most: 99.0 };
    let exhaustive = planner(&Part::new("exhaustive"));
    assert_eq!(found(&*exhaustive, &mut flat, &[1.0; 12]).unwrap().0, [0.0; 12]);
    // The last of four thousand is looked at too.
    flat.each = vec![vec![0.0, 1.0]; 12];
    assert_eq!(found(&*exhaustive, &mut flat, &[0.0; 12]).unwrap().0, [1.0; 12]);
}

#[test]
fn a_first_step_of_ascent_by_hand() {
    // The first step of Adam is as long as the rate, whatever the slope: uphill from 0 and from 1 to ½.
    let of = |sign| Bowl { sign, ..Bowl::between(-9.0, 9.0, &[&[0.5]]) };
    let step = |start: f64| found(&*climbing(1, 0.1), &mut of(1.0), &[start]).unwrap();
    let (plan, worth) = step(0.0);
    assert!((plan[0] - 0.1).abs() < 1e-8 && (worth[0] + 0.16).abs() < 1e-7, "{plan:?} {worth:?}");
    assert!((step(1.0).0[0] - 0.9).abs() < 1e-8);
    // Two steps: m = 0.09 g₁ + 0.1 g₂ over 0.19, v = 0.000999 g₁² + 0.001 g₂² over 0.001999, where g₁ = 1, g₂ = 0.8.
    let (plan, _) = found(&*climbing(2, 0.1), &mut of(1.0), &[0.0]).unwrap();
    let (m, v) = (0.17 / 0.19, (0.000_999 + 0.000_64) / 0.001_999_f64);
    assert!((plan[0] - 0.1 - 0.1 * m / v.sqrt()).abs() < 1e-7, "{plan:?}");
    // Downhill is never gone: what is best is where one was.
    let (plan, worth) = found(&*climbing(10, 0.1), &mut of(1.0), &[0.5]).unwrap();
    assert_eq!((plan[0], worth[0]), (0.5, 0.0));
}

#[test]
fn no_plan_is_worse_than_its_start() {
    // Steps that are far too long, and draws that are far too wide, hit nothing.
    let wild =
        planner(&Part::new("cem").with("samples", 3_i64).with("elites", 2_i64).with("std", 1e6));
    for planner in [climbing(10, 1e3), wild, shooting(3)] {
        let mut of = Bowl::between(-1e9, 1e9, &[&[0.5, 0.25], &[0.75, 0.5]]);
        let start = [0, 1].map(|row| of.at(row, &[0.5, 0.5]));
        let (_, worth) = found(&*planner, &mut of, &[0.5, 0.5]).unwrap();
        assert!(
            worth.iter().zip(start).all(|(worth, start)| *worth >= start),
            "{planner:?}: {worth:?}"
        );
    }
}

#[test]
fn problems_are_planned_alone_and_again_with_the_same_bits() {
    let bests: [&[f64]; 2] = [&[0.5, -0.25], &[-0.5, 0.125]];
    for planner in [climbing(20, 0.1), cem(), shooting(50)] {
        let both = found(&*planner, &mut Bowl::between(-1.0, 1.0, &bests), &[0.1, 0.2]).unwrap();
        for (row, best) in bests.into_iter().enumerate() {
            let (mut planning, mut of) = (planner.open(), Bowl::between(-1.0, 1.0, &[best]));
            // The second time in buffers that are used.
            for _ in 0..2 {
                let (mut plan, mut worth) = (vec![0.1, 0.2], vec![0.0]);
                planning.plan(&mut of, &mut plan, &mut worth, &mut luck()).unwrap();
                assert_eq!(
                    (&plan[..], worth[0]),
                    (&both.0[row * 2..][..2], both.1[row]),
                    "{planner:?}"
                );
            }
        }
    }
}

#[test]
fn as_many_plans_are_tried_as_is_said() {
    let asked = |planner: &dyn Planner| {
        let mut of = Bowl::between(-1.0, 1.0, &[&[0.5, 0.5], &[0.0, 0.0]]);
        found(planner, &mut of, &[0.0; 2]).unwrap();
        of.asked / 2
    };
    assert_eq!(asked(&*climbing(10, 0.1)), 11);
    assert_eq!(asked(&*shooting(50)), 51);
    assert_eq!(asked(&*cem()), 20 * 201);
}

#[test]
fn what_does_not_fit_is_told() {
    let why =
        |planner: &dyn Planner, space: &Space, len| planner.fits(space, len).unwrap_err().message;
    let line = Space::Continuous { low: vec![-1.0; 2], high: vec![1.0; 2] };
    let exhaustive = planner(&Part::new("exhaustive"));
    assert!(why(&*exhaustive, &line, 2).contains("no end of plans"));
    let told = "there are 4^12, 16777216, plans, and `exhaustive` tries no more than 1000000";
    assert_eq!(why(&*exhaustive, &Space::Discrete(4), 12), told);
    assert!(why(&*exhaustive, &Space::Discrete(9), 99).starts_with("there are 9^99 plans"));
    assert!(exhaustive.fits(&Space::Discrete(10), 6).is_ok());
    assert!(why(&*climbing(1, 0.1), &Space::Discrete(4), 2).contains("have none"));
    let two = library(&[0.5, -0.5, 0.0, 2.0], 2);
    let told = "the library has 2 plans of 2 numbers, and a plan is to have 3 numbers";
    assert_eq!(why(&two, &Space::Discrete(4), 3), told);
    let told = "number 1 of plan 1 of the library is 2, which it cannot be here";
    assert_eq!(why(&two, &line, 2), told);
    assert_eq!(
        why(&library(&[1.0, 0.5], 2), &Space::Discrete(4), 2),
        told.replace("plan 1", "plan 0").replace("is 2", "is 0.5")
    );
    // A slope is asked for where there is none.
    let mut of = table(9.0);
    of.space = Space::Continuous { low: vec![0.0; 4], high: vec![2.0; 4] };
    let why = found(&*climbing(1, 0.1), &mut of, &[0.0; 4]).unwrap_err().to_string();
    assert!(why.ends_with("has none"), "{why}");
}

#[test]
fn a_plan_starts_in_the_middle() {
    let space = Space::Continuous {
        low: vec![-1.0, f64::NEG_INFINITY, 2.0, f64::NEG_INFINITY],
        high: vec![3.0, f64::INFINITY, f64::INFINITY, -5.0],
    };
    assert_eq!(space.middle(4), [1.0, 0.0, 2.0, -5.0]);
    let arm = Actions::Continuous { low: vec![-1.0, -2.0], high: vec![1.0, 2.0] };
    let expected =
        Space::Continuous { low: vec![-1.0, -2.0, -1.0, -2.0], high: vec![1.0, 2.0, 1.0, 2.0] };
    assert_eq!(Space::of(&arm, 2), expected);
}
