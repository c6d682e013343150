//! When faults are in effect: at the sample, in the state, in the move that their text names, and at no other time.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/record.rs"]
mod record;

use protocol::messages::Mode;
use protocol::table;
use record::{Record, run_of};
use sim::faults::Fault;
use sim::scenario::Scenario;

/// Two jumps, from 0.2 s on, the second one from where the first ends.
fn gate(fault: &str) -> Record {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 1;
    run_of(scenario, &[fault], 0).1
}

/// Times at which no command is on the bus for more than a sample, of a run in which commands are lost.
fn lost(record: &Record) -> Vec<(f64, f64)> {
    let commands = record
        .frames
        .iter()
        .filter(|(_, frame)| table::COMMAND.identifies(frame));
    let times: Vec<f64> = commands.map(|(time, _)| time.seconds()).collect();
    let gaps = times.windows(2).filter(|two| two[1] - two[0] > 0.0015);
    gaps.map(|two| (two[0], two[1])).collect()
}

/// A window by its time in samples is that by its time.
#[test]
fn samples_are_times() {
    let by_time = gate("command:loss@400ms..403ms");
    assert_eq!(
        by_time.frames,
        gate("command:loss@400samples..403samples").frames
    );
    assert_eq!(
        by_time.frames,
        gate("command:loss@400samples..+3samples").frames
    );
    assert_eq!(by_time.frames, gate("command:loss@0.4s..+3ms").frames);
    assert_eq!(lost(&by_time).len(), 1);
    // At another rate they are others.
    let mut scenario = Scenario::built_in("gate").unwrap();
    (scenario.cycles, scenario.rate_hz) = (1, 2000.0);
    let (_, fast) = run_of(
        scenario.clone(),
        &["command:loss@400samples..403samples"],
        0,
    );
    let (_, same) = run_of(scenario, &["command:loss@200ms..201.5ms"], 0);
    assert_eq!(fast.frames, same.frames);
}

/// The second move begins where its request's number is the one under way: its reference leaves the place where the first one has
/// ended, within a sample, and comes to rest once more.
#[test]
fn the_second_jump_is_the_second() {
    let sound = gate("payload:dropped@100s");
    let rests = |index: usize| {
        let speed = |truth: &sim::observer::Truth| truth.mind.qd.iter().all(|qd| qd.abs() < 0.02);
        speed(&sound.truths[index]) && !speed(&sound.truths[index + 1])
    };
    let begins: Vec<usize> = (0..sound.truths.len() - 1).filter(|&i| rests(i)).collect();
    assert_eq!(begins.len(), 2, "two jumps of one cycle: {begins:?}");
    for (number, begin) in [
        ("jump", begins[0]),
        ("jump1", begins[0]),
        ("jump2", begins[1]),
        ("move2", begins[1]),
    ] {
        let [(from, until)] = lost(&gate(&format!("command:loss@{number}+20ms..+3ms")))[..] else {
            panic!("{number}");
        };
        let begin = sound.truths[begin].plant.t;
        assert!(
            (from - begin - 0.020).abs() < 0.003,
            "{number}: {begin} {from}"
        );
        assert!(
            (until - from - 0.004).abs() < 0.0015,
            "{number}: {from} {until}"
        );
    }
    // There are only two, and no line.
    for never in ["jump3", "line", "joints", "cycle2", "quick-stop"] {
        assert_eq!(
            gate(&format!("command:loss@{never}")).frames,
            sound.frames,
            "{never}"
        );
    }
}

/// `while` holds as often as it is so. The drives break no sooner than the controller says that it moves, and are sound as soon as it
/// does not.
#[test]
fn a_window_lasts_as_long_as_something_goes_on() {
    // Old frames of a message that nobody needs: only to see when.
    let record = gate("command:duplicate@while=moving");
    let mut doubled = Vec::new();
    let mut last = None;
    for (time, frame) in &record.frames {
        if table::COMMAND.identifies(frame) {
            if last == Some(*frame) {
                doubled.push(time.seconds());
            }
            last = Some(*frame);
        }
    }
    let modes: Vec<(f64, Mode)> = record
        .truths
        .iter()
        .map(|it| (it.plant.t, it.mind.mode))
        .collect();
    let moving: Vec<f64> = modes
        .iter()
        .filter(|(_, mode)| *mode == Mode::Moving)
        .map(|(t, _)| *t)
        .collect();
    // What a sample ends with holds from the next one on.
    let during = |t: &f64| {
        moving
            .iter()
            .any(|m| *t > m + 0.001 - 1e-9 && *t < m + 0.002)
    };
    assert!(doubled.len() > 200, "{}", doubled.len());
    assert!(doubled.iter().all(during));
    assert!(
        doubled.len().abs_diff(moving.len()) <= 1,
        "{} {}",
        doubled.len(),
        moving.len()
    );
}

