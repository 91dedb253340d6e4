//! Programs as nodes: what makes them run again, and how they fail.

use std::fs::{self, File};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;

use crate::project::{Project, run};

const SPEC: &str = r#"edition "2026"

experiment e {
    param order: Str = "-n"
    axis seed = 0..3
    let data = sample(sinusoids(), n: 4)
    let run = command(
        "sh", args: ["run.sh", order, 2],
        files: ["run.sh", "lib/../lib/more.txt"], lock: "tools.lock",
        inputs: [as_file(data, "data.csv")], outputs: ["n.json", "copy.csv"],
        time_limit: 60.0)
    measure n = read_scalar(run, "n.json", field: "n")
    measure far = mean(support_distance(read_dataset(run, "copy.csv"), at: grid(0.0, 1.0, points: 3)), over: x)
    let plain = command("sh", args: ["-c", "echo 7"], stdout: "seven")
    measure seven = read_scalar(plain, "seven")
    let seeded = command(
        "sh", args: ["-c", "echo $SEED.$1", "sh", seed], env: [variable("SEED", seed)], stdout: "s")
    measure twice = read_scalar(seeded, "s")
}
"#;

const SCRIPT: &str = "cp data.csv copy.csv
test -f lib/more.txt && test -f tools.lock && test \"$1\" = -n || exit 1
echo \"{\\\"n\\\": $2}\" > n.json
";

fn project() -> Project {
    let files = [("e.ivx", SPEC), ("run.sh", SCRIPT), ("lib/more.txt", "m"), ("tools.lock", "1")];
    Project::with(&files)
}

#[test]
fn a_program_runs_again_when_what_it_depends_on_changes() {
    let project = project();
    // 3 samples and runs, 3 × (n, copy, far, its mean), 2 of what draws nothing, 3 × 2 of the seed.
    assert_eq!(project.executed("e.ivx", &[]), 6 + 12 + 2 + 6);
    let results = project.read("results/e/results.ron");
    let flat: String = results.split_whitespace().collect();
    for values in ["[2.0,2.0,2.0,]", "[7.0,]", "[0.0,1.1,2.2,]"] {
        assert!(flat.contains(&format!("values:{values}")), "{values}: {results}");
    }
    assert_eq!(project.executed("e.ivx", &[]), 0);
    // What depends on the file that is the same still does not run.
    project.write("run.sh", &SCRIPT.replace("$2", "$(($2 + 1))"));
    assert_eq!(project.executed("e.ivx", &[]), 3 + 3 + 3);
    project.write("run.sh", SCRIPT);
    assert_eq!(project.executed("e.ivx", &[]), 0);
    project.write("tools.lock", "2");
    assert_eq!(project.executed("e.ivx", &[]), 3, "the lock changes the runs and no output");
    project.write("lib/more.txt", "more");
    assert_eq!(project.executed("e.ivx", &[]), 3);
    let said = project.run("exec", "e.ivx", &["--set", "order=\"-r\""]);
    assert_eq!(said.code, 1, "an argument is seen by the program: {}", said.out);
    project.write("e.ivx", &SPEC.replace("time_limit: 60.0", "time_limit: 90.0"));
    assert_eq!(project.executed("e.ivx", &[]), 0, "how long it may take is in no key");
    project.write("e.ivx", &SPEC.replace("\"copy.csv\"],", "\"copy.csv\", \"data.csv\"],"));
    let said = project.run("exec", "e.ivx", &[]);
    assert_eq!(said.code, 2, "an input is no output");
    assert!(
        said.err.contains("`data.csv` is the name of an input and of an output"),
        "{}",
        said.err
    );
}

#[test]
fn names_belong_to_the_file_that_says_them() {
    let library = r#"edition "2026"
let answer(which: Str) = command("sh", args: ["run.sh", which], files: ["run.sh"], stdout: "n")
"#;
    let spec = r#"edition "2026"
use "tools/library.ivx" { answer }
experiment e {
    axis way = ["here", "there"]
    measure theirs = read_scalar(answer("1"), "n")
    let script = command(
        match way { "here": "sh", "there": "cat" },
        args: match way { "here": ["run.sh", "2"], "there": ["tools/run.sh"] },
        files: [match way { "here": "run.sh", "there": "tools/run.sh" }], stdout: "n")
    measure ours = read_scalar(script[way: "here"], "n")
    measure text = read_scalar(script[way: "there"], "n")
}
"#;
    let project = Project::with(&[
        ("e.ivx", spec),
        ("run.sh", "echo 10$1"),
        ("tools/library.ivx", library),
        ("tools/run.sh", "echo 20$1"),
    ]);
    let said = project.run("exec", "e.ivx", &[]);
    assert!(said.err.contains("e/text: `n` is not as expected"), "{}", said.err);
    let results = project.read("results/e/results.ron");
    assert!(results.contains("201.0") && results.contains("102.0"), "{results}");
}

