//! What is warned of before a run is what a run shows.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::io;

use oorandom::Rand64;
use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Message, MotionRequest};
use protocol::time::Instant;
use sim::model::RobotModel;
use sim::observer::Observer;
use sim::rehearsal::rehearse;
use sim::run::in_process;
use sim::scenario::{GainsSpec, PayloadSpec, Scenario};
use sim::setup::RunConfig;
use sim::summary::Summary;

fn run(config: &RunConfig) -> Summary {
    in_process(config, &mut ()).unwrap()
}

/// The run is the oracle: with a warning it has late commands, and without one none.
#[test]
fn a_rate_at_which_commands_come_late_is_warned_of() {
    for (rate_hz, late) in [(2450.0, false), (3500.0, true)] {
        let mut config = RunConfig::new(Scenario::built_in("gate").unwrap());
        config.scenario.rate_hz = rate_hz;
        let warnings = rehearse(&config).unwrap().warnings;
        assert_eq!(run(&config).overruns > 0, late, "{rate_hz}");
        assert_eq!(warnings.len(), usize::from(late), "{warnings:?}");
        // By hand: frames of 136.8, 136.8 and 88.8 us with every stuff bit, and 40 us of computing.
        assert!(
            warnings
                .iter()
                .all(|said| said.contains("402 us") && said.contains("up to 2485 Hz")),
            "{warnings:?}"
        );
    }
}

/// A torque that is to build up faster than commands follow each other makes a cycle slower, not faster: the run is the oracle.
#[test]
fn a_rise_time_below_two_samples_is_warned_of() {
    let mut cycles = [0.0; 2];
    for (cycle, (rise, warned)) in cycles.iter_mut().zip([(0.004, false), (0.001, true)]) {
        let mut config = RunConfig::new(Scenario::built_in("gate").unwrap());
        config.scenario.cycles = 2;
        config.nominal.limits.effort_rise_time[1] = rise;
        config.nominal.limits.effort_rise_time[0] = rise;
        let warnings = config.warnings();
        assert_eq!(warnings.len(), usize::from(warned), "{warnings:?}");
        let words = [
            "effort_rise_time_s of the shoulder is 0.001 s",
            "say 0.002 s or more",
        ];
        assert!(
            warnings
                .iter()
                .all(|said| words.iter().all(|word| said.contains(word))),
            "{warnings:?}"
        );
        *cycle = run(&config).cycle_time_s.unwrap().mean;
    }
    assert!(cycles[1] > cycles[0], "{cycles:?}");
}

/// The gate with the robot's encoders replaced by others.
fn with_counts(robot: RobotModel, counts: u32, rate_hz: f64) -> RunConfig {
    let mut config = RunConfig::new(Scenario::built_in("gate").unwrap());
    config.scenario.cycles = 2;
    config.scenario.rate_hz = rate_hz;
    config.scenario.requirements.clear();
    config.nominal = robot;
    config.nominal.drive.encoder_counts = counts;
    config.actual = config.nominal.clone();
    config
}

/// Whatever the encoders are, the controller's own gains do what a run needs, or are refused; they are warned of if they are other than those
/// of a fine encoder.
#[test]
fn coarse_encoders_are_warned_of_and_stop_no_run() {
    let mut random = Rand64::new(20);
    let (mut warned, mut refused) = (0, 0);
    for case in 0..40 {
        let robot = [RobotModel::irb_930_22_105(), RobotModel::irb_930_12_085()][case % 2].clone();
        let rate_hz = [250.0, 500.0, 1000.0, 2000.0, 2400.0][case % 5];
        let counts = 2.0f64.powf(8.0 + 9.0 * random.rand_float()) as u32;
        let heaviest = robot.payload_max;
        let mut config = with_counts(robot, counts, rate_hz);
        config.scenario.mismatch.friction = 0.7 + 0.6 * random.rand_float();
        let mass = heaviest * random.rand_float();
        config.scenario.payload = Some(PayloadSpec::compact(mass));
        let what = format!("{counts} counts at {rate_hz} Hz, {mass} kg");
        match config.rig() {
            Ok(_) => {}
            Err(error) => {
                let error = error.to_string();
                for word in [
                    "encoder_counts_per_motor_rev",
                    "torque limit of the",
                    "allowed: ",
                ] {
                    assert!(error.contains(word), "{what}: {error}");
                }
                refused += 1;
                continue;
            }
        }
        let fine = run(&with_counts(config.nominal.clone(), 131_072, rate_hz));
        let coarse = run(&config);
        assert!(coarse.faults.is_empty(), "{what}: {:?}", coarse.error);
        assert!(coarse.completed, "{what}");
        let warnings = config.warnings();
        let is_lower = coarse.recipe.gains != fine.recipe.gains;
        assert_eq!(
            warnings.len(),
            usize::from(is_lower),
            "{what}: {warnings:?}"
        );
        warned += u32::from(is_lower);
    }
    assert!(warned > 10 && refused > 3, "{warned} {refused}");
}

