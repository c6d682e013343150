//! Faults of the summary: each that the controller has reported, once, however it was told.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/record.rs"]
mod record;

use record::run_of;
use sim::scenario::Scenario;
use sim::summary::{Fault, Summary};

fn run(faults: &[&str]) -> Summary {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 1;
    run_of(scenario, faults, 0).0
}

/// Value of the requirement that counts faults.
fn counted(summary: &Summary) -> f64 {
    let of_faults = |it: &&sim::requirements::Verdict| {
        it.requirement.quantity == sim::scenario::Quantity::Faults
    };
    let verdict = summary.requirements.iter().find(of_faults).unwrap();
    assert_eq!(verdict.met, verdict.value == Some(0.0));
    verdict.value.unwrap()
}

/// Everything but the time, which is later by what the emergency takes on the bus.
fn what(fault: &Fault) -> Fault {
    Fault {
        time_s: 0.0,
        ..fault.clone()
    }
}

/// What the emergency tells, the state tells as well: losing it, or having it late, changes no fault and no count.
#[test]
fn a_fault_without_its_emergency_is_told_by_the_state() {
    for broken in [
        "encoder:elbow:stuck@0.4s",
        "motor:elbow:dead@0.4s",
        "feedback:loss@0.4s",
    ] {
        let told = run(&[broken]);
        let first = what(&told.faults[0]);
        for emergency in ["loss@0s", "delay=0.005@0s", "duplicate@0s"] {
            let emergency = format!("ControllerEmergency:{emergency}");
            let summary = run(&[broken, &emergency]);
            assert_eq!(what(&summary.faults[0]), first, "{broken}, {emergency}");
            let causes: Vec<_> = summary.faults.iter().map(|fault| fault.cause).collect();
            let all: Vec<_> = told.faults.iter().map(|fault| fault.cause).collect();
            // A fault after the first is told by its emergency alone.
            assert!(
                all.starts_with(&causes),
                "{broken}, {emergency}: {causes:?}"
            );
            assert_eq!(
                counted(&summary),
                causes.len() as f64,
                "{broken}, {emergency}"
            );
        }
    }
}

/// From nearly the stretched arm the elbow carries the shoulder along against all its torque, and it turns back slowly: its encoder moves.
#[test]
fn a_shoulder_that_turns_back_slowly_is_not_stuck() {
    for law in ["pd-gravity", "pid", "kinematic-joint", "kinematic-task"] {
        for rate in [500, 1000, 2000] {
            let text = format!(
                "name = \"stretched\"\ncycles = 1\nrate_hz = {rate}\nlaw = \"{law}\"\n\
                 start = [0.994818, 0.334115, -0.25, 0.0]\n\
                 [payload]\nmass = 5.0\ncom_flange_frame = [0.0, 0.0, 0.05]\ninertia_com_diag = [0.02, 0.02, 0.025]\n\
                 [[cycle]]\njoints = {{ to = [0.3, 1.0, 0.1, 0.0] }}\n[[cycle]]\ndwell = 0.2\n"
            );
            let scenario = Scenario::parse(&text, "stretched.toml").unwrap();
            for fault in run_of(scenario, &[], 0).0.faults {
                assert_ne!(fault.cause, "stuck-sensor", "{law} {rate}");
            }
        }
    }
}
