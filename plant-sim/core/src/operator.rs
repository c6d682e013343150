//! The operator on the bus: executes a scenario, one request at a time, and waits for the answers.
//!
//! It knows the controller by its messages alone. Every wait has a limit, and its error names what is late.

mod program;

use protocol::codec::{self, Encoder};
use protocol::frame::CanFrame;
use protocol::messages::{
    Cause, Hello, Message, Mode, Motion, MotionRequest, Node, Outcome, ParameterReply,
    ParameterRequest, Server, State,
};
use protocol::table;
use protocol::time::{Duration, Instant, Period};

use crate::peer::{Outbox, Peer, PeerError};
use crate::scenario::Scenario;
use crate::world::{CellEvent, OperatorError, World};
use program::{Action, program};

/// Longest wait for a reply.
const REPLY_LIMIT: Duration = Duration::from_secs(2);
/// Longest wait for a mode to change.
const MODE_LIMIT: Duration = Duration::from_secs(2);
/// Longest wait for a move to end.
const MOVE_LIMIT: Duration = Duration::from_secs(120);
/// Time without any frame after which the controller counts as silent: ten heartbeats.
const SILENCE_LIMIT: Duration = Duration::from_secs(1);

/// Progress of the current action.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Progress {
    /// Not started.
    Due,
    /// Sent or started at this time.
    Since(Instant),
}

/// The operator of one run.
///
/// If something goes wrong, it reports the error once, requests stop and disable, and does no more.
#[derive(Clone, Debug)]
pub struct Operator {
    actions: std::vec::IntoIter<Action>,
    current: Option<Action>,
    progress: Progress,
    /// Polling period, and time of the next poll.
    period: Period,
    next: Instant,
    given_up: bool,
    encoder: Encoder,
    sequence: u8,
    reply: Option<Outcome>,
    greeted: Option<Hello>,
    state: Option<State>,
    /// Whether the controller has reported a fault that is not cleared.
    alarmed: bool,
    /// Time of the controller's last frame.
    heard: Instant,
    /// Sequence number of the last accepted move.
    last_move: Option<u8>,
}

impl Operator {
    /// An operator that runs `scenario`.
    pub fn new(scenario: &Scenario) -> Self {
        let mut actions = program(scenario).into_iter();
        Self {
            current: actions.next(),
            actions,
            progress: Progress::Due,
            period: Period::of_rate(scenario.rate_hz),
            next: Instant::ORIGIN,
            given_up: false,
            encoder: Encoder::default(),
            sequence: 0,
            reply: None,
            greeted: None,
            state: None,
            alarmed: false,
            heard: Instant::ORIGIN,
            last_move: None,
        }
    }

    /// Takes a frame that has just arrived.
    fn receive(&mut self, now: Instant, frame: &CanFrame) {
        if table::of_frame(frame).is_none_or(|info| info.sender != Some(Node::Controller)) {
            return;
        }
        self.heard = now;
        // Commands do not concern an operator.
        if table::COMMAND.identifies(frame) {
            return;
        }
        let Ok(received) = codec::decode(frame) else {
            return;
        };
        match received.message {
            Message::MotionReply(reply) if reply.sequence == self.sequence => {
                self.reply = Some(reply.outcome);
            }
            Message::ParameterReply(Server::Controller, ParameterReply::Hello(hello)) => {
                self.greeted = Some(hello);
            }
            Message::State(state) => self.state = Some(state),
            Message::Emergency(_, emergency) => self.alarmed = emergency.cause != Cause::None,
            _ => {}
        }
    }

    /// One poll: evaluates what has arrived and acts on it.
    fn step(&mut self, now: Instant, world: &mut World, out: &mut Outbox) {
        match self.work(now, world, out) {
            Ok(true) => {
                // An operator that has given up has already reported it.
                world.outcome = (!self.given_up).then_some(Ok(()));
            }
            Ok(false) => {}
            Err(_) if self.given_up => self.stop_working(vec![]),
            Err(error) => {
                world.outcome = Some(Err(error));
                self.given_up = true;
                self.stop_working(vec![
                    Action::Request(MotionRequest::Stop),
                    Action::Request(MotionRequest::Disable),
                ]);
            }
        }
    }

    fn stop_working(&mut self, last: Vec<Action>) {
        self.actions = last.into_iter();
        self.current = self.actions.next();
        self.progress = Progress::Due;
    }

