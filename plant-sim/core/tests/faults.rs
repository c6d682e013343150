//! Planned faults: what is written is what happens, nothing else happens, and the arm stops for the right cause.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/record.rs"]
mod record;

use protocol::frame::CanFrame;
use protocol::messages::{Cause, Message, Mode};
use protocol::time::Instant;
use protocol::{codec, table};
use record::{Record, run_of};
use sim::faults::{Fault, KINDS};
use sim::observer::Truth;
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use sim::summary::Summary;

fn run(faults: &[&str], seed: u64) -> (Summary, Record) {
    let mut scenario = Scenario::built_in("gate").expect("the gate is built in");
    scenario.cycles = 1;
    run_of(scenario, faults, seed)
}

/// The first cause that the controller reports.
fn cause(record: &Record) -> Cause {
    let emergency = |frame: &CanFrame| match codec::decode(frame).ok()?.message {
        Message::Emergency(_, emergency) if emergency.cause != Cause::None => Some(emergency.cause),
        _ => None,
    };
    let mut causes = record
        .frames
        .iter()
        .filter_map(|(_, frame)| emergency(frame));
    causes.next().unwrap_or(Cause::None)
}

/// The modes that the controller reports.
fn modes(record: &Record) -> Vec<Mode> {
    let mode = |frame: &CanFrame| match codec::decode(frame).ok()?.message {
        Message::State(state) => Some(state.mode),
        _ => None,
    };
    record
        .frames
        .iter()
        .filter_map(|(_, frame)| mode(frame))
        .collect()
}

/// In motion at 0.32 s.
const CASES: [(&str, Cause); 12] = [
    ("feedback:loss@0.32s", Cause::PeerSilent),
    ("feedback:corrupt@0.32s", Cause::Corrupted),
    ("feedback:bad-value@0.32s", Cause::BadValue),
    ("drives:silent@0.32s", Cause::PeerSilent),
    ("controller:slow=0.002@0.32s", Cause::Overrun),
    ("encoder:elbow:stuck@0.32s", Cause::StuckSensor),
    ("encoder:shoulder:jump=0.5@0.32s", Cause::EncoderFault),
    ("encoder:elbow:reversed@0.32s", Cause::EncoderFault),
    ("motor:elbow:dead@0.32s", Cause::FollowingError),
    ("motor:shoulder:runaway@0.32s", Cause::FollowingError),
    ("motor:lift:dead@0.33s", Cause::FollowingError),
    ("encoder:elbow:bit=18@0.32s", Cause::EncoderFault),
];

#[test]
fn the_arm_stops_for_the_right_cause_and_stays_stopped() {
    for (text, expected) in CASES {
        let (summary, record) = run(&[text], 0);
        let found = cause(&record);
        assert_eq!(found, expected, "{text}");
        assert!(!summary.completed, "{text}");
        let last = record.truths.last().expect("a run has samples").plant;
        assert!(
            last.qd.iter().all(|qd| qd.abs() < 1e-2),
            "{text} leaves the arm in motion: {:?}",
            last.qd
        );
    }
}

/// A stop closes the loop through the encoders: none begins on one that lies. Where that is an axis of the arm, the shaft is held.
#[test]
fn a_lying_encoder_gets_no_controlled_stop() {
    let mut unseen = 0;
    for defect in ["stuck", "reversed"] {
        for axis in ["shoulder", "elbow", "lift", "wrist"] {
            for at in 0..40 {
                // Until the second move ends.
                let text = format!("encoder:{axis}:{defect}@{}ms", 50 + 15 * at);
                let (summary, record) = run(&[&text], 0);
                match cause(&record) {
                    Cause::StuckSensor if defect == "stuck" => {}
                    Cause::EncoderFault if defect == "reversed" => {}
                    // An axis that need not move any more.
                    Cause::None => unseen += 1,
                    other => panic!("{text}: {other}"),
                }
                if matches!(axis, "lift" | "wrist") {
                    assert!(!modes(&record).contains(&Mode::FaultReaction), "{text}");
                } else if let Some(fault) = summary.faults.first() {
                    let after =
                        (record.truths.iter()).filter(|it| it.plant.t > fault.time_s + 1e-3);
                    let arm = after.map(|it| (it.plant.tau[0], it.plant.tau[1]));
                    assert!(arm.into_iter().all(|torque| torque == (0.0, 0.0)), "{text}");
                }
            }
        }
    }
    assert!(unseen <= 40, "{unseen} of 320 unseen");
}

