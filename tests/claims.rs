//! What becomes of claims.

use crate::project::Project;

/// The verdicts that a run tells, in the order of the claims.
fn outcomes(claims: &str, axis: &str) -> Vec<String> {
    let spec = format!(
        "edition \"2026\"
experiment e {{
    {axis}
    let data = sample(sinusoids(), n: 5)
    let far = mean(support_distance(data, at: grid(0.0, 1.0, points: 3)), over: x)
    let truth = mean(reward_at(sinusoids(), at: grid(0.0, 1.0, points: 3)), over: x)
    {claims}
}}
"
    );
    let project = Project::with(&[("e.ivx", &spec)]);
    let said = project.run("exec", "e.ivx", &[]);
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    let told = said.out.lines().filter_map(|line| line.strip_prefix("  "));
    told.map(|line| line.split(' ').next().unwrap_or_default().to_owned()).collect()
}

#[test]
fn fewer_than_five_seeds_decide_nothing() {
    let claims = "claim \"paired\" : far < 9.0
    claim \"reduced\" : mean(far, over: seed) < 9.0
    claim \"shared\" : share(far < 9.0, over: seed) >= 0.8
    claim \"reduced far up\" : 2.0 * max(far * 2.0, over: seed) - truth < 99.0
    claim \"one side\" : truth < mean(far, over: seed) + 9.0
    claim \"picked\" : far[seed: 0] < 9.0
    claim \"some\" : mean(far[seed: [0, 1]], over: seed) < 9.0
    claim \"against one\" : far < far[seed: 0] + 9.0
    claim \"deterministic\" : truth < 9.0";
    let (holds, undecided) = ("holds", "undecided");
    let mut expected = [undecided; 9];
    expected[8] = holds;
    assert_eq!(outcomes(claims, "axis seed = 0..4"), expected);
    expected[..5].fill(holds);
    // A largest number of these seeds says nothing of others.
    expected[3] = "describes";
    assert_eq!(outcomes(claims, "axis seed = 0..20"), expected);
}

#[test]
fn without_an_axis_there_is_one_seed() {
    let claims = "claim \"drawn\" : far < 9.0\n claim \"deterministic\" : truth < 9.0";
    assert_eq!(outcomes(claims, ""), ["undecided", "holds"]);
}

#[test]
fn the_want_of_seeds_is_told() {
    let spec = "edition \"2026\"
experiment e {
    let data = sample(sinusoids(), n: 5)
    claim \"near\" : mean(support_distance(data, at: grid(0.0, 1.0, points: 3)), over: x) < 9.0
}
";
    let project = Project::with(&[("e.ivx", spec)]);
    let said = project.run("exec", "e.ivx", &[]).out;
    assert!(said.contains(", n = 1: fewer than 5 seeds decide nothing"), "{said}");
}

#[test]
fn equality_has_a_tolerance() {
    let claims = "claim \"wide\" : far == 0.0 within(9.0)
    claim \"narrow\" : far == 9.0 within(1e-3)
    claim \"plain\" : truth == truth + 0.5 within(0.6)
    claim \"plain and apart\" : truth == truth + 0.5 within(0.4)";
    let told = outcomes(claims, "axis seed = 0..10");
    assert_eq!(told, ["holds", "fails", "holds", "fails"]);
    let project = Project::with(&[(
        "e.ivx",
        "edition \"2026\"\nexperiment e { claim \"x\" : 1.0 == 1.5 // half\n within(0.5) }",
    )]);
    project.executed("e.ivx", &[]);
    let results = project.read("results/e/results.ron");
    assert!(results.contains("claim: \"1.0 == 1.5 within(0.5)\""), "{results}");
}
