//! The operator on the bus: executes a scenario, one request at a time, and waits for the answers.
//!
//! It knows the controller by its messages alone. Every wait has a limit, and its error names what is late.

mod desk;
mod news;
pub(crate) mod program;
mod signs;

use protocol::codec::Encoder;
use protocol::e2e::{Profile, Receiver};
use protocol::frame::CanFrame;
use protocol::messages::{
    EStop, EStopReason, Hello, Message, Mode, MotionRequest, Outcome, ParameterRequest, Server,
    State,
};
use protocol::table;
use protocol::time::{Duration, Instant, Period};

use crate::heart::Heart;
use crate::peer::{Outbox, Peer, PeerError};
use crate::scenario::Scenario;
use crate::world::{CellEvent, OperatorError, Spot, Unused, World};
use program::{Action, Program, Task};
use signs::Button;

pub use desk::{Answer, Desk, Order};

/// Longest wait for a reply.
const REPLY_LIMIT: Duration = Duration::from_secs(2);
/// Longest wait for a mode to change.
const MODE_LIMIT: Duration = Duration::from_secs(2);
/// Longest wait for a move at full speed to end, s; one at a thousandth of it may take a thousand times as long.
const MOVE_LIMIT_S: f64 = 120.0;
/// Longest wait for a move of any speed, s.
const ANY_MOVE_LIMIT_S: f64 = 1e9;
/// Its first heartbeat comes between those of the drives.
const FIRST_HEARTBEAT: Instant = Instant::from_nanos(50_000_000);

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
    program: Program,
    current: Option<Task>,
    progress: Progress,
    /// Polling period, and time of the next poll.
    period: Period,
    next: Instant,
    heart: Heart,
    /// The button of manual operation.
    button: Button,
    given_up: bool,
    encoder: Encoder,
    sequence: u8,
    /// Number of the request whose answer the program waits for.
    awaited: u8,
    reply: Option<Outcome>,
    greeted: Option<Hello>,
    state: Option<State>,
    /// Tells a new state from an old one.
    states: Receiver,
    /// Whether the controller has reported a fault that is not cleared.
    alarmed: bool,
    /// Time of the last new state.
    heard: Instant,
    /// States since then that could not be used, and replies since the last request.
    refused_states: Unused,
    refused_replies: Unused,
    /// Whether another node has sent requests in its name.
    is_imitated: bool,
    /// Sequence number of the last accepted move.
    last_move: Option<u8>,
    /// Speed of the slowest move since the arm last arrived.
    slowest: f32,
    /// Speed override, and the least since then: it slows down the moves that are under way as well.
    pace: f32,
    least_pace: f32,
    /// Whether the program has set it to 0: no move goes on until the program raises it.
    held: bool,
}

impl Operator {
    /// An operator that runs `scenario`.
    pub fn new(scenario: &Scenario) -> Self {
        let mut program = Program::new(scenario);
        Self {
            current: program.next(),
            program,
            progress: Progress::Due,
            period: Period::of_rate(scenario.rate_hz),
            next: Instant::ORIGIN,
            heart: Heart::new(FIRST_HEARTBEAT, Period::of_rate(scenario.rate_hz)),
            button: Button::default(),
            given_up: false,
            encoder: Encoder::default(),
            sequence: 0,
            awaited: 0,
            reply: None,
            greeted: None,
            state: None,
            states: Receiver::new(Profile::Fd),
            alarmed: false,
            heard: Instant::ORIGIN,
            refused_states: Unused::default(),
            refused_replies: Unused::default(),
            is_imitated: false,
            last_move: None,
            slowest: 1.0,
            pace: 1.0,
            least_pace: 1.0,
            held: false,
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
            Err(_) if self.given_up => self.stop_working([]),
            Err(error) => {
                world.outcome = Some(Err(self.explain(error)));
                self.given_up = true;
                self.stop_working([
                    Action::Request(MotionRequest::Stop),
                    Action::Request(MotionRequest::Disable),
                ]);
            }
        }
    }

    /// The same with what may be behind it.
    fn explain(&self, error: OperatorError) -> OperatorError {
        let is_about_requests = matches!(
            error,
            OperatorError::Refused { .. }
                | OperatorError::Unfinished { .. }
                | OperatorError::Late { .. }
        );
        if is_about_requests && self.is_imitated {
            let why = Box::new(error);
            return OperatorError::Imitated { why };
        }
        error
    }

