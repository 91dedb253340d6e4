//! The fuzz target: see `run`.
#![no_main]

#[path = "../../tests/pipeline.rs"]
mod pipeline;

use std::sync::LazyLock;

use ivx_op::Registry;
use libfuzzer_sys::fuzz_target;

static REGISTRY: LazyLock<Registry> = LazyLock::new(ivx_library::registry);

fuzz_target!(|bytes: &[u8]| pipeline::run(&String::from_utf8_lossy(bytes), &REGISTRY));
