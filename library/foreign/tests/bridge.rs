//! The bridge, with a shell script in the place of Python.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use ivx_data::Values;
use ivx_foreign::{Gymnasium, look_up};
use ivx_op::{Args, Ctx, External, Fields, Foreign, How, State};
use ivx_world::{End, Env as _, Lanes};

const CTX: Ctx = Ctx::new("learn", 5, None);

/// A folder with an interpreter of its own.
struct Fake {
    folder: tempfile::TempDir,
    time_limit: f64,
}

impl Fake {
    fn new(time_limit: f64) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("fake.sh");
        fs::write(&path, include_str!("fake.sh")).expect("it can be written");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("it is ours");
        Self { folder, time_limit }
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("fake.sh")
    }

    fn look_up(&self, name: &str) -> Result<External, String> {
        look_up(&self.path(), name, &Args::new(), self.time_limit)
    }

    fn world(&self, name: &str) -> Gymnasium {
        Gymnasium {
            name: Foreign(self.look_up(name).expect("it is known")),
            kwargs: Fields::default(),
            python: How("fake.sh".to_owned()),
            time_limit: How(self.time_limit),
        }
    }

    /// Whether the interpreter that was started last has ended.
    fn is_gone(&self) -> bool {
        let id = fs::read_to_string(self.folder.path().join("fake.sh.pid")).expect("it ran");
        let stat = Path::new("/proc").join(id.trim()).join("stat");
        let gone = || fs::read_to_string(&stat).map_or(true, |stat| stat.contains(") Z "));
        (0..200).any(|_| {
            thread::sleep(Duration::from_millis(5));
            gone()
        })
    }
}

fn seen(lanes: &Lanes<'_>) -> Vec<u8> {
    let Values::U8(at) = lanes.seen().values(0) else { panic!("it shows bytes") };
    at.clone()
}

#[test]
fn lanes_go_in_one_message_and_begin_with_seeds_of_their_own() {
    let fake = Fake::new(60.0);
    let world = fake.world("plain");
    assert_eq!(world.spec().expect("a world").does.n_discrete().ok(), Some(3));
    assert!(world.open().is_err());
    let mut lanes = Lanes::open(&world, 2, &CTX, ("learn", 0)).expect("worlds");
    let first = seen(&lanes);
    assert_ne!(first[0], first[1]);
    let again = Lanes::open(&world, 2, &CTX, ("learn", 0)).expect("worlds");
    assert_eq!(seen(&again), first);
    let mut go = |acts: [usize; 2]| {
        lanes.choose().1.places = acts.to_vec();
        let step = lanes.step().expect("they go on");
        let Values::U8(after) = step.after.values(0) else { panic!("it shows bytes") };
        let found = (after.clone(), step.rewards.clone(), step.ends.clone());
        (found, seen(&lanes))
    };
    let one = [first[0].wrapping_add(1), first[1].wrapping_add(1)].to_vec();
    assert_eq!(go([0, 0]), ((one.clone(), vec![1.0; 2], vec![End::No; 2]), one.clone()));
    // The second is cut off, and is followed by another at once.
    let two = [one[0].wrapping_add(1), one[1].wrapping_add(3)].to_vec();
    let ((after, _, ends), now) = go([0, 2]);
    assert_eq!((after, ends), (two.clone(), vec![End::No, End::Limit]));
    assert_eq!(now[0], two[0]);
    assert_ne!(now[1], two[1]);
    // The first rests.
    lanes.rest(&[0]);
    lanes.choose().1.places = vec![1, 1];
    let ends = lanes.step().expect("it goes on").ends.clone();
    assert_eq!(ends, [End::No, End::Terminal]);
    drop((lanes, again));
    assert!(fake.is_gone());
}

