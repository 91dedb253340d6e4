//! What does not go together, and how to mend it.

/// Why layers do not take a shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Misfit {
    /// What is wrong, in one sentence without a full stop.
    pub message: String,
    /// How to mend it.
    pub help: String,
}

impl Misfit {
    /// A misfit.
    #[must_use]
    pub fn new(message: String, help: &str) -> Self {
        Self { message, help: help.to_owned() }
    }
}

/// `a number`, `vectors of 3`, `sequences of 5 × 3` or `images of 1 × 8 × 8`.
#[must_use]
pub fn sizes_told(shape: &[usize]) -> String {
    let sizes: Vec<String> = shape.iter().map(usize::to_string).collect();
    let sizes = sizes.join(" × ");
    match shape.len() {
        0 => "numbers".to_owned(),
        1 => format!("vectors of {sizes}"),
        2 => format!("sequences of {sizes}"),
        3 => format!("images of {sizes}"),
        _ => format!("arrays of {sizes}"),
    }
}