#[test]
fn a_program_that_is_given_the_seed_draws_from_it() {
    let spec = |given: &str, seeds: usize| {
        format!(
            "edition \"2026\"\nexperiment e {{\n axis seed = 0..{seeds}\n let n = read_scalar(\
             command(\"echo\", args: [{given}], stdout: \"n\"), \"n\")\n \
             claim \"c\" : n * 1.0 > -1.0\n}}\n"
        )
    };
    let project = Project::with(&[]);
    let check = |given: &str, seeds: usize, verdict: &str| {
        project.write("e.ivx", &spec(given, seeds));
        let said = project.run("exec", "e.ivx", &[]);
        assert!(said.out.contains(&format!("  {verdict} ")), "{given}: {}{}", said.out, said.err);
    };
    check("seed", 4, "undecided");
    check("seed", 5, "holds");
    check("1", 4, "holds");
}

#[test]
fn what_varies_is_found_by_verify() {
    let spec = r#"edition "2026"
experiment e {
    measure sure = read_scalar(command("echo", args: [1], stdout: "n"), "n")
    measure drawn = read_scalar(
        command("sh", args: ["-c", "od -An -N4 -tu4 /dev/urandom"], stdout: "n"), "n")
}
"#;
    let project = Project::with(&[("e.ivx", spec)]);
    assert_eq!(project.executed("e.ivx", &[]), 4);
    let said = project.run("verify", "e.ivx", &[]);
    assert_eq!(said.code, 1, "{}{}", said.out, said.err);
    assert!(said.out.contains("3 the same, 1 not"), "{}", said.out);
    assert!(said.out.contains("differs  e/drawn/read_scalar"), "{}", said.out);
}

/// Each of these fails in its own way, and none keeps the last from running.
const HOSTILE: &str = r#"edition "2026"

experiment hostile {
    measure code = read_scalar(command("sh", args: ["-c", "echo why >&2; exit 3"], stdout: "s"), "s")
    measure sleeps = read_scalar(
        command("sh", args: ["-c", "sleep 1000 & sleep 1000"], stdout: "s", time_limit: 0.2), "s")
    measure floods = read_scalar(command("sh", args: ["-c", "cat /dev/zero"], outputs: ["o"]), "o")
    measure links = read_scalar(
        command("sh", args: ["-c", "ln -s /etc/passwd o"], outputs: ["o"]), "o")
    measure silent = read_scalar(command("sh", args: ["-c", "true"], outputs: ["o"]), "o")
    measure pipes = read_scalar(command("sh", args: ["-c", "mkfifo o"], outputs: ["o"]), "o")
    measure large = read_scalar(
        command("sh", args: ["-c", "truncate -s 1T o"], outputs: ["o"]), "o")
    measure text = read_scalar(command("sh", args: ["-c", "echo no"], stdout: "s"), "s")
    measure sound = read_scalar(command("sh", args: ["-c", "sleep 1000 & echo 1"], stdout: "s"), "s")
}
"#;

