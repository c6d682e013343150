//! `plant-sim run`: a scenario from start to summary.

mod config;
mod mcap;
mod place;
mod text;
mod verdicts;

use std::path::PathBuf;

use clap::Args;
use plant_sim::external::{LockStep, RealTime, WallClock};
use plant_sim::interrupt;
use plant_sim::output::{self, Folder};
use plant_sim::qemu::{self, Qemu};
use plant_sim::report;
use plant_sim::run::{self, Recording, Results};
use plant_sim::say;
use plant_sim::verdicts::failure;
use plant_sim::viewers::Viewers;
use protocol::time::{Instant, Period};
use sim::controller::InProcess;
use sim::curves::Curves;
use sim::faults::Fault;
use sim::observer::Observer;
use sim::setup::RunConfig;

use super::{Failure, show};
pub(super) use config::{ConfigArgs, ScenarioArgs, USUAL, load, what};
use mcap::McapFile;
use place::{Place, PlaceArgs};
use verdicts::VerdictArgs;

/// What to run, and where the results go.
#[derive(Args)]
pub(super) struct RunArgs {
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    place: PlaceArgs,
    /// Where trace.log, truth.csv, summary.json and report.html go; with --controller qemu controller.log, too. Results of
    /// an older run are removed from there when this one begins.
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Write neither trace.log nor truth.csv: for runs that are long, or many.
    #[arg(long)]
    no_trace: bool,
    /// Leave report.html out: the page to look at the run in a browser.
    #[arg(long)]
    no_report: bool,
    /// Show neither progress nor the summary; what goes wrong is still said.
    #[arg(long, short)]
    quiet: bool,
    /// Print summary.json instead of the text.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    verdicts: VerdictArgs,
    /// Write the run to this file as MCAP, for Foxglove and Lichtblick: every frame, joint states (measured, actual, reference)
    /// and the arm in motion.
    #[arg(long, value_name = "FILE")]
    mcap: Option<PathBuf>,
}

/// Arguments of `run`; without the command a scenario that stands alone could not be told from one.
#[derive(Args)]
pub(super) struct NamedRunArgs {
    #[command(flatten)]
    pub scenario: ScenarioArgs,
    #[command(flatten)]
    pub run: RunArgs,
}

/// Runs the scenario, writes the results and shows the summary.
pub(super) fn run(scenario: &str, args: &RunArgs) -> Result<(), Failure> {
    let place = args.place.place()?;
    let config = args.config.config(scenario)?;
    // Everything that can be refused is, before the folder is touched.
    place.admit(&config.scenario.faults)?;
    config.rig().map_err(Failure::usage)?;
    let results = run::results(&args.out);
    let outputs = results.iter().chain(&args.mcap).map(PathBuf::as_path);
    output::distinct(
        args.config.inputs(scenario),
        outputs.chain(args.verdicts.paths()),
    )?;
    let verdicts = args.verdicts.create()?;
    let mcap = args.mcap.as_deref();
    let mut mcap = mcap
        .map(|path| McapFile::create(path, &config))
        .transpose()?;
    let folder = run::folder(&args.out)?;
    let recording = Recording {
        folder: &folder,
        traces: !args.no_trace,
        progress: !args.quiet,
    };
    let mut curves = (!args.no_report).then(|| Curves::new(&config));
    let mut came = Came::new(&config);
    let seen = (&mut came, (&mut curves, &mut mcap));
    interrupt::listen()?;
    let results = match place {
        Place::InProcess => {
            let connect = |config| Ok(InProcess::new(config));
            run::execute_with(&config, &recording, connect, &mut (), seen)
        }
        Place::Watched(server) => {
            let viewers = Viewers::bind(server)
                .map_err(|error| format!("the bus cannot be watched: {error}"))?;
            let connect = |config| Ok(InProcess::new(config));
            run::execute_with(
                &config,
                &recording,
                connect,
                &mut viewers.clone(),
                (viewers, seen),
            )
        }
        Place::Qemu(mut options) => {
            options.image = Some(
                qemu::image(options.image.as_deref(), qemu::IMAGE)
                    .map_err(|error| error.to_string())?,
            );
            let mut controller = None;
            let results = run::execute_with(
                &config,
                &recording,
                |config| Ok(controller.insert(Qemu::start(config, &options)?)),
                &mut (),
                seen,
            );
            if let Some(controller) = &mut controller {
                keep_log(controller, &folder);
            }
            results
        }
        Place::LockStep(bus) => {
            let connect = |config| LockStep::connect(bus, config);
            run::execute_with(&config, &recording, connect, &mut (), seen)
        }
        Place::RealTime(bus) => {
            let mut controller = None;
            let mut clock = WallClock::new(Period::of_rate(config.scenario.rate_hz));
            let ends = clock.clone();
            let results = run::execute_with(
                &config,
                &recording,
                |config| Ok(controller.insert(RealTime::connect(bus, config, &ends)?)),
                &mut clock,
                seen,
            );
            if let Some(controller) = &controller {
                say!(
                    "{}  commands different from the twin's {}",
                    clock.timing().report(),
                    controller.different()
                );
            }
            results
        }
    }?;
    let end = results.summary.sim_time_s;
    for (fault, from) in config.scenario.faults.iter().zip(&came.0) {
        if from.seconds() >= end {
            say!(
                "plant-sim: warning: the fault {} never came: the run ended at {end:.3} s",
                fault.text
            );
        }
    }
    if let Some(curves) = curves {
        keep_report(&config, &results, curves, &folder)?;
    }
    if args.json {
        show(&results.to_json())?;
    } else if !args.quiet {
        show(&text::report(&results, &config, &args.out))?;
    }
    if let Some(mcap) = mcap {
        mcap.finish()?;
    }
    verdicts.write(&results)?;
    failure(&results.summary).map_or(Ok(()), |why| Err(Failure::failed(why)))
}

/// When each fault has begun, or would.
struct Came(Vec<Instant>);

impl Came {
    fn new(config: &RunConfig) -> Self {
        let period = Period::of_rate(config.scenario.rate_hz);
        let from = |fault: &Fault| fault.window.fixed(period).map(|(from, _)| from);
        let faults = config.scenario.faults.iter();
        Self(
            faults
                .map(|fault| from(fault).unwrap_or(Instant::MAX))
                .collect(),
        )
    }
}

impl Observer for Came {
    fn fault(&mut self, number: usize, from: Instant, _: Instant) {
        if let Some(begun) = self.0.get_mut(number) {
            *begun = from.min(*begun);
        }
    }
}

/// Writes the page about the run.
fn keep_report(
    config: &RunConfig,
    results: &Results,
    curves: Curves,
    folder: &Folder,
) -> Result<(), Failure> {
    let page = report::page(results, &curves.finish(config));
    Ok(folder.write(report::FILE, &page)?)
}

/// Writes the controller's log. A lost log does not invalidate the run.
fn keep_log(controller: &mut Qemu, folder: &Folder) {
    let written = controller.take_log().and_then(|log| {
        folder
            .write("controller.log", &log)
            .map_err(|error| error.to_string())
    });
    if let Err(error) = written {
        say!(
            "plant-sim: cannot write the controller's log to {}: {error}",
            folder.path().display()
        );
    }
}
