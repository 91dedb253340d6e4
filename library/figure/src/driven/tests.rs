use ivx_data::{Actions, End, Trajectories};
use ivx_op::Labels;
use ivx_world::{Carnovel, Env as _, Town};

use super::super::arrange::tests::axes;
use super::*;

/// Two roads of 100 m, and a route along the first.
fn crossing() -> RoadMap {
    let edges = vec![
        vec![[0.0, 0.0], [100.0, 0.0]],
        vec![[50.0, -50.0], [50.0, 50.0]],
        vec![[900.0, 900.0], [990.0, 900.0]],
    ];
    RoadMap { edges, route: vec![[10.0, 0.0], [90.0, 0.0]] }
}

/// Episodes of `(x, y, infraction, asked)`.
fn rollouts(episodes: &[&[[f32; 4]]]) -> Rollouts {
    let mut paths = Trajectories::new(Vec::new(), Actions::Discrete(vec!["go".to_owned()]));
    paths.episodes = episodes.iter().map(|steps| (steps.len(), End::Limit)).collect();
    let names = ["x", "y", "infraction", "asked"].map(str::to_owned);
    let mut all = Rollouts::new(paths, names.to_vec());
    all.told = episodes.concat().concat();
    all
}

/// To the right and, with an infraction in the end, down; and straight on.
fn two() -> Rollouts {
    rollouts(&[
        &[
            [10.0, 0.0, 0.0, 0.0],
            [30.0, 0.0, 1.0, 1.0],
            [50.0, 0.0, 0.0, 1.0],
            [50.0, 20.0, 1.0, 0.0],
        ],
        &[[12.0, 0.0, 0.0, 0.0], [40.0, 0.0, 0.0, 0.0], [90.0, 0.0, 0.0, 0.0]],
    ])
}

fn over<A>(dims: &[(&str, &[&str])], values: Vec<A>) -> Everything<A> {
    let dim = |(name, labels): &(&str, &[&str])| {
        Dim::new(name, Labels::Names(labels.iter().map(ToString::to_string).collect()))
    };
    Everything(Gathered { dims: dims.iter().map(dim).collect(), values, name: "drives".to_owned() })
}

fn driven(on: Everything<RoadMap>, of: Option<Everything<Rollouts>>) -> Driven {
    Driven {
        on: Some(on),
        of,
        by: axes(&[]),
        facet: axes(&[]),
        places: ["x", "y"].map(str::to_owned).to_vec(),
        episodes: 6,
        shade: String::new(),
        style: "paths".to_owned(),
        title: String::new(),
    }
}

fn svg(op: &Driven) -> String {
    let found = op.run(&Ctx::new("driven", 0, None)).unwrap();
    assert_eq!(found, op.run(&Ctx::new("driven", 0, None)).unwrap());
    found.files["svg"].clone()
}

fn n(svg: &str, part: &str) -> usize {
    svg.matches(part).count()
}

