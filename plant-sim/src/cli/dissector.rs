//! `plant-sim dissector`: the messages for Wireshark.

use std::path::PathBuf;

use clap::Args;
use plant_sim::output;
use trace::dissector;

use super::{Failure, show};

/// Arguments of `dissector`.
#[derive(Args)]
pub(super) struct DissectorArgs {
    /// Write to this file instead of standard output, such as ~/.local/lib/wireshark/plugins/scara.lua.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Writes the Lua file.
pub(super) fn run(args: &DissectorArgs) -> Result<(), Failure> {
    let text = dissector::generate();
    match &args.out {
        Some(path) => output::write(path, &text)?,
        None => show(&text)?,
    }
    Ok(())
}
