//! Tests that cross the boundaries of ivx's crates.

mod cases;
mod experiments;
mod failures;
mod layout;
mod project;
mod reruns;
mod tidy;
mod versions;
