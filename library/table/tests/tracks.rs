//! Tracks of Argoverse 2, ETH and UCY, where `IVX_TRACKS_DIR` names a folder that has them: their licences keep them out of
//! this repository.
//!
//! `ethucy/` has a file a scene, and `av2/` a file `tracks_LOG.csv` a log and the windows that are known, in
//! `windows.json`.

use std::fs;
use std::path::{Path, PathBuf};

use ivx_op::{Ctx, External, File, Op as _};
use ivx_table::ReadTracks;
use ivx_table::tracks::{Cut, Scene, argoverse, ethucy, windows};
use serde_json::Value;

fn folder() -> Option<PathBuf> {
    std::env::var_os("IVX_TRACKS_DIR").map(PathBuf::from)
}

fn scene(path: &Path, read: fn(&str, &[u8]) -> Result<Scene, String>) -> Scene {
    let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    read(&path.display().to_string(), &bytes).unwrap_or_else(|why| panic!("{why}"))
}

/// As many as another program counts of 8 known points and 12 to come, one at each frame.
#[test]
fn pedestrians_walk_as_many_windows_as_are_known() {
    let Some(folder) = folder() else { return };
    let cut = Cut { past: 8, future: 12, every: 10, stride: 10, least: 0.0, kinds: Vec::new() };
    for (name, n) in [
        ("biwi_eth", 364),
        ("biwi_hotel", 1197),
        ("crowds_zara01", 2356),
        ("crowds_zara02", 5910),
        ("students001", 14295),
        ("students003", 10039),
    ] {
        let scene = scene(&folder.join(format!("ethucy/{name}.txt")), ethucy::read);
        let found = windows(&[scene], &cut).unwrap();
        assert_eq!((found.who.len(), found.past.len(), found.future.len()), (n, 8 * n, 12 * n));
    }
}

/// The operation counts steps of ten frames, and sees places from the last that is known.
#[test]
fn scenes_are_one_data_set() {
    let Some(folder) = folder() else { return };
    let file = |name: &str| {
        let bytes = fs::read(folder.join(format!("ethucy/{name}.txt"))).expect("a scene");
        File(External::file(format!("{name}.txt"), bytes, false))
    };
    let files = ["biwi_eth", "biwi_hotel"].map(file).to_vec();
    let kinds = Vec::new();
    let read = ReadTracks { files, past: 8, future: 12, every: 1, stride: 1, least: 0.0, kinds };
    let data = read.run(&Ctx::new("read_tracks", 0, None)).unwrap();
    assert_eq!((data.len(), data.x.len()), (364 + 1197, (364 + 1197) * 16));
    assert!(data.x.chunks_exact(16).all(|past| past[14..] == [0.0, 0.0]));
}

/// The past of 2 s and the future of 6 s at 2 Hz, of vehicles that move 3 m.
#[test]
fn vehicles_drive_the_windows_that_are_known() {
    let Some(folder) = folder().map(|folder| folder.join("av2")) else { return };
    let kinds =
        "EGO VEHICLE REGULAR_VEHICLE LARGE_VEHICLE BUS BOX_TRUCK TRUCK TRUCK_CAB VEHICULAR_TRAILER";
    let kinds = kinds.split(' ').map(str::to_owned).collect();
    let cut = Cut { past: 5, future: 12, every: 5, stride: 5, least: 3.0, kinds };
    let text = fs::read_to_string(folder.join("windows.json")).expect("windows that are known");
    let known: Value = serde_json::from_str(&text).expect("windows that are known");
    for (part, logs) in
        [("train", &["adcf7d18", "7fab2350", "3b3570b4"][..]), ("test", &["3bffdcff", "0a1e6f0a"])]
    {
        let path = |log: &&str| folder.join(format!("tracks_{log}.csv"));
        let scenes: Vec<Scene> =
            logs.iter().map(|log| scene(&path(log), argoverse::read)).collect();
        let found = windows(&scenes, &cut).unwrap();
        let found: Vec<(&str, u64, u64)> = (0..found.who.len())
            .map(|i| (logs[found.scene[i]], found.who[i], found.now[i]))
            .collect();
        let number = |value: &Value| value.as_u64().expect("a count");
        let known = known[part].as_array().expect("a list").iter().map(|window| {
            let log = window["log"].as_str().expect("a log");
            (log, number(&window["track"]), number(&window["step"]))
        });
        assert!(found.iter().copied().eq(known), "{part}");
    }
}
