//! The message table against the structs, and its consistency.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::message;
use proptest::prelude::*;
use protocol::codec;
use protocol::e2e::Profile;
use protocol::hash;
use protocol::messages::*;
use protocol::schema::{Content, Kind, MessageInfo, Rate, Signal};
use protocol::table::{self, TABLE};

/// Values of the signals present in a frame, read by the table alone.
fn by_table(info: &MessageInfo, data: &[u8]) -> Vec<(&'static str, Vec<f64>)> {
    let mut selected = None;
    let mut values = Vec::new();
    for signal in info.signals {
        if signal.when.is_some() && signal.when != selected {
            continue;
        }
        let numbers: Vec<f64> = data[signal.offset..signal.end()]
            .chunks(signal.kind.size())
            .map(|b| match signal.kind {
                Kind::U8 | Kind::Code(_) | Kind::Selector(_) | Kind::Flags8(_) => f64::from(b[0]),
                Kind::U16 | Kind::Flags16(_) => u16::from_le_bytes([b[0], b[1]]).into(),
                Kind::I16 => i16::from_le_bytes([b[0], b[1]]).into(),
                Kind::U32 => u32::from_le_bytes([b[0], b[1], b[2], b[3]]).into(),
                Kind::I32 => i32::from_le_bytes([b[0], b[1], b[2], b[3]]).into(),
                Kind::F32 { .. } => f32::from_le_bytes([b[0], b[1], b[2], b[3]]).into(),
            })
            .collect();
        assert_eq!(numbers.len(), signal.elements.len());
        if let Kind::Selector(_) = signal.kind {
            selected = Some(numbers[0] as u8);
        }
        values.push((signal.name, numbers));
    }
    values
}

