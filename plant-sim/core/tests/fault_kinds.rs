//! Kinds of faults of frames, nodes and clocks: each does what its row says, by a law or a count from elsewhere.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

#[path = "common/gate.rs"]
mod gate;
#[path = "common/record.rs"]
mod record;

use std::collections::BTreeMap;

use gate::{cause, gate};
use protocol::codec::{self, DecodeError, Encoder};
use protocol::frame::CanFrame;
use protocol::messages::{Cause, Command, ControlWord, Message, Mode, Node};
use protocol::table;
use protocol::time::{Duration, Instant};
use record::Record;
use sim::clock::Clock;
use sim::faults::{Fault, Faulty};
use sim::peer::{Outbox, Peer, PeerError};
use sim::rig::Rig;
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use sim::world::{Mind, World};

/// Numbers the commands that it sends, one a call.
struct Counter(u32, Encoder);

impl Peer for Counter {
    fn wake(&self) -> Option<Instant> {
        None
    }

    fn poll(
        &mut self,
        now: Instant,
        _: Option<&CanFrame>,
        _: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        let command = Command {
            sample: self.0,
            control: ControlWord::EMPTY,
            torque: [0.0; 4],
        };
        self.0 += 1;
        out.push((now, self.1.encode(&Message::Command(command)).unwrap()));
        Ok(())
    }
}

/// What is left of so many commands.
fn survivors(fault: &str, count: u32, seed: u64) -> Vec<u32> {
    let config = RunConfig::new(Scenario::built_in("gate").unwrap());
    let config = config.rig().unwrap();
    let planned = Rig::new(&config).plan(&fault.parse().unwrap());
    let mut faulty = Faulty::new(
        Counter(0, Encoder::default()),
        Node::Controller,
        &[planned],
        seed,
    );
    let mut world = World {
        plant: sim::plant::Plant::new(&config.actual, config.start),
        mind: Mind::BLANK,
        sample: None,
        clock: Clock::default(),
        cell_events: Vec::new(),
        outcome: None,
    };
    let mut out = Outbox::new();
    for call in 0..count {
        let now = Instant::ORIGIN + Duration::from_millis(1) * call;
        faulty.poll(now, None, &mut world, &mut out).unwrap();
    }
    let number = |frame: &CanFrame| match codec::decode(frame).unwrap().message {
        Message::Command(command) => command.sample,
        _ => panic!("{frame}"),
    };
    out.iter().map(|(_, frame)| number(frame)).collect()
}

/// The chain of Gilbert: bursts have a geometric length of the mean that is asked for, and as many frames as asked for are in one. Both
/// within five standard deviations; those of a share of a Markov chain are wider than of a coin by (1 + r) / (1 - r), with r its
/// correlation from one frame to the next.
#[test]
fn bursts_are_those_of_gilbert() {
    const COUNT: u32 = 200_000;
    for (share, length) in [(0.2, 10.0), (0.05, 4.0), (0.5, 2.0)] {
        let left = survivors(&format!("command:burst={share}/{length}@0s"), COUNT, 3);
        let n = f64::from(COUNT);
        let lost = (n - left.len() as f64) / n;
        let (ends, begins) = (1.0 / length, share / (1.0 - share) / length);
        let correlation: f64 = 1.0 - ends - begins;
        let deviation =
            (share * (1.0 - share) / n * (1.0 + correlation) / (1.0 - correlation)).sqrt();
        assert!(
            (lost - share).abs() < 5.0 * deviation,
            "{share}/{length}: {lost}"
        );
        let gaps = left
            .windows(2)
            .map(|two| two[1] - two[0] - 1)
            .filter(|gap| *gap > 0);
        let mut lengths = BTreeMap::new();
        gaps.for_each(|gap| *lengths.entry(gap).or_insert(0_u32) += 1);
        let bursts = f64::from(lengths.values().sum::<u32>());
        for least in 1..=12_u32 {
            let found =
                f64::from(lengths.range(least..).map(|(_, count)| *count).sum::<u32>()) / bursts;
            let expected = (1.0 - ends).powi(least as i32 - 1);
            let deviation = (expected * (1.0 - expected) / bursts).sqrt();
            assert!(
                (found - expected).abs() <= 5.0 * deviation,
                "{share}/{length}, {least}: {found} {expected}"
            );
        }
    }
    assert_eq!(
        survivors("command:burst=0.2/10@0s", 1000, 3),
        survivors("command:burst=0.2/10@0s", 1000, 3)
    );
    assert_ne!(
        survivors("command:burst=0.2/10@0s", 1000, 3),
        survivors("command:burst=0.2/10@0s", 1000, 4)
    );
}

