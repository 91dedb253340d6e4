//! The page of how the thesis stands, and the command that writes it.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use ivx_engine::{Locks, Results};
use ivx_op::Outcome as Verdict;

use crate::project::{Project, Said, run};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// `BLESS=1` writes the page anew; review the difference.
#[test]
fn the_page_is_what_specs_and_locks_say() {
    let [list, page] = ["experiments/thesis.ron", "docs/thesis.md"].map(|path| root().join(path));
    let mut args: Vec<OsString> = vec!["ivx".into(), "standing".into(), list.into()];
    args.extend(["--out".into(), page.into()]);
    if std::env::var_os("BLESS").is_none() {
        args.push("--check".into());
    }
    let said = run(args);
    let help = "docs/thesis.md is stale: run this test with BLESS=1";
    assert_eq!((said.code, said.err.as_str()), (0, ""), "{help}");
}

#[test]
fn the_page_counts_the_verdicts_that_are_locked() {
    let read = |path: &str| fs::read_to_string(root().join(path)).expect("it is there");
    let locks = Locks::from_ron(&read("experiments/ivx.lock")).expect("locks read");
    let lock = &locks.specs["experiments/thesis"];
    assert_eq!(lock.profile.as_deref(), Some("quick"));
    let registered = lock.registered.as_ref().expect("claims are registered");
    let claims = || registered.claims.values().flat_map(|claims| claims.values());
    let count = |verdict| claims().filter(|claim| claim.verdict == verdict).count();
    let [holds, fails, undecided, describes] =
        [Verdict::Holds, Verdict::Fails, Verdict::Undecided, Verdict::Describes]
            .map(|verdict| count(Some(verdict)));
    let not_run = count(None);
    let row = format!("| `quick` | {holds} | {fails} | {undecided} | {describes} | {not_run} |\n");
    let page = read("docs/thesis.md");
    assert!(page.contains(&row), "{row}");
    assert!(page.contains(&format!("| {} claims at |", claims().count())), "{page}");
}

/// The results that `desk` found, as files: their verdicts are those that are locked, and no run lacks its file.
#[test]
fn what_desk_found_is_what_is_locked() {
    let read = |path: &str| fs::read_to_string(root().join(path)).expect(path);
    for chapter in ["ch3", "ch4"] {
        let locks = Locks::from_ron(&read(&format!("experiments/{chapter}/ivx.lock")));
        let locks = locks.expect("locks read");
        let mut n_claims = 0;
        for (name, lock) in &locks.specs {
            let own = name.strip_prefix(&format!("experiments/{chapter}/"));
            let Some(name) = own.and_then(|x| x.strip_suffix("@desk")) else {
                continue;
            };
            let found = Results::from_ron(&read(&format!("experiments/desk/{name}.ron")));
            let found = found.expect("results read").experiments;
            let registered = lock.registered.as_ref().expect("claims are registered");
            for (experiment, claims) in &registered.claims {
                for (words, claim) in claims {
                    let other = &found[experiment].claims[words];
                    let locked = (claim.verdict, &claim.claim);
                    assert_eq!((other.outcome, &other.claim), locked, "{words}");
                    n_claims += 1;
                }
            }
        }
        assert!(n_claims > 0, "nothing of {chapter} was run at desk");
    }
}

