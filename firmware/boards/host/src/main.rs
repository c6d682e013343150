//! `controller`: the controller of the cabinet as a Linux process, on SocketCAN or a serial-line adapter.
//!
//! The same node as on the boards, with a socket as its CAN controller.

// They panic where standard output or error is full or gone; `say!` does not.
#![deny(clippy::print_stderr, clippy::print_stdout)]

mod clock;
mod shell;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Parser;
use firmware::control::controller::Config;
use firmware::mechanics::arm::{ArmModel, IRB_930};
use link::{Link, LinkAddress, realtime};
use protocol::time::Period;
use terminal::{FAILED, USAGE, guard, only_shown, say};

use crate::clock::Clock;
use crate::shell::Shell;

/// Controller of a SCARA drive cabinet on a CAN bus. Waits for the drives, follows the operator, ends with Ctrl-C.
#[derive(Parser)]
#[command(name = "controller", version = env!("VERSION_AND_COMMIT"))]
struct Args {
    /// The bus: socketcan:INTERFACE, slcan:TERMINAL or slcan:tcp:HOST:PORT.
    #[arg(long, value_name = "BUS")]
    bus: LinkAddress,
    /// Sampling rate of the drives.
    #[arg(long, value_name = "HZ", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(100..=10_000))]
    rate: u32,
    /// Take the time from this machine and request real-time scheduling, for drives that sample in real time. Otherwise
    /// time is counted in samples, for a plant that waits for each command (lock-step).
    #[arg(long)]
    real_time: bool,
    /// The robot, as `plant-sim model` writes it; otherwise an IRB 930-22/1.05.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
}

/// Why the controller ends, as a person reads it, and the exit code (docs/exit-codes.md).
struct Failure {
    message: String,
    code: u8,
}

impl Failure {
    /// What was typed, or a file that it names, has to be changed.
    fn usage(message: String) -> Self {
        Self {
            message,
            code: USAGE,
        }
    }

    /// The bus or the machine did not allow it.
    fn failed(message: impl ToString) -> Self {
        Self {
            message: message.to_string(),
            code: FAILED,
        }
    }
}

fn main() -> ExitCode {
    let work = || match Args::try_parse().map(|args| run(&args)) {
        Ok(Ok(())) => 0,
        Ok(Err(Failure { message, code })) => {
            say!("controller: {message}");
            code
        }
        Err(help) => only_shown(
            "controller",
            help.exit_code(),
            help.print(),
            help.use_stderr(),
        ),
    };
    ExitCode::from(guard("controller", env!("VERSION_AND_COMMIT"), work))
}

fn run(args: &Args) -> Result<(), Failure> {
    let arm = args
        .model
        .as_deref()
        .map_or(Ok(IRB_930), load)
        .map_err(Failure::usage)?;
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed))
        .map_err(|error| Failure::failed(format!("cannot handle Ctrl-C: {error}")))?;
    let link = Link::open(&args.bus).map_err(Failure::failed)?;
    let period = Period::of_rate(args.rate.into());
    let clock = if args.real_time {
        for refused in realtime::claim() {
            say!("controller: {refused}");
        }
        Clock::real_time()
    } else {
        Clock::lock_step(period)
    };
    Shell::new(link, args.bus.clone(), Config::new(arm, period), clock)
        .run(&stop)
        .map_err(Failure::failed)
}

/// The robot of a file, if the controller can use it.
fn load(path: &Path) -> Result<ArmModel, String> {
    let name = path.display();
    let text = fs::read_to_string(path).map_err(|error| format!("cannot read {name}: {error}"))?;
    let arm: ArmModel = serde_json::from_str(&text).map_err(|error| {
        format!("{name} is not a robot file of the controller: {error}; write one with: plant-sim model FILE")
    })?;
    arm.validate().map_err(|error| format!("{name}: {error}"))?;
    Ok(arm)
}
