//! The message table: the meaning of every identifier, byte by byte.
//!
//! Codec (ranges), schema hash and DBC come from this table; the structs of [`messages`](crate::messages) mirror it in
//! Rust, and tests compare the two. Every message has exactly one length and one sender per
//! identifier.
//!
//! Identifiers follow CANopen's predefined connection set (CiA 301), with the drives as node 40h, the controller as 41h
//! and the operator as 42h:
//!
//! | identifier | CANopen | here |
//! |---|---|---|
//! | 000h | NMT | the same |
//! | 001h | global fail-safe command of CANopen Safety (EN 50325-5), an empty frame | emergency stop, empty or not |
//! | 080h + n | EMCY of node n | the same |
//! | 1C0h | 180h + 40h: first transmit PDO of the drives | feedback |
//! | 240h | 200h + 40h: first receive PDO of the drives | command |
//! | 2C0h, 300h, 340h | band of the second PDOs | motion, state and reply, by urgency |
//! | 580h + n, 600h + n | SDO of server n: reply, request | parameters (own format, one frame each) |
//! | 700h + n | heartbeat of node n: its state | the same, longer and protected |
//!
//! Cyclic and urgent messages thus win arbitration over the others.

use crate::e2e::Profile;
use crate::frame::{self, CanFrame, Id};
use crate::hash;
use crate::messages::{Hello, Node, Server};
use crate::schema::{Content, Kind, MessageInfo, Rate};
use crate::signals;

/// Network management.
pub static NMT: MessageInfo = MessageInfo {
    name: "Nmt",
    id: 0x000,
    sender: Some(Node::Operator),
    receiver: None,
    rate: Rate::Event,
    len: 2,
    protection: None,
    content: Content::Nmt,
    signals: signals::NMT,
};

/// Emergency stop; also valid with length 0.
pub static ESTOP: MessageInfo = MessageInfo {
    name: "EStop",
    id: 0x001,
    sender: None,
    receiver: None,
    rate: Rate::Event,
    len: 2,
    protection: None,
    content: Content::EStop,
    signals: signals::ESTOP,
};

/// Emergency of the drives. Reserved: not sent yet.
pub static DRIVES_EMERGENCY: MessageInfo = emergency_of("DrivesEmergency", Node::Drives);
/// Emergency of the controller.
pub static CONTROLLER_EMERGENCY: MessageInfo =
    emergency_of("ControllerEmergency", Node::Controller);
/// Emergency of the operator. Reserved: not sent yet.
pub static OPERATOR_EMERGENCY: MessageInfo = emergency_of("OperatorEmergency", Node::Operator);

const fn emergency_of(name: &'static str, node: Node) -> MessageInfo {
    MessageInfo {
        name,
        id: 0x080 + node.code() as u16,
        sender: Some(node),
        receiver: None,
        rate: Rate::Event,
        len: 8,
        protection: None,
        content: Content::Emergency(node),
        signals: signals::EMERGENCY,
    }
}

/// Feedback of the drives.
pub static FEEDBACK: MessageInfo = MessageInfo {
    name: "Feedback",
    id: 0x1C0,
    sender: Some(Node::Drives),
    receiver: Some(Node::Controller),
    rate: Rate::EverySample,
    len: 48,
    protection: Some(Profile::Fd),
    content: Content::Feedback,
    signals: signals::FEEDBACK,
};

/// Command to the drives.
pub static COMMAND: MessageInfo = MessageInfo {
    name: "Command",
    id: 0x240,
    sender: Some(Node::Controller),
    receiver: Some(Node::Drives),
    rate: Rate::EverySample,
    len: 24,
    protection: Some(Profile::Fd),
    content: Content::Command,
    signals: signals::COMMAND,
};

/// Request of the operator.
pub static MOTION: MessageInfo = MessageInfo {
    name: "Motion",
    id: 0x2C0,
    sender: Some(Node::Operator),
    receiver: Some(Node::Controller),
    rate: Rate::Event,
    len: 48,
    protection: Some(Profile::Fd),
    content: Content::Motion,
    signals: signals::MOTION,
};

