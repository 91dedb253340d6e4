//! A hundred cars in each town, for ten thousand steps: none touches another, none leaves its lanes, none stands for ever.

use ivx_town::{Body, DT, Pose, Town, town, town_map, traffic};

fn drawn(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        f64::from(u32::try_from(state >> 32).expect("it has 32 bits")) / 4_294_967_296.0
    }
}

fn body(pose: Pose) -> Body {
    Body::car(pose, [0.0, 0.0])
}

/// - `least`: mean speed of all cars, in metres a second, that is reached.
fn check(name: &str, least: f64) {
    let town: Town = town(town_map(name).expect("it is ours"));
    let mut draw = drawn(7);
    let mut traffic = traffic(&town.space, &town.centres, 100, &[], &mut draw);
    assert_eq!(traffic.cars.len(), 100);
    let n_steps = 10_000;
    let mut driven = vec![0.0; traffic.cars.len()];
    for step in 0..n_steps {
        let before: Vec<Pose> = traffic.cars.iter().map(|car| car.pose).collect();
        traffic.step(&town.space, &town.centres, &mut draw);
        let bodies: Vec<Body> = traffic.bodies().collect();
        for (i, one) in bodies.iter().enumerate() {
            let touched = bodies[..i].iter().position(|other| one.overlaps(other));
            assert_eq!(touched, None, "car {i} of {name} at step {step}");
            let moved = before[i].distance(&one.pose);
            assert!(moved < 0.5, "car {i} of {name} jumps {moved} m at step {step}");
            driven[i] += moved;
        }
        if step % 100 == 0 {
            for car in &traffic.cars {
                let point = [car.pose.x, car.pose.y, car.pose.z];
                let (_, far) = town.nearest.find(&town.network, point).expect("there are lanes");
                assert!(far < 0.05, "{far} m off the lanes of {name} at step {step}");
            }
        }
    }
    let mean = driven.iter().sum::<f64>() / 100.0 / (f64::from(n_steps) * DT);
    let slowest = driven.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(mean > least && slowest > 500.0, "{name}: {mean} m/s, {slowest} m");
}

#[test]
fn a_hundred_cars_in_town_1() {
    check("Town01", 4.0);
}

#[test]
fn a_hundred_cars_in_town_2() {
    check("Town02", 2.0);
}

#[test]
fn a_hundred_cars_in_town_3() {
    check("Town03", 3.5);
}

#[test]
fn a_hundred_cars_in_town_4() {
    check("Town04", 5.5);
}

#[test]
fn a_hundred_cars_in_town_5() {
    check("Town05", 5.5);
}

#[test]
fn the_same_draws_make_the_same_traffic() {
    let town = town(town_map("Town02").unwrap());
    let run = |seed: u64| {
        let mut draw = drawn(seed);
        let mut traffic = traffic(&town.space, &town.centres, 60, &[], &mut draw);
        (0..500).for_each(|_| traffic.step(&town.space, &town.centres, &mut draw));
        traffic.cars
    };
    assert_eq!(run(3), run(3));
    assert_ne!(run(3), run(4));
}

#[test]
fn a_town_takes_no_more_than_it_has_room_for() {
    let town = town(town_map("Town02").unwrap());
    let mut draw = drawn(1);
    let many = traffic(&town.space, &town.centres, 5_000, &[], &mut draw).cars;
    assert!((100..1_000).contains(&many.len()), "{}", many.len());
    let none = traffic(&town.space, &town.centres, 0, &[], &mut draw);
    assert!(none.cars.is_empty());
    // Nobody starts where somebody is.
    let here = body(many[0].pose);
    let away = traffic(&town.space, &town.centres, 5_000, &[here], &mut draw).cars;
    assert!(away.iter().all(|car| !body(car.pose).overlaps(&here)));
}
