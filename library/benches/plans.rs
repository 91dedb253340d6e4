//! How many plans a second an ignorant imitator makes, by processor time: `cargo bench -p ivx-library --bench plans -- [KE]`.
//!
//! They are those of `benches/plans.sh`, which runs JAX and `PyTorch` beside them: five models with 64 units and a head of
//! 64-32-4, four places of two numbers, ten steps of Adam up the knowledge equivalent.

use std::fs;

use ivx_data::Form;
use ivx_library::ke::KnowledgeEquivalent;
use ivx_library::planner::{GradientPlan, Imitated, Planner as _};
use ivx_math::moments::real;
use ivx_nn::{Imitative, Imitators, Mlp, PlanNets, Tanh};
use ivx_op::{Ctx, Lit, Literal as _, Part};
use ivx_world::Luck;

/// How long each is measured, in seconds of the processor.
const LONG: f64 = 3.0;

#[expect(clippy::print_stdout, reason = "a bench tells what it measured")]
fn main() {
    let args: Vec<String> = std::env::args().skip(1).filter(|arg| arg != "--bench").collect();
    let wanted = args.first().map_or("wcm", String::as_str);
    let registry = ivx_library::registry();
    let ke = Lit::Part(registry.complete(&Part::new(wanted)));
    let ke = Box::<dyn KnowledgeEquivalent>::from_lit(&ke).expect("a knowledge equivalent");
    for rows in [1, 50] {
        println!("rip {wanted}, batch {rows}: {:.0} plans/s of CPU", plans_a_second(&*ke, rows));
    }
}

fn plans_a_second(ke: &dyn KnowledgeEquivalent, rows: usize) -> f64 {
    let form = Form { input: vec![4], target: vec![4, 2], ..Form::default() };
    let net = Mlp { hidden: vec![4], activation: Box::new(Tanh {}) };
    let nets = PlanNets { net: &net, features: 4, merge: &[], units: 64, head: &[64, 32] };
    let ctx = Ctx::new("bench", 0, None);
    let drawn = |k: u64| {
        let mut rng = ctx.rng("init", &[&k.to_string()]);
        Imitative::drawn(&nets, &form, &mut rng).expect("it fits")
    };
    let models: Vec<Imitative> = (0..5).map(drawn).collect();
    let mut opened = Imitators::of(&models.iter().collect::<Vec<_>>(), &form);
    let seen: Vec<f32> = (0_u16..).take(4 * rows).map(|i| f32::from(i).sin()).collect();
    opened.see(&seen);
    let mut of = Imitated::new(&mut opened, ke, None, false);
    let mut planning = GradientPlan { steps: 10, rate: 0.1 }.open();
    let mut luck = Luck::from(ctx.rng("search", &[]));
    let start: Vec<f64> = (0..8 * rows).map(|i| (real(i) * 0.7).cos()).collect();
    let mut worth = vec![0.0; rows];
    let (mut n, mut plans) = (0, start.clone());
    let before = processor_time();
    while processor_time() - before < LONG {
        for _ in 0..20 {
            plans.copy_from_slice(&start);
            planning.plan(&mut of, &mut plans, &mut worth, &mut luck).expect("a plan");
        }
        n += 20 * rows;
    }
    real(n) / (processor_time() - before)
}

/// What this thread has spent, in seconds.
fn processor_time() -> f64 {
    let told = fs::read_to_string("/proc/self/schedstat").expect("Linux tells it");
    let ns: f64 = told.split(' ').next().and_then(|ns| ns.parse().ok()).expect("nanoseconds");
    ns * 1e-9
}
