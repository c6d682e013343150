//! A sample that is answered late, or not at all, has no reference to compare the arm with.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/record.rs"]
mod record;

use record::{Record, run_of};
use sim::scenario::Scenario;
use sim::summary::Summary;

fn run(faults: &[&str]) -> (Summary, Record) {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 2;
    run_of(scenario, faults, 0)
}

fn unanswered(record: &Record) -> usize {
    record.truths.iter().filter(|it| !it.is_answered()).count()
}

/// Every sample of a sound run is answered. What keeps the answer back for some costs the arm a fraction of a millimetre; the reference of
/// the sample before is off by as much as the arm moves in between, 4 mm at 4 m/s.
#[test]
fn a_late_answer_is_no_tracking_error() {
    let (sound, record) = run(&[]);
    assert_eq!(unanswered(&record), 0);
    assert!(sound.tracking_error_mm.max < 0.05);
    for fault in [
        "operator:misread@0.4s",
        "feedback:loss@0.4s..0.402s",
        "feedback:delay=0.0015@0.4s..0.404s",
    ] {
        let (summary, record) = run(&[fault]);
        assert!(unanswered(&record) > 0, "{fault}");
        let error = summary.tracking_error_mm.max;
        assert!(error < 0.5, "{fault}: {error}");
    }
}

/// The controller is off the bus: the arm without torque leaves a reference that nobody moves any more, by most of a metre. What is left is the
/// time until the controller knows.
#[test]
fn a_controller_off_the_bus_has_no_reference() {
    let (summary, record) = run(&["command:bit-error@0.4s..1.4s"]);
    assert!(unanswered(&record) > 900);
    let error = summary.tracking_error_mm.max;
    assert!(error < 10.0, "{error}");
}