#[test]
fn an_unfinished_episode_is_taken_again() {
    let fake = Fake::new(60.0);
    let open = |world: &Gymnasium| Lanes::open(world, 2, &CTX, ("learn", 0)).expect("worlds");
    let taken_again = |name: &str| {
        let world = fake.world(name);
        let mut lanes = open(&fake.world("plain"));
        for acts in [[0, 0], [0, 1], [0, 2], [0, 0]] {
            lanes.choose().1.places = acts.to_vec();
            lanes.step().expect("they go on");
        }
        let kept = State::keep(|state| lanes.state(state));
        let mut other = open(&world);
        assert!(State::restore(&kept, |state| other.state(state)));
        other.catch_up().map(|()| assert_eq!(seen(&other), seen(&lanes)))
    };
    assert_eq!(taken_again("plain"), Ok(()));
    let why = taken_again("forgets").expect_err("it ended otherwise").to_string();
    assert!(why.contains("depends on more than its seed"), "{why}");
}

/// What comes of a world that fails in its third frame.
fn failure(name: &str, time_limit: f64) -> String {
    let fake = Fake::new(time_limit);
    let world = fake.world(name);
    let mut lanes = Lanes::open(&world, 2, &CTX, ("learn", 0)).expect("worlds");
    let started = Instant::now();
    let why = (0..3).find_map(|_| lanes.step().map(|_| ()).err()).expect("it fails").to_string();
    assert!(started.elapsed() < Duration::from_secs(30), "{why}");
    assert!(fake.is_gone(), "{why}");
    why
}

#[test]
fn a_world_that_fails_says_how() {
    let dead = "`fake.sh` ended with exit code 3; its standard error ends:\n    last\n    words";
    assert_eq!(failure("dies", 60.0), dead);
    assert_eq!(failure("killed", 60.0), "`fake.sh` was killed by signal 9 (SIGKILL)");
    let hung = "`fake.sh` did not answer within 0.5 s, its time limit; its standard error \
                ends:\n    waiting";
    assert_eq!(failure("hangs", 0.5), hung);
    assert_eq!(failure("garbage", 60.0), "`fake.sh` answered what is no frame");
    assert_eq!(failure("short", 60.0), "`fake.sh` ended with exit code 0");
    assert_eq!(failure("shuts", 60.0), "`fake.sh` closed its pipe");
    assert_eq!(failure("nan", 60.0), "`fake.sh` paid what is no number");
}

#[test]
fn what_a_world_says_beside_is_not_waited_for() {
    let fake = Fake::new(60.0);
    let mut lanes = Lanes::open(&fake.world("chatty"), 2, &CTX, ("learn", 0)).expect("worlds");
    for _ in 0..4 {
        lanes.step().expect("it goes on");
    }
}

#[test]
fn a_world_that_is_none_is_refused() {
    let why = |name: &str, time_limit| {
        let fake = Fake::new(time_limit);
        let why = fake.look_up(name).expect_err(name);
        assert!(fake.is_gone(), "{name}");
        why
    };
    assert_eq!(why("refused", 60.0), "there is no such world");
    let silent = "`fake.sh` did not answer within 0.2 s, its time limit";
    assert_eq!(why("mute", 0.2), silent);
    assert_eq!(why("endless", 60.0), "`fake.sh` said more than was asked for");
    let crash = "`fake.sh` ended with exit code 1; its standard error ends:\n    a Traceback";
    assert_eq!(why("crash", 60.0), crash);
    let nowhere = look_up(Path::new("/nowhere/python3"), "plain", &Args::new(), 1.0);
    assert!(nowhere.expect_err("nothing is there").contains("cannot be started"));
}

#[test]
fn a_world_that_changed_since_it_was_looked_up_is_not_opened() {
    let fake = Fake::new(60.0);
    let world = fake.world("changed");
    let why = Lanes::open(&world, 2, &CTX, ("learn", 0)).err().expect("it changed").to_string();
    assert_eq!(why, "`changed` is not what it was when the spec was read: run again");
    assert!(fake.is_gone());
    let most = 1 << 30;
    let why = Lanes::open(&fake.world("plain"), most, &CTX, ("learn", 0)).err();
    assert!(why.is_some_and(|why| why.to_string().contains("more than 1024 MiB")));
}
