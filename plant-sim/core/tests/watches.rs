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
use sim::scenario::{GainsSpec, Scenario, built_in};
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

/// The first fault of a gate in motion, with the time from the beginning of what is planned.
fn first(scenario: Scenario, fault: &str, begin: f64) -> Option<(&'static str, f64)> {
    let (summary, _) = run_of(scenario, &[fault], 5);
    let first = summary.faults.first()?;
    Some((first.cause, first.time_s - begin))
}

fn scenario(name: &str, rate: f64, law: &str) -> Scenario {
    let mut scenario = Scenario::built_in(name).unwrap();
    scenario.cycles = 1;
    scenario.rate_hz = rate;
    scenario.law = law.parse().unwrap();
    scenario.requirements.clear();
    scenario
}

/// How often the torque of an axis goes from beyond half of its limit to one side to the other within 15 ms, at the most in a row.
fn swings(record: &Record, until: f64) -> u32 {
    let limits = RunConfig::new(Scenario::built_in("gate").unwrap())
        .nominal
        .limits
        .effort;
    let mut most = 0;
    for (axis, limit) in limits.iter().enumerate() {
        let (mut side, mut last, mut count) = (0.0, 0.0, 0);
        let samples = record.truths.iter().map(|it| &it.plant);
        for it in samples.take_while(|it| it.t < until) {
            let share = it.tau[axis] / limit;
            if share.abs() < 0.5 {
                continue;
            }
            if share * side < 0.0 {
                count = if it.t - last < 0.015 { count + 1 } else { 0 };
                most = most.max(count);
            }
            (side, last) = (share.signum(), it.t);
        }
    }
    most
}

/// A loop that an encoder that lags a little makes swing, too slowly for a difference from sample to sample and too weakly for a
/// collision, is stopped after a tenth of a second or two of it.
#[test]
fn a_loop_that_swings_is_stopped() {
    let mut chatters = 0;
    for rate in [500.0, 1000.0, 2000.0] {
        for law in [
            "kinematic-joint",
            "pid",
            "pd-gravity",
            "computed-torque:integral",
            "computed-torque:observer",
            "computed-torque-task:observer",
        ] {
            let (sound, _) = run_of(scenario("gate", rate, law), &[], 5);
            assert_eq!(sound.faults, [], "{law} at {rate} Hz");
            for axis in ["shoulder", "elbow", "lift", "wrist"] {
                for lag in ["0.0025", "0.003", "0.004", "0.006"] {
                    let fault = format!("encoder:{axis}:slow={lag}@0.15s");
                    let (summary, record) = run_of(scenario("gate", rate, law), &[&fault], 5);
                    let told = summary.faults.first();
                    let swings = swings(&record, told.map_or(f64::MAX, |it| it.time_s));
                    // 0.2 s of 8 ms each.
                    assert!(swings <= 25, "{law} at {rate} Hz, {fault}: {swings}");
                    chatters += u32::from(told.is_some_and(|it| it.cause == "chatter"));
                }
            }
        }
    }
    assert!(chatters > 40, "{chatters}");
}

/// As it was found: full torque to both sides for seconds.
#[test]
fn an_encoder_that_lags_three_milliseconds_is_felt_in_every_cycle() {
    for lag in ["0.0025", "0.003"] {
        let fault = format!("encoder:shoulder:slow={lag}@0.15s");
        let law = "computed-torque:observer";
        let (cause, _) = first(scenario("palletise", 1000.0, law), &fault, 0.15).unwrap();
        assert_eq!(cause, Cause::Chatter.name(), "{fault}");
    }
}

/// A tick that the clock of the drives misses is a sample that is bridged, whenever it is; more look like an encoder that jumps.
#[test]
fn a_missed_tick_of_the_clock_is_bridged() {
    for rate in [1000.0, 2000.0] {
        for law in ["computed-torque:observer", "pid"] {
            for at in 0..25 {
                let begin = 0.25 + 0.013 * f64::from(at);
                let fault = format!("clock:misses@{begin}s..+1samples");
                let found = first(scenario("palletise", rate, law), &fault, begin);
                assert_eq!(found, None, "{law} at {rate} Hz, {fault}");
            }
        }
    }
    for ticks in [3, 5] {
        let law = "computed-torque:observer";
        let fault = format!("clock:misses@0.4s..+{ticks}samples");
        let told = first(scenario("palletise", 1000.0, law), &fault, 0.4);
        let (cause, _) = told.unwrap();
        assert!(["encoder-fault", "collision"].contains(&cause), "{cause}");
    }
}

