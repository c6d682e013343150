//! The command line: one file per subcommand.

mod arrival;
mod bench;
mod bitrate;
mod campaign;
mod check;
mod cost;
mod crash;
mod dbc;
mod dissector;
mod eval;
mod failure;
mod late;
mod model;
mod monitor;
mod pages;
mod parameters;
mod record;
mod report;
mod run;
mod schema;
mod timing;
mod trace;
mod values;
mod view;
mod what_if;

use std::io::{self, Write as _};

use clap::{CommandFactory as _, Parser, Subcommand};
use terminal::only_shown;

pub(crate) use failure::Failure;
use late::Late;

/// In short what docs/exit-codes.md says.
const EXIT_CODES: &str = "Exit codes: 0 done; 1 the run or check failed; 2 wrong usage or input; 3 nothing was judged; \
                          70 a fault of the program itself; 130 ended by a second signal.";

/// Development bench for a SCARA drive cabinet: the cabinet's controller against
/// a simulated IRB 930, over CAN.
#[derive(Parser)]
#[command(name = "plant-sim", version = env!("VERSION_AND_COMMIT"), args_conflicts_with_subcommands = true, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[arg(long, value_name = "NAME|FILE", default_value = run::USUAL, help = run::what())]
    scenario: String,
    #[command(flatten)]
    run: run::RunArgs,
}

#[derive(Subcommand)]
enum Command {
    /// Run a scenario (the default command).
    Run(Box<Late<run::NamedRunArgs>>),
    /// Check a scenario before a run: what would be refused or not followed, how long it takes, what torque it needs.
    Check(Late<check::CheckArgs>),
    /// Run many cases with a fault each, on one machine or on a cluster, and judge them.
    #[command(subcommand)]
    Campaign(Late<campaign::CampaignCommand>),
    /// Measure what the controller attains, beside what could be attained.
    #[command(subcommand)]
    Bench(Late<bench::BenchCommand>),
    /// Count the instructions and the stack that the controller takes on the emulated Cortex-M4F.
    Cost(Late<cost::CostArgs>),
    /// Plant faults into the controller on the emulated Cortex-M4F, and see how they end.
    Crash(Late<crash::CrashArgs>),
    /// Compute kinematics or dynamics for the rows of a CSV table on standard input.
    Eval(Late<eval::EvalArgs>),
    /// Measure the timing of the loop with an external controller, against the watchdog limits.
    Timing(Late<timing::TimingArgs>),
    /// Compare two runs on one page.
    Report(Late<report::ReportArgs>),
    /// Show a run, or a bus, on a page in the browser while it lives, and take part in it.
    View(Late<view::ViewArgs>),
    /// Write the page that runs the simulation in a browser.
    #[command(alias = "whatif")]
    WhatIf(Late<what_if::WhatIfArgs>),
    /// Inspect a recorded trace.
    #[command(subcommand)]
    Trace(Late<trace::TraceCommand>),
    /// Watch a bus: identifiers, rates, values, load, states and faults.
    Monitor(Late<monitor::MonitorArgs>),
    /// Record a bus into a file, or into several by size.
    Record(Late<record::RecordArgs>),
    /// List and set parameters of controller and drives over a bus.
    Parameters(Late<parameters::ParametersArgs>),
    /// Write the messages of the link as a DBC file.
    Dbc(Late<dbc::DbcArgs>),
    /// Write the messages of the link as a dissector for Wireshark (Lua).
    Dissector(Late<dissector::DissectorArgs>),
    /// Print the JSON schema of a file or of JSON output.
    Schema(Late<schema::SchemaArgs>),
    /// Write a robot for an external controller (controller --model).
    Model(Late<model::ModelArgs>),
    /// Write a completion script for a shell: plant-sim completions bash > /etc/bash_completion.d/plant-sim.
    Completions(Late<pages::CompletionsArgs>),
    /// Write the manual page: plant-sim man | man -l -.
    Man(Late<pages::ManArgs>),
}

/// Executes the command line. An error is one message for the user.
pub(crate) fn main() -> u8 {
    match Cli::try_parse().map(command) {
        Ok(Ok(())) => 0,
        Ok(Err(failure)) => failure.report(),
        Err(help) => only_shown(
            "plant-sim",
            help.exit_code(),
            help.print(),
            help.use_stderr(),
        ),
    }
}

fn command(cli: Cli) -> Result<(), Failure> {
    match cli.command {
        None => run::run(&cli.scenario, &cli.run),
        Some(Command::Run(args)) => run::run(args.scenario.name(), &args.run),
        Some(Command::Check(args)) => check::run(&args),
        Some(Command::Campaign(command)) => campaign::run(&command),
        Some(Command::Bench(command)) => bench::run(&command),
        Some(Command::Cost(args)) => cost::run(&args),
        Some(Command::Crash(args)) => crash::run(&args),
        Some(Command::Eval(args)) => eval::run(&args),
        Some(Command::Timing(args)) => timing::run(&args),
        Some(Command::Report(args)) => report::run(&args),
        Some(Command::View(args)) => view::run(&args),
        Some(Command::WhatIf(args)) => what_if::run(&args),
        Some(Command::Trace(command)) => trace::run(&command),
        Some(Command::Monitor(args)) => monitor::run(&args),
        Some(Command::Record(args)) => record::run(&args),
        Some(Command::Parameters(args)) => parameters::run(&args),
        Some(Command::Dbc(args)) => dbc::run(&args),
        Some(Command::Dissector(args)) => dissector::run(&args),
        Some(Command::Schema(args)) => schema::run(&args),
        Some(Command::Model(args)) => model::run(&args),
        Some(Command::Completions(args)) => pages::completions(&args, Cli::command()),
        Some(Command::Man(args)) => pages::man(&args, Cli::command()),
    }
}

/// Writes to standard output. A reader that has closed the pipe (`| head`) is not an error.
fn show(text: &str) -> Result<(), Failure> {
    let mut output = io::stdout().lock();
    match output
        .write_all(text.as_bytes())
        .and_then(|()| output.flush())
    {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(format!("cannot write to standard output: {error}").into())
        }
        _ => Ok(()),
    }
}