/// Report of the controller.
pub static STATE: MessageInfo = MessageInfo {
    name: "State",
    id: 0x300,
    sender: Some(Node::Controller),
    receiver: None,
    rate: Rate::Hertz(50),
    len: 48,
    protection: Some(Profile::Fd),
    content: Content::State,
    signals: signals::STATE,
};

/// Answer to a request.
pub static MOTION_REPLY: MessageInfo = MessageInfo {
    name: "MotionReply",
    id: 0x340,
    sender: Some(Node::Controller),
    receiver: Some(Node::Operator),
    rate: Rate::Event,
    len: 16,
    protection: Some(Profile::Fd),
    content: Content::MotionReply,
    signals: signals::MOTION_REPLY,
};

/// Answer of the drives to the controller.
pub static DRIVES_PARAMETER_REPLY: MessageInfo =
    reply_of("DrivesParameterReply", Server::Drives, Node::Controller);
/// Answer of the controller to the operator.
pub static CONTROLLER_PARAMETER_REPLY: MessageInfo = reply_of(
    "ControllerParameterReply",
    Server::Controller,
    Node::Operator,
);

const fn reply_of(name: &'static str, server: Server, client: Node) -> MessageInfo {
    MessageInfo {
        name,
        id: 0x580 + server.node().code() as u16,
        sender: Some(server.node()),
        receiver: Some(client),
        rate: Rate::Event,
        len: 20,
        protection: Some(Profile::Fd),
        content: Content::ParameterReply(server),
        signals: signals::PARAMETER_REPLY,
    }
}

/// Request of the controller to the drives.
pub static DRIVES_PARAMETER_REQUEST: MessageInfo =
    request_of("DrivesParameterRequest", Server::Drives, Node::Controller);
/// Request of the operator to the controller.
pub static CONTROLLER_PARAMETER_REQUEST: MessageInfo = request_of(
    "ControllerParameterRequest",
    Server::Controller,
    Node::Operator,
);

const fn request_of(name: &'static str, server: Server, client: Node) -> MessageInfo {
    MessageInfo {
        name,
        id: 0x600 + server.node().code() as u16,
        sender: Some(client),
        receiver: Some(server.node()),
        rate: Rate::Event,
        len: 16,
        protection: Some(Profile::Fd),
        content: Content::ParameterRequest(server),
        signals: signals::PARAMETER_REQUEST,
    }
}

/// Heartbeat of the drives.
pub static DRIVES_HEARTBEAT: MessageInfo = heartbeat_of("DrivesHeartbeat", Node::Drives);
/// Heartbeat of the controller.
pub static CONTROLLER_HEARTBEAT: MessageInfo =
    heartbeat_of("ControllerHeartbeat", Node::Controller);
/// Heartbeat of the operator.
pub static OPERATOR_HEARTBEAT: MessageInfo = heartbeat_of("OperatorHeartbeat", Node::Operator);

const fn heartbeat_of(name: &'static str, node: Node) -> MessageInfo {
    MessageInfo {
        name,
        id: 0x700 + node.code() as u16,
        sender: Some(node),
        receiver: None,
        rate: Rate::Hertz(10),
        len: 5,
        protection: Some(Profile::Classical),
        content: Content::Heartbeat(node),
        signals: signals::HEARTBEAT,
    }
}

/// Every message, in the order of arbitration.
pub static TABLE: [&MessageInfo; 17] = [
    &NMT,
    &ESTOP,
    &DRIVES_EMERGENCY,
    &CONTROLLER_EMERGENCY,
    &OPERATOR_EMERGENCY,
    &FEEDBACK,
    &COMMAND,
    &MOTION,
    &STATE,
    &MOTION_REPLY,
    &DRIVES_PARAMETER_REPLY,
    &CONTROLLER_PARAMETER_REPLY,
    &DRIVES_PARAMETER_REQUEST,
    &CONTROLLER_PARAMETER_REQUEST,
    &DRIVES_HEARTBEAT,
    &CONTROLLER_HEARTBEAT,
    &OPERATOR_HEARTBEAT,
];