/// What a jump can be taken for is a sample that is missing: it is believed up to 2.3 times as far as the axis has moved in the last one, of which it has
/// moved one itself. Anything further is told, or felt and stopped.
#[test]
fn an_encoder_that_jumps_by_more_than_a_sample_is_found() {
    for by in [0.004, 0.006, 0.008, 0.03, -0.005] {
        for at in 0..30 {
            let begin = 0.385 + 0.003 * f64::from(at);
            let descent = [
                "start=[0.6,0.1,-0.13,0.0]",
                "cycle=[{line={to=[0.6,0.1,-0.41,0.0]}},{dwell=0.2}]",
            ];
            let changes = descent.map(|change| change.parse().unwrap());
            let text = built_in("gate").unwrap();
            let mut scenario = Scenario::parse_with(text, "gate", &changes).unwrap();
            scenario.carry(22.0).unwrap();
            let fault = format!("encoder:lift:jump={by}@{begin}s");
            assert!(first(scenario, &fault, begin).is_some(), "{fault}");
        }
    }
}

/// A load that is lost or far heavier than announced is no fault of an encoder: an obstacle at most, or a loop that swings since its
/// gain is that for a heavier arm.
#[test]
fn a_load_that_changes_is_not_taken_for_a_broken_encoder() {
    let mut wrong = Vec::new();
    for name in ["gate", "palletise"] {
        for mass in [12.0, 22.0] {
            for at in 0..100 {
                let begin = 0.25 + 0.0062 * f64::from(at);
                for fault in ["payload:dropped", "payload:heavier=25"] {
                    let mut scenario = scenario(name, 1000.0, "computed-torque:observer");
                    scenario.carry(mass).unwrap();
                    let fault = format!("{fault}@{begin}s");
                    let found = first(scenario, &fault, begin).map(|it| it.0);
                    if let Some("encoder-fault" | "stuck-sensor") = found {
                        wrong.push((name, mass, fault));
                    }
                }
            }
        }
    }
    // Where a heavy load pushes the elbow back from rest as a reversed encoder would let it run.
    assert!(wrong.len() <= 12, "of 800: {wrong:?}");
}

/// The watch has a corner of its own: a slow observer or integral of the law does not make it slow.
#[test]
fn an_obstacle_is_felt_as_soon_with_a_slow_observer() {
    for law in [
        "computed-torque:observer",
        "computed-torque:integral",
        "pid",
    ] {
        let times = [None, Some(50.0), Some(1.0)].map(|observer| {
            let mut scenario = scenario("gate", 1000.0, law);
            scenario.gains = observer.map(|observer| GainsSpec {
                observer: Some(observer),
                ..GainsSpec::default()
            });
            let (cause, time) = first(scenario, "payload:caught=20000@0.41s", 0.41).unwrap();
            assert_eq!(cause, Cause::Collision.name(), "{law}, {observer:?}");
            time
        });
        assert!(
            times.iter().all(|time| *time < times[0] + 0.01),
            "{law}: {times:?}"
        );
    }
}

/// The lift is measured through the wrist: a wrong angle of that shows in both, and in the wrist by far more.
#[test]
fn a_wrong_wrist_is_not_told_as_the_lift() {
    for jump in ["0.5", "1.5", "2", "-3"] {
        let (summary, _) = gate(
            "computed-torque:observer",
            &format!("encoder:wrist:jump={jump}@0.4s"),
        );
        let first = &summary.faults[0];
        assert_eq!(
            (first.cause, first.axis),
            (Cause::EncoderFault.name(), Some("wrist")),
            "{jump}"
        );
    }
}

/// Their samples begin at 0 again, and they are without torque.
#[test]
fn drives_that_start_anew_are_told_as_a_drive_fault() {
    for fault in ["drives:dead@0.4s..+50ms", "drives:dead@0.4s..+4ms"] {
        let (summary, _) = gate("computed-torque:observer", fault);
        let first = &summary.faults[0];
        assert_eq!(first.cause, Cause::DriveFault.name(), "{fault}");
    }
}
