//! Names that meet: whatever a spec calls its items, each node and each column has a name of its own.

use std::collections::BTreeSet;

use ivx_engine::{Measure, Results, expand, tidy};
use ivx_grammar::check::{File, Project, Settings, check, runs};
use ivx_grammar::parse;
use ivx_op::{Dim, Labels};
use proptest::collection::{hash_set, vec};
use proptest::prelude::{ProptestConfig, proptest};
use proptest::sample::select;
use proptest::test_runner::RngSeed;

const NAMES: [&str; 8] = ["m", "value", "member", "figures", "train", "claims", "e", "rmse"];
const TEXTS: [&str; 16] = [
    "m", "value", "figure", "e/m", "m[k=a]", "m/rmse", "#0", "m#1", "a]", "[", "a=b", " ", "\\\"",
    "a, b", "ä", "a b",
];

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: RngSeed::Fixed(0), failure_persistence: None, ..Default::default()
    })]

    #[test]
    fn every_node_has_an_address_of_its_own_whatever_names_are(
        names in hash_set(select(&NAMES[..]), 3),
        files in vec(select(&NAMES[..]), 2),
        claim in select(&TEXTS[..]),
        labels in hash_set(select(&TEXTS[..]), 2..4),
    ) {
        let names: Vec<&str> = names.into_iter().collect();
        let [axis, data, measure] = names[..] else { unreachable!("there are three") };
        let labels: Vec<String> = labels.iter().map(|label| format!("\"{label}\"")).collect();
        let spec = format!(
            "edition \"2026\"\nexperiment e {{\n axis seed = 0..2\n axis {axis} = [{}]\n \
             let {data} = sample(sinusoids(), n: 3, stream: {axis})\n \
             measure {measure} = rmse(train(linear_mle(features: polynomial(degree: 0)), on: {data}), on: {data})\n \
             figure \"{}\" = bars({measure} + 1.0, by: {axis})\n \
             table \"{}\" = table([{measure} + 1.0, {measure} * 2.0], rows: {axis})\n \
             claim \"{}\" : {measure} + 1.0 > {measure}\n}}\n",
            labels.join(", "), files[0], files[1], claim,
        );
        let (ast, faults) = parse(&spec, 0);
        let file = File { path: "e.ivx".into(), stem: "e".into(), text: spec.clone(), ast: ast.into(), ..File::default() };
        let registry = ivx_library::registry();
        let (ir, more) = check(&Project { files: vec![file] }, &registry, &Settings::default());
        assert!(claim.trim().is_empty() || runs(&faults) && runs(&more), "{more:?}\n{spec}");
        if runs(&faults) && runs(&more) {
            let plan = expand(&ir, &registry);
            let addresses: BTreeSet<&str> =
                plan.graph.node_weights().map(|step| step.address.as_str()).collect();
            assert_eq!(addresses.len(), plan.graph.node_count(), "{spec}");
        }
    }

    #[test]
    fn every_column_of_an_export_has_a_name_of_its_own(
        names in hash_set("(axis_){0,2}(value|experiment|measure|n)", 0..5),
    ) {
        let dims: Vec<Dim> =
            names.iter().map(|name| Dim::new(name, Labels::Numbers(vec![7.0]))).collect();
        let mut results = Results::default();
        let measures = &mut results.experiments.entry("e".to_owned()).or_default().measures;
        measures.insert("m".to_owned(), Measure { dims, values: vec![0.5], ..Measure::default() });
        let csv = tidy(&results, "").to_csv();
        let columns: Vec<&str> = csv.lines().next().unwrap_or_default().split(',').collect();
        let own: BTreeSet<&str> = columns.iter().copied().collect();
        assert_eq!((own.len(), own.len()), (columns.len(), names.len() + 3), "{csv}");
    }
}
