//! What becomes of rows in which something is missing.

use std::fmt::Debug;
use std::sync::LazyLock;

use ivx_op::{Parts, declare, family};

/// What is done with gaps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gaps {
    /// They are errors.
    Refused,
    /// Their rows are left out.
    Dropped,
    /// Inputs get this number.
    Filled(f64),
    /// Inputs get the mean of their column.
    Means,
}

/// What programs write where there is no text.
pub(crate) fn is_no_text(text: &str) -> bool {
    let text = text.trim().to_ascii_lowercase();
    matches!(&*text, "" | "na" | "n/a" | "nan" | "null" | "?")
}

/// What becomes of rows in which something is missing.
pub trait Missing: Debug + Send + Sync {
    /// What is done.
    fn gaps(&self) -> Gaps;
}

declare! {
    /// Something that is missing is an error, which names its place.
    pub struct Refused = "refused" @ 1 {}
}

declare! {
    /// Rows in which something is missing are left out, with all that is in them.
    pub struct Dropped = "dropped" @ 1 {}
}

declare! {
    /// A number stands in the place of each input that is missing. A target that is missing is an error.
    pub struct Filled = "filled" @ 1 {
        /// The number.
        with: f64;
    }
}

declare! {
    /// The mean of its column stands in the place of each input that is missing: of the whole file, and so of rows too
    /// that are tested on later. A target that is missing is an error.
    pub struct MeanFilled = "mean_filled" @ 1 {}
}

impl Missing for Refused {
    fn gaps(&self) -> Gaps {
        Gaps::Refused
    }
}

impl Missing for Dropped {
    fn gaps(&self) -> Gaps {
        Gaps::Dropped
    }
}

impl Missing for Filled {
    fn gaps(&self) -> Gaps {
        Gaps::Filled(self.with)
    }
}

impl Missing for MeanFilled {
    fn gaps(&self) -> Gaps {
        Gaps::Means
    }
}

/// What can be done, by name.
pub(crate) fn missing() -> &'static Parts<dyn Missing> {
    static TABLE: LazyLock<Parts<dyn Missing>> = LazyLock::new(|| {
        Parts::<dyn Missing>::new()
            .with(|x: Refused| Box::new(x))
            .with(|x: Dropped| Box::new(x))
            .with(|x: Filled| Box::new(x))
            .with(|x: MeanFilled| Box::new(x))
    });
    &TABLE
}

family!(dyn Missing, "Missing", missing);
