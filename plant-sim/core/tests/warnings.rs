//! What is warned of before a run is what a run shows.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use sim::rehearsal::rehearse;
use sim::run::in_process;
use sim::scenario::Scenario;
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
