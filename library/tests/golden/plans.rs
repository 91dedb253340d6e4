//! Imitative models: how they score plans, which way these would be better, and what is planned (torch).

use ivx_library::ke::{Bcm, KnowledgeEquivalent, Ma, Wcm};
use ivx_math::moments::{mean, uniform};
use ivx_math::order::argmax;
use ivx_math::trajectory::{Displacement, displacements, is_miss, min_ade, min_fde};
use ivx_nn::{Body, Curve, Graph, Module, Params, PlanWeights, Scorer, Shape, plan_log_density};
use serde_json::{Value, json};

use crate::harness::{Case, check_kind, check_wrong, number};
use crate::networks::{Tensor, at, input};

#[test]
fn golden_imitative_models_score_and_plan() {
    check_kind("rip_imitative_planning", "rip_model", |case, path| {
        at(&planned(case, &Wcm {}), path)
    });
}

/// The released code of RIP takes the best case for the worst (trap T1).
#[test]
fn golden_the_best_case_is_told_from_the_worst() {
    check_wrong("rip_imitative_planning", "rip_model", |case, path| {
        at(&planned(case, &Bcm {}), path)
    });
}

fn tensors(case: &Case, k: usize) -> impl Fn(&str) -> Tensor {
    let params = case.inputs["params"][k].clone();
    move |name| Tensor::of(&params[name])
}

fn weights(case: &Case, k: usize) -> PlanWeights<f64> {
    let of = tensors(case, k);
    let turned = |name: &str| of(name).transposed().values;
    let plain = |name: &str| of(name).values;
    PlanWeights {
        dims: of("w_ih").shape[1],
        units: of("w_hh").shape[1],
        cell: [turned("w_ih"), plain("b_ih"), turned("w_hh"), plain("b_hh")],
        head: vec![
            (turned("w1"), plain("b1"), curve()),
            (turned("w2"), plain("b2"), Curve::Identity),
        ],
    }
}

fn curve() -> Curve {
    Curve::Relu
}

/// The models of a case, which see what they begin with.
fn scorer(case: &Case) -> Scorer<f64> {
    let models = case.inputs["params"].as_array().expect("models").len();
    let steps = input(case, "start_plan").shape[0];
    let all: Vec<_> = (0..models).map(|k| weights(case, k)).collect();
    let mut scorer = Scorer::new(&all, steps);
    let states = (0..models).flat_map(|k| tensors(case, k)("z0").values);
    scorer.see(&states.collect::<Vec<_>>());
    scorer
}

fn planned(case: &Case, worst: &dyn KnowledgeEquivalent) -> Value {
    let mut scorer = scorer(case);
    let (library, len) = (input(case, "library"), scorer.len());
    let (n, models) = (library.shape[0], scorer.models());
    let mut scores = vec![0.0; n * models];
    scorer.scores(&library.values, n, &mut scores);
    let weights = uniform(models);
    let by = |ke: &dyn KnowledgeEquivalent| -> Vec<f64> {
        scores.chunks_exact(models).map(|scores| ke.reduce(scores, &weights)).collect()
    };
    let best = |scores: &[f64]| argmax(scores).expect("there are plans");
    let of_model = |k: usize| scores.iter().skip(k).step_by(models).copied().collect::<Vec<_>>();
    let variances = scores.chunks_exact(models).map(|scores| {
        let centre = mean(scores);
        mean(&scores.iter().map(|x| (x - centre).powi(2)).collect::<Vec<_>>())
    });
    let variances: Vec<f64> = variances.collect();
    let tau = number(&case.inputs["tau"]);
    let slopes = |scorer: &mut Scorer<f64>, ke: &dyn KnowledgeEquivalent| -> Value {
        let plans = library.values.chunks_exact(len).map(|plan| climb(scorer, ke, plan).1);
        nested(plans.flatten().collect(), &library.shape)
    };
    let (mu, sigma) = said(&mut scorer, &library);
    let (objective, climbed) = ascended(case, &mut scorer, worst);
    let noise = input(case, "latent_z");
    let mut made = noise.values.clone();
    scorer.plans(0, &mut made, noise.values.len() / len);
    json!({
        "scores_KxN": (0..models).map(of_model).collect::<Vec<_>>(),
        "member0_mu": mu.json(),
        "member0_sigma": sigma.json(),
        "rip_wcm": best(&by(worst)),
        "rip_ma": best(&by(&Ma {})),
        "rip_bcm": best(&by(&Bcm {})),
        "dim_member0": best(&of_model(0)),
        "var_rip_per_plan": variances,
        "query_expert_per_plan": variances.iter().map(|v| *v > tau).collect::<Vec<_>>(),
        "grad_plan_of_min": { "plans": slopes(&mut scorer, worst) },
        "grad_plan_of_mean": { "plans": slopes(&mut scorer, &Ma {}) },
        "inverse_flow_plan": nested(made, &noise.shape[1..]),
        "ascent_objective_trace": objective,
        "ascent_final_plan": climbed.json(),
        "nll_member0": loss(case).0,
        "grads_nll_member0": loss(case).1,
    })
}

