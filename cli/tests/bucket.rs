//! A bucket as the store, through the command: where ivx is built with object storage, and a server of S3 can be had,
//! `moto_server` or `s3s-fs`: on the `PATH`, or named by `IVX_S3_SERVER`.
#![cfg(feature = "object-storage")]

mod common;
#[path = "common/s3.rs"]
mod s3;

use std::fs;
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant};

use common::{ivx, project};
use s3::{BUCKET, Server, Way, answering, proxy, silent};
use tempfile::TempDir;

const STORE: &str = "s3://ivx/shared/results";
const SECRET: &str = "a-key-that-nobody-may-see";

/// Nodes with results large and small, and a figure.
fn spec(seeds: usize, steps: usize) -> String {
    format!(
        r#"edition "2026"
experiment e {{
    axis seed = 0..{seeds}
    let data = sample(sinusoids(), n: 10)
    let model = train(ensemble(map_estimate(net: mlp(hidden: [48, 48])), members: 2), on: data, steps: {steps})
    let drawn = predict(model[seed: 0], at: grid(-1.0, 1.0, points: 101))
    measure spread = mean(std(predict(model, at: grid(-1.0, 1.0, points: 11)), over: member), over: x)
    figure "members" = plot([curve(drawn, x: x, label: "members")])
}}
"#
    )
}

struct Said {
    text: String,
    executed: usize,
    took: Duration,
}

/// Runs the spec of a project with a bucket behind a port, and the mode.
#[track_caller]
fn exec(project: &Path, port: u16, mode: &str) -> Said {
    let began = Instant::now();
    let mut command = ivx(project, &["exec", "e.ivx", "--store", STORE, "--store-mode", mode]);
    let output = command.envs(environment(port)).output().expect("the command runs");
    let text = String::from_utf8([output.stdout, output.stderr].concat()).expect("it is UTF-8");
    assert!(output.status.success(), "{text}");
    assert!(!text.contains(SECRET), "{text}");
    let line = text.lines().find(|line| line.contains("nodes executed"));
    let first = line.and_then(|line| line.split(' ').next()?.parse().ok());
    let executed = first.unwrap_or_else(|| panic!("{text}"));
    Said { executed, text, took: began.elapsed() }
}

