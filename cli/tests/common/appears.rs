//! Waits for what other processes do.

use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// A busy machine may take so long for anything; nothing is said to be faster.
pub(crate) const BOUND: Duration = Duration::from_mins(2);

/// Waits until there is a file.
#[track_caller]
pub(crate) fn appears(path: &Path) {
    let start = Instant::now();
    while !path.exists() {
        assert!(start.elapsed() < BOUND, "{} does not appear", path.display());
        sleep(Duration::from_millis(10));
    }
}
