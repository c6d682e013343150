//! `plant-sim`: runs the controller against the simulated robot, and inspects the results.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::main() {
        Ok(code) => code,
        Err(message) => {
            eprintln!("plant-sim: {message}");
            ExitCode::FAILURE
        }
    }
}
