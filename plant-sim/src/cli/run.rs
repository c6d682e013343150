//! `plant-sim run`: a scenario from start to summary.

mod text;

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;

use clap::{Args, ValueEnum};
use link::{AddressError, LinkAddress, SlcanPeer};
use plant_sim::external::{LockStep, RealTime, WallClock};
use plant_sim::input;
use plant_sim::output;
use plant_sim::qemu::{self, Channel, Qemu};
use plant_sim::report;
use plant_sim::run::{self, Results};
use plant_sim::viewers::Viewers;
use protocol::time::Period;
use sim::controller::InProcess;
use sim::curves::Curves;
use sim::model::RobotModel;
use sim::scenario;
use sim::selection::LawChoice;
use sim::setup::RunConfig;

use super::show;

/// Arguments of `run`.
#[derive(Args, Clone)]
pub(super) struct RunArgs {
    /// What to run: gate, gate-mismatch, square, pick-place, or a scenario file.
    #[arg(long, value_name = "NAME|FILE", default_value = "gate")]
    scenario: String,
    /// Control law: kinematic-joint, kinematic-task, pid, pd-gravity, computed-torque or
    /// computed-torque-task; the last two with :none, :integral or :observer (default).
    #[arg(long, value_name = "NAME")]
    law: Option<LawChoice>,
    /// Payload, announced and carried from the start.
    #[arg(long, value_name = "KG")]
    payload: Option<f64>,
    /// Number of cycles.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(scenario::MAX_CYCLES)))]
    cycles: Option<u32>,
    /// Control rate.
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// The bus: builtin is the bit-timed simulated one; socketcan:INTERFACE, slcan:TERMINAL or
    /// slcan:tcp:HOST:PORT lead to an external controller.
    #[arg(long, value_name = "BUS", default_value = "builtin")]
    bus: BusChoice,
    /// Take samples at deadlines of the clock instead of waiting for each command (needs an
    /// external controller that was started with --real-time).
    #[arg(long)]
    real_time: bool,
    /// Where the controller runs: in this process, as an image on an emulated Cortex-M4F, or
    /// external, on the other end of --bus. The last two are compared with the one in this process
    /// byte for byte.
    #[arg(long, value_name = "WHERE", default_value = "in-process")]
    controller: ControllerChoice,
    /// The image for --controller qemu, instead of the one built from the sources.
    #[arg(long, value_name = "FILE")]
    image: Option<PathBuf>,
    /// How frames reach the controller in QEMU: as records (fast), or as slcan over its UART.
    #[arg(long, value_name = "CHANNEL", default_value = "fifo")]
    channel: ChannelChoice,
    /// Show the built-in bus to CAN tools, which connect to slcan:tcp:HOST:PORT as to an adapter. The
    /// run waits for the first one and then runs in real time.
    #[arg(long, value_name = "slcan:tcp:HOST:PORT")]
    listen: Option<LinkAddress>,
    /// The robot as the controller knows it (a model file); also the actual one, unless --plant-model
    /// is given. Configure an external controller the same way: plant-sim model FILE.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// The actual robot (a model file).
    #[arg(long, value_name = "FILE")]
    plant_model: Option<PathBuf>,
    /// Where trace.log, truth.csv, summary.json and report.html go; with --controller qemu controller.log, too.
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Leave report.html out: the page to look at the run in a browser.
    #[arg(long)]
    no_report: bool,
    /// Print summary.json instead of the text.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum ControllerChoice {
    InProcess,
    Qemu,
    External,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum ChannelChoice {
    Fifo,
    Uart,
}

#[derive(Clone)]
enum BusChoice {
    Builtin,
    Link(LinkAddress),
}

impl FromStr for BusChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "builtin" {
            return Ok(Self::Builtin);
        }
        text.parse()
            .map(Self::Link)
            .map_err(|error: AddressError| format!("{error}, or builtin"))
    }
}