const SPEC: &str = "edition \"2026\"
/// deviation \"fewer | are shown\"
experiment e {
    param seeds: Int = 60
    profile quick { seeds = 20 }
    axis seed = 0..seeds
    axis n = [5, 10, 20]
    let data = sample(sinusoids(), n: n, noise: 0.1)
    let model = train(linear_map(features: polynomial(degree: 5), noise: 0.1), on: data)
    measure error = rmse(model, on: sample(sinusoids(), n: 50, stream: \"test\"))
    figure \"1\" = lines(error, x: n)
    table \"1\" = table(error, rows: n)
    claim \"fewer are worse\" : error[n: 5] > error[n: 20]
    claim \"few are few\" : error[n: [5, 10]] < 1.0
    claim \"few are best\" : error[n: 5] < error[n: 20]
}
";

const LIST: &str = "(
    title: \"How it stands\",
    profiles: [\"quick\", \"desk\"],
    specs: [\"e.ivx\"],
    sections: [(title: \"All\", elements: [
        (id: \"Figure 1\", title: \"errors\", places: [
            (file: \"e.ivx\", experiment: \"e\", claims: [\"few*\"], figures: [\"1\"], tables: [\"1\"]),
        ]),
        (id: \"H1\", title: \"fewer are worse\", places: [
            (file: \"e.ivx\", experiment: \"e\", claims: [\"fewer are worse\"]),
        ], explained: \"more data, smaller errors\"),
        (id: \"Figure 2\", title: \"later\", why_not: \"it takes a week\"),
    ])],
)";

fn standing(project: &Project, list: &str) -> Said {
    project.write("list.ron", list);
    let out = project.path("docs/page.md").display().to_string();
    project.run("standing", "list.ron", &["--out", &out])
}

#[test]
fn a_list_becomes_a_page() {
    let project = Project::with(&[("e.ivx", SPEC), ("docs/other.md", "")]);
    let said = standing(&project, LIST);
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    let page = project.read("docs/page.md");
    assert!(page.contains("| `quick` | 0 | 0 | 0 | 0 | 3 |"), "nothing is registered: {page}");

    assert_eq!(project.run("exec", "e.ivx", &["--register"]).code, 0);
    let said = standing(&project, LIST);
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    let page = project.read("docs/page.md");
    for expected in [
        "| together | 3 | 2 | 0 | 1 |",
        "| `quick` | 2 | 1 | 0 | 0 | 0 |\n| `desk` | 0 | 0 | 0 | 0 | 3 |",
        "| [H1](#h1-fewer-are-worse) | fewer are worse | 1 holds | not run |",
        "In [`e.ivx`](<../e.ivx>): experiment `e`, figure `1`, table `1`.",
        "Differs: fewer \\| are shown.",
        "At `quick`: other sizes: seeds = 20 for 60. At `desk`: full size (no profile of that name).",
        "  - `quick`: **holds** at 2 of 2 coordinates, difference -",
        "  - `quick`: **fails**, difference ",
        "- fewer are worse: `quick` **holds**, `desk` **not run**, as under [Figure 1](#figure-1-errors)",
        "Table `1` at `quick`:\n\n| n ",
        "**Why so**: more data, smaller errors.",
        "### Figure 2: later\n\n**Not there yet**: it takes a week.",
    ] {
        assert!(page.contains(expected), "{expected}\nis not in\n{page}");
    }

    let out = project.path("docs/page.md").display().to_string();
    let check = || project.run("standing", "list.ron", &["--out", &out, "--check"]);
    assert_eq!(check().code, 0);
    project.write("docs/page.md", &page.replace("holds", "fails"));
    let said = check();
    assert_eq!(said.code, 1);
    assert!(said.out.contains("page.md is stale: "), "{}", said.out);

    // Sizes of a profile that were run under another name are known.
    project.write("e.ivx", &SPEC.replace("seeds: Int = 60", "seeds: Int = 20"));
    assert_eq!(standing(&project, LIST).code, 0);
    let page = project.read("docs/page.md");
    assert!(page.contains("| `desk` | 2 | 1 | 0 | 0 | 0 |"), "{page}");
    assert!(page.contains("  - `quick`, `desk`: **fails**"), "{page}");
}

#[test]
fn runs_are_found_beside_a_spec_and_where_it_is_included() {
    let spec = SPEC.replace("seeds = 20 }", "seeds = 20 }\n    profile desk { seeds = 30 }");
    let all = "edition \"2026\"\ninclude \"sub/e.ivx\"\n";
    let project = Project::with(&[("all.ivx", all), ("sub/e.ivx", &spec), ("docs/other.md", "")]);
    assert_eq!(project.run("exec", "all.ivx", &["--register"]).code, 0);
    let desk = ["--profile", "desk", "--register"];
    assert_eq!(project.run("exec", "sub/e.ivx", &desk).code, 0);
    let list = LIST.replace("specs: [\"e.ivx\"]", "specs: [\"all.ivx\"]");
    let list = list.replace("file: \"e.ivx\"", "file: \"sub/e.ivx\"");
    let said = standing(&project, &list);
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    let page = project.read("docs/page.md");
    for expected in [
        "| `quick` | 2 | 1 | 0 | 0 | 0 |\n| `desk` | 1 | 1 | 1 | 0 | 0 |",
        "At `desk`: other sizes: seeds = 30 for 60.",
        ", n = 20 (among 3",
        ", n = 30 (among 3",
        "Table `1` at `desk`:\n\n| n ",
    ] {
        assert!(page.contains(expected), "{expected}\nis not in\n{page}");
    }
}

#[test]
fn a_list_that_names_what_is_not_there_or_hides_a_claim_is_wrong() {
    let project = Project::with(&[("e.ivx", SPEC), ("docs/other.md", "")]);
    assert_eq!(project.run("exec", "e.ivx", &["--register"]).code, 0);
    let wrong = |from: &str, to: &str, expected: &[&str]| {
        assert!(LIST.contains(from), "{from}");
        let said = standing(&project, &LIST.replace(from, to));
        assert_eq!(said.code, 2, "{to}: {}", said.out);
        for line in expected {
            assert!(said.err.contains(line), "{line}\nis not in\n{}", said.err);
        }
    };
    wrong(
        "claims: [\"few*\"]",
        "claims: [\"few are best\", \"few are fewer\"]",
        &[
            "error: `Figure 1`: `e` has no claim \"few are fewer\"\nhelp: ",
            "did you mean `few are few`?",
            "error: no element names the claim \"few are few\" of `e`\nhelp: ",
        ],
    );
    wrong("figures: [\"1\"]", "figures: [\"2\"]", &["`e` has no figure \"2\"\nhelp: "]);
    wrong(
        "experiment: \"e\", claims: [\"fewer",
        "experiment: \"f\", claims: [\"fewer",
        &["error: `H1`: e.ivx has no experiment \"f\"\nhelp: did you mean `e`?"],
    );
    wrong("id: \"H1\"", "id: \"Figure 2\"", &["error: `Figure 2` is on the list twice"]);
    wrong(", why_not: \"it takes a week\"", "", &["error: `Figure 2` is nowhere"]);
    wrong("why_not", "published: [\"t.ron\"], why_not", &["error: t.ron: there is no such file"]);
    wrong("why_not", "tested: [\"t.rs\"], why_not", &["error: t.rs: there is no such file"]);
    wrong("why_not", "why", &["list.ron: ", "why"]);
    wrong("[\"quick\", \"desk\"]", "[]", &["error: the list has no profiles"]);
    wrong("file: \"e.ivx\"", "file: \"f.ivx\"", &["f.ivx", "there is no such file"]);

    // What a spec says now is not what was registered.
    project.write("e.ivx", &SPEC.replace("< 1.0", "< 2.0"));
    let said = standing(&project, LIST);
    assert_eq!(said.code, 2, "{}", said.out);
    assert!(said.err.contains("error: `e` is not what `e` in ivx.lock registered"), "{}", said.err);
    assert!(said.err.contains("< 1.0 -> "), "{}", said.err);
}
