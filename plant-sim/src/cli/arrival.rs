//! Frames received from a bus, as records of a trace.

use std::time::{SystemTime, UNIX_EPOCH};

use link::{Arrival, Event};
use trace::{Entry, ErrorFrame, Interface, Record};

/// The record; `None` for a report of the CAN controller without a class.
pub(super) fn record(arrival: &Arrival, interface: Interface) -> Option<Record> {
    let entry = match arrival.event {
        Event::Frame(frame) => Entry::Frame(frame),
        Event::Error { class, data } => Entry::Error(ErrorFrame::new(class, &data)?),
    };
    Some(Record {
        time_us: microseconds(arrival.at),
        interface,
        direction: None,
        entry,
    })
}

/// Microseconds since 1970.
pub(super) fn microseconds(time: SystemTime) -> u64 {
    time.duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_micros() as u64)
}
