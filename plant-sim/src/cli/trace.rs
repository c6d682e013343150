//! `plant-sim trace`: looks into recorded traces.
//!
//! Every subcommand reads its trace once, from front to end, in bounded memory.

mod source;

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::{Args, Subcommand, ValueEnum};
use firmware::mechanics::arm::ArmModel;
use link::{Link, LinkAddress, SlcanPeer};
use plant_sim::check::Checker;
use plant_sim::output;
use plant_sim::play::{PlayError, Player};
use plant_sim::plot::Plot;
use plant_sim::replay::Replay;
use protocol::time::Period;
use protocol::wire::BitTiming;
use sim::model::RobotModel;
use sim::rig::RigConfig;
use sim::scenario;
use trace::Record;
use trace::convert::{Converter, Target};
use trace::decode::{Decoder, Format};
use trace::stats::Gatherer;

use super::run::load;
use super::show;
use source::Source;

/// Subcommands of `trace`.
#[derive(Subcommand)]
pub(super) enum TraceCommand {
    /// Name every field of every frame, with its unit.
    Decode(DecodeArgs),
    /// Rates, periods, jitter, losses and bus load, by identifier.
    Stats(StatsArgs),
    /// Draw positions, errors, torques, modes and faults over time (SVG).
    Plot(PlotArgs),
    /// Judge the trace by the rules of the protocol; name the first offence.
    Check(CheckArgs),
    /// Feed the trace into a fresh controller and compare its commands byte for byte; or, with --bus, play it onto a bus.
    Replay(ReplayArgs),
    /// Write the trace in the format of another tool.
    Convert(ConvertArgs),
}

/// Arguments of `decode`.
#[derive(Args)]
pub(super) struct DecodeArgs {
    /// candump log, or - for standard input.
    file: PathBuf,
    /// How it is written.
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    format: FormatChoice,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum FormatChoice {
    /// A line for each frame.
    Text,
    /// A row for each field.
    Csv,
    /// An object for each frame.
    Jsonl,
}

/// Arguments of `stats`.
#[derive(Args)]
pub(super) struct StatsArgs {
    /// candump log, or - for standard input.
    file: PathBuf,
    /// Print JSON instead of a table.
    #[arg(long)]
    json: bool,
}

/// Arguments of `plot`.
#[derive(Args)]
pub(super) struct PlotArgs {
    /// candump log, or - for standard input.
    file: PathBuf,
    /// The robot (a model file); turns encoder counts into joint positions.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Arguments of `check`.
#[derive(Args)]
pub(super) struct CheckArgs {
    /// candump log, or - for standard input.
    file: PathBuf,
    /// The robot (a model file); its motors limit the torque.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
}

/// Arguments of `replay`.
#[derive(Args)]
pub(super) struct ReplayArgs {
    /// candump log, or - for standard input. For the controller it must begin before its first sample.
    file: PathBuf,
    /// The robot that the recorded controller believed in (a model file).
    #[arg(long, value_name = "FILE", conflicts_with = "bus")]
    model: Option<PathBuf>,
    /// Control rate of the recorded controller.
    #[arg(
        long,
        value_name = "HZ",
        default_value_t = 1000.0,
        conflicts_with = "bus"
    )]
    rate: f64,
    /// Play every frame onto this bus instead: socketcan:INTERFACE, slcan:TERMINAL, slcan:tcp:HOST:PORT or
    /// slcan:listen:HOST:PORT.
    #[arg(long, value_name = "BUS")]
    bus: Option<LinkAddress>,
    /// How many times as fast as recorded; 0: as fast as the bus takes the frames.
    #[arg(long, value_name = "X", default_value_t = 1.0, requires = "bus", allow_negative_numbers = true, value_parser = speed)]
    speed: f64,
}

/// A speed at which every time of a trace stays a time.
fn speed(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(speed) if speed == 0.0 || (0.001..=1000.0).contains(&speed) => Ok(speed),
        _ => Err("allowed: 0, or 0.001 to 1000".into()),
    }
}

