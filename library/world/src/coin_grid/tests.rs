use ivx_data::{Columns, Values};

use super::*;

const STEPS: [&str; 3] = ["LEFT", "RIGHT", "FORWARD"];

/// A corner of the grid, with the agent at its end and a wall (#) in its way:
///
/// ```text
/// > G Y #
///   R
/// ```
fn corner() -> Coins {
    let coins = [1 << 9, 1 << 16, 1 << 10];
    Coins { coins, walls: Coins::BORDER | 1 << 11, at: 8, faces: 0 }
}

/// An episode by hand, of the second task of Example 4.1: 2 for red, -1 for yellow.
#[test]
fn coins_pay_when_their_cells_are_entered() {
    let env =
        CoinGrid { pays: vec![2.0, 0.0, -1.0], coins: 1, walls: 1, limit: 9, front_apart: false };
    let spec = env.spec().unwrap();
    assert_eq!(spec.does, Actions::named(&STEPS));
    let mut world = Collecting {
        sees: env.field(),
        pays: task(&env.pays).unwrap(),
        coins: 1,
        walls: 1,
        state: corner(),
    };
    let mut seen = Columns::zeros(spec.sees, 1);
    let mut luck = Luck::numpy(0);
    let none = [0.0; 3];
    for (action, at, faces, told, paid) in [
        (1, 8, 1, none, 0.0),
        (0, 8, 0, none, 0.0),
        (2, 9, 0, [1.0, 0.0, 0.0], 0.0),
        (2, 10, 0, [0.0, 0.0, 1.0], -1.0),
        (2, 10, 0, none, 0.0), // The wall is in the way.
        (1, 10, 1, none, 0.0),
        (2, 17, 1, none, 0.0),
        (1, 17, 2, none, 0.0),
        (2, 16, 2, [0.0, 1.0, 0.0], 2.0),
    ] {
        let mut tells = [9.0; 3];
        let row = &mut Row::of(&mut seen, 0, &mut tells);
        let (pays, end) = world.step(Act::Index(action), &mut luck, row);
        assert_eq!((world.state.at, world.state.faces), (at, faces));
        assert_eq!((tells, pays), (told, paid));
        assert_eq!(end, if at == 16 { End::Terminal } else { End::No });
    }
}

#[test]
fn five_masks_are_seen() {
    let mut seen = [9; 5 * CELLS];
    corner().show(&mut seen);
    let ones = |channel: usize| -> Vec<usize> {
        let mask = &seen[channel * CELLS..][..CELLS];
        assert!(mask.iter().all(|bit| *bit < 2));
        (0..CELLS).filter(|cell| mask[*cell] == 1).collect()
    };
    assert_eq!([ones(0), ones(1), ones(2)], [[9], [16], [10]]);
    assert_eq!(ones(3)[..10], [0, 1, 2, 3, 4, 5, 6, 7, 11, 13]);
    assert_eq!(ones(3).len(), 25);
    assert_eq!(ones(4), [8, 9]);

    // Whether the agent is at 8 and goes east or at 9 and goes west, a mask of its own says.
    let mut apart = [9; 6 * CELLS];
    corner().show(&mut apart);
    assert_eq!(apart[..4 * CELLS], seen[..4 * CELLS]);
    let cells = |channel: usize| apart[channel * CELLS..][..CELLS].iter().position(|bit| *bit == 1);
    assert_eq!((cells(4), cells(5)), (Some(8), Some(9)));
    assert_eq!(apart[4 * CELLS..].iter().sum::<u8>(), 2);
}

#[test]
fn a_picture_has_everything_in_its_place() {
    let at = |faces| {
        let state = Coins { faces, ..corner() };
        Collecting {
            sees: Field::new("grid", &[5, SIDE, SIDE], Kind::Bit),
            pays: [0.0; 3],
            coins: 1,
            walls: 1,
            state,
        }
        .draw()
        .unwrap()
    };
    let picture = at(0);
    let of = |colour| picture.shapes.iter().filter(move |shape| shape.colour == colour);
    let outline = |colour| of(colour).map(|shape| &shape.outline).collect::<Vec<_>>();
    let [green, red, yellow] = COLOURS.map(outline);
    let disc = |x, y| Outline::Circle([x, y], 0.3);
    assert_eq!(green, [&disc(2.5, 1.5)]);
    assert_eq!(red, [&disc(2.5, 2.5)]);
    assert_eq!(yellow, [&disc(3.5, 1.5)]);
    assert_eq!(of(paint::WALL).count(), 25);
    assert!(outline(paint::WALL).contains(&&Outline::rectangle([4.5, 1.5], [1.0; 2], 0.0)));
    assert_eq!((picture.size, picture.shapes.len()), ([7.0; 2], 1 + 16 + 25 + 3 + 1));
    // Its tip is where it faces.
    let tips = [0, 1, 2, 3].map(|faces| match &at(faces).shapes.last().unwrap().outline {
        Outline::Polygon(corners) => corners[0],
        other => panic!("{other:?}"),
    });
    assert_eq!(tips, [[1.88, 1.5], [1.5, 1.88], [1.12, 1.5], [1.5, 1.12]]);
    let unborn =
        CoinGrid { pays: vec![1.0, 1.0], coins: 2, walls: 0, limit: 120, front_apart: false };
    assert!(unborn.open().unwrap().draw().is_none());
}

