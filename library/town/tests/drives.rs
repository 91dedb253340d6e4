//! Drives of the expert, and of others who do not drive well.

use ivx_town::{
    At, Controls, DT, Drive, Follower, Happened, Pose, Town, autopilot, drive, route_length, tasks,
    town, town_map,
};

fn drawn(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        f64::from(u32::try_from(state >> 32).expect("it has 32 bits")) / 4_294_967_296.0
    }
}

/// A place outside of junctions, on a lane of 10 m or more.
fn place(town: &Town, draw: &mut dyn FnMut() -> f64) -> Pose {
    let network = &town.network;
    loop {
        let driven = network.lanes.iter().enumerate().filter(|(lane, _)| network.is_driven(*lane));
        let long: Vec<usize> = driven
            .filter(|(lane, of)| {
                network.junction(*lane).is_none() && of.range[1] - of.range[0] > 10.0
            })
            .map(|(lane, _)| lane)
            .collect();
        let n_lanes = f64::from(u32::try_from(long.len()).expect("a town has fewer"));
        let share = draw() * n_lanes;
        let lane = long.iter().zip(1_u32..).find(|(_, k)| f64::from(*k) > share);
        if let Some((lane, _)) = lane {
            let [start, end] = network.lanes[*lane].range;
            return network.pose(At { lane: *lane, s: start + draw() * (end - start) });
        }
    }
}

/// How a drive ends: with an infraction, at its destination, or not at all.
fn ends(
    town: &Town,
    mut drive: Drive,
    noise: f64,
    draw: &mut dyn FnMut() -> f64,
) -> Option<Happened> {
    // At 2 m/s, and 75 s more.
    let limit = 75.0 + route_length(&drive.route) / 2.0;
    let mut time = 0.0;
    while time < limit {
        time += DT;
        let controls = autopilot(&drive, noise, draw);
        let happened = drive.step(town, &controls, draw);
        if happened.is_infraction() || happened.has_arrived {
            return Some(happened);
        }
    }
    None
}

/// How many of `n` drives between random places arrive without an infraction, with 100 cars about.
fn arrivals(name: &str, n: usize, noise: f64) -> usize {
    let town = town(town_map(name).expect("it is ours"));
    let mut draw = drawn(17);
    let mut n_arrived = 0;
    let mut n_drives = 0;
    while n_drives < n {
        let [from, to] = [place(&town, &mut draw), place(&town, &mut draw)];
        let length = town.route(&from, &to).map_or(0.0, |route| route_length(&route));
        if !(50.0..600.0).contains(&length) {
            continue;
        }
        n_drives += 1;
        let drive = drive(&town, &from, &to, 100, &mut draw).expect("there is a route");
        let end = ends(&town, drive, noise, &mut draw);
        n_arrived += usize::from(end.is_some_and(|end| end.has_arrived && !end.is_infraction()));
    }
    n_arrived
}

#[test]
fn the_expert_arrives_in_town_1() {
    let n_arrived = arrivals("Town01", 25, 0.0);
    assert!(n_arrived >= 24, "{n_arrived} of 25");
}

#[test]
fn the_expert_arrives_in_town_3() {
    let n_arrived = arrivals("Town03", 12, 0.0);
    assert!(n_arrived >= 11, "{n_arrived} of 12");
}

#[test]
fn noise_makes_it_worse() {
    let n_arrived = arrivals("Town01", 12, 0.9);
    assert!(n_arrived < 6, "{n_arrived} of 12");
}

#[test]
fn the_expert_does_most_tasks() {
    let mut failed = Vec::new();
    for name in ["Town03", "Town04"] {
        let town = town(town_map(name).expect("it is ours"));
        for task in tasks().iter().filter(|task| task.town == name) {
            let mut draw = drawn(3);
            let drive = drive(&town, &task.origin, &task.destination, 100, &mut draw)
                .expect("there is a route");
            let end = ends(&town, drive, 0.0, &mut draw);
            if !end.as_ref().is_some_and(|end| end.has_arrived && !end.is_infraction()) {
                failed.push((task.name.clone(), end));
            }
        }
    }
    assert!(failed.len() <= 3, "{failed:?}");
}

