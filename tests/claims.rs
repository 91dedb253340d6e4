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

const SPEC: &str = "edition \"2026\"
experiment e {
    axis seed = 0..20
    param most: Float = 9.0
    let data = sample(sinusoids(), n: 5)
    let far = mean(support_distance(data, at: grid(0.0, 1.0, points: 3)), over: x)
    measure far_at = far
    claim \"near\" : far < most
    claim \"not far\" : far > 0.9
}
experiment f {
    axis seed = 0..20
    claim \"true\" : 1.0 < 2.0
    claim \"other\" family \"F\" : e.far < 9.0
    claim \"par\" family \"F\" : e.far on par with 0.0 within(0.001, \"the width of a line\")
}
";

#[test]
fn a_registered_claim_that_changes_is_told() {
    let project = Project::with(&[("e.ivx", SPEC)]);
    let said = project.run("claims", "e.ivx", &["--since", "ivx.lock"]);
    assert_eq!(said.code, 2, "{}{}", said.out, said.err);
    assert_eq!(project.run("exec", "e.ivx", &["--register"]).code, 0);
    let lock = project.read("ivx.lock");
    assert!(!lock.contains(project.path("").to_str().expect("paths are text")), "{lock}");
    let said = project.run("exec", "e.ivx", &["--locked"]);
    assert!(said.code == 0 && said.out.contains("as locked"), "{}", said.out);
    let at = project.path("ivx.lock").display().to_string();
    let said = project.run("claims", "e.ivx", &["--since", &at]);
    assert_eq!((said.code, said.out.trim()), (0, "no claim, threshold or parameter changed"));

    // Where lines are broken is no part of a claim.
    let broken = "e.far on par\n    with 0.0 within(\n        0.001,\n        \"the width of a line\",\n    )";
    let whole = "e.far on par with 0.0 within(0.001, \"the width of a line\")";
    project.write("e.ivx", &SPEC.replace(whole, broken));
    let said = project.run("claims", "e.ivx", &["--since", &at]);
    assert_eq!((said.code, said.out.trim()), (0, "no claim, threshold or parameter changed"));

    // A lock of another name beside the spec is the one that is read.
    project.write("other.lock", "no lock");
    let other = project.path("other.lock").display().to_string();
    assert_ne!(project.run("claims", "e.ivx", &["--since", &other]).code, 0);
    // A verdict that moves, and a parameter and a threshold that are changed after it was seen.
    project.write(
        "e.ivx",
        &SPEC.replace("most: Float = 9.0", "most: Float = 0.001").replace("> 0.9", "> 0.8"),
    );
    let said = project.run("claims", "e.ivx", &["--since", &at]);
    assert_eq!(said.code, 1);
    assert!(said.out.contains("~ param e.most: 9.0 -> 0.001"), "{}", said.out);
    assert!(said.out.contains("claim e/\"not far\", registered on 20"), "{}", said.out);
    assert!(said.out.contains(": far > 0.9 -> far > 0.8"), "{}", said.out);
    let said = project.run("exec", "e.ivx", &["--locked"]);
    assert!(
        said.code == 1 && said.out.contains("! claim e/\"near\": holds -> fails"),
        "{}",
        said.out
    );

    // Other data: the measure leaves its interval.
    project.write("e.ivx", &SPEC.replace("n: 5", "n: 50"));
    let said = project.run("exec", "e.ivx", &["--locked"]);
    assert!(
        said.code == 1 && said.out.contains("~ measure e/far_at: 1 of 1 moved"),
        "{}",
        said.out
    );
}

#[test]
fn what_seeds_can_tell_is_listed_once_they_are_judged() {
    let project = Project::with(&[("e.ivx", SPEC)]);
    let said = project.run("plan", "e.ivx", &["--power"]);
    assert!(said.out.contains("5 claims are not judged yet"), "{}", said.out);
    project.executed("e.ivx", &[]);
    let said = project.run("plan", "e.ivx", &["--power"]);
    let lines = said.out.lines().filter(|line| line.contains(" seeds tell this"));
    assert!(lines.count() == 4 && !said.out.contains("true"), "{}", said.out);
}