/// Arguments of `convert`.
#[derive(Args)]
pub(super) struct ConvertArgs {
    /// candump log, or - for standard input.
    file: PathBuf,
    /// What it becomes.
    #[arg(long, value_name = "FORMAT")]
    to: TargetChoice,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
enum TargetChoice {
    /// For Wireshark and tshark.
    Pcapng,
    /// For CANalyzer and CANoe.
    Asc,
    /// For can-utils and python-can.
    Candump,
}

/// Does what the subcommand says.
pub(super) fn run(command: &TraceCommand) -> Result<ExitCode, String> {
    match command {
        TraceCommand::Decode(args) => decode(args),
        TraceCommand::Stats(args) => stats(args),
        TraceCommand::Plot(args) => plot(args),
        TraceCommand::Check(args) => check(args),
        TraceCommand::Replay(args) => match &args.bus {
            None => replay(args),
            Some(bus) => play(&args.file, bus, args.speed),
        },
        TraceCommand::Convert(args) => convert(args),
    }
}

fn decode(args: &DecodeArgs) -> Result<ExitCode, String> {
    let format = match args.format {
        FormatChoice::Text => Format::Text,
        FormatChoice::Csv => Format::Csv,
        FormatChoice::Jsonl => Format::JsonLines,
    };
    let mut source = Source::open(&args.file)?;
    written(args.out.as_deref(), |sink| {
        let mut decoder = Decoder::new(sink, format)?;
        each(&mut source, |record| decoder.record(record))?;
        decoder.finish()?;
        Ok(())
    })?;
    source.verdict()
}

fn convert(args: &ConvertArgs) -> Result<ExitCode, String> {
    let target = match args.to {
        TargetChoice::Pcapng => Target::Pcapng,
        TargetChoice::Asc => Target::Asc,
        TargetChoice::Candump => Target::Candump,
    };
    let mut source = Source::open(&args.file)?;
    written(args.out.as_deref(), |sink| {
        let mut converter = Converter::new(sink, target)?;
        each(&mut source, |record| converter.record(record))?;
        converter.finish()?;
        Ok(())
    })?;
    source.verdict()
}

fn stats(args: &StatsArgs) -> Result<ExitCode, String> {
    let mut source = Source::open(&args.file)?;
    let mut gatherer = Gatherer::new(BitTiming::default());
    while let Some(record) = source.record()? {
        gatherer.record(&record);
    }
    let statistics = gatherer.statistics();
    if args.json {
        let json = serde_json::to_string_pretty(&statistics).map_err(|error| error.to_string())?;
        show(&(json + "\n"))?;
    } else {
        show(&statistics.to_string())?;
    }
    source.verdict()
}

fn plot(args: &PlotArgs) -> Result<ExitCode, String> {
    let arm = ArmModel::from(&load(args.model.as_ref())?);
    let mut source = Source::open(&args.file)?;
    let mut plot = Plot::new(&arm, &args.file.display().to_string());
    while let Some(record) = source.record()? {
        plot.record(&record);
    }
    written(args.out.as_deref(), |sink| {
        sink.write_all(plot.svg().as_bytes())?;
        sink.flush()?;
        Ok(())
    })?;
    source.verdict()
}

fn check(args: &CheckArgs) -> Result<ExitCode, String> {
    let arm = ArmModel::from(&load(args.model.as_ref())?);
    let mut source = Source::open(&args.file)?;
    let mut checker = Checker::new(&arm);
    while let Some(line) = source.line()? {
        let record = line.map_err(|problem| format!("{}: {problem}", source.place()))?;
        checker
            .record(&record)
            .map_err(|offence| format!("{}: {offence}", source.place()))?;
    }
    let counts = checker.counts();
    show(&format!(
        "{} frames keep every rule; {} foreign frames and {} error frames are not judged\n",
        counts.judged, counts.foreign, counts.error_frames
    ))?;
    Ok(ExitCode::SUCCESS)
}

fn replay(args: &ReplayArgs) -> Result<ExitCode, String> {
    scenario::check_rate(args.rate)
        .map_err(|allowed| format!("--rate is {}; allowed: {allowed}", args.rate))?;
    let model: RobotModel = load(args.model.as_ref())?;
    let config = RigConfig {
        nominal: ArmModel::from(&model),
        actual: model,
        period: Period::of_rate(args.rate),
        start: [0.0; 4],
        timing: BitTiming::default(),
    };
    let mut source = Source::open(&args.file)?;
    let mut replay = Replay::new(config.controller());
    while let Some(record) = source.record()? {
        replay
            .record(&record)
            .map_err(|difference| format!("{}: {difference}", source.place()))?;
    }
    show(&format!(
        "{} commands are the same, byte for byte\n",
        replay.compared()
    ))?;
    source.verdict()
}

fn play(file: &Path, bus: &LinkAddress, speed: f64) -> Result<ExitCode, String> {
    let mut source = Source::open(file)?;
    let link = Link::open(bus).map_err(|error| error.to_string())?;
    let mut player = Player::new(link, speed);
    let failed = |error: PlayError| format!("{bus}: {error}");
    if let LinkAddress::Slcan(SlcanPeer::Listen(_)) = bus {
        eprintln!("plant-sim: waiting for a client on {bus}");
        player.wait_for_client().map_err(failed)?;
    }
    let begun = Instant::now();
    while let Some(record) = source.record()? {
        player
            .record(&record)
            .map_err(|error| format!("{}: {}", source.place(), failed(error)))?;
    }
    let played = player.finish().map_err(failed)?;
    show(&format!(
        "{} frames played onto {bus} in {:.3} s; {} had to wait for a place in the queue, {} error frames left out\n",
        played.frames,
        begun.elapsed().as_secs_f64(),
        played.waited,
        played.left_out,
    ))?;
    if played.lost > 0 {
        return Err(format!(
            "{bus}: {} frames were refused or not read at the other end",
            played.lost
        ));
    }
    source.verdict()
}

/// Which end failed.
enum Failure {
    Input(String),
    Output(io::Error),
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Self::Output(error)
    }
}

/// Hands every record to `take`.
fn each(
    source: &mut Source,
    mut take: impl FnMut(&Record) -> io::Result<()>,
) -> Result<(), Failure> {
    while let Some(record) = source.record().map_err(Failure::Input)? {
        take(&record)?;
    }
    Ok(())
}

/// Does the writing, to the file or to standard output. A reader of standard output that has seen enough and gone
/// (`| head`) is no error.
fn written(
    out: Option<&Path>,
    write: impl FnOnce(&mut dyn Write) -> Result<(), Failure>,
) -> Result<(), String> {
    let Some(path) = out else {
        let mut sink = BufWriter::with_capacity(1 << 16, io::stdout().lock());
        return match write(&mut sink) {
            Ok(()) => Ok(()),
            Err(Failure::Input(message)) => Err(message),
            Err(Failure::Output(error)) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
            Err(Failure::Output(error)) => Err(format!("cannot write to standard output: {error}")),
        };
    };
    let mut file = output::File::create(path).map_err(|error| error.to_string())?;
    match write(&mut file) {
        Ok(()) => file.persist().map_err(|error| error.to_string()),
        Err(Failure::Input(message)) => Err(message),
        Err(Failure::Output(error)) => Err(format!("cannot write {}: {error}", path.display())),
    }
}
