//! Tests that cross the boundaries of ivx's crates.

mod cases;
mod docs;
mod editors;
mod examples;
mod experiments;
mod explain;
mod failures;
mod layout;
mod new;
mod project;
mod records;
mod reruns;
mod tidy;
mod versions;
