use ivx_data::{Columns, Values};
use ivx_op::{Ctx, Lit, Part};

use super::*;

fn town(shows: &[&str], cars: usize, reach: f64, cells: usize) -> Town {
    let shows = shows.iter().map(|name| (*name).to_owned()).collect();
    Town { name: "Town01".to_owned(), cars, shows, reach, cells, limit: 100 }
}

/// A world, and what is seen of its first state by one luck.
fn begun(env: &Town) -> (Box<dyn World>, Luck, Columns) {
    let mut luck = Luck::of(&Ctx::new("test", 3, None), "town", 0, 0);
    let mut seen = Columns::zeros(env.spec().unwrap().sees, 1);
    let mut world = env.open().unwrap();
    world.reset(&mut luck, &mut Row::of(&mut seen, 0, &mut []));
    (world, luck, seen)
}

fn bytes(seen: &Columns, field: usize) -> &[u8] {
    let Values::U8(bytes) = seen.values(field) else { panic!("pictures are bytes") };
    bytes
}

#[test]
fn a_smaller_picture_is_the_middle_of_the_larger() {
    let (_, _, whole) = begun(&town(&["lidar"], 30, 50.0, 200));
    let (_, _, near) = begun(&town(&["velocity", "lidar"], 30, 25.0, 50));
    let (whole, near) = (bytes(&whole, 0), bytes(&near, 1));
    assert!(near.iter().filter(|n| **n > 0).count() > 100);
    for channel in 0..2 {
        for y in 0..50 {
            for x in 0..50 {
                let bin = |i: usize| {
                    whole[(channel * 200 + 50 + 2 * y + i / 2) * 200 + 50 + 2 * x + i % 2]
                };
                let most = (0..4).map(bin).max().unwrap();
                assert_eq!(near[(channel * 50 + y) * 50 + x], most, "{channel} {y} {x}");
            }
        }
    }
}

#[test]
fn what_the_expert_would_do_is_what_it_does() {
    // Without others nothing is left to chance.
    let env = town(&["expert", "command"], 0, 50.0, 25);
    let (mut world, mut luck, mut seen) = begun(&env);
    let shown = world.shown(60, &mut Luck::of(&Ctx::new("test", 9, None), "other", 0, 0)).unwrap();
    let mut told = [0.0; TELLS.len()];
    for row in shown.chunks_exact(TELLS.len()).skip(1) {
        let Values::F32(acts) = seen.values(0) else { panic!("an action is numbers") };
        let act = acts.clone();
        let mut after = Row::of(&mut seen, 0, &mut told);
        world.step(Act::Vector(&act), &mut luck, &mut after);
        // Actions are seen in single precision.
        let near = told.iter().zip(row).all(|(told, shown)| (told - shown).abs() < 1e-3);
        assert!(near, "{told:?} {row:?}");
    }
    assert!(shown[3] == 0.0 && shown[60 * TELLS.len() + 3] > 4.0, "it stands, and then drives");
    let Values::F32(commands) = seen.values(1) else { panic!("commands are numbers") };
    assert_eq!(commands.iter().sum::<f32>(), 1.0);
}

#[test]
fn what_cannot_be_shown_is_told() {
    let registry = crate::register(ivx_op::Registry::default());
    let told = |shows: &[&str], reach: f64, cells: i64| {
        let shows: Vec<Lit> = shows.iter().map(|name| (*name).into()).collect();
        let part = Part::new("town").with("shows", Lit::List(shows)).with("reach", reach);
        let args = registry.complete(&part.with("cells", cells)).args;
        let (over, shapes) = (BTreeMap::new(), BTreeMap::new());
        let facts = Facts { args: &args, given: &[], over: &over, seen: &over, shapes: &shapes };
        registry.decl("town").unwrap().rule.unwrap()(&facts).err().map(|wrong| wrong.message)
    };
    let message = |shows: &[&str], reach, cells| told(shows, reach, cells).unwrap_or_default();
    assert_eq!(message(&[], 50.0, 200), "nothing is seen");
    assert_eq!(message(&["radar"], 50.0, 200), "a town does not show `radar`");
    assert_eq!(message(&["lidar", "lidar"], 50.0, 200), "`lidar` is shown twice");
    let bins = "the 100 bins of points within 25 m do not fill 30 cells";
    assert_eq!(message(&["lidar"], 25.0, 30), bins);
    assert_eq!(told(&["streets"], 25.0, 30), None);
    assert_eq!(told(&["lidar"], 25.0, 50), None);
}
