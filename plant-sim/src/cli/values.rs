//! Values that several subcommands take.

use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::thread;

use sim::scenario::MAX_CYCLES;

/// Any number; what it may be is checked where it is used.
pub(super) fn number(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| "allowed: a number".into())
}

/// A number of cycles; how many there may be is checked with the scenario.
pub(super) fn cycles(text: &str) -> Result<i64, String> {
    text.parse()
        .map_err(|_| format!("allowed: a whole number from 1 to {MAX_CYCLES}"))
}

/// A seed; what it may be is checked with the scenario.
pub(super) fn seed(text: &str) -> Result<i64, String> {
    let most = i64::MAX;
    text.parse()
        .map_err(|_| format!("allowed: a whole number from 0 to {most}"))
}

/// How many of something there are to be.
pub(super) fn count(text: &str) -> Result<NonZero<u32>, String> {
    let most = u32::MAX;
    text.parse()
        .map_err(|_| format!("allowed: a whole number from 1 to {most}"))
}

/// Threads: as many as asked for, or as the machine has cores.
pub(super) fn jobs(asked: Option<NonZero<u32>>) -> NonZero<usize> {
    match asked {
        Some(jobs) => NonZero::try_from(jobs).unwrap_or(NonZero::<usize>::MAX),
        None => thread::available_parallelism().unwrap_or(NonZero::<usize>::MIN),
    }
}

/// A file for an SVG: under another picture's name no program would show it.
pub(super) fn svg(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension() {
        Some(other) if !other.eq_ignore_ascii_case("svg") => {
            Err("the plot is an SVG; allowed: a name that ends in .svg".into())
        }
        _ => Ok(path),
    }
}

/// The image of a controller.
pub(super) fn image(text: &str) -> Result<PathBuf, String> {
    let path = Path::new(text);
    if path.is_file() {
        Ok(path.into())
    } else {
        Err("there is no such file; allowed: the ELF file of the board's program".into())
    }
}
