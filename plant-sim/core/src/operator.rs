//! The operator on the bus: works off a scenario, one request at a time, and waits for answers.
//!
//! It knows the controller by its messages alone. Every wait has a limit and names who is late.

use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{
    Hello, Message, Mode, Motion, MotionRequest, Outcome, ParameterReply, ParameterRequest,
    Refusal, Server, State,
};
use protocol::table;

use crate::model::Payload;
use crate::scenario::{PayloadSpec, Scenario, Step};

/// Longest wait for a reply, ns.
const REPLY_LIMIT_NS: u64 = 2_000_000_000;
/// Longest wait for a mode to change, ns.
const MODE_LIMIT_NS: u64 = 2_000_000_000;
/// Longest wait for a move to end, ns.
const MOVE_LIMIT_NS: u64 = 120_000_000_000;

/// One thing to do.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Action {
    Hello,
    Request(MotionRequest),
    WaitMode(Mode),
    WaitArrived,
    Dwell(u64),
    Attach(Payload),
    Release,
    BeginCycle,
    EndCycle,
}

/// What the rig has to do for the operator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hand {
    /// Put this into the gripper.
    Attach(Payload),
    /// Open the gripper.
    Release,
    /// A cycle begins.
    BeginCycle,
    /// A cycle has ended, dwell included.
    EndCycle,
}

/// Why a run ended early.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OperatorError {
    /// The controller refused a request.
    #[error("{request} refused: {}", sentence(refusal))]
    Refused {
        /// Which.
        request: &'static str,
        /// Why.
        refusal: Refusal,
    },
    /// Nothing came in time.
    #[error("the controller is late: {what} did not come within {seconds:.1} s")]
    Late {
        /// What was waited for.
        what: String,
        /// For how long.
        seconds: f64,
    },
    /// The peers were built from different message tables.
    #[error(
        "the controller speaks schema {theirs:08x}, this program {ours:08x}; build both from one source"
    )]
    Schema {
        /// Controller's.
        theirs: u32,
        /// Ours.
        ours: u32,
    },
    /// The controller stopped.
    #[error("the controller went to {mode}: {fault}")]
    Stopped {
        /// State it is in.
        mode: Mode,
        /// Latched fault.
        fault: protocol::messages::Fault,
    },
}

fn sentence(refusal: &Refusal) -> String {
    let axis = match refusal.axis {
        0 => " (shoulder)",
        1 => " (elbow)",
        2 => " (lift)",
        3 => " (wrist)",
        _ => "",
    };
    format!(
        "{}{axis}; value {}, limit {}",
        refusal.reason.describe(),
        refusal.value,
        refusal.limit
    )
}

/// Progress of the present action.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Progress {
    /// Not begun.
    Due,
    /// Sent or begun at this time, ns.
    Since(u64),
}

/// The operator of one run.
#[derive(Clone, Debug)]
pub struct Operator {
    actions: std::vec::IntoIter<Action>,
    current: Option<Action>,
    progress: Progress,
    sequence: u8,
    motion_counter: u8,
    parameter_counter: u8,
    reply: Option<Outcome>,
    greeted: Option<Hello>,
    state: Option<State>,
    /// Number of the last move that was accepted.
    last_move: Option<u8>,
}

impl Operator {
    /// An operator who will run `scenario`.
    pub fn new(scenario: &Scenario) -> Self {
        let actions = program(scenario).into_iter();
        let mut operator = Self {
            actions,
            current: None,
            progress: Progress::Due,
            sequence: 0,
            motion_counter: 0,
            parameter_counter: 0,
            reply: None,
            greeted: None,
            state: None,
            last_move: None,
        };
        operator.current = operator.actions.next();
        operator
    }

    /// Whether everything has been done.
    pub fn is_done(&self) -> bool {
        self.current.is_none()
    }

