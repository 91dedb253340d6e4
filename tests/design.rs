//! The specs by which the language was designed. They check, and expand, with operations that do
//! not exist yet declared here.

use std::path::Path;
use std::sync::LazyLock;

use ivx_data::Dataset;
use ivx_engine::expand;
use ivx_grammar::check::{File, Project, Settings, check};
use ivx_grammar::{format, parse};
use ivx_library::ke::KnowledgeEquivalent;
use ivx_nn::Model;
use ivx_op::{
    Array, Artifact, Ctx, Family, Lit, MemberCount, Members, One, Op, OpError, Part, Parts,
    Registry, Rows, Ty, declare, family, record,
};

/// Artifacts of which only the kind is known.
macro_rules! opaque {
    ($($ty:ident = $kind:literal;)+) => {$(
        struct $ty;

        impl Artifact for $ty {
            const KIND: &'static str = $kind;
            fn encode(&self) -> Vec<u8> {
                Vec::new()
            }
            fn decode(_: &[u8]) -> Option<Self> {
                Some(Self)
            }
        }

        impl std::fmt::Debug for $ty {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str($kind)
            }
        }
    )+};
}

opaque! {
    Agent = "Agent";
    Value = "Value";
}

/// Families of parts of which nothing is known.
macro_rules! families {
    ($($part:ident = $family:literal, $table:ident [$($member:ident),+];)+) => {$(
        trait $part: std::fmt::Debug + Send + Sync {}
        $( impl $part for $member {} )+

        fn $table() -> &'static Parts<dyn $part> {
            static TABLE: LazyLock<Parts<dyn $part>> = LazyLock::new(|| {
                Parts::<dyn $part>::new()$( .with(|x: $member| Box::new(x)) )+
            });
            &TABLE
        }
    )+};
}

families! {
    World = "World", worlds [Town01, Scene, Cells];
    Expert = "Expert", experts [Autopilot];
    Adaptive = "Adaptive", adaptives [AdaRip];
    NetToCome = "Net", nets [Imitative];
}

family!(dyn World, "World", worlds);
family!(dyn Expert, "Expert", experts);
family!(dyn Adaptive, "Adaptive", adaptives);

/// One more network beside those of the library.
impl Family for dyn NetToCome {
    const NAME: &'static str = "Net";
}

declare! {
    /// The town of the demonstrations.
    struct Town01 = "town01" @ 1 {}
}

declare! {
    /// A scene that the demonstrations do not cover.
    struct Scene = "unfamiliar" @ 1 {
        /// Which.
        name: String;
    }
}

declare! {
    /// Five by five states with wind.
    struct Cells = "cells" @ 1 {
        /// How likely the wind moves the agent.
        wind: f64 = 0.0, in 0.0..=1.0;
    }
}

declare! {
    /// The expert that knows the rules.
    struct Autopilot = "by_rules" @ 1 {}
}

declare! {
    /// A density of the expert's plans.
    struct Imitative = "imitating" @ 1 {
        /// The width of the recurrent state.
        hidden: u64 = 64;
    }
}

declare! {
    /// Asks the expert where the scores of the members vary more than a threshold.
    struct AdaRip = "adarip" @ 1 {
        /// The threshold.
        threshold: One<Array>;
        /// How often the expert may be asked.
        budget: u64 = 40;
        /// How the scores of the members become one.
        ke: Box<dyn KnowledgeEquivalent> = Part::new("wcm");
    }
}

declare! {
    /// The tasks of the benchmark.
    struct CarnovelTasks = "carnovel_tasks" @ 1 {}
}

impl Rows for CarnovelTasks {
    fn fields() -> Vec<(&'static str, Ty)> {
        vec![("scene", Ty::Str), ("env", Ty::Part("World".to_owned()))]
    }
    fn rows(&self) -> Vec<(String, Vec<Lit>)> {
        let families = [("AbnormalTurns", 7), ("BusyTown", 11), ("Hills", 4), ("Roundabouts", 5)];
        let tasks = families.into_iter().flat_map(|(family, n)| (0..n).map(move |i| (family, i)));
        let row = |(family, i): (&str, i32)| {
            let label = format!("{family}{i}");
            let env = Part::new("unfamiliar").with("name", label.as_str());
            (label, vec![family.into(), env.into()])
        };
        tasks.map(row).collect()
    }
}

record! {
    /// What became of an agent in one world.
    struct Run = "Run" {
        /// Whether it arrived.
        success: Array [trial];
        /// How often it broke the rules.
        infractions: Array [trial];
        /// How far it came, in kilometres.
        distance: Array [trial];
        /// How often it asked the expert.
        queries: Array [trial];
    }
}

