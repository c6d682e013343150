//! `plant-sim report`: two runs on one page.

use std::path::PathBuf;

use clap::Args;
use plant_sim::{output, report};

use super::{Failure, show};

/// Arguments of `report`.
#[derive(Args)]
pub(super) struct ReportArgs {
    /// Folder of a run, with its report.html.
    one: PathBuf,
    /// Folder of the run to compare it with.
    other: PathBuf,
    /// The page.
    #[arg(long, value_name = "FILE", default_value = "compare.html")]
    out: PathBuf,
}

/// Writes the page about both.
pub(super) fn run(args: &ReportArgs) -> Result<(), Failure> {
    let folders = [args.one.as_path(), &args.other];
    let pages = folders.map(|folder| folder.join(report::FILE));
    output::distinct(pages.iter().map(PathBuf::as_path), [args.out.as_path()])?;
    let page = report::compare(folders).map_err(Failure::usage)?;
    output::write(&args.out, &page)?;
    show(&format!("{}\n", args.out.display()))?;
    Ok(())
}