/// Gains of a scenario that the encoders do not bear: the run shows it, and with those that the warning names it does not.
#[test]
fn gains_too_high_for_the_encoders_are_named() {
    for (counts, rate_hz) in [(4096, 2000.0), (2000, 1000.0), (1024, 2000.0)] {
        let mut config = with_counts(RobotModel::irb_930_22_105(), counts, rate_hz);
        config.scenario.gains = Some(GainsSpec {
            bandwidth: Some(160.0),
            damping: None,
            observer: Some(160.0),
        });
        let what = format!("{counts} counts at {rate_hz} Hz");
        let summary = run(&config);
        assert!(summary.stopped, "{what}: it does not stop");
        let [warning] = config.warnings().try_into().unwrap();
        let refused = rehearse(&config).unwrap().refused;
        let reason = &refused[0].reason;
        for text in [&warning, reason] {
            assert!(
                text.contains(&format!("encoder_counts_per_motor_rev is {counts}")),
                "{text}"
            );
            assert!(
                text.contains("shoulder") && !text.contains("higher rate"),
                "{text}"
            );
        }
        let (_, said) = reason.split_once("lower gains.bandwidth to ").unwrap();
        let (bandwidth, said) = said.split_once(" and gains.observer to ").unwrap();
        let (observer, _) = said.split_once(',').unwrap();
        config.scenario.gains = Some(GainsSpec {
            bandwidth: Some(bandwidth.parse().unwrap()),
            damping: None,
            observer: Some(observer.parse().unwrap()),
        });
        assert_eq!(config.warnings(), [""; 0], "{what}");
        assert_eq!(rehearse(&config).unwrap().refused, [], "{what}");
        let summary = run(&config);
        assert!(
            summary.completed && summary.faults.is_empty(),
            "{what}: {:?}",
            summary.error
        );
    }
}

/// A gain that a scenario leaves out is the one that the controller has with its encoders.
#[test]
fn a_gain_left_out_is_that_of_the_encoders() {
    let mut config = with_counts(RobotModel::irb_930_22_105(), 10_000, 2000.0);
    let own = run(&config).recipe.gains;
    assert!((30.0..40.0).contains(&own.observer), "{own:?}");
    config.scenario.gains = Some(GainsSpec {
        bandwidth: Some(20.0),
        ..GainsSpec::default()
    });
    let mut asked = Asked::default();
    let summary = in_process(&config, &mut asked).unwrap();
    assert_eq!(summary.recipe.gains.observer, own.observer);
    assert_eq!(
        asked.0.map(|gains| gains.map(f64::from)),
        Some([20.0, 1.0, own.observer])
    );
}

/// The gains that the operator asked for on the bus.
#[derive(Default)]
struct Asked(Option<[f32; 3]>);

impl Observer for Asked {
    fn frame(&mut self, _: Instant, frame: &CanFrame) -> io::Result<()> {
        if let Ok(received) = codec::decode(frame)
            && let Message::Motion(motion) = received.message
            && let MotionRequest::SetGains {
                bandwidth,
                damping,
                observer,
            } = motion.request
        {
            self.0 = Some([bandwidth, damping, observer]);
        }
        Ok(())
    }
}

/// A payload far off the axis of the flange: a count of the wrist's encoder is a third of its torque with the usual gains, on which the wrist
/// chatters. By hand in the controller's test `gains`.
#[test]
fn gains_are_lowered_for_a_payload_off_the_axis() {
    for (mass, off, rate_hz) in [
        (22.0, [0.4, 0.0], 2000.0),
        (22.0, [0.0, -0.8], 1000.0),
        (10.0, [-1.0, 0.0], 1000.0),
        (5.0, [0.6, 0.8], 2000.0),
    ] {
        let mut config = RunConfig::new(Scenario::built_in("gate-22kg").unwrap());
        config.scenario.cycles = 2;
        config.scenario.rate_hz = rate_hz;
        let payload = config.scenario.payload.as_mut().unwrap();
        payload.mass = mass;
        payload.com_flange_frame = [off[0], off[1], 0.05];
        let warnings = config.warnings();
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        let words = format!("a payload of {mass} kg has its centre of mass");
        assert!(warnings[0].contains(&words), "{warnings:?}");
        let summary = run(&config);
        assert_eq!(summary.error, None, "{mass} {off:?}");
        let used = summary.recipe.gains.bandwidth;
        let words = format!("uses gains.bandwidth {used:.1}");
        assert!(warnings[0].contains(&words), "{warnings:?}");
    }
}

/// Laws without a model of the arm are behind by acceleration over squared bandwidth: the run is the oracle at low rates, where the gate ends as a
/// following error of the lift, and at a rate at which it does not.
#[test]
fn a_law_that_stays_behind_at_a_low_rate_is_warned_of() {
    for law in ["pid", "pd-gravity", "kinematic-joint", "kinematic-task"] {
        for (rate_hz, stays_behind) in [(120.0, true), (200.0, true), (1000.0, false)] {
            let mut config = RunConfig::new(Scenario::built_in("gate").unwrap());
            config.scenario.cycles = 1;
            config.scenario.rate_hz = rate_hz;
            config.scenario.law = law.parse().unwrap();
            let words = format!("at {rate_hz} Hz {law}, which has no model of the arm");
            let warned = config
                .warnings()
                .iter()
                .any(|said| said.starts_with(&words));
            assert_eq!(warned, stays_behind, "{law} {rate_hz}");
            let error = run(&config).error.unwrap_or_default();
            assert_eq!(
                error.contains("following error, axis 3"),
                stays_behind,
                "{law} {rate_hz}: {error}"
            );
        }
    }
}
