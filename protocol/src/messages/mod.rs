//! One struct per message; its identifier, length and signals are in [`table`](crate::table).
//!
//! Axis order is shoulder, elbow, lift, wrist. Quantities are SI. Motor quantities refer to the motor shafts, before
//! gears and the coupling of lift and wrist; joint quantities are ordered `[theta1, theta2, d3, theta4]`, lift and its
//! force positive downwards.

mod cyclic;
mod fault;
mod motion;
mod parameter;
mod posture;
mod service;

pub use cyclic::{Command, ControlWord, DriveStatus, Feedback, LimitFlags, State};
pub use fault::{Fault, FaultAxis, KnownAnswer, Unit};
pub use motion::{
    Compensation, Law, Motion, MotionReply, MotionRequest, Operation, Outcome, Refusal,
    RefusalReason,
};
pub use parameter::{Hello, ParameterError, ParameterReply, ParameterRequest, Server};
pub use posture::{ElbowSide, Posture, WristTurn};
pub use service::{
    Cause, EStop, EStopReason, Emergency, Heartbeat, Mode, Nmt, NmtCommand, Node, ResetReason,
};

/// Any message, with its node where that is part of the identifier.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Message {
    /// Operator to all: network management.
    Nmt(Nmt),
    /// Any node to all: emergency stop.
    EStop(EStop),
    /// From this node to all: a fault has just been latched, or all are cleared.
    Emergency(Node, Emergency),
    /// Drives to controller: what the motors did in the last sample.
    Feedback(Feedback),
    /// Controller to drives: motor commands.
    Command(Command),
    /// Operator to controller: a request.
    Motion(Motion),
    /// Controller to all: report of the cabinet.
    State(State),
    /// Controller to operator: outcome of a request.
    MotionReply(MotionReply),
    /// From this server to its client.
    ParameterReply(Server, ParameterReply),
    /// To this server from its client.
    ParameterRequest(Server, ParameterRequest),
    /// From this node to all: alive.
    Heartbeat(Node, Heartbeat),
}
