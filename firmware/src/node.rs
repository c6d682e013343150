//! The controller on the bus: frames in, one control sample when feedback arrives, frames out.
//!
//! Frame arrival drives the control; a timer only supervises. [`Node::poll`] is called with each frame that has
//! arrived, and without one when none arrives for some samples. Only feedback advances the control; the time passed in
//! only ages the feedback. So lock-step, a virtual bus in real time and a real bus all run the same code path.

mod parameters;
mod peers;
mod report;
mod shell;

use nalgebra::Vector4;
use protocol::bus::Transmit;
use protocol::codec::{self, Encoder};
use protocol::counters::Counters;
use protocol::e2e::{Profile, Receiver, Verdict};
use protocol::frame::CanFrame;
use protocol::messages::{
    Cause, Command, DriveStatus, Fault, Feedback, Message, Mode, Motion, MotionRequest, NmtCommand,
    Node as Name, ParameterReply, Refusal, RefusalReason, ResetReason, Server,
};
use protocol::time::{Duration, Instant};

use crate::control::controller::{Config, Controller, TURNS};
use crate::control::fault::{FLOOD, PEER_TIMEOUT_MS};
use crate::control::phase::{Phase, Probe};
use crate::control::readings::Readings;
use crate::control::self_test;
use crate::control::states::Event;
use peers::Pulse;

/// Default age of the feedback at which the drives count as silent: torque off, brake.
pub const PEER_TIMEOUT: Duration = Duration::from_millis(PEER_TIMEOUT_MS as u64);
/// Samples that a feedback can be ahead of the last one: the default of that age at the greatest rate, 10 kHz.
const FARTHEST: u32 = 10 * PEER_TIMEOUT_MS;
/// Answers that may wait for the sample in ten in which planning pauses; with more, reports are sent in spite of planning. Two leave room in the
/// outbox for a request in every sample until then.
const MAX_ANSWERS_WAITING: usize = 2;

/// A controller with its place on the bus.
#[derive(Clone, Debug)]
pub struct Node {
    controller: Controller,
    feedback: Receiver,
    motion: Receiver,
    parameter: Receiver,
    drives_parameter: Receiver,
    drives: Pulse,
    operator: Pulse,
    encoder: Encoder,
    received: Counters,
    unsent: u16,
    bad_feedback: u8,
    /// Samples in a row in which the drives have had a late command.
    late: u8,
    /// Frames since the newest feedback that are no message, saturating.
    strangers: u16,
    /// So many of a flood that has ended, for some more feedbacks, or 0.
    flood: u16,
    flood_fades: u8,
    /// Sample number and arrival of the newest feedback.
    newest: Option<(u32, Instant)>,
    /// Number of samples answered.
    samples: u32,
    /// Whether the operator was built from the same message table, once it has greeted.
    same_schema: Option<bool>,
    overruns: u16,
    /// Samples in a row that took too long, and the number of the last one.
    overruns_in_a_row: u8,
    overrun: u32,
    worst_tick: u32,
    /// Why the node was started, and whether network management has requested a reset.
    reset: ResetReason,
    reset_asked: bool,
    next_state: Instant,
    next_heartbeat: Instant,
}

impl Node {
    /// A node in self-test, started for this reason.
    // Out of line it is built in place; inlined it would take its size on the stack a second time.
    #[inline(never)]
    pub fn new(config: Config, reset: ResetReason) -> Self {
        Self {
            controller: Controller::new(config),
            feedback: Receiver::new(Profile::Fd),
            motion: Receiver::new(Profile::Fd),
            parameter: Receiver::new(Profile::Fd),
            drives_parameter: Receiver::new(Profile::Fd),
            drives: Pulse::new(),
            operator: Pulse::new(),
            encoder: Encoder::default(),
            received: Counters::default(),
            unsent: 0,
            bad_feedback: 0,
            late: 0,
            strangers: 0,
            flood: 0,
            flood_fades: 0,
            newest: None,
            samples: 0,
            same_schema: None,
            overruns: 0,
            overruns_in_a_row: 0,
            overrun: 0,
            worst_tick: 0,
            reset,
            reset_asked: false,
            next_state: Instant::ORIGIN,
            next_heartbeat: Instant::ORIGIN,
        }
    }

