//! `plant-sim`: runs the controller against the simulated robot, and inspects the results.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "an index or an expectation names an invariant of this crate; one that breaks is its own fault"
)]
#![deny(clippy::print_stderr, clippy::print_stdout)]

mod cli;

use std::process::ExitCode;

use terminal::guard;

fn main() -> ExitCode {
    ExitCode::from(guard("plant-sim", env!("VERSION_AND_COMMIT"), cli::main))
}
