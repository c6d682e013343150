//! `plant-sim model`: a robot for a controller in another process.
//!
//! Model files are only read and checked here. The controller takes the output: its own numbers in its own precision,
//! which read back exactly.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use firmware::mechanics::arm::ArmModel;

use plant_sim::output;

use super::run::load;
use super::show;

/// Arguments of `model`.
#[derive(Args)]
pub(super) struct ModelArgs {
    /// The robot (a model file); otherwise the built-in IRB 930-22/1.05.
    file: Option<PathBuf>,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Writes the robot as JSON.
pub(super) fn run(args: &ModelArgs) -> Result<ExitCode, String> {
    let arm = ArmModel::from(&load(args.file.as_ref())?);
    arm.validate()
        .map_err(|error| format!("the controller cannot use this robot: {error}"))?;
    let text = serde_json::to_string_pretty(&arm).map_err(|error| error.to_string())? + "\n";
    match &args.out {
        Some(path) => output::write(path, &text).map_err(|error| error.to_string())?,
        None => show(&text)?,
    }
    Ok(ExitCode::SUCCESS)
}
