//! `plant-sim check`: whether a scenario could run, and what it would come to, without running it.

use std::fmt::Write as _;

use clap::Args;
use sim::rehearsal::{Plan, RehearsalError, rehearse};
use sim::world::OperatorError;

use super::run::{ConfigArgs, what};
use super::{Failure, show};

/// Arguments of `check`.
#[derive(Args)]
pub(super) struct CheckArgs {
    #[arg(value_name = "NAME|FILE", default_value = "gate", help = what("check"))]
    name: String,
    /// The same, written as for run.
    #[arg(long, value_name = "NAME|FILE", conflicts_with = "name")]
    scenario: Option<String>,
    #[command(flatten)]
    config: ConfigArgs,
    /// Print JSON instead of text.
    #[arg(long)]
    json: bool,
}

/// Plans the scenario and shows durations and torques. Fails where the controller would refuse a step.
pub(super) fn run(args: &CheckArgs) -> Result<(), Failure> {
    let scenario = args.scenario.as_ref().unwrap_or(&args.name);
    let config = args.config.config(scenario)?;
    let plan = rehearse(&config).map_err(|error| match error {
        RehearsalError::Setup(error) => Failure::usage(error),
        RehearsalError::Operator(errors) => {
            Failure::failed(refused(&config.scenario.name, &errors))
        }
    })?;
    if args.json {
        let json = serde_json::to_string_pretty(&plan).map_err(|error| error.to_string())?;
        show(&(json + "\n"))
    } else {
        show(&text(&plan))
    }
}

/// Why a scenario cannot run. A step after a refused one has another start than it would have.
fn refused(name: &str, errors: &[OperatorError]) -> String {
    match errors {
        [error] => format!("scenario {name} cannot run: {error}"),
        _ => errors.iter().fold(
            format!(
                "scenario {name} cannot run; after a refusal, steps are planned from where the arm is:"
            ),
            |text, error| text + &format!("\n  {error}"),
        ),
    }
}

/// Moves that are listed; of a longer scenario the totals say enough.
const LISTED: usize = 40;

fn text(plan: &Plan) -> String {
    let mut text = String::new();
    let percent = |shares: &[f64; 4]| {
        shares
            .map(|share| format!("{:6.0} %", share * 100.0))
            .join("  ")
    };
    let _ = writeln!(
        text,
        "{} on {}: nothing is refused",
        plan.scenario, plan.robot
    );
    let _ = writeln!(
        text,
        "  move                      duration    torque, peak as planned\n{:41}shoulder   elbow     lift    wrist",
        ""
    );
    for planned in plan.moves.iter().take(LISTED) {
        let name = format!("{} of {}", planned.step, planned.cycle);
        let _ = writeln!(
            text,
            "  {name:24}  {:8.3} s  {}",
            planned.duration_s,
            percent(&planned.torque_utilisation)
        );
    }
    if let Some(more @ 1..) = plan.moves.len().checked_sub(LISTED) {
        let _ = writeln!(text, "  and {more} more");
    }
    let cycles = if plan.cycles == 1 { "cycle" } else { "cycles" };
    let _ = writeln!(
        text,
        "  torque, peak                          {}\n  speed, peak                           {}",
        percent(&plan.torque_utilisation),
        percent(&plan.speed_utilisation),
    );
    let _ = writeln!(
        text,
        "  {} {cycles} in {:.2} s, as planned; an operator who waits for State adds up to 20 ms to each move",
        plan.cycles, plan.duration_s
    );
    text
}
