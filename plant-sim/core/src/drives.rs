//! The drive side of the link: samples the plant into feedback and applies commands to it.
//!
//! It owns the sampling clock. A command acts when it arrives, not when it was due. Without a new one the last torque is held
//! for [`hold_samples`], then the drives brake and switch torque off. A command that answers an older sample is none. Once off
//! for want of commands, they take torque only to stop the arm while their brake closes, and then none until a command has let
//! go of it: one that was on its way knows nothing of that, and an arm that stands is not to move again.

mod settings;

use protocol::codec::{self, Encoder};
use protocol::e2e::{Profile, Receiver, Verdict};
use protocol::frame::CanFrame;
use protocol::messages::{
    Cause, Command, ControlWord, DriveStatus, Feedback, Heartbeat, Message, Mode, NmtCommand, Node,
    ParameterError, ParameterReply, ParameterRequest, ResetReason, Server,
};
use protocol::parameters::{self, DriveParameter};
use protocol::table;
use protocol::time::{Duration, Instant, Period};

use crate::heart::Heart;
use crate::model::{DriveTrain, RobotModel};
use crate::peer::{Outbox, Peer, PeerError};
use crate::plant::Plant;
use crate::world::World;
use settings::Settings;

/// Default number of samples of this period (s) for which the last command is held without a new one.
pub fn hold_samples(period: f32) -> u32 {
    DriveParameter::HoldSamples.initial(period) as u32
}

/// Age from which on the sample that a command answers makes it late: a feedback of 2 ms before is old.
const LATE: Duration = Duration::from_millis(2);

/// The drives.
#[derive(Clone, Debug)]
pub struct Drives {
    sample: u32,
    /// Time of the next sample.
    next: Instant,
    heart: Heart,
    /// Why they started.
    reset: ResetReason,
    encoder: Encoder,
    commands: Receiver,
    requests: Receiver,
    settings: Settings,
    /// Whether the last command exceeded the torque limit that is set.
    cut: bool,
    /// Encoder counts of the last sample.
    previous: Option<[i32; 4]>,
    train: DriveTrain,
    period: Period,
    /// Sample that the last command echoed.
    answered: Option<u32>,
    /// Time of that command.
    commanded: Instant,
    control: ControlWord,
    /// Whether that command was late.
    late: bool,
    /// Whether they have switched off by themselves, and no command has let go of torque since.
    let_down: bool,
}

impl Drives {
    /// Drives of `model`, sampled every `period`.
    pub fn new(model: &RobotModel, period: Period) -> Self {
        Self::started(model.drive, period, Instant::ORIGIN, ResetReason::PowerOn)
    }

    /// Drives that have just been switched on.
    fn started(train: DriveTrain, period: Period, next: Instant, reset: ResetReason) -> Self {
        Self {
            sample: 0,
            next,
            heart: Heart::new(next, period),
            reset,
            encoder: Encoder::default(),
            commands: Receiver::new(Profile::Fd),
            requests: Receiver::new(Profile::Fd),
            settings: Settings::new(&train, period),
            cut: false,
            previous: None,
            train,
            period,
            answered: None,
            commanded: Instant::ORIGIN,
            control: ControlWord::EMPTY,
            late: false,
            let_down: false,
        }
    }

    /// Samples the plant at its present time.
    fn feedback(&mut self, plant: &mut Plant) -> CanFrame {
        self.guard(plant);
        let reading = plant.latch();
        let before = self
            .previous
            .replace(reading.counts)
            .unwrap_or(reading.counts);
        let period = self.period.duration().seconds();
        let radians_per_count = std::f64::consts::TAU / f64::from(self.train.encoder_counts);
        let mut velocity = [0.0f32; 4];
        let mut torque = [0i16; 4];
        for axis in 0..4 {
            let counts = reading.counts[axis].wrapping_sub(before[axis]);
            // What a broken encoder makes of it, no motor reaches: a drive reports its greatest value.
            velocity[axis] = ((f64::from(counts) * radians_per_count / period) as f32)
                .clamp(-Feedback::MAX_VELOCITY, Feedback::MAX_VELOCITY);
            let per_mille =
                reading.motor_torque[axis] / self.train.motor_torque_rated[axis] * 1000.0;
            // `as` saturates, for the same reason.
            torque[axis] = per_mille.round() as i16;
        }
        let powered = self.control.contains(ControlWord::TORQUE_ENABLE);
        let feedback = Feedback {
            sample: self.sample,
            status: (DriveStatus::READY | DriveStatus::ENCODER_VALID)
                .with(DriveStatus::FAULT, plant.has_dip())
                .with(DriveStatus::TORQUE_ON, powered)
                .with(DriveStatus::BRAKE_RELEASED, !plant.brake().is_closed())
                .with(DriveStatus::COMMAND_LATE, self.late)
                .with(
                    DriveStatus::TORQUE_SATURATED,
                    self.cut || plant.is_saturated(),
                ),
            position: reading.counts,
            velocity,
            torque,
        };
        self.sample = self.sample.wrapping_add(1);
        self.encoder
            .encode(&Message::Feedback(feedback))
            .expect("encoder speeds and torques are finite and inside the ranges")
    }

    /// Gives a sign of life if it is due.
    fn beat(&mut self, now: Instant, plant: &Plant, out: &mut Outbox) {
        let (state, cause) = if plant.has_dip() {
            (Mode::Fault, Cause::DriveFault)
        } else if self.control.contains(ControlWord::TORQUE_ENABLE) {
            (Mode::Enabled, Cause::None)
        } else {
            (Mode::Ready, Cause::None)
        };
        let heartbeat = Heartbeat {
            state,
            cause,
            reset: self.reset,
        };
        let encoder = &mut self.encoder;
        self.heart
            .beat(now, (Node::Drives, heartbeat), encoder, out);
    }

