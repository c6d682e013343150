//! One sample of control: drive readings in, motor torques out.
//!
//! ```text
//! readings -> joints -> monitor -> state -> reference -> control law -> torque limits -> torques
//! ```
//!
//! There is one call, and it is total: every input gives an output. The work is bounded, nothing is allocated and no
//! clock is read: time is counted in samples.

mod manual;
mod motion;
mod parameters;
mod reports;
mod requests;
mod strain;
mod transitions;

use heapless::Deque;
use nalgebra::Vector4;
use protocol::messages::{
    Cause, Compensation, ControlWord, Emergency, Fault, LimitFlags, MotionReply, MotionRequest,
    Operation, Outcome, Refusal,
};
use protocol::parameters::ControllerParameter as Parameter;
use protocol::time::Period;
use serde::{Deserialize, Serialize};

use crate::control::burden::Burden;
use crate::control::chatter::Chatter;
use crate::control::heat::Heat;
use crate::control::laws::observer::MomentumObserver;
use crate::control::laws::{ControlInput, Memory, Motion};
use crate::control::limits;
use crate::control::monitor::{Felt, Monitor};
use crate::control::phase::{Phase, Probe};
use crate::control::readings::Readings;
use crate::control::setup::Setup;
use crate::control::stance::Stance;
use crate::control::states::State;
use crate::mechanics::arm::ArmModel;
use crate::mechanics::body::Body;
use crate::mechanics::dynamics::drive::Drive;
use crate::mechanics::math::clamp;
use crate::trajectory::queue::{CAPACITY, MoveQueue};
use crate::trajectory::{Reference, Setpoint};
use requests::Answer;
pub use strain::TURNS;

/// How often per sample its room for planning is used, at the most: once for each millisecond of its period; below 100 Hz, planning is no
/// faster than at 100 Hz.
const MAX_PLANNING_TURNS: f32 = 10.0;

/// Configuration, fixed at start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// The robot.
    pub arm: ArmModel,
    /// Sampling period.
    pub period: Period,
    /// Initial values of what can be changed at run time.
    pub setup: Setup,
}

impl Config {
    /// Bench settings for `arm`: computed torque with observer, sampled every `period`, on a bus of the default bit timing.
    pub fn new(arm: ArmModel, period: Period) -> Self {
        Self {
            period,
            setup: Setup::new(&arm, period.seconds()),
            arm,
        }
    }
}

/// What the drives are to do until the next command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Actions {
    /// Torque enable, brake, stop flags.
    pub control: ControlWord,
    /// Motor torques, N m.
    pub torque: [f32; 4],
}

/// The controller of one arm.
// The order keeps everything that every sample reads and writes within reach of one base register; the queue alone exceeds that reach.
#[derive(Clone, Debug)]
#[repr(C)]
pub struct Controller {
    /// Sampling period, s; fixed, like the arm.
    period: f32,
    /// Least corner of the observer, by which the arm is watched, rad/s.
    least_corner: f32,
    setup: Setup,
    body: Body,
    state: State,
    /// Samples that a gap in the feedback may span.
    max_gap: u32,
    /// How often per sample its room for planning is used.
    planning_turns: u8,
    /// Whether this sample follows no move.
    stands: bool,
    /// Limits that have acted since this was last taken.
    limits: LimitFlags,
    /// How the arm is operated.
    operation: Operation,
    /// Samples in a row in which the tool was too fast for manual operation.
    too_fast: u8,
    /// Samples for which moves are still held in it.
    held: u16,
    /// Share of its torques that the arm gets: they build up from enabling on.
    built_up: f32,
    /// Samples in a row in which the brake was not where it had to be by now: not closed without torque, or not open.
    misplaced: u32,
    /// First fault since the last reset.
    fault: Fault,
    /// Whether only the shaft is under torque until the brake has closed: shoulder or elbow has to be without.
    limp: bool,
    /// Where the lift is held meanwhile, m; along the path of the stop if it was not at rest.
    lift_held: Option<f32>,
    /// Whether it is known where the arm was in the last sample.
    is_placed: bool,
    /// Whether the drives have had torque since enabling.
    drives_on: bool,
    /// Samples in which an axis hardly moved at its torque limit, since the last move began.
    saturated: u32,
    /// Samples more than the drives have counted that have passed since the last one.
    missed: u32,
    /// Samples in a row in which an encoder did not move with its axis at its torque limit, those off the reference several times.
    stuck: u32,
    /// What the last sample followed, as handed to the law.
    setpoint: Setpoint,
    memory: Memory,
    observer: MomentumObserver,
    monitor: Monitor,
    heat: Heat,
    burden: Burden,
    chatter: Chatter,
    excess: Vector4<f32>,
    error: Vector4<f32>,
    /// Motor velocities in the last sample, rad/s.
    last_velocity: Vector4<f32>,
    arm: ArmModel,
    replies: Deque<MotionReply, { 2 * CAPACITY }>,
    unanswered: u16,
    /// Faults not reported to the peers yet, in their order. Of more than one stop can have, the first are enough.
    alarms: [Option<Emergency>; 3],
    stance: Stance,
    queue: MoveQueue,
}

