//! The trace tools against traces of known content: made here frame by frame, or by a run.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod check;
mod decode;
mod run;
mod stats;

use std::sync::LazyLock;

use firmware::mechanics::arm::IRB_930;
use plant_sim::check::{Checker, Offence};
use plant_sim::plot::{Plot, page};
use plant_sim::replay::Replay;
use plant_sim::run::execute;
use protocol::codec::{self, DecodeError};
use protocol::e2e::Verdict;
use protocol::frame::{CanFrame, StandardId};
use protocol::messages::{Command, ControlWord, DriveStatus, Feedback, Message};
use protocol::table;
use protocol::time::Period;
use protocol::wire::{BitTiming, FrameBits};
use sim::model::RobotModel;
use sim::rig::RigConfig;
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use sim::summary::Summary;
use trace::decode::{Decoder, Format};
use trace::difference::Difference;
use trace::stats::{BusStatistics, Gatherer, Statistics};
use trace::{Entry, ErrorFrame, Interface, Reader, Record};

fn record(time_us: u64, frame: CanFrame) -> Record {
    Record {
        time_us,
        interface: Interface::CAN0,
        direction: None,
        entry: Entry::Frame(frame),
    }
}

fn frame_of(record: &Record) -> CanFrame {
    match record.entry {
        Entry::Frame(frame) => frame,
        Entry::Error(_) => panic!("an error frame"),
    }
}

fn feedback(sample: u32) -> CanFrame {
    let feedback = Feedback {
        sample,
        status: DriveStatus::READY | DriveStatus::ENCODER_VALID,
        position: [1, -2, 3, -4],
        velocity: [0.5, -0.25, 0.0, 1000.0],
        torque: [0, -1, 1000, -1000],
    };
    codec::encode(&Message::Feedback(feedback), sample as u8).unwrap()
}

fn command(sample: u32, counter: u8, control: ControlWord, torque: [f32; 4]) -> CanFrame {
    let command = Command {
        sample,
        control,
        torque,
    };
    codec::encode(&Message::Command(command), counter).unwrap()
}

/// Samples 0 to 9 at 1 kHz, each answered after 200 us.
fn good() -> Vec<Record> {
    (0..10)
        .flat_map(|n: u32| {
            let time = 1000 * u64::from(n);
            [
                record(time, feedback(n)),
                record(
                    time + 200,
                    command(n, n as u8, ControlWord::EMPTY, [0.0; 4]),
                ),
            ]
        })
        .collect()
}

fn check(records: &[Record]) -> Option<(usize, Offence)> {
    let mut checker = Checker::new(&IRB_930);
    records
        .iter()
        .enumerate()
        .find_map(|(index, record)| checker.record(record).err().map(|offence| (index, offence)))
}

/// `good()` with record `index` replaced by another frame at the same time.
fn with(index: usize, frame: CanFrame) -> Vec<Record> {
    let mut records = good();
    records[index].entry = Entry::Frame(frame);
    records
}

fn without(index: usize) -> Vec<Record> {
    let mut records = good();
    records.remove(index);
    records
}

fn statistics(records: &[Record]) -> Statistics {
    let mut gatherer = Gatherer::new(BitTiming::default());
    for record in records {
        gatherer.record(record);
    }
    gatherer.statistics()
}

/// Statistics of the one interface.
fn bus(records: &[Record]) -> BusStatistics {
    statistics(records).interfaces.remove(0)
}
