//! The range of an axis that is asked for.

use ivx_op::{Facts, Wrong};

use super::log::is_log;
use super::scale::{apart, placeable};

/// The ends of a range; none where none are given.
///
/// # Errors
/// If they are not two in order, or a logarithmic axis does not have them.
pub(super) fn range(ends: &[f64], scale: &str) -> Result<Option<(f64, f64)>, String> {
    match *ends {
        [] => Ok(None),
        [low, _] if low <= 0.0 && is_log(scale)? => {
            Err("a logarithmic axis has nothing at 0 and below".to_owned())
        }
        [low, high] if [low, high].into_iter().all(placeable) && apart(low, high) => {
            Ok(Some((low, high)))
        }
        _ => Err("`y_range` takes the lowest and the highest `y`, as in `[0.0, 1.0]`".to_owned()),
    }
}

/// The rule that `y_range` is one of `y_scale`.
pub(super) fn known_range(facts: &Facts<'_>) -> Result<(), Wrong> {
    let (Some(ends), Some(scale)) =
        (facts.arg::<Vec<f64>>("y_range"), facts.arg::<String>("y_scale"))
    else {
        return Ok(());
    };
    let help = || "write the lowest `y` shown and the highest, or leave it out".to_owned();
    let wrong = |message| Wrong { arg: "y_range", message, help: help() };
    range(&ends, &scale).map(drop).map_err(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_has_two_ends_in_order() {
        let bad = [&[1.0][..], &[1.0, 0.0], &[0.0, f64::NAN], &[0.0, 1.0, 2.0], &[0.0, 5e-324]];
        assert!(bad.into_iter().all(|ends| range(ends, "linear").is_err()));
        assert_eq!(range(&[], "log"), Ok(None));
        assert_eq!(range(&[-1.0, 1.0], "linear"), Ok(Some((-1.0, 1.0))));
        assert_eq!(range(&[0.1, 1.0], "log"), Ok(Some((0.1, 1.0))));
        assert!(range(&[0.0, 1.0], "log").unwrap_err().contains("nothing at 0"));
    }
}
