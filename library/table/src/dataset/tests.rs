use ivx_data::form;

use super::*;
use crate::npz;

fn choice(targets: &[&str]) -> Choice {
    Choice {
        inputs: Vec::new(),
        except: Vec::new(),
        targets: owned(targets),
        one_hot: Vec::new(),
        categories: BTreeMap::new(),
        classes: Classes::None,
        gaps: Gaps::Refused,
    }
}

fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(ToString::to_string).collect()
}

fn csv(text: &str, choice: &Choice) -> Result<Dataset, String> {
    dataset("d.csv", text.as_bytes(), (b',', true), choice).map(nameless)
}

fn file(bytes: &[u8], choice: &Choice) -> Result<Dataset, String> {
    dataset("d.npz", bytes, (b',', true), choice).map(nameless)
}

/// The observations alone.
fn nameless(mut data: Dataset) -> Dataset {
    data.form.names = Names::default();
    data
}

fn form(input: &[usize], target: &[usize], classes: Option<usize>) -> Form {
    Form { input: input.to_vec(), target: target.to_vec(), classes, ..Form::default() }
}

#[test]
fn columns_are_inputs_and_targets() {
    let text = "x0,x1,y\n1,2,3\n4,5,6\n";
    let all = csv(text, &choice(&["y"])).unwrap();
    assert_eq!(all.form, form(&[2], &[], None));
    assert_eq!((all.x, all.y), (vec![1.0, 2.0, 4.0, 5.0], vec![3.0, 6.0]));
    let one = csv(text, &Choice { inputs: owned(&["x1"]), ..choice(&["y"]) }).unwrap();
    assert_eq!(one, Dataset::pairs(vec![2.0, 5.0], vec![3.0, 6.0]));
    let turned = csv(text, &Choice { inputs: owned(&["y", "x0"]), ..choice(&["x1"]) }).unwrap();
    assert_eq!((turned.x, turned.y), (vec![3.0, 1.0, 6.0, 4.0], vec![2.0, 5.0]));
    let several = csv(text, &choice(&["y", "x0"])).unwrap();
    assert_eq!((several.form, several.y), (form(&[], &[2], None), vec![3.0, 1.0, 6.0, 4.0]));
    // What is neither is not looked at.
    let text = "name,x,y\nAnn,1,2\n";
    let named = csv(text, &Choice { inputs: owned(&["x"]), ..choice(&["y"]) }).unwrap();
    assert_eq!(named, Dataset::pairs(vec![1.0], vec![2.0]));
}

#[test]
fn all_but_some_are_inputs() {
    let text = "name,a,b,y,z\nAnn,1,2,3,4\nBob,5,6,7,8\n";
    let found = |except: &[&str]| csv(text, &Choice { except: owned(except), ..choice(&["y"]) });
    let two = found(&["z", "name"]).unwrap();
    assert_eq!((two.form, two.x), (form(&[2], &[], None), vec![1.0, 2.0, 5.0, 6.0]));
    // A target is no input anyway, so that one list does for several targets.
    let one = found(&["name", "y", "z", "a"]).unwrap();
    assert_eq!(one, Dataset::pairs(vec![2.0, 6.0], vec![3.0, 7.0]));
    let why = |except: &[&str]| found(except).unwrap_err();
    assert_eq!(why(&["w"]), "it has no column `w`; it has `name`, `a`, `b`, `y`, `z`");
    assert_eq!(why(&[""]), "it has no column ``; it has `name`, `a`, `b`, `y`, `z`");
    assert!(why(&["name", "a", "b", "z"]).contains("`except` leaves no input"));
    assert!(why(&["z"]).contains("name"));
    let one_hot = Choice { one_hot: owned(&["name"]), ..choice(&["y"]) };
    assert_eq!(csv(text, &one_hot).unwrap().form.input, [5]);
    let why = csv(text, &Choice { except: owned(&["name"]), ..one_hot }).unwrap_err();
    assert_eq!(why, "`name` is of no input: `except` leaves it out");
}

