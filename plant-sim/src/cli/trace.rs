//! `plant-sim trace`: inspects recorded traces.
//!
//! Every subcommand reads its trace once, from front to end, in bounded memory.

mod args;
mod judge;
mod sink;
mod source;

use std::io::{self, Write};

use clap::Subcommand;
use firmware::mechanics::arm::ArmModel;
use plant_sim::interrupt;
use plant_sim::mcap::Recorder;
use plant_sim::plot::{Plot, page};
use trace::convert::Converter;
use trace::decode::{Decoder, Format};
use trace::stats::Gatherer;
use trace::{Interface, Record};

use super::run::load;
use super::{Failure, show};
use args::{
    CheckArgs, ConvertArgs, DecodeArgs, Form, FormatChoice, PlotArgs, ReplayArgs, StatsArgs,
};
use sink::{Records, each, refuse_same, written};
use source::Source;

/// Subcommands of `trace`.
#[derive(Subcommand)]
pub(super) enum TraceCommand {
    /// Name every field of every frame, with its unit.
    Decode(DecodeArgs),
    /// Rates, periods, jitter, losses, errors and bus load, by interface and identifier.
    Stats(StatsArgs),
    /// Draw positions, errors, torques, modes and faults over time (SVG).
    Plot(PlotArgs),
    /// Check the trace against the rules of the protocol; report the first violation.
    Check(CheckArgs),
    /// Feed the trace into a fresh controller and compare its commands byte for byte; or, with --bus, play it onto a bus.
    Replay(ReplayArgs),
    /// Write the trace in the format of another tool.
    Convert(ConvertArgs),
}

/// Executes the subcommand.
pub(super) fn run(command: &TraceCommand) -> Result<(), Failure> {
    match command {
        TraceCommand::Decode(args) => decode(args),
        TraceCommand::Stats(args) => stats(args),
        TraceCommand::Plot(args) => plot(args),
        TraceCommand::Check(args) => judge::check(args),
        TraceCommand::Replay(args) => judge::replay(args),
        TraceCommand::Convert(args) => convert(args),
    }
}

fn decode(args: &DecodeArgs) -> Result<(), Failure> {
    let format = match args.format {
        FormatChoice::Text => Format::Text,
        FormatChoice::Csv => Format::Csv,
        FormatChoice::Jsonl => Format::JsonLines,
    };
    refuse_same(&args.input.file, args.out.as_deref())?;
    interrupt::listen()?;
    let mut source = Source::open(&args.input.file, args.input.selection(args.end.to))?;
    written(args.out.as_deref(), |sink| {
        let mut decoder = Decoder::new(sink, format)?;
        each(&mut source, &mut decoder)?;
        decoder.finish().map(|_| ())
    })?;
    source.verdict()
}

fn convert(args: &ConvertArgs) -> Result<(), Failure> {
    let (form, end) = args.goals().map_err(Failure::usage)?;
    let model = load(args.model.as_deref())?;
    refuse_same(&args.input.file, args.out.as_deref())?;
    interrupt::listen()?;
    let mut source = Source::open(&args.input.file, args.input.selection(end))?;
    written(args.out.as_deref(), |sink| match form {
        Form::Frames(target) => {
            let mut converter = Converter::new(sink, target)?;
            each(&mut source, &mut converter)?;
            converter.finish().map(|_| ())
        }
        Form::Mcap => {
            let mut recorder = Recorder::new(sink, &model)?;
            each(&mut source, &mut recorder)?;
            recorder.finish().map(|_| ())
        }
    })?;
    source.verdict()
}

impl<W: Write> Records for Decoder<W> {
    fn record(&mut self, record: &Record) -> io::Result<()> {
        Decoder::record(self, record)
    }

    fn flush(&mut self) -> io::Result<()> {
        Decoder::flush(self)
    }
}

impl<W: Write> Records for Converter<W> {
    fn record(&mut self, record: &Record) -> io::Result<()> {
        Converter::record(self, record)
    }

    fn flush(&mut self) -> io::Result<()> {
        Converter::flush(self)
    }
}

impl<W: Write> Records for Recorder<W> {
    fn record(&mut self, record: &Record) -> io::Result<()> {
        Recorder::record(self, record)
    }

    /// Nobody reads this format before its end, and where its parts end must not depend on when the input came.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn stats(args: &StatsArgs) -> Result<(), Failure> {
    interrupt::listen()?;
    let mut source = Source::open(&args.input.file, args.input.selection(args.end.to))?;
    let mut gatherer = Gatherer::new(args.bitrate);
    if let Some(longest) = args.skip_gaps {
        gatherer = gatherer.skipping(u64::try_from(longest.as_micros()).unwrap_or(u64::MAX));
    }
    while let Some(record) = source.record() {
        gatherer.record(&record);
    }
    let statistics = gatherer.statistics();
    if let Some((id, period_s)) = statistics.left_out() {
        return Err(Failure::usage(format!(
            "--skip-gaps leaves out most of the time between frames of {}, so that loads and rates would mean nothing; \
             allowed: more than the {period_s:.6} s from one to the next on average",
            id.id
        )));
    }
    if args.json {
        let json = serde_json::to_string_pretty(&statistics).map_err(|error| error.to_string())?;
        show(&(json + "\n"))?;
    } else {
        show(&statistics.to_string())?;
        if args.histogram {
            show(&statistics.histograms())?;
        }
    }
    source.verdict()
}

fn plot(args: &PlotArgs) -> Result<(), Failure> {
    refuse_same(&args.input.file, args.out.as_deref())?;
    interrupt::listen()?;
    let arm = ArmModel::from(&load(args.model.as_deref())?);
    let mut source = Source::open(&args.input.file, args.input.selection(args.end.to))?;
    let title = args.input.file.display().to_string();
    let mut plots: Vec<(Interface, Plot)> = Vec::new();
    while let Some(record) = source.record() {
        let interface = record.interface;
        let place = plots.iter().position(|(name, _)| *name == interface);
        let place = place.unwrap_or_else(|| {
            plots.push((interface, Plot::new(&arm, &format!("{title}: {interface}"))));
            plots.len() - 1
        });
        plots[place].1.record(&record);
    }
    plots.retain(|(_, plot)| !plot.is_empty());
    if plots.is_empty() {
        source.verdict()?;
        return Err(source.nothing("the log has no frame of this protocol that can be drawn"));
    }
    let plots: Vec<Plot> = plots.into_iter().map(|(_, plot)| plot).collect();
    written(args.out.as_deref(), |sink| {
        sink.write_all(page(&plots).as_bytes())
    })?;
    source.verdict()
}
