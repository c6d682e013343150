//! `plant-sim what-if`: the page that runs the simulation in a browser.

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use plant_sim::{output, report};

use super::show;

/// First bytes of every WebAssembly module.
const MAGIC: &[u8] = b"\0asm";

/// Arguments of `what-if`.
#[derive(Args)]
pub(super) struct WhatIfArgs {
    /// The simulation as a WebAssembly module; plant-sim/web/build builds it and the page.
    module: PathBuf,
    /// The page.
    #[arg(long, value_name = "FILE", default_value = "what-if.html")]
    out: PathBuf,
}

/// Writes the page.
pub(super) fn run(args: &WhatIfArgs) -> Result<ExitCode, String> {
    let path = args.module.display();
    let module =
        fs::read(&args.module).map_err(|error| format!("{path}: cannot be read: {error}"))?;
    if !module.starts_with(MAGIC) {
        return Err(format!(
            "{path}: not a WebAssembly module; plant-sim/web/build builds it and the page"
        ));
    }
    output::write(&args.out, &report::what_if(&module)).map_err(|error| error.to_string())?;
    show(&format!("{}\n", args.out.display()))?;
    Ok(ExitCode::SUCCESS)
}