impl Controller {
    /// A controller in self-test. The model should have passed [`ArmModel::validate`]; with one that
    /// has not, the controller never leaves self-test.
    // Out of line it is built in place; inlined it would take its size on the stack a second time.
    #[inline(never)]
    pub fn new(config: Config) -> Self {
        Self {
            // Of a model that has passed the self-test.
            body: Body::default(),
            arm: config.arm,
            period: config.period.seconds(),
            least_corner: Parameter::Observer.initial(config.period.seconds()),
            setup: config.setup,
            state: State::SelfTest,
            max_gap: config.setup.monitor.gap_samples(config.period.seconds()),
            planning_turns: clamp(config.period.seconds() * 1e3 + 0.5, 1.0, MAX_PLANNING_TURNS)
                as u8,
            stands: false,
            limits: LimitFlags::EMPTY,
            operation: Operation::Automatic,
            held: 0,
            built_up: 0.0,
            misplaced: 0,
            too_fast: 0,
            fault: Fault::NONE,
            limp: false,
            lift_held: None,
            is_placed: false,
            drives_on: false,
            saturated: 0,
            stuck: 0,
            missed: 0,
            queue: MoveQueue::new(),
            setpoint: Setpoint::rest(Vector4::zeros()),
            memory: Memory::new(),
            observer: MomentumObserver::new(),
            monitor: Monitor::new(&config.arm, &config.setup.monitor, config.period.seconds()),
            heat: Heat::new(),
            burden: Burden::new(),
            chatter: Chatter::new(),
            stance: Stance::new(),
            excess: Vector4::zeros(),
            error: Vector4::zeros(),
            last_velocity: Vector4::zeros(),
            replies: Deque::new(),
            unanswered: 0,
            alarms: [None; 3],
        }
    }

    /// Refuses a request without examining it further.
    pub fn refuse(&mut self, sequence: u8, refusal: Refusal) {
        self.reply(sequence, Outcome::Refused(refusal));
    }

    /// Accepts or refuses an operator's request. [`Controller::take_reply`] has the answer at once, or for a move once
    /// it has been planned.
    pub fn request(&mut self, sequence: u8, request: &MotionRequest) {
        match self.accept(sequence, request) {
            Ok(Answer::Now) => self.reply(sequence, Outcome::Accepted),
            Ok(Answer::WhenPlanned | Answer::Never) => {}
            Err(refusal) => self.reply(sequence, Outcome::Refused(refusal)),
        }
    }

