//! The operator of a run that goes on: first a scenario, and then, or in its place, what a person asks for.

use std::collections::VecDeque;

use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Message, Mode, MotionRequest, Operation, Outcome, State};
use protocol::time::Instant;

use super::news::SILENCE_LIMIT;
use super::program::{Action, Program, announcement};
use super::{Operator, Progress};
use crate::peer::{Outbox, Peer, PeerError};
use crate::refusal::sentence;
use crate::scenario::{PayloadSpec, Scenario};
use crate::world::{CellEvent, World};

/// What a person asks the operator for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// A request to the controller.
    Request(MotionRequest),
    /// The same, to keep on only while a button is held: not in automatic operation, where it would go on by itself.
    Jog(MotionRequest),
    /// Carry this, announced to the controller; the gripper takes it when the controller has accepted it.
    Carry(PayloadSpec),
    /// Press the emergency stop.
    EmergencyStop,
    /// The cycles of the scenario, from the beginning.
    Scenario,
}

impl Order {
    /// Name, lower case with hyphens.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Request(request) | Self::Jog(request) => request.name(),
            Self::Carry(_) => "set-payload",
            Self::EmergencyStop => "emergency-stop",
            Self::Scenario => "scenario",
        }
    }
}

/// What has become of an order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Time.
    pub at: Instant,
    /// In words.
    pub text: String,
    /// Whether it was done as asked.
    pub good: bool,
}

/// An order that the controller has yet to answer.
#[derive(Clone, Copy, Debug)]
struct Open {
    sequence: u8,
    request: MotionRequest,
    carry: Option<PayloadSpec>,
}

/// Most orders without an answer that are remembered.
const OPEN: usize = 16;

/// An operator that executes its scenario until a person asks for something, and stays when the scenario has ended.
///
/// It sends a person's requests as they come, one a sample, without waiting for their answers: a stop follows a move at
/// once.
#[derive(Clone, Debug)]
pub struct Desk {
    operator: Operator,
    scenario: Scenario,
    /// Whether the scenario goes on.
    scripted: bool,
    orders: VecDeque<Order>,
    open: VecDeque<Open>,
    answers: Vec<Answer>,
    /// Whether the controller has had a request: numbers begin anew after 255.
    introduced: bool,
}

impl Desk {
    /// An operator that runs `scenario` and stays.
    pub fn new(scenario: &Scenario) -> Self {
        let mut operator = Operator::new(scenario);
        operator.take_up(Program::new(scenario).staying());
        Self {
            operator,
            scenario: scenario.clone(),
            scripted: true,
            orders: VecDeque::new(),
            open: VecDeque::new(),
            answers: Vec::new(),
            introduced: false,
        }
    }

    /// Asks for something. Unless it is another speed, the scenario does not go on by itself after it; moves that the controller
    /// has accepted do.
    pub fn order(&mut self, order: Order) {
        self.orders.push_back(order);
    }

    /// Answers since the last call.
    pub fn answers(&mut self) -> Vec<Answer> {
        std::mem::take(&mut self.answers)
    }

    /// Whether the scenario goes on.
    pub fn is_scripted(&self) -> bool {
        self.scripted
    }

    fn answer(&mut self, at: Instant, good: bool, text: String) {
        self.answers.push(Answer { at, text, good });
    }

    /// Executes an order. A scenario goes on only with another speed.
    fn obey(&mut self, now: Instant, order: Order, out: &mut Outbox) {
        let (request, carry) = match order {
            Order::Request(request) => (request, None),
            Order::Jog(_) if !self.is_manual() => {
                let text = "jog: moves are held in manual operation alone; choose it first";
                return self.answer(now, false, text.into());
            }
            Order::Jog(request) => (request, None),
            Order::Carry(payload) => (announcement(&payload), Some(payload)),
            Order::EmergencyStop => {
                self.interrupt();
                let frame = self.operator.begin(&Action::EmergencyStop);
                out.extend(frame.map(|frame| (now, frame)));
                return self.answer(now, true, format!("{}: sent", order.name()));
            }
            Order::Scenario => {
                self.interrupt();
                return self.again(now);
            }
        };
        if request == MotionRequest::Hold {
            out.extend(self.operator.hold().map(|frame| (now, frame)));
            return;
        }
        if !matches!(request, MotionRequest::SetOverride { .. }) {
            self.interrupt();
        }
        let Some(frame) = self.operator.send(request) else {
            let text = format!("{}: a value that no frame can carry", order.name());
            return self.answer(now, false, text);
        };
        out.push((now, frame));
        if self.open.len() == OPEN {
            self.open.pop_front();
        }
        self.open.push_back(Open {
            sequence: self.operator.sequence,
            request,
            carry,
        });
    }

    /// Whether the controller is in manual operation, and not asked for another.
    fn is_manual(&self) -> bool {
        let changes = |open: &Open| matches!(open.request, MotionRequest::SetOperation { .. });
        let state = self.operator.state;
        state.is_some_and(|state| state.operation == Operation::Manual)
            && !self.open.iter().any(changes)
    }

