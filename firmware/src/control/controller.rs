//! One sample of control: drive readings in, motor torques out.
//!
//! ```text
//! readings -> joints -> monitor -> mode -> reference -> control law -> torque limits -> torques
//! ```
//!
//! There is one call and it is total: every input gives an output, the work is bounded, nothing
//! is allocated and no clock is read. Time is the number of samples.

mod modes;
mod motion;
mod requests;

use heapless::Deque;
use nalgebra::Vector4;
use protocol::messages::{
    Cause, Compensation, ControlWord, DriveStatus, Law, Mode, MotionReply, MotionRequest, Outcome,
    Refusal,
};
use serde::{Deserialize, Serialize};

use crate::control::laws::{Gains, Memory, Model, Motion, Selection, Situation, Task};
use crate::control::limits;
use crate::control::mode::{self, Event};
use crate::control::monitor::{Finding, Monitor, MonitorLimits};
use crate::control::phase::{Phase, Probe};
use crate::mechanics::arm::{ArmModel, Payload};
use crate::mechanics::body::Body;
use crate::mechanics::kinematics::Trig;
use crate::mechanics::math::clamp;
use crate::trajectory::Reference;
use crate::trajectory::queue::{CAPACITY, MoveQueue};
use requests::Answer;

/// Samples that a gap in the feedback may span before the arm is stopped.
pub const MAX_GAP: u32 = 5;

/// Everything a controller is told before it starts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// The robot.
    pub arm: ArmModel,
    /// What the flange carries at the start.
    pub payload: Payload,
    /// Control law at the start.
    pub selection: Selection,
    /// Sampling period, s.
    pub period: f32,
    /// Time from a sample until its command acts at the drives, s.
    pub command_delay: f32,
    /// Time the brake takes to open or close, s.
    pub brake_delay: f32,
    /// What stops the arm.
    pub monitor: MonitorLimits,
}

impl Config {
    /// Bench settings for `arm`: computed torque with observer, sampled every `period` seconds.
    pub fn new(arm: ArmModel, period: f32) -> Self {
        Self {
            arm,
            payload: Payload::NONE,
            selection: Selection {
                law: Law::ComputedTorqueJoint,
                compensation: Compensation::Observer,
                gains: Gains::for_period(period),
            },
            period,
            command_delay: 0.25e-3,
            brake_delay: 0.06,
            monitor: MonitorLimits::DEFAULT,
        }
    }
}

/// Drive readings of one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Readings {
    /// Samples since the last readings: 1, or more where feedback was lost.
    pub steps: u32,
    /// State of the drives.
    pub status: DriveStatus,
    /// Motor encoder counts.
    pub counts: [i32; 4],
    /// Motor speeds, rad/s, means over the last sample.
    pub speed: Vector4<f32>,
    /// Motor torques, N m, means over the last sample.
    pub torque: Vector4<f32>,
}

/// What the drives are to do until the next command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Actions {
    /// Torque enable, brake, stop flags.
    pub control: ControlWord,
    /// Motor torques, N m.
    pub torque: [f32; 4],
}

/// Progress of switching off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shutdown {
    /// Coming to rest on the path.
    Stopping,
    /// The brake closes; torque still holds the arm. Samples left.
    Closing(u32),
    /// Torque is off.
    Off,
}

/// The controller of one arm.
// In this order all that a sample looks at lies within reach of one base register; the queue is longer than that.
#[derive(Clone, Debug)]
#[repr(C)]
pub struct Controller {
    config: Config,
    body: Body,
    mode: Mode,
    cause: Cause,
    alarm: Option<Finding>,
    /// Samples until the brake has opened.
    opening: u32,
    shutdown: Shutdown,
    /// Planning steps a sample.
    planning_steps: u8,
    /// The reference of the last sample, as handed to the law.
    reference: Reference,
    memory: Memory,
    monitor: Monitor,
    excess: Vector4<f32>,
    limited: u16,
    error: Vector4<f32>,
    replies: Deque<MotionReply, { 2 * CAPACITY }>,
    unanswered: u16,
    queue: MoveQueue,
}