#[test]
fn who_drives_straight_on_hits_something() {
    let town = town(town_map("Town01").expect("it is ours"));
    let mut draw = drawn(2);
    let mut seen = [0; 4];
    for _ in 0..20 {
        let [from, to] = [place(&town, &mut draw), place(&town, &mut draw)];
        let mut drive = drive(&town, &from, &to, 100, &mut draw).expect("there is a route");
        let straight = Controls { throttle: 0.7, ..Controls::default() };
        let ends = (0..600).map(|_| drive.step(&town, &straight, &mut draw));
        let ends: Vec<Happened> = ends.collect();
        let any = |of: fn(&Happened) -> bool| usize::from(ends.iter().any(of));
        seen[0] += any(|end| end.hits_vehicle);
        seen[1] += any(|end| end.hits_edge);
        seen[2] += any(|end| end.invades_lane);
        seen[3] += any(|end| end.is_off_road);
        let moved: f64 = ends.iter().map(|end| end.moved).sum();
        assert!((moved - drive.distance).abs() < 1e-9 && drive.step == 600);
    }
    assert!(seen[0] > 2 && seen[1] > 15 && seen[2] > 10 && seen[3] > 15, "{seen:?}");
}

#[test]
fn who_stands_is_not_hit_and_keeps_nobody_for_ever() {
    let town = town(town_map("Town02").expect("it is ours"));
    let mut draw = drawn(4);
    let [from, to] = [place(&town, &mut draw), place(&town, &mut draw)];
    let mut drive = drive(&town, &from, &to, 60, &mut draw).expect("there is a route");
    let stands = Controls { brake: 1.0, ..Controls::default() };
    let mut moved = vec![0.0; drive.traffic.cars.len()];
    for _ in 0..4_000 {
        let at: Vec<Pose> = drive.traffic.cars.iter().map(|car| car.pose).collect();
        let happened = drive.step(&town, &stands, &mut draw);
        assert!(!happened.is_infraction(), "{happened:?}");
        for ((car, at), moved) in drive.traffic.cars.iter().zip(at).zip(&mut moved) {
            *moved += at.distance(&car.pose);
        }
    }
    let n_gone = moved.iter().filter(|moved| **moved > 100.0).count();
    assert!(n_gone > 40, "{n_gone} of 60 drove on");
}

/// The controllers of CARNOVEL's agents keep to a route, if set-points are on it.
#[test]
fn set_points_are_followed() {
    let town = town(town_map("Town01").expect("it is ours"));
    let mut draw = drawn(8);
    for _ in 0..4 {
        let [from, to] = [place(&town, &mut draw), place(&town, &mut draw)];
        let mut drive = drive(&town, &from, &to, 0, &mut draw).expect("there is a route");
        let mut follower = Follower::default();
        let mut n_wrong = 0;
        while drive.step < 6_000 {
            // At 18 km/h the fifth of set-points 1/20 s apart is a little nearer.
            let set_point = drive.route[(drive.at + 3).min(drive.route.len() - 1)].pose;
            let ego = drive.ego;
            let controls = follower.follow(&ego.pose, ego.speed, 5.0, [set_point.x, set_point.y]);
            let happened = drive.step(&town, &controls, &mut draw);
            n_wrong += usize::from(happened.is_infraction());
            if happened.has_arrived {
                break;
            }
        }
        assert_eq!((n_wrong, drive.step < 6_000), (0, true));
    }
}

#[test]
fn goals_are_ahead_on_the_route() {
    let town = town(town_map("Town01").expect("it is ours"));
    let mut draw = drawn(5);
    let from = town.network.pose(town.network.lane_at(10, -1, 20.0).expect("it is there"));
    let to = town.network.pose(town.network.lane_at(10, -1, 100.0).expect("it is there"));
    let drive = drive(&town, &from, &to, 0, &mut draw).expect("there is a route");
    // A straight lane: 2, 4, …, 20 m ahead.
    for (goal, ahead) in drive.goals().iter().zip(1_u32..) {
        assert!((goal[0] - 2.0 * f64::from(ahead)).abs() < 0.1 && goal[1].abs() < 0.1, "{goal:?}");
    }
    let same = |a: &Drive, b: &Drive| a.ego == b.ego && a.traffic.cars == b.traffic.cars;
    let again = ivx_town::drive(&town, &from, &to, 0, &mut drawn(5)).expect("there is a route");
    assert!(same(&drive, &again));
}
