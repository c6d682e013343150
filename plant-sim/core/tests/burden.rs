//! Which mass the controller says that the lift carries beyond the announced one: the plant knows it.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use sim::run::in_process;
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use sim::summary::Summary;

fn run(scenario: Scenario) -> Summary {
    in_process(&RunConfig::new(scenario), &mut ()).unwrap()
}

fn gate(payload: f64, rate_hz: f64) -> Scenario {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.carry(payload).unwrap();
    (scenario.rate_hz, scenario.cycles) = (rate_hz, 10);
    scenario
}

#[test]
fn what_was_announced_is_not_told() {
    for payload in [0.0, 2.0, 22.0] {
        for rate in [500.0, 1000.0, 2000.0] {
            let found = run(gate(payload, rate)).burden_kg;
            assert!(found.abs() < 0.1, "{payload} kg at {rate} Hz: {found}");
        }
    }
}

/// Friction that is half as much again, and none of the model's, in strokes down and up.
#[test]
fn friction_is_not_taken_for_a_mass() {
    for friction in [0.5, 1.5] {
        let mut scenario = gate(2.0, 1000.0);
        scenario.mismatch.friction = friction;
        let found = run(scenario).burden_kg;
        assert!(found.abs() < 0.4, "{friction}: {found}");
    }
}

#[test]
fn what_is_more_or_less_is_weighed() {
    for (payload, share) in [(22.0, 1.2), (12.0, 1.25), (12.0, 0.75), (2.0, 2.0)] {
        let mut scenario = gate(payload, 1000.0);
        scenario.mismatch.payload = share;
        let (found, more) = (run(scenario).burden_kg, (share - 1.0) * payload);
        assert!(
            (found - more).abs() < 0.05 * more.abs() + 0.05,
            "{found}, {more} kg"
        );
    }
}
