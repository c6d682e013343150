//! A node reset by network management counts from its start: neither check nor statistics treat that as a violation.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use firmware::mechanics::arm::IRB_930;
use plant_sim::check::{Checker, Offence};
use protocol::codec;
use protocol::e2e::Verdict;
use protocol::frame::CanFrame;
use protocol::messages::{
    Command, ControlWord, DriveStatus, Feedback, Message, Nmt, NmtCommand, Node,
};
use protocol::wire::BitTiming;
use trace::stats::Gatherer;
use trace::{Entry, Interface, Record};

fn record(time_us: u64, message: Message, counter: u8) -> Record {
    let frame: CanFrame = codec::encode(&message, counter).unwrap();
    Record {
        time_us,
        interface: Interface::CAN0,
        direction: None,
        entry: Entry::Frame(frame),
    }
}

/// Five samples from `start` on; the counters of feedback and command begin as given.
fn samples(start: u64, first: u32, feedback: u8, command: u8) -> Vec<Record> {
    let pair = |n: u8| {
        let time = start + 1000 * u64::from(n);
        let sample = first + u32::from(n);
        let measured = Message::Feedback(Feedback {
            sample,
            status: DriveStatus::READY,
            position: [0; 4],
            velocity: [0.0; 4],
            torque: [0; 4],
        });
        let answer = Message::Command(Command {
            sample,
            control: ControlWord::EMPTY,
            torque: [0.0; 4],
        });
        [
            record(time, measured, feedback + n),
            record(time + 200, answer, command + n),
        ]
    };
    (0..5).flat_map(pair).collect()
}

fn reset(time_us: u64, node: u8) -> Record {
    let command = NmtCommand::ResetNode;
    record(time_us, Message::Nmt(Nmt { command, node }), 0)
}

fn offence(records: &[Record]) -> Option<Offence> {
    let mut checker = Checker::new(&IRB_930);
    records
        .iter()
        .find_map(|record| checker.record(record).err())
}

fn stale(records: &[Record]) -> u64 {
    let mut gatherer = Gatherer::new(BitTiming::default());
    for record in records {
        gatherer.record(record);
    }
    let ids = gatherer.statistics().interfaces.remove(0).ids;
    ids.iter().map(|id| id.stale + id.duplicate + id.lost).sum()
}

#[test]
fn the_controller_begins_anew_after_its_reset() {
    let before = samples(0, 0, 0, 100);
    let after = samples(5_000, 5, 5, 0);
    let with = |node| [&before[..], &[reset(4_900, node)], &after].concat();
    for node in [0, Node::Controller.code()] {
        assert_eq!(offence(&with(node)), None);
        assert_eq!(stale(&with(node)), 0);
    }
    // No node or another one was reset: then the command is an old one.
    for records in [
        [&before[..], &after].concat(),
        with(Node::Drives.code()),
        with(5),
    ] {
        assert!(matches!(
            offence(&records),
            Some(Offence::Counter {
                message: "Command",
                verdict: Verdict::Stale(_),
                ..
            })
        ));
        assert!(stale(&records) > 0);
    }
}

/// Restarted drives number their samples anew, after a time in which nothing is due.
#[test]
fn the_drives_begin_anew_after_their_reset() {
    let before = samples(0, 1000, 200, 0);
    let after = samples(2_000_000, 0, 0, 5);
    let with = |node| [&before[..], &[reset(4_900, node)], &after].concat();
    // The controller had nothing to answer either.
    assert_eq!(offence(&with(0)), None);
    assert!(offence(&with(Node::Controller.code())).is_some());
    assert_eq!(stale(&with(0)), 0);
}