    /// One sample. Worst case: one trajectory evaluation, one more look ahead and one control law. Planning is not part
    /// of it: call [`Controller::plan`] once the command is on its way.
    pub fn step<P: Probe>(&mut self, readings: &Readings, probe: &mut P) -> Actions {
        let drive = &self.body.drive;
        let q = drive.joint_angle(&drive.motor_angle_of_counts(&readings.counts));
        let qd = drive.joint_speed(&readings.velocity);
        let measured_torque = drive.joint_torque(&readings.torque);

        if readings.steps > 1 {
            self.bridge(readings.steps);
        }
        self.watch(readings, &q, &qd);
        self.wait(readings);
        if !self.state.is_powered() {
            self.watch_at_rest(readings, &q);
            // No torque: follow the arm, so that enabling starts at its present position.
            self.setpoint = Setpoint::rest(q);
            self.is_placed = true;
            self.queue.clear(&q);
            self.last_velocity = readings.velocity;
            self.error = Vector4::zeros();
            self.excess = Vector4::zeros();
            self.saturated = 0;
            self.chatter = Chatter::new();
            self.let_go();
            return self.act(Vector4::zeros());
        }
        let period = self.period;
        let lead = self.setup.command_delay + 0.5 * period;
        let before = begun(&self.setpoint.reference, period);
        self.advance(readings.steps.min(self.max_gap), lead);
        if self.limp {
            self.hold_lift();
        }
        if self.state.is_braking() || readings.steps > self.max_gap {
            // The brake holds: the load it carries must not be mistaken for a disturbance. Nor what has not been seen.
            self.unlearn();
        }
        let reference = &self.setpoint.reference;
        self.error = reference.q - q;

        let velocity_error = mean_velocity(&before, reference, readings.steps, period) - qd;
        let motion = Motion {
            q,
            qd,
            torque: measured_torque,
            setpoint: &self.setpoint,
            velocity_error,
            qd_ahead: self.setpoint.ahead.qd - velocity_error,
            lead,
            period,
            elapsed: period * readings.steps as f32,
            error: &self.error,
            excess: &self.excess,
        };
        let mut selection = &self.setup.selection;
        let lowered;
        if self.limp || self.operation == Operation::Manual {
            lowered = self.lowered();
            selection = &lowered;
        }
        let input = ControlInput {
            motion: &motion,
            geometry: &self.arm.geometry,
            body: &self.body,
        };
        probe.end(Phase::Reference);
        let output = selection.torque(&input, &mut self.memory);
        probe.end(Phase::Law);
        let corners = [selection.gains.observer, self.least_corner];
        self.observer.update(&self.body, &motion, &output, corners);
        let felt = self.observer.residual();
        if let Some(axis) = self.monitor.feels(felt)
            && !self.limp
        {
            let last_qd = last_qd(&self.body.drive, &self.last_velocity);
            let numbers = [&motion.qd, &last_qd, felt, &self.error, &reference.qd];
            let felt = self.monitor.felt(axis, readings, numbers);
            if felt != Felt::Nothing {
                return self.react(felt);
            }
        }
        let mut torque = output.torque;
        if self.limp {
            torque = of_shaft(torque);
        } else if selection.compensation == Compensation::Observer {
            torque -= self.observer.for_law();
        }
        probe.end(Phase::Observer);
        let limited = limits::cut(&self.arm, &self.body.drive, &torque);
        self.excess = limited.excess;
        if limited.flags != LimitFlags::EMPTY {
            if !torque.iter().all(|torque| torque.is_finite()) {
                // No finite input leads here; should it happen, close the brake.
                self.unlearn();
                self.fail(Fault::because(Cause::BadValue));
                return self.act(Vector4::zeros());
            }
            self.limits = self.limits | limited.flags;
            self.ease(&torque, &qd);
            self.strain(readings, &qd);
        } else {
            self.stuck = 0;
        }
        self.last_velocity = readings.velocity;
        self.chatter.keep(&limited.motor_torque);
        if self.operation == Operation::Manual {
            self.watch_tool(&q, &qd);
        }
        probe.end(Phase::Limits);
        self.act(limited.motor_torque)
    }

    /// What the drives are to do in this state, which may be another one than the torques were meant for: they have none that is not
    /// enabled in the same command.
    pub(super) fn act(&mut self, torque: Vector4<f32>) -> Actions {
        let control = self.control_word();
        let torque = if control.contains(ControlWord::TORQUE_ENABLE) {
            self.released(torque).into()
        } else {
            [0.0; 4]
        };
        Actions { control, torque }
    }

    /// What of these motor torques the drives may have: none for the arm where it has to be without; and from enabling on as much as builds up
    /// in half of the time of the brake, as a step of the load's weight would shake the arm.
    fn released(&mut self, torque: Vector4<f32>) -> Vector4<f32> {
        let torque = if self.limp { of_shaft(torque) } else { torque };
        if self.built_up >= 1.0 {
            return torque;
        }
        self.built_up += 2.0 * self.period / self.setup.brake_delay;
        torque * clamp(self.built_up, 0.0, 1.0)
    }

    /// Forgets what law and observer have gathered.
    fn unlearn(&mut self) {
        self.memory = Memory::new();
        self.observer = MomentumObserver::new();
    }

    fn reply(&mut self, sequence: u8, outcome: Outcome) {
        let reply = MotionReply { sequence, outcome };
        // The outbox has room for the replies to everything that can wait to be planned, and as many again.
        if self.replies.push_back(reply).is_err() {
            self.unanswered = self.unanswered.saturating_add(1);
        }
    }
}

/// Joint velocities at these motor velocities.
// Out of line, for the size of two copies that are rarely reached.
#[inline(never)]
fn last_qd(drive: &Drive, velocity: &Vector4<f32>) -> Vector4<f32> {
    drive.joint_speed(velocity)
}

/// Torques of joints or motors without those of the arm.
fn of_shaft(torque: Vector4<f32>) -> Vector4<f32> {
    Vector4::new(0.0, 0.0, torque.z, torque.w)
}

/// Mean velocity over the sample that ends at `reference`, exact for constant jerk since the one before, of which `before` is the
/// [part](begun).
fn mean_velocity(
    before: &Vector4<f32>,
    reference: &Reference,
    steps: u32,
    period: f32,
) -> Vector4<f32> {
    if steps > 1 {
        // That reference is older than the sample.
        return reference.qd - reference.qdd * (0.5 * period);
    }
    before + (0.5 * reference.qd - reference.qdd * (period / 12.0))
}

/// What a reference contributes to the mean velocity over the sample that begins with it.
fn begun(reference: &Reference, period: f32) -> Vector4<f32> {
    0.5 * reference.qd + reference.qdd * (period / 12.0)
}