#[test]
fn labels_are_counted_in_order() {
    let check = |labels: &str, classes: Classes, expected: Result<(&[f64], usize), &str>| {
        let text =
            labels.split(' ').fold("x,y\n".to_owned(), |text, label| text + "0," + label + "\n");
        let found = csv(&text, &Choice { classes, ..choice(&["y"]) });
        match expected {
            Ok((y, n)) => {
                let found = found.unwrap();
                assert_eq!((&*found.y, found.form), (y, form(&[], &[], Some(n))), "{labels}");
            }
            Err(why) => assert_eq!(found, Err(why.to_owned())),
        }
    };
    let listed = |names: &[&str]| Classes::Listed(owned(names));
    check("b a b none", Classes::Sorted, Ok((&[1.0, 0.0, 1.0, 2.0], 3)));
    check("10 9 9.0 -1", Classes::Sorted, Ok((&[2.0, 1.0, 1.0, 0.0], 3)));
    check("b a", listed(&["c", "b", "a"]), Ok((&[1.0, 2.0], 3)));
    check("1.0 2", listed(&["2", "1"]), Ok((&[1.0, 0.0], 2)));
    check(
        "b z",
        listed(&["a", "b"]),
        Err("observation 2 has `z` in `y`, which is none of `a`, `b`"),
    );
    check("2 0", Classes::Indices(3), Ok((&[2.0, 0.0], 3)));
    check("3", Classes::Indices(3), Err("3 is no index of 3 classes"));
    let arrays = npz::write(&[("x", &[3], &[0.0; 3]), ("y", &[3], &[7.0, 5.0, 7.0])]);
    let found = file(&arrays, &Choice { classes: Classes::Sorted, ..choice(&["y"]) }).unwrap();
    assert_eq!((found.y, found.form.classes), (vec![1.0, 0.0, 1.0], Some(2)));
}

#[test]
fn texts_become_numbers_of_their_own() {
    let text = "size,colour,y\n1,red,0\n2,blue,0\n3,red,1\n";
    let one_hot = owned(&["colour"]);
    let found = csv(text, &Choice { one_hot: one_hot.clone(), ..choice(&["y"]) }).unwrap();
    assert_eq!(found.form, form(&[3], &[], None));
    assert_eq!(found.x, [1.0, 0.0, 1.0, 2.0, 1.0, 0.0, 3.0, 0.0, 1.0]);
    // What stands only in rows that are left out is none of them.
    let dropped = Choice { one_hot, gaps: Gaps::Dropped, ..choice(&["y"]) };
    let found = csv("colour,y\nred,0\nblue,\n,1\n", &dropped).unwrap();
    assert_eq!((found.form, found.x), (form(&[1], &[], None), vec![1.0]));
}

#[test]
fn gaps_are_refused_dropped_or_filled() {
    let text = "a,b,y\n1,NA,1\n3,5,2\n,7,3\n2,6,\n";
    let found = |gaps| csv(text, &Choice { gaps, ..choice(&["y"]) });
    let why = found(Gaps::Refused).unwrap_err();
    assert!(why.contains("line 2, column `b`: `NA` is no number"), "{why}");
    let dropped = found(Gaps::Dropped).unwrap();
    assert_eq!((dropped.x, dropped.y), (vec![3.0, 5.0], vec![2.0]));
    let why = found(Gaps::Means).unwrap_err();
    assert!(why.contains("observation 4 has no number in `y`, which is a target"), "{why}");
    let text = "a,b,y\n1,,1\n3,5,2\n,7,3\n";
    let found = |gaps| csv(text, &Choice { gaps, ..choice(&["y"]) }).map(|data| data.x);
    assert_eq!(found(Gaps::Filled(-1.0)), Ok(vec![1.0, -1.0, 3.0, 5.0, -1.0, 7.0]));
    assert_eq!(found(Gaps::Means), Ok(vec![1.0, 6.0, 3.0, 5.0, 2.0, 7.0]));
    let x = [1.0, f64::NAN, f64::NAN, 4.0];
    let arrays = npz::write(&[("x", &[2, 2], &x), ("y", &[2], &[1.0, 2.0])]);
    let found = |gaps| file(&arrays, &Choice { gaps, ..choice(&["y"]) }).map(|data| data.x);
    assert_eq!(found(Gaps::Means), Ok(vec![1.0, 4.0, 1.0, 4.0]));
    assert!(found(Gaps::Refused).unwrap_err().contains("observation 1 has NaN in `x`"));
    assert_eq!(found(Gaps::Dropped), Ok(vec![]));
}