fn environment(port: u16) -> [(&'static str, String); 5] {
    [
        ("AWS_ENDPOINT", format!("http://127.0.0.1:{port}")),
        ("AWS_ALLOW_HTTP", "true".to_owned()),
        ("AWS_REGION", "us-east-1".to_owned()),
        ("AWS_ACCESS_KEY_ID", "test".to_owned()),
        ("AWS_SECRET_ACCESS_KEY", SECRET.to_owned()),
    ]
}

/// A machine that has nothing but the spec.
fn machine(spec: &str) -> TempDir {
    project(&[("e.ivx", spec)])
}

fn results(machine: &TempDir) -> String {
    fs::read_to_string(machine.path().join("results/e/results.ron")).expect("results are written")
}

/// The names of the objects in a cache.
fn objects(machine: &TempDir) -> Vec<String> {
    let folder = machine.path().join(".ivx/cache/objects");
    let shelves = fs::read_dir(folder).expect("the cache has objects");
    let files = shelves.flat_map(|shelf| {
        fs::read_dir(shelf.expect("it can be read").path()).expect("shelves are folders")
    });
    let name = |path: PathBuf| path.file_name()?.to_str().map(str::to_owned);
    files.filter_map(|file| name(file.expect("it can be read").path())).collect()
}

#[test]
fn machines_that_write_at_once_share_what_they_find() {
    let Some(server) = Server::start() else { return };
    let (one, two) = (spec(3, 20), spec(5, 20));
    let others: Vec<Said> = std::thread::scope(|scope| {
        let run = |spec: &str| {
            let machine = machine(spec);
            let port = server.port;
            scope.spawn(move || exec(machine.path(), port, "write"))
        };
        let runs = [run(&one), run(&one), run(&two), run(&two)];
        runs.map(|run| run.join().expect("it runs")).into()
    });
    for said in &others {
        assert!(!said.text.contains("note: "), "{}", said.text);
    }
    for spec in [&one, &two] {
        let reader = machine(spec);
        let said = exec(reader.path(), server.port, "read");
        assert_eq!(said.executed, 0, "{}", said.text);
        assert!(said.text.contains("nothing is put there"), "{}", said.text);
        let alone = machine(spec);
        ivx(alone.path(), &["exec", "e.ivx"]).output().expect("the command runs");
        assert_eq!(results(&reader), results(&alone));
    }
}

#[test]
fn a_run_with_nothing_to_do_makes_one_listing_however_slow_the_store_is() {
    let Some(server) = Server::start() else { return };
    let spec = spec(40, 4);
    let first = machine(&spec);
    let all = exec(first.path(), server.port, "write").executed;
    let slow = proxy(server.port, Way::Slow(Duration::from_millis(20)));
    let said = exec(first.path(), slow.port, "write");
    assert_eq!((said.executed, slow.n_requests()), (0, 2), "the version, and one listing");
    // A machine without a cache asks for many at once: one after another would take this long.
    let reader = machine(&spec);
    let said = exec(reader.path(), slow.port, "read");
    let n_requests = slow.n_requests() - 2;
    assert!(n_requests > all, "{n_requests} requests for {all} nodes");
    let one_by_one = Duration::from_millis(20) * u32::try_from(n_requests).expect("it is small");
    assert!(said.executed == 0 && said.took < one_by_one, "{:?}: {}", said.took, said.text);
    // So does one that has everything to put.
    let said = exec(machine(&spec).path(), slow.port, "write");
    assert_eq!(said.executed, 0);
}

#[test]
fn a_server_that_is_killed_costs_nothing_but_time() {
    let Some(mut server) = Server::start() else { return };
    let spec = spec(12, 4_000);
    let (one, port) = (machine(&spec), server.port);
    let said = std::thread::scope(|scope| {
        let run = scope.spawn(|| exec(one.path(), port, "write"));
        // What is found first has been put by then, and the rest has not.
        fills(&one.path().join(".ivx/cache/objects"));
        sleep(Duration::from_millis(300));
        server.kill();
        run.join().expect("it runs")
    });
    assert!(said.text.contains("nothing more is "), "{}", said.text);
    server.start_again();
    let said = exec(one.path(), server.port, "write");
    assert_eq!(said.executed, 0);
    let two = machine(&spec);
    let said = exec(two.path(), server.port, "read");
    assert_eq!(said.executed, 0, "what could not be put is put by the next run: {}", said.text);
    assert_eq!(results(&one), results(&two));
}

fn fills(path: &Path) {
    let began = Instant::now();
    while fs::read_dir(path).map_or(0, Iterator::count) == 0 {
        assert!(began.elapsed() < Duration::from_mins(2), "{} stays empty", path.display());
        sleep(Duration::from_millis(10));
    }
}

#[test]
fn an_object_that_was_altered_is_refused_and_mended() {
    let Some(server) = Server::start() else { return };
    let spec = spec(2, 20);
    let first = machine(&spec);
    exec(first.path(), server.port, "write");
    for name in objects(&first) {
        let place = format!("shared/results/objects/{}/{name}", &name[..2]);
        let path = first.path().join(".ivx/cache/objects").join(&name[..2]).join(&name);
        let n = fs::metadata(path).expect("it is there").len();
        server.alter(&place, &vec![7; usize::try_from(n).expect("it is small")]);
    }
    let second = machine(&spec);
    let said = exec(second.path(), server.port, "write");
    assert!(said.text.contains("bytes of another digest"), "{}", said.text);
    assert!(said.executed > 0);
    assert_eq!(results(&second), results(&first));
    let third = machine(&spec);
    let said = exec(third.path(), server.port, "read");
    assert!(results(&third) == results(&first) && said.executed <= 1, "{}", said.text);
}

#[test]
fn who_may_only_read_is_told_so_and_goes_on() {
    let Some(server) = Server::start() else { return };
    let spec = spec(2, 20);
    let first = machine(&spec);
    let all = exec(first.path(), server.port, "write").executed;
    let guarded = proxy(server.port, Way::ReadOnly);
    let larger = self::spec(3, 20);
    let said = exec(machine(&larger).path(), guarded.port, "write");
    assert!(said.text.contains("the store does not allow it"), "{}", said.text);
    assert!(said.text.contains("nothing more is written there"), "{}", said.text);
    assert!(said.executed > 0 && said.executed < all, "{}", said.text);
}

#[test]
fn a_store_that_refuses_or_hangs_or_is_not_there_is_a_note() {
    let spec = spec(1, 2);
    let check = |port: u16, expected: &str| {
        let said = exec(machine(&spec).path(), port, "write");
        assert!(
            said.text.contains("note: the store s3://ivx/shared/results is not used: version: ")
        );
        assert!(said.text.contains(expected), "{}", said.text);
        assert!(said.executed > 0 && said.took < Duration::from_mins(1), "{:?}", said.took);
    };
    check(answering("403 Forbidden").port, "the store does not allow it");
    check(answering("500 Internal Server Error").port, "500");
    check(silent().port, "nothing was heard for 10 s");
    check(s3::free_port(), "refused");
    let Some(server) = Server::start() else { return };
    let machine = machine(&spec);
    let mut command = ivx(machine.path(), &["exec", "e.ivx", "--store", "s3://another/p"]);
    let output = command.envs(environment(server.port)).output().expect("the command runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("is not used: version: "), "{said}");
    assert_ne!(BUCKET, "another");
}

#[test]
fn addresses_with_secrets_are_refused_without_being_told() {
    let machine = machine(&spec(1, 2));
    for place in ["s3://me:hidden@ivx/p", "s3://ivx/p?sig=hidden", "ftp://hidden"] {
        for command in ["exec", "plan"] {
            let output = ivx(machine.path(), &[command, "e.ivx", "--store", place]).output();
            let output = output.expect("the command runs");
            let said = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{said}");
            assert!(said.contains("error: the store: ") && !said.contains("hidden"), "{said}");
        }
    }
}
