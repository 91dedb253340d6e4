//! Windows of past and future that are cut from tracks.

use std::collections::BTreeSet;

use super::{Scene, Track};
use crate::table::listed;

/// How windows are cut.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// How many points are known, the last of them now.
    pub past: usize,
    /// How many points are to be foretold.
    pub future: usize,
    /// How many steps of the file lie between two points.
    pub every: u64,
    /// How many steps lie between the begins of two windows, which are counted from the first step of their scene.
    pub stride: u64,
    /// How far the last point is from the first at least, in metres.
    pub least: f64,
    /// The kinds of which tracks are cut; all where none is named.
    pub kinds: Vec<String>,
}

/// `n` windows of past and future, in the order of scenes, of who, and of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Windows {
    /// What is known: `[n, past]` points, in metres.
    pub past: Vec<[f64; 2]>,
    /// What came: `[n, future]` points, in metres.
    pub future: Vec<[f64; 2]>,
    /// Which of the scenes each is of.
    pub scene: Vec<usize>,
    /// Who moves in each.
    pub who: Vec<u64>,
    /// The step of the last known point of each.
    pub now: Vec<u64>,
}

/// The windows of scenes. A track that is not seen at a step that is needed has no window there.
///
/// # Errors
/// If a count of the cut is 0 or the distance is negative or no number, or if there is no window.
pub fn windows(scenes: &[Scene], cut: &Cut) -> Result<Windows, String> {
    let counts = [cut.past as u64, cut.future as u64, cut.every, cut.stride];
    let names = ["past", "future", "every", "stride"];
    if let Some((name, _)) = names.iter().zip(counts).find(|(_, count)| *count == 0) {
        return Err(format!("`{name}` is 0, and no window is cut so"));
    }
    if cut.least.is_nan() || cut.least < 0.0 {
        return Err(format!("{} is no distance that is moved at least", cut.least));
    }
    let (mut past, mut future) = (Vec::new(), Vec::new());
    let (mut scene, mut who, mut now) = (Vec::new(), Vec::new(), Vec::new());
    for (i, seen) in scenes.iter().enumerate() {
        let wanted = |track: &&Track| cut.kinds.is_empty() || cut.kinds.contains(&track.kind);
        let first = seen.tracks.iter().filter_map(|track| track.points.keys().next()).min();
        for track in seen.tracks.iter().filter(wanted) {
            let begins =
                |step: &&u64| first.is_some_and(|first| (*step - first).is_multiple_of(cut.stride));
            for &begin in track.points.keys().filter(begins) {
                let Some(points) = points(track, begin, cut) else { continue };
                let (known, came) = points.split_at(cut.past);
                past.extend_from_slice(known);
                future.extend_from_slice(came);
                scene.push(i);
                who.push(track.who);
                now.push(begin + cut.every * (counts[0] - 1));
            }
        }
    }
    if scene.is_empty() {
        return Err(none(scenes, cut));
    }
    Ok(Windows { past, future, scene, who, now })
}

/// The points of a window; `None` where one is missing, or they do not go far enough.
fn points(track: &Track, begin: u64, cut: &Cut) -> Option<Vec<[f64; 2]>> {
    let n = cut.past.saturating_add(cut.future);
    let point = |i: u64| track.points.get(&begin.checked_add(cut.every.checked_mul(i)?)?).copied();
    let points: Vec<[f64; 2]> = (0..).take(n).map(point).collect::<Option<_>>()?;
    let (first, last) = (points.first()?, points.last()?);
    let moved = ((last[0] - first[0]).powi(2) + (last[1] - first[1]).powi(2)).sqrt();
    (moved >= cut.least).then_some(points)
}

