//! The optimality and hallucination gaps of Example 2.8.

use ivx_data::Decision;
use ivx_library::ke::{KnowledgeEquivalent, MeanStd};
use ivx_library::metric::{Hallucination, Regret};
use ivx_library::planner::{choose, equivalents};
use ivx_op::{Ctx, One, Op};
use ivx_world::{Reward, Sinusoids};
use serde_json::{Value, json};

use crate::decision;
use crate::harness::{Case, check_kind, numbers, rows};

#[test]
fn golden_gaps() {
    check_kind("agents_baselines", "gaps", gaps);
}

fn gaps(case: &Case, path: &[&str]) -> Option<Value> {
    let actions = numbers(&case.inputs["actions"]);
    let members = rows(&case.inputs["r_hat_KxN"]);
    match path {
        ["r_star"] => {
            let rewards = actions.iter().map(|&a| Sinusoids {}.mean(a));
            Some(json!(rewards.collect::<Vec<_>>()))
        }
        ["members", k, gap] => {
            let scores = &members[k.parse::<usize>().ok()?];
            gap_of(choose(actions, scores).ok()?, gap)
        }
        [ke, gap] => {
            let members: Vec<&[f64]> = members.iter().map(Vec::as_slice).collect();
            let scores = equivalents(&members, ke_named(ke)?.as_ref());
            gap_of(choose(actions, &scores).ok()?, gap)
        }
        _ => None,
    }
}

fn ke_named(key: &str) -> Option<Box<dyn KnowledgeEquivalent>> {
    match key {
        "mean_minus_std" => Some(Box::new(MeanStd { beta: -1.0 })),
        other => decision::ke_named(other),
    }
}

fn gap_of(decision: Decision, gap: &str) -> Option<Value> {
    let ctx = Ctx::new("", 0, None);
    let under = Box::new(Sinusoids {});
    let index = decision.candidates.iter().position(|a| *a == decision.action);
    let decision = One(decision);
    let gap = match gap {
        "index" => return Some(json!(index)),
        "optimality_gap" => Regret { decision, under }.run(&ctx),
        "hallucination_gap" => Hallucination { decision, under }.run(&ctx),
        _ => return None,
    };
    Some(json!(gap.ok()?.values[0]))
}