    /// Continues the current action, and all following ones that take no time; `true` when nothing is left to do.
    fn work(
        &mut self,
        now: Instant,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<bool, OperatorError> {
        if !self.given_up {
            self.watch(now)?;
        }
        loop {
            let Some(action) = self.current else {
                return Ok(true);
            };
            let begun = match self.progress {
                Progress::Due => {
                    self.progress = Progress::Since(now);
                    if let Some(frame) = self.begin(&action) {
                        out.push((now, frame));
                        return Ok(false);
                    }
                    now
                }
                Progress::Since(begun) => begun,
            };
            if !self.is_complete(&action, now.since(begun))? {
                return Ok(false);
            }
            self.progress = Progress::Due;
            self.current = self.actions.next();
            if let Action::Cell(event) = action {
                match event {
                    CellEvent::Attach(payload) => world.plant.attach(payload),
                    CellEvent::Release => world.plant.release(),
                    CellEvent::BeginCycle | CellEvent::EndCycle => {}
                }
                world.cell_events.push(event);
                return Ok(false);
            }
        }
    }

    /// Ends the run if the controller has stopped by itself or gone silent.
    fn watch(&self, now: Instant) -> Result<(), OperatorError> {
        if let Some(state) = self.state
            && matches!(state.mode, Mode::FaultReaction | Mode::Fault | Mode::EStop)
        {
            return Err(OperatorError::Stopped {
                mode: state.mode,
                fault: state.fault(),
            });
        }
        if now.since(self.heard) > SILENCE_LIMIT {
            return Err(OperatorError::Silent { since: self.heard });
        }
        Ok(())
    }

    fn begin(&mut self, action: &Action) -> Option<CanFrame> {
        let message = match action {
            Action::Hello => {
                Message::ParameterRequest(Server::Controller, ParameterRequest::Hello(table::HELLO))
            }
            Action::Request(request) => {
                self.reply = None;
                self.sequence = self.sequence.wrapping_add(1);
                Message::Motion(Motion {
                    sequence: self.sequence,
                    request: *request,
                })
            }
            _ => return None,
        };
        // A value that no frame can carry is not sent; the error of the missing reply then names the request.
        self.encoder.encode(&message).ok()
    }

    /// Whether the action is complete.
    fn is_complete(&mut self, action: &Action, waited: Duration) -> Result<bool, OperatorError> {
        let (complete, limit) = match action {
            Action::Hello => {
                if let Some(hello) = self.greeted
                    && hello.schema != table::HASH
                {
                    return Err(OperatorError::Schema {
                        theirs: hello.schema,
                        ours: table::HASH,
                    });
                }
                (self.greeted.is_some(), REPLY_LIMIT)
            }
            Action::Request(request) => {
                match self.reply {
                    // A refusal because of a fault is not the cause: the next state reports the fault.
                    Some(Outcome::Refused(_)) if self.alarmed && waited <= REPLY_LIMIT => {
                        return Ok(false);
                    }
                    Some(Outcome::Refused(refusal)) => {
                        return Err(OperatorError::Refused {
                            request: request.name(),
                            refusal,
                        });
                    }
                    Some(Outcome::Accepted) if request.is_move() => {
                        self.last_move = Some(self.sequence);
                    }
                    _ if *request == MotionRequest::Stop => {
                        // The current move will never complete.
                        self.last_move = None;
                    }
                    _ => {}
                }
                (self.reply.is_some(), REPLY_LIMIT)
            }
            Action::WaitMode(mode) => (
                self.state.is_some_and(|state| state.mode == *mode),
                MODE_LIMIT,
            ),
            Action::WaitArrived => (
                self.state.is_some_and(|state| {
                    state.mode == Mode::Enabled
                        && state.queue == 0
                        && self.last_move.is_none_or(|last| last == state.completed)
                }),
                MOVE_LIMIT,
            ),
            Action::Dwell(time) => (waited >= *time, Duration::MAX),
            Action::Cell(_) => (true, Duration::MAX),
        };
        if !complete && waited > limit {
            return Err(OperatorError::Late {
                what: self.awaited(action),
                limit,
            });
        }
        Ok(complete)
    }

    /// What an action waits for, as text.
    fn awaited(&self, action: &Action) -> String {
        match action {
            Action::Hello => "reply to hello".into(),
            Action::Request(request) => {
                format!("reply to request {} ({})", self.sequence, request.name())
            }
            Action::WaitMode(mode) => format!("state {mode}"),
            Action::WaitArrived => "end of the move".into(),
            Action::Dwell(_) | Action::Cell(_) => "end of a dwell".into(),
        }
    }
}

impl Peer for Operator {
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
        match received {
            Some(frame) => self.receive(now, frame),
            None => {
                self.next = now + self.period.duration();
                self.step(now, world, out);
            }
        }
        Ok(())
    }
}