    /// Takes a command that has just arrived. A damaged or old one is ignored.
    fn receive(&mut self, now: Instant, frame: &CanFrame, plant: &mut Plant) {
        if let Ok(received) = codec::decode(frame)
            && let Message::Command(command) = received.message
            && self.age(command.sample) <= self.settings.hold_samples()
            && self.commands.check(received.counter.unwrap_or(0)).is_new()
        {
            self.commanded = now;
            // Whole samples by which it has missed its own; at a low rate it is late from the first one on.
            let missed = self.age(command.sample);
            self.late = missed > 0 && self.period.duration() * missed >= LATE;
            self.apply(&command, plant);
        }
    }

    /// Answers a request of the controller, unless it is damaged or old. A new value takes effect from the next command
    /// or sample on.
    fn answer(&mut self, frame: &CanFrame) -> Option<CanFrame> {
        let received = codec::decode(frame).ok()?;
        let Message::ParameterRequest(Server::Drives, request) = received.message else {
            return None;
        };
        let verdict = self.requests.check(received.counter.unwrap_or(0));
        if !verdict.is_new() {
            return None;
        }
        self.settings.at_rest = !self.control.contains(ControlWord::TORQUE_ENABLE);
        let reply = match request {
            // The first frame may be a replay: it must not change anything.
            ParameterRequest::Set { index, .. } if verdict == Verdict::Initial => {
                ParameterReply::Error {
                    index,
                    error: ParameterError::NotNow,
                    limit: 0.0,
                }
            }
            _ => parameters::serve(&mut self.settings, &request)
                .unwrap_or(ParameterReply::Hello(table::HELLO)),
        };
        let message = Message::ParameterReply(Server::Drives, reply);
        let frame = self.encoder.encode(&message);
        Some(frame.expect("parameters and their bounds are finite"))
    }

    fn apply(&mut self, command: &Command, plant: &mut Plant) {
        self.answered = Some(command.sample);
        let (torque, release) = (ControlWord::TORQUE_ENABLE, ControlWord::BRAKE_RELEASE);
        self.let_down &= command.control.contains(torque);
        let stops =
            command.control.contains(ControlWord::QUICK_STOP) || !command.control.contains(release);
        self.control = if self.let_down && (!stops || plant.brake().is_closed()) {
            ControlWord::EMPTY
        } else {
            command.control
        };
        let motor_torque = self.settings.cut(command.torque);
        self.cut = motor_torque != command.torque.map(f64::from);
        plant.set_motor_torque(motor_torque);
        plant.set_torque_enabled(self.control.contains(torque));
        plant.set_brake(!self.control.contains(release));
    }

    /// Network management: a reset is what switching on is, but for the beat of the samples.
    fn manage(&mut self, frame: &CanFrame, plant: &mut Plant) {
        if let Ok(received) = codec::decode(frame)
            && let Message::Nmt(nmt) = received.message
            && nmt.command == NmtCommand::ResetNode
            && [0, Node::Drives.code()].contains(&nmt.node)
        {
            plant.set_brake(true);
            plant.set_torque_enabled(false);
            *self = Self::started(self.train, self.period, self.next, ResetReason::Software);
        }
    }

    /// Samples since the one after `sample`.
    fn age(&self, sample: u32) -> u32 {
        self.sample.wrapping_sub(sample).wrapping_sub(1)
    }

    /// Brakes and switches torque off when commands stop arriving.
    fn guard(&mut self, plant: &mut Plant) {
        let Some(answered) = self.answered else {
            return;
        };
        if self.age(answered) > self.settings.hold_samples() {
            self.let_go(plant);
        }
    }

    /// The same by a clock of its own, when that of the samples stands still.
    fn watchdog(&mut self, now: Instant, plant: &mut Plant) {
        let held = self.period.duration() * (self.settings.hold_samples() + 1);
        if self.answered.is_some() && now.since(self.commanded) > held {
            plant.advance_to(now.nanos());
            self.let_go(plant);
        }
    }

    fn let_go(&mut self, plant: &mut Plant) {
        self.let_down |= self.control.contains(ControlWord::TORQUE_ENABLE);
        plant.set_brake(true);
        plant.set_torque_enabled(false);
        self.control = ControlWord::EMPTY;
        self.late = false;
        self.commands.reset();
        self.requests.reset();
    }
}

impl Peer for Drives {
    fn wake(&self) -> Option<Instant> {
        Some(self.next)
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        let World {
            plant,
            clock,
            sample,
            ..
        } = world;
        match received {
            None => {
                let period = self.period.duration();
                self.beat(now, plant, out);
                self.next = now + clock.tick(period);
                if clock.misses() {
                    self.watchdog(now, plant);
                } else {
                    plant.advance_to(now.nanos());
                    *sample = Some(self.sample);
                    out.push((now, self.feedback(plant)));
                }
            }
            Some(frame) if table::COMMAND.identifies(frame) => {
                plant.advance_to(now.nanos());
                self.receive(now, frame, plant);
            }
            Some(frame) if table::DRIVES_PARAMETER_REQUEST.identifies(frame) => {
                out.extend(self.answer(frame).map(|answer| (now, answer)));
            }
            Some(frame) if table::NMT.identifies(frame) => self.manage(frame, plant),
            Some(_) => {}
        }
        Ok(())
    }
}