#[test]
fn verdicts_among_others_stand_beside_those_by_themselves() {
    let project = Project::with(&[("e.ivx", SPEC)]);
    let said = project.run("exec", "e.ivx", &[]).out;
    let line = |words: &str| {
        let line = said.lines().find(|line| line.contains(words));
        line.unwrap_or_else(|| panic!("{words}: {said}")).to_owned()
    };
    assert!(line("not far").contains("[among 2: p < 0.0001]"), "{said}");
    assert!(line("holds     other").contains("[among 2: p < 0.0001]"), "{said}");
    assert!(line("fails     par").contains("[among 2: p < 0.0001]"), "{said}");
    assert!(line("true").contains("[deterministic; cannot fail]"), "{said}");
}

#[test]
fn what_cannot_fail_is_marked() {
    let claims = "claim \"itself\" : far == far
    claim \"spread\" : std(far, over: seed) >= 0.0
    claim \"share\" : share(far < 9.0, over: seed) <= 1.0
    claim \"could\" : std(far, over: seed) > 0.0
    claim \"least\" : min(far, over: seed) > 0.0
    claim \"most\" : far < max(far, over: seed) + 1.0
    claim \"far out\" : quantile(far, q: 0.9, over: seed) < 9.0
    claim \"bent\" : (mean(far, over: seed) > 0.0) > 0.5";
    let spec = format!(
        "edition \"2026\"
experiment e {{
    axis seed = 0..10
    let data = sample(sinusoids(), n: 5)
    let far = mean(support_distance(data, at: grid(0.0, 1.0, points: 3)), over: x)
    {claims}
}}
"
    );
    let project = Project::with(&[("e.ivx", &spec)]);
    let said = project.run("claims", "e.ivx", &[]).out;
    for words in ["itself", "spread", "share"] {
        assert!(said.contains(&format!("  {words}  [cannot fail]")), "{words}: {said}");
    }
    assert!(said.contains("  could\n"), "{said}");
    for words in ["least", "most", "far out", "bent"] {
        assert!(
            said.contains(&format!("  {words}  [describes these seeds only]")),
            "{words}: {said}"
        );
    }
    let said = project.run("exec", "e.ivx", &[]).out;
    for words in ["least", "most", "far out", "bent"] {
        assert!(said.contains(&format!("  describes {words}")), "{words}: {said}");
    }
    // The count of verdicts leaves none out.
    let page = project.read("results/e/report.html");
    assert!(page.contains("<b>4</b> <span class=\"badge describes\">"), "the page counts them");
}

#[test]
fn seeds_that_a_claim_chooses_are_told_of() {
    let spec = "edition \"2026\"
experiment e {
    axis seed = 0..10
    let data = sample(sinusoids(), n: 8)
    let model = train(linear_map(features: polynomial(degree: 1)), on: data)
    let one = train(linear_map(features: polynomial(degree: 1)), on: data[seed: 3])
    let test = sample(sinusoids(), n: 8, stream: \"test\")
    let error = rmse(model, on: test)
    claim \"one set of data\" : rmse(one, on: test) < 1.0
    claim \"some of ten\" : error[seed: [0, 1, 2, 3, 4, 5]] < 1.0
    claim \"in their mean\" : mean(error[seed: [0, 1, 2, 3, 4, 5]], over: seed) < 1.0
    claim \"all of ten\" : error[seed: [9, 8, 7, 6, 5, 4, 3, 2, 1, 0]] < 1.0
    claim \"all\" : error < 1.0
}
";
    let project = Project::with(&[("e.ivx", spec)]);
    let said = project.run("claims", "e.ivx", &[]).out;
    for words in ["one set of data", "some of ten", "in their mean"] {
        let line = format!("  {words}  [rests on chosen seeds]\n");
        assert!(said.contains(&line), "{words}: {said}");
    }
    for words in ["all of ten", "all"] {
        assert!(said.contains(&format!("  {words}\n")), "{words}: {said}");
    }
}
