use super::*;

fn digest(n: u8) -> Digest {
    Digest([n; 32])
}

/// Nodes by address, key and output; without either, it is 0.
fn run(nodes: &[(&str, u8, u8)]) -> BTreeMap<String, Made> {
    let some = |n: u8| (n > 0).then(|| digest(n));
    let made = |(address, key, output): &(&str, u8, u8)| {
        let (key, output) = (some(*key), some(*output));
        ((*address).to_owned(), Made { key, output, ..Made::default() })
    };
    nodes.iter().map(made).collect()
}

/// What is told, a line a group.
#[track_caller]
fn check(
    before: &[(&str, u8, u8)],
    after: &[(&str, u8, u8)],
    texts: &[(u8, String)],
    expected: &[&str],
) {
    let text = |key: &Digest| {
        texts.iter().find(|(n, _)| digest(*n) == *key).map(|(_, text)| text.as_str())
    };
    let told = shifts(&run(before), &run(after), &text).into_iter().map(|shift| {
        let Shift { binding, how, roots, nodes } = shift;
        let roots: Vec<String> = roots.iter().map(ToString::to_string).collect();
        format!("{} {binding} {how:?}: {}", nodes.len(), roots.join("; "))
    });
    assert_eq!(told.collect::<Vec<_>>(), expected);
}

fn data(n: u8) -> String {
    format!("format 1\nop sample@1\narg.n {n}\nseed 0\n")
}

fn model(input: u8) -> String {
    format!("format 1\nop train@1\nport on 1\ninput {}\n", digest(input))
}

#[test]
fn a_change_is_followed_to_where_it_began() {
    let before =
        [("e/data[seed=0]", 1, 11), ("e/fit/member[0]", 2, 12), ("e/fit/member[1]", 3, 13)];
    let after = [("e/data[seed=0]", 4, 14), ("e/fit/member[0]", 5, 15), ("e/fit/member[1]", 6, 16)];
    let texts = [
        (1, data(8)),
        (4, data(9)),
        (2, model(11)),
        (5, model(14)),
        (3, model(11)),
        (6, model(14)),
    ];
    let told = [
        "1 e/data Rekeyed: `sample.n` was 8, is 9 (e/data)",
        "2 e/fit/member Rekeyed: `sample.n` was 8, is 9 (e/data)",
    ];
    check(&before, &after, &texts, &told);
    check(&before, &before, &texts, &[]);
    let lost = "1 e/data Rekeyed: the cache has lost what e/data was made from";
    check(&before[..1], &after[..1], &texts[..1], &[lost]);
}

#[test]
fn another_result_of_a_key_is_a_root_and_nodes_may_take_another_input() {
    let before = [("e/a", 1, 11), ("e/b", 2, 12), ("e/fit", 3, 13)];
    let remade = [("e/a", 1, 21), ("e/b", 2, 12), ("e/fit", 4, 14)];
    let texts = [(3, model(11)), (4, model(21)), (5, model(12))];
    let told = ["1 e/fit Rekeyed: e/a came out otherwise, of the same key", "1 e/a Remade: "];
    check(&before, &remade, &texts, &told);
    let other = [("e/a", 1, 11), ("e/b", 2, 12), ("e/fit", 5, 15)];
    check(&before, &other, &texts, &["1 e/fit Rekeyed: `train.on` was e/a, is e/b (e/fit)"]);
}

/// What is told of nodes that the second run, or the first, does not know like the other.
#[track_caller]
fn check_fates(ended: &[(&str, u8, Ended)], expected: &[&str], back: &[&str]) {
    let known: Vec<_> = ended.iter().map(|(address, ..)| (*address, 1, 11)).collect();
    let known = run(&known);
    let other = ended.iter().map(|(address, key, fate)| {
        let explanation = (*fate == Ended::Failed).then(|| data(*key));
        let key = (*key > 0).then(|| digest(*key));
        let cause = (*fate == Ended::Skipped).then(|| "e/run[seed=0]".to_owned());
        ((*address).to_owned(), Made { key, output: None, fate: *fate, cause, explanation })
    });
    let other: BTreeMap<String, Made> = other.collect();
    let one = data(1);
    let text = |key: &Digest| (*key == digest(1)).then_some(one.as_str());
    for (before, after, expected) in [(&known, &other, expected), (&other, &known, back)] {
        let told = shifts(before, after, &text).into_iter().map(|shift| {
            let roots: Vec<String> = shift.roots.iter().map(ToString::to_string).collect();
            format!("{} {:?}: {}", shift.binding, shift.how, roots.join("; "))
        });
        assert_eq!(told.collect::<Vec<_>>(), expected);
    }
}

#[test]
fn what_has_no_result_says_how_it_came_to_that() {
    let ended = [
        ("e/again", 1, Ended::Failed),
        ("e/never", 0, Ended::Waiting),
        ("e/run[seed=0]", 2, Ended::Failed),
        ("e/then", 0, Ended::Skipped),
    ];
    let told = [
        "e/again Failed: ",
        "e/run Failed: `sample.n` was 1, is 2 (e/run)",
        "e/then Skipped: e/run failed",
        "e/never NotRun: ",
    ];
    let back = [
        "e/again Mended: ",
        "e/never Mended: ",
        "e/run Mended: `sample.n` was 2, is 1 (e/run)",
        "e/then Mended: e/run does not fail any more",
    ];
    check_fates(&ended, &told, &back);
}

#[test]
fn nodes_come_and_go_with_their_coordinates() {
    let before = [("e/a[seed=0,ke=x]", 1, 0), ("e/old", 2, 0), ("e/gone", 9, 0)];
    let after = [
        ("e/a[seed=0,ke=x]", 1, 0),
        ("e/a[seed=2,ke=x]", 3, 0),
        ("e/a[seed=10,ke=x]", 4, 0),
        ("e/named", 2, 0),
        ("e/new", 0, 0),
    ];
    let told = [
        "1 e/named Renamed: it was e/old",
        "2 e/a Added: seed = 2, 10",
        "1 e/new Added: ",
        "1 e/gone Gone: ",
    ];
    check(&before, &after, &[], &told);
}

#[test]
fn a_node_that_makes_its_own_input_ends_the_search() {
    let texts = [(1, model(11)), (2, model(12))];
    check(&[("e/a", 1, 11)], &[("e/a", 2, 12)], &texts, &["1 e/a Rekeyed: "]);
}