/// The same values from the struct, field by field, with no codec in between.
fn by_struct(message: &Message) -> Vec<(&'static str, Vec<f64>)> {
    fn one(name: &'static str, value: impl Into<f64>) -> (&'static str, Vec<f64>) {
        (name, vec![value.into()])
    }
    fn many<const N: usize>(
        name: &'static str,
        values: [impl Into<f64>; N],
    ) -> (&'static str, Vec<f64>) {
        (name, values.map(Into::into).to_vec())
    }
    let hello = |tag: u8, name, hello: &Hello| {
        vec![
            one(name, tag),
            one("hello_schema", hello.schema),
            one("hello_build", hello.build),
            one("hello_profile", hello.profile),
        ]
    };
    match message {
        Message::Nmt(m) => vec![one("command", m.command.code()), one("node", m.node)],
        Message::EStop(m) => vec![one("reason", m.reason.0), one("counter", m.counter)],
        Message::Emergency(_, m) => vec![
            one("code", m.code),
            one("error_register", m.error_register),
            one("cause", m.cause.code()),
            one("data", m.data),
        ],
        Message::Feedback(m) => vec![
            one("sample", m.sample),
            one("status", m.status.bits()),
            many("position", m.position),
            many("velocity", m.velocity),
            many("torque", m.torque),
        ],
        Message::Command(m) => vec![
            one("sample", m.sample),
            one("control", m.control.bits()),
            many("torque", m.torque),
        ],
        Message::Motion(m) => {
            let mut values = vec![one("sequence", m.sequence)];
            values.extend(match m.request {
                MotionRequest::Enable => vec![one("request", 0)],
                MotionRequest::Disable => vec![one("request", 1)],
                MotionRequest::FaultReset => vec![one("request", 2)],
                MotionRequest::Stop => vec![one("request", 3)],
                MotionRequest::MoveJoint {
                    target,
                    speed,
                    zone,
                } => vec![
                    one("request", 4),
                    many("joint_target", target),
                    one("joint_speed", speed),
                    one("joint_zone", zone),
                ],
                MotionRequest::MoveLine {
                    target,
                    speed,
                    posture,
                    tool_speed,
                    zone,
                } => vec![
                    one("request", 5),
                    many("line_target", target),
                    one("line_speed", speed),
                    one("line_elbow", posture.elbow.code()),
                    one("line_turn", posture.turn.code()),
                    one("line_tool_speed", tool_speed),
                    one("line_zone", zone),
                ],
                MotionRequest::MoveArc {
                    target,
                    via,
                    speed,
                    posture,
                    tool_speed,
                    zone,
                } => vec![
                    one("request", 13),
                    many("arc_target", target),
                    many("arc_via", via),
                    one("arc_speed", speed),
                    one("arc_elbow", posture.elbow.code()),
                    one("arc_turn", posture.turn.code()),
                    one("arc_tool_speed", tool_speed),
                    one("arc_zone", zone),
                ],
                MotionRequest::Jump {
                    target,
                    top,
                    clearance,
                    speed,
                    posture,
                    zone,
                } => vec![
                    one("request", 6),
                    many("jump_target", target),
                    one("jump_top", top),
                    one("jump_clearance", clearance),
                    one("jump_speed", speed),
                    one("jump_elbow", posture.elbow.code()),
                    one("jump_turn", posture.turn.code()),
                    one("jump_zone", zone),
                ],
                MotionRequest::SetPayload { mass, com, inertia } => vec![
                    one("request", 7),
                    one("payload_mass", mass),
                    many("payload_com", com),
                    many("payload_inertia", inertia),
                ],
                MotionRequest::SelectLaw { law, compensation } => vec![
                    one("request", 8),
                    one("law", law.code()),
                    one("compensation", compensation.code()),
                ],
                MotionRequest::SetGains {
                    bandwidth: b,
                    damping: d,
                    observer: o,
                } => vec![
                    one("request", 9),
                    one("bandwidth", b),
                    one("damping", d),
                    one("observer", o),
                ],
                MotionRequest::SetOverride { pace } => {
                    vec![one("request", 10), one("override_pace", pace)]
                }
                MotionRequest::SetOperation { operation } => {
                    vec![one("request", 11), one("operation", operation.code())]
                }
                MotionRequest::Hold => vec![one("request", 12)],
            });
            values
        }
        Message::State(m) => vec![
            one("mode", m.mode.code()),
            one("cause", m.cause.code()),
            one("limits", m.limits.bits()),
            one("queue", m.queue),
            one("completed", m.completed),
            one("overruns", m.overruns),
            one("rejected", m.rejected),
            one("worst_tick", m.worst_tick),
            one("law", m.law.code()),
            one("compensation", m.compensation.code()),
            many("tracking_error", m.tracking_error),
            one("fault_axis", m.fault_axis.code()),
            one("fault_value", m.fault_value),
            one("fault_limit", m.fault_limit),
            one("pace", m.pace),
            one("operation", m.operation.code()),
            one("burden", m.burden),
        ],
        Message::MotionReply(m) => match m.outcome {
            Outcome::Accepted => vec![one("sequence", m.sequence), one("outcome", 0)],
            Outcome::Refused(refusal) => vec![
                one("sequence", m.sequence),
                one("outcome", 1),
                one("reason", refusal.reason.code()),
                one("axis", refusal.axis),
                one("value", refusal.value),
                one("limit", refusal.limit),
            ],
        },
        Message::ParameterReply(_, m) => match *m {
            ParameterReply::Value {
                index,
                value,
                lower,
                upper,
            } => vec![
                one("reply", 0),
                one("value_index", index),
                one("value", value),
                one("value_lower", lower),
                one("value_upper", upper),
            ],
            ParameterReply::Error {
                index,
                error,
                limit,
            } => vec![
                one("reply", 1),
                one("error_index", index),
                one("error", error.code()),
                one("error_limit", limit),
            ],
            ParameterReply::Hello(m) => hello(2, "reply", &m),
        },
        Message::ParameterRequest(_, m) => match *m {
            ParameterRequest::Get { index } => vec![one("request", 0), one("get_index", index)],
            ParameterRequest::Set { index, value } => vec![
                one("request", 1),
                one("set_index", index),
                one("set_value", value),
            ],
            ParameterRequest::List { from } => vec![one("request", 2), one("list_from", from)],
            ParameterRequest::Hello(m) => hello(3, "request", &m),
        },
        Message::Heartbeat(_, m) => vec![
            one("state", m.state.code()),
            one("cause", m.cause.code()),
            one("reset", m.reset.code()),
        ],
    }
}

/// Content of the message, by the struct.
fn content(message: &Message) -> Content {
    match *message {
        Message::Nmt(_) => Content::Nmt,
        Message::EStop(_) => Content::EStop,
        Message::Emergency(node, _) => Content::Emergency(node),
        Message::Feedback(_) => Content::Feedback,
        Message::Command(_) => Content::Command,
        Message::Motion(_) => Content::Motion,
        Message::State(_) => Content::State,
        Message::MotionReply(_) => Content::MotionReply,
        Message::ParameterReply(server, _) => Content::ParameterReply(server),
        Message::ParameterRequest(server, _) => Content::ParameterRequest(server),
        Message::Heartbeat(node, _) => Content::Heartbeat(node),
    }
}

