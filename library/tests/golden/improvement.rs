//! Successor features of finite processes, generalised evaluation and improvement, and their bound (numpy), to the
//! tolerance of the file (1e-8).

use ivx_library::ke::{Bcm, KnowledgeEquivalent, Ma, Wcm};
use ivx_math::bellman::{Model, backup, fixed_point, optimality};
use ivx_math::moments::uniform;
use ivx_math::policy::greedy;
use ivx_math::successor::{
    Errors, Process, Selected, certain_policy, improved_policy, largest_norm, preferred,
    select_action, successor_features, transfer_bounds,
};
use serde_json::{Value, json};

use crate::harness::{Case, check, check_wrong, number, numbers, rows};
use crate::networks::{Tensor, at, input};

const TOPIC: &str = "gpe_gpi";

#[test]
fn golden_generalised_improvement_agrees() {
    check(TOPIC, |case, path| at(&computed(case, false)?, path));
}

/// Each kind with a formula that is nearly right: a discount of a step more, errors of features by their largest number,
/// and the worst policy after an action in place of the best.
#[test]
fn golden_generalised_improvement_tells_wrong_ones() {
    for kind in ["sf_gpi", "bound", "gpi_select", "coingrid_gpi"] {
        check_wrong(TOPIC, kind, |case, path| at(&computed(case, true)?, path));
    }
}

fn computed(case: &Case, wrong: bool) -> Option<Value> {
    let computed = match case.kind.as_str() {
        "sf_gpi" => exact(case, wrong),
        "bound" => bound(case, wrong),
        "gpi_select" => selected(case, wrong),
        "coingrid_gpi" => coins(case, wrong),
        _ => return None,
    };
    Some(computed)
}

/// What a case says of a process.
struct World {
    transitions: Tensor,
    cumulants: Tensor,
    terminal: Vec<bool>,
    discount: f64,
}

impl World {
    fn of(case: &Case) -> Self {
        let transitions = input(case, "P");
        let terminal = vec![false; transitions.shape[0]];
        let discount = number(&case.inputs["gamma"]);
        Self { transitions, cumulants: input(case, "Phi"), terminal, discount }
    }

    fn process(&self) -> Process<'_> {
        Process {
            transitions: &self.transitions.values,
            cumulants: &self.cumulants.values,
            terminal: &self.terminal,
        }
    }

    fn n_actions(&self) -> usize {
        self.transitions.shape[1]
    }

    /// The best values of a task.
    fn best(&self, w: &[f64]) -> Vec<f64> {
        let rewards = preferred(&self.cumulants.values, w);
        let model = Model {
            transitions: &self.transitions.values,
            rewards: &rewards,
            terminal: &self.terminal,
        };
        let operator = |v: &[f64]| optimality(&model, self.discount, v);
        let v = fixed_point(operator, self.terminal.len(), 1e-15, 100_000);
        backup(&model, self.discount, &v.expect("they settle"))
    }

    fn actions(&self, w: &[f64]) -> Vec<usize> {
        self.best(w).chunks(self.n_actions()).map(greedy).collect()
    }

    fn features(&self, actions: &[usize], discount: f64) -> Vec<f64> {
        let policy = certain_policy(actions, self.n_actions());
        successor_features(&self.process(), &policy, discount).expect("there is a solution")
    }

    /// The values of acting so, for one who prefers `w`.
    fn values(&self, actions: &[usize], w: &[f64]) -> Vec<f64> {
        preferred(&self.features(actions, self.discount), w)
    }

    fn pairs(&self, values: Vec<f64>) -> Value {
        Tensor { shape: self.transitions.shape[..2].to_vec(), values }.json()
    }
}

fn chosen(selected: &[Selected]) -> Vec<usize> {
    selected.iter().map(|s| s.action).collect()
}

