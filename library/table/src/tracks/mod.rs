//! Where people and cars went, and the windows of past and future that are cut from it.

pub mod argoverse;
pub mod ethucy;
mod paced;
mod rows;
mod windows;

use std::collections::BTreeMap;

pub use paced::paced;
pub use windows::{Cut, Windows, windows};

/// What was seen in one place during one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// What it is called: the name of its file.
    pub name: String,
    /// Who moved there, in ascending order of `who`.
    pub tracks: Vec<Track>,
}

/// Where somebody was.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// The number that the scene has for them.
    pub who: u64,
    /// What they are, as the file says it; empty where it does not.
    pub kind: String,
    /// Where they were at each step at which they were seen, in metres. Steps are counted as the file does.
    pub points: BTreeMap<u64, [f64; 2]>,
}

/// A scene, row by row.
struct Seen {
    name: String,
    tracks: BTreeMap<u64, Track>,
}

impl Seen {
    fn new(name: &str) -> Self {
        Self { name: name.to_owned(), tracks: BTreeMap::new() }
    }

    /// Adds where somebody was.
    ///
    /// # Errors
    /// If they were somewhere at that step already, or something else before.
    fn add(&mut self, who: u64, kind: &str, step: u64, point: [f64; 2]) -> Result<(), String> {
        let new = || Track { who, kind: kind.to_owned(), points: BTreeMap::new() };
        let track = self.tracks.entry(who).or_insert_with(new);
        if track.kind != kind {
            let before = &track.kind;
            return Err(format!("number {who} is of the kind `{kind}`, and was of `{before}`"));
        }
        match track.points.insert(step, point) {
            None => Ok(()),
            Some(_) => Err(format!("number {who} is at step {step} twice")),
        }
    }

    /// # Errors
    /// If nobody was seen.
    fn scene(self) -> Result<Scene, String> {
        if self.tracks.is_empty() {
            return Err(format!("`{}` has no rows", self.name));
        }
        Ok(Scene { name: self.name, tracks: self.tracks.into_values().collect() })
    }
}
