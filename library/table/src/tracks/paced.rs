//! Steps as they follow each other, where a file counts otherwise: by frames of a film, of which one in ten was looked at.

use std::collections::BTreeSet;

use super::{Scene, Track};

/// The scene with its steps counted from the first, by the largest step of which all others are multiples.
#[must_use]
pub fn paced(scene: Scene) -> Scene {
    let steps: BTreeSet<u64> =
        scene.tracks.iter().flat_map(|track| track.points.keys().copied()).collect();
    let Some(first) = steps.first().copied() else { return scene };
    let pace = steps.iter().fold(0, |pace, step| divisor(pace, step - first)).max(1);
    let counted = |track: Track| Track {
        points: track.points.into_iter().map(|(step, at)| ((step - first) / pace, at)).collect(),
        ..track
    };
    Scene { tracks: scene.tracks.into_iter().map(counted).collect(), ..scene }
}

/// The greatest common divisor.
fn divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_follow_each_other() {
        let counted = |steps: &[&[u64]]| {
            let track = |steps: &&[u64]| Track {
                who: 0,
                kind: String::new(),
                points: steps.iter().map(|step| (*step, [0.0; 2])).collect(),
            };
            let scene = Scene { name: String::new(), tracks: steps.iter().map(track).collect() };
            let steps = |track: Track| track.points.into_keys().collect::<Vec<_>>();
            paced(scene).tracks.into_iter().map(steps).collect::<Vec<_>>()
        };
        // Frames of ten, of which one is missing; of all tracks together.
        assert_eq!(counted(&[&[780, 790, 810], &[800]]), [vec![0, 1, 3], vec![2]]);
        assert_eq!(counted(&[&[6, 26], &[16, 31]]), [vec![0, 4], vec![2, 5]]);
        assert_eq!(counted(&[&[3, 4, 6]]), [vec![0, 1, 3]]);
        assert_eq!(counted(&[&[7]]), [vec![0]]);
    }
}
