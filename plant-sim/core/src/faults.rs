//! Planned faults of a run: what breaks, and from when until when.
//!
//! A fault is one line of text, in a scenario as on the command line:
//!
//! ```text
//! command:loss=0.2@0.3s..0.5s     PLACE[:AXIS]:KIND[=VALUE]@WINDOW
//! encoder:elbow:stuck@300ms
//! motor:lift:dead@jump2+200ms..+50ms
//! ```
//!
//! Four parts of a run carry them out, each as long as the [`Window`] is open. A wrapper around each node ([`Faulty`]) changes
//! the frames that the node sends, and takes its power and its time; a peer without frames ([`Injector`]) breaks parts of the robot and
//! repairs them; a foreign node ([`Impostor`]) sends frames that are not its own; the bus itself has the errors that CAN
//! controllers find ([`Rig::spoil`](crate::rig::Rig::spoil)). All are seeded, so a run with faults repeats to the byte. The
//! controller is not informed.

mod frames;
mod impostor;
mod injector;
mod kinds;
mod parse;
mod watch;
mod window;

use protocol::messages::Node;
use protocol::schema::MessageInfo;
use protocol::time::Duration;
use serde::{Deserialize, Serialize};

pub use frames::Faulty;
pub use impostor::Impostor;
pub use injector::Injector;
pub use kinds::{KINDS, Kind, Value};
pub use parse::FaultError;
pub use watch::Planned;
pub(crate) use watch::{Sense, Watch};
pub use window::{Activity, End, Episode, Moment, Span, Window};

use crate::bus::{ErrorKind, Level};
use crate::clock::ClockDefect;
use crate::plant::defect::{BrakeDefect, EncoderDefect, LoadDefect, MotorDefect};

/// A planned fault.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(try_from = "String", into = "String")]
pub struct Fault {
    /// As it was written.
    pub text: String,
    /// What breaks, and how.
    pub what: What,
    /// When.
    pub window: Window,
}

impl From<Fault> for String {
    fn from(fault: Fault) -> Self {
        fault.text
    }
}

/// What breaks, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum What {
    /// Frames of one message, between the node that sends them and the bus.
    Frames(&'static MessageInfo, FrameFault),
    /// A foreign node sends the message, once a sample.
    Foreign(&'static MessageInfo, Disguise),
    /// The node neither receives nor sends.
    Silent(Node),
    /// The node has no power, and starts anew when it has.
    Dead(Node),
    /// The controller needs so much longer for a sample, s.
    Slow(f64),
    /// The node's CAN controller sends the frame of the highest priority whenever it can.
    Babbling(Node),
    /// Attempts to send one message, on the bus: this error, in this share of them.
    Attempts(&'static MessageInfo, ErrorKind, f64),
    /// The node alone reads this share of the others' frames with a wrong CRC.
    Misreads(Node, f64),
    /// The node's CAN controller stays bus-off.
    NoRecovery(Node),
    /// The wires of the bus are held at this level.
    Wires(Level),
    /// The clock by which the drives take their samples.
    Clock(ClockDefect),
    /// An encoder, by axis.
    Encoder(usize, EncoderDefect),
    /// A motor, by axis.
    Motor(usize, MotorDefect),
    /// The brake of the lift.
    Brake(BrakeDefect),
    /// What the flange carries.
    Load(LoadDefect),
}

/// How well a foreign node imitates another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Disguise {
    /// By the identifier and the length alone: the end-to-end protection is wrong.
    Poor,
    /// In everything: the last frame of the message again, with the next counter and the right CRC.
    Perfect,
}

/// What happens to a frame before it is on the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FrameFault {
    /// It is lost, with this probability.
    Loss(f64),
    /// It is lost in bursts: this share of all frames, in bursts of this many on average (Gilbert 1960, Elliott 1963).
    Burst(f64, f64),
    /// It goes out after the next one of its message, with this probability.
    Reorder(f64),
    /// It is delayed by this many seconds.
    Delay(f64),
    /// It is delayed by a random time, uniform from 0 to this many seconds.
    Jitter(f64),
    /// It is sent twice.
    Duplicate,
    /// One bit of it is wrong, with this probability: a fault inside the node, which the CRC of the bus covers up.
    Corrupt(f64),
    /// Its first real number is none, under a right CRC, with this probability.
    BadValue(f64),
    /// The frame of the same message that was sent this many frames earlier takes its place.
    Replay(usize),
}

/// Seconds to the nearest nanosecond: a decimal fraction of a second is not cut one short.
fn duration(seconds: f64) -> Duration {
    Duration::from_nanos((seconds * 1e9).round() as u64)
}
