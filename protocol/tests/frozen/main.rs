//! Frozen wire format: one literal frame for every message and variant.
//!
//! The bytes were not made by this crate: they were packed by a separate script from the layout in the message table,
//! with CRCs computed bit by bit. Frames of a released version are never edited here; new ones are added.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod motion;

use protocol::codec::{self, Received};
use protocol::frame::CanFrame;
use protocol::messages::*;

const HELLO: Hello = Hello {
    schema: 0x1122_3344,
    build: 0xAABB_CCDD,
    profile: Hello::PROFILE_FD,
};

/// The message, its counter (0 where it has none), and its frame as `candump` prints it.
fn check(message: Message, counter: u8, wire: &str) {
    let frame: CanFrame = codec::encode(&message, counter).unwrap();
    assert_eq!(frame.to_string(), wire);
    let Received {
        message: read,
        counter: found,
    } = codec::decode(&frame).unwrap();
    assert_eq!((read, found.unwrap_or(0)), (message, counter));
}

#[test]
fn nmt() {
    check(
        Message::Nmt(Nmt {
            command: NmtCommand::Start,
            node: 0,
        }),
        0,
        "000#0100",
    );
}

#[test]
fn estop() {
    check(
        Message::EStop(EStop {
            reason: EStopReason::BUTTON,
            counter: 7,
        }),
        0,
        "001#0107",
    );
}

#[test]
fn emergency() {
    check(
        Message::Emergency(
            Node::Controller,
            Emergency::new(Cause::FollowingError, 0x1234_5678),
        ),
        0,
        "0C1#1186210B78563412",
    );
}

#[test]
fn feedback() {
    check(
        Message::Feedback(Feedback {
            sample: 0x0102_0304,
            status: DriveStatus::READY
                | DriveStatus::TORQUE_ON
                | DriveStatus::BRAKE_RELEASED
                | DriveStatus::ENCODER_VALID,
            position: [-1, 131_072, i32::MIN, i32::MAX],
            velocity: [1.5, -2.5, 0.25, -628.0],
            torque: [1000, -1000, 32_767, -32_768],
        }),
        42,
        "1C0##10403020147FFFFFFFF0000020000000080FFFFFF7F0000C03F000020C00000803E00001DC4E80318FC\
        FF7F00802AFE98",
    );
}

#[test]
fn command() {
    check(
        Message::Command(Command {
            sample: 0xDEAD_BEEF,
            control: ControlWord::TORQUE_ENABLE | ControlWord::BRAKE_RELEASE,
            torque: [8.0, -8.0, 3.42, -0.0],
        }),
        255,
        "240##1EFBEADDE0300000041000000C148E15A4000000080FFC7C9",
    );
}

#[test]
fn state() {
    check(
        Message::State(State {
            mode: Mode::Fault,
            cause: Cause::FollowingError,
            limits: LimitFlags::POSITION_WRIST | LimitFlags::DAMPED | LimitFlags::PREDICTED,
            queue: 3,
            completed: 9,
            overruns: 258,
            rejected: 65_535,
            worst_tick: 170_000,
            law: Law::ComputedTorqueJoint,
            compensation: Compensation::Integral,
            tracking_error: [0.5, -0.25, 0.125, -1.0],
            // Fields added later: zeros, as the padding was.
            fault_axis: FaultAxis::None,
            fault_value: 0.0,
            fault_limit: 0.0,
            pace: 0,
            operation: Operation::Automatic,
            burden: 0,
        }),
        128,
        "300##1090B003803090201FFFF1098020004010000003F000080BE0000003E000080BF000000000000000000\
        0000000080272E",
    );
}

/// A fault with its axis and number, in former padding.
#[test]
fn state_with_a_fault() {
    check(
        Message::State(State {
            mode: Mode::FaultReaction,
            cause: Cause::FollowingError,
            limits: LimitFlags::TORQUE_LIFT | LimitFlags::PREDICTED,
            queue: 0,
            completed: 7,
            overruns: 1,
            rejected: 2,
            worst_tick: 0,
            law: Law::ComputedTorqueJoint,
            compensation: Compensation::Observer,
            tracking_error: [0.5, -0.25, 0.0021, -1.0],
            fault_axis: FaultAxis::Lift,
            fault_value: 0.0021,
            fault_limit: 0.002,
            pace: 0,
            operation: Operation::Automatic,
            burden: 0,
        }),
        129,
        "300##1080B04200007010002000000000004020000003F000080BE27A0093B000080BF0327A0093B6F12033\
        B0000000081624D",
    );
}

