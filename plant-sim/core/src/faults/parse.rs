//! Faults from text.

use protocol::messages::Node;
use protocol::schema::MessageInfo;
use protocol::table::TABLE;

use super::kinds::{KINDS, Kind, Value};
use super::{Disguise, Fault, FrameFault, What, Window};
use crate::bus::{ErrorKind, Level};
use crate::clock::ClockDefect;
use crate::model::AXES;
use crate::plant::defect::{BrakeDefect, EncoderDefect, LoadDefect, MotorDefect};
use crate::text::allowed;

/// Why a text does not describe a fault: what is wrong and what is allowed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct FaultError(String);

impl std::str::FromStr for Fault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, FaultError> {
        parse(text).map_err(|what| FaultError(format!("fault {text}: {what}")))
    }
}

impl TryFrom<String> for Fault {
    type Error = FaultError;

    fn try_from(text: String) -> Result<Self, FaultError> {
        text.parse()
    }
}

fn parse(text: &str) -> Result<Fault, String> {
    let (what, window) = text
        .split_once('@')
        .ok_or("there is no time; write it as ...@0.3s, ...@0.3s..0.5s, ...@jump2+200ms or ...@while=moving")?;
    Ok(Fault {
        text: text.into(),
        what: what_of(what)?,
        window: Window::parse(window)?,
    })
}

fn what_of(text: &str) -> Result<What, String> {
    let mut parts = text.split(':');
    let place = parts.next().unwrap_or_default();
    let message = TABLE
        .iter()
        .find(|info| info.name.eq_ignore_ascii_case(place));
    let node = Node::from_name(place);
    let group = match (message, node) {
        (Some(_), _) => "message",
        (_, Some(_)) => "node",
        _ => place,
    };
    let kinds: Vec<&Kind> = KINDS.iter().filter(|kind| kind.place == group).collect();
    let Some(first) = kinds.first() else {
        return Err(unknown("place", place, places()));
    };
    let axis = if first.has_axis {
        let name = parts.next().unwrap_or_default();
        AXES.iter()
            .position(|axis| *axis == name)
            .ok_or_else(|| unknown("axis", name, AXES.to_vec()))?
    } else {
        0
    };
    let rest = parts.next().unwrap_or_default();
    if let Some(more) = parts.next() {
        return Err(format!(
            "{more:?} is too much; allowed: PLACE[:AXIS]:KIND[=VALUE]@WINDOW"
        ));
    }
    let (name, value) = match rest.split_once('=') {
        Some((name, value)) => (name, Some(value)),
        None => (rest, None),
    };
    let kind = kinds
        .iter()
        .find(|kind| kind.name == name)
        .ok_or_else(|| unknown("kind", name, kinds.iter().map(|kind| kind.name).collect()))?;
    let (value, second) = match value.and_then(|value| value.split_once('/')) {
        Some((value, second)) if kind.second.is_some() => (Some(value), Some(second)),
        _ => (value, None),
    };
    let value = number(kind.name, kind.value, value)?;
    let second = number(kind.name, kind.second, second)?;
    if let (Some(info), None) = (message, node) {
        if let Some(why) = kind.why_not(info) {
            let with = TABLE.iter().filter(|info| kind.acts_on(info));
            let names: Vec<_> = with.map(|info| info.name).collect();
            let (name, names) = (info.name, names.join(", "));
            return Err(format!("{why} {name}; allowed: {names}"));
        }
        return Ok(of_message(info, kind.name, value, second));
    }
    if let Some(node) = node {
        return of_node(node, kind.name, value);
    }
    Ok(match (group, kind.name) {
        ("bus", "dominant") => What::Wires(Level::Dominant),
        ("bus", _) => What::Wires(Level::Recessive),
        ("clock", "drift") => What::Clock(ClockDefect::Drift(value)),
        ("clock", _) => What::Clock(ClockDefect::Misses(value)),
        ("encoder", "slow") => What::Encoder(axis, EncoderDefect::Slow(value)),
        ("encoder", "jump") => What::Encoder(axis, EncoderDefect::Jump(value)),
        ("encoder", "noise") => What::Encoder(axis, EncoderDefect::Noise(value.abs())),
        ("encoder", "reversed") => What::Encoder(axis, EncoderDefect::Reversed),
        ("encoder", "bit") => What::Encoder(axis, EncoderDefect::BitLost(value as u32)),
        ("encoder", _) => What::Encoder(axis, EncoderDefect::Stuck),
        ("motor", "dead") => What::Motor(axis, MotorDefect::Weak(0.0)),
        ("motor", "dip") => What::Motor(axis, MotorDefect::Dip),
        ("motor", "weak") => What::Motor(axis, MotorDefect::Weak(value)),
        ("motor", _) => What::Motor(axis, MotorDefect::Runaway),
        ("brake", "stuck") => What::Brake(BrakeDefect::Stuck),
        ("brake", "stuck-open") => What::Brake(BrakeDefect::StuckOpen),
        ("brake", "stuck-closed") => What::Brake(BrakeDefect::StuckClosed),
        ("brake", _) => What::Brake(BrakeDefect::Slow(value)),
        (_, "heavier") => What::Load(LoadDefect::Heavier(value)),
        (_, "caught") => What::Load(LoadDefect::Caught(value)),
        _ => What::Load(LoadDefect::Dropped),
    })
}

