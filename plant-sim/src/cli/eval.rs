//! `plant-sim eval`: the formulas of controller and plant, row by row over a table.

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use plant_sim::eval::{By, Table, eval};
use plant_sim::input;

use super::{run, show};

/// Arguments of `eval`.
#[derive(Args)]
pub(super) struct EvalArgs {
    /// What to compute.
    #[arg(value_enum)]
    table: Table,
    /// The robot (a model file); default: the IRB 930-22/1.05.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Payload at the flange (a file with mass, com_flange_frame, inertia_com_diag).
    #[arg(long, value_name = "FILE")]
    payload: Option<PathBuf>,
    /// Implementation to use.
    #[arg(long, value_enum, default_value = "lagrange")]
    by: By,
}

/// Reads rows from standard input and writes results to standard output; after an error, nothing.
pub(super) fn run(args: &EvalArgs) -> Result<ExitCode, String> {
    let model = run::load(args.model.as_ref())?;
    let payload = match &args.payload {
        None => None,
        Some(path) => Some(input::payload(path).map_err(|error| error.to_string())?),
    };
    let mut output = Vec::new();
    eval(
        args.table,
        args.by,
        &model,
        payload.as_ref(),
        io::stdin().lock(),
        &mut output,
    )
    .map_err(|error| format!("standard input: {error}"))?;
    show(&String::from_utf8_lossy(&output))?;
    Ok(ExitCode::SUCCESS)
}