/// The lift goes up at the beginning of a jump and down at its end.
#[test]
fn the_way_of_the_lift_opens_a_window() {
    for (text, sign) in [("while=lift-down", 1.0), ("while=lift-up", -1.0)] {
        let record = gate(&format!("command:duplicate@{text}"));
        let mut last = None;
        let mut seen = 0;
        for (time, frame) in &record.frames {
            if table::COMMAND.identifies(frame) && last.replace(*frame) == Some(*frame) {
                let sample = (time.seconds() * 1e3) as usize;
                let speed = record.truths[sample].plant.qd[2] * sign;
                assert!(speed > 1e-3, "{text}: {speed} at {time:?}");
                seen += 1;
            }
        }
        assert!(seen > 50, "{text}: {seen}");
    }
}

/// After a reset by hand the same state may come again: a moment is the first time, `while` is each.
#[test]
fn moments_come_once() {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 3;
    let count = |fault: &str| lost(&run_of(scenario.clone(), &[fault], 0).1).len();
    assert_eq!(count("command:loss@jump+20ms..+3ms"), 1);
    assert_eq!(count("command:loss@jump5+20ms..+3ms"), 1);
    assert_eq!(count("command:loss@cycle3+50ms..+3ms"), 1);
    assert_eq!(count("command:loss@cycle4+50ms..+3ms"), 0);
}

/// Whoever breaks the bus is told as well.
#[test]
fn errors_on_the_bus_wait_too() {
    let errors = |fault: &str| {
        let mut scenario = Scenario::built_in("gate").unwrap();
        scenario.cycles = 1;
        run_of(scenario, &[fault], 3).0.bus_errors
    };
    assert_eq!(errors("command:crc-error=0.2@quick-stop"), 0);
    assert!(errors("command:crc-error=0.2@jump2+50ms..+20ms") > 0);
    assert!(errors("bus:dominant@jump2+50ms..+1ms") > 0);
    let moving = errors("command:crc-error=0.1@while=moving");
    let always = errors("command:crc-error=0.1@0s");
    assert!(moving > 20 && moving < always, "{moving} of {always}");
}

/// The controller stops the arm, and only then the brake turns out to be stuck.
#[test]
fn a_fault_waits_for_another() {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 1;
    let faults = [
        "feedback:corrupt@0.45s..0.46s",
        "brake:stuck-open@fault-reaction",
    ];
    let (_, record) = run_of(scenario, &faults, 0);
    let end = record.truths.last().unwrap();
    // The motor holds what the brake does not.
    assert_eq!(end.mind.mode, Mode::FaultReaction);
    assert!(end.plant.tau[2].abs() > 10.0, "{:?}", end.plant.tau);
    let opened = record
        .truths
        .iter()
        .find(|it| it.mind.mode == Mode::FaultReaction);
    assert!(opened.is_some());
}

/// The second jump begins at 0.475 s.
#[test]
fn a_window_that_would_end_before_it_begins_does_not_come() {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 1;
    let (_, sound) = run_of(scenario.clone(), &["payload:dropped@100s"], 0);
    for (fault, times) in [
        ("motor:lift:dead@jump2+200ms..0.1s", 0),
        ("motor:lift:dead@jump2..300samples", 0),
        ("motor:lift:dead@jump2..0.477s", 1),
    ] {
        let (summary, record) = run_of(scenario.clone(), &[fault], 0);
        let injected = &summary.injected[0];
        assert_eq!(injected.times, times, "{fault}: {injected:?}");
        assert_eq!(injected.from_s.is_some(), times > 0, "{fault}");
        assert_eq!(injected.until_s.is_some(), times > 0, "{fault}");
        assert_eq!(record.frames == sound.frames, times == 0, "{fault}");
    }
}

#[test]
fn a_window_that_means_nothing_is_refused_with_what_is_allowed() {
    for (window, expected) in [
        ("jmp2", "did you mean jump?"),
        ("jump0", "a whole number from 1 to"),
        ("jump2+3", "is not a time; allowed: seconds as 0.3s"),
        ("while=movin", "did you mean moving?"),
        ("3.5samples", "is not a number of samples"),
        ("10samples..5samples", "is empty: it has to end"),
        ("jump2..+0ms", "is empty: it has to end"),
        ("0.3s..+0samples", "is empty: it has to end"),
        ("0.3s..", "is not a time"),
        ("", "is not a time"),
    ] {
        let text = format!("drives:silent@{window}");
        let error = text.parse::<Fault>().unwrap_err().to_string();
        assert!(error.contains(expected), "{text}: {error}");
    }
    for window in [
        "jump2..0.9s",
        "lift-down+5samples..+1s",
        "while=jump2",
        "enabled3",
        "estop+1ms",
    ] {
        let text = format!("drives:silent@{window}");
        assert_eq!(text.parse::<Fault>().unwrap().text, text);
    }
}
