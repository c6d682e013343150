//! What the operator takes for a sign of life, and how it tells what became of a controller that gives none.

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
    scenario.cycles = 4;
    run_of(scenario, faults, 0)
}

/// A state every 20 ms: the last new one came up to that long before `at`, or is the one that hangs from then on.
fn assert_silent(faults: &[&str], at: f64) {
    let (summary, _) = run(faults);
    let error = summary.error.unwrap();
    // Of frames that came and could not be used, both are said.
    let since = ["has been silent since ", "has told nothing new since "]
        .iter()
        .find_map(|how| error.strip_prefix("the controller ")?.strip_prefix(how))
        .and_then(|rest| rest.split_once(' '))
        .unwrap_or_else(|| panic!("{faults:?}: {error}"))
        .0
        .parse::<f64>()
        .unwrap();
    assert!(
        (at - 0.021..at + 0.021).contains(&since),
        "{faults:?}: {error}"
    );
    // One second, and what an arm without torque takes to come to rest.
    assert!(
        summary.sim_time_s < since + 2.0,
        "{faults:?}: {}",
        summary.sim_time_s
    );
    assert!(summary.at_rest, "{faults:?}");
}

/// Frames that only look like the controller's: without its CRC, or the same one over and over.
#[test]
fn only_a_new_state_is_a_sign_of_life() {
    for frames in ["ControllerHeartbeat", "State", "MotionReply"] {
        let masquerade = format!("{frames}:masquerade@0.35s");
        assert_silent(&["controller:silent@0.4s", &masquerade], 0.4);
    }
    assert_silent(&["State:ack-error@0.35s"], 0.35);
    assert_silent(&["command:ack-error@0.4s"], 0.4);
    assert_silent(&["State:corrupt@0.35s"], 0.35);
}

/// What is said is what is wrong: frames that came are no silence, and requests of somebody else no delay.
#[test]
fn frames_that_came_in_vain_are_told() {
    for (fault, expected) in [
        (
            "state:bad-value@0.4s",
            "the controller has told nothing new since 0.380 s; 50 came and had to be refused: tracking_error shoulder is not finite",
        ),
        (
            "state:corrupt@0.4s",
            "the controller has told nothing new since 0.380 s; 50 came and had to be refused: end-to-end CRC is wrong",
        ),
        (
            "motionreply:corrupt@0s",
            "no reply to request 1 (stop) within 2.0 s; 1 came and had to be refused: end-to-end CRC is wrong",
        ),
        (
            "motion:forged@0.22s",
            "jump refused: No more motions can be queued; another node sends the requests of the operator as well",
        ),
        (
            "motion:forged@0.42s",
            "the move did not end within 120 s at 1 of full speed; another node sends the requests of the operator as well",
        ),
    ] {
        let error = run(&[fault]).0.error.unwrap();
        assert!(error.contains(expected), "{fault}: {error}");
    }
    // Nobody takes for a request what has another CRC.
    assert_eq!(run(&["motion:masquerade@0.22s"]).0.error, None);
}

/// 64 states ago, 1.28 s, the controller was about to start: neither is that believed, nor does it keep the operator waiting.
#[test]
fn an_old_state_is_no_news() {
    assert_silent(&["State:replay=64@0.35s"], 1.28);
}

/// Some states may be lost, and a controller that starts anew is heard although it counts from 0 again, which is old by its counters.
#[test]
fn a_controller_that_starts_anew_is_told_from_a_silent_one() {
    let (summary, _) = run(&["State:loss@0.3s..0.7s"]);
    assert_eq!(summary.error, None);
    for dead in ["dead@0.37s..+20ms", "dead@0.42s..+5ms"] {
        let (summary, _) = run(&[&format!("controller:{dead}")]);
        let error = summary.error.unwrap();
        assert!(
            error.contains("the controller has started anew"),
            "{dead}: {error}"
        );
        assert!(summary.sim_time_s < 2.0, "{dead}: {}", summary.sim_time_s);
    }
}

/// Whatever the operator waits for then: an answer, the end of a move, of a dwell.
#[test]
fn a_controller_that_reboots_in_a_cycle_has_started_anew() {
    for at in (250..900).step_by(13) {
        let fault = format!("controller:dead@{at}ms..+20ms");
        let (summary, _) = run(&[&fault]);
        assert_eq!(
            summary.error.as_deref(),
            Some("the controller has started anew: it went to pre-operational without a stop"),
            "{fault}"
        );
    }
}