/// By hand. One that is held back goes out behind the next one, also when the fault has ended meanwhile.
#[test]
fn reordered_frames_change_places() {
    assert_eq!(survivors("command:reorder@0s", 6, 0), [1, 0, 3, 2, 5, 4]);
    assert_eq!(survivors("command:reorder@0s", 5, 0), [1, 0, 3, 2]);
    assert_eq!(
        survivors("command:reorder@2ms..3ms", 6, 0),
        [0, 1, 3, 2, 4, 5]
    );
    let some = survivors("command:reorder=0.2@0s", 1000, 1);
    let mut sorted = some.clone();
    sorted.sort_unstable();
    assert!(some != sorted && sorted.windows(2).all(|two| two[0] < two[1]));
}

fn commands(record: &Record) -> Vec<CanFrame> {
    let frames = record.frames.iter().map(|(_, frame)| *frame);
    frames
        .filter(|frame| table::COMMAND.identifies(frame))
        .collect()
}

/// Where the commands of two runs first differ.
fn first_difference(a: &Record, b: &Record) -> Option<(usize, CanFrame, CanFrame)> {
    let (a, b) = (commands(a), commands(b));
    let pairs = a.into_iter().zip(b).enumerate();
    pairs.map(|(k, (a, b))| (k, a, b)).find(|(_, a, b)| a != b)
}

/// Frames that the controller has dropped.
fn rejected(record: &Record) -> u16 {
    let states = record.frames.iter().rev();
    let mut counts = states.filter_map(|(_, frame)| match codec::decode(frame).ok()?.message {
        Message::State(state) => Some(state.rejected),
        _ => None,
    });
    counts.next().unwrap()
}

/// A foreign node without the protection, between the frames of the drives: what it sends is dropped and counted, and every command
/// is the one of a run without it.
#[test]
fn a_poor_masquerade_changes_no_torque() {
    let (_, without) = gate("payload:dropped@100s");
    for fault in ["feedback:masquerade@300.5ms", "feedback:masquerade@300.7ms"] {
        let (summary, with) = gate(fault);
        assert!(summary.completed, "{fault}: {:?}", summary.error);
        assert_eq!(first_difference(&with, &without), None, "{fault}");
        assert!(
            rejected(&with) > rejected(&without) + 500,
            "{fault}: {}",
            rejected(&with)
        );
    }
}

/// What a foreign node says in the controller's name is no fault of the controller: the frames are on the bus, and the summary, which
/// knows who sent them, has only what the controller makes of them.
#[test]
fn a_foreign_emergency_is_no_fault_of_the_controller() {
    let (summary, record) = gate("controlleremergency:masquerade@300.5ms..+100ms");
    assert_ne!(cause(&record), Cause::None, "none of them looks like one");
    let causes: Vec<_> = summary.faults.iter().map(|it| it.cause).collect();
    assert_eq!(causes, [Cause::DuplicateNode.name()]);
    // One of its own is.
    let (summary, _) = gate("motor:elbow:dead@0.4s");
    assert_eq!(summary.faults.len(), 1);
}

