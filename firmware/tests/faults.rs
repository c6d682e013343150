//! The fault table: against a second copy written by hand, and against the docs.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::fmt::Write;

use firmware::control::fault::{Latch, Limit, REACTIONS, Reaction};
use protocol::messages::Cause;

#[path = "common/table.rs"]
mod table;

/// A second copy of the table, from the safety rules and not from the code: cause, limit, reaction in normal operation,
/// while stopping and while the brake closes, and what ends the fault.
const ORACLE: &str = "
self-test       at once      nothing        nothing        nothing        restart
feedback-lost   5 ms         stop           brake          nothing        reset
babbling        32 frames    stop           brake          nothing        reset
bus-off         at once      stop           brake          nothing        reset
overrun         5 samples    stop           brake          nothing        reset
peer-silent     100 ms       off            off            off            reset
operator-silent 250 ms       stop           nothing        nothing        reset
reordered       3 frames     stop           brake          nothing        reset
late            3 frames     stop           nothing        nothing        reset
corrupted       3 frames     stop           brake          nothing        reset
duplicate-node  at once      stop           nothing        nothing        reset
bad-value       3 frames     off            off            off            reset
following-error each axis    stop           brake          off            reset
stuck-sensor    each axis    off            off            off            reset
over-speed      each axis    stop           brake          off            reset
over-torque     200 ms       stop           brake          nothing        reset
soft-limit      each axis    stop           nothing        nothing        reset
estop           at once      emergency stop emergency stop emergency stop reset
drive-fault     at once      brake          brake          nothing        reset
encoder-fault   at once      off            off            off            reset
collision       each axis    stop           off            off            reset
chatter         80 %         off            off            off            reset
overload        120 %        stop           nothing        nothing        reset
";

fn limit(limit: Limit) -> String {
    match limit {
        Limit::AtOnce => "at once".into(),
        Limit::Milliseconds(ms) => format!("{ms} ms"),
        Limit::Frames(frames) => format!("{frames} frames"),
        Limit::Samples(samples) => format!("{samples} samples"),
        Limit::Percent(share) => format!("{share} %"),
        Limit::EachAxis => "each axis".into(),
    }
}

fn reaction(reaction: Reaction) -> &'static str {
    match reaction {
        Reaction::None => "nothing",
        Reaction::Stop => "stop",
        Reaction::Brake => "brake",
        Reaction::Off => "off",
        Reaction::EmergencyStop => "emergency stop",
    }
}

fn latch(latch: Latch) -> &'static str {
    match latch {
        Latch::Reset => "reset",
        Latch::Restart => "restart",
    }
}

/// What detects the cause, for the docs; no code depends on it.
fn seen_by(cause: Cause) -> &'static str {
    match cause {
        Cause::SelfTest => "known answers of mathematics, kinematics and CRC; ranges of the model",
        Cause::FeedbackLost => "sample number of the next feedback",
        Cause::Babbling => {
            "frames that are no message, with no feedback in between; felt where feedback is lost, the drives have let go, or nothing is heard of them"
        }
        Cause::BusOff => "CAN controller",
        Cause::Overrun => "time of a sample",
        Cause::PeerSilent => {
            "age of the feedback; of the heartbeat of the drives, as of the operator's"
        }
        Cause::OperatorSilent => "age of the operator's heartbeat, once one was heard",
        Cause::Reordered => "counter of the feedback: repeated or old",
        Cause::Late => {
            "drives: their newest command answers a sample of 2 ms before, or older, as feedback or command was held up"
        }
        Cause::Corrupted => "format, length or CRC of the feedback",
        Cause::DuplicateNode => "frame that only the controller sends",
        Cause::BadValue => "value in the feedback; once in a torque of the law",
        Cause::FollowingError => "reference against encoder",
        Cause::StuckSensor => {
            "reference, effort, or torque at its limit, against an encoder that does not move"
        }
        Cause::OverSpeed => "speed of the encoder; in manual operation of the tool",
        Cause::OverTorque => "a torque cut to its limit while the axis hardly moves",
        Cause::SoftLimit => "position against range",
        Cause::EStop => "emergency stop on the bus",
        Cause::DriveFault => {
            "status of the drives: a fault, torque off by themselves, a brake that does not close or open, or does so by itself"
        }
        Cause::EncoderFault => {
            "status of the drives; a jump no axis can make; away from the reference, faster and faster, against the torque"
        }
        Cause::Collision => "effort that the model does not explain, by the observer",
        Cause::Chatter => {
            "torques that swing from sample to sample, or more often than a plan's can"
        }
        Cause::Overload => "mean square of the effort over that of continuous operation",
        other => panic!("{other} is in the table: say what detects it"),
    }
}

#[test]
fn the_table_is_that_of_the_safety_rules() {
    let mut oracle: Vec<&str> = ORACLE.trim().lines().collect();
    for row in &REACTIONS {
        let line = format!(
            "{:15} {:12} {:14} {:14} {:14} {}",
            row.cause.name(),
            limit(row.limit),
            reaction(row.reaction),
            reaction(row.stopping),
            reaction(row.closing),
            latch(row.latch)
        );
        let at = oracle.iter().position(|expected| *expected == line);
        oracle.remove(at.unwrap_or_else(|| panic!("not expected, or twice: {line}")));
    }
    assert!(oracle.is_empty(), "missing: {oracle:?}");
}

#[test]
fn the_docs_have_the_table() {
    let mut text = String::from(
        "| fault | seen by | limit | reaction | while stopping | while the brake closes | until |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for row in &REACTIONS {
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} |",
            row.cause,
            seen_by(row.cause),
            limit(row.limit),
            reaction(row.reaction),
            reaction(row.stopping),
            reaction(row.closing),
            latch(row.latch)
        );
    }
    table::compare("faults", &text);
}
