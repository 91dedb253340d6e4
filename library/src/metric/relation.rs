//! How the sides of a claim relate, and how surprising what was seen would be were it otherwise.

use ivx_math::evidence::Evidence;
use ivx_op::{OpError, Outcome};

/// How the left side is claimed to relate to the right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Relation {
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Equal,
    Unequal,
}

impl Relation {
    pub(super) fn named(sign: &str) -> Result<Self, OpError> {
        match sign {
            "<" => Ok(Self::Less),
            "<=" => Ok(Self::LessOrEqual),
            ">" => Ok(Self::Greater),
            ">=" => Ok(Self::GreaterOrEqual),
            "==" => Ok(Self::Equal),
            "!=" => Ok(Self::Unequal),
            other => Err(OpError::Failed(format!(
                "`{other}` is no relation; use one of <, <=, >, >=, ==, !="
            ))),
        }
    }

    /// The same relation from the right side.
    pub(super) fn mirrored(self) -> Self {
        match self {
            Self::Less => Self::Greater,
            Self::LessOrEqual => Self::GreaterOrEqual,
            Self::Greater => Self::Less,
            Self::GreaterOrEqual => Self::LessOrEqual,
            other => other,
        }
    }

    pub(super) fn is_equality(self) -> bool {
        matches!(self, Self::Equal | Self::Unequal)
    }

    /// Whether it is true of a difference, left minus right.
    ///
    /// - `within`: how far from 0 counts as equal, or the left side as not worse.
    pub(super) fn compare(self, difference: f64, within: f64) -> Outcome {
        let is_true = match self {
            _ if difference.is_nan() => return Outcome::Undecided,
            Self::Less => difference < 0.0,
            Self::LessOrEqual => difference <= within,
            Self::Greater => difference > 0.0,
            Self::GreaterOrEqual => difference >= -within,
            Self::Equal => difference.abs() <= within,
            Self::Unequal => difference != 0.0,
        };
        if is_true { Outcome::Holds } else { Outcome::Fails }
    }

    /// Where the numbers of which it is true end, for a number compared with `bound`.
    pub(super) fn edges(self, bound: f64, within: f64) -> Vec<f64> {
        match self {
            Self::Less | Self::Greater | Self::Unequal => vec![bound],
            Self::LessOrEqual => vec![bound + within],
            Self::GreaterOrEqual => vec![bound - within],
            Self::Equal => vec![bound - within, bound + within],
        }
    }

    /// The levels of two-sided tests at which it would hold of the number compared with `bound`, and at which it would
    /// fail: an interval of confidence `1 − p` ends where it ceases to be true.
    pub(super) fn p(self, seen: &Evidence, bound: f64, within: f64) -> (f64, f64) {
        let (low, high) = (bound - within, bound + within);
        let (holds, fails) = match self {
            Self::Less => (seen.p_below(bound, false), seen.p_above(bound, true)),
            Self::LessOrEqual => (seen.p_below(high, true), seen.p_above(high, false)),
            Self::Greater => (seen.p_above(bound, false), seen.p_below(bound, true)),
            Self::GreaterOrEqual => (seen.p_above(low, true), seen.p_below(low, false)),
            Self::Equal => (
                seen.p_below(high, true).max(seen.p_above(low, true)),
                seen.p_above(high, false).min(seen.p_below(low, false)),
            ),
            Self::Unequal => (
                seen.p_below(bound, false).min(seen.p_above(bound, false)),
                seen.p_below(bound, true).max(seen.p_above(bound, true)),
            ),
        };
        ((2.0 * holds).min(1.0), (2.0 * fails).min(1.0))
    }
}
