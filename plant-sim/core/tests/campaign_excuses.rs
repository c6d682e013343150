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
use sim::scenario::Scenario;
use sim::setup::RunConfig;

fn judge(fault: &str) -> Verdict {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 1;
    scenario.faults = vec![fault.parse().unwrap()];
    let connect = |config| Ok(InProcess::new(config));
    let (verdict, ..) = trial::run(&RunConfig::new(scenario), connect, &mut ()).unwrap();
    verdict
}

/// An operator who reads one frame in two stays error active, and takes the controller off the bus, which tells just that.
#[test]
fn whoever_spoils_the_frames_of_others_may_be_told_as_their_bus_off() {
    let verdict = judge("operator:misread=0.5@0.4s");
    assert_eq!(verdict.detected.as_deref(), Some("bus-off"));
    assert!(verdict.missed.is_empty(), "{verdict:?}");
}

/// Nine ticks of ten are missed, in which the time of the brake is counted: the drives have let go by their own clock.
#[test]
fn torque_that_the_drives_have_cut_is_off() {
    for begin in [0.2521, 0.4, 0.5, 0.5993] {
        let verdict = judge(&format!("clock:misses=0.9@{begin}s"));
        assert!(verdict.missed.is_empty(), "{begin}: {verdict:?}");
    }
}
