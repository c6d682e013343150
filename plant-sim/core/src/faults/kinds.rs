//! The kinds of faults: a row for each, as people write it and read about it.

use protocol::schema::{Content, MessageInfo};

use super::frames::real_number;

const BAD_VALUE: &str = "bad-value";
const FORGED: &str = "forged";

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
    /// A second one after a slash; it may be left out.
    pub second: Option<Value>,
    /// What it does.
    pub about: &'static str,
}

impl Kind {
    /// Whether this kind, of a message, can act on that one.
    pub fn acts_on(&self, info: &MessageInfo) -> bool {
        self.why_not(info).is_none()
    }

    /// Why it cannot, as in "... of the message NAME".
    pub(super) fn why_not(&self, info: &MessageInfo) -> Option<&'static str> {
        match self.name {
            BAD_VALUE if real_number(info).is_none() => {
                Some("there is not always a real number in")
            }
            // An emergency stop is sent once, where there is nothing left to stop.
            FORGED if matches!(info.content, Content::Nmt | Content::EStop) => {
                Some("a run has nothing to repeat of")
            }
            _ => None,
        }
    }
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
    /// Whether it is a whole number.
    pub whole: bool,
    /// Unit and meaning.
    pub unit: &'static str,
}

impl Value {
    /// Between two values that a person may choose.
    pub fn step(&self) -> f64 {
        if self.whole { 1.0 } else { 0.001 }
    }

    /// One to begin with: a hundredth of what is allowed can be seen and is no nonsense.
    pub fn moderate(&self) -> f64 {
        let hundredth = self.greatest / 100.0;
        let start = if self.whole {
            hundredth.ceil()
        } else {
            hundredth
        };
        self.default.unwrap_or(start)
    }
}

const SHARE: Value = Value {
    default: Some(1.0),
    ..value(0.0, 1.0, "share of the frames")
};
const ATTEMPTS: Value = Value {
    unit: "share of the attempts to send it",
    ..SHARE
};
const SECONDS: Value = value(0.0, 1.0, "s");
const ANGLE: Value = value(-10.0, 10.0, "rad, for the lift m");

const fn value(least: f64, greatest: f64, unit: &'static str) -> Value {
    Value {
        least,
        greatest,
        default: None,
        whole: false,
        unit,
    }
}

const fn whole(least: f64, greatest: f64, unit: &'static str) -> Value {
    Value {
        whole: true,
        ..value(least, greatest, unit)
    }
}

const fn of(
    place: &'static str,
    name: &'static str,
    value: Option<Value>,
    about: &'static str,
) -> Kind {
    Kind {
        place,
        has_axis: false,
        name,
        value,
        second: None,
        about,
    }
}

const fn of_message(name: &'static str, value: Option<Value>, about: &'static str) -> Kind {
    of("message", name, value, about)
}

const fn of_node(name: &'static str, value: Option<Value>, about: &'static str) -> Kind {
    of("node", name, value, about)
}

const fn of_axis(
    place: &'static str,
    name: &'static str,
    value: Option<Value>,
    about: &'static str,
) -> Kind {
    Kind {
        has_axis: true,
        ..of(place, name, value, about)
    }
}