/// When a fault was in effect is in the summary: by its text where that says it, by what happened where it depends on that.
#[test]
fn the_summary_says_when_a_fault_was_in_effect() {
    let of = |fault: &str| {
        let (summary, record) = gate(fault);
        let [injected] = summary.injected.as_slice() else {
            panic!("{fault}: {:?}", summary.injected);
        };
        assert_eq!(injected.fault, fault);
        (
            injected.times,
            injected.from_s,
            injected.until_s,
            summary,
            record,
        )
    };
    let (times, from, until, ..) = of("command:duplicate@250samples..0.5s");
    assert_eq!((times, from, until), (1, Some(0.25), Some(0.5)));
    let (times, from, until, summary, _) = of("payload:dropped@0.5s");
    assert_eq!(
        (times, from, until),
        (1, Some(0.5), Some(summary.sim_time_s))
    );
    for never in ["payload:dropped@100s", "payload:dropped@jump9"] {
        let (times, from, until, ..) = of(never);
        assert_eq!((times, from, until), (0, None, None), "{never}");
    }
    let (times, from, until, _, record) = of("command:duplicate@while=moving");
    let moving = |it: &&sim::observer::Truth| it.mind.mode == Mode::Moving;
    let of_mode: Vec<f64> = record
        .truths
        .iter()
        .filter(moving)
        .map(|it| it.plant.t)
        .collect();
    // Seen at the sample after the one that was answered so.
    let first = of_mode[0];
    let last = of_mode[of_mode.len() - 1];
    assert!(
        times >= 1 && (from.unwrap() - first).abs() < 0.0015,
        "{from:?} {first}"
    );
    assert!((until.unwrap() - last).abs() < 0.0025, "{until:?} {last}");
}

/// At the same instant as the frames of the drives it destroys them, and its own: the arm stops.
#[test]
fn a_masquerade_on_the_beat_is_a_bus_error() {
    let (summary, record) = gate("feedback:masquerade@400ms");
    assert!(
        !summary.completed && summary.bus_errors > 16,
        "{}",
        summary.bus_errors
    );
    assert_ne!(cause(&record), Cause::None);
}

/// A sample that the controller has had already is nothing new, whatever its counter says: it is dropped, and does not take the place of
/// the true one after it.
#[test]
fn a_forged_feedback_changes_nothing() {
    let (_, without) = gate("payload:dropped@100s");
    let (summary, with) = gate("feedback:forged@400.5ms");
    assert!(summary.completed, "{:?}", summary.error);
    // Once the torque is off the drives may restart.
    if let Some((_, _, command)) = first_difference(&with, &without) {
        let Message::Command(command) = codec::decode(&command).unwrap().message else {
            panic!("a command");
        };
        assert_eq!(command.control, ControlWord::EMPTY);
    }
    assert!(rejected(&with) > 400, "{}", rejected(&with));
}

/// A feedback so late that its counter looks new: its sample runs backwards.
#[test]
fn a_very_late_feedback_changes_nothing() {
    for ms in [129, 192, 255, 1000] {
        let (summary, _) = gate(&format!(
            "feedback:delay={}@200samples..+1samples",
            f64::from(ms) * 1e-3
        ));
        assert!(summary.completed, "{ms} ms: {:?}", summary.error);
    }
}

fn feedback_times(record: &Record) -> Vec<f64> {
    let frames = record
        .frames
        .iter()
        .filter(|(_, frame)| table::FEEDBACK.identifies(frame));
    frames.map(|(time, _)| time.seconds()).collect()
}

/// A clock that is fast by a fiftieth has a period shorter by as much; the time of the frame on the bus differs by its stuff bits.
#[test]
fn a_clock_that_drifts_changes_the_period() {
    for (drift, period) in [("0.02", 1.0 / 1.02), ("-0.02", 1.0 / 0.98), ("0", 1.0)] {
        let (_, record) = gate(&format!("clock:drift={drift}@0.1s..0.2s"));
        let times: Vec<f64> = feedback_times(&record)
            .into_iter()
            .filter(|t| (0.11..0.19).contains(t))
            .collect();
        let mean = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64 * 1e3;
        assert!((mean - period).abs() < 2e-4, "{drift}: {mean}");
    }
}

