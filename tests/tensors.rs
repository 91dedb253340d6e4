//! Artifact files beside Python's safetensors, and the order of what is in them.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::process::Command;

use ivx_cache::Digest;
use ivx_data::Dataset;
use ivx_library::learner::{Learner as _, MapEstimate, Normal};
use ivx_nn::{Adam, Constant, Mlp, Squared, Tanh};
use ivx_nn::{Model, NetModel};
use ivx_op::{Artifact as _, Ctx, Data, Tensors, read_tensors};

/// Prints the arrays of `ours.safetensors` as JSON, their numbers bit by bit; writes their halves to `halves.safetensors`
/// with the same metadata, and arrays of its own to `theirs.safetensors`.
const SCRIPT: &str = r#"
import json
import numpy as np
from safetensors import safe_open
from safetensors.numpy import load_file, save_file

ours = load_file("ours.safetensors")
told = {n: [str(a.dtype), list(a.shape), a.ravel().view("uint32").tolist()] for n, a in ours.items()}
print(json.dumps(told))
with safe_open("ours.safetensors", framework="numpy") as file:
    metadata = file.metadata()
save_file({n: a / 2 for n, a in ours.items()}, "halves.safetensors", metadata)
save_file({
    "z": np.arange(6, dtype="float32").reshape(2, 3) / 4,
    "a": np.array([0.1, -1e300]),
    "0.weight": np.zeros((0, 2), dtype="float32"),
    "raw": np.frombuffer(b"ivx", dtype="uint8"),
}, "theirs.safetensors")
"#;

/// A trained network.
fn net() -> NetModel {
    let learner = MapEstimate {
        net: Box::new(Mlp { hidden: vec![3, 2], activation: Box::new(Tanh {}) }),
        prior: Box::new(Normal { mean: 0.0, std: 1.0 }),
        loss: Box::new(Squared { noise: 0.1 }),
        adversarial: 0.0,
        batch: 0,
        optimiser: Box::new(Adam {
            lr: Box::new(Constant { value: 0.01 }),
            beta1: 0.9,
            beta2: 0.999,
            eps: 1e-8,
        }),
    };
    let data = Dataset::pairs(vec![-1.0, 0.0, 1.0], vec![1.0, 0.0, 1.0]);
    let model = learner.train(&data, 5, &Ctx::new("train", 0, None)).expect("there are data");
    let Model::Net(net) = model else { panic!("it learns networks") };
    net
}

/// Needs a Python with `safetensors` and `numpy`: that of the variable `PYTHON`, or `python3`.
#[test]
fn python_reads_what_we_write_and_we_what_it_writes() {
    let python = std::env::var_os("PYTHON").unwrap_or_else(|| OsString::from("python3"));
    let there = Command::new(&python).args(["-c", "import safetensors.numpy"]).output();
    if !there.is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: {} has no safetensors", python.display());
        return;
    }
    let folder = tempfile::tempdir().expect("a folder can be made");
    let net = net();
    fs::write(folder.path().join("ours.safetensors"), Model::Net(net.clone()).encode())
        .expect("files can be written");
    let output = Command::new(&python).args(["-c", SCRIPT]).current_dir(folder.path()).output();
    let output = output.expect("it ran before");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));

    let told: BTreeMap<String, (String, Vec<usize>, Vec<u32>)> =
        serde_json::from_slice(&output.stdout).expect("it prints JSON");
    let ours = net.nets.arrays.iter().map(|(name, shape, values)| {
        let values = values.iter().map(|x| x.to_bits()).collect();
        (name.clone(), ("float32".to_owned(), shape.clone(), values))
    });
    assert_eq!(told, ours.collect());

    let read = |name: &str| fs::read(folder.path().join(name)).expect("it writes the file");
    let mut halves = net;
    halves.nets.arrays.iter_mut().flat_map(|(.., values)| values).for_each(|x| *x /= 2.0);
    assert_eq!(Model::decode(&read("halves.safetensors")), Some(Model::Net(halves)));

    let (theirs, metadata) = read_tensors(&read("theirs.safetensors")).expect("it is read");
    let expected = [
        ("z", Data::F32(vec![2, 3], vec![0.0, 0.25, 0.5, 0.75, 1.0, 1.25])),
        ("a", Data::F64(vec![2], vec![0.1, -1e300])),
        ("0.weight", Data::F32(vec![0, 2], vec![])),
        ("raw", Data::bytes(b"ivx".to_vec())),
    ];
    let arrays = expected.map(|(name, data)| (name.to_owned(), data)).into();
    assert_eq!((theirs, metadata.len()), (Tensors { arrays }, 0));
}

#[test]
fn arrays_lie_in_one_order_whatever_the_order_in_which_they_came() {
    let net = net();
    let file = Model::Net(net.clone()).encode();
    for turn in 0..net.nets.arrays.len() {
        let mut turned = net.clone();
        turned.nets.arrays.rotate_left(turn);
        turned.nets.arrays.swap(0, 1);
        assert_eq!(Digest::of(&Model::Net(turned).encode()), Digest::of(&file), "{turn}");
    }
    // And another array's numbers under a name are another file.
    let mut other = net;
    let (first, rest) = other.nets.arrays.split_at_mut(1);
    std::mem::swap(&mut first[0].2[0], &mut rest[0].2[0]);
    assert_ne!(Digest::of(&Model::Net(other).encode()), Digest::of(&file));

    // Wider numbers come first in the file, names after that.
    let arrays = [
        ("b", Data::F32(vec![1], vec![1.0])),
        ("c", Data::F64(vec![1], vec![2.0])),
        ("a", Data::F32(vec![1], vec![3.0])),
    ];
    let encode = |places: [usize; 3]| {
        let mut tensors = Tensors::default();
        for place in places {
            let (name, data) = &arrays[place];
            tensors.arrays.insert((*name).to_owned(), data.clone());
        }
        tensors.encode("Toy", &())
    };
    let file = encode([0, 1, 2]);
    assert!([[1, 0, 2], [2, 1, 0], [2, 0, 1]].into_iter().all(|places| encode(places) == file));
    let numbers = [&2.0_f64.to_le_bytes()[..], &3.0_f32.to_le_bytes(), &1.0_f32.to_le_bytes()];
    assert!(file.ends_with(&numbers.concat()));
}