/// A jump of the elbow shakes the other axes, some of which it throws back, and in ready it is told with its axis as well.
#[test]
fn a_jump_is_told_of_its_own_axis() {
    for (name, axis, jump, at) in [
        ("square", "elbow", -0.02184, 879.64),
        ("square", "elbow", -0.02486, 604.76),
        ("square", "elbow", -0.02392, 875.24),
        ("gate", "lift", 0.00213, 520.91),
        ("gate", "wrist", 0.86573, 838.29),
    ] {
        let mut scenario = Scenario::built_in(name).expect("it is built in");
        scenario.cycles = 1;
        let text = format!("encoder:{axis}:jump={jump}@{at}ms");
        let (summary, _) = run_of(scenario, &[&text], 0);
        assert_eq!(
            summary.faults[0].axis,
            Some(axis),
            "{text}: {:?}",
            summary.faults
        );
    }
}

/// By 1.25 times full speed in a sample, less than what turning back at full speed is. Nothing else is told, and no stop closes the loop.
#[test]
fn a_jump_that_no_axis_can_make_is_told_at_once_at_a_low_rate() {
    for (rate, axis, jump, at) in [
        (100.0, "lift", -0.0275, 0.36),
        (125.0, "lift", -0.0205, 0.46),
        (100.0, "shoulder", 0.096, 0.3),
        (100.0, "wrist", -0.371, 0.51),
        (250.0, "elbow", 0.1025, 0.25),
    ] {
        let mut scenario = Scenario::built_in("gate").expect("it is built in");
        (scenario.cycles, scenario.rate_hz) = (1, rate);
        let text = format!("encoder:{axis}:jump={jump}@{at}s");
        let (summary, _) = run_of(scenario, &[&text], 0);
        let first = &summary.faults[0];
        let found = (first.cause, first.axis);
        assert_eq!(found, ("encoder-fault", Some(axis)), "{text}");
        // The sample of the jump, and what the frames of two take.
        assert!(first.time_s < at + 1.5 / rate, "{text}: {first:?}");
    }
}

/// Nobody acknowledges a feedback, so that it is repeated without end: old ones keep no clock from going on, and the controller says that it has
/// switched off.
#[test]
fn feedback_that_is_repeated_without_end_keeps_nobody_from_switching_off() {
    let mut scenario = Scenario::built_in("square").expect("it is built in");
    scenario.cycles = 1;
    // The last new one is that with which torque goes off.
    let (summary, _) = run_of(scenario, &["feedback:ack-error@1231.8ms"], 0);
    assert!(summary.completed, "{:?}", summary.error);
}

/// The controller hears nothing of its commands being lost; the drives brake by themselves.
#[test]
fn the_drives_brake_when_commands_stop_arriving() {
    for text in ["command:loss@0.32s", "controller:silent@0.32s"] {
        let (summary, record) = run(&[text], 0);
        assert!(!summary.completed, "{text}");
        let commands = |(time, frame): &&(Instant, CanFrame)| {
            table::COMMAND.identifies(frame) && time.seconds() > 0.3205
        };
        assert_eq!(record.frames.iter().filter(commands).count(), 0, "{text}");
        let last = record.truths.last().expect("a run has samples").plant;
        assert!(last.qd.iter().all(|qd| qd.abs() < 1e-2), "{text}");
    }
}

