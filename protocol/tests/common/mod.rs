//! Random messages that every receiver must accept, and a CRC written from its definition.

#![allow(dead_code, reason = "each test file uses its part")]

use proptest::array::{uniform3, uniform4};
use proptest::prelude::*;
use proptest::sample::select;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use protocol::frame::{CanFrame, StandardId};
use protocol::messages::*;
use protocol::schema::MessageInfo;

fn any_f32() -> impl Strategy<Value = f32> {
    use proptest::num::f32::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO
}

fn coordinates() -> impl Strategy<Value = [f32; 4]> {
    uniform4(-100.0..=100.0f32)
}

fn fraction() -> impl Strategy<Value = f32> {
    0.0..=1.0f32
}

fn tool_speed() -> impl Strategy<Value = f32> {
    0.0..=100.0f32
}

pub(crate) fn node() -> impl Strategy<Value = Node> {
    select(Node::ALL)
}

fn server() -> impl Strategy<Value = Server> {
    select(&[Server::Drives, Server::Controller][..])
}

fn nmt() -> impl Strategy<Value = Message> {
    (select(NmtCommand::ALL), any::<u8>())
        .prop_map(|(command, node)| Message::Nmt(Nmt { command, node }))
}

fn estop() -> impl Strategy<Value = Message> {
    (any::<u8>(), any::<u8>()).prop_map(|(reason, counter)| {
        Message::EStop(EStop {
            reason: EStopReason(reason),
            counter,
        })
    })
}

fn emergency() -> impl Strategy<Value = Message> {
    (node(), select(Cause::ALL), any::<u32>())
        .prop_map(|(node, cause, data)| Message::Emergency(node, Emergency::new(cause, data)))
}

pub(crate) fn feedback() -> impl Strategy<Value = Message> {
    (
        any::<u32>(),
        0..0x80u8,
        uniform4(any::<i32>()),
        uniform4(-2000.0..=2000.0f32),
        uniform4(any::<i16>()),
    )
        .prop_map(|(sample, status, position, velocity, torque)| {
            Message::Feedback(Feedback {
                sample,
                status: DriveStatus::from_bits(status).unwrap(),
                position,
                velocity,
                torque,
            })
        })
}

pub(crate) fn command() -> impl Strategy<Value = Message> {
    (any::<u32>(), 0..0x10u8, uniform4(-20.0..=20.0f32)).prop_map(|(sample, control, torque)| {
        Message::Command(Command {
            sample,
            control: ControlWord::from_bits(control).unwrap(),
            torque,
        })
    })
}

fn posture() -> impl Strategy<Value = Posture> {
    (select(ElbowSide::ALL), select(WristTurn::ALL))
        .prop_map(|(elbow, turn)| Posture { elbow, turn })
}

pub(crate) fn request() -> impl Strategy<Value = MotionRequest> {
    use MotionRequest as R;
    prop_oneof![
        select(&[R::Enable, R::Disable, R::FaultReset, R::Stop][..]),
        (coordinates(), fraction(), fraction()).prop_map(|(target, speed, zone)| R::MoveJoint {
            target,
            speed,
            zone
        }),
        (
            coordinates(),
            fraction(),
            posture(),
            tool_speed(),
            fraction()
        )
            .prop_map(|(target, speed, posture, tool_speed, zone)| R::MoveLine {
                target,
                speed,
                posture,
                tool_speed,
                zone
            }),
        (
            coordinates(),
            uniform3(-100.0..=100.0f32),
            fraction(),
            posture(),
            tool_speed(),
            fraction()
        )
            .prop_map(
                |(target, via, speed, posture, tool_speed, zone)| R::MoveArc {
                    target,
                    via,
                    speed,
                    posture,
                    tool_speed,
                    zone
                }
            ),
        (
            coordinates(),
            -100.0..=100.0f32,
            fraction(),
            fraction(),
            posture(),
            fraction()
        )
            .prop_map(|(target, top, clearance, speed, posture, zone)| R::Jump {
                target,
                top,
                clearance,
                speed,
                posture,
                zone
            }),
        (
            0.0..=100.0f32,
            uniform3(-1.0..=1.0f32),
            uniform3(0.0..=10.0f32)
        )
            .prop_map(|(mass, com, inertia)| R::SetPayload { mass, com, inertia }),
        (select(Law::ALL), select(Compensation::ALL))
            .prop_map(|(law, compensation)| R::SelectLaw { law, compensation }),
        (0.0..=1000.0f32, 0.0..=10.0f32, 0.0..=1000.0f32).prop_map(
            |(bandwidth, damping, observer)| R::SetGains {
                bandwidth,
                damping,
                observer
            }
        ),
        (0.0..=1.0f32).prop_map(|pace| R::SetOverride { pace }),
        select(Operation::ALL).prop_map(|operation| R::SetOperation { operation }),
        Just(R::Hold),
    ]
}

fn motion() -> impl Strategy<Value = Message> {
    (any::<u8>(), request())
        .prop_map(|(sequence, request)| Message::Motion(Motion { sequence, request }))
}

fn state() -> impl Strategy<Value = Message> {
    (
        (select(Mode::ALL), select(Cause::ALL), 0..0x4000u16),
        any::<(u8, u8, u16, u16, u32)>(),
        (
            select(Law::ALL),
            select(Compensation::ALL),
            select(Operation::ALL),
        ),
        uniform4(any_f32()),
        (
            select(FaultAxis::ALL),
            any_f32(),
            any_f32(),
            any::<u8>(),
            any::<i16>(),
        ),
    )
        .prop_map(|(status, counts, selected, tracking_error, fault)| {
            Message::State(State {
                mode: status.0,
                cause: status.1,
                limits: LimitFlags::from_bits(status.2).unwrap(),
                queue: counts.0,
                completed: counts.1,
                overruns: counts.2,
                rejected: counts.3,
                worst_tick: counts.4,
                law: selected.0,
                compensation: selected.1,
                tracking_error,
                fault_axis: fault.0,
                fault_value: fault.1,
                fault_limit: fault.2,
                pace: fault.3,
                operation: selected.2,
                burden: fault.4,
            })
        })
}