    /// Takes a frame that has just arrived.
    pub fn receive(&mut self, frame: &CanFrame) {
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
            _ => {}
        }
    }

    /// One sample of the operator's work, at `now` ns: at most one frame to send and what there
    /// is to do by hand.
    ///
    /// # Errors
    /// The run cannot go on; see [`OperatorError`].
    pub fn step(&mut self, now: u64) -> Result<(Option<CanFrame>, Option<Hand>), OperatorError> {
        self.watch()?;
        // Things that take no time are done in the same sample.
        loop {
            let Some(action) = self.current else {
                return Ok((None, None));
            };
            let begun = match self.progress {
                Progress::Due => {
                    self.progress = Progress::Since(now);
                    if let Some(frame) = self.begin(&action) {
                        return Ok((Some(frame), None));
                    }
                    now
                }
                Progress::Since(begun) => begun,
            };
            if !self.is_complete(&action, now - begun)? {
                return Ok((None, None));
            }
            self.progress = Progress::Due;
            self.current = self.actions.next();
            let hand = match action {
                Action::Attach(payload) => Hand::Attach(payload),
                Action::Release => Hand::Release,
                Action::BeginCycle => Hand::BeginCycle,
                Action::EndCycle => Hand::EndCycle,
                _ => continue,
            };
            return Ok((None, Some(hand)));
        }
    }

    /// A controller that has stopped by itself ends the run.
    fn watch(&self) -> Result<(), OperatorError> {
        match self.state {
            Some(state)
                if matches!(state.mode, Mode::FaultReaction | Mode::Fault | Mode::EStop) =>
            {
                Err(OperatorError::Stopped {
                    mode: state.mode,
                    fault: state.fault(),
                })
            }
            _ => Ok(()),
        }
    }

    fn begin(&mut self, action: &Action) -> Option<CanFrame> {
        let (message, counter) = match action {
            Action::Hello => {
                let hello = Hello {
                    schema: table::HASH,
                    build: 0,
                    profile: Hello::PROFILE_FD,
                };
                let counter = self.parameter_counter;
                self.parameter_counter = counter.wrapping_add(1);
                let request = ParameterRequest::Hello(hello);
                (
                    Message::ParameterRequest(Server::Controller, request),
                    counter,
                )
            }
            Action::Request(request) => {
                self.reply = None;
                self.sequence = self.sequence.wrapping_add(1);
                let counter = self.motion_counter;
                self.motion_counter = counter.wrapping_add(1);
                let motion = Motion {
                    sequence: self.sequence,
                    request: *request,
                };
                (Message::Motion(motion), counter)
            }
            _ => return None,
        };
        // A value that no frame can carry stays unsent; the missing reply then names the request.
        codec::encode(&message, counter).ok()
    }

    fn is_complete(&mut self, action: &Action, waited: u64) -> Result<bool, OperatorError> {
        let (complete, limit, what) = match action {
            Action::Hello => {
                if let Some(hello) = self.greeted
                    && hello.schema != table::HASH
                {
                    return Err(OperatorError::Schema {
                        theirs: hello.schema,
                        ours: table::HASH,
                    });
                }
                (
                    self.greeted.is_some(),
                    REPLY_LIMIT_NS,
                    "reply to hello".to_string(),
                )
            }
            Action::Request(request) => {
                if let Some(Outcome::Refused(refusal)) = self.reply {
                    return Err(OperatorError::Refused {
                        request: request.name(),
                        refusal,
                    });
                }
                if self.reply.is_some() && request.is_move() {
                    self.last_move = Some(self.sequence);
                } else if *request == MotionRequest::Stop {
                    // What was under way will never be completed.
                    self.last_move = None;
                }
                let what = format!("reply to request {} ({})", self.sequence, request.name());
                (self.reply.is_some(), REPLY_LIMIT_NS, what)
            }
            Action::WaitMode(mode) => (
                self.state.is_some_and(|state| state.mode == *mode),
                MODE_LIMIT_NS,
                format!("state {mode}"),
            ),
            Action::WaitArrived => (
                self.state.is_some_and(|state| {
                    state.mode == Mode::Enabled
                        && state.queue == 0
                        && self.last_move.is_none_or(|last| last == state.completed)
                }),
                MOVE_LIMIT_NS,
                "end of the move".to_string(),
            ),
            Action::Dwell(time) => (waited >= *time, u64::MAX, String::new()),
            Action::Attach(_) | Action::Release | Action::BeginCycle | Action::EndCycle => {
                (true, u64::MAX, String::new())
            }
        };
        if !complete && waited > limit {
            return Err(OperatorError::Late {
                what,
                seconds: limit as f64 * 1e-9,
            });
        }
        Ok(complete)
    }
}

