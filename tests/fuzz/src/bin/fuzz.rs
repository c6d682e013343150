//! libFuzzer on the target that the variable `FUZZ_TARGET` names; `tests/ci/23-fuzz.sh` builds and calls it.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "an example or a benchmark of the built-in files"
)]
#![no_main]

use std::env;
use std::sync::OnceLock;

use fuzz::{TARGETS, Target, names};
use libfuzzer_sys::fuzz_target;

static TARGET: OnceLock<Target> = OnceLock::new();

fn target() -> Target {
    let name = env::var("FUZZ_TARGET").unwrap_or_default();
    let Some((_, target)) = TARGETS.iter().find(|(known, _)| *known == name) else {
        eprintln!("FUZZ_TARGET is '{name}'; allowed: {}", names());
        std::process::exit(2);
    };
    *target
}

fuzz_target!(|data: &[u8]| TARGET.get_or_init(target)(data));