/// Emergency of this node.
#[must_use]
pub const fn emergency(node: Node) -> &'static MessageInfo {
    match node {
        Node::Drives => &DRIVES_EMERGENCY,
        Node::Controller => &CONTROLLER_EMERGENCY,
        Node::Operator => &OPERATOR_EMERGENCY,
    }
}

/// Hash of the whole table, computed at compile time: two nodes with the same hash agree on every identifier, length,
/// offset, type, range, unit and code.
pub const HASH: u32 = hash::schema(&TABLE);

/// What every node of this version says in the handshake.
pub const HELLO: Hello = Hello {
    schema: HASH,
    build: number(env!("CARGO_PKG_VERSION_MAJOR")) << 16
        | number(env!("CARGO_PKG_VERSION_MINOR")) << 8
        | number(env!("CARGO_PKG_VERSION_PATCH")),
    profile: Hello::PROFILE_FD,
};

/// A part of the version as a byte of the build.
const fn number(text: &str) -> u32 {
    let number = match u32::from_str_radix(text, 10) {
        Ok(number) => number,
        Err(_) => u32::MAX,
    };
    assert!(number < 256, "a part of the version is no byte");
    number
}

/// Message of this 11-bit identifier, or `None`.
#[must_use]
pub fn find(id: u16) -> Option<&'static MessageInfo> {
    TABLE.iter().copied().find(|info| info.id == id)
}

/// Message of a frame by its identifier, or `None`; the table has no extended identifiers.
#[must_use]
pub fn of_frame(frame: &CanFrame) -> Option<&'static MessageInfo> {
    match frame.id() {
        Id::Standard(id) => find(id.as_raw()),
        Id::Extended(_) => None,
    }
}

/// Heartbeat of this node.
#[must_use]
pub const fn heartbeat(node: Node) -> &'static MessageInfo {
    match node {
        Node::Drives => &DRIVES_HEARTBEAT,
        Node::Controller => &CONTROLLER_HEARTBEAT,
        Node::Operator => &OPERATOR_HEARTBEAT,
    }
}

/// Answers of this server.
#[must_use]
pub const fn parameter_reply(server: Server) -> &'static MessageInfo {
    match server {
        Server::Drives => &DRIVES_PARAMETER_REPLY,
        Server::Controller => &CONTROLLER_PARAMETER_REPLY,
    }
}

/// Requests to this server.
#[must_use]
pub const fn parameter_request(server: Server) -> &'static MessageInfo {
    match server {
        Server::Drives => &DRIVES_PARAMETER_REQUEST,
        Server::Controller => &CONTROLLER_PARAMETER_REQUEST,
    }
}

/// Every message fits its frame, and none can be mistaken for another.
const _: () = {
    let mut messages: &[&MessageInfo] = &TABLE;
    while let [info, rest @ ..] = messages {
        let longest = if info.is_fd() {
            frame::FD_MAX
        } else {
            frame::CLASSICAL_MAX
        };
        assert!(info.id <= 0x7FF && info.len <= longest);
        assert!(matches!(frame::fd_length(info.len), Some(len) if len == info.len));
        let mut signals = info.signals;
        while let [signal, rest @ ..] = signals {
            assert!(signal.end() <= info.body_len());
            // The codec's range check refuses infinities and NaN only if the range is finite.
            if let Kind::F32 { min, max } = signal.kind {
                assert!(min.is_finite() && max.is_finite() && min < max);
            }
            signals = rest;
        }
        if let [next, ..] = rest {
            assert!(info.id < next.id);
        }
        messages = rest;
    }
};
