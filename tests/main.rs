//! Tests that cross the boundaries of ivx's crates.

mod cases;
mod corpus;
mod docs;
mod editors;
mod examples;
mod experiments;
mod explain;
mod failures;
mod large;
mod layout;
mod new;
mod pipeline;
mod project;
mod reruns;
mod tidy;
mod versions;
