//! Faults from text.

use protocol::messages::Node;
use protocol::table::TABLE;
use protocol::time::Instant;

use super::{Fault, FrameFault, What, duration};
use crate::bus::ErrorKind;
use crate::model::AXES;
use crate::plant::defect::{EncoderDefect, MotorDefect};
use crate::text::allowed;

/// Why a text does not describe a fault: what is wrong and what is allowed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct FaultError(String);

/// A kind of fault, as people write it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kind {
    /// Where: `message` for the name of any message, `node` for any node, else the part of the robot.
    pub place: &'static str,
    /// Whether an axis follows the place.
    pub has_axis: bool,
    /// Name.
    pub name: &'static str,
    /// Its value, where it takes one.
    pub value: Option<Value>,
    /// What it does.
    pub about: &'static str,
}

/// A number that a kind takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value {
    /// Least.
    pub least: f64,
    /// Greatest.
    pub greatest: f64,
    /// Where none is given; `None` where one must be.
    pub default: Option<f64>,
    /// Unit and meaning.
    pub unit: &'static str,
}

const SHARE: Value = Value {
    least: 0.0,
    greatest: 1.0,
    default: Some(1.0),
    unit: "share of the frames",
};
const ATTEMPTS: Value = Value {
    unit: "share of the attempts to send it",
    ..SHARE
};
const SECONDS: Value = Value {
    least: 0.0,
    greatest: 1.0,
    default: None,
    unit: "s",
};
const ANGLE: Value = Value {
    least: -10.0,
    greatest: 10.0,
    default: None,
    unit: "rad, for the lift m",
};

const fn of_message(name: &'static str, value: Option<Value>, about: &'static str) -> Kind {
    Kind {
        place: "message",
        has_axis: false,
        name,
        value,
        about,
    }
}

const fn of_node(name: &'static str, value: Option<Value>, about: &'static str) -> Kind {
    Kind {
        place: "node",
        ..of_message(name, value, about)
    }
}

const fn of_axis(
    place: &'static str,
    name: &'static str,
    value: Option<Value>,
    about: &'static str,
) -> Kind {
    Kind {
        place,
        has_axis: true,
        name,
        value,
        about,
    }
}

/// Every kind, in the order of the documents.
#[rustfmt::skip]
pub const KINDS: [Kind; 24] = [
    of_message("loss", Some(SHARE), "the frame never gets to the bus"),
    of_message("delay", Some(SECONDS), "the frame is late"),
    of_message("jitter", Some(SECONDS), "the frame is late by a random time up to this"),
    of_message("duplicate", None, "the frame is sent twice"),
    of_message("corrupt", Some(SHARE), "one bit is wrong inside the node, so that the CRC of the bus is right"),
    of_message("replay", Some(Value { least: 1.0, greatest: 64.0, default: Some(1.0), unit: "frames" }),
        "the frame is the one sent so many frames before"),
    of_message("bit-error", Some(ATTEMPTS), "the node that sends reads another bit than its own"),
    of_message("stuff-error", Some(ATTEMPTS), "all nodes read six equal bits in a row"),
    of_message("form-error", Some(ATTEMPTS), "a delimiter or the end of the frame has a dominant bit"),
    of_message("crc-error", Some(ATTEMPTS), "all that receive it find a wrong CRC"),
    of_message("ack-error", Some(ATTEMPTS), "the node that sends reads no acknowledgement"),
    of_node("silent", None, "the node neither receives nor sends"),
    of_node("misread", Some(SHARE), "the node, and no other, finds a wrong CRC in what it receives"),
    of_node("no-recovery", None, "once bus-off, the node stays so: nobody tells its CAN controller to recover"),
    of_axis("encoder", "stuck", None, "the reading does not change"),
    of_axis("encoder", "jump", Some(ANGLE), "the reading is off by this"),
    of_axis("encoder", "noise", Some(ANGLE), "the reading is off by a random angle up to this, anew in every sample"),
    of_axis("encoder", "reversed", None, "the reading goes backwards from where it is"),
    of_axis("encoder", "bit", Some(Value { least: 0.0, greatest: 31.0, default: None, unit: "number of the bit" }),
        "this bit of the reading is always 0"),
    of_axis("motor", "dead", None, "the motor gives no torque"),
    of_axis("motor", "weak", Some(Value { least: 0.0, greatest: 1.0, default: None, unit: "share of the torque" }),
        "the motor gives this share of the torque that it is asked for"),
    of_axis("motor", "runaway", None, "the motor gives its peak torque while torque is enabled"),
    Kind { place: "brake", has_axis: false, name: "stuck", value: None, about: "the brake of the lift stays as it is" },
    Kind { place: "payload", has_axis: false, name: "dropped", value: None, about: "the payload falls out of the gripper" },
];

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
        .ok_or("there is no time; write it as ...@0.3s or ...@0.3s..0.5s")?;
    let (from, until) = match window.split_once("..") {
        Some((from, until)) => (time(from)?, time(until)?),
        None => (time(window)?, Instant::MAX),
    };
    if until <= from {
        return Err(format!("{window} ends before it begins"));
    }
    Ok(Fault {
        text: text.into(),
        what: what_of(what)?,
        from,
        until,
    })
}

