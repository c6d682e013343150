//! `plant-sim what-if`: the page that runs the simulation in a browser.

use std::fs;
use std::path::PathBuf;

use clap::Args;
use plant_sim::{output, report};

use super::{Failure, show};

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
pub(super) fn run(args: &WhatIfArgs) -> Result<(), Failure> {
    output::distinct([args.module.as_path()], [args.out.as_path()])?;
    let path = args.module.display();
    let module = fs::read(&args.module)
        .map_err(|error| Failure::usage(format!("{path}: cannot be read: {error}")))?;
    if !module.starts_with(MAGIC) {
        return Err(Failure::usage(format!(
            "{path}: not a WebAssembly module; plant-sim/web/build builds it and the page"
        )));
    }
    output::write(&args.out, &report::what_if(&module))?;
    show(&format!("{}\n", args.out.display()))?;
    Ok(())
}