/// Runs the scenario, writes the results and shows the summary.
pub(super) fn run(args: &RunArgs) -> Result<ExitCode, String> {
    let place = place(args)?;
    let mut scenario = input::scenario(&args.scenario).map_err(|error| error.to_string())?;
    if let Some(law) = args.law {
        scenario.law = law;
    }
    if let Some(cycles) = args.cycles {
        scenario.cycles = cycles;
    }
    if let Some(rate) = args.rate {
        scenario::check_rate(rate)
            .map_err(|allowed| format!("--rate is {rate}; allowed: {allowed}"))?;
        scenario.rate_hz = rate;
    }
    let model = load(args.model.as_ref())?;
    if let Some(kg) = args.payload {
        if !(0.0..=model.payload_max).contains(&kg) {
            return Err(format!(
                "--payload is {kg} kg; allowed: 0 to {} kg for {}",
                model.payload_max, model.name
            ));
        }
        scenario.payload = scenario.payload_of(kg);
    }
    let plant_model = match &args.plant_model {
        Some(_) => load(args.plant_model.as_ref())?,
        None => model.clone(),
    };
    let config = RunConfig {
        scenario,
        nominal: model,
        actual: plant_model,
    };
    let mut curves = (!args.no_report).then(|| Curves::new(&config));
    let seen = &mut curves;
    let results = match place {
        Place::InProcess => {
            let connect = |config| Ok(InProcess::new(config));
            run::execute_with(&config, &args.out, connect, &mut (), seen)
        }
        Place::Watched(server) => {
            let viewers = Viewers::bind(server)
                .map_err(|error| format!("the bus cannot be watched: {error}"))?;
            let connect = |config| Ok(InProcess::new(config));
            run::execute_with(
                &config,
                &args.out,
                connect,
                &mut viewers.clone(),
                (viewers, seen),
            )
        }
        Place::Qemu => {
            let options = qemu::Options {
                image: args.image.clone(),
                channel: match args.channel {
                    ChannelChoice::Fifo => Channel::Fifo,
                    ChannelChoice::Uart => Channel::Uart,
                },
                count: None,
            };
            let mut controller = None;
            let results = run::execute_with(
                &config,
                &args.out,
                |config| Ok(controller.insert(Qemu::start(config, &options)?)),
                &mut (),
                seen,
            );
            if let Some(controller) = &mut controller {
                keep_log(controller, &args.out.join("controller.log"));
            }
            results
        }
        Place::LockStep(bus) => {
            let connect = |config| LockStep::connect(bus, config);
            run::execute_with(&config, &args.out, connect, &mut (), seen)
        }
        Place::RealTime(bus) => {
            let mut controller = None;
            let mut clock = WallClock::new(Period::of_rate(config.scenario.rate_hz));
            let ends = clock.clone();
            let results = run::execute_with(
                &config,
                &args.out,
                |config| Ok(controller.insert(RealTime::connect(bus, config, &ends)?)),
                &mut clock,
                seen,
            );
            if let Some(controller) = &controller {
                eprint!("{}", clock.timing().report());
                eprintln!(
                    "  commands different from the twin's {}",
                    controller.different()
                );
            }
            results
        }
    }
    .map_err(|error| error.to_string())?;
    keep_report(&config, &results, curves, &args.out)?;
    if args.json {
        show(&results.to_json())?;
    } else {
        show(&text::report(&results, &config, &args.out))?;
    }
    match &results.summary.error {
        None => Ok(ExitCode::SUCCESS),
        Some(error) => Err(format!("the run was not completed: {error}")),
    }
}

/// Writes the page about the run. Where none is wanted, that of a run before goes.
fn keep_report(
    config: &RunConfig,
    results: &Results,
    curves: Option<Curves>,
    out: &Path,
) -> Result<(), String> {
    let path = out.join(report::FILE);
    let Some(curves) = curves else {
        return match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                Err(format!("{}: cannot be removed: {error}", path.display()))
            }
            _ => Ok(()),
        };
    };
    let drawing = curves.finish(config);
    let page = report::page(results, &drawing);
    output::write(&path, &page).map_err(|error| error.to_string())
}

/// Writes the controller's log. A lost log does not invalidate the run.
fn keep_log(controller: &mut Qemu, path: &Path) {
    let written = controller
        .take_log()
        .and_then(|log| fs::write(path, log).map_err(|error| error.to_string()));
    if let Err(error) = written {
        eprintln!(
            "plant-sim: cannot write the controller's log to {}: {error}",
            path.display()
        );
    }
}

/// Where the controller runs, with its options.
enum Place<'a> {
    InProcess,
    Watched(&'a str),
    Qemu,
    LockStep(&'a LinkAddress),
    RealTime(&'a LinkAddress),
}

/// Checks that options belong together: a link and an external controller need each other.
fn place(args: &RunArgs) -> Result<Place<'_>, String> {
    if args.listen.is_some() && !matches!(args.controller, ControllerChoice::InProcess) {
        return Err("--listen shows the built-in bus of a controller in this process; the bus of an external one can be watched itself".into());
    }
    if args.channel != ChannelChoice::Fifo && !matches!(args.controller, ControllerChoice::Qemu) {
        return Err("--channel needs --controller qemu".into());
    }
    match (args.controller, &args.bus) {
        (ControllerChoice::External, BusChoice::Link(bus)) if args.real_time => {
            Ok(Place::RealTime(bus))
        }
        (ControllerChoice::External, BusChoice::Link(bus)) => Ok(Place::LockStep(bus)),
        (ControllerChoice::External, BusChoice::Builtin) => Err(
            "--controller external needs a bus that leads to it, such as --bus socketcan:vcan0"
                .into(),
        ),
        (_, BusChoice::Link(bus)) => Err(format!(
            "--bus {bus} leads to an external controller: add --controller external, and start it with: controller --bus {bus}"
        )),
        _ if args.real_time => Err("--real-time needs --controller external".into()),
        (ControllerChoice::InProcess, BusChoice::Builtin) if args.listen.is_some() => {
            match &args.listen {
                Some(LinkAddress::Slcan(SlcanPeer::Tcp(server))) => Ok(Place::Watched(server)),
                _ => Err("--listen allows slcan:tcp:HOST:PORT only".into()),
            }
        }
        (ControllerChoice::InProcess, BusChoice::Builtin) => Ok(Place::InProcess),
        (ControllerChoice::Qemu, BusChoice::Builtin) => Ok(Place::Qemu),
    }
}

/// The robot of a model file, or the built-in one; warnings go to standard error.
pub(super) fn load(path: Option<&PathBuf>) -> Result<RobotModel, String> {
    let Some(path) = path else {
        return Ok(RobotModel::irb_930_22_105());
    };
    let (model, warnings) = input::robot(path).map_err(|error| error.to_string())?;
    for warning in warnings {
        eprintln!("plant-sim: warning: {}: {warning}", path.display());
    }
    Ok(model)
}