    fn stop_working<const N: usize>(&mut self, last: [Action; N]) {
        self.button.press(false);
        self.program.only(last);
        self.current = self.program.next();
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
            let Some(Task { action, spot }) = self.current else {
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
            if !self.is_complete(&action, spot, now.since(begun))? {
                return Ok(false);
            }
            self.progress = Progress::Due;
            self.current = self.program.next();
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

    fn begin(&mut self, action: &Action) -> Option<CanFrame> {
        let message = match action {
            Action::Hello => {
                Message::ParameterRequest(Server::Controller, ParameterRequest::Hello(table::HELLO))
            }
            Action::Request(request) => {
                self.reply = None;
                self.refused_replies = Unused::default();
                let frame = self.send(*request);
                self.awaited = self.sequence;
                if let MotionRequest::SetOverride { pace } = request {
                    self.held = *pace == 0.0;
                }
                return frame;
            }
            Action::EmergencyStop => Message::EStop(EStop {
                reason: EStopReason::BUTTON,
                counter: 0,
            }),
            Action::Hold(pressed) => {
                self.button.press(*pressed);
                return None;
            }
            _ => return None,
        };
        // A value that no frame can carry is not sent; the error of the missing reply then names the request.
        self.encoder.encode(&message).ok()
    }

    /// Whether the action is complete.
    fn is_complete(
        &mut self,
        action: &Action,
        spot: Option<Spot>,
        waited: Duration,
    ) -> Result<bool, OperatorError> {
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
                            spot,
                            request: *request,
                            refusal,
                        });
                    }
                    Some(Outcome::Accepted) if request.is_move() => {
                        self.last_move = Some(self.awaited);
                    }
                    None => self.slowest = self.slowest.min(speed_of(request)),
                    _ if *request == MotionRequest::Stop => {
                        // The current move will never complete.
                        self.last_move = None;
                    }
                    _ => {}
                }
                // A move is answered once it is planned, which may have to wait until earlier moves leave the queue.
                let limit = if request.is_move() && self.queue() > 0 {
                    self.move_limit()
                } else {
                    REPLY_LIMIT
                };
                (self.reply.is_some(), limit)
            }
            Action::WaitMode(mode) => (
                self.state.is_some_and(|state| state.mode == *mode),
                MODE_LIMIT,
            ),
            Action::WaitArrived => {
                let arrived = self.state.is_some_and(|state| {
                    state.mode == Mode::Enabled
                        && state.queue == 0
                        && self.last_move.is_none_or(|last| last == state.completed)
                });
                let limit = self.move_limit();
                if arrived {
                    self.slowest = 1.0;
                    self.least_pace = self.pace;
                }
                (arrived, limit)
            }
            Action::Dwell(time) => (waited >= *time, Duration::MAX),
            Action::EmergencyStop | Action::Hold(_) | Action::Cell(_) => (true, Duration::MAX),
        };
        if complete || waited <= limit {
            return Ok(complete);
        }
        Err(match action {
            _ if self.held && self.queue() > 0 => OperatorError::Held {
                spot,
                what: action.awaited(self.awaited),
                limit,
            },
            Action::WaitArrived => OperatorError::Unfinished {
                spot,
                speed: self.slowest * self.least_pace,
                limit,
            },
            _ => OperatorError::Late {
                what: action.awaited(self.awaited),
                limit,
                refused: match action {
                    Action::Request(_) => self.refused_replies,
                    _ => Unused::default(),
                },
            },
        })
    }

    /// Moves that have not ended.
    fn queue(&self) -> u8 {
        self.state.map_or(0, |state| state.queue)
    }

    fn move_limit(&self) -> Duration {
        // An arm that is to be held comes to its next rest at once, or not at all.
        if self.held {
            return MODE_LIMIT;
        }
        let share = f64::from(self.slowest) * f64::from(self.least_pace);
        Duration::from_seconds((MOVE_LIMIT_S / share).min(ANY_MOVE_LIMIT_S))
    }
}

/// Share of full speed that a request asks for. Full speed is more than 1 m/s at the tool, which so is never longer on its way with
/// a share of as many as its m/s.
fn speed_of(request: &MotionRequest) -> f32 {
    match request {
        MotionRequest::MoveLine {
            speed, tool_speed, ..
        }
        | MotionRequest::MoveArc {
            speed, tool_speed, ..
        } if *tool_speed > 0.0 => speed.min(*tool_speed),
        MotionRequest::Jump { speed, .. }
        | MotionRequest::MoveLine { speed, .. }
        | MotionRequest::MoveArc { speed, .. }
        | MotionRequest::MoveJoint { speed, .. } => *speed,
        _ => 1.0,
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
                self.tick(now, out);
                self.step(now, world, out);
            }
        }
        Ok(())
    }
}
