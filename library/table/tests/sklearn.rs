//! What scikit-learn does with the same data, where `IVX_PYTHON` names a Python that has it.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use ivx_data::{Dataset, Form};
use ivx_op::{Ctx, One, Op as _};
use ivx_table::{Folds, Standardised};
use serde_json::{Value, json};

/// Scales the rows of `test` by those of `train`, and counts the classes of `y` in each fold.
const PLAIN: &str = r#"
import json, sys
import numpy
from sklearn.model_selection import KFold, StratifiedKFold
from sklearn.preprocessing import StandardScaler
asked = json.load(sys.stdin)
scaler = StandardScaler().fit(numpy.array(asked["train"]))
counts = []
for case in asked["folds"]:
    y = numpy.array(case["y"])
    splits = StratifiedKFold(case["k"]).split(numpy.zeros(len(y)), y)
    counts.append([numpy.bincount(y[test], minlength=case["n"]).tolist() for _, test in splits])
sizes = [len(test) for _, test in KFold(7).split(numpy.zeros(45))]
print(json.dumps({
    "train": scaler.transform(asked["train"]).ravel().tolist(),
    "test": scaler.transform(asked["test"]).ravel().tolist(),
    "counts": counts, "sizes": sizes,
}))
"#;

const WIDTH: usize = 4;

fn python() -> Option<PathBuf> {
    let python = std::env::var_os("IVX_PYTHON").map(PathBuf::from);
    let has = |python: &PathBuf| {
        let mut asked = Command::new(python);
        asked.args(["-c", "import sklearn"]).stderr(Stdio::null());
        asked.status().is_ok_and(|status| status.success())
    };
    let found = python.filter(has);
    if found.is_none() {
        eprintln!("without IVX_PYTHON, a Python that has scikit-learn, nothing is tried here");
    }
    found
}

fn asked(python: &PathBuf, what: &Value) -> Value {
    let mut child = Command::new(python)
        .args(["-c", PLAIN])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("Python starts");
    let mut stdin = child.stdin.take().expect("it is asked");
    stdin.write_all(what.to_string().as_bytes()).expect("it listens");
    drop(stdin);
    let said = child.wait_with_output().expect("it ends");
    assert!(said.status.success());
    serde_json::from_slice(&said.stdout).expect("it speaks JSON")
}

/// Numbers from -1 to 1 that look random.
fn noise(n: usize, seed: u64) -> Vec<f64> {
    let mut bits = seed;
    let next = std::iter::repeat_with(move || {
        bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        f64::from(u32::try_from(bits >> 32).expect("half of the bits")) / f64::from(1_u32 << 31)
            - 1.0
    });
    next.take(n).collect()
}

/// Rows of numbers of several sizes, of which the last are all the same.
fn rows(n: usize, seed: u64) -> Vec<f64> {
    let scale = |(i, x): (usize, f64)| match i % WIDTH {
        0 => x,
        1 => 1e6 + x,
        2 => 1e-5 * x - 3.0,
        _ => 0.1,
    };
    noise(n * WIDTH, seed).into_iter().enumerate().map(scale).collect()
}

fn data(x: Vec<f64>) -> Dataset {
    let y = vec![0.0; x.len() / WIDTH];
    Dataset { form: Form { input: vec![WIDTH], ..Form::default() }, x, y }
}

#[test]
fn scales_and_folds_are_those_of_scikit_learn() {
    let Some(python) = python() else { return };
    let (train, test) = (rows(57, 1), rows(23, 2));
    let as_rows = |x: &[f64]| x.chunks(WIDTH).map(|row| json!(row)).collect::<Vec<Value>>();
    let drawn = |n: usize, seed| -> Vec<u32> {
        noise(n, seed).iter().map(|x| if *x > 0.6 { 2 } else { u32::from(*x > -0.3) }).collect()
    };
    let cases = [
        (drawn(60, 3), 5),
        (drawn(101, 4), 7),
        (drawn(33, 5), 4),
        (vec![1, 1, 0, 2, 1, 0, 2, 0, 1, 1, 2], 3),
    ];
    let folds = cases.iter().map(|(y, k)| json!({ "y": y, "k": k, "n": 3 }));
    let folds: Vec<Value> = folds.collect();
    let said = asked(
        &python,
        &json!({ "train": as_rows(&train), "test": as_rows(&test), "folds": folds }),
    );

    let scaled = |own: &[f64]| {
        let (own, by) = (One(data(own.to_vec())), One(data(train.clone())));
        let scaled = Standardised { data: own, by, targets: false };
        scaled.run(&Ctx::new("standardised", 0, None)).unwrap().x
    };
    for (own, part) in [(&train, "train"), (&test, "test")] {
        let theirs: Vec<f64> = serde_json::from_value(said[part].clone()).unwrap();
        for (i, (a, b)) in scaled(own).iter().zip(&theirs).enumerate() {
            // Large numbers that lie close lose digits in the mean of either.
            let bound = if i % WIDTH == 1 { 1e-9 } else { 1e-10 };
            assert!((a - b).abs() < bound, "{part} {i}: {a} and {b}");
        }
    }

    for ((y, k), theirs) in cases.iter().zip(said["counts"].as_array().unwrap()) {
        let form = Form { classes: Some(3), ..Form::default() };
        let y: Vec<f64> = y.iter().map(|y| f64::from(*y)).collect();
        let data = Dataset { form, x: y.clone(), y };
        let counts = (0..*k).map(|fold| {
            let folds = Folds { data: One(data.clone()), k: *k, fold, stream: "main".to_owned() };
            let test = folds.run(&Ctx::new("folds", 0, None)).unwrap().test;
            let of = |class: f64| test.y.iter().filter(|y| **y == class).count();
            [of(0.0), of(1.0), of(2.0)]
        });
        assert_eq!(&json!(counts.collect::<Vec<_>>()), theirs);
    }
    let sizes = (0..7).map(|fold| {
        let data = One(Dataset::pairs(vec![0.0; 45], vec![0.0; 45]));
        let folds = Folds { data, k: 7, fold, stream: "main".to_owned() };
        folds.run(&Ctx::new("folds", 0, None)).unwrap().test.len()
    });
    assert_eq!(json!(sizes.collect::<Vec<_>>()), said["sizes"]);
}