#[test]
fn a_cell_is_entered_from_those_beside_it() {
    let env = CoinGrid { pays: vec![1.0; 2], coins: 1, walls: 1, limit: 9, front_apart: true };
    let world =
        Collecting { sees: env.field(), pays: [1.0; 3], coins: 1, walls: 1, state: corner() };
    let entries = world.entries().unwrap();
    // 24 free cells of a square of five: 80 ways, without the six of the wall at the border.
    assert_eq!((entries.sides, entries.acts.len(), entries.seen.len()), ([7, 7], 74, 74));
    // Into the red coin from the west, the north and the south; from the north with what was in the way.
    let into: Vec<usize> = (0..74).filter(|i| entries.cells[*i] == 16).collect();
    let Values::U8(bits) = entries.seen.values(0) else { panic!("bits") };
    let ones = |row: usize, mask: usize| -> Vec<usize> {
        let bits = &bits[(row * 6 + mask) * CELLS..][..CELLS];
        (0..CELLS).filter(|cell| bits[*cell] == 1).collect()
    };
    let from: Vec<usize> = into.iter().map(|row| ones(*row, 4)[0]).collect();
    assert_eq!(from, [15, 9, 17, 23]);
    assert!(into.iter().all(|row| ones(*row, 5) == [16] && ones(*row, 1) == [16]));
    assert_eq!(into.iter().map(|row| ones(*row, 0).len()).collect::<Vec<_>>(), [1, 0, 1, 1]);
}

#[test]
fn the_agent_goes_where_it_faces() {
    let mut state = Coins { coins: [0; 3], walls: Coins::BORDER, at: 24, faces: 3 };
    let ahead = |state: &mut Coins| {
        state.step(1);
        state.ahead()
    };
    assert_eq!([(); 4].map(|()| ahead(&mut state)), [25, 31, 23, 17]);
    // The border holds it.
    (0..5).for_each(|_| assert_eq!(state.step(2), [false; 3]));
    assert_eq!(state.at, 10);
}

#[test]
fn an_episode_starts_with_everything_in_a_cell_of_its_own() {
    let mut luck = Luck::numpy(0);
    for (coins, walls) in [(2, 0), (1, 4), (5, 8)] {
        let (mut ever, mut faced) = (0, [false; 4]);
        for _ in 0..200 {
            let state = Coins::drawn(&mut luck, coins, walls);
            let inner = state.walls & !Coins::BORDER;
            let masks = [inner, state.coins[0], state.coins[1], state.coins[2], 1 << state.at];
            let counts = masks.map(u64::count_ones);
            let expected = [walls, coins, coins, coins, 1];
            assert_eq!(counts.map(|n| n as usize), expected);
            let all = masks.iter().fold(0, |all, mask| all | mask);
            assert_eq!(all.count_ones() as usize, expected.iter().sum::<usize>());
            assert!(all & Coins::BORDER == 0 && state.walls & Coins::BORDER == Coins::BORDER);
            ever |= 1 << state.at;
            faced[state.faces] = true;
        }
        assert_eq!((u64::count_ones(ever), faced), (25, [true; 4]));
    }
}

#[test]
fn no_coin_is_shut_in() {
    // Two walls cut off the corner in which the agent is.
    let shut = Coins { walls: Coins::BORDER | 1 << 9 | 1 << 15, ..corner() };
    let beside = |coin: usize| Coins { coins: [1 << coin, 0, 0], ..shut }.reaches_all();
    assert!(!beside(16) && beside(8));
    assert!(Coins { at: 12, faces: 0, ..corner() }.reaches_all());
}

#[test]
fn a_task_names_two_colours_or_three() {
    assert_eq!(task(&[1.0, -1.0]), Ok([-1.0, 1.0, 0.0]));
    assert_eq!(task(&[2.0, 0.0, -1.0]), Ok([0.0, 2.0, -1.0]));
    assert!(task(&[1.0]).is_err() && task(&[0.0; 4]).is_err());
    let env = |pays| CoinGrid { pays, coins: 2, walls: 0, limit: 120, front_apart: false };
    assert!(env(vec![0.0, -1.0]).pays() && !env(vec![0.0, 0.0]).pays());
    assert!(env(vec![]).spec().is_err() && env(vec![]).open().is_err());
}

/// What is seen, told and paid over an episode of luck agrees.
#[test]
fn a_world_starts_afresh() {
    let pays = vec![1.0, -1.0];
    let env = CoinGrid { pays, coins: 2, walls: 3, limit: 120, front_apart: false };
    let mut seen = Columns::zeros(env.spec().unwrap().sees, 1);
    let (mut world, mut luck) = (env.open().unwrap(), Luck::numpy(5));
    let count = |seen: &Columns, channel: usize| {
        let Values::U8(bytes) = seen.values(0) else { panic!("bytes") };
        bytes[channel * CELLS..][..CELLS].iter().map(|bit| f32::from(*bit)).sum::<f32>()
    };
    for _ in 0..20 {
        let mut told = [7.0; 3];
        world.reset(&mut luck, &mut Row::of(&mut seen, 0, &mut told));
        assert_eq!(told, [0.0; 3]);
        assert_eq!([0, 1, 2, 3, 4].map(|c| count(&seen, c)), [2.0, 2.0, 2.0, 27.0, 2.0]);
        let (mut got, mut return_) = ([0.0; 3], 0.0);
        for _ in 0..100 {
            let act = Act::Index(luck.below(3) as usize);
            let row = &mut Row::of(&mut seen, 0, &mut told);
            let (pays, end) = world.step(act, &mut luck, row);
            return_ += pays;
            (0..3).for_each(|c| got[c] += told[c]);
            assert_eq!([0, 1, 2].map(|c| count(&seen, c) + got[c]), [2.0; 3]);
            assert_eq!(end == End::Terminal, got == [2.0; 3]);
            if end == End::Terminal {
                break;
            }
        }
        assert_eq!(return_, f64::from(got[1] - got[0]));
    }
}