/// Every kind, in the order of the documents.
#[rustfmt::skip]
pub const KINDS: [Kind; 43] = [
    of_message("loss", Some(SHARE), "the frame never gets to the bus"),
    Kind {
        second: Some(Value { default: Some(8.0), ..value(1.0, 1000.0, "frames in a burst, on average") }),
        ..of_message("burst", Some(value(0.0, 0.5, "share of the frames")), "frames never get to the bus, many in a row")
    },
    of_message("reorder", Some(SHARE), "the frame goes out after the next one of its message"),
    of_message("delay", Some(SECONDS), "the frame is late"),
    of_message("jitter", Some(SECONDS), "the frame is late by a random time up to this"),
    of_message("duplicate", None, "the frame is sent twice"),
    of_message("corrupt", Some(SHARE), "one bit is wrong inside the node, so that the CRC of the bus is right"),
    of_message(BAD_VALUE, Some(SHARE), "its first real number is none (NaN): the arithmetic of the node is wrong, and every CRC right"),
    of_message("replay", Some(Value { default: Some(1.0), ..whole(1.0, 64.0, "frames") }),
        "the frame is the one sent so many frames before"),
    of_message("masquerade", None, "a foreign node sends the message once a sample, without its end-to-end protection"),
    of_message(FORGED, None, "a foreign node sends the last frame of the message once a sample, with the next counter and the right CRC"),
    of_message("bit-error", Some(ATTEMPTS), "the node that sends reads another bit than its own"),
    of_message("stuff-error", Some(ATTEMPTS), "all nodes read six equal bits in a row"),
    of_message("form-error", Some(ATTEMPTS), "a delimiter or the end of the frame has a dominant bit"),
    of_message("crc-error", Some(ATTEMPTS), "all that receive it find a wrong CRC"),
    of_message("ack-error", Some(ATTEMPTS), "the node that sends reads no acknowledgement"),
    of_node("silent", None, "the node neither receives nor sends; when the fault ends it goes on where it is"),
    of_node("dead", None, "the node has no power; when the fault ends it starts anew"),
    of_node("slow", Some(SECONDS), "the controller needs so much longer for a sample, and the next one waits for that"),
    of_node("babbling", None, "the node sends the frame of the highest priority, again and again"),
    of_node("misread", Some(SHARE), "the node, and no other, finds a wrong CRC in what it receives"),
    of_node("no-recovery", None, "once bus-off, the node stays so: nobody tells its CAN controller to recover"),
    of("bus", "dominant", None, "the wires are held dominant, as by a transceiver that has broken down"),
    of("bus", "recessive", None, "the wires are held recessive, as by a short between them"),
    of("clock", "drift", Some(value(-0.1, 0.1, "share by which it is fast")), "the clock by which the drives take their samples runs too fast or too slow"),
    of("clock", "misses", Some(Value { unit: "share of the ticks", ..SHARE }), "the drives take no sample at a tick of their clock, and do not count it"),
    of_axis("encoder", "stuck", None, "the reading does not change"),
    of_axis("encoder", "slow", Some(SECONDS), "the reading follows with this time constant"),
    of_axis("encoder", "jump", Some(ANGLE), "the reading is off by this"),
    of_axis("encoder", "noise", Some(ANGLE), "the reading is off by a random angle up to this, anew in every sample"),
    of_axis("encoder", "reversed", None, "the reading goes backwards from where it is"),
    of_axis("encoder", "bit", Some(whole(0.0, 31.0, "number of the bit")), "this bit of the reading is always 0"),
    of_axis("motor", "dead", None, "the motor gives no torque, and its drive does not notice"),
    of_axis("motor", "dip", None, "the drive has no power: the motor gives no torque, and the drives report a fault"),
    of_axis("motor", "weak", Some(value(0.0, 1.0, "share of the torque")), "the motor gives this share of the torque that it is asked for"),
    of_axis("motor", "runaway", None, "the motor gives its peak torque while torque is enabled"),
    of("brake", "stuck", None, "the brake of the lift stays as it is"),
    of("brake", "stuck-open", None, "the brake of the lift does not hold, whatever it is told"),
    of("brake", "stuck-closed", None, "the brake of the lift closes, whatever it is told"),
    of("brake", "slow", Some(SECONDS), "the brake of the lift takes so much longer to close and to open"),
    of("payload", "dropped", None, "the payload falls out of the gripper"),
    of("payload", "heavier", Some(value(0.0, 50.0, "kg")), "the flange carries so much more than was announced"),
    of("payload", "caught", Some(value(0.0, 100_000.0, "N/m")), "a spring of this stiffness holds the flange where it is"),
];
