//! The lift under load: no step of its torque as it is switched on, and no fall whose brake is stuck open while something else breaks.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/record.rs"]
mod record;

use protocol::messages::Mode;
use record::{Record, run_of};
use sim::scenario::Scenario;
use sim::summary::Summary;

const LIFT: usize = 2;
/// Weight of lift, shaft and 22 kg, N.
const WEIGHT: f64 = (1.95 + 22.0) * 9.81;

fn with_22_kg(faults: &[&str]) -> (Summary, Record) {
    let mut scenario = Scenario::built_in("gate-22kg").unwrap();
    scenario.cycles = 1;
    run_of(scenario, faults, 5)
}

/// From nothing to the weight of 235 N within 30 ms: 8 N a sample.
#[test]
fn the_weight_is_taken_over_without_a_step() {
    let (summary, record) = with_22_kg(&[]);
    assert!(summary.completed);
    let first = record
        .truths
        .iter()
        .position(|it| it.plant.tau[LIFT] != 0.0);
    let taken = &record.truths[first.unwrap() - 1..][..40];
    let steps = taken
        .windows(2)
        .map(|two| (two[1].plant.tau[LIFT] - two[0].plant.tau[LIFT]).abs());
    assert!(steps.fold(0.0, f64::max) < 1.2 * WEIGHT / 30.0);
    let last = taken.last().unwrap();
    assert!((last.plant.tau[LIFT] + WEIGHT).abs() < 0.02 * WEIGHT);
    // Nor does it move meanwhile.
    let sunk = last.plant.q[LIFT] - taken[0].plant.q[LIFT];
    assert!(sunk.abs() < 1e-6, "{sunk}");
}

/// Whatever the arm does, the motor of the lift stops it, and holds it for as long as the brake does not.
#[test]
fn a_lift_whose_brake_is_stuck_open_is_held_when_the_arm_fails() {
    for fault in [
        "motor:elbow:dead@0.42s",
        "motor:elbow:dip@0.42s..0.44s",
        "motor:elbow:weak=0.2@0.37s",
        "motor:shoulder:runaway@0.37s",
        "encoder:elbow:stuck@0.37s",
        "encoder:shoulder:reversed@0.37s",
        "encoder:elbow:jump=0.3@0.37s",
        "encoder:elbow:noise=0.01@0.37s",
        "encoder:shoulder:slow=0.02@0.37s",
    ] {
        let (summary, record) = with_22_kg(&["brake:stuck-open@0.22s", fault]);
        assert!(!summary.completed, "{fault}");
        let told = summary.faults[0].time_s;
        let after: Vec<_> = record
            .truths
            .iter()
            .filter(|it| it.plant.t > told)
            .collect();
        // The way down from full speed, 0.7 m/s, as fast as the torque allows, and no more.
        let way =
            after.iter().map(|it| it.plant.q[LIFT]).fold(0.0, f64::max) - after[0].plant.q[LIFT];
        assert!(way < 0.05, "{fault}: {way} m");
        let rest = after.last().unwrap();
        assert!(rest.plant.t > told + 1.0, "{fault}");
        assert!(
            (rest.plant.tau[LIFT] + WEIGHT).abs() < 0.1 * WEIGHT,
            "{fault}"
        );
        assert!(rest.plant.qd[LIFT].abs() < 1e-3, "{fault}");
        let arm = after.iter().filter(|it| it.plant.t > told + 0.2);
        let pushes = arm.filter(|it| it.plant.tau[0] != 0.0 || it.plant.tau[1] != 0.0);
        let runaway = fault.contains("runaway");
        assert!(runaway || pushes.count() == 0, "{fault}");
    }
}

/// The arm fails while the lift stands at the top of the gate: it is not driven down the path that follows, against its brake or where that is
/// stuck open.
#[test]
fn a_lift_at_rest_stays_where_it_is_when_the_arm_fails() {
    for brake in [None, Some("brake:stuck-open@0.22s")] {
        let jump = "encoder:elbow:jump=1@0.37s";
        let faults: Vec<&str> = brake.into_iter().chain([jump]).collect();
        let (summary, record) = with_22_kg(&faults);
        assert!(!summary.completed, "{faults:?}");
        let after = record.truths.iter().filter(|it| it.plant.t > 0.3695);
        let places = after.map(|it| it.plant.q[LIFT]);
        let (highest, lowest) = places.fold((f64::MAX, f64::MIN), |(high, low), place| {
            (high.min(place), low.max(place))
        });
        assert!(
            lowest - highest < 1e-3,
            "{faults:?}: {} m",
            lowest - highest
        );
    }
}

/// An emergency stop whose brake does not close is no reason to keep that to oneself.
#[test]
fn a_brake_that_does_not_close_is_told_whatever_was_told_before() {
    let scenario = Scenario::built_in("estop-descent").unwrap();
    let (summary, _) = run_of(scenario, &["brake:stuck-open@0.3s"], 5);
    let causes: Vec<_> = summary.faults.iter().map(|fault| fault.cause).collect();
    assert_eq!(causes, ["estop", "drive-fault"]);
}

/// The brake is where the drives say, and that is not where it is to be: told as such, and not as what the lift makes of it.
#[test]
fn the_drives_word_of_the_brake_comes_first() {
    for (fault, by) in [
        // Told to open once ready, and waited for twice as long as it may take.
        ("brake:stuck-closed@0s", 0.2),
        ("brake:stuck@0s", 0.2),
        // Open from the first sample on, at rest.
        ("brake:stuck-open@0s", 0.1),
        // While it moves: with the next sample.
        ("brake:stuck-closed@0.32s", 0.322),
        ("brake:stuck-closed@while=lift-down", 1.0),
    ] {
        let (summary, record) = with_22_kg(&[fault]);
        assert!(!summary.completed, "{fault}");
        let told = &summary.faults[0];
        assert_eq!(told.cause, "drive-fault", "{fault}");
        assert!(told.time_s < by, "{fault}: {}", told.time_s);
        if by < 0.3 {
            let enabled = |it: &sim::observer::Truth| it.mind.mode == Mode::Enabled;
            assert!(!record.truths.iter().any(enabled), "{fault}");
        }
    }
    // One that takes 50 ms longer is waited for.
    let (summary, _) = with_22_kg(&["brake:slow=0.05@0s..0.2s"]);
    assert!(summary.completed, "{:?}", summary.error);
}
