//! `plant-sim`: runs the controller against the simulated robot, and inspects the results.

#![deny(clippy::print_stderr, clippy::print_stdout)]

mod cli;

use std::process::ExitCode;

use plant_sim::guard::guard;

fn main() -> ExitCode {
    ExitCode::from(guard(cli::main))
}
