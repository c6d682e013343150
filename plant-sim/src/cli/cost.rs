//! `plant-sim cost`: what the controller costs on the emulated Cortex-M4F.

use std::cell::RefCell;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::rc::Rc;

use clap::Args;
use plant_sim::model::RobotModel;
use plant_sim::qemu::{Channel, Measured, Options, Poll, Qemu};
use plant_sim::run::{self, RunConfig};
use plant_sim::scenario::Scenario;
use plant_sim::selection::LawChoice;
use protocol::table::FEEDBACK;

use super::show;

/// Arguments of `cost`.
#[derive(Args)]
pub struct CostArgs {
    /// What to run: gate, gate-mismatch, square, pick-place, or a scenario file.
    #[arg(long, value_name = "NAME|FILE", default_value = "gate")]
    scenario: String,
    /// Control law, as for run; the default is the most expensive one.
    #[arg(
        long,
        value_name = "NAME",
        default_value = "computed-torque-task:observer"
    )]
    law: LawChoice,
    /// The image, instead of the one built from the sources.
    #[arg(long, value_name = "FILE")]
    image: Option<PathBuf>,
}

/// Runs two cycles and shows instructions by kind of call: the second is planned while the first
/// is still running. The count is that of the emulator, the same in every run.
pub fn run(args: &CostArgs) -> Result<ExitCode, String> {
    let mut scenario = Scenario::open(&args.scenario).map_err(|error| error.to_string())?;
    scenario.law = args.law;
    scenario.cycles = 2;
    let model = RobotModel::irb_930_22_105();
    let config = RunConfig {
        scenario,
        plant_model: model.clone(),
        model,
        seed: 1,
    };
    let measured = Rc::new(RefCell::new(Measured::default()));
    let options = Options {
        image: args.image.clone(),
        channel: Channel::Fifo,
        count: Some(Rc::clone(&measured)),
    };
    let summary = run::execute_with(&config, None, |config| Qemu::start(config, &options))
        .map_err(|error| error.to_string())?;
    show(&report(&measured.borrow()))?;
    match summary.error {
        None => Ok(ExitCode::SUCCESS),
        Some(error) => Err(format!("the run was not completed: {error}")),
    }
}

/// Kinds of call, as the report names them.
const KINDS: [&str; 4] = ["sample", "sample_planning", "other_frame", "no_frame"];

fn kind(poll: &Poll) -> &'static str {
    match poll.received {
        None => "no_frame",
        Some(id) if id != u32::from(FEEDBACK.id) => "other_frame",
        Some(_) if poll.planning => "sample_planning",
        Some(_) => "sample",
    }
}

/// One line a kind of call, and the stack.
fn report(measured: &Measured) -> String {
    let mut text = String::from("call              calls    min  median     max   instructions\n");
    for name in KINDS {
        let mut counts: Vec<u32> = measured
            .polls
            .iter()
            .filter(|poll| kind(poll) == name)
            .map(|poll| poll.instructions)
            .collect();
        counts.sort_unstable();
        if let (Some(min), Some(max)) = (counts.first(), counts.last()) {
            let median = counts[counts.len() / 2];
            let calls = counts.len();
            let _ = writeln!(text, "{name:<16} {calls:>6} {min:>6} {median:>7} {max:>7}");
        }
    }
    let _ = writeln!(text, "stack {} bytes", measured.stack);
    text
}
