//! Verdicts on claims.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::{Artifact, Tensors, shown_together};

/// What came out of a claim, coordinate by coordinate.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// One finding for each coordinate of the axes other than `seed`.
    pub findings: Vec<Finding>,
}

/// What came out at one coordinate.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Axis and label, in the order of declaration; empty for a single statement.
    pub at: Vec<(String, String)>,
    /// What it amounts to.
    pub outcome: Outcome,
    /// The difference, left minus right; the mean over seeds where there are any.
    pub estimate: f64,
    /// The interval of the paired difference, of the claim's confidence; none where nothing is stochastic. An end of
    /// which nothing is known is infinite.
    pub interval: Option<(f64, f64)>,
    /// How many seeds were paired. 0 where nothing is, unless what was compared rests on too few
    /// seeds to decide anything: then how many.
    pub n: usize,
    /// How far from 0 counts as equal; 0 where nothing but 0 does.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub within: f64,
    /// The levels at which it would hold and at which it would fail: two-sided, as that of the interval. None where
    /// nothing is stochastic.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p: Option<(f64, f64)>,
    /// The smallest difference that so many seeds tell in four of five cases.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub smallest: Option<f64>,
    /// About how many seeds tell the difference seen, in four of five cases.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub enough: Option<usize>,
    /// The seeds of which something is missing, because a node failed: nothing is decided without them. An empty one
    /// where there are no seeds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
    /// Whether it is undecided only because such differences, skewed or all alike, need more seeds.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub too_few: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for it")]
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

impl Finding {
    /// Below this many seeds nothing is decided.
    pub const MIN_SEEDS: usize = 5;

    /// The difference and then the ends of its interval, if it has one: with digits that tell them from each other
    /// and from what counts as equal.
    #[must_use]
    pub fn shown(&self) -> Vec<String> {
        let ends = self.interval.map(|(low, high)| [low, high]);
        let told = [self.estimate].into_iter().chain(ends.into_iter().flatten());
        let bounds = [-self.within, self.within].into_iter().filter(|bound| *bound != 0.0);
        let mut shown = shown_together(&told.chain(bounds).collect::<Vec<_>>());
        shown.truncate(if ends.is_some() { 3 } else { 1 });
        // The ends may be open.
        shown.iter().map(|number| number.replace("inf", "∞")).collect()
    }

    /// Whether it is undecided for want of seeds.
    #[must_use]
    pub fn lacks_seeds(&self) -> bool {
        self.outcome == Outcome::Undecided && (1..Self::MIN_SEEDS).contains(&self.n)
    }
}

/// Whether a claim holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// The data support it.
    Holds,
    /// It is true of these seeds, and nothing is said of others.
    Describes,
    /// The data do not decide it.
    #[default]
    Undecided,
    /// The data contradict it.
    Fails,
}

impl Verdict {
    /// The outcome over all coordinates: the worst.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        self.findings.iter().map(|finding| finding.outcome).max().unwrap_or(Outcome::Undecided)
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Holds => "holds",
            Self::Describes => "describes",
            Self::Undecided => "undecided",
            Self::Fails => "fails",
        })
    }
}

impl Artifact for Verdict {
    const KIND: &'static str = "Verdict";

    fn encode(&self) -> Vec<u8> {
        Tensors::default().encode(Self::KIND, &self.findings)
    }

    fn decode(bytes: &[u8]) -> Option<Self> {
        Tensors::decode(Self::KIND, bytes).map(|(_, findings)| Self { findings })
    }
}