/// What a sound link carries must survive: a few lost or doubled frames are no reason to stop.
#[test]
fn a_few_bad_frames_are_ridden_out() {
    for text in [
        "feedback:loss@0.32s..0.322s",
        "feedback:duplicate@0.32s..0.322s",
        "command:loss@0.32s..0.323s",
        "command:duplicate@0.32s..0.52s",
        "command:corrupt@0.32s..0.323s",
        "state:loss@0.22s..0.42s",
        "motionreply:duplicate@0s",
        "feedback:jitter=0.0001@0.22s..0.42s",
    ] {
        let (summary, record) = run(&[text], 1);
        assert!(summary.completed, "{text}: {:?}", cause(&record));
    }
}

#[test]
fn chance_follows_the_seed_alone() {
    let frames = |seed| run(&["command:loss=0.2@0.22s..0.42s"], seed).1.frames;
    assert_eq!(frames(7), frames(7));
    assert_ne!(frames(7), frames(8));
}

#[test]
fn a_fault_outside_the_run_changes_nothing() {
    let (_, sound) = run(&[], 0);
    for kind in KINDS {
        let place = match kind.place {
            "message" => "feedback",
            "node" => "controller",
            place => place,
        };
        let axis = if kind.has_axis { ":lift" } else { "" };
        let value = kind
            .value
            .map_or_else(String::new, |value| format!("={}", value.greatest));
        let text = format!("{place}{axis}:{}{value}@1000s..2000s", kind.name);
        let (_, record) = run(&[&text], 0);
        assert_eq!(record.frames, sound.frames, "{text}");
    }
}

#[test]
fn a_payload_that_falls_is_felt() {
    let (_, sound) = run(&[], 0);
    let (_, dropped) = run(&["payload:dropped@0.32s"], 0);
    let differs = |(a, b): (&Truth, &Truth)| a.plant.q != b.plant.q;
    let first = sound.truths.iter().zip(&dropped.truths).position(differs);
    let time = first.map(|index| sound.truths[index].plant.t);
    assert!(time.is_some_and(|t| (0.32..0.322).contains(&t)), "{time:?}");
}

#[test]
fn a_stuck_brake_keeps_the_lift_closed_or_open() {
    // Closed when it sticks: the lift never moves, and the controller does not take that for a motion.
    let (summary, record) = run(&["brake:stuck@0s"], 0);
    assert!(!summary.completed);
    let heights: Vec<_> = record.truths.iter().map(|truth| truth.plant.q[2]).collect();
    let moved = heights
        .iter()
        .fold(0.0_f64, |most, q| most.max((q - heights[0]).abs()));
    assert!(moved < 1e-3, "{moved}");
}

