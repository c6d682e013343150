//! A picture of a trace: set and actual joint positions, tracking errors, torques, modes and faults over time.
//!
//! Memory is bounded: every curve keeps the envelope of its values in a fixed number of bins (see `series`), so an
//! hour takes as much as a second, and no peak is lost.

mod series;
mod svg;

use firmware::mechanics::arm::ArmModel;
use firmware::mechanics::dynamics::drive::Drive;
use nalgebra::Vector4;
use protocol::codec;
use protocol::messages::{Cause, Command, Feedback, Message, Mode, Node, State};

use series::Series;
use trace::{Entry, Record};

/// Most mode changes and faults that are drawn; further ones are only counted.
const MAX_EVENTS: usize = 200;

/// The pictures one below the other, as a self-contained SVG document.
#[must_use]
pub fn page(plots: &[Plot]) -> String {
    svg::page(plots)
}

/// Gathers the data of a plot, record by record.
pub struct Plot {
    drive: Drive,
    torque_limit: [f32; 4],
    title: String,
    first_us: Option<u64>,
    newest_us: u64,
    /// Joint position at the newest feedback.
    joints: Option<Vector4<f32>>,
    /// Joint positions, rad and m: reference and measurement.
    set: [Series; 4],
    actual: [Series; 4],
    /// Reference minus measurement.
    error: [Series; 4],
    /// Commanded motor torques, relative to their limits.
    torque: [Series; 4],
    modes: Vec<(u64, Mode)>,
    marks: Vec<Mark>,
    cause: Cause,
    undrawn: u64,
}

/// An event to mark.
struct Mark {
    time_us: u64,
    text: String,
    grave: bool,
}

impl Plot {
    /// An empty plot, for a robot with the joints and encoders of `arm`.
    #[must_use]
    pub fn new(arm: &ArmModel, title: &str) -> Self {
        Self {
            drive: Drive::new(&arm.drive),
            torque_limit: arm.drive.motor_torque_limit.into(),
            title: title.to_owned(),
            first_us: None,
            newest_us: 0,
            joints: None,
            set: Default::default(),
            actual: Default::default(),
            error: Default::default(),
            torque: Default::default(),
            modes: Vec::new(),
            marks: Vec::new(),
            cause: Cause::None,
            undrawn: 0,
        }
    }

    /// Adds the next record. Frames that the protocol refuses are left out.
    pub fn record(&mut self, record: &Record) {
        let first = *self.first_us.get_or_insert(record.time_us);
        // A clock set back stands still instead.
        self.newest_us = self.newest_us.max(record.time_us.saturating_sub(first));
        let Entry::Frame(frame) = &record.entry else {
            return;
        };
        let Ok(received) = codec::decode(frame) else {
            return;
        };
        match received.message {
            Message::Feedback(feedback) => self.feedback(&feedback),
            Message::Command(command) => self.command(&command),
            Message::State(state) => self.state(&state),
            Message::Heartbeat(Node::Controller, heartbeat) => self.mode(heartbeat.state),
            Message::Emergency(node, emergency) if emergency.cause != Cause::None => {
                self.mark(format!("{node}: {}", emergency.cause), true);
            }
            Message::EStop(_) => self.mark("emergency stop".into(), true),
            Message::Motion(motion) => self.mark(motion.request.name().into(), false),
            _ => {}
        }
    }

    /// Whether no record held anything to draw.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        let curves = [&self.set, &self.actual, &self.error, &self.torque];
        self.modes.is_empty()
            && self.marks.is_empty()
            && curves.into_iter().flatten().all(Series::is_empty)
    }

    fn feedback(&mut self, feedback: &Feedback) {
        let motors = self.drive.motor_angle_of_counts(&feedback.position);
        let joints = self.drive.joint_angle(&motors);
        for (series, &value) in self.actual.iter_mut().zip(joints.iter()) {
            series.push(self.newest_us, value);
        }
        self.joints = Some(joints);
    }

    fn command(&mut self, command: &Command) {
        for ((series, torque), limit) in self
            .torque
            .iter_mut()
            .zip(command.torque)
            .zip(self.torque_limit)
        {
            series.push(self.newest_us, torque / limit);
        }
    }

    /// Adds a report: its error of the newest sample plus the position of that sample gives the reference.
    fn state(&mut self, state: &State) {
        self.mode(state.mode);
        if state.cause != self.cause && state.cause != Cause::None {
            self.mark(state.cause.name().into(), true);
        }
        self.cause = state.cause;
        for (axis, error) in state.tracking_error.into_iter().enumerate() {
            self.error[axis].push(self.newest_us, error);
            if let Some(joints) = self.joints {
                self.set[axis].push(self.newest_us, joints[axis] + error);
            }
        }
    }

    fn mode(&mut self, mode: Mode) {
        if self.modes.last().map(|(_, mode)| *mode) == Some(mode) {
            return;
        }
        if self.modes.len() < MAX_EVENTS {
            self.modes.push((self.newest_us, mode));
        } else {
            self.undrawn += 1;
        }
    }

    fn mark(&mut self, text: String, grave: bool) {
        let repeated = self
            .marks
            .last()
            .is_some_and(|last| last.text == text && self.newest_us - last.time_us < REPEATED_US);
        if repeated {
            return;
        }
        if self.marks.len() < MAX_EVENTS {
            self.marks.push(Mark {
                time_us: self.newest_us,
                text,
                grave,
            });
        } else {
            self.undrawn += 1;
        }
    }
}

/// Repetitions of an event within this time count as one, us.
const REPEATED_US: u64 = 10_000;