impl Controller {
    /// A controller in self-test. The model should have passed [`ArmModel::validate`]; one that
    /// has not never leaves self-test.
    // Out of line it is built in place; inlined it would take its own size once more on the stack.
    #[inline(never)]
    pub fn new(config: Config) -> Self {
        Self {
            body: Body::new(&config.arm, &config.payload),
            config,
            mode: Mode::SelfTest,
            cause: Cause::None,
            alarm: None,
            opening: 0,
            shutdown: Shutdown::Off,
            queue: MoveQueue::new(),
            planning_steps: clamp(config.period * 1e3 + 0.5, 1.0, 10.0) as u8,
            reference: Reference::rest(Vector4::zeros()),
            memory: Memory::new(),
            monitor: Monitor::new(&config.arm, &config.monitor),
            excess: Vector4::zeros(),
            limited: 0,
            error: Vector4::zeros(),
            replies: Deque::new(),
            unanswered: 0,
        }
    }

    /// State of the cabinet.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Latched cause of the last fault.
    pub fn cause(&self) -> Cause {
        self.cause
    }

    /// A fault that the peers have not been told of; each is handed out once.
    pub fn take_alarm(&mut self) -> Option<Finding> {
        self.alarm.take()
    }

    /// The robot.
    pub fn arm(&self) -> &ArmModel {
        &self.config.arm
    }

    /// Law, compensation and gains in use.
    pub fn selection(&self) -> &Selection {
        &self.config.selection
    }

    /// Reference of the last sample.
    pub fn reference(&self) -> &Reference {
        &self.reference
    }

    /// Reference minus measured position of the last sample.
    pub fn following_error(&self) -> &Vector4<f32> {
        &self.error
    }

    /// Bit i: axis i was at its torque limit in the last sample.
    pub fn limited(&self) -> u16 {
        self.limited
    }

    /// Moves planned or waiting.
    pub fn queued(&self) -> u8 {
        self.queue.len()
    }

    /// Whether a move is being planned: what makes a sample expensive.
    pub fn is_planning(&self) -> bool {
        self.queue.is_planning()
    }

    /// Number of the last move that was completed.
    pub fn completed(&self) -> u8 {
        self.queue.completed()
    }

    /// Answers that are due.
    pub fn answers_waiting(&self) -> usize {
        self.replies.len()
    }

    /// Requests that got no answer, since too many others waited for theirs.
    pub fn unanswered(&self) -> u16 {
        self.unanswered
    }

    /// An answer to an operator that is due.
    pub fn take_reply(&mut self) -> Option<MotionReply> {
        self.replies.pop_front()
    }

    /// Something happened outside: self-test passed, peer found or lost, emergency stop.
    pub fn event(&mut self, event: Event, cause: Cause) {
        if event == Event::PeerLost {
            // Nothing can be brought to rest any more, not even in an emergency stop.
            self.shutdown = Shutdown::Off;
        }
        let Some(next) = mode::transition(self.mode, event) else {
            return;
        };
        if cause != Cause::None {
            self.latch(cause);
        }
        let was_powered = mode::is_powered(self.mode) || self.shutdown != Shutdown::Off;
        self.enter(next, was_powered);
    }

    /// Keeps the first cause until a reset, and has it reported.
    pub fn latch(&mut self, cause: Cause) {
        if self.cause == Cause::None {
            self.cause = cause;
            self.alarm.get_or_insert(Finding {
                cause,
                axis: None,
                value: 0.0,
            });
        }
    }

    /// Answers a request without looking at it further.
    pub fn refuse(&mut self, sequence: u8, refusal: Refusal) {
        self.reply(sequence, Outcome::Refused(refusal));
    }

