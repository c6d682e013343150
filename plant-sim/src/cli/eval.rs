//! `plant-sim eval`: the formulas of controller and plant, row by row over a table.

use std::io;
use std::path::PathBuf;

use clap::Args;
use plant_sim::eval::{By, Elbow, Posture, Table, eval};
use plant_sim::input;

use super::{Failure, run, show};

/// Arguments of `eval`.
#[derive(Args)]
pub(super) struct EvalArgs {
    /// What to compute.
    #[arg(value_enum)]
    table: Table,
    /// The robot: irb930-22-1.05 (the default), irb930-12-0.85 or a model file.
    #[arg(long, value_name = "NAME|FILE")]
    model: Option<String>,
    /// Payload at the flange (a file with mass, com_flange_frame, inertia_com_diag).
    #[arg(long, value_name = "FILE")]
    payload: Option<PathBuf>,
    /// For ik: the side of the elbow that the reason is given for; otherwise that of the better one.
    #[arg(long, value_enum)]
    elbow: Option<Elbow>,
    /// For ik: the turn of the wrist, whole revolutions of theta4, 0 from -pi to pi.
    #[arg(long, allow_negative_numbers = true, value_parser = clap::value_parser!(i8).range(-8..=8))]
    turn: Option<i8>,
    /// Implementation to use.
    #[arg(long, value_enum, default_value = "lagrange")]
    by: By,
}

/// Reads rows from standard input and writes results to standard output; after an error, nothing.
pub(super) fn run(args: &EvalArgs) -> Result<(), Failure> {
    let posture = Posture {
        elbow: args.elbow,
        turn: args.turn,
    };
    if args.table != Table::Ik && posture != Posture::default() {
        return Err(Failure::usage(
            "--elbow and --turn say which joint positions of a pose are meant; allowed: with the table ik",
        ));
    }
    let model = run::load(args.model.as_deref())?;
    let payload = match &args.payload {
        None => None,
        Some(path) => Some(input::payload(path)?),
    };
    let mut output = Vec::new();
    eval(
        args.table,
        posture,
        args.by,
        &model,
        payload.as_ref(),
        io::stdin().lock(),
        &mut output,
    )
    .map_err(|error| Failure::usage(format!("standard input: {error}")))?;
    show(&String::from_utf8_lossy(&output))?;
    Ok(())
}