fn nested(values: Vec<f64>, shape: &[usize]) -> Value {
    Tensor { shape: shape.to_vec(), values }.json()
}

/// The knowledge equivalent of a plan, and its gradient by the plan.
fn climb(scorer: &mut Scorer<f64>, ke: &dyn KnowledgeEquivalent, plan: &[f64]) -> (f64, Vec<f64>) {
    let mut scores = vec![0.0; scorer.models()];
    scorer.scores(plan, 1, &mut scores);
    let weights = uniform(scores.len());
    let mut slope = vec![0.0; plan.len()];
    scorer.slope(&ke.gradient(&scores, &weights), &mut slope);
    (ke.reduce(&scores, &weights), slope)
}

/// Means and deviations of the first model along plans, found by the noise that makes each.
fn said(scorer: &mut Scorer<f64>, plans: &Tensor) -> (Tensor, Tensor) {
    let (n, steps, dims) = (plans.shape[0], plans.shape[1], plans.shape[2]);
    let mut noise = vec![0.0; plans.values.len()];
    let (mut mu, mut sigma) = (plans.clone(), plans.clone());
    for t in 0..steps {
        let mut made = |x: f64| {
            let mut made = noise.clone();
            for i in 0..n {
                made[(i * steps + t) * dims..][..dims].fill(x);
            }
            scorer.plans(0, &mut made, n);
            made
        };
        let (middle, above) = (made(0.0), made(1.0));
        for at in (0..n).flat_map(|i| (i * steps + t) * dims..(i * steps + t + 1) * dims) {
            mu.values[at] = middle[at];
            sigma.values[at] = above[at] - middle[at];
            noise[at] = (plans.values[at] - middle[at]) / sigma.values[at];
        }
    }
    (mu, sigma)
}

/// Plain gradient ascent from a plan: what it is worth at every step, and where it ends.
fn ascended(
    case: &Case,
    scorer: &mut Scorer<f64>,
    ke: &dyn KnowledgeEquivalent,
) -> (Vec<f64>, Tensor) {
    let (rate, mut plan) = (number(&case.inputs["ascent_lr"]), input(case, "start_plan"));
    let steps = case.expected["ascent_objective_trace"].as_array().expect("a trace").len();
    let mut trace = Vec::new();
    for step in 0..steps {
        let (worth, slope) = climb(scorer, ke, &plan.values);
        trace.push(worth);
        if step + 1 < steps {
            plan.values.iter_mut().zip(slope).for_each(|(x, slope)| *x += rate * slope);
        }
    }
    (trace, plan)
}