    /// Takes an operator's request. Answers follow by [`Controller::take_reply`]: at once, or for
    /// a move when it has been planned.
    pub fn request(&mut self, sequence: u8, request: &MotionRequest) {
        match self.judge(sequence, request) {
            Ok(Answer::Now) => self.reply(sequence, Outcome::Accepted),
            Ok(Answer::WhenPlanned) => {}
            Err(refusal) => self.reply(sequence, Outcome::Refused(refusal)),
        }
    }

    /// One sample. Worst case: one trajectory evaluation and one control law. Planning is not part
    /// of it: [`Controller::plan`] follows when the command is on its way.
    pub fn step<P: Probe>(&mut self, readings: &Readings, probe: &mut P) -> Actions {
        let drive = &self.body.drive;
        let q = drive.joint_angle(&drive.motor_angle_of_counts(&readings.counts));
        let qd = drive.joint_speed(&readings.speed);
        let measured_torque = drive.joint_torque(&readings.torque);

        if readings.steps > MAX_GAP {
            self.fail(Finding {
                cause: Cause::FeedbackLost,
                axis: None,
                value: readings.steps as f32,
            });
        }
        self.watch(readings.status, &q, &qd);
        self.count_brake(readings.steps);
        if !self.is_holding() {
            // No torque: follow the arm, so that switching on starts where it stands.
            self.reference = Reference::rest(q);
            self.queue.clear(&q);
            self.error = Vector4::zeros();
            self.limited = 0;
            self.excess = Vector4::zeros();
            return Actions {
                control: self.control_word(),
                torque: [0.0; 4],
            };
        }
        self.reference = self.advance(readings.steps.min(MAX_GAP));
        let reference = &self.reference;
        let lead = self.config.command_delay + 0.5 * self.config.period;
        self.error = reference.q - q;

        let period = self.config.period;
        let motion = Motion {
            q,
            qd,
            torque: measured_torque,
            reference,
            mean_qd: mean_velocity(reference, period),
            ahead_qd: reference.qd + reference.qdd * lead + reference.qddd * (0.5 * lead * lead),
            ahead_qdd: reference.qdd + reference.qddd * lead,
            period,
            excess: self.excess,
        };
        probe.end(Phase::Reference);
        let trig = Trig::new(&q);
        let task = Task::new(&self.config.arm.geometry, &trig, &motion);
        probe.end(Phase::Kinematics);
        let model = Model::new(&self.body, &trig, &motion);
        probe.end(Phase::Dynamics);
        let situation = Situation {
            motion: &motion,
            task: &task,
            model: &model,
            nominal_inertia: &self.body.nominal_inertia,
        };
        if self.mode == Mode::Enabling || matches!(self.shutdown, Shutdown::Closing(_)) {
            // The brake holds: what it carries must not be taken for a disturbance.
            self.memory = Memory::new();
        }
        let mut torque = self.config.selection.torque(&situation, &mut self.memory);
        if !torque.iter().all(|torque| torque.is_finite()) {
            // Nothing finite that comes in leads here; should it happen, the brake is the answer.
            self.memory = Memory::new();
            torque = Vector4::zeros();
            self.fail(Finding {
                cause: Cause::BadValue,
                axis: None,
                value: 0.0,
            });
        }
        probe.end(Phase::Law);
        let limited = limits::cut(&self.config.arm, &self.body.drive, &torque);
        self.excess = limited.excess;
        self.limited = limited.flags;
        probe.end(Phase::Limits);
        Actions {
            control: self.control_word(),
            torque: limited.motor_torque.into(),
        }
    }

    fn reply(&mut self, sequence: u8, outcome: Outcome) {
        let reply = MotionReply { sequence, outcome };
        // The outbox holds an answer to everything that can wait to be planned, and as many again.
        if self.replies.push_back(reply).is_err() {
            self.unanswered = self.unanswered.saturating_add(1);
        }
    }
}

/// Mean velocity over the sample that ends at `reference`, exact for constant jerk.
fn mean_velocity(reference: &Reference, period: f32) -> Vector4<f32> {
    reference.qd - reference.qdd * (0.5 * period) + reference.qddd * (period * period / 6.0)
}