/// `0.3s` or `300ms`, from the beginning of the run.
fn time(text: &str) -> Result<Instant, String> {
    let (number, scale) = match text.strip_suffix("ms") {
        Some(number) => (number, 1e-3),
        None => (text.strip_suffix('s').unwrap_or(""), 1.0),
    };
    match number.parse::<f64>() {
        Ok(number) if (0.0..=1e6).contains(&(number * scale)) => {
            Ok(Instant::ORIGIN + duration(number * scale))
        }
        _ => Err(format!(
            "{text:?} is not a time; allowed: seconds as 0.3s or milliseconds as 300ms, up to a million seconds"
        )),
    }
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
            "{more:?} is too much; allowed: PLACE[:AXIS]:KIND[=VALUE]@FROM[..UNTIL]"
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
    let value = number(kind, value)?;
    Ok(match (kind.name, message, node) {
        ("loss", Some(info), _) => What::Frames(info, FrameFault::Loss(value)),
        ("delay", Some(info), _) => What::Frames(info, FrameFault::Delay(value)),
        ("jitter", Some(info), _) => What::Frames(info, FrameFault::Jitter(value)),
        ("duplicate", Some(info), _) => What::Frames(info, FrameFault::Duplicate),
        ("corrupt", Some(info), _) => What::Frames(info, FrameFault::Corrupt(value)),
        ("replay", Some(info), _) => What::Frames(info, FrameFault::Replay(value as usize)),
        ("bit-error", Some(info), _) => What::Attempts(info, ErrorKind::Bit, value),
        ("stuff-error", Some(info), _) => What::Attempts(info, ErrorKind::Stuff, value),
        ("form-error", Some(info), _) => What::Attempts(info, ErrorKind::Form, value),
        ("crc-error", Some(info), _) => What::Attempts(info, ErrorKind::Crc, value),
        ("ack-error", Some(info), _) => What::Attempts(info, ErrorKind::Ack, value),
        ("misread", _, Some(node)) => What::Misreads(node, value),
        ("no-recovery", _, Some(node)) => What::NoRecovery(node),
        (_, _, Some(node)) => What::Silent(node),
        ("jump", ..) => What::Encoder(axis, EncoderDefect::Jump(value)),
        ("noise", ..) => What::Encoder(axis, EncoderDefect::Noise(value.abs())),
        ("reversed", ..) => What::Encoder(axis, EncoderDefect::Reversed),
        ("bit", ..) => What::Encoder(axis, EncoderDefect::BitLost(value as u32)),
        ("dead", ..) => What::Motor(axis, MotorDefect::Weak(0.0)),
        ("weak", ..) => What::Motor(axis, MotorDefect::Weak(value)),
        ("runaway", ..) => What::Motor(axis, MotorDefect::Runaway),
        ("dropped", ..) => What::PayloadDropped,
        _ if group == "brake" => What::BrakeStuck,
        _ => What::Encoder(axis, EncoderDefect::Stuck),
    })
}

/// The value of a kind, or 0 for one without.
fn number(kind: &Kind, text: Option<&str>) -> Result<f64, String> {
    let Some(rule) = kind.value else {
        return match text {
            None => Ok(0.0),
            Some(_) => Err(format!("{} takes no value", kind.name)),
        };
    };
    let Value {
        least,
        greatest,
        unit,
        ..
    } = rule;
    let allowed = format!("{least} to {greatest} {unit}");
    let Some(text) = text else {
        return rule.default.ok_or_else(|| {
            format!(
                "{0} needs a value, as in {0}=...; allowed: {allowed}",
                kind.name
            )
        });
    };
    match text.parse::<f64>() {
        Ok(number) if (least..=greatest).contains(&number) => Ok(number),
        _ => Err(format!("{} is {text}; allowed: {allowed}", kind.name)),
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