/// The negative log-likelihood of the library under the first model, and its gradients.
fn loss(case: &Case) -> (f64, Value) {
    let (own, of) = (weights(case, 0), tensors(case, 0));
    let mut params = Params::default();
    let PlanWeights { dims, units, cell, head } = own;
    let hidden = head[0].1.len();
    let mut add = |name: &str, shape: Vec<usize>, values: Vec<f64>| {
        params.add(name.to_owned(), shape, values)
    };
    let [w_ih, b_ih, w_hh, b_hh] = cell;
    let cell = [
        add("w_ih", vec![dims, 3 * units], w_ih),
        add("b_ih", vec![3 * units], b_ih),
        add("w_hh", vec![units, 3 * units], w_hh),
        add("b_hh", vec![3 * units], b_hh),
    ];
    let [(w1, b1, _), (w2, b2, _)] = <[_; 2]>::try_from(head).expect("two layers");
    let layers = [
        add("w1", vec![units, hidden], w1),
        add("b1", vec![hidden], b1),
        add("w2", vec![hidden, 2 * dims], w2),
        add("b2", vec![2 * dims], b2),
    ];
    let graph = Graph::new(params);
    let library = input(case, "library");
    let (n, steps) = (library.shape[0], library.shape[1]);
    let z0 = of("z0").values;
    let state = graph.variable(Shape::vectors(n, units), &z0.repeat(n));
    let dense = |inputs, outputs, curve| Module::Dense { inputs, outputs, curve };
    let head = Module::Sequence(vec![
        dense(units, hidden, curve()),
        dense(hidden, 2 * dims, Curve::Identity),
    ]);
    let gru = Module::Gru { inputs: dims, units };
    let bodies = (Body { module: &gru, params: &cell }, Body { module: &head, params: &layers });
    let log_q = plan_log_density(&graph, bodies, state, (&library.values, steps));
    let nll = graph.affine(graph.mean(log_q), -1.0, 0.0);
    graph.backward(nll);
    let of_state = graph.grad(state);
    let of_z0: Vec<f64> =
        (0..units).map(|i| of_state.iter().skip(i).step_by(units).sum()).collect();
    let value = graph.scalar(nll);
    let params = graph.params();
    let grad = |id, name: &str, turned: bool| {
        let values = params.grad(id).expect("a gradient").to_vec();
        let own = Tensor { shape: params.shape(id).to_vec(), values };
        (name.to_owned(), if turned { own.transposed().json() } else { own.json() })
    };
    let mut all: serde_json::Map<String, Value> = [
        grad(cell[0], "w_ih", true),
        grad(cell[1], "b_ih", false),
        grad(cell[2], "w_hh", true),
        grad(cell[3], "b_hh", false),
        grad(layers[0], "w1", true),
        grad(layers[1], "b1", false),
        grad(layers[2], "w2", true),
        grad(layers[3], "b2", false),
    ]
    .into_iter()
    .collect();
    all.insert("z0".to_owned(), json!(of_z0));
    (value, Value::Object(all))
}

#[test]
fn golden_forecasts_are_measured() {
    check_kind("rip_imitative_planning", "traj_metrics", |case, path| at(&measured(case), path));
}

/// The measures of every scene at every `k` that the case asks for, and their means.
fn measured(case: &Case) -> Value {
    let (forecasts, shares, taken) = (input(case, "pred"), input(case, "probs"), input(case, "gt"));
    let [scenes, modes, steps, _] = forecasts.shape[..] else { panic!("scenes of modes") };
    let (places, _) = forecasts.values.as_chunks::<2>();
    let (taken, _) = taken.values.as_chunks::<2>();
    let of = |scene: usize| {
        let modes_of = &places[scene * modes * steps..][..modes * steps];
        let shares = &shares.values[scene * modes..][..modes];
        displacements(modes_of, shares, &taken[scene * steps..][..steps]).expect("paths")
    };
    let all: Vec<Vec<Displacement>> = (0..scenes).map(of).collect();
    let mut found = serde_json::Map::new();
    let mut means = serde_json::Map::new();
    for name in case.expected["mean"].as_object().expect("means").keys() {
        let (what, k) = match name.strip_suffix("_2m").unwrap_or(name).rsplit_once('_') {
            Some((what, k)) => (what, k.parse().expect("a number of modes")),
            None => panic!("`{name}` has a number of modes"),
        };
        let number = |modes: &Vec<Displacement>| match what {
            "minADE" => min_ade(modes, k),
            "minFDE" => min_fde(modes, k),
            "missrate" => f64::from(u8::from(is_miss(modes, k, 2.0))),
            other => panic!("nothing computes `{other}`"),
        };
        let each: Vec<f64> = all.iter().map(number).collect();
        means.insert(name.clone(), json!(mean(&each)));
        found.insert(name.clone(), json!(each));
    }
    found.insert("mean".to_owned(), Value::Object(means));
    Value::Object(found)
}