/// Declares operations that only check.
macro_rules! to_come {
    ($($(#[doc = $doc:literal])+ $ty:ident = $name:literal $(, $flag:ident)?
        -> $out:ident $([$($dim:ident),+])? { $($arg:ident: $arg_ty:ty $(= $default:expr)?;)* }
    )+) => {$(
        declare! {
            $(#[doc = $doc])+
            struct $ty = $name @ 1 $(, $flag)? -> $out $([$($dim),+])? {
                $(
                    /// An argument.
                    $arg: $arg_ty $(= $default)?;
                )*
            }
        }

        impl Op for $ty {
            fn run(&self, _: &Ctx) -> Result<$out, OpError> {
                Err(OpError::Failed("declared to be checked, not to be run".to_owned()))
            }
        }
    )+};
}

to_come! {
    /// What an expert does.
    Rollout = "rollout", stochastic -> Dataset {
        expert: Box<dyn Expert>;
        r#in: Box<dyn World>;
        episodes: u64;
        stream: String = "data";
    }
    /// An agent that plans under one model.
    ImitativePlanner = "imitative_planner" -> Agent { model: One<Model>; }
    /// An agent that plans under an ensemble.
    Rip = "robust_planner" -> Agent { model: Members<Model>; ke: Box<dyn KnowledgeEquivalent>; }
    /// What becomes of an agent.
    Drive = "drive", stochastic -> Run {
        agent: One<Agent>;
        r#in: Box<dyn World>;
        trials: u64 = 10;
    }
    /// What becomes of an agent that asks.
    Adapt = "adapt_as", stochastic -> Run {
        agent: Box<dyn Adaptive>;
        model: Members<Model>;
        expert: Box<dyn Expert>;
        r#in: Box<dyn World>;
        trials: u64 = 10;
    }
    /// How much the scores of the members vary.
    ScoreVariance = "score_variance" -> Array [state] { model: Members<Model>; on: One<Dataset>; }
    /// Steps of the uniform policy.
    Experience = "experience", stochastic -> Dataset {
        world: Box<dyn World>;
        steps: u64;
        without: String = "";
    }
    /// Implicit value ensemble.
    Ive = "ive" -> Array [member, state] { model: One<Value>; value: One<Value>; n: u64; }
    /// Explicit value ensemble.
    Eve = "eve" -> Array [member, state] { value: Members<Value>; n: u64; }
    /// Explicit model value ensemble.
    Emve = "emve" -> Array [member, state] { model: Members<Value>; value: One<Value>; n: u64; }
    /// Values of states.
    TrainValue = "train_value", stochastic -> Value {
        on: One<Dataset>;
        epochs: u64;
        members: MemberCount = 1;
    }
    /// A model of the world.
    TrainModel = "train_model", stochastic -> Value {
        on: One<Dataset>;
        epochs: u64;
        members: MemberCount = 1;
    }
}

fn registry() -> Registry {
    ivx_library::registry()
        .parts(worlds())
        .parts(experts())
        .parts(adaptives())
        .parts(nets())
        .rows::<CarnovelTasks>()
        .op::<Rollout>()
        .op::<ImitativePlanner>()
        .op::<Rip>()
        .op::<Drive>()
        .op::<Adapt>()
        .op::<ScoreVariance>()
        .op::<Experience>()
        .op::<Ive>()
        .op::<Eve>()
        .op::<Emve>()
        .op::<TrainValue>()
        .op::<TrainModel>()
}

/// How many nodes of each operation a spec has, without its mention of anything wrong.
fn nodes(name: &str, text: &str, profile: &str, texts: &[(&str, &str)]) -> Vec<(String, usize)> {
    let (ast, faults) = parse(text, 0);
    assert_eq!(faults, [], "{name}");
    assert_eq!(format(text).as_deref(), Ok(text), "{name} is laid out as `ivx fmt` does");
    let texts = texts.iter().map(|(path, text)| ((*path).to_owned(), (*text).to_owned()));
    let file = File {
        path: name.to_owned(),
        stem: Path::new(name).file_stem().expect("a name").to_string_lossy().into_owned(),
        text: text.to_owned(),
        ast: ast.into(),
        texts: texts.collect(),
        ..File::default()
    };
    let project = Project { files: vec![file] };
    let settings = Settings { profile: Some(profile.to_owned()), ..Settings::default() };
    let (spec, faults) = check(&project, &registry(), &settings);
    assert_eq!(faults, [], "{name}");
    let plan = expand(&spec, &registry());
    let mut counts = std::collections::BTreeMap::<String, usize>::new();
    for step in plan.graph.node_weights() {
        *counts.entry(step.op.clone()).or_default() += 1;
    }
    counts.into_iter().collect()
}

fn count(nodes: &[(String, usize)], op: &str) -> usize {
    nodes.iter().find(|(name, _)| name == op).map_or(0, |(_, n)| *n)
}

#[test]
fn table_3_3_has_methods_of_different_make_and_ragged_tasks() {
    let text = include_str!("specs/design/table_3_3.ivx");
    let published = include_str!("specs/design/published/table_3_3.ron");
    let texts = [("published/table_3_3.ron", published)];
    let nodes = nodes("table_3_3.ivx", text, "desk", &texts);
    // Three seeds, five members, 27 tasks, four methods.
    assert_eq!(count(&nodes, "rollout"), 3);
    assert_eq!(count(&nodes, "train"), 3 * 5);
    assert_eq!(count(&nodes, "imitative_planner"), 3);
    assert_eq!(count(&nodes, "robust_planner"), 3 * 3);
    assert_eq!(count(&nodes, "drive"), 3 * 27 * 4);
}

#[test]
fn figure_5_6_has_three_kinds_of_ensemble_of_several_sizes() {
    let nodes = nodes("figure_5_6.ivx", include_str!("specs/design/figure_5_6.ivx"), "quick", &[]);
    assert_eq!(count(&nodes, "train_value"), 20);
    assert_eq!(["ive", "eve", "emve"].map(|op| count(&nodes, op)), [5, 5, 5]);
    assert_eq!(count(&nodes, "heatmap"), 1);
}

#[test]
fn adarip_holds_a_threshold_that_is_computed() {
    let nodes = nodes("adarip.ivx", include_str!("specs/design/adarip.ivx"), "paper", &[]);
    // Five seeds, five budgets, 27 tasks.
    assert_eq!(count(&nodes, "adapt_as"), 5 * 5 * 27);
    assert_eq!(count(&nodes, "quantile"), 5);
}
