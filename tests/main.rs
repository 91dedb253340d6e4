//! Tests that cross the boundaries of ivx's crates.

mod archives;
mod cases;
mod claims;
mod corpus;
mod design;
mod docs;
mod editors;
mod examples;
mod experiments;
mod explain;
mod failures;
mod foreseen;
mod keys;
mod large;
mod layout;
mod new;
mod pipeline;
mod project;
mod published;
mod records;
mod report;
mod reruns;
mod tidy;
mod values;
mod versions;
mod why;
