//! The wire, frozen: one literal frame for every message and every variant.
//!
//! The bytes were not made by this crate: they were packed by a separate script from the layout in the message table,
//! with CRCs computed bit by bit. A frame of a released version is never edited here, only added to.

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
fn enable() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::Enable,
        }),
        5,
        "2C0##10900000000000000000000000000000000000000000000000000000000000000000000000000000000\
        0000000005769F",
    );
}

#[test]
fn disable() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::Disable,
        }),
        5,
        "2C0##10901000000000000000000000000000000000000000000000000000000000000000000000000000000\
        0000000005A2BC",
    );
}

#[test]
fn fault_reset() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::FaultReset,
        }),
        5,
        "2C0##10902000000000000000000000000000000000000000000000000000000000000000000000000000000\
        0000000005CEF8",
    );
}

#[test]
fn stop() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::Stop,
        }),
        5,
        "2C0##10903000000000000000000000000000000000000000000000000000000000000000000000000000000\
        00000000051ADB",
    );
}

#[test]
fn move_joint() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::MoveJoint {
                target: [0.5, -1.0, 0.25, 2.0],
                speed: 1.0,
            },
        }),
        5,
        "2C0##109040000003F000080BF0000803E000000400000803F00000000000000000000000000000000000000\
        0000000005821D",
    );
}

#[test]
fn move_line() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::MoveLine {
                target: [0.5, -0.25, 0.125, 3.0],
                speed: 0.5,
            },
        }),
        5,
        "2C0##109050000003F000080BE0000003E000040400000003F00000000000000000000000000000000000000\
        000000000574CE",
    );
}

#[test]
fn jump() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::Jump {
                target: [0.75, 0.25, -0.25, -1.5],
                top: -0.125,
                clearance: 0.0625,
                speed: 1.0,
            },
        }),
        5,
        "2C0##109060000403F0000803E000080BE0000C0BF000000BE0000803D0000803F0000000000000000000000\
        00000000057A50",
    );
}

#[test]
fn payload() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::SetPayload {
                mass: 2.0,
                com: [0.0, 0.03125, -0.0625],
                inertia: [0.25, 0.5, 0.75],
            },
        }),
        5,
        "2C0##1090700000040000000000000003D000080BD0000803E0000003F0000403F0000000000000000000000\
        0000000005BE8D",
    );
}

#[test]
fn law() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::SelectLaw {
                law: Law::ComputedTorqueTask,
                compensation: Compensation::Observer,
            },
        }),
        5,
        "2C0##10908050200000000000000000000000000000000000000000000000000000000000000000000000000\
        00000000052A28",
    );
}

#[test]
fn gains() {
    check(
        Message::Motion(Motion {
            sequence: 9,
            request: MotionRequest::SetGains {
                bandwidth: 60.0,
                damping: 1.0,
                observer: 200.0,
            },
        }),
        5,
        "2C0##10909000070420000803F00004843000000000000000000000000000000000000000000000000000000\
        000000000572CC",
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
            // What the frame had no field for yet: zeros, as the padding was.
            fault_axis: FaultAxis::None,
            fault_value: 0.0,
            fault_limit: 0.0,
        }),
        128,
        "300##1090B003803090201FFFF1098020004010000003F000080BE0000003E000080BF000000000000000000\
        0000000080272E",
    );
}

/// A fault with its axis and number, in what was padding before.
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
        }),
        129,
        "300##1080B04200007010002000000000004020000003F000080BE27A0093B000080BF0327A0093B6F12033\
        B0000000081624D",
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
