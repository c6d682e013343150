//! Encoders that get stuck while their axis stands, or nearly so: how far the true arm gets before that is told.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/record.rs"]
mod record;
#[path = "common/tool.rs"]
mod tool;

use record::{Record, run_of};
use sim::scenario::{OperationName, Scenario, built_in};
use sim::summary::Summary;
use tool::speed;

const AXES: [&str; 4] = ["shoulder", "elbow", "lift", "wrist"];
/// How far an axis gets at the most from where it stood until it has come to rest again: rad, rad, m, rad. It is found by its effort, which a slow loop
/// builds up slowly.
const STRAYS: [f64; 4] = [0.2, 0.2, 0.1, 0.01];
const SLOW_STRAYS: [f64; 4] = [0.6, 0.2, 0.1, 0.01];
/// Speed of the tool in manual operation, m/s: that of the plan and what an axis gains until it is found, or its reading has turned round.
const STUCK_SPEED: f64 = 0.35;
const LATE_SPEED: f64 = 0.65;
/// Of one that is reversed, by the rate in Hz.
const REVERSED_SPEED: [(f64, f64); 3] = [(500.0, 1.2), (1000.0, 0.8), (2000.0, 0.8)];

fn stands(cycle: &str, rate: f64, law: &str, mass: f64) -> Scenario {
    let changes = [cycle, "requirements=[]", "cycles=1"].map(|change| change.parse().unwrap());
    let text = built_in("gate").unwrap();
    let mut scenario = Scenario::parse_with(text, "gate", &changes).unwrap();
    scenario.rate_hz = rate;
    scenario.law = law.parse().unwrap();
    scenario.carry(mass).unwrap();
    scenario
}

/// The cause that is told first, and its axis.
fn told(summary: &Summary) -> Option<(&str, Option<&str>)> {
    summary.faults.first().map(|it| (it.cause, it.axis))
}

/// How far the axis is from where it was at `begin`, at the most.
fn strays(record: &Record, axis: usize, begin: f64) -> f64 {
    let mut after = record.truths.iter().filter(|it| it.plant.t >= begin);
    let from = after.next().unwrap().plant.q[axis];
    let far = after.map(|it| (it.plant.q[axis] - from).abs());
    far.fold(0.0, f64::max)
}

/// Greatest speed of the tool, m/s.
fn fastest(record: &Record) -> f64 {
    let pairs = record.truths.windows(2);
    let speeds = pairs.map(|pair| speed(&pair[0].plant, &pair[1].plant));
    speeds.fold(0.0, f64::max)
}

/// The reading stays some counts from the reference, of which integral or observer make more and more: until the axis slips away.
#[test]
fn an_encoder_that_gets_stuck_while_its_axis_stands_is_told() {
    let mut found = 0;
    for rate in [500.0, 1000.0, 2000.0] {
        for law in [
            "computed-torque:observer",
            "computed-torque-task:observer",
            "pid",
        ] {
            for mass in [0.0, 2.0, 22.0] {
                for (number, axis) in AXES.into_iter().enumerate() {
                    let scenario = stands("cycle=[{dwell=8}]", rate, law, mass);
                    let noise = format!("encoder:{axis}:noise=0.000001@0s");
                    let stuck = format!("encoder:{axis}:stuck@0.5s");
                    let (summary, record) = run_of(scenario, &[&noise, &stuck], 3);
                    let what = format!("{axis}, {law} at {rate} Hz, {mass} kg");
                    let told = told(&summary);
                    let is_right = told == Some(("stuck-sensor", Some(axis)));
                    assert!(told.is_none() || is_right, "{what}: {told:?}");
                    found += u32::from(is_right);
                    let most = if rate < 1000.0 { SLOW_STRAYS } else { STRAYS };
                    let strays = strays(&record, number, 0.5);
                    assert!(strays < most[number], "{what}: {strays}");
                }
            }
        }
    }
    // What is on its reference to the count stays where it is.
    assert!(found > 40, "{found} of 108");
}

/// Slow moves, in which nothing but the effort shows what is wrong.
#[test]
fn an_encoder_that_fails_in_manual_operation_makes_the_tool_little_faster() {
    let cycle = "cycle=[{jump={to=[0.35,0.35,-0.3,2.0],top=-0.2}},{jump={to=[0.6,-0.2,-0.3,-1.0],top=-0.3}}]";
    for (rate, reversed) in REVERSED_SPEED {
        let defects = [
            ("stuck", STUCK_SPEED),
            ("slow=0.005", LATE_SPEED),
            ("slow=0.02", LATE_SPEED),
            ("slow=0.05", LATE_SPEED),
            ("reversed", reversed),
        ];
        for (mass, axis) in [0.0, 2.0, 22.0]
            .into_iter()
            .flat_map(|mass| AXES.map(|axis| (mass, axis)))
        {
            for (defect, allowed) in defects {
                for at in [0.4, 0.7, 1.0, 1.5] {
                    let law = "computed-torque:observer";
                    let mut scenario = stands(cycle, rate, law, mass);
                    scenario.operation = OperationName::Manual;
                    let fault = format!("encoder:{axis}:{defect}@{at}s");
                    let (summary, record) = run_of(scenario, &[&fault], 3);
                    let what = format!("{fault} at {rate} Hz, {mass} kg");
                    let fastest = fastest(&record);
                    assert!(fastest < allowed, "{what}: {fastest}");
                    // One that is late may do no harm.
                    match (defect, told(&summary)) {
                        ("stuck", told) => {
                            assert_eq!(told, Some(("stuck-sensor", Some(axis))), "{what}")
                        }
                        ("reversed", told) => assert_ne!(told, None, "{what}"),
                        _ => {}
                    }
                }
            }
        }
    }
}