/// The tool, in manual operation: a byte that was padding.
#[test]
fn state_in_manual_operation() {
    check(
        Message::State(State {
            mode: Mode::FaultReaction,
            cause: Cause::OverSpeed,
            limits: LimitFlags::PREDICTED,
            queue: 1,
            completed: 7,
            overruns: 1,
            rejected: 2,
            worst_tick: 0,
            law: Law::ComputedTorqueJoint,
            compensation: Compensation::Observer,
            tracking_error: [0.5, -0.25, 0.0021, -1.0],
            fault_axis: FaultAxis::Tool,
            fault_value: 0.275,
            fault_limit: 0.25,
            pace: 9,
            operation: Operation::Manual,
            burden: 0,
        }),
        130,
        "300##1080C00200107010002000000000004020000003F000080BE27A0093B000080BF05CDCC8C3E0000803E\
        090100008284BD",
    );
}

/// A payload of 2.5 kg less than announced, in the last bytes that were padding.
#[test]
fn state_with_a_burden() {
    check(
        Message::State(State {
            mode: Mode::Moving,
            cause: Cause::None,
            limits: LimitFlags::PREDICTED,
            queue: 1,
            completed: 7,
            overruns: 1,
            rejected: 2,
            worst_tick: 0,
            law: Law::ComputedTorqueJoint,
            compensation: Compensation::Observer,
            tracking_error: [0.5, -0.25, 0.0021, -1.0],
            fault_axis: FaultAxis::None,
            fault_value: 0.0,
            fault_limit: 0.0,
            pace: 100,
            operation: Operation::Automatic,
            burden: -250,
        }),
        131,
        "300##1060000200107010002000000000004020000003F000080BE27A0093B000080BF000000000000000000\
        640006FF83B69F",
    );
}

#[test]
fn accepted() {
    check(
        Message::MotionReply(MotionReply {
            sequence: 9,
            outcome: Outcome::Accepted,
        }),
        0,
        "340##109000000000000000000000000003844",
    );
}

#[test]
fn refused() {
    check(
        Message::MotionReply(MotionReply {
            sequence: 10,
            outcome: Outcome::Refused(Refusal {
                reason: RefusalReason::JointLimit,
                axis: 2,
                value: 0.375,
                limit: 0.25,
            }),
        }),
        1,
        "340##10A0108020000C03E0000803E00013876",
    );
}

#[test]
fn value() {
    check(
        Message::ParameterReply(
            Server::Controller,
            ParameterReply::Value {
                index: 0x0102,
                value: 1.0,
                lower: 0.5,
                upper: 2.0,
            },
        ),
        3,
        "5C1##10002010000803F0000003F000000400000032FD7",
    );
}

#[test]
fn error() {
    check(
        Message::ParameterReply(
            Server::Drives,
            ParameterReply::Error {
                index: 0x0102,
                error: ParameterError::OutOfRange,
                limit: 2.0,
            },
        ),
        3,
        "5C0##101020102000000400000000000000000000306C4",
    );
}

#[test]
fn reply_hello() {
    check(
        Message::ParameterReply(Server::Controller, ParameterReply::Hello(HELLO)),
        3,
        "5C1##10244332211DDCCBBAA0100000000000000035E4E",
    );
}

#[test]
fn get() {
    check(
        Message::ParameterRequest(Server::Controller, ParameterRequest::Get { index: 0x0102 }),
        4,
        "641##10002010000000000000000000004E773",
    );
}

#[test]
fn set() {
    check(
        Message::ParameterRequest(
            Server::Drives,
            ParameterRequest::Set {
                index: 0x0102,
                value: -1.0,
            },
        ),
        4,
        "640##1010201000080BF00000000000004EFC3",
    );
}

#[test]
fn list() {
    check(
        Message::ParameterRequest(Server::Controller, ParameterRequest::List { from: 7 }),
        4,
        "641##10207000000000000000000000004520A",
    );
}

#[test]
fn hello() {
    check(
        Message::ParameterRequest(Server::Drives, ParameterRequest::Hello(HELLO)),
        4,
        "640##10344332211DDCCBBAA01000000043CF7",
    );
}

#[test]
fn heartbeat() {
    check(
        Message::Heartbeat(
            Node::Operator,
            Heartbeat {
                state: Mode::Enabled,
                cause: Cause::None,
                reset: ResetReason::Watchdog,
            },
        ),
        10,
        "742#0500030A5E",
    );
}