fn of_message(info: &'static MessageInfo, kind: &str, value: f64, second: f64) -> What {
    let frames = |fault| What::Frames(info, fault);
    let attempts = |error| What::Attempts(info, error, value);
    match kind {
        "loss" => frames(FrameFault::Loss(value)),
        "burst" => frames(FrameFault::Burst(value, second)),
        "reorder" => frames(FrameFault::Reorder(value)),
        "delay" => frames(FrameFault::Delay(value)),
        "jitter" => frames(FrameFault::Jitter(value)),
        "duplicate" => frames(FrameFault::Duplicate),
        "corrupt" => frames(FrameFault::Corrupt(value)),
        "bad-value" => frames(FrameFault::BadValue(value)),
        "replay" => frames(FrameFault::Replay(value as usize)),
        "masquerade" => What::Foreign(info, Disguise::Poor),
        "forged" => What::Foreign(info, Disguise::Perfect),
        "bit-error" => attempts(ErrorKind::Bit),
        "stuff-error" => attempts(ErrorKind::Stuff),
        "form-error" => attempts(ErrorKind::Form),
        "crc-error" => attempts(ErrorKind::Crc),
        _ => attempts(ErrorKind::Ack),
    }
}

fn of_node(node: Node, kind: &str, value: f64) -> Result<What, String> {
    Ok(match kind {
        "dead" if node == Node::Operator => {
            return Err(
                "an operator that starts anew has nobody to tell it what to do; allowed: operator:silent"
                    .into(),
            );
        }
        "dead" => What::Dead(node),
        "slow" if node != Node::Controller => {
            return Err(
                "nobody but the controller has to answer within a sample; allowed: controller:slow, or the delay of a message"
                    .into(),
            );
        }
        "slow" => What::Slow(value),
        "babbling" => What::Babbling(node),
        "misread" => What::Misreads(node, value),
        "no-recovery" => What::NoRecovery(node),
        _ => What::Silent(node),
    })
}

/// The value of a kind, or 0 for one without.
fn number(name: &str, rule: Option<Value>, text: Option<&str>) -> Result<f64, String> {
    let Some(rule) = rule else {
        return match text {
            None => Ok(0.0),
            Some(_) => Err(format!("{name} takes no value")),
        };
    };
    let Value {
        least,
        greatest,
        whole,
        unit,
        ..
    } = rule;
    let a_whole_number = if whole { "a whole number from " } else { "" };
    let allowed = format!("{a_whole_number}{least} to {greatest} {unit}");
    let Some(text) = text else {
        return rule
            .default
            .ok_or_else(|| format!("{name} needs a value, as in {name}=...; allowed: {allowed}"));
    };
    match text.parse::<f64>() {
        Ok(number) if (least..=greatest).contains(&number) && !(whole && number.fract() != 0.0) => {
            Ok(number)
        }
        _ => Err(format!("{name} is {text}; allowed: {allowed}")),
    }
}

fn places() -> Vec<&'static str> {
    let parts = KINDS.iter().map(|kind| kind.place);
    let parts = parts.filter(|place| !matches!(*place, "message" | "node"));
    let mut places: Vec<_> = TABLE
        .iter()
        .map(|info| info.name)
        .chain(Node::ALL.iter().map(|node| node.name()))
        .chain(parts)
        .collect();
    places.dedup();
    places
}

fn unknown(what: &str, word: &str, known: Vec<&str>) -> String {
    format!(
        "there is no {what} {word:?}; allowed: {}",
        allowed(word, &known)
    )
}
