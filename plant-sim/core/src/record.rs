//! Observers that record a run: its trace and its truth, as text into any sink.

use std::io::{self, Write};

use protocol::frame::CanFrame;
use protocol::time::{Duration, Instant};
use trace::{Entry, ErrorFrame, Interface, LogHash, Record, Writer};

use crate::observer::{Observer, Truth};

/// A record of a run's own bus.
pub fn of_run(time: Instant, entry: Entry) -> Record {
    Record {
        time_us: time.micros(),
        interface: Interface::CAN0,
        direction: None,
        entry,
    }
}

/// Every frame, and what CAN controllers report of errors, as `candump -L -e` writes it.
pub struct TraceLog<W: Write>(Writer<W>);

impl<W: Write> TraceLog<W> {
    /// An empty log that goes into `sink`.
    pub fn new(sink: W) -> Self {
        Self(Writer::new(sink, Interface::CAN0))
    }

    /// The sink, flushed, and the hash of the log.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn finish(self) -> io::Result<(W, LogHash)> {
        self.0.finish()
    }
}

impl<W: Write> Observer for TraceLog<W> {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        self.0.frame(time.micros(), frame)
    }

    fn error(&mut self, time: Instant, error: &ErrorFrame, _: Duration) -> io::Result<()> {
        self.0.error(time.micros(), error)
    }
}

/// Columns of the truth: name, unit, what it is. The lift is positive downwards.
pub const TRUTH_COLUMNS: [(&str, &str, &str); 25] = [
    ("t", "s", "Time of the sample."),
    ("q1", "rad", "True joint position, shoulder."),
    ("q2", "rad", "True joint position, elbow."),
    ("q3", "m", "True joint position, lift."),
    ("q4", "rad", "True joint position, wrist."),
    ("qd1", "rad/s", "True joint velocity, shoulder."),
    ("qd2", "rad/s", "True joint velocity, elbow."),
    ("qd3", "m/s", "True joint velocity, lift."),
    ("qd4", "rad/s", "True joint velocity, wrist."),
    (
        "rq1",
        "rad",
        "Reference position of the controller, shoulder.",
    ),
    ("rq2", "rad", "Reference position of the controller, elbow."),
    ("rq3", "m", "Reference position of the controller, lift."),
    ("rq4", "rad", "Reference position of the controller, wrist."),
    (
        "rqd1",
        "rad/s",
        "Reference velocity of the controller, shoulder.",
    ),
    (
        "rqd2",
        "rad/s",
        "Reference velocity of the controller, elbow.",
    ),
    ("rqd3", "m/s", "Reference velocity of the controller, lift."),
    (
        "rqd4",
        "rad/s",
        "Reference velocity of the controller, wrist.",
    ),
    (
        "tau1",
        "N m",
        "Effort that the motor brings to the joint, after all limits, shoulder.",
    ),
    (
        "tau2",
        "N m",
        "Effort that the motor brings to the joint, after all limits, elbow.",
    ),
    (
        "tau3",
        "N",
        "Effort that the motor brings to the joint, after all limits, lift.",
    ),
    (
        "tau4",
        "N m",
        "Effort that the motors bring to the joint, after all limits, wrist: with the torque of the lift's nut.",
    ),
    ("x", "m", "True flange, x in frame 0."),
    ("y", "m", "True flange, y in frame 0."),
    ("z", "m", "True flange, z in frame 0."),
    (
        "yaw",
        "rad",
        "True flange, turn about z of frame 0, in (-pi, pi].",
    ),
];

/// One row per sample: actual motion of the robot and its reference.
pub struct TruthLog<W: Write> {
    sink: W,
    /// A row under construction.
    row: String,
}

impl<W: Write> TruthLog<W> {
    /// A table with its header that goes into `sink`.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn new(mut sink: W) -> io::Result<Self> {
        let header = TRUTH_COLUMNS.map(|(name, _, _)| name).join(",");
        writeln!(sink, "{header}")?;
        Ok(Self {
            sink,
            row: String::new(),
        })
    }

    /// The sink, flushed.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn finish(mut self) -> io::Result<W> {
        self.sink.flush()?;
        Ok(self.sink)
    }
}

impl<W: Write> Observer for TruthLog<W> {
    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        fill(&mut self.row, truth);
        self.sink.write_all(self.row.as_bytes())
    }
}

/// The row of a sample. Without the sink: compiled once and here.
fn fill(row: &mut String, truth: &Truth) {
    // The standard library's float formatting would take a third of the run's time.
    let mut digits = zmij::Buffer::new();
    row.clear();
    row.push_str(digits.format(truth.plant.t));
    for group in [
        &truth.plant.q,
        &truth.plant.qd,
        &truth.mind.q,
        &truth.mind.qd,
        &truth.plant.tau,
        &truth.plant.tool,
    ] {
        for value in group {
            row.push(',');
            row.push_str(digits.format(*value));
        }
    }
    row.push('\n');
}
