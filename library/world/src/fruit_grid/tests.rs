use std::collections::BTreeSet;

use ivx_data::{Columns, Values};

use super::*;

const STAY: usize = 0;

fn env(pays: [f64; 3]) -> FruitGrid {
    FruitGrid { pays: pays.to_vec(), walls: 5, doors: 0.0, levels: 0, first: 0 }
}

/// The last rows of a course, from that of the agent (A) in column 0 up to the presents. `f` is a fruit, `o` another
/// object, `#` a wall and `D` a door:
///
/// ```text
/// 60  presents
/// 59  . . . . .  free
/// 58  # # D D #  wall
/// 57  . . o . .  free
/// 56  . f . . .  free
/// 55  # # . . #  wall
/// 54  o f . . .  free
/// 53  A . . . .  free
/// ```
fn last_rows() -> Course {
    let mut course = Course { row: 53, column: 0, ..Course::EMPTY };
    (course.fruits[54], course.objects[54]) = (0b10, 0b1);
    course.walls[55] = !0b1100;
    (course.fruits[56], course.objects[57]) = (0b10, 0b100);
    (course.walls[58], course.objects[58]) = (ALL, 0b1100);
    course
}

/// An episode by hand, of who collects both: 1 for a fruit, 2 for another object, 7 for the end.
#[test]
fn a_course_pays_for_what_lies_where_a_step_leads() {
    use Met::{End, Fruit, Nothing, Object, Wall};
    let check = |actions: &[usize], met: &[Met]| {
        let mut course = last_rows();
        let found: Vec<Met> = actions.iter().map(|action| course.step(*action)).collect();
        assert_eq!(found, met, "{actions:?}");
    };
    let through = [RIGHT, RIGHT, LEFT, FIRE];
    check(&through, &[Fruit, Nothing, Fruit, Nothing]);
    // The key met the wall and not the door beside it.
    check(&[&through[..], &[RIGHT]].concat(), &[Fruit, Nothing, Fruit, Nothing, Wall]);
    check(&[STAY, STAY], &[Object, Wall]);
    check(&[STAY, FAR_RIGHT, STAY, STAY, STAY], &[Object, Nothing, Nothing, Object, Wall]);
    let opens = [FAR_RIGHT, FIRE, STAY, STAY, RIGHT, LEFT, STAY];
    check(&opens, &[Nothing, Nothing, Nothing, Object, Nothing, Nothing, End]);
    // A step leads past what lies between, and not beyond an edge.
    check(&[FAR_RIGHT, FAR_LEFT], &[Nothing, Wall]);
    check(&[LEFT, FAR_LEFT], &[Object, Wall]);
    let edge = |column, action| {
        let mut course = Course { column, ..Course::EMPTY };
        course.step(action);
        course.column
    };
    assert_eq!([edge(1, FAR_LEFT), edge(14, FAR_RIGHT), edge(15, RIGHT)], [0, 15, 15]);

    let env = FruitGrid { pays: vec![1.0, 2.0, 7.0], ..env([0.0; 3]) };
    let mut seen = Columns::zeros(env.spec().unwrap().sees, 1);
    let (pays, course, mut luck) = (task(&env.pays).unwrap(), last_rows(), Luck::numpy(0));
    let mut world = Playing { pays, levels: [0, 1], how: (5, 0.0), course };
    let mut told = [9.0; 3];
    let steps = opens.map(|action| {
        let row = &mut Row::of(&mut seen, 0, &mut told);
        let (paid, end) = world.step(Act::Index(action), &mut luck, row);
        (paid, end == ivx_data::End::Terminal, told)
    });
    let none = (0.0, false, [0.0; 3]);
    let object = (2.0, false, [0.0, 1.0, 0.0]);
    assert_eq!(steps, [none, none, none, object, none, none, (7.0, true, [0.0, 0.0, 1.0])]);
}

