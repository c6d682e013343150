//! Parameters as text, JSON and Markdown.

use std::fmt::Write as _;

use protocol::messages::Server;
use protocol::parameters::{self, CORNER_PER_SAMPLE, Kind, Parameter};
use schemars::JsonSchema;
use serde::Serialize;

use super::Reading;

/// A line of text; writing to a string cannot fail.
macro_rules! line {
    ($text:ident, $($arg:tt)*) => {{
        let _ = writeln!($text, $($arg)*);
    }};
}

/// Unit, and the range as reported by the node.
pub(super) fn allowed(reading: &Reading) -> String {
    let kind = match reading.parameter {
        Some(parameter) if parameter.rule.kind == Kind::Whole => "whole numbers from ",
        _ => "",
    };
    let unit = reading.parameter.map_or("", |parameter| parameter.unit);
    let range = format!("{kind}{} to {}", reading.lower, reading.upper);
    format!("{range} {unit}").trim_end().to_owned()
}

fn name(reading: &Reading) -> String {
    match reading.parameter {
        Some(parameter) => parameter.name.to_owned(),
        None => format!("{:#06x}", reading.number),
    }
}

/// One line per parameter, under a heading; `period` is the sampling period, s.
#[must_use]
pub fn table(readings: &[Reading], period: f32) -> String {
    let mut text = String::new();
    line!(
        text,
        "{:<24} {:>10} {:<8} {:<18} {:>8}  settable",
        "parameter",
        "value",
        "unit",
        "allowed",
        "default"
    );
    for reading in readings {
        let (unit, default, settable) = match reading.parameter {
            Some(parameter) => (
                parameter.unit,
                parameter
                    .default
                    .map_or_else(String::new, |level| level.at(period).to_string()),
                parameter.rule.settable.name(),
            ),
            None => ("", String::new(), "not known to this program"),
        };
        line!(
            text,
            "{:<24} {:>10} {unit:<8} {:<18} {default:>8}  {settable}",
            name(reading),
            reading.value.to_string(),
            format!("{} to {}", reading.lower, reading.upper),
        );
    }
    text
}

/// A parameter as it is written in JSON.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Parameter")]
pub struct Row {
    /// Name; its number where this program does not know it.
    name: String,
    /// Number on the bus.
    number: u16,
    /// Node that has it.
    server: &'static str,
    /// Value in force.
    value: f32,
    /// Unit of value, bounds and default; empty where it has none.
    unit: &'static str,
    /// Least value allowed.
    lower: f32,
    /// Greatest value allowed.
    upper: f32,
    /// Value after a start of the node; `null` for readings.
    default: Option<f32>,
    /// When it can be set: `never`, `at rest` or `always`; `null` where this program does not know it.
    settable: Option<&'static str>,
    /// What it is.
    about: &'static str,
}

/// The same as a JSON array; `default` is null for readings, `settable` for parameters unknown to this program.
///
/// # Panics
/// Never: every number from the bus is finite.
#[must_use]
pub fn json(readings: &[Reading], period: f32) -> String {
    let rows: Vec<Row> = readings
        .iter()
        .map(|reading| Row {
            name: name(reading),
            number: reading.number,
            server: if reading.number < parameters::DRIVES {
                Server::Controller.node().name()
            } else {
                Server::Drives.node().name()
            },
            value: reading.value,
            unit: reading.parameter.map_or("", |row| row.unit),
            lower: reading.lower,
            upper: reading.upper,
            default: reading
                .parameter
                .and_then(|row| row.default)
                .map(|level| level.at(period)),
            settable: reading.parameter.map(|row| row.rule.settable.name()),
            about: reading.parameter.map_or("", |row| row.about),
        })
        .collect();
    let mut text = serde_json::to_string_pretty(&rows).expect("finite numbers and text");
    text.push('\n');
    text
}

/// `docs/parameters.md`.
#[must_use]
pub fn markdown() -> String {
    let mut text = String::from(
        "# Parameters

Parameters that can be read and set over the bus, generated from the table in
[protocol/src/parameters/list.rs](../protocol/src/parameters/list.rs) by `plant-sim parameters --markdown`.

    plant-sim parameters --bus socketcan:vcan0                                       # list
    plant-sim parameters --bus slcan:tcp:localhost:29536 --set bandwidth=120 --json  # set, and show the new value

- The operator asks the controller (identifiers 0x641 and 0x5C1). Numbers from 0x1000 on belong to the drives: the
  controller forwards requests (0x640) and returns the answers (0x5C0).
- A new value takes effect from the next sample until its node restarts; a restart restores the defaults. A run with an
  external controller restarts it.
- *Settable at rest*: for the controller ready, or enabled with no move planned or under way; for the drives, torque off.
  Otherwise the answer is `not-now`, as it is to a set in the first frame that a node receives, which may be a replay, and
  to requests for silent drives.
- Corner frequencies are bounded by the sampling rate: beyond a quarter of a radian per sample, no phase margin is left
  for the delays of sampling and bus.
- `plant-sim parameters` sends with the operator's identifier and finds a valid value of the operator's counter by
  itself; an operator that requests parameters at the same time may lose requests and has to repeat them.
",
    );
    for (server, title) in [
        (Server::Controller, "Controller"),
        (Server::Drives, "Drives"),
    ] {
        line!(text, "\n## {title}\n");
        line!(
            text,
            "| number | name | unit | allowed | default | settable | |\n|---|---|---|---|---|---|---|"
        );
        for parameter in parameters::all().filter(|parameter| parameter.server() == server) {
            row(&mut text, parameter);
        }
    }
    text
}

fn row(text: &mut String, parameter: &Parameter) {
    let rule = &parameter.rule;
    let per_sample = |angle: f32| format!(", at most {angle} rad per sample");
    let kind = match rule.kind {
        Kind::Real => String::new(),
        Kind::Whole => ", whole".to_owned(),
        Kind::Corner => per_sample(CORNER_PER_SAMPLE),
    };
    let default = match parameter.default {
        Some(default) if rule.kind == Kind::Corner => {
            format!("{}{}", default.most, per_sample(default.per_sample))
        }
        Some(default) if default.lasts > 0.0 => {
            format!("{}, and at least {} ms", default.most, 1e3 * default.lasts)
        }
        Some(default) => default.most.to_string(),
        None => String::new(),
    };
    line!(
        text,
        "| {:#06x} | `{}` | {} | {} to {}{kind} | {default} | {} | {} |",
        rule.number,
        parameter.name,
        parameter.unit,
        rule.lower,
        rule.upper,
        rule.settable.name(),
        parameter.about,
    );
}