    /// The controller, read-only.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// Frames received but not used so far, by cause.
    pub fn received(&self) -> &Counters {
        &self.received
    }

    /// Frames that could not be sent so far, including answers to a flood of requests.
    pub fn unsent(&self) -> u16 {
        self.unsent.saturating_add(self.controller.unanswered())
    }

    /// Processes the frame that has arrived, if any, and sends whatever is due to `bus`. `now` must never run
    /// backwards; its origin does not matter.
    pub fn poll<B: Transmit>(&mut self, now: Instant, received: Option<&CanFrame>, bus: &mut B) {
        self.poll_with(now, received, bus, &mut ());
    }

    /// Like [`Node::poll`], with a probe that measures the phases.
    pub fn poll_with<B: Transmit, P: Probe>(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        bus: &mut B,
        probe: &mut P,
    ) {
        if self.controller.mode() == Mode::SelfTest {
            match self_test::run(self.controller.arm()) {
                Ok(()) => {
                    self.controller.event(Event::SelfTestPassed);
                }
                Err(answer) => self.controller.fail(Fault::value(
                    Cause::SelfTest,
                    f32::from(answer.code()),
                    0.0,
                )),
            }
        }
        let mut planned = false;
        if let Some(frame) = received {
            // By reference: taken out of the result, the message would be copied.
            match &codec::decode(frame) {
                Ok(received) => {
                    planned = self.take(&received.message, received.counter, now, bus, probe);
                }
                Err(error) => self.reject(error, frame),
            }
            if self.reset_asked {
                return;
            }
        }
        probe.end(Phase::Decode);
        self.guard(now);
        // Not in the same call as planning, so that no call does both, unless an operator sends requests so fast that
        // the answers pile up.
        if !planned || self.controller.answers_waiting() > MAX_ANSWERS_WAITING {
            self.report(now, bus);
        }
        probe.end(Phase::Report);
    }

    /// Acts on a message; returns whether that included planning.
    fn take<B: Transmit, P: Probe>(
        &mut self,
        message: &Message,
        counter: Option<u8>,
        now: Instant,
        bus: &mut B,
        probe: &mut P,
    ) -> bool {
        let counter = counter.unwrap_or(0);
        match message {
            Message::Feedback(feedback) => {
                let verdict = self.judge(feedback, counter);
                if self.accept(verdict) {
                    self.bad_feedback = 0;
                    return self.sample(feedback, now, bus, probe);
                }
                if self.has_let_go(feedback.status) {
                    self.suspect(Cause::DriveFault, Some(feedback.status));
                } else {
                    self.suspect(Cause::Reordered, None);
                }
            }
            Message::Motion(motion) => {
                let verdict = self.motion.check(counter);
                if self.accept(verdict) {
                    self.motion(motion, verdict);
                }
            }
            Message::EStop(_) => self.controller.fail(Fault::because(Cause::EStop)),
            Message::ParameterRequest(Server::Controller, request) => {
                let verdict = self.parameter.check(counter);
                if self.accept(verdict) {
                    self.parameter(request, verdict, bus);
                }
            }
            Message::ParameterReply(Server::Drives, reply) => {
                let verdict = self.drives_parameter.check(counter);
                // Hello concerns direct peers only.
                if self.accept(verdict) && !matches!(reply, ParameterReply::Hello(_)) {
                    self.reply_parameter(*reply, bus);
                }
            }
            Message::Nmt(nmt) => {
                let for_us = nmt.node == 0 || nmt.node == Name::Controller.code();
                self.reset_asked |= for_us && nmt.command == NmtCommand::ResetNode;
            }
            Message::Command(_)
            | Message::State(_)
            | Message::MotionReply(_)
            | Message::ParameterRequest(Server::Drives, _)
            | Message::ParameterReply(Server::Controller, _)
            | Message::Emergency(Name::Controller, _)
            | Message::Heartbeat(Name::Controller, _) => self.meet(message),
            // Messages between other nodes.
            Message::Heartbeat(name, _) => self.hear(*name, counter),
            Message::Emergency(..) => {}
        }
        false
    }

