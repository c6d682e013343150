//! `plant-sim model`: a robot for a controller in another process.
//!
//! Model files are only read and checked here. The controller takes the output: its own numbers in its own precision,
//! which read back exactly.

use std::path::{Path, PathBuf};

use clap::Args;
use firmware::mechanics::arm::ArmModel;

use plant_sim::output;

use super::run::load;
use super::{Failure, show};

/// Arguments of `model`.
#[derive(Args)]
pub(super) struct ModelArgs {
    /// The robot: irb930-22-1.05 (the default), irb930-12-0.85 or a model file.
    #[arg(value_name = "NAME|FILE")]
    robot: Option<String>,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Writes the robot as JSON.
pub(super) fn run(args: &ModelArgs) -> Result<(), Failure> {
    let arm = ArmModel::from(&load(args.robot.as_deref())?);
    arm.validate()
        .map_err(|error| format!("the controller cannot use this robot: {error}"))?;
    let text = serde_json::to_string_pretty(&arm).map_err(|error| error.to_string())? + "\n";
    let input = args.robot.as_deref().map(Path::new);
    output::distinct(input, args.out.as_deref())?;
    match &args.out {
        Some(path) => output::write(path, &text)?,
        None => show(&text)?,
    }
    Ok(())
}
