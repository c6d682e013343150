//! `plant-sim crash`: faults of the controller on the emulated Cortex-M4F, and how they end.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use plant_sim::crash::{self, Planted, Seen};
use plant_sim::input;
use plant_sim::qemu;
use sim::setup::RunConfig;

use super::values::image;
use super::{Failure, show};

/// Arguments of `crash`.
#[derive(Args)]
pub(super) struct CrashArgs {
    /// The image, instead of the one built from the sources; it must be one that plants faults.
    #[arg(long, value_name = "FILE", value_parser = image)]
    image: Option<PathBuf>,
}

/// Plants one fault after another while the arm moves. Fails if one of them does not end in the
/// safe state.
pub(super) fn run(args: &CrashArgs) -> Result<(), Failure> {
    let image = qemu::image(args.image.as_deref(), qemu::FAULTS_IMAGE)
        .map_err(|error| error.to_string())?;
    let config = RunConfig::new(input::scenario("gate", &[])?);
    show(
        "planted                pins          reason      fault at    status      mode             torque off\n",
    )?;
    let mut bad = false;
    for planted in Planted::all() {
        let name = planted.name();
        match crash::plant(&config, &image, planted) {
            Ok(seen) => {
                let wrong = seen.wrong(planted);
                bad |= !wrong.is_empty();
                show(&row(name, &seen, &wrong))?;
            }
            Err(error) => {
                bad = true;
                show(&format!("{name:<22} FAILED: {error}\n"))?;
            }
        }
    }
    if bad {
        return Err("a fault did not end in the safe state".into());
    }
    Ok(())
}

/// One line per fault, and one more per deviation.
fn row(name: &str, seen: &Seen, wrong: &[String]) -> String {
    let mut text = format!("{name:<22} ");
    if let Some(stop) = &seen.stop {
        let _ = write!(
            text,
            "{:04b} > {:04b}   {:<10}  {:#010x}  {:#010x}  ",
            stop.pins[0],
            stop.pins[1],
            stop.reason.name(),
            stop.at,
            stop.status
        );
    }
    let mode = seen.mode.map_or("none", |mode| mode.name());
    let _ = match seen.let_go {
        Some(samples) => writeln!(text, "{mode:<16} {samples} samples"),
        None => writeln!(text, "{mode:<16} never"),
    };
    for what in wrong {
        let _ = writeln!(text, "    FAILED: {what}");
    }
    text
}