#[test]
fn paths_begin_in_a_circle_and_end_in_an_arrow_or_a_cross() {
    let op = driven(over(&[], vec![crossing()]), Some(over(&[], vec![two()])));
    let found = svg(&op);
    // The part is 80 m by 20 m with 20 m about it, at 560 / 120 pixels a metre.
    let unit = 560.0 / 120.0;
    let x = |metres: f64| ((metres + 10.0) * unit * 10.0).round() / 10.0;
    let y = |metres: f64| ((metres + 20.0) * unit * 10.0).round() / 10.0;
    let corner = format!("M{} {} {} {}", x(10.0), y(0.0), x(50.0), y(0.0));
    assert!(found.contains(&format!("{corner} {} {}", x(50.0), y(20.0))), "{corner} in {found}");
    // One element of each colour; the far road is not there, and the others are cut off.
    assert_eq!((n(&found, "#0072B2"), n(&found, "#a8a8a8")), (1, 1));
    let roads = found.lines().find(|line| line.contains("#a8a8a8")).unwrap();
    assert_eq!(n(roads, "M"), 2, "{roads}");
    assert!(roads.contains(&format!("M{} {} {} {}", x(0.0), y(0.0), x(100.0), y(0.0))), "{roads}");
    // Those of the route and of the first are one; another is in the legend.
    for (label, entries) in
        [("start", 1), ("destination", 1), ("end", 1), ("infraction at the end", 1), ("route", 1)]
    {
        assert_eq!(n(&found, &format!(">{label}<")), entries, "{label}");
    }
    assert_eq!(n(&found, r#"r="3.4""#), 4);
    assert_eq!(n(&found, ">20 m<"), 1);
    // Of one episode, which ends by an infraction, there is no arrow.
    let first = svg(&Driven { episodes: 1, ..op });
    assert_eq!((n(&first, ">end<"), n(&first, ">infraction at the end<")), (0, 1));
}

#[test]
fn without_roads_there_are_paths_alone() {
    let op = driven(over(&[], Vec::new()), Some(over(&[], vec![two()])));
    let found = svg(&Driven { on: None, ..op });
    assert_eq!((n(&found, "#0072B2"), n(&found, "#a8a8a8"), n(&found, "#b9d6ee")), (1, 0, 0));
}

#[test]
fn what_is_told_is_dark_red() {
    let op = driven(over(&[], vec![crossing()]), Some(over(&[], vec![two()])));
    let plain = svg(&op);
    let found = svg(&Driven { shade: "asked".to_owned(), ..op });
    assert_eq!((n(&plain, "#8b0000"), n(&found, "#8b0000")), (0, 2));
    // From where the step began that was asked first.
    let asked = found.lines().find(|line| line.contains("#8b0000")).unwrap();
    assert!(asked.contains("M93.3 93.3 280 93.3\""), "{asked}");
    assert_eq!(n(&found, ">asked<"), 1);
}

#[test]
fn labels_have_colours_and_panels_of_the_same_roads_the_same_part() {
    let few = rollouts(&[&[[10.0, 0.0, 0.0, 0.0], [20.0, 0.0, 0.0, 0.0]]]);
    let method = ("method", &["CIL", "RIP"][..]);
    let drives = || Some(over(&[method], vec![two(), few.clone()]));
    let map = || over(&[], vec![crossing()]);
    let by = svg(&Driven { by: axes(&["method"]), ..driven(map(), drives()) });
    assert_eq!((n(&by, "#0072B2"), n(&by, "#D55E00")), (2, 2));
    assert!(by.contains(">CIL<") && by.contains(">RIP<"));

    let panels = svg(&Driven { facet: axes(&["method"]), ..driven(map(), drives()) });
    assert_eq!((n(&panels, "#0072B2"), n(&panels, "#D55E00"), n(&panels, "#a8a8a8")), (2, 0, 2));
    let roads: Vec<&str> = panels.lines().filter(|line| line.contains("#a8a8a8")).collect();
    assert_eq!(roads[0], roads[1]);

    // Roads that vary have parts of their own.
    let moved = RoadMap { route: vec![[10.0, 0.0], [900.0, 0.0]], ..crossing() };
    let task = ("task", &["near", "far"][..]);
    let maps = over(&[task], vec![crossing(), moved]);
    let routes = svg(&Driven { facet: axes(&["task"]), ..driven(maps, None) });
    let scales = routes.lines().filter(|line| line.contains(" m</text>")).count();
    assert_eq!((scales, n(&routes, ">near<"), n(&routes, "#b9d6ee")), (2, 1, 3));
    assert!(!routes.contains(">end<"));
}

#[test]
fn panels_have_what_was_driven_at_their_labels() {
    let at = |x: f32| rollouts(&[&[[x, 0.0, 0.0, 0.0], [x + 9.0, 0.0, 0.0, 0.0]]]);
    let (task, method) = (("task", &["a", "b"][..]), ("method", &["p", "q"][..]));
    let drives = over(&[method, task], vec![at(10.0), at(20.0), at(30.0), at(40.0)]);
    let op = Driven {
        by: axes(&["method"]),
        facet: axes(&["task"]),
        ..driven(over(&[task], vec![crossing(), RoadMap::default()]), Some(drives))
    };
    let groups = op.groups(&[("task", "b".to_owned())]).unwrap();
    let begins: Vec<(&str, f64)> =
        groups.iter().map(|(label, drives)| (&**label, drives[0].way[0][0])).collect();
    assert_eq!(begins, [("p", 20.0), ("q", 40.0)]);
    let Some(Everything(maps)) = &op.on else { panic!("it has maps") };
    assert_eq!(map(maps, &[("task", "b".to_owned())]), Ok(1));
    assert!(map(maps, &[]).is_err());
    let why = driven(over(&[], vec![RoadMap::default()]), None).run(&Ctx::new("driven", 0, None));
    assert!(why.unwrap_err().to_string().contains("nothing to show"));
}

#[test]
fn places_are_dots_and_lines_of_dots() {
    let still = [[0.0, 0.0, 0.0, 0.0]; 9];
    let few = rollouts(&[&still, &[[30.0, 10.0, 0.0, 0.0], [30.1, 10.0, 0.0, 0.0]]]);
    let map = || over(&[], vec![RoadMap { route: Vec::new(), ..crossing() }]);
    let points =
        |of| Driven { style: "points".to_owned(), ..driven(map(), Some(over(&[], vec![of]))) };
    let found = svg(&points(few));
    // With 7.98 pixels a metre those of the second are halves beside each other.
    let dots = found.lines().find(|line| line.contains("#0072B2")).unwrap();
    assert!(dots.contains(r#"d="M399.5 239.5 400 239.5M160 159.5h0""#), "{dots}");
    assert!(!found.contains(">start<") && !found.contains(">end<"));

    #[expect(clippy::cast_precision_loss, reason = "places are few")]
    let many: Vec<[f32; 4]> = (0..200_000_u32)
        .map(|i| i.wrapping_mul(2_654_435_761))
        .map(|i| [(i % 4003) as f32 / 10.0, (i % 307) as f32, 0.0, 0.0])
        .collect();
    let long = svg(&points(rollouts(&[&many])));
    assert!(long.len() < 1_000_000 && n(&long, "M") > 10_000, "{}", long.len());
}

#[test]
fn what_is_not_told_is_named() {
    let places = ["x", "z"].map(str::to_owned).to_vec();
    let op = Driven { places, ..driven(over(&[], vec![crossing()]), Some(over(&[], vec![two()]))) };
    let why = op.run(&Ctx::new("driven", 0, None)).unwrap_err().to_string();
    assert_eq!(why, "the world tells no `z`, but x, y, infraction, asked");
}

/// The tasks of CARNOVEL, whose places are those of Figures 3.8 and A.1.
#[test]
fn all_tasks_are_one_figure() {
    let families = [("AbnormalTurns", 7), ("BusyTown", 11), ("Hills", 4), ("Roundabouts", 5)];
    let names: Vec<String> =
        families.iter().flat_map(|(name, n)| (0..*n).map(move |i| format!("{name}{i}"))).collect();
    let shows = || vec!["velocity".to_owned()];
    let map = |task: &String| {
        let task = Carnovel {
            task: task.clone(),
            cars: 0,
            shows: shows(),
            reach: 50.0,
            cells: 25,
            limit: 9,
        };
        task.map().unwrap()
    };
    let labels: Vec<&str> = names.iter().map(String::as_str).collect();
    let maps = over(&[("task", &labels)], names.iter().map(map).collect());
    let found = svg(&Driven { facet: axes(&["task"]), ..driven(maps, None) });
    assert!(found.len() < 500_000, "{}", found.len());
    // A route, a start and a destination each, and one in the legend; a frame and roads each.
    for (part, count) in
        [("#b9d6ee", 28), (r#"r="3.4""#, 28), (r#"width="7.4""#, 28), ("#a8a8a8", 27)]
    {
        assert_eq!(n(&found, part), count, "{part}");
    }
    let town =
        Town { name: "Town01".into(), cars: 0, shows: shows(), reach: 50.0, cells: 25, limit: 9 };
    let whole = svg(&driven(over(&[], vec![town.map().unwrap()]), None));
    assert!(n(&whole, ">100 m<") == 1 && whole.len() < 100_000, "{}", whole.len());
}
