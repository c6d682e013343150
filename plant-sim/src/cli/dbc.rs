//! `plant-sim dbc`: the messages for other CAN tools.

use std::path::PathBuf;

use clap::Args;
use plant_sim::output;
use trace::dbc;

use super::{Failure, show};

/// Arguments of `dbc`.
#[derive(Args)]
pub(super) struct DbcArgs {
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Writes the DBC file.
pub(super) fn run(args: &DbcArgs) -> Result<(), Failure> {
    let text = dbc::generate();
    match &args.out {
        Some(path) => output::write(path, &text)?,
        None => show(&text)?,
    }
    Ok(())
}
