//! Planned faults of a run: what breaks, and from when until when.
//!
//! A fault is one line of text, in a scenario as on the command line:
//!
//! ```text
//! command:loss=0.2@0.3s..0.5s     PLACE[:AXIS]:KIND[=VALUE]@FROM[..UNTIL]
//! encoder:elbow:stuck@300ms
//! ```
//!
//! Three parts of a run carry them out. A wrapper around each node ([`Faulty`]) changes the frames that the node sends; a
//! peer without frames ([`Injector`]) breaks parts of the robot and repairs them; the bus itself has the errors that CAN
//! controllers find ([`Rig::spoil`](crate::rig::Rig::plant)). All are seeded, so a run with faults repeats to the byte. The
//! controller is not informed.

mod frames;
mod injector;
mod parse;

use protocol::messages::Node;
use protocol::schema::MessageInfo;
use protocol::time::{Duration, Instant};
use serde::{Deserialize, Serialize};

pub use frames::Faulty;
pub use injector::Injector;
pub use parse::{FaultError, KINDS, Kind};

use crate::bus::ErrorKind;
use crate::plant::defect::{EncoderDefect, MotorDefect};

/// A planned fault.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(try_from = "String", into = "String")]
pub struct Fault {
    /// As it was written.
    pub text: String,
    /// What breaks, and how.
    pub what: What,
    /// Beginning.
    pub from: Instant,
    /// End; [`Instant::MAX`] for a fault that stays.
    pub until: Instant,
}

impl From<Fault> for String {
    fn from(fault: Fault) -> Self {
        fault.text
    }
}

impl Fault {
    /// Whether it is in effect.
    pub fn acts(&self, now: Instant) -> bool {
        (self.from..self.until).contains(&now)
    }
}

/// What breaks, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum What {
    /// Frames of one message, between the node that sends them and the bus.
    Frames(&'static MessageInfo, FrameFault),
    /// The node neither receives nor sends.
    Silent(Node),
    /// Attempts to send one message, on the bus: this error, in this share of them.
    Attempts(&'static MessageInfo, ErrorKind, f64),
    /// The node alone reads this share of the others' frames with a wrong CRC.
    Misreads(Node, f64),
    /// The node's CAN controller stays bus-off.
    NoRecovery(Node),
    /// An encoder, by axis.
    Encoder(usize, EncoderDefect),
    /// A motor, by axis.
    Motor(usize, MotorDefect),
    /// The brake of the lift stays as it is.
    BrakeStuck,
    /// The payload falls out of the gripper.
    PayloadDropped,
}

/// What happens to a frame before it is on the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FrameFault {
    /// It is lost, with this probability.
    Loss(f64),
    /// It is delayed by this many seconds.
    Delay(f64),
    /// It is delayed by a random time, uniform from 0 to this many seconds.
    Jitter(f64),
    /// It is sent twice.
    Duplicate,
    /// One bit of it is wrong, with this probability: a fault inside the node, which the CRC of the bus covers up.
    Corrupt(f64),
    /// The frame of the same message that was sent this many frames earlier takes its place.
    Replay(usize),
}

/// Seconds to the nearest nanosecond: a decimal fraction of a second is not cut one short.
fn duration(seconds: f64) -> Duration {
    Duration::from_nanos((seconds * 1e9).round() as u64)
}