/// Everything to do, in order.
fn program(scenario: &Scenario) -> Vec<Action> {
    let announce = |payload: &PayloadSpec| {
        Action::Request(MotionRequest::SetPayload {
            mass: payload.mass as f32,
            com: payload.com_flange_frame.map(|x| x as f32),
            inertia: payload.inertia_com_diag.map(|x| x as f32),
        })
    };
    let nothing = PayloadSpec {
        mass: 0.0,
        com_flange_frame: [0.0; 3],
        inertia_com_diag: [0.0; 3],
    };
    let carried = |payload: &PayloadSpec| payload.scaled(scenario.mismatch.payload).into();
    let mut actions = vec![
        Action::Hello,
        Action::WaitMode(Mode::Ready),
        // The first request of an operator might be a replay and cannot switch anything on.
        Action::Request(MotionRequest::Stop),
        Action::Request(MotionRequest::SelectLaw {
            law: scenario.law.law,
            compensation: scenario.law.compensation,
        }),
    ];
    if let Some(gains) = &scenario.gains {
        actions.push(Action::Request(MotionRequest::SetGains {
            bandwidth: gains.bandwidth as f32,
            damping: gains.damping as f32,
            observer: gains.observer as f32,
        }));
    }
    if let Some(payload) = &scenario.payload {
        actions.extend([Action::Attach(carried(payload)), announce(payload)]);
    }
    actions.extend([
        Action::Request(MotionRequest::Enable),
        Action::WaitMode(Mode::Enabled),
        // Until brake and observer have come to rest.
        Action::Dwell(100_000_000),
    ]);
    for _ in 0..scenario.cycles {
        actions.push(Action::BeginCycle);
        for step in &scenario.cycle {
            match step {
                Step::Jump(jump) => actions.push(Action::Request(MotionRequest::Jump {
                    target: jump.to.map(|x| x as f32),
                    top: jump.top as f32,
                    clearance: jump.clearance as f32,
                    speed: jump.speed as f32,
                })),
                Step::Line(line) => actions.push(Action::Request(MotionRequest::MoveLine {
                    target: line.to.map(|x| x as f32),
                    speed: line.speed as f32,
                })),
                Step::Joints(line) => actions.push(Action::Request(MotionRequest::MoveJoint {
                    target: line.to.map(|x| x as f32),
                    speed: line.speed as f32,
                })),
                Step::Dwell(seconds) => {
                    actions.extend([Action::WaitArrived, Action::Dwell((seconds * 1e9) as u64)])
                }
                Step::Stop(seconds) => actions.extend([
                    Action::Dwell((seconds * 1e9) as u64),
                    Action::Request(MotionRequest::Stop),
                ]),
                Step::Pick(payload) => actions.extend([
                    Action::WaitArrived,
                    Action::Attach(carried(payload)),
                    announce(payload),
                ]),
                Step::Place {} => {
                    actions.extend([Action::WaitArrived, Action::Release, announce(&nothing)])
                }
            }
        }
        actions.extend([Action::WaitArrived, Action::EndCycle]);
    }
    actions.extend([
        Action::Request(MotionRequest::Disable),
        Action::WaitMode(Mode::Ready),
    ]);
    actions
}
