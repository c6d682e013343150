//! Feedback and commands that come late, all the time or for a moment.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/gate.rs"]
mod gate;
#[path = "common/record.rs"]
mod record;

use gate::{cause, gate};
use protocol::messages::Cause;
use record::run_of;
use sim::scenario::Scenario;

/// What is late leaves no gap in any number: it is told as that, whichever way is held up, whatever the rate and load, within the 7 samples
/// and twice the delay that docs/safety.md promises.
#[test]
fn what_stays_late_is_told_as_late() {
    for (rate, kg, fault, late_ms) in [
        (1000.0, 2.0, "feedback:delay=0.0025", 2.5),
        (1000.0, 22.0, "feedback:delay=0.004", 4.0),
        (1000.0, 2.0, "feedback:delay=0.0055", 5.5),
        (1000.0, 22.0, "command:delay=0.0025", 2.5),
        (1000.0, 2.0, "command:delay=0.0055", 5.5),
        (1000.0, 22.0, "command:replay=3", 3.0),
        (1000.0, 2.0, "command:replay=5", 5.0),
        (500.0, 2.0, "feedback:delay=0.004", 4.0),
        (500.0, 2.0, "command:delay=0.006", 6.0),
        (2000.0, 2.0, "feedback:delay=0.002", 2.0),
        (2000.0, 2.0, "command:delay=0.002", 2.0),
    ] {
        for begin in [0.3, 0.4137, 0.5231] {
            let mut scenario = Scenario::built_in("gate").unwrap();
            scenario.cycles = 1;
            scenario.rate_hz = rate;
            scenario.carry(kg).unwrap();
            let fault = format!("{fault}@{begin}s");
            let (summary, record) = run_of(scenario, &[&fault], 5);
            assert_eq!(cause(&record), Cause::Late, "{rate} Hz, {kg} kg, {fault}");
            let due = begin + 7.0 / rate + 2e-3 * late_ms;
            let told = summary.faults[0].time_s;
            assert!(
                told <= due,
                "{rate} Hz, {kg} kg, {fault}: {told}, due {due}"
            );
        }
    }
}

/// A gap of less than 5 ms is bridged above 1 kHz, too, where five samples are over sooner, and 32 attempts in vain are a bus-off.
#[test]
fn above_1_khz_a_command_is_held_for_as_long() {
    for (fault, expected) in [
        ("feedback:loss@0.4003s..+3.5ms", Cause::None),
        ("command:loss@0.4003s..+3.5ms", Cause::None),
        ("command:crc-error@0.4s", Cause::BusOff),
        ("command:loss@0.4s", Cause::DriveFault),
    ] {
        let mut scenario = Scenario::built_in("gate").unwrap();
        scenario.cycles = 1;
        scenario.rate_hz = 2000.0;
        let (_, record) = run_of(scenario, &[fault], 5);
        assert_eq!(cause(&record), expected, "{fault}");
    }
}

/// Nor is a burst late that a bus without room holds up for a moment, nor what two clocks make of the time.
#[test]
fn what_catches_up_is_not_late() {
    for fault in [
        "feedback:delay=0.0009@0.4s",
        "command:delay=0.0009@0.4s",
        "operator:babbling@0.4s..+2ms",
        "feedback:loss@0.4s..+2ms",
        "command:loss@0.4s..+3ms",
        "clock:drift=0.0001@0.1s",
        "clock:drift=-0.0001@0.1s",
    ] {
        let (summary, record) = gate(fault);
        assert!(summary.completed, "{fault}: {:?}", summary.error);
        assert_eq!(cause(&record), Cause::None, "{fault}");
    }
}
