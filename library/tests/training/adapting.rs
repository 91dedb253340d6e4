//! Who asks an expert learns what was not known.

use ivx_data::Dataset;
use ivx_library::agent::{Act, Actor, Adapt, Adapted, Windows};
use ivx_library::learner::{Learner, Train};
use ivx_math::moments::mean;
use ivx_nn::{Imitative, Model, Optimiser};
use ivx_op::{Array, Ctx, Held, Lit, One, Op as _, Part};
use ivx_world::Env;

fn built<T: ivx_op::Literal>(part: &Part) -> T {
    T::from_lit(&Lit::Part(ivx_library::registry().complete(part))).expect("it is a part")
}

fn town(cars: i64, limit: i64) -> Box<dyn Env> {
    let shows = vec!["lidar", "velocity", "goals", "expert"];
    let town = Part::new("town").with("cars", cars).with("cells", 25_i64).with("reach", 25.0);
    built(&town.with("shows", shows).with("limit", limit))
}

/// Drives of the expert, and two members that have seen little of them.
fn begun() -> (Dataset, Vec<Model>) {
    let (actor, keeps) = (built::<Box<dyn Actor>>(&Part::new("autopilot")), Vec::new());
    let stream = "main".to_owned();
    let act = Act { actor, r#in: town(0, 200), episodes: 2, limit: 0, stream, keeps };
    let of = One(act.run(&Ctx::new("act", 0, None)).expect("it drives"));
    let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    let windows = Windows {
        of,
        places: names(&["x", "y"]),
        heading: "yaw".to_owned(),
        sees: names(&["lidar", "velocity"]),
        steps: 4,
        every: 20,
        stride: 10,
    };
    let data = windows.run(&Ctx::new("windows", 0, None)).expect("they are long enough");
    let net = Part::new("sequence").with("layers", Lit::List(vec![Part::new("flatten").into()]));
    let part =
        Part::new("imitative").with("net", net).with("features", 8_i64).with("batch", 16_i64);
    let train = |member| {
        let learner = built::<Box<dyn Learner>>(&part);
        let train = Train { learner, on: One(data.clone()), steps: 40, epochs: 0 };
        train.run(&Ctx::new("train", 0, Some(member))).expect("it learns")
    };
    let models = vec![train(0), train(1)];
    (data, models)
}

fn rip(models: &[Model]) -> Box<dyn Actor> {
    use ivx_op::Artifact as _;
    let values = models.iter().map(|model| model.encode().into()).collect();
    let dims = vec![ivx_op::Dim::new("member", ivx_op::Labels::count(models.len()))];
    let held = Held::Value(ivx_op::Gathered { dims, values, name: String::new() });
    let part = Part::new("rip").with("model", Lit::Held(held)).with("ke", Part::new("wcm"));
    built(&part)
}

fn adapted((data, models): &(Dataset, Vec<Model>), threshold: f64, at_random: f64) -> Adapted {
    let adapt = Adapt {
        actor: rip(models),
        on: One(data.clone()),
        r#in: town(5, 120),
        threshold: One(Array::scalar(threshold)),
        budget: 6,
        episodes: 2,
        updates: 20,
        batch: 16,
        optimiser: built::<Box<dyn Optimiser>>(&Part::new("adam")),
        prior: built(&Part::new("normal")),
        noise: 0.01,
        places: vec!["x".to_owned(), "y".to_owned()],
        heading: "yaw".to_owned(),
        at_random,
        stream: "adapt".to_owned(),
    };
    adapt.run(&Ctx::new("adapt", 1, None)).expect("it adapts")
}

fn log_density(models: &[&Imitative], on: &Dataset) -> f64 {
    let mut opened = ivx_nn::Imitators::of(models, &on.form);
    #[expect(clippy::cast_possible_truncation, reason = "networks are of single precision")]
    let single = |xs: &[f64]| xs.iter().map(|x| *x as f32).collect::<Vec<_>>();
    opened.see(&single(&on.x));
    let mut scores = vec![0.0; on.len() * models.len()];
    opened.scorer.scores(&single(&on.y), 1, &mut scores);
    mean(&scores.into_iter().map(f64::from).collect::<Vec<_>>())
}

#[test]
fn who_asks_learns_what_was_shown_and_asks_no_more_than_it_may() {
    let begun = begun();
    let asks = adapted(&begun, 0.0, 0.0);
    assert_eq!(asks.asked.values.iter().sum::<f64>(), 6.0);
    assert_eq!((asks.shown.len(), asks.queries.dims[0].len()), (6, 6));
    // Every second of what the expert shows; then it is asked anew.
    let steps: Vec<f64> = asks.queries.values.chunks(3).map(|row| row[1]).collect();
    assert_eq!(steps, [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]);
    let column = asks.drives.tells.iter().position(|name| name == "asked").unwrap();
    let of_expert: f32 =
        asks.drives.told.chunks(asks.drives.tells.len()).map(|row| row[column]).sum();
    assert_eq!(of_expert, 120.0);
    let own = |models: &[Model], on: &Dataset| {
        let models: Vec<&Imitative> =
            models.iter().map(|model| Imitative::within(model).unwrap().0).collect();
        log_density(&models, on)
    };
    let Model::Fitted(fitted) = &asks.model else { panic!("a mixture") };
    let function: &dyn std::any::Any = &*fitted.function;
    let mixture: &ivx_nn::Mixture = function.downcast_ref().expect("a mixture");
    let (before, after) = (own(&begun.1, &asks.shown), own(&mixture.members, &asks.shown));
    assert!(after > before + 1.0, "what was shown was worth {before} nats, and is {after}");
    assert_eq!(adapted(&begun, 0.0, 0.0), asks);

    // Who is never lost asks nobody, and remains what they were.
    let never = adapted(&begun, f64::INFINITY, 0.0);
    let Model::Fitted(fitted) = &never.model else { panic!("a mixture") };
    let function: &dyn std::any::Any = &*fitted.function;
    let mixture: &ivx_nn::Mixture = function.downcast_ref().expect("a mixture");
    assert_eq!((mixture.members.clone(), never.shown.len()), (begun.1.clone(), 0));

    // At random it is asked whatever the members say.
    let random = adapted(&begun, f64::INFINITY, 0.02);
    assert!((1..=6).contains(&random.shown.len()) && random.queries != asks.queries);
}