    /// Judges the place of a feedback. As long as there is torque, one whose sample is not new is old whatever its counter says, half a turn
    /// of that late or sent by another node, and must not take the place of the next one. Nor may one from so far ahead that the feedback
    /// would have been missed long before: all that follow would be old.
    #[inline(always)]
    fn judge(&mut self, feedback: &Feedback, counter: u8) -> Verdict {
        if let Some((last, _)) = self.newest
            && self.controller.state().is_powered()
        {
            match feedback.sample.wrapping_sub(last) {
                0 => return Verdict::Duplicate,
                1..=FARTHEST => {}
                _ => return Verdict::Stale(1),
            }
        }
        self.feedback.check(counter)
    }

    /// One control sample: the only place where the control advances. Returns whether planning took a step.
    fn sample<B: Transmit, P: Probe>(
        &mut self,
        feedback: &Feedback,
        now: Instant,
        bus: &mut B,
        probe: &mut P,
    ) -> bool {
        probe.end(Phase::Decode);
        let steps = match self.newest {
            None => 1,
            Some((last, _)) => feedback.sample.wrapping_sub(last).max(1),
        };
        let steps = steps.saturating_add(self.controller.take_missed());
        self.newest = Some((feedback.sample, now));
        if self.strangers.max(self.flood) >= FLOOD {
            self.feel_flood(steps, feedback.status);
        }
        self.strangers = 0;
        if feedback.status.contains(DriveStatus::COMMAND_LATE) {
            self.come_late();
        } else {
            self.late = 0;
        }
        if self.controller.mode() == Mode::PreOperational && self.may_be_ready(feedback.status) {
            self.controller.event(Event::PeerReady);
        }
        let rated = self.controller.arm().drive.motor_torque_rated * 1e-3;
        let [t1, t2, t3, t4] = feedback.torque.map(f32::from);
        let readings = Readings {
            steps,
            status: feedback.status,
            counts: feedback.position,
            velocity: Vector4::from(feedback.velocity),
            torque: Vector4::new(t1, t2, t3, t4).component_mul(&rated),
        };
        let actions = self.controller.step(&readings, probe);
        let command = Command {
            sample: feedback.sample,
            control: actions.control,
            torque: actions.torque,
        };
        self.send(&Message::Command(command), bus);
        probe.end(Phase::Encode);
        // Now that the command is on its way. By sample count and not by time, so that the same
        // feedback gives the same torques whenever it arrives.
        self.samples = self.samples.wrapping_add(1);
        let turn = self.samples % TURNS;
        let planned = if turn == 0 {
            self.listen(feedback.sample);
            self.controller.look();
            false
        } else {
            self.controller.plan_or_watch(&readings, turn)
        };
        probe.end(Phase::Planning);
        planned
    }

    fn motion(&mut self, motion: &Motion, verdict: Verdict) {
        let edge = matches!(
            motion.request,
            MotionRequest::Enable | MotionRequest::FaultReset | MotionRequest::Hold
        );
        // The first frame of an operator may be a replay: it must not switch anything on, or let it move.
        if edge && verdict == Verdict::Initial {
            self.controller
                .refuse(motion.sequence, Refusal::because(RefusalReason::WrongState));
        } else if edge && self.same_schema == Some(false) {
            self.controller.refuse(
                motion.sequence,
                Refusal::because(RefusalReason::SchemaMismatch),
            );
        } else {
            self.controller.request(motion.sequence, &motion.request);
        }
    }

    /// Counts lost, repeated and late frames by the verdict; `true` for a frame to act on.
    fn accept(&mut self, verdict: Verdict) -> bool {
        self.received.count(verdict);
        !matches!(verdict, Verdict::Duplicate | Verdict::Stale(_))
    }

    /// Returns whether there was room for it.
    fn send<B: Transmit>(&mut self, message: &Message, bus: &mut B) -> bool {
        let sent = self
            .encoder
            .encode_with(message, |frame| bus.transmit(frame));
        let is_sent = matches!(sent, Ok(Ok(())));
        if !is_sent {
            self.unsent = self.unsent.saturating_add(1);
        }
        is_sent
    }
}
