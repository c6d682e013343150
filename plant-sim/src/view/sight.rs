//! What frames say of the arm: positions, errors, efforts, and how busy the bus is.

use firmware::mechanics::arm::ArmModel;
use firmware::mechanics::dynamics::drive::Drive;
use nalgebra::Vector4;
use protocol::codec;
use protocol::messages::{Message, Mode};
use protocol::wire::{BitTiming, FrameBits};
use sim::model::RobotModel;
use trace::{Entry, Record};

/// Time between two moments, us.
const STEP_US: u64 = 10_000;

/// Numbers of a moment: time (s); positions (rad, m), reference minus measurement, efforts (N m, N), share of the time for
/// which the bus was busy, time from Feedback to Command (s), code of the state. What is not known is not a number, which
/// JSON writes as null.
pub(super) type Moment = (f64, [f32; 15]);

/// Gathers moments.
pub(super) struct Sight {
    drive: Drive,
    timing: BitTiming,
    joints: Option<Vector4<f32>>,
    error: [f32; 4],
    effort: [f32; 4],
    /// Sample of the newest feedback, and when it came, us.
    sampled: Option<(u32, u64)>,
    latency: f32,
    mode: Mode,
    busy_ns: u64,
    /// The last moment, us.
    last_us: Option<u64>,
    moments: Vec<Moment>,
}

impl Sight {
    /// Nothing seen yet of a robot like `model`, on a bus of this timing.
    pub(super) fn new(model: &RobotModel, timing: BitTiming) -> Self {
        Self {
            drive: Drive::new(&ArmModel::from(model).drive),
            timing,
            joints: None,
            error: [f32::NAN; 4],
            effort: [f32::NAN; 4],
            sampled: None,
            latency: f32::NAN,
            mode: Mode::Boot,
            busy_ns: 0,
            last_us: None,
            moments: Vec::new(),
        }
    }

    /// Joint positions of the newest feedback, rad and m.
    pub(super) fn joints(&self) -> Option<[f32; 4]> {
        self.joints.map(Into::into)
    }

    /// Moments since the last call.
    pub(super) fn moments(&mut self) -> Vec<Moment> {
        std::mem::take(&mut self.moments)
    }

    /// Takes the next record.
    pub(super) fn record(&mut self, record: &Record) {
        let Entry::Frame(frame) = &record.entry else {
            return;
        };
        self.busy_ns += self.timing.duration(FrameBits::exact(frame)).nanos();
        let Ok(received) = codec::decode(frame) else {
            return;
        };
        match received.message {
            Message::Feedback(feedback) => {
                let motors = self.drive.motor_angle_of_counts(&feedback.position);
                self.joints = Some(self.drive.joint_angle(&motors));
                self.sampled = Some((feedback.sample, record.time_us));
                self.moment(record.time_us);
            }
            Message::Command(command) => {
                self.effort = self.drive.joint_torque(&command.torque.into()).into();
                if let Some((sample, at)) = self.sampled
                    && sample == command.sample
                {
                    self.latency = record.time_us.saturating_sub(at) as f32 * 1e-6;
                }
            }
            Message::State(state) => {
                self.mode = state.mode;
                self.error = state.tracking_error;
            }
            _ => {}
        }
    }

    fn moment(&mut self, now_us: u64) {
        let last = *self.last_us.get_or_insert(now_us);
        let span = now_us.saturating_sub(last);
        if span < STEP_US {
            return;
        }
        let Some(joints) = self.joints else {
            return;
        };
        let load = self.busy_ns as f32 / (span as f32 * 1e3);
        let mut values = [0.0; 15];
        values[..4].copy_from_slice(joints.as_slice());
        values[4..8].copy_from_slice(&self.error);
        values[8..12].copy_from_slice(&self.effort);
        values[12..].copy_from_slice(&[load, self.latency, f32::from(self.mode.code())]);
        self.moments.push((now_us as f64 * 1e-6, values));
        self.last_us = Some(now_us);
        self.busy_ns = 0;
        self.latency = f32::NAN;
    }
}
