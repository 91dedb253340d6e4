//! Every kind of golden case is somebody's: a file that nobody reads, or a kind that nobody computes, is no proof.

use std::collections::BTreeSet;
use std::path::Path;

/// Kinds of operations that are not there yet.
const LATER: &[(&str, &str)] = &[
    ("agents_baselines", "reward_threshold"),
    ("model_based_losses", "cmpo"),
    ("model_based_losses", "dreamer_returns"),
    ("model_based_losses", "ive_objective"),
    ("model_based_losses", "nstep_q"),
    ("model_based_losses", "rssm_elbo"),
    ("model_based_losses", "rssm_kl"),
    ("model_based_losses", "vpn"),
];

#[test]
fn golden_every_kind_is_computed_or_named_here() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let sources = std::fs::read_dir(here.join("tests/golden")).expect("tests are there").flatten();
    let others = sources.filter(|entry| entry.file_name() != "claimed.rs");
    // The controllers of cars are compared where they are.
    let others = others.map(|entry| entry.path()).chain([here.join("town/src/pid.rs")]);
    let sources: String =
        others.map(|path| std::fs::read_to_string(path).unwrap_or_default()).collect();
    let sources: String = sources.chars().filter(|c| !c.is_whitespace()).collect();
    // Worlds are compared with theirs in the crate of worlds.
    let of_worlds = ["tests/traces.rs", "src/minatar/transitions.rs", "src/highway/replay.rs"];
    let of_worlds = of_worlds.map(|path| std::fs::read_to_string(here.join("world").join(path)));
    let replays = |topic: &str| {
        let file = format!("\"{topic}.json\"");
        of_worlds.iter().any(|text| text.as_ref().expect("a test").contains(&file))
    };
    let named = |name: &str| sources.contains(&format!("\"{name}\""));
    let mut missing = BTreeSet::new();
    let files = std::fs::read_dir(here.join("../tests/golden")).expect("golden files are there");
    let files = files.flatten().filter(|entry| entry.path().is_file());
    for entry in files {
        let text = std::fs::read_to_string(entry.path()).expect("golden files read");
        let file: serde_json::Value = serde_json::from_str(&text).expect("golden files are JSON");
        let topic = file["topic"].as_str().expect("a topic").to_owned();
        if sources.contains(&format!("check(\"{topic}\",")) || replays(&topic) {
            continue;
        }
        for case in file["cases"].as_array().expect("cases") {
            let kind = case["kind"].as_str().expect("a kind");
            let claimed = named(&topic) && named(kind);
            if claimed == LATER.contains(&(topic.as_str(), kind)) {
                missing.insert((topic.clone(), kind.to_owned()));
            }
        }
    }
    assert_eq!(missing, BTreeSet::new(), "computed by nobody, or named here and computed");
}
