//! The gate with a fault.

use protocol::codec;
use protocol::messages::{Cause, Message};
use sim::scenario::Scenario;
use sim::summary::Summary;

use crate::record::{Record, run_of};

/// One cycle of the gate with this fault, and everything that is seen of it.
pub(crate) fn gate(fault: &str) -> (Summary, Record) {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 1;
    run_of(scenario, &[fault], 5)
}

/// Cause of the first emergency.
pub(crate) fn cause(record: &Record) -> Cause {
    let causes =
        record
            .frames
            .iter()
            .filter_map(|(_, frame)| match codec::decode(frame).ok()?.message {
                Message::Emergency(_, emergency) => Some(emergency.cause),
                _ => None,
            });
    causes.into_iter().next().unwrap_or(Cause::None)
}