#[test]
fn four_masks_are_seen() {
    let seen = |course: &Course| -> [Vec<[usize; 2]>; 4] {
        let mut cells = [9; 4 * CELLS];
        course.show(&mut cells);
        [0, 1, 2, 3].map(|channel| {
            let plane = &cells[channel * CELLS..][..CELLS];
            assert!(plane.iter().all(|bit| *bit < 2));
            let marked = (0..CELLS).filter(|cell| plane[*cell] == 1);
            marked.map(|cell| [cell / SIDE, cell % SIDE]).collect()
        })
    };
    let presents = || (0..SIDE).map(|column| [8, column]);
    let wall =
        |row, gap: [usize; 2]| (0..SIDE).filter(move |c| !gap.contains(c)).map(move |c| [row, c]);
    let mut course = last_rows();
    let [fruits, objects, walls, agent] = seen(&course);
    assert!(fruits.into_iter().eq(presents().chain([[12, 1], [14, 1]])));
    let doors_and_others = [[10, 2], [10, 3], [11, 2], [14, 0]];
    assert!(objects.into_iter().eq(presents().chain(doors_and_others)));
    assert!(walls.into_iter().eq(wall(10, [99; 2]).chain(wall(13, [2, 3]))));
    assert_eq!(agent, [[15, 0]]);
    course.step(FAR_RIGHT);
    course.step(FIRE);
    let [_, objects, walls, agent] = seen(&course);
    assert!(objects.into_iter().eq(presents().map(|[_, c]| [10, c]).chain([[13, 2]])));
    assert!(walls.into_iter().eq(wall(12, [2, 3]).chain(wall(15, [2, 3]))));
    assert_eq!(agent, [[15, 2]]);
}

fn drawn(level: u32, walls: usize, doors: f64) -> Course {
    Course::drawn(&mut of_level(level), walls, doors)
}

#[test]
fn levels_are_as_they_are_described() {
    let (mut gaps, mut starts, mut counts) = ([0; SIDE], ALL, BTreeSet::new());
    let mut doors = 0;
    for level in 0..400 {
        let n_walls = level as usize % 8;
        let course = drawn(level, n_walls, 0.25);
        let rows: Vec<usize> = (0..END).filter(|row| course.walls[*row] != 0).collect();
        assert!(rows.len() == n_walls && rows.last().is_none_or(|row| row + LAST <= END));
        for (row, before) in rows.iter().zip([0].iter().chain(&rows)) {
            let gap = !course.walls[*row] | course.objects[*row];
            assert!(row - before >= APART && course.fruits[*row] == 0);
            assert_eq!(gap >> gap.trailing_zeros(), (1 << gap.count_ones()) - 1);
            gaps[gap.count_ones() as usize] += 1;
            doors += usize::from(course.walls[*row] == ALL);
        }
        let (mut fruits, mut others) = (0, 0);
        for row in (0..END).filter(|row| course.walls[*row] == 0) {
            assert_eq!(course.fruits[row] & course.objects[row], 0);
            fruits += course.fruits[row].count_ones();
            others += course.objects[row].count_ones();
        }
        counts.extend([fruits, others]);
        assert_eq!((course.fruits[0], course.objects[0], course.row), (0, 0, 0));
        assert_eq!((course.fruits[END], course.objects[END]), (ALL, ALL));
        starts &= !(1 << course.column);
    }
    assert_eq!((starts, counts), (0, (20..40).collect()));
    assert!(gaps[3..7].iter().all(|n| *n > 300) && gaps.iter().sum::<i32>() == 1400);
    assert!((300..400).contains(&doors), "{doors} of 1400 walls have a door");
}

/// From anywhere behind a wall, and from anywhere in the first row, some way leads through the next wall.
#[test]
fn there_is_always_a_way_through() {
    for (level, walls, doors) in (0..24).map(|level| (level, [5, 7][level as usize % 2], 0.5)) {
        let mut course = drawn(level, walls, doors);
        let rows: Vec<usize> = (1..END).filter(|row| course.walls[*row] != 0).collect();
        // What can be collected bars no way.
        course.fruits = Course::EMPTY.fruits;
        (0..END).filter(|row| course.walls[*row] == 0).for_each(|row| course.objects[row] = 0);
        let mut row = 0;
        for next in rows.into_iter().chain([END]) {
            for column in 0..SIDE {
                let mut reached = BTreeSet::from([Course { row, column, ..course }]);
                for _ in row..next {
                    let each = reached.iter().flat_map(|course| (0..6).map(|a| (*course, a)));
                    reached = each
                        .filter_map(|(mut course, action)| {
                            (course.step(action) != Met::Wall).then_some(course)
                        })
                        .collect();
                }
                assert!(!reached.is_empty(), "level {level}, row {row}, column {column}");
            }
            row = next;
        }
    }
}

