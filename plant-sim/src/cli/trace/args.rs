//! Arguments of the subcommands of `trace`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};
use link::LinkAddress;
use protocol::table::TABLE;
use protocol::wire::BitTiming;
use sim::text::nearest;
use trace::Interface;
use trace::convert::Target;
use trace::select::{Ids, Moment, Selection};

use crate::cli::bitrate::bit_timing;
use crate::cli::values::{number, svg};

/// A trace, and a selection of its records.
#[derive(Args)]
pub(crate) struct InputArgs {
    /// candump log, candump's screen output, Vector ASC or pcapng, optionally gzipped; - for standard input.
    pub file: PathBuf,
    /// Only these identifiers: hexadecimal, 3 digits (11 bits) or 8 (29 bits), a range (300-3FF) or a message's name.
    #[arg(long, value_name = "ID", value_delimiter = ',', value_parser = ids)]
    id: Vec<Ids>,
    /// Only these interfaces.
    #[arg(long, value_name = "NAME", value_delimiter = ',', value_parser = interface)]
    interface: Vec<Interface>,
    /// Only from this time on: seconds as in the trace, or after its first record (+12.5).
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    from: Option<Moment>,
}

impl InputArgs {
    pub(crate) fn selection(&self, to: Option<Moment>) -> Selection {
        Selection {
            ids: self.id.clone(),
            interfaces: self.interface.clone(),
            from: self.from,
            to,
        }
    }
}

/// End of the selection; separate from [`InputArgs`], since `convert` uses the same option for its format.
#[derive(Args)]
pub(crate) struct EndArgs {
    /// Only up to this time: seconds as in the trace, or after its first record (+12.5).
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub to: Option<Moment>,
}

/// Identifiers; for a name that is nearly that of a message, that one.
fn ids(text: &str) -> Result<Ids, String> {
    text.parse().map_err(|allowed| {
        let text = text.to_ascii_lowercase();
        let names = TABLE.iter().map(|info| info.name);
        let lower: Vec<_> = names.clone().map(str::to_ascii_lowercase).collect();
        let near = nearest(&text, lower.iter().map(String::as_str));
        match names
            .into_iter()
            .find(|name| near.is_some_and(|near| name.eq_ignore_ascii_case(near)))
        {
            Some(name) => format!("{allowed}; did you mean {name}?"),
            None => allowed,
        }
    })
}

fn interface(text: &str) -> Result<Interface, String> {
    Interface::new(text).ok_or_else(|| {
        format!(
            "allowed: 1 to {} printable characters without blanks",
            Interface::MAX
        )
    })
}

/// Seconds to skip or to wait.
fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: Option<f64> = text.parse().ok();
    seconds
        .filter(|seconds| *seconds >= 0.0)
        .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())
        .ok_or_else(|| "allowed: seconds, 0 or more".into())
}

/// Arguments of `decode`.
#[derive(Args)]
pub(crate) struct DecodeArgs {
    #[command(flatten)]
    pub input: InputArgs,
    #[command(flatten)]
    pub end: EndArgs,
    /// Output format.
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    pub format: FormatChoice,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum FormatChoice {
    /// A line per frame.
    Text,
    /// A row per field.
    Csv,
    /// An object per frame.
    Jsonl,
}

/// Arguments of `stats`.
#[derive(Args)]
pub(crate) struct StatsArgs {
    #[command(flatten)]
    pub input: InputArgs,
    #[command(flatten)]
    pub end: EndArgs,
    /// Bit rates of the bus, bit/s, for its load: nominal, and after a comma the data bit rate (500k,2M).
    #[arg(long, value_name = "N[,D]", default_value = "1M,5M", value_parser = bit_timing)]
    pub bitrate: BitTiming,
    /// Leave out gaps without records longer than this, as when a clock was set.
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = seconds)]
    pub skip_gaps: Option<Duration>,
    /// Draw the distribution of the periods of each identifier.
    #[arg(long, conflicts_with = "json")]
    pub histogram: bool,
    /// Print JSON instead of a table.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `plot`.
#[derive(Args)]
pub(crate) struct PlotArgs {
    #[command(flatten)]
    pub input: InputArgs,
    #[command(flatten)]
    pub end: EndArgs,
    /// The robot (a name or a model file, as for run); turns encoder counts into joint positions.
    #[arg(long, value_name = "NAME|FILE")]
    pub model: Option<String>,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE", value_parser = svg)]
    pub out: Option<PathBuf>,
}

/// Arguments of `check`.
#[derive(Args)]
pub(crate) struct CheckArgs {
    /// The whole trace is followed; violations outside the selection are ignored.
    #[command(flatten)]
    pub input: InputArgs,
    #[command(flatten)]
    pub end: EndArgs,
    /// The robot (a name or a model file, as for run); its motors limit the torque.
    #[arg(long, value_name = "NAME|FILE")]
    pub model: Option<String>,
}

