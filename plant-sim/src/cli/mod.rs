//! The command line: one file per subcommand.

mod arrival;
mod cost;
mod crash;
mod dbc;
mod dissector;
mod eval;
mod model;
mod monitor;
mod parameters;
mod record;
mod report;
mod run;
mod signal;
mod timing;
mod trace;
mod what_if;

use std::io::{self, Write as _};
use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Development bench for a SCARA drive cabinet: the cabinet's controller against
/// a simulated IRB 930, over CAN.
#[derive(Parser)]
#[command(name = "plant-sim", version = env!("VERSION_AND_COMMIT"), args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: run::RunArgs,
}

#[derive(Subcommand)]
enum Command {
    /// Run a scenario (the default command).
    Run(run::RunArgs),
    /// Count the instructions and the stack that the controller takes on the emulated Cortex-M4F.
    Cost(cost::CostArgs),
    /// Plant faults into the controller on the emulated Cortex-M4F, and see how they end.
    Crash(crash::CrashArgs),
    /// Compute kinematics or dynamics for the rows of a CSV table on standard input.
    Eval(eval::EvalArgs),
    /// Measure the timing of the loop with an external controller, against the watchdog limits.
    Timing(timing::TimingArgs),
    /// Compare two runs on one page.
    Report(report::ReportArgs),
    /// Write the page that runs the simulation in a browser.
    WhatIf(what_if::WhatIfArgs),
    /// Inspect a recorded trace.
    #[command(subcommand)]
    Trace(trace::TraceCommand),
    /// Watch a bus: identifiers, rates, values, load, states and faults.
    Monitor(monitor::MonitorArgs),
    /// Record a bus into a file, or into several by size.
    Record(record::RecordArgs),
    /// List and set parameters of controller and drives over a bus.
    Parameters(parameters::ParametersArgs),
    /// Write the messages of the link as a DBC file.
    Dbc(dbc::DbcArgs),
    /// Write the messages of the link as a dissector for Wireshark (Lua).
    Dissector(dissector::DissectorArgs),
    /// Write a robot for an external controller (controller --model).
    Model(model::ModelArgs),
}

/// Executes the command line. An error is one message for the user.
pub(crate) fn main() -> Result<ExitCode, String> {
    let cli = Cli::parse();
    match cli.command {
        None => run::run(&cli.run),
        Some(Command::Run(args)) => run::run(&args),
        Some(Command::Cost(args)) => cost::run(&args),
        Some(Command::Crash(args)) => crash::run(&args),
        Some(Command::Eval(args)) => eval::run(&args),
        Some(Command::Timing(args)) => timing::run(&args),
        Some(Command::Report(args)) => report::run(&args),
        Some(Command::WhatIf(args)) => what_if::run(&args),
        Some(Command::Trace(command)) => trace::run(&command),
        Some(Command::Monitor(args)) => monitor::run(&args),
        Some(Command::Record(args)) => record::run(&args),
        Some(Command::Parameters(args)) => parameters::run(&args),
        Some(Command::Dbc(args)) => dbc::run(&args),
        Some(Command::Dissector(args)) => dissector::run(&args),
        Some(Command::Model(args)) => model::run(&args),
    }
}

/// Writes to standard output. A reader that has closed the pipe (`| head`) is not an error.
fn show(text: &str) -> Result<(), String> {
    match io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(format!("cannot write to standard output: {error}"))
        }
        _ => Ok(()),
    }
}