fn exact(case: &Case, wrong: bool) -> Value {
    let world = World::of(case);
    let w = numbers(&case.inputs["w_new"]);
    let tasks = rows(&case.inputs["w_tasks"]);
    let policies: Vec<Vec<usize>> = tasks.iter().map(|w| world.actions(w)).collect();
    let discount = if wrong { world.discount.powi(2) } else { world.discount };
    let features = policies.iter().map(|actions| world.features(actions, discount));
    let features: Vec<Vec<f64>> = features.collect();
    let selected = improved_policy(&features, &w, world.n_actions());
    let index: Vec<usize> = selected.iter().map(|s| s.policy).collect();
    let each = features.iter().map(|psi| world.pairs(preferred(psi, &w)));
    let psi = features
        .iter()
        .map(|psi| Tensor { shape: world.cumulants.shape.clone(), values: psi.clone() }.json());
    json!({
        "policies": policies,
        "psi": psi.collect::<Vec<_>>(),
        "gpe_q_new": each.collect::<Vec<_>>(),
        "gpi_action": chosen(&selected),
        "gpi_policy_index": index,
        "q_of_gpi_policy": world.pairs(world.values(&chosen(&selected), &w)),
        "q_star_new": world.pairs(world.best(&w)),
    })
}

fn bound(case: &Case, wrong: bool) -> Value {
    let world = World::of(case);
    let (tasks, w) = (rows(&case.inputs["w_tasks"]), numbers(&case.inputs["w_new"]));
    let thought = input(case, "psi_tilde");
    let off: Vec<f64> =
        thought.values.iter().zip(input(case, "psi").values).map(|(a, b)| a - b).collect();
    let errors = Errors {
        largest_cumulant: largest_norm(&world.cumulants.values, w.len()),
        reward: 0.0,
        features: largest_norm(&off, if wrong { 1 } else { w.len() }),
    };
    let thought: Vec<Vec<f64>> =
        thought.values.chunks(world.cumulants.values.len()).map(<[f64]>::to_vec).collect();
    let actions = chosen(&improved_policy(&thought, &w, world.n_actions()));
    let gaps = world.best(&w).into_iter().zip(world.values(&actions, &w)).map(|(a, b)| a - b);
    json!({
        "phi_max": errors.largest_cumulant,
        "delta_psi": errors.features,
        "bound_per_j": transfer_bounds(&tasks, &w, &errors, world.discount),
        "max_gap": gaps.fold(0.0, f64::max),
        "gpi_action": actions,
    })
}

/// Eqn. 4.23 with the worst, the mean and the best of members, and with the first alone.
fn selected(case: &Case, wrong: bool) -> Value {
    let features = input(case, "psi_BKMAd");
    let [n, n_policies, n_members, n_actions, _] = features.shape[..] else {
        panic!("{}: features of items, policies, members and actions", case.name)
    };
    let w = numbers(&case.inputs["w"]);
    let q = preferred(&features.values, &w);
    let sign = if wrong { -1.0 } else { 1.0 };
    let of = |reduce: &dyn Fn(&[f64]) -> f64| -> Vec<Selected> {
        q.chunks(q.len() / n)
            .map(|q| select_action(q, (n_policies, n_members), |said| sign * reduce(said)))
            .collect()
    };
    let by = |ke: &dyn KnowledgeEquivalent| of(&|said| ke.reduce(said, &uniform(said.len())));
    let worst = by(&Wcm {});
    let policies: Vec<usize> = worst.iter().map(|s| s.policy).collect();
    json!({
        "q": Tensor { shape: vec![n, n_policies, n_members, n_actions], values: q.clone() }.json(),
        "pessimistic_action": chosen(&worst),
        "pessimistic_k": policies,
        "single_member_m0_action": chosen(&of(&|said| said[0])),
        "mean_action": chosen(&by(&Ma {})),
        "optimistic_action": chosen(&by(&Bcm {})),
    })
}

fn coins(case: &Case, wrong: bool) -> Value {
    let (features, w) = (input(case, "psi_KAd"), numbers(&case.inputs["w_new"]));
    let q = preferred(&features.values, &w);
    let sign = if wrong { -1.0 } else { 1.0 };
    let selected = select_action(&q, (features.shape[0], 1), |said| sign * said[0]);
    let tasks = rows(&case.inputs["w_tasks"]);
    let colours = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let paid = colours.map(|phi| tasks.iter().map(|w| preferred(&phi, w)[0]).collect::<Vec<_>>());
    json!({
        "q": Tensor { shape: features.shape[..2].to_vec(), values: q }.json(),
        "gpi_action": selected.action,
        "rewards_for_green_red_yellow": paid,
    })
}