/// A tick that is lost is not counted. With a clock that stands still nobody answers, and the drives let go by another one.
#[test]
fn a_clock_that_misses_its_ticks() {
    let (_, record) = gate("clock:misses@100ms..110ms");
    let times = feedback_times(&record);
    let gap = times
        .windows(2)
        .map(|two| two[1] - two[0])
        .fold(0.0, f64::max);
    assert!((gap - 0.011).abs() < 1e-4, "{gap}");
    let (summary, record) = gate("clock:misses@0.4s");
    assert!(!summary.completed && summary.at_rest);
    let off = record
        .truths
        .iter()
        .find(|it| it.plant.t > 0.4 && it.plant.tau == [0.0; 4])
        .unwrap();
    assert!(off.plant.t < 0.4 + 0.0085, "{}", off.plant.t);
}

/// The drives say that one of them is in fault, and the brake closes at once.
#[test]
fn a_dip_of_a_drive_is_reported_by_it() {
    for axis in ["shoulder", "elbow", "lift", "wrist"] {
        let (summary, record) = gate(&format!("motor:{axis}:dip@0.4s..0.42s"));
        assert_eq!(cause(&record), Cause::DriveFault, "{axis}");
        assert!(!summary.completed && summary.at_rest, "{axis}");
    }
}

/// By hand: with 2 ms for each sample of 1 ms every answer is a millisecond later than the one before it. The fifth that is late stops the arm. With
/// half a millisecond each is in time for the next sample.
#[test]
fn a_slow_controller_answers_later_and_later() {
    let times = |record: &Record| -> Vec<f64> {
        let commands = record.frames.iter();
        let commands = commands.filter(|(_, frame)| table::COMMAND.identifies(frame));
        let times = commands.map(|(time, _)| time.seconds());
        times.filter(|time| *time > 0.4).collect()
    };
    let (_, sound) = gate("payload:heavier=0@0s");
    let (summary, slow) = gate("controller:slow=0.002@0.4s");
    assert_eq!(cause(&slow), Cause::Overrun);
    assert!(!summary.completed && summary.at_rest);
    let late = times(&slow).into_iter().zip(times(&sound));
    for (number, (slow, sound)) in (0..5).zip(late) {
        // Give or take what another frame on the bus takes.
        let late = slow - sound - 2e-3 - 1e-3 * f64::from(number);
        assert!(late.abs() < 0.2e-3, "{number}: {late}");
    }
    let (summary, in_time) = gate("controller:slow=0.0005@0.4s");
    assert!(summary.completed, "{:?}", summary.error);
    let first = |record: &Record| times(record)[0];
    assert!((first(&in_time) - first(&sound) - 0.5e-3).abs() < 0.2e-3);
}

/// All that is protected is right: only the range of the number is not.
#[test]
fn a_bad_value_is_the_only_thing_that_is_wrong() {
    let (summary, record) = gate("feedback:bad-value@0.4s..0.402s");
    assert!(summary.completed, "two can be noise: {:?}", summary.error);
    let bad: Vec<_> = record
        .frames
        .iter()
        .filter(|(_, frame)| codec::decode(frame).is_err())
        .collect();
    assert_eq!(bad.len(), 2);
    for (_, frame) in bad {
        assert!(table::FEEDBACK.identifies(frame));
        let error = codec::decode(frame).unwrap_err();
        assert!(matches!(error, DecodeError::Value(_)), "{error:?}");
    }
    let refused = "motion:bad-value@0s"
        .parse::<Fault>()
        .unwrap_err()
        .to_string();
    assert!(
        refused.contains("allowed: Feedback, Command, State"),
        "{refused}"
    );
}
