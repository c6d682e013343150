//! How warm the motors get: against closed forms, and what is foreseen against runs.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::f64::consts::TAU;

use sim::metrics::Heat;
use sim::model::RobotModel;
use sim::rehearsal::{Plan, rehearse};
use sim::run::in_process;
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use sim::summary::Summary;

/// The step response of a first-order lag of 30 s, of the square of the effort.
#[test]
fn a_steady_effort_warms_up_like_a_first_order_lag() {
    let robot = RobotModel::irb_930_22_105();
    let continuous = robot.limits.effort_continuous;
    let mut heat = Heat::new(&robot);
    // The lift's force reaches the motor of the wrist as well, which has to bear what the screw turns of it.
    let screwed = robot.drive.screw_lead / TAU * continuous[2];
    let tau = [
        0.5 * continuous[0],
        -continuous[1],
        continuous[2],
        screwed + 2.0 * continuous[3],
    ];
    for step in 0..=60_000 {
        heat.sample(f64::from(step) * 1e-3, &tau);
    }
    let at_rest = [0.0, 0.0, 0.0, 0.0];
    let warm = 1.0 - (-2.0f64).exp();
    for (axis, square) in [0.25, 1.0, 1.0, 4.0].into_iter().enumerate() {
        let found = heat.shares()[axis];
        assert!((found - square * warm).abs() < 1e-9, "{axis}: {found}");
    }
    for step in 1..=30_000 {
        heat.sample(60.0 + f64::from(step) * 1e-3, &at_rest);
    }
    assert!((heat.shares()[3] - 4.0 * warm * (-1.0f64).exp()).abs() < 1e-9);
    assert!((heat.greatest()[3] - 4.0 * warm).abs() < 1e-9);
}

fn both(name: &str, cycles: u32, continuous: f64) -> (Plan, Summary) {
    let mut config = RunConfig::new(Scenario::built_in(name).unwrap());
    config.scenario.cycles = cycles;
    for limit in &mut config.nominal.limits.effort_continuous {
        *limit *= continuous;
    }
    config.actual = config.nominal.clone();
    let summary = in_process(&config, &mut ()).unwrap();
    (rehearse(&config).unwrap(), summary)
}

/// The run is the oracle of what is foreseen, the truth of what the controller reports.
#[test]
fn warm_motors_are_foreseen_where_the_run_slows_down() {
    for (name, cycles) in [
        ("gate", 10),
        ("gate", 40),
        ("gate-22kg", 30),
        ("far-reach", 12),
        ("palletise", 4),
        ("screw", 10),
        ("near-singular", 20),
    ] {
        let (plan, summary) = both(name, cycles, 1.0);
        assert!(summary.completed, "{name}: {:?}", summary.error);
        assert_eq!(plan.refused, [], "{name}");
        let heat = &summary.heat;
        let warning = plan.warnings.iter().find(|it| it.contains("more slowly"));
        let what = format!("{name}, {cycles} cycles: {warning:?}, {heat:?}");
        assert_eq!(warning.is_some(), heat.slowed_from_s.is_some(), "{what}");
        let Some((warning, from)) = warning.zip(heat.slowed_from_s) else {
            assert!(heat.greatest < 0.9, "{what}");
            continue;
        };
        // Two that know nothing of each other: the controller's torques, and those of the plant.
        assert!((0.9..1.05).contains(&heat.greatest), "{what}");
        let said = |before: &str| -> f64 {
            let (_, rest) = warning.split_once(before).unwrap();
            rest.split(' ').next().unwrap().parse().unwrap()
        };
        assert!((said("from about ") / from - 1.0).abs() < 0.25, "{what}");
        let last = summary.each_cycle.last().unwrap();
        let first = &summary.each_cycle[0];
        assert!(last.commanded_s > 1.1 * first.commanded_s, "{what}");
        let slower = last.commanded_s - first.commanded_s;
        let (_, rest) = warning.split_once("a cycle takes ").unwrap();
        let (then, rest) = rest.split_once(" s instead of ").unwrap();
        let now = rest.split_once(' ').map_or(rest, |(now, _)| now);
        let now = now.trim_end_matches([';', '.']);
        let foreseen = then.parse::<f64>().unwrap() - now.parse::<f64>().unwrap();
        assert!(
            (0.5..2.0).contains(&(slower / foreseen)),
            "{what}: {slower}"
        );
    }
}

/// Weight that no pace makes lighter: refused where the run ends with overload.
#[test]
fn an_overload_is_foreseen() {
    for (continuous, overloaded) in [(0.45, true), (0.52, true), (1.0, false)] {
        let (plan, summary) = both("gate-22kg", 40, continuous);
        let fault = summary.fault.clone().unwrap_or_default();
        assert_eq!(fault.contains("overload"), overloaded, "{fault}");
        assert_eq!(plan.refused.len(), usize::from(overloaded), "{plan:?}");
        for refused in &plan.refused {
            for word in ["lift", "overload", "lighter load"] {
                assert!(refused.reason.contains(word), "{}", refused.reason);
            }
        }
        if overloaded {
            assert_eq!(summary.heat.warmest, "lift");
            assert!((1.19..1.25).contains(&summary.heat.greatest));
        }
    }
}