#[test]
fn what_is_not_a_fault_is_refused_with_what_is_allowed() {
    for (text, expected) in [
        ("encoder:elbow:stuck", "there is no time"),
        (
            "encoder:elbow:stuck@0.3",
            "is not a time; allowed: seconds as 0.3s",
        ),
        ("encoder:elbow:stuck@0.5s..0.3s", "0.5s..0.3s is empty"),
        (
            "encoder:elbow:stuck@0.5s..+0ms",
            "is empty: it has to end after it begins",
        ),
        (
            "encoder:elbow:stuck@jump4294967296",
            "allowed: a whole number from 1 to 4294967295, as in jump2",
        ),
        (
            "encoder:elbow:stuck@1.5samples",
            "allowed: a whole number from 0 to 4294967295, as 300samples",
        ),
        (
            "encoder:elbow:bit=1.5@0.3s",
            "bit is 1.5; allowed: a whole number from 0 to 31 number of the bit",
        ),
        (
            "command:replay=1.5@0.3s",
            "allowed: a whole number from 1 to 64 frames",
        ),
        ("encoder:elbo:stuck@0.3s", "did you mean elbow?"),
        ("encoder:elbow:stuk@0.3s", "did you mean stuck?"),
        ("encodr:elbow:stuck@0.3s", "did you mean encoder?"),
        (
            "encoder:stuck@0.3s",
            "there is no axis \"stuck\"; allowed: shoulder, elbow, lift, wrist",
        ),
        ("encoder:elbow:jump@0.3s", "jump needs a value"),
        (
            "encoder:elbow:jump=nan@0.3s",
            "jump is nan; allowed: -10 to 10 rad",
        ),
        ("drives:slow=0.1@0.3s", "allowed: controller:slow"),
        ("command:loss=2@0.3s", "loss is 2; allowed: 0 to 1"),
        ("command:duplicate=2@0.3s", "duplicate takes no value"),
        ("estop:forged@0.3s", "nothing to repeat of EStop; allowed: "),
        ("nmt:forged@0.3s", "nothing to repeat of Nmt; allowed: "),
        ("command:loss:1@0.3s", "is too much"),
        ("", "there is no time"),
    ] {
        let error = text.parse::<Fault>().expect_err(text).to_string();
        assert!(error.contains(expected), "{error}");
    }
    let text = include_str!("../../scenarios/gate.toml");
    let text = format!("faults = [\"encoder:elbo:stuck@0.3s\"]\n{text}");
    let error = Scenario::parse(&text, "mine")
        .expect_err("no such axis")
        .to_string();
    assert!(
        error.contains("line 1") && error.contains("did you mean elbow?"),
        "{error}"
    );
}

/// Sample 300 is at 300 ms, or at 150.
#[test]
fn a_window_that_is_empty_at_the_rate_of_the_run_is_refused_by_its_key() {
    for (rate, fault, empty) in [
        (1000.0, "encoder:elbow:stuck@400ms..300samples", true),
        (1000.0, "encoder:elbow:stuck@300samples..300ms", true),
        (1000.0, "encoder:elbow:stuck@300samples..301ms", false),
        (2000.0, "encoder:elbow:stuck@300samples..160ms", false),
    ] {
        let mut config = RunConfig::new(Scenario::built_in("gate").unwrap());
        config.scenario.rate_hz = rate;
        config.scenario.faults = vec![
            "payload:dropped@9s".parse().unwrap(),
            fault.parse().unwrap(),
        ];
        let said = config.rig().err().map(|error| error.to_string());
        let expected = format!("faults[1] is {fault}; allowed: a window that ends after it begins");
        assert_eq!(
            said.as_ref().is_some_and(|said| said.contains(&expected)),
            empty,
            "{said:?}"
        );
        assert_eq!(said.is_some(), empty);
    }
}

/// A drive that is in fault before anything is switched on, and an encoder that jumps then: the arm is not switched on.
#[test]
fn an_arm_that_is_not_sound_is_not_switched_on() {
    for (fault, cause) in [
        ("motor:wrist:dip@0.01s", "drive-fault"),
        ("encoder:elbow:jump=0.2@0.02s", "encoder-fault"),
    ] {
        let (summary, record) = run(&[fault], 5);
        assert_eq!(summary.faults[0].cause, cause, "{fault}");
        assert!(summary.faults[0].time_s < 0.025, "{fault}");
        let on = record.truths.iter().any(|it| it.plant.tau != [0.0; 4]);
        assert!(!on || cause == "encoder-fault", "{fault}");
    }
}

/// Drives that let go while the brake opens, once they have been on, are told in the next sample.
#[test]
fn drives_that_let_go_while_the_brake_opens_are_told() {
    let (summary, _) = run(&["command:loss@enabling+10ms..+12ms"], 5);
    let first = &summary.faults[0];
    assert_eq!(first.cause, "drive-fault");
    // Enabling begins at 26 ms: five samples after the last command, and one to tell it.
    assert!(first.time_s < 0.045, "{}", first.time_s);
}