#[test]
fn files_that_cannot_be_are_told_before_anything_runs() {
    let check = |command: &str, read: &str, expected: [&str; 2]| {
        let spec = format!(
            "edition \"2026\"\nexperiment e {{\n measure m = {read}(command(\"sh\", args: [\"-c\", \"true\"], \
             {command}), \"o.json\")\n}}\n"
        );
        let project = Project::with(&[("e.ivx", &spec), ("a.txt", "")]);
        let said = project.run("check", "e.ivx", &[]);
        assert_eq!(said.code, 2, "{command}: {}", said.out);
        for part in expected {
            assert!(said.err.contains(part), "{command}: {}", said.err);
        }
    };
    let number = "read_scalar";
    check(
        "outputs: [\"a.json\", \"b\"]",
        number,
        ["there is no output `o.json`; there are `a.json`, `b`", "outputs: [\"o.json\"]"],
    );
    check("stdout: \"b\"", number, ["there is no output `o.json`; there is `b`", "name it"]);
    check("env: []", number, ["there is no output `o.json`, nor any other", "name it"]);
    check("outputs: [\"../o\"]", number, ["\"../o\" is no name of a file", "out/result.json"]);
    let twice = ["`a.txt` is the name of a file and of an output", "give one of them another name"];
    check("files: [\"a.txt\"], outputs: [\"a.txt\"]", number, twice);
    let twice = ["`o.json` is the name of an input and of the standard output", "another name"];
    check("inputs: [as_file(1.0, \"o.json\")], stdout: \"o.json\"", number, twice);
    check("outputs: [\"o.json\"]", "read_dataset", ["does not say how it is written", "`.csv`"]);
}

#[test]
fn what_goes_wrong_is_told_and_harms_nobody_else() {
    let project = Project::with(&[("hostile.ivx", HOSTILE)]);
    let said = project.run("exec", "hostile.ivx", &[]);
    assert_eq!(said.code, 1, "{}{}", said.out, said.err);
    for part in [
        "`sh` ended with exit code 3; its standard error ends:\n    why\n",
        "`sh` was stopped after 0.2 s, its time limit",
        "`sh` wrote more than 64 MiB to its standard output",
        "`o` is a link: outputs are regular files",
        "`o` was not written",
        "`o` is no regular file: outputs are regular files",
        "the outputs are larger than 256 MiB together",
        "`s` is not as expected: it is not JSON",
    ] {
        assert!(said.err.contains(part), "{part}: {}", said.err);
    }
    assert!(said.out.contains("8 failed, 7 skipped"), "{}", said.out);
}

#[test]
fn files_that_are_no_files_of_the_project_are_refused() {
    let spec = |name: &str| {
        format!(
            "edition \"2026\"\nexperiment e {{\n measure m = read_scalar(command(\"sh\", \
             files: [\"{name}\"], stdout: \"s\"), \"s\")\n}}\n"
        )
    };
    let project = Project::with(&[]);
    symlink("/etc/passwd", project.path("link")).expect("links can be made");
    // As large as it claims to be, and empty on the disk.
    let huge = File::create(project.path("huge")).expect("files can be made");
    huge.set_len((256 << 20) + 1).expect("files can be long");
    for (name, part) in [
        ("link", "lies outside the project"),
        ("huge", "is larger than 256 MiB"),
        ("", "is a folder"),
    ] {
        project.write("e.ivx", &spec(name));
        let said = project.run("exec", "e.ivx", &[]);
        assert_eq!(said.code, 2, "{name}: {}", said.out);
        assert!(said.err.contains(part) && said.err.contains("e.ivx:3:"), "{name}: {}", said.err);
    }
}

/// Needs a `python3` with the packages of `experiments/command/requirements.txt`.
#[test]
fn the_example_agrees_with_scikit_learn() {
    let python = Command::new("python3").args(["-c", "import sklearn, safetensors"]).output();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../experiments/command");
    if python.is_ok() {
        let spec = folder.join("scikit_learn.ivx").into_os_string();
        let said = run(vec!["ivx".into(), "check".into(), spec]);
        assert_eq!((said.code, said.err.as_str()), (0, ""));
    }
    if !python.is_ok_and(|python| python.status.success()) {
        eprintln!("skipped: `python3` has no scikit-learn, which this example is about");
        return;
    }
    let read = |name: &str| fs::read_to_string(folder.join(name)).expect("the example is there");
    let names = ["scikit_learn.ivx", "train.py", "requirements.txt"];
    let texts = names.map(read);
    let files: Vec<(&str, &str)> =
        names.iter().zip(&texts).map(|(name, text)| (*name, text.as_str())).collect();
    let project = Project::with(&files);
    let said = project.run("exec", "scikit_learn.ivx", &[]);
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    assert_eq!(said.out.matches("  holds ").count(), 4, "{}", said.out);
    assert_eq!(project.executed("scikit_learn.ivx", &[]), 0);
    // Two programs in five seeds; what they leave behind is as it was.
    project.write("train.py", &texts[1].replacen("Trains a", "Trains one", 1));
    assert_eq!(project.executed("scikit_learn.ivx", &[]), 10);
}
