//! `plant-sim timing`: timing of the loop on this machine and this bus.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use link::LinkAddress;
use plant_sim::external::{histogram, measure};
use plant_sim::output;
use sim::scenario;
use sim::text;

use super::values::{number, svg};
use super::{Failure, show};

/// Arguments of `timing`.
#[derive(Args)]
pub(super) struct TimingArgs {
    /// The bus, with a controller on it (controller --bus BUS --real-time): socketcan:INTERFACE,
    /// slcan:TERMINAL or slcan:tcp:HOST:PORT.
    #[arg(long, value_name = "BUS")]
    bus: LinkAddress,
    /// Sampling rate.
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, allow_negative_numbers = true, value_parser = number)]
    rate: f64,
    /// Duration.
    #[arg(long, value_name = "S", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=86_400))]
    seconds: u32,
    /// Where the histogram goes.
    #[arg(long, value_name = "FILE", default_value = "timing.svg", value_parser = svg)]
    svg: PathBuf,
}

/// Measures, prints percentiles and margins, draws the histogram.
pub(super) fn run(args: &TimingArgs) -> Result<(), Failure> {
    scenario::check_rate(args.rate).map_err(|allowed| {
        Failure::usage(format!(
            "--rate is {}; allowed: {allowed}",
            text::number(args.rate)
        ))
    })?;
    let time = Duration::from_secs(args.seconds.into());
    let timing = measure(&args.bus, args.rate, time).map_err(|error| error.to_string())?;
    output::write(&args.svg, &histogram(&timing))?;
    show(&timing.report())?;
    show(&format!("histogram in {}\n", args.svg.display()))?;
    Ok(())
}