/// Why there is no window.
fn none(scenes: &[Scene], cut: &Cut) -> String {
    let tracks: Vec<&Track> = scenes.iter().flat_map(|scene| &scene.tracks).collect();
    let kinds: BTreeSet<&String> = tracks.iter().map(|track| &track.kind).collect();
    if !cut.kinds.is_empty() && !kinds.iter().any(|kind| cut.kinds.contains(kind)) {
        let (wanted, kinds) = (listed(&cut.kinds), kinds.into_iter().cloned().collect::<Vec<_>>());
        return format!("no track is of {wanted}; there are {}", listed(&kinds));
    }
    let (n, n_points) = (tracks.len(), cut.past.saturating_add(cut.future));
    let Cut { every, least, .. } = cut;
    format!("none of {n} tracks has {n_points} points, {every} steps apart, that go {least} m far")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along x by 1 a step, seen at these steps.
    fn track(who: u64, kind: &str, steps: impl IntoIterator<Item = u64>) -> Track {
        #[expect(clippy::cast_precision_loss, reason = "steps are few")]
        let points = steps.into_iter().map(|step| (step, [step as f64, 0.0]));
        Track { who, kind: kind.to_owned(), points: points.collect() }
    }

    fn scene(tracks: Vec<Track>) -> Scene {
        Scene { name: "scene".to_owned(), tracks }
    }

    fn cut(past: usize, future: usize, every: u64, stride: u64) -> Cut {
        Cut { past, future, every, stride, least: 0.0, kinds: Vec::new() }
    }

    fn xs(points: &[[f64; 2]]) -> Vec<f64> {
        points.iter().map(|point| point[0]).collect()
    }

    #[test]
    fn windows_by_hand() {
        let scenes = [scene(vec![track(3, "", 0..3)]), scene(vec![track(1, "", 4..8)])];
        let found = windows(&scenes, &cut(2, 1, 1, 1)).unwrap();
        assert_eq!(xs(&found.past), [0.0, 1.0, 4.0, 5.0, 5.0, 6.0]);
        assert_eq!(xs(&found.future), [2.0, 6.0, 7.0]);
        assert_eq!(
            (found.scene, found.who, found.now),
            (vec![0, 1, 1], vec![3, 1, 1], vec![1, 5, 6])
        );
    }

    #[test]
    fn points_are_apart_and_windows_begin_at_the_same_steps_of_a_scene() {
        // Begins are 10, 13, 16, 19: whoever comes at 11 begins at 13.
        let scenes = [scene(vec![track(0, "", 10..20), track(1, "", 11..18)])];
        let found = windows(&scenes, &cut(2, 1, 2, 3)).unwrap();
        assert_eq!(xs(&found.past), [10.0, 12.0, 13.0, 15.0, 13.0, 15.0]);
        assert_eq!(xs(&found.future), [14.0, 17.0, 17.0]);
        assert_eq!((found.who, found.now), (vec![0, 0, 1], vec![12, 15, 15]));
    }

    #[test]
    fn a_window_has_no_gap() {
        let scenes = [scene(vec![track(0, "", [0, 1, 2, 4, 5, 6])])];
        let begins = |every, n| windows(&scenes, &cut(1, n, every, 1)).map(|found| found.now);
        assert_eq!(begins(1, 2).unwrap(), [0, 4]);
        // What lies between points may be missing.
        assert_eq!(begins(2, 2).unwrap(), [0, 2]);
        let why = begins(1, 3).unwrap_err();
        assert_eq!(why, "none of 1 tracks has 4 points, 1 steps apart, that go 0 m far");
    }

    #[test]
    fn those_that_stand_and_other_kinds_are_left_out() {
        let mut slow = track(1, "BUS", 0..4);
        slow.points.values_mut().for_each(|point| point[0] /= 2.0);
        let scenes = [scene(vec![track(0, "EGO", 0..4), slow, track(2, "BUS", 0..4)])];
        let who = |least, kinds: &[&str]| {
            let kinds = kinds.iter().map(ToString::to_string).collect();
            windows(&scenes, &Cut { least, kinds, ..cut(2, 2, 1, 1) }).map(|found| found.who)
        };
        assert_eq!(who(0.0, &[]).unwrap(), [0, 1, 2]);
        // Three steps of 1, and three of ½.
        assert_eq!(who(1.5, &["BUS", "TRAM"]).unwrap(), [1, 2]);
        assert_eq!(who(1.6, &["BUS"]).unwrap(), [2]);
        assert!(who(3.1, &[]).unwrap_err().contains("go 3.1 m far"));
        assert_eq!(
            who(0.0, &["TRAM"]).unwrap_err(),
            "no track is of `TRAM`; there are `BUS`, `EGO`"
        );
    }

    #[test]
    fn a_cut_that_is_none_is_told() {
        let scenes = [scene(vec![track(0, "", 0..9)])];
        let why = |cut: Cut| windows(&scenes, &cut).unwrap_err();
        assert!(why(cut(0, 1, 1, 1)).contains("`past`"));
        assert!(why(cut(1, 0, 1, 1)).contains("`future`"));
        assert!(why(cut(1, 1, 0, 1)).contains("`every`"));
        assert!(why(cut(1, 1, 1, 0)).contains("`stride`"));
        assert!(why(Cut { least: f64::NAN, ..cut(1, 1, 1, 1) }).contains("NaN"));
        // However many, and however far apart.
        let most = why(cut(usize::MAX, usize::MAX, u64::MAX, 1));
        assert!(most.contains("none of 1 tracks"), "{most}");
        assert!(why(cut(1, usize::MAX, 1, u64::MAX)).contains("none of 1 tracks"));
    }
}