/// Arguments of `replay`.
#[derive(Args)]
pub(crate) struct ReplayArgs {
    /// For the controller the trace must begin before its first sample; it receives all of it, and the selection is
    /// compared.
    #[command(flatten)]
    pub input: InputArgs,
    #[command(flatten)]
    pub end: EndArgs,
    /// The robot as the recorded controller knew it (a name or a model file, as for run).
    #[arg(long, value_name = "NAME|FILE", conflicts_with = "bus")]
    pub model: Option<String>,
    /// Control rate of the recorded controller.
    #[arg(
        long,
        value_name = "HZ",
        default_value_t = 1000.0,
        allow_negative_numbers = true,
        value_parser = number,
        conflicts_with = "bus"
    )]
    pub rate: f64,
    /// Bit rates of the recorded bus, bit/s, which determine when the controller's commands act (1M,5M).
    #[arg(long, value_name = "N[,D]", default_value = "1M,5M", value_parser = bit_timing, conflicts_with = "bus")]
    pub bitrate: BitTiming,
    /// Play every frame onto this bus instead: socketcan:INTERFACE, slcan:TERMINAL, slcan:tcp:HOST:PORT or
    /// slcan:listen:HOST:PORT.
    #[arg(long, value_name = "BUS")]
    pub bus: Option<LinkAddress>,
    /// Speed relative to the recording; 0: as fast as the bus takes the frames.
    #[arg(long, value_name = "X", default_value_t = 1.0, requires = "bus", allow_negative_numbers = true, value_parser = speed)]
    pub speed: f64,
    /// Skip recorded gaps without records longer than this.
    #[arg(long, value_name = "S", requires = "bus", allow_negative_numbers = true, value_parser = seconds)]
    pub skip_gaps: Option<Duration>,
}

/// A speed at which every time of a trace stays representable.
fn speed(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(speed) if speed == 0.0 || (0.001..=1000.0).contains(&speed) => Ok(speed),
        _ => Err("allowed: 0, or 0.001 to 1000".into()),
    }
}

/// Arguments of `convert`.
#[derive(Args)]
pub(crate) struct ConvertArgs {
    #[command(flatten)]
    pub input: InputArgs,
    /// Target format: pcapng (Wireshark, tshark), asc (CANalyzer, CANoe), candump (can-utils, python-can) or mcap
    /// (Foxglove, Lichtblick); and, as a number, only up to this time.
    #[arg(long, value_name = "FORMAT|S", required = true, value_parser = goal)]
    to: Vec<Goal>,
    /// The robot (a name or a model file, as for run); for mcap, which has joint positions beside the frames.
    #[arg(long, value_name = "NAME|FILE")]
    pub model: Option<String>,
    /// Write to this file instead of standard output.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// A format to convert to.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Form {
    /// Of frames alone.
    Frames(Target),
    /// Frames, and what they say of the arm.
    Mcap,
}

/// A value of `convert --to`.
#[derive(Clone, Copy)]
enum Goal {
    Format(Form),
    End(Moment),
}

fn goal(text: &str) -> Result<Goal, String> {
    match text {
        "pcapng" => Ok(Goal::Format(Form::Frames(Target::Pcapng))),
        "asc" => Ok(Goal::Format(Form::Frames(Target::Asc))),
        "candump" => Ok(Goal::Format(Form::Frames(Target::Candump))),
        "mcap" => Ok(Goal::Format(Form::Mcap)),
        _ => text.parse().map(Goal::End).map_err(|error| {
            format!("allowed: a format (pcapng, asc, candump, mcap) or a time; for a time: {error}")
        }),
    }
}

impl ConvertArgs {
    /// The one format, and the end if there is one.
    pub(crate) fn goals(&self) -> Result<(Form, Option<Moment>), String> {
        let (mut formats, mut ends) = (Vec::new(), Vec::new());
        for goal in &self.to {
            match goal {
                Goal::Format(form) => formats.push(*form),
                Goal::End(moment) => ends.push(*moment),
            }
        }
        match (formats.as_slice(), ends.as_slice()) {
            ([Form::Frames(_)], _) if self.model.is_some() => {
                Err("--model is for --to mcap; the other formats have no joint positions".into())
            }
            ([form], []) => Ok((*form, None)),
            ([form], [end]) => Ok((*form, Some(*end))),
            ([], _) => Err("--to has no format; allowed: pcapng, asc, candump, mcap".into()),
            _ => Err("--to has more than one format or more than one time".into()),
        }
    }
}
