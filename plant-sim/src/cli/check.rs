//! `plant-sim check`: whether a scenario can run, and what it comes to, from its plan and a trial of one cycle.

use std::fmt::Write as _;

use clap::Args;
use plant_sim::say;
use sim::rehearsal::{Plan, rehearse};

use super::run::{ConfigArgs, ScenarioArgs};
use super::{Failure, show};

/// Arguments of `check`.
#[derive(Args)]
pub(super) struct CheckArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,
    #[command(flatten)]
    config: ConfigArgs,
    /// Print JSON instead of text.
    #[arg(long)]
    json: bool,
}

/// Plans the scenario and shows durations and torques. Fails where the controller would refuse a step.
pub(super) fn run(args: &CheckArgs) -> Result<(), Failure> {
    let config = args.config.config(args.scenario.name())?;
    let plan = rehearse(&config).map_err(Failure::usage)?;
    let said = config.warnings();
    for warning in plan.warnings.iter().filter(|it| !said.contains(it)) {
        say!("plant-sim: warning: {warning}");
    }
    if args.json {
        let json = serde_json::to_string_pretty(&plan).map_err(|error| error.to_string())?;
        show(&(json + "\n"))?;
    } else if plan.refused.is_empty() {
        show(&text(&plan))?;
    }
    refused(&plan)
}

/// Fails with why a scenario cannot run. A step after a refused one has another start than it would have.
fn refused(plan: &Plan) -> Result<(), Failure> {
    let name = &plan.scenario;
    Err(Failure::failed(match plan.refused.as_slice() {
        [] => return Ok(()),
        [refused] => format!("scenario {name} cannot run: {}", refused.reason),
        all => all.iter().fold(
            format!(
                "scenario {name} cannot run; after a refusal, steps are planned from where the arm is:"
            ),
            |text, refused| text + &format!("\n  {}", refused.reason),
        ),
    }))
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
        "  torque, peak                          {}\n  speed, peak                           {}\n  heat, if it went on for ever          {}",
        percent(&plan.torque_utilisation),
        percent(&plan.speed_utilisation),
        percent(&plan.heat),
    );
    let _ = writeln!(
        text,
        "  {} {cycles} in {:.2} s, as planned; an operator who waits for State adds up to 20 ms to each move",
        plan.cycles, plan.duration_s
    );
    text
}