#[test]
fn levels_are_the_same_on_all_seeds_and_test_levels_are_others() {
    let starts = |levels, first, seed| -> BTreeSet<Vec<u8>> {
        let env = FruitGrid { levels, first, ..env([1.0; 3]) };
        let mut seen = Columns::zeros(env.spec().unwrap().sees, 1);
        let (mut world, mut luck) = (env.open().unwrap(), Luck::numpy(seed));
        let starts = (0..60).map(|_| {
            world.reset(&mut luck, &mut Row::of(&mut seen, 0, &mut []));
            let Values::U8(cells) = seen.values(0) else { panic!("bits") };
            cells.clone()
        });
        starts.collect()
    };
    let few = starts(5, 10, 0);
    assert_eq!((few.len(), &few), (5, &starts(5, 10, 1)));
    assert_eq!(starts(4, 11, 2).difference(&few).count(), 0);
    assert_eq!(starts(5, 15, 0).intersection(&few).count(), 0);
    assert_eq!(starts(0, 0, 0).union(&starts(0, 0, 1)).count(), 120);
}

#[test]
fn tasks_and_levels_that_there_are_not_are_refused() {
    let why = |env: FruitGrid| {
        assert!(env.open().is_err());
        env.spec().unwrap_err().message
    };
    let pays = FruitGrid { pays: vec![1.0, -4.0], ..env([0.0; 3]) };
    assert_eq!(why(pays), "a task pays for fruits, other objects and the end, not for 2");
    let levels = |levels, first| FruitGrid { levels, first, ..env([0.0; 3]) };
    assert!(why(levels(0, 3)).contains("none is the first"));
    assert!(why(levels(9, LEVELS - 8)).contains("beyond"));
    assert!(levels(9, LEVELS - 9).open().is_ok() && levels(LEVELS, 0).open().is_ok());
    assert!(!env([0.0; 3]).pays() && env([0.0, 0.0, 1.0]).pays());
}

/// What is seen, told and paid agrees, and an episode is known by its luck and its actions.
#[test]
fn a_world_starts_afresh() {
    let env = FruitGrid { doors: 0.5, walls: 2, ..env([1.0, -4.0, 10.0]) };
    let mut seen = Columns::zeros(env.spec().unwrap().sees, 1);
    let mut episode = |world: &mut dyn World, seed| {
        let (mut luck, mut told) = (Luck::numpy(seed), [0.0; 3]);
        world.reset(&mut luck, &mut Row::of(&mut seen, 0, &mut []));
        let mut steps = Vec::new();
        loop {
            let act = Act::Index(luck.below(6) as usize);
            let (paid, end) = world.step(act, &mut luck, &mut Row::of(&mut seen, 0, &mut told));
            let Values::U8(cells) = seen.values(0) else { panic!("bits") };
            steps.push((paid, told, cells.clone()));
            if end == End::Terminal {
                return steps;
            }
            assert!(steps.len() < END);
        }
    };
    let (mut world, mut ends) = (env.open().unwrap(), [0.0; 3]);
    for seed in 0..60 {
        let one = episode(&mut *world, seed);
        for (paid, told, _) in &one {
            let worth = [1.0, -4.0, 10.0].iter().zip(told).map(|(pays, n)| pays * f64::from(*n));
            assert_eq!(*paid, worth.sum::<f64>());
            (0..3).for_each(|i| ends[i] += told[i]);
        }
        let last = one.last().unwrap();
        let in_a_wall = last.2[2 * CELLS..].chunks(CELLS).map(|plane| &plane[CELLS - SIDE..]);
        let in_a_wall: Vec<&[u8]> = in_a_wall.collect();
        let meets = in_a_wall[0].iter().zip(in_a_wall[1]).any(|(wall, agent)| wall & agent == 1);
        assert_eq!((last.1[2] == 1.0, one.len() == END), (!meets, !meets));
        assert_eq!(episode(&mut *env.open().unwrap(), seed), one);
        episode(&mut *world, seed + 100);
        assert_eq!(episode(&mut *world, seed), one);
    }
    assert!(ends.iter().all(|n| *n > 3.0), "{ends:?}");
}