proptest! {
    #[test]
    fn table_and_struct_give_one_layout(message in message()) {
        let frame = codec::encode(&message, 0).unwrap();
        let info = table::of_frame(&frame).unwrap();
        prop_assert_eq!(info.content, content(&message));
        prop_assert_eq!((frame.is_fd(), frame.data().len()), (info.is_fd(), info.len));
        prop_assert_eq!(by_table(info, frame.data()), by_struct(&message));
    }
}

/// No gap, no overlap: every byte up to the padding belongs to one signal, in each variant of a message.
#[test]
fn signals_stand_side_by_side() {
    for info in TABLE {
        let tags = info.signals.iter().find_map(|signal| match signal.kind {
            Kind::Selector(tags) => Some(tags),
            _ => None,
        });
        let variants: Vec<Option<u8>> =
            tags.map_or(vec![None], |tags| tags.iter().map(|t| Some(t.0)).collect());
        for variant in variants {
            let mut end = 0;
            for signal in info
                .signals
                .iter()
                .filter(|s| s.when.is_none() || s.when == variant)
            {
                assert_eq!(signal.offset, end, "{} {}", info.name, signal.name);
                end = signal.end();
            }
            assert!(end <= info.body_len(), "{}", info.name);
        }
        // A shorter frame would not hold the longest variant.
        let ends = info.signals.iter().map(|signal| signal.end());
        let longest = ends.max().unwrap() + info.len - info.body_len();
        let needed = if info.is_fd() {
            protocol::frame::fd_length(longest).unwrap()
        } else {
            longest
        };
        assert_eq!(info.len, needed, "{}", info.name);
    }
}

#[test]
fn names_are_unique_and_identifiers_in_order() {
    for (k, info) in TABLE.iter().enumerate() {
        assert!(
            TABLE[..k]
                .iter()
                .all(|other| other.name != info.name && other.id < info.id)
        );
        for (k, signal) in info.signals.iter().enumerate() {
            assert!(
                info.signals[..k]
                    .iter()
                    .all(|other| other.name != signal.name)
            );
        }
    }
}

/// Whatever changes the meaning of a byte changes the hash.
#[test]
fn the_hash_sees_every_part_of_the_table() {
    assert_eq!(hash::schema(&TABLE), table::HASH);
    // FNV-1a of nothing is its offset basis.
    assert_eq!(hash::schema(&[]), 0x811C_9DC5);
    let mut hashes = vec![table::HASH];
    let mut hash_with = |k: usize, change: &dyn Fn(&mut MessageInfo)| {
        let mut info = *TABLE[k];
        change(&mut info);
        let mut table = TABLE;
        table[k] = &info;
        hashes.push(hash::schema(&table));
    };
    for (k, signals) in TABLE.iter().map(|info| info.signals).enumerate() {
        hash_with(k, &|info| info.name = "Other");
        hash_with(k, &|info| info.id ^= 1);
        hash_with(k, &|info| info.len += 1);
        hash_with(k, &|info| info.rate = Rate::Hertz(7));
        hash_with(k, &|info| info.signals = &info.signals[1..]);
        hash_with(k, &|info| {
            info.sender = match info.sender {
                None => Some(Node::Drives),
                Some(_) => None,
            };
        });
        hash_with(k, &|info| {
            info.protection = match info.protection {
                None => Some(Profile::Classical),
                Some(_) => None,
            };
        });
        let range = |min, max| Kind::F32 { min, max };
        for s in 0..signals.len() {
            let mut with_signal = |change: &dyn Fn(&mut Signal)| {
                let mut signals = signals.to_vec();
                change(&mut signals[s]);
                let signals: &'static [Signal] = signals.leak();
                hash_with(k, &|info| info.signals = signals);
            };
            with_signal(&|signal| signal.name = "other");
            with_signal(&|signal| signal.offset += 1);
            with_signal(&|signal| signal.elements = &[("", "furlong")]);
            with_signal(&|signal| signal.when = Some(99));
            with_signal(&|signal| signal.kind = range(-1.5, 1.5));
            with_signal(&|signal| signal.kind = range(-1.5, 2.5));
            with_signal(&|signal| signal.kind = range(-2.5, 1.5));
            with_signal(&|signal| signal.kind = Kind::Code(&[(0, "other")]));
            with_signal(&|signal| signal.kind = Kind::Code(&[(1, "other")]));
            with_signal(&|signal| signal.kind = Kind::Flags8(&["other"]));
        }
    }
    let count = hashes.len();
    hashes.sort_unstable();
    hashes.dedup();
    assert_eq!(hashes.len(), count, "two different tables have one hash");
}
