//! The drive side of the link: samples the plant into feedback, applies commands to it.
//!
//! It owns the sampling clock. A command acts when it arrives, not when it was due; one that does
//! not come leaves the last torque for [`HOLD_SAMPLES`], then the drives brake and let go.

use protocol::codec;
use protocol::e2e::{Profile, Receiver};
use protocol::frame::CanFrame;
use protocol::messages::{Command, ControlWord, DriveStatus, Feedback, Message};

use crate::model::RobotModel;
use crate::plant::Plant;

/// Samples for which the last command is held when none comes.
pub const HOLD_SAMPLES: u32 = 5;

/// What the drives do with the commands they get.
#[derive(Clone, Debug)]
pub struct Drives {
    sample: u32,
    counter: u8,
    commands: Receiver,
    /// Encoder counts of the last sample.
    previous: Option<[i32; 4]>,
    /// Radians a count, and the rated torques that feedback is scaled with.
    radians_per_count: f64,
    rated: [f64; 4],
    period: f64,
    saturated: bool,
    /// Sample that the last command echoed.
    answered: Option<u32>,
    control: ControlWord,
    late: u64,
    missing: u64,
    rejected: u64,
}

impl Drives {
    /// Drives of `model`, sampled every `period` s.
    pub fn new(model: &RobotModel, period: f64) -> Self {
        Self {
            sample: 0,
            counter: 0,
            commands: Receiver::new(Profile::Fd),
            previous: None,
            radians_per_count: std::f64::consts::TAU / f64::from(model.drive.encoder_counts),
            rated: model.drive.motor_torque_rated,
            period,
            saturated: false,
            answered: None,
            control: ControlWord::EMPTY,
            late: 0,
            missing: 0,
            rejected: 0,
        }
    }

    /// Samples the plant at its present time.
    pub fn feedback(&mut self, plant: &mut Plant) -> CanFrame {
        self.guard(plant);
        let reading = plant.latch();
        let before = self
            .previous
            .replace(reading.counts)
            .unwrap_or(reading.counts);
        let mut velocity = [0.0f32; 4];
        let mut torque = [0i16; 4];
        for axis in 0..4 {
            let counts = reading.counts[axis].wrapping_sub(before[axis]);
            velocity[axis] = (f64::from(counts) * self.radians_per_count / self.period) as f32;
            let per_mille = reading.motor_torque[axis] / self.rated[axis] * 1000.0;
            // `as` saturates: a drive reports its largest value, not a wrapped one.
            torque[axis] = per_mille.round() as i16;
        }
        let powered = self.control.contains(ControlWord::TORQUE_ENABLE);
        let feedback = Feedback {
            sample: self.sample,
            status: (DriveStatus::READY | DriveStatus::ENCODER_VALID)
                .with(DriveStatus::TORQUE_ON, powered)
                .with(DriveStatus::BRAKE_RELEASED, !plant.brake().is_closed())
                .with(DriveStatus::TORQUE_SATURATED, self.saturated),
            position: reading.counts,
            velocity,
            torque,
        };
        let counter = self.counter;
        self.counter = counter.wrapping_add(1);
        self.sample = self.sample.wrapping_add(1);
        codec::encode(&Message::Feedback(feedback), counter)
            .expect("encoder speeds and torques are finite and far inside the ranges")
    }

    /// Takes a command that has just arrived; anything else is counted or none of our business.
    pub fn receive(&mut self, frame: &CanFrame, plant: &mut Plant) {
        match codec::decode(frame) {
            Ok(received) => {
                if let Message::Command(command) = received.message {
                    if self.commands.judge(received.counter.unwrap_or(0)).is_new() {
                        self.apply(&command, plant);
                    } else {
                        self.rejected += 1;
                    }
                }
            }
            Err(_) => self.rejected += 1,
        }
    }

    fn apply(&mut self, command: &Command, plant: &mut Plant) {
        if command.sample.wrapping_add(1) != self.sample {
            self.late += 1;
        }
        self.answered = Some(command.sample);
        self.control = command.control;
        let saturated = plant.set_motor_torque(command.torque.map(f64::from));
        self.saturated = saturated.contains(&true);
        plant.set_torque_enabled(command.control.contains(ControlWord::TORQUE_ENABLE));
        plant.set_brake(!command.control.contains(ControlWord::BRAKE_RELEASE));
    }

    /// Lets go when commands stay away.
    fn guard(&mut self, plant: &mut Plant) {
        let Some(answered) = self.answered else {
            return;
        };
        let age = self.sample.wrapping_sub(answered).wrapping_sub(1);
        if age > 0 {
            self.missing += 1;
        }
        if age > HOLD_SAMPLES {
            plant.set_brake(true);
            plant.set_torque_enabled(false);
            self.control = ControlWord::EMPTY;
            self.commands.reset();
        }
    }

    /// Samples since the last command, 0 before the first.
    pub fn silent(&self) -> u64 {
        self.answered
            .map_or(0, |answered| u64::from(self.sample.wrapping_sub(answered)))
    }

    /// Samples for which no command had come when the next sample was taken.
    pub fn overruns(&self) -> u64 {
        self.missing
    }

    /// Commands that answered an older sample than the newest.
    pub fn late(&self) -> u64 {
        self.late
    }

    /// Frames refused.
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Whether the last command asked for more torque than the drives can give.
    pub fn is_saturated(&self) -> bool {
        self.saturated
    }
}
