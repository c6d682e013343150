//! What the controller feels: an obstacle, a late encoder, warm motors.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/record.rs"]
mod record;

use protocol::messages::Cause;
use record::{Record, run_of};
use sim::run::in_process;
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use sim::summary::Summary;

fn gate(law: &str, fault: &str) -> (Summary, Record) {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 1;
    scenario.law = law.parse().unwrap();
    run_of(scenario, &[fault], 5)
}

/// A spring of 20 or 50 N/mm catches the tool in mid-motion: with every law the arm stops, and does not go on pulling.
#[test]
fn an_obstacle_is_felt_with_every_law() {
    for law in [
        "kinematic-joint",
        "kinematic-task",
        "pid",
        "pd-gravity",
        "computed-torque:none",
        "computed-torque:observer",
        "computed-torque-task:observer",
    ] {
        for fault in ["payload:caught=20000@0.41s", "payload:caught=50000@0.45s"] {
            let (summary, record) = gate(law, fault);
            assert!(!summary.completed && summary.at_rest, "{law}, {fault}");
            let first = &summary.faults[0];
            assert_eq!(first.cause, Cause::Collision.name(), "{law}, {fault}");
            // As soon as it pulls with half of a limit.
            let begin = if fault.ends_with("0.41s") { 0.41 } else { 0.45 };
            assert!(first.time_s < begin + 0.08, "{law}: {}", first.time_s);
            // The brake's time, and no more.
            let off = first.time_s + 0.1;
            let late = record.truths.iter().filter(|it| it.plant.t > off);
            assert!(late.clone().count() > 10);
            for it in late {
                assert_eq!(it.plant.tau, [0.0; 4], "{law}: {}", it.plant.t);
            }
        }
    }
}

/// An encoder that shows where the axis was 20 ms ago is found within a few samples of a fast motion.
#[test]
fn a_late_encoder_is_felt() {
    for axis in ["shoulder", "elbow", "lift", "wrist"] {
        let fault = format!("encoder:{axis}:slow=0.02@0.35s");
        let (summary, _) = gate("computed-torque:observer", &fault);
        let first = &summary.faults[0];
        assert_eq!(first.cause, Cause::Collision.name(), "{fault}");
        assert!(first.time_s < 0.36, "{fault}: {}", first.time_s);
    }
}

/// A cycle that asks for too much settles at a pace that no motor is too warm for, and goes on. The mean square is that of the truth.
#[test]
fn a_warm_arm_slows_down_and_goes_on() {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 300;
    scenario.requirements.clear();
    let mut record = Record::default();
    let config = RunConfig::new(scenario);
    let continuous = config.nominal.limits.effort_continuous;
    let summary = in_process(&config, &mut record).unwrap();
    assert!(summary.completed, "{:?}", summary.error);
    assert_eq!(summary.faults, []);
    assert!((0.3..0.9).contains(&summary.pace), "{}", summary.pace);

    // Twice the time constant before the end, and more after the start.
    let end = record.truths.last().unwrap().plant.t;
    assert!(end > 150.0, "{end}");
    let last: Vec<_> = record
        .truths
        .iter()
        .filter(|it| it.plant.t > end - 60.0)
        .collect();
    let warmest = (0..4)
        .map(|axis| {
            let squares = last
                .iter()
                .map(|it| (it.plant.tau[axis] / continuous[axis]).powi(2));
            squares.sum::<f64>() / last.len() as f64
        })
        .fold(0.0, f64::max);
    assert!((0.85..1.0).contains(&warmest), "{warmest}");
}