#[test]
fn images_keep_their_shape() {
    let x: Vec<f64> = (0..12).map(f64::from).collect();
    let arrays = npz::write(&[("x", &[2, 1, 2, 3], &x), ("y", &[2], &[2.0, 0.0])]);
    let classes = Classes::Indices(3);
    let found = file(&arrays, &Choice { classes, ..choice(&["y"]) }).unwrap();
    assert_eq!(found, Dataset { form: form(&[1, 2, 3], &[], Some(3)), x, y: vec![2.0, 0.0] });
}

#[test]
fn many_columns_take_no_longer_each() {
    let names: Vec<String> = (0..50_000).map(|i| format!("c{i}")).collect();
    let row = "1,".repeat(50_000);
    let wide = csv(&format!("{},y\n{row}2\n", names.join(",")), &choice(&["y"])).unwrap();
    assert_eq!((wide.form.input, wide.y), (vec![50_000], vec![2.0]));
}

#[test]
fn what_is_there_instead_is_told() {
    let check = |found: Result<Dataset, String>, expected: &str| {
        let why = found.unwrap_err();
        assert!(why.contains(expected), "{why}");
    };
    let y = || choice(&["y"]);
    check(csv("x,z\n1,2\n", &y()), "it has no column `y`; it has `x`, `z`");
    check(csv("y\n1\n", &y()), "nothing but its targets");
    check(csv("x,y\n1,a\n", &y()), "line 2, column `y`: `a` is no number");
    let stray = Choice { one_hot: owned(&["y"]), ..y() };
    check(csv("x,y\n1,2\n", &stray), "`y` is of no input");
    let two = Choice { classes: Classes::Sorted, ..choice(&["x", "y"]) };
    check(csv("z,x,y\n1,2,3\n", &two), "here are several");
    let many = (0..5000).fold("c,y\n".to_owned(), |text, i| text + &format!("t{i},1\n"));
    check(csv(&many, &Choice { one_hot: owned(&["c"]), ..y() }), "5000 different texts");
    let arrays = |x: &[usize], n: usize, y_len: usize| {
        npz::write(&[("x", x, &vec![0.0; n]), ("y", &[y_len], &vec![0.0; y_len])])
    };
    check(file(&arrays(&[1], 1, 2), &y()), "there are 1 of `x` and 2 of `y`");
    check(file(&arrays(&[1, 1, 1, 1, 1], 1, 1), &y()), "and not [1, 1, 1, 1, 1]");
    check(file(&arrays(&[2, 0], 0, 2), &y()), "and not [2, 0]");
    let number = npz::write(&[("x", &[], &[0.0]), ("y", &[1], &[0.0])]);
    check(file(&number, &y()), "`x` is a single number, and no column");
}