    /// The scenario does not go on, and nobody holds its moves.
    fn interrupt(&mut self) {
        self.scripted = false;
        self.operator.button.press(false);
    }

    /// Begins the scenario again, from where the controller is.
    fn again(&mut self, now: Instant) {
        let program = Program::new(&self.scenario).staying();
        let wanted = self.scenario.operation.code();
        let operation = self.operator.state.map(|state| state.operation);
        if let Some(operation) = operation.filter(|operation| *operation != wanted) {
            let text =
                format!("scenario: the arm is in {operation} operation; choose {wanted} first");
            return self.answer(now, false, text);
        }
        let program = match self.operator.state.map(|state| state.mode) {
            Some(Mode::Ready) => program,
            Some(Mode::Enabled) => program.of_cycles(),
            other => {
                let mode = other.map_or("unknown", |mode| mode.name());
                let text = format!(
                    "scenario: the controller is in state {mode}; a scenario begins in ready or enabled"
                );
                return self.answer(now, false, text);
            }
        };
        self.operator.take_up(program);
        self.scripted = true;
        self.answer(now, true, "scenario: begun".into());
    }

    /// Takes the controller's answer to a person's request.
    fn hear(&mut self, now: Instant, frame: &CanFrame, world: &mut World) {
        let Ok(Message::MotionReply(reply)) = codec::decode(frame).map(|received| received.message)
        else {
            return;
        };
        let Some(place) = self
            .open
            .iter()
            .position(|open| open.sequence == reply.sequence)
        else {
            return;
        };
        let Some(Open { request, carry, .. }) = self.open.remove(place) else {
            return;
        };
        let name = request.name();
        match reply.outcome {
            Outcome::Accepted => {
                if let Some(payload) = carry {
                    self.grip(&payload, world);
                }
                self.answer(now, true, format!("{name}: accepted"));
            }
            Outcome::Refused(refusal) => {
                let why = sentence(&request, &refusal);
                self.answer(now, false, format!("{name} refused: {why}"));
            }
        }
    }

    fn grip(&self, payload: &PayloadSpec, world: &mut World) {
        let event = if payload.mass > 0.0 {
            let carried = payload.scaled(self.scenario.mismatch.payload).into();
            world.plant.attach(carried);
            CellEvent::Attach(carried)
        } else {
            world.plant.release();
            CellEvent::Release
        };
        world.cell_events.push(event);
    }

    /// Continues the scenario; one that has ended or failed is over.
    fn go_on(&mut self, now: Instant, world: &mut World, out: &mut Outbox) {
        self.operator.step(now, world, out);
        match &world.outcome {
            None => {}
            Some(Ok(())) => {
                self.scripted = false;
                self.answer(now, true, "scenario: completed".into());
            }
            Some(Err(error)) => {
                let text = format!("scenario ended: {error}");
                self.scripted = false;
                self.answer(now, false, text);
                // As an operator does who gives up.
                for request in [MotionRequest::Stop, MotionRequest::Disable] {
                    self.orders.push_back(Order::Request(request));
                }
            }
        }
        // This run does not end with its scenario.
        world.outcome = None;
    }
}

impl Operator {
    /// Executes `program` from now on.
    fn take_up(&mut self, program: Program) {
        self.program = program;
        self.current = self.program.next();
        self.progress = Progress::Due;
        self.given_up = false;
        self.alarmed = false;
        self.last_move = None;
        self.slowest = 1.0;
        self.least_pace = self.pace;
    }
}

impl Peer for Desk {
    fn wake(&self) -> Option<Instant> {
        self.operator.wake()
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        match received {
            Some(frame) => {
                let (heard, state) = (self.operator.heard, self.operator.state);
                self.operator.receive(now, frame);
                self.hear(now, frame, world);
                // After a silence, its own or that of the drives, the controller wants to know again who asks, and after its own it takes a
                // first request for a replay.
                let is_waiting =
                    |state: Option<State>| state.map(|it| it.mode == Mode::PreOperational);
                let waits = (is_waiting(state), is_waiting(self.operator.state));
                let was_silent = self.operator.heard.since(heard) > SILENCE_LIMIT;
                if was_silent {
                    self.orders.push_front(Order::Request(MotionRequest::Stop));
                }
                if was_silent || waits == (Some(false), Some(true)) {
                    let hello = self.operator.begin(&Action::Hello);
                    out.extend(hello.map(|frame| (now, frame)));
                }
            }
            None => {
                self.operator.tick(now, out);
                if let Some(order) = self.orders.pop_front() {
                    // The controller treats an operator's first request as a possible replay.
                    let first = !self.introduced && self.operator.sequence == 0;
                    self.introduced = true;
                    if first && !matches!(order, Order::EmergencyStop | Order::Scenario) {
                        self.orders.push_front(order);
                        self.obey(now, Order::Request(MotionRequest::Stop), out);
                    } else {
                        self.obey(now, order, out);
                    }
                } else if self.scripted {
                    self.go_on(now, world, out);
                }
            }
        }
        Ok(())
    }
}
