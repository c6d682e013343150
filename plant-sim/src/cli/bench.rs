//! `plant-sim bench`: what the controller attains, beside what could be attained.

use std::num::NonZero;
use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use plant_sim::bench::{self, Controller, Extent};
use plant_sim::output::{self, File};
use plant_sim::qemu;

use super::values::{count, jobs, svg};
use super::{Failure, show};

/// Subcommands of `bench`.
#[derive(Subcommand)]
pub(super) enum BenchCommand {
    /// Measure gates in closed loop in seven places with four payloads: times beside the optimum, errors, torques, and how warm
    /// the motors get; the same with another friction and payload than the controller believes; gates at random beside the planner of
    /// before; how well a pose is attained again and again.
    Motion(MotionArgs),
}

/// Arguments of `motion`.
#[derive(Args)]
pub(super) struct MotionArgs {
    /// Only one place, two payloads and one rate.
    #[arg(long)]
    quick: bool,
    /// Threads; as many as the machine has cores if left out.
    #[arg(long, value_name = "N", value_parser = count)]
    jobs: Option<NonZero<u32>>,
    /// Where the controller runs: in this process, or on an emulated Cortex-M4F, whose every frame is compared with that of the one
    /// in this process.
    #[arg(long, value_name = "WHERE", default_value = "in-process")]
    controller: Place,
    /// Print JSON instead of tables.
    #[arg(long)]
    json: bool,
    /// Write every row to this file as CSV.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write every gate at random to this file as CSV.
    #[arg(long, value_name = "FILE")]
    others: Option<PathBuf>,
    /// Write the repeatability of a pose to this file as CSV.
    #[arg(long, value_name = "FILE")]
    repeatability: Option<PathBuf>,
    /// Draw the rows without mismatch into this file.
    #[arg(long, value_name = "FILE", value_parser = svg)]
    svg: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Place {
    InProcess,
    Qemu,
}

/// Executes a subcommand.
pub(super) fn run(command: &BenchCommand) -> Result<(), Failure> {
    match command {
        BenchCommand::Motion(args) => motion(args),
    }
}

/// Runs the benchmark and shows it. Fails where a gate was not completed.
fn motion(args: &MotionArgs) -> Result<(), Failure> {
    let outputs = [&args.csv, &args.svg, &args.others, &args.repeatability];
    output::distinct(None, outputs.into_iter().flatten().map(PathBuf::as_path))?;
    // What cannot be written is refused before the work.
    let create = |path: &Option<PathBuf>| path.as_deref().map(File::create).transpose();
    let (csv, svg) = (create(&args.csv)?, create(&args.svg)?);
    let (others, repeatability) = (create(&args.others)?, create(&args.repeatability)?);
    let extent = if args.quick {
        Extent::Quick
    } else {
        Extent::Whole
    };
    let controller = match args.controller {
        Place::InProcess => Controller::InProcess,
        Place::Qemu => {
            let image = qemu::image(None, qemu::IMAGE).map_err(Failure::failed)?;
            Controller::Qemu(image)
        }
    };
    let report = bench::motion(extent, &controller, jobs(args.jobs)).map_err(Failure::failed)?;
    if let Some(file) = csv {
        output::finish(file, &bench::csv(&report)?)?;
    }
    if let Some(file) = others {
        output::finish(file, &bench::other_csv(&report)?)?;
    }
    if let Some(file) = repeatability {
        output::finish(file, &bench::repeatability_csv(&report)?)?;
    }
    if let Some(file) = svg {
        output::finish(file, &bench::picture(&report))?;
    }
    if args.json {
        let json = serde_json::to_string_pretty(&report).map_err(|error| error.to_string())?;
        show(&(json + "\n"))?;
    } else {
        show(&bench::text(&report))?;
    }
    report
        .failure()
        .map_or(Ok(()), |why| Err(Failure::failed(why)))
}
