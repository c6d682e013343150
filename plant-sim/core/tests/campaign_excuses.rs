//! What the judge of campaigns does not hold against a controller, as the controller can do nothing about it.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use sim::campaign::trial;
use sim::campaign::verdict::Verdict;
use sim::controller::InProcess;
use sim::scenario::{Change, Scenario, built_in};
use sim::setup::RunConfig;

fn judge(changes: &[&str], faults: &[&str]) -> Verdict {
    let changes: Vec<Change> = changes.iter().map(|it| it.parse().unwrap()).collect();
    let mut scenario = Scenario::parse_with(built_in("gate").unwrap(), "gate", &changes).unwrap();
    scenario.cycles = 1;
    scenario.faults = faults.iter().map(|text| text.parse().unwrap()).collect();
    let connect = |config| Ok(InProcess::new(config));
    let (verdict, ..) = trial::run(&RunConfig::new(scenario), connect, &mut ()).unwrap();
    verdict
}

/// An operator who reads one frame in two stays error active, and takes the controller off the bus, which tells just that.
#[test]
fn whoever_spoils_the_frames_of_others_may_be_told_as_their_bus_off() {
    let verdict = judge(&[], &["operator:misread=0.5@0.4s"]);
    assert_eq!(verdict.detected.as_deref(), Some("bus-off"));
    assert!(verdict.missed.is_empty(), "{verdict:?}");
}

/// Nine ticks of ten are missed, in which the time of the brake is counted: the drives have let go by their own clock.
#[test]
fn torque_that_the_drives_have_cut_is_off() {
    for begin in [0.2521, 0.4, 0.5, 0.5993] {
        let verdict = judge(&[], &[&format!("clock:misses=0.9@{begin}s")]);
        assert!(verdict.missed.is_empty(), "{begin}: {verdict:?}");
    }
}

/// Drives whose clock is too fast take samples that are not those of the judge, and a controller that is off the bus leaves commands there that answer
/// what came before its fault: they are sent after it.
#[test]
fn a_command_from_before_the_fault_is_none_after_it_whatever_the_clock() {
    for begin in [0.4369, 0.5, 0.6125] {
        let window = format!("{begin}s..{}s", begin + 0.06);
        let faults = ["clock:drift=0.02", "command:bit-error"].map(|it| format!("{it}@{window}"));
        let verdict = judge(&[], &faults.each_ref().map(String::as_str));
        assert_eq!(verdict.detected.as_deref(), Some("bus-off"));
        assert!(verdict.missed.is_empty(), "{begin}: {verdict:?}");
    }
}

/// Above 1 kHz the bus is so full that it takes more than the 2 ms that are late to catch up with what has been held up.
#[test]
fn a_full_bus_catches_up_late() {
    for (rate, fault) in [
        ("rate_hz=2000", "bus:dominant@0.4s..0.403s"),
        ("rate_hz=3000", "drives:babbling@0.4s..0.403s"),
        ("rate_hz=3000", "bus:dominant@0.4s..0.401s"),
    ] {
        let verdict = judge(&[rate], &[fault]);
        assert!(verdict.missed.is_empty(), "{rate} {fault}: {verdict:?}");
    }
}
