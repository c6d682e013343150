//! `plant-sim cost`: cost of the controller on the emulated Cortex-M4F.

use std::cell::RefCell;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::rc::Rc;

use clap::Args;
use firmware::control::phase::Phase;
use plant_sim::input;
use plant_sim::qemu::{self, COST_IMAGE, Channel, Costs, IMAGE, Options, Poll, Qemu};
use protocol::table::FEEDBACK;
use schemars::JsonSchema;
use serde::Serialize;
use sim::run::with_controller;
use sim::selection::LawChoice;
use sim::setup::RunConfig;

use super::run::what;
use super::values::image;
use super::{Failure, show};

/// Arguments of `cost`.
#[derive(Args)]
pub(super) struct CostArgs {
    #[arg(long, value_name = "NAME|FILE", default_value = "gate", help = what())]
    scenario: String,
    /// Control law, as for run; the default is the most expensive one.
    #[arg(
        long,
        value_name = "NAME",
        default_value = "computed-torque-task:observer"
    )]
    law: LawChoice,
    /// The image of the controller, instead of the one built from the sources.
    #[arg(long, value_name = "FILE", value_parser = image)]
    image: Option<PathBuf>,
    /// The image that measures phases, instead of the one built from the sources.
    #[arg(long, value_name = "FILE", value_parser = image)]
    cost_image: Option<PathBuf>,
    /// Print the figures as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs two cycles with each image and shows instructions by kind of call and by phase: the second cycle is planned
/// while the first is still running. The emulator's counts are the same in every run.
pub(super) fn run(args: &CostArgs) -> Result<(), Failure> {
    let whole = measure(args, args.image.as_ref(), IMAGE)?;
    let parts = measure(args, args.cost_image.as_ref(), COST_IMAGE)?;
    let report = Report::new(&whole, &parts);
    if args.json {
        let json = serde_json::to_string_pretty(&report).map_err(|error| error.to_string())?;
        show(&(json + "\n"))?;
    } else {
        show(&report.text())?;
    }
    Ok(())
}

fn measure(args: &CostArgs, image: Option<&PathBuf>, program: &str) -> Result<Costs, Failure> {
    let image =
        qemu::image(image.map(PathBuf::as_path), program).map_err(|error| error.to_string())?;
    let mut scenario = input::scenario(&args.scenario, &[])?;
    scenario.law = args.law;
    scenario.cycles = 2;
    let config = RunConfig::new(scenario);
    let costs = Rc::new(RefCell::new(Costs::default()));
    let options = Options {
        image: Some(image),
        channel: Channel::Fifo,
        count: Some(Rc::clone(&costs)),
        in_step: false,
    };
    let summary = with_controller(
        &config,
        |config| Qemu::start(config, &options),
        &mut (),
        &mut (),
    )
    .map_err(|error| error.to_string())?;
    if let Some(error) = summary.error {
        return Err(format!("the run was not completed: {error}").into());
    }
    Ok(costs.take())
}

/// Instructions by kind of call and by phase.
#[derive(Serialize, JsonSchema)]
pub(super) struct Report {
    /// By kind of call.
    calls: Vec<Row>,
    /// By phase of a call.
    phases: Vec<Row>,
    /// Most stack used, bytes.
    stack: u32,
}

/// Instructions of calls of one kind, or of one phase of them.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Count")]
struct Row {
    /// Kind of call, or phase.
    name: &'static str,
    /// How many.
    calls: usize,
    /// Fewest instructions.
    min: u32,
    /// Median.
    median: u32,
    /// Most instructions.
    max: u32,
}

impl Report {
    fn new(whole: &Costs, parts: &Costs) -> Self {
        let calls = KINDS.into_iter().filter_map(|name| {
            let of_kind = |(index, poll): (usize, &Poll)| {
                (kind(index, poll) == name).then_some(poll.instructions)
            };
            row(name, whole.polls.iter().enumerate().filter_map(of_kind))
        });
        let phases = Phase::ALL.into_iter().filter_map(|phase| {
            let of_phase = |(index, poll): (usize, &Poll)| {
                let counts = match phase {
                    Phase::Planning => kind(index, poll) == "sample_planning",
                    // Without torque there is no law and little else.
                    _ => poll.phases[Phase::Law as usize] > 0,
                };
                counts.then_some(poll.phases[phase as usize])
            };
            row(
                phase.name(),
                parts.polls.iter().enumerate().filter_map(of_phase),
            )
        });
        Self {
            calls: calls.collect(),
            phases: phases.collect(),
            stack: whole.stack,
        }
    }

    fn text(&self) -> String {
        let mut text = String::new();
        for (what, rows) in [("call", &self.calls), ("phase", &self.phases)] {
            let _ = writeln!(
                text,
                "{what:<16} calls    min  median     max   instructions"
            );
            for row in rows {
                let Row {
                    name,
                    calls,
                    min,
                    median,
                    max,
                } = row;
                let _ = writeln!(text, "{name:<16} {calls:>5} {min:>6} {median:>7} {max:>7}");
            }
        }
        let _ = writeln!(text, "stack {} bytes", self.stack);
        text
    }
}

/// Minimum, median and maximum of the counts; `None` if there are none.
fn row(name: &'static str, counts: impl Iterator<Item = u32>) -> Option<Row> {
    let mut counts: Vec<u32> = counts.collect();
    counts.sort_unstable();
    Some(Row {
        name,
        calls: counts.len(),
        min: *counts.first()?,
        median: counts[counts.len() / 2],
        max: *counts.last()?,
    })
}

/// Kinds of call, as named in the report.
const KINDS: [&str; 5] = [
    "start",
    "sample",
    "sample_planning",
    "other_frame",
    "no_frame",
];

fn kind(index: usize, poll: &Poll) -> &'static str {
    match poll.received {
        // The self-test is part of it.
        _ if index == 0 => "start",
        None => "no_frame",
        Some(id) if id != u32::from(FEEDBACK.id) => "other_frame",
        Some(_) if poll.planning => "sample_planning",
        Some(_) => "sample",
    }
}