/// Files whose columns, texts or classes are not the same are told apart by what a model was trained on.
#[test]
fn names_tell_files_apart() {
    let of = |text: &str, choice: &Choice| {
        dataset("d.csv", text.as_bytes(), (b',', true), choice).unwrap().form
    };
    let differ = |(one, other): (&str, &str), choice: &Choice| {
        let (one, other) = (of(one, choice), of(other, choice));
        assert!(form::same(&one, &one).is_ok());
        form::same(&one, &other).map_err(|why| why.message)
    };
    let columns = differ(("p,q,y\n1,2,3\n", "q,p,y\n1,2,3\n"), &choice(&["y"]));
    let why = "number 1 of the inputs is `p` to the model and `q` in the data";
    assert_eq!(columns, Err(why.to_owned()));
    // One input is what it is called, and no other can stand in its place.
    assert_eq!(differ(("p,y\n1,2\n", "q,y\n1,2\n"), &choice(&["y"])), Ok(()));

    let labelled = Choice { classes: Classes::Sorted, ..choice(&["y"]) };
    let classes = differ(("x,y\n1,cat\n2,dog\n", "x,y\n1,dog\n2,fox\n"), &labelled);
    let why = "number 1 of the classes is `cat` to the model and `dog` in the data";
    assert_eq!(classes, Err(why.to_owned()));
    assert_eq!(differ(("x,y\n1,1\n2,2.0\n", "x,y\n1,1.0\n2,2\n"), &labelled), Ok(()));
    let classes = Classes::Listed(owned(&["cat", "dog", "fox"]));
    let listed = Choice { classes, ..labelled };
    assert_eq!(differ(("x,y\n1,cat\n2,dog\n", "x,y\n1,dog\n2,fox\n"), &listed), Ok(()));

    let coloured = Choice { one_hot: owned(&["c"]), ..choice(&["y"]) };
    let texts = differ(("c,y\nred,1\ngreen,2\n", "c,y\nred,1\nyellow,2\n"), &coloured);
    let why = "number 1 of the inputs is `c=green` to the model and `c=red` in the data";
    assert_eq!(texts, Err(why.to_owned()));
}

/// Files of which each has some of the texts are read alike where the texts are said.
#[test]
fn texts_of_two_files_are_said() {
    let categories = BTreeMap::from([("c".to_owned(), owned(&["red", "green", "blue"]))]);
    let said = Choice { one_hot: owned(&["c"]), categories, ..choice(&["y"]) };
    let (one, other) =
        (csv("c,y\nred,1\ngreen,2\n", &said).unwrap(), csv("c,y\nblue,1\nred,2\n", &said).unwrap());
    assert_eq!(one.x, [0.0, 0.0, 1.0, 0.0, 1.0, 0.0]);
    assert_eq!(other.x, [1.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    let why = csv("c,y\nyellow,1\n", &said).unwrap_err();
    assert_eq!(why, "`c` has the text `yellow`, which is none of `red`, `green`, `blue`");
}

#[test]
fn one_class_is_none() {
    for classes in [Classes::Sorted, Classes::Listed(owned(&["a"]))] {
        let why = csv("x,y\n1,a\n2,a\n", &Choice { classes, ..choice(&["y"]) }).unwrap_err();
        assert_eq!(why, "its targets are of 1 class, and there is nothing to tell apart");
    }
    assert!(csv("x,y\n1,0\n", &Choice { classes: Classes::Indices(1), ..choice(&["y"]) }).is_err());
}

#[test]
fn gaps_of_texts_are_those_of_numbers() {
    let text = "x,y\n1,0\n2,NA\n3,10\n4,?\n5,\n6,null\n7,NaN\n";
    let with = |gaps, classes| Choice { classes, gaps, ..choice(&["y"]) };
    let found = csv(text, &with(Gaps::Dropped, Classes::Sorted)).unwrap();
    assert_eq!((found.x, found.y), (vec![1.0, 3.0], vec![0.0, 1.0]));
    let why = csv(text, &with(Gaps::Filled(0.0), Classes::Sorted)).unwrap_err();
    assert!(why.starts_with("observation 2 has no text in `y`: `missing: dropped()`"), "{why}");
    // Who says that it is a class means it.
    let listed = Classes::Listed(owned(&["0", "NA", "10"]));
    assert_eq!(csv(text, &with(Gaps::Dropped, listed)).unwrap().y, [0.0, 1.0, 2.0]);
}

#[test]
fn a_text_is_told_what_makes_a_number_of_it() {
    let why = csv("x,y\n1,setosa\n", &choice(&["y"])).unwrap_err();
    assert!(why.contains("`setosa` is no number: `labels: true` makes"), "{why}");
}