fn motion_reply() -> impl Strategy<Value = Message> {
    let refused = (
        select(RefusalReason::ALL),
        any::<u8>(),
        any_f32(),
        any_f32(),
    )
        .prop_map(|(reason, axis, value, limit)| {
            Outcome::Refused(Refusal {
                reason,
                axis,
                value,
                limit,
            })
        });
    (any::<u8>(), prop_oneof![Just(Outcome::Accepted), refused])
        .prop_map(|(sequence, outcome)| Message::MotionReply(MotionReply { sequence, outcome }))
}

fn hello() -> impl Strategy<Value = Hello> {
    any::<(u32, u32, u8)>().prop_map(|(schema, build, profile)| Hello {
        schema,
        build,
        profile,
    })
}

fn parameter_request() -> impl Strategy<Value = Message> {
    use ParameterRequest as R;
    let request = prop_oneof![
        any::<u16>().prop_map(|index| R::Get { index }),
        (any::<u16>(), any_f32()).prop_map(|(index, value)| R::Set { index, value }),
        any::<u16>().prop_map(|from| R::List { from }),
        hello().prop_map(R::Hello),
    ];
    (server(), request).prop_map(|(server, request)| Message::ParameterRequest(server, request))
}

fn parameter_reply() -> impl Strategy<Value = Message> {
    use ParameterReply as R;
    let reply = prop_oneof![
        (any::<u16>(), any_f32(), any_f32(), any_f32()).prop_map(|(index, value, lower, upper)| {
            R::Value {
                index,
                value,
                lower,
                upper,
            }
        }),
        (any::<u16>(), select(ParameterError::ALL), any_f32()).prop_map(|(index, error, limit)| {
            R::Error {
                index,
                error,
                limit,
            }
        }),
        hello().prop_map(R::Hello),
    ];
    (server(), reply).prop_map(|(server, reply)| Message::ParameterReply(server, reply))
}

pub(crate) fn heartbeat() -> impl Strategy<Value = Message> {
    (
        node(),
        select(Mode::ALL),
        select(Cause::ALL),
        select(ResetReason::ALL),
    )
        .prop_map(|(node, state, cause, reset)| {
            Message::Heartbeat(
                node,
                Heartbeat {
                    state,
                    cause,
                    reset,
                },
            )
        })
}

/// Any message with any allowed values.
pub(crate) fn message() -> impl Strategy<Value = Message> {
    prop_oneof![
        nmt(),
        estop(),
        emergency(),
        feedback(),
        command(),
        motion(),
        state(),
        motion_reply(),
        parameter_request(),
        parameter_reply(),
        heartbeat(),
    ]
}

/// CRC bit by bit, most significant bit first, as its polynomial division is defined: the second derivation.
pub(crate) fn bitwise_crc(width: u32, poly: u16, init: u16, xor_out: u16, bytes: &[u8]) -> u16 {
    let top = 1 << (width - 1);
    let mask = (top - 1) | top;
    let mut crc = init;
    for byte in bytes {
        for bit in (0..8).rev() {
            let feedback = (crc & top != 0) ^ (byte >> bit & 1 != 0);
            crc = crc << 1 & mask;
            if feedback {
                crc ^= poly;
            }
        }
    }
    crc ^ xor_out
}

/// CRC-16/IBM-3740 of identifier and bytes.
pub(crate) fn crc16(id: u16, bytes: &[u8]) -> u16 {
    let input: Vec<u8> = id
        .to_be_bytes()
        .into_iter()
        .chain(bytes.iter().copied())
        .collect();
    bitwise_crc(16, 0x1021, 0xFFFF, 0x0000, &input)
}

/// CRC-8/AUTOSAR of identifier and bytes.
pub(crate) fn crc8(id: u16, bytes: &[u8]) -> u8 {
    let input: Vec<u8> = id
        .to_be_bytes()
        .into_iter()
        .chain(bytes.iter().copied())
        .collect();
    bitwise_crc(8, 0x2F, 0xFF, 0xFF, &input) as u8
}

/// A small reproducible source of bytes (xorshift64), for tests that count.
pub(crate) struct Bytes(pub u64);

impl Bytes {
    pub(crate) fn next(&mut self) -> u8 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 32) as u8
    }
}

/// A frame on this identifier.
pub(crate) fn frame_of(id: u16, fd: bool, data: &[u8]) -> CanFrame {
    let id = StandardId::new(id).unwrap();
    if fd {
        CanFrame::fd(id, data, true)
    } else {
        CanFrame::classical(id, data)
    }
    .unwrap()
}

/// A frame with this body, zero-padded and correctly protected: an error of the sender's software, not of the wire.
pub(crate) fn protected(info: &MessageInfo, body: &[u8]) -> CanFrame {
    let mut data = vec![0; info.len];
    data[..body.len()].copy_from_slice(body);
    if let Some(profile) = info.protection {
        profile.protect(info.id, 1, &mut data);
    }
    frame_of(info.id, info.is_fd(), &data)
}

/// One of the random messages, always the same.
pub(crate) fn sample(strategy: impl Strategy<Value = Message>) -> Message {
    strategy
        .new_tree(&mut TestRunner::deterministic())
        .unwrap()
        .current()
}
