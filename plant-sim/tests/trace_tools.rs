//! The trace tools against traces whose content is known: made here frame by frame, or by a run.

use std::sync::LazyLock;

use firmware::mechanics::arm::IRB_930;
use plant_sim::check::{Checker, Offence};
use plant_sim::plot::{Plot, page};
use plant_sim::replay::Replay;
use plant_sim::run::execute;
use protocol::codec::{self, DecodeError};
use protocol::e2e::Verdict;
use protocol::frame::{CanFrame, StandardId};
use protocol::messages::{Command, ControlWord, DriveStatus, Feedback, Message};
use protocol::table;
use protocol::time::Period;
use protocol::wire::{BitTiming, FrameBits};
use sim::model::RobotModel;
use sim::rig::RigConfig;
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use sim::summary::Summary;
use trace::decode::{Decoder, Format};
use trace::difference::Difference;
use trace::stats::{BusStatistics, Gatherer, Statistics};
use trace::{Entry, ErrorFrame, Interface, Reader, Record};

fn record(time_us: u64, frame: CanFrame) -> Record {
    Record {
        time_us,
        interface: Interface::CAN0,
        direction: None,
        entry: Entry::Frame(frame),
    }
}

fn frame_of(record: &Record) -> CanFrame {
    match record.entry {
        Entry::Frame(frame) => frame,
        Entry::Error(_) => panic!("an error frame"),
    }
}

fn feedback(sample: u32) -> CanFrame {
    let feedback = Feedback {
        sample,
        status: DriveStatus::READY | DriveStatus::ENCODER_VALID,
        position: [1, -2, 3, -4],
        velocity: [0.5, -0.25, 0.0, 1000.0],
        torque: [0, -1, 1000, -1000],
    };
    codec::encode(&Message::Feedback(feedback), sample as u8).unwrap()
}

fn command(sample: u32, counter: u8, control: ControlWord, torque: [f32; 4]) -> CanFrame {
    let command = Command {
        sample,
        control,
        torque,
    };
    codec::encode(&Message::Command(command), counter).unwrap()
}

/// Samples 0 to 9 at 1 kHz, each answered after 200 us.
fn good() -> Vec<Record> {
    (0..10)
        .flat_map(|n: u32| {
            let time = 1000 * u64::from(n);
            [
                record(time, feedback(n)),
                record(
                    time + 200,
                    command(n, n as u8, ControlWord::EMPTY, [0.0; 4]),
                ),
            ]
        })
        .collect()
}

fn check(records: &[Record]) -> Option<(usize, Offence)> {
    let mut checker = Checker::new(&IRB_930);
    records
        .iter()
        .enumerate()
        .find_map(|(index, record)| checker.record(record).err().map(|offence| (index, offence)))
}

/// `good()` with record `index` replaced by another frame at the same time.
fn with(index: usize, frame: CanFrame) -> Vec<Record> {
    let mut records = good();
    records[index].entry = Entry::Frame(frame);
    records
}

fn without(index: usize) -> Vec<Record> {
    let mut records = good();
    records.remove(index);
    records
}

#[test]
fn a_good_trace_breaks_no_rule() {
    assert_eq!(check(&good()), None);
}

#[test]
fn every_rule_is_told_where_it_is_broken() {
    let torque = ControlWord::TORQUE_ENABLE;
    let mut damaged = *feedback(4).data().first_chunk::<48>().unwrap();
    damaged[10] ^= 1;
    let damaged = CanFrame::fd(StandardId::new(table::FEEDBACK.id).unwrap(), &damaged, true);
    let mut backwards = good();
    backwards[9].time_us = 3999;
    let mut twice = good();
    twice.insert(10, record(4300, command(4, 5, torque, [0.0; 4])));
    let mut late = good();
    for record in &mut late[10..] {
        record.time_us += 100_000;
    }
    let message = "Command";
    let cases = [
        (backwards, 9, Offence::Backwards { by_us: 1 }),
        (
            with(8, damaged.unwrap()),
            8,
            Offence::Refused {
                message: "Feedback",
                error: DecodeError::Crc,
            },
        ),
        (
            // The command that answers the lost feedback is the first to tell.
            without(8),
            8,
            Offence::Echo {
                found: 4,
                newest: 3,
            },
        ),
        (without(9), 9, Offence::Unanswered { sample: 4 }),
        (
            with(9, command(4, 3, torque, [0.0; 4])),
            9,
            Offence::Counter {
                message,
                counter: 3,
                verdict: Verdict::Duplicate,
            },
        ),
        (
            with(9, command(4, 2, torque, [0.0; 4])),
            9,
            Offence::Counter {
                message,
                counter: 2,
                verdict: Verdict::Stale(1),
            },
        ),
        (
            with(9, command(4, 7, torque, [0.0; 4])),
            9,
            Offence::Counter {
                message,
                counter: 7,
                verdict: Verdict::Lost(3),
            },
        ),
        (
            with(9, command(3, 4, torque, [0.0; 4])),
            9,
            Offence::Echo {
                found: 3,
                newest: 4,
            },
        ),
        (twice, 10, Offence::Twice { sample: 4 }),
        (good()[1..].to_vec(), 0, Offence::NoFeedback { found: 0 }),
        (
            late,
            10,
            Offence::Age {
                message: "Feedback",
                age_us: 101_000,
                limit_us: 100_000,
            },
        ),
        (
            with(9, command(4, 4, ControlWord::EMPTY, [0.0, 0.5, 0.0, 0.0])),
            9,
            Offence::TorqueDisabled {
                motor: 1,
                torque: 0.5,
            },
        ),
        (
            with(9, command(4, 4, torque, [0.0, 0.0, 0.0, -1.6])),
            9,
            Offence::TorqueLimit {
                motor: 3,
                torque: -1.6,
                limit: IRB_930.drive.motor_torque_limit.w,
            },
        ),
    ];
    for (records, index, offence) in cases {
        assert_eq!(check(&records), Some((index, offence)));
    }
    // A sample number that skips while the counter does not: a sender that is not one of ours.
    let skipping = Feedback {
        sample: 7,
        status: DriveStatus::READY,
        position: [0; 4],
        velocity: [0.0; 4],
        torque: [0; 4],
    };
    let skipping = codec::encode(&Message::Feedback(skipping), 4).unwrap();
    let offence = Offence::Sample {
        found: 7,
        expected: 4,
    };
    assert_eq!(check(&with(8, skipping)), Some((8, offence)));
}

#[test]
fn what_is_not_ours_is_not_judged() {
    let mut records = good();
    let foreign = CanFrame::classical(StandardId::new(0x123).unwrap(), &[1]).unwrap();
    records.insert(3, record(1100, foreign));
    let error = ErrorFrame::new(0x80, &[0; 8]).unwrap();
    records.insert(
        4,
        Record {
            entry: Entry::Error(error),
            ..record(1100, foreign)
        },
    );
    let mut checker = Checker::new(&IRB_930);
    for record in &records {
        checker.record(record).unwrap();
    }
    let counts = checker.counts();
    assert_eq!(
        (counts.judged, counts.foreign, counts.error_frames),
        (20, 1, 1)
    );
}

fn decoded(records: &[Record], format: Format) -> String {
    let mut decoder = Decoder::new(Vec::new(), format).unwrap();
    for record in records {
        decoder.record(record).unwrap();
    }
    String::from_utf8(decoder.finish().unwrap()).unwrap()
}

#[test]
fn text_names_every_field_with_its_unit() {
    assert_eq!(
        decoded(&[record(1_000_002, feedback(258))], Format::Text),
        "1.000002 can0 1C0 Feedback #2  sample=258  status=ready|encoder-valid  \
         position=(1, -2, 3, -4) count  velocity=(0.5, -0.25, 0, 1000) rad/s  \
         torque=(0, -1, 1000, -1000) 0.1 %\n"
    );
}

#[test]
fn csv_has_a_row_for_each_field() {
    let control = ControlWord::TORQUE_ENABLE | ControlWord::BRAKE_RELEASE;
    let text = decoded(
        &[record(5, command(9, 3, control, [0.1, 0.0, -3.0, 1.5]))],
        Format::Csv,
    );
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let rows: Vec<[String; 3]> = reader
        .records()
        .map(|row| {
            let row = row.unwrap();
            assert_eq!(row.len(), 8);
            assert_eq!(
                row.iter().take(5).collect::<Vec<_>>(),
                ["0.000005", "can0", "240", "Command", "3"]
            );
            [5, 6, 7].map(|column| row[column].to_owned())
        })
        .collect();
    let expected = [
        ["sample", "9", ""],
        ["control", "torque-enable|brake-release", ""],
        ["torque_shoulder", "0.1", "N m"],
        ["torque_elbow", "0", "N m"],
        ["torque_lift", "-3", "N m"],
        ["torque_wrist", "1.5", "N m"],
    ];
    assert_eq!(rows, expected.map(|row| row.map(str::to_owned)));
}

/// A frame that is refused, a foreign one and an error frame appear with the reason and their bytes.
#[test]
fn what_is_no_message_is_shown_raw() {
    let wrong = CanFrame::fd(StandardId::new(0x1C0).unwrap(), &[0; 48], true).unwrap();
    let foreign = CanFrame::classical(StandardId::new(0x123).unwrap(), &[0xAB]).unwrap();
    let error = Record {
        time_us: 3,
        interface: Interface::new("a\"b,c").unwrap(),
        direction: None,
        entry: Entry::Error(ErrorFrame::new(0x40, &[1, 0, 0, 0, 0, 0, 0, 2]).unwrap()),
    };
    let text = decoded(
        &[record(1, wrong), record(2, foreign), error],
        Format::JsonLines,
    );
    let objects: Vec<serde_json::Value> = text
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let get = |index: usize, key: &str| objects[index][key].as_str().unwrap();
    assert_eq!(get(0, "message"), "Feedback");
    assert_eq!(get(0, "error"), DecodeError::Crc.to_string());
    assert_eq!(get(1, "error"), DecodeError::UnknownId.to_string());
    assert_eq!(get(1, "raw"), "123#AB");
    assert_eq!(
        (get(2, "id"), get(2, "raw")),
        ("20000040", "0100000000000002")
    );
    assert_eq!(get(2, "error"), "bus-off");
    assert_eq!(get(2, "interface"), "a\"b,c");
}

fn statistics(records: &[Record]) -> Statistics {
    let mut gatherer = Gatherer::new(BitTiming::default());
    for record in records {
        gatherer.record(record);
    }
    gatherer.statistics()
}

/// Statistics of the one interface.
fn bus(records: &[Record]) -> BusStatistics {
    statistics(records).interfaces.remove(0)
}

/// Periods of 900 and 1100 us in turn: mean 1000, standard deviation 100 us exactly; then a gap of three samples.
#[test]
fn statistics_are_those_of_the_definition() {
    let times: Vec<u64> = (0..101).map(|n| 1000 * n - 100 * (n % 2)).collect();
    let mut records: Vec<Record> = times
        .iter()
        .zip(0..)
        .map(|(&time, n)| record(time, feedback(n)))
        .collect();
    let line = bus(&records).ids.remove(0);
    let period = line.period.unwrap();
    assert_eq!(line.frames, 101);
    // 100 additions of a running mean and of squares: a few hundred rounding errors of 2^-53 at most.
    let close = |found: f64, expected: f64| (found - expected).abs() <= 1e-12 * expected.max(1.0);
    assert!(close(period.mean_ms, 1.0) && close(period.jitter_ms, 0.1));
    assert_eq!((period.min_ms, period.max_ms), (0.9, 1.1));
    assert_eq!((line.gaps, line.lost, line.duplicate), (0, 0, 0));

    records.push(record(104_000, feedback(104)));
    records.push(record(104_100, feedback(104)));
    records.push(record(104_200, feedback(103)));
    let mut damaged = *feedback(105).data().first_chunk::<48>().unwrap();
    damaged[0] ^= 0x80;
    let id = StandardId::new(table::FEEDBACK.id).unwrap();
    records.push(record(104_300, CanFrame::fd(id, &damaged, true).unwrap()));
    records.push(record(104_400, CanFrame::fd(id, &[], true).unwrap()));
    let line = bus(&records).ids.remove(0);
    assert_eq!(
        (
            line.gaps,
            line.lost,
            line.duplicate,
            line.stale,
            line.crc,
            line.refused
        ),
        (1, 3, 1, 1, 1, 1)
    );
}

/// Bits on the wire over time, as the bus itself reckons.
#[test]
fn load_is_the_time_of_the_frames() {
    let records = good();
    let busy: u64 = records
        .iter()
        .map(|record| {
            BitTiming::default()
                .duration(FrameBits::exact(&frame_of(record)))
                .nanos()
        })
        .sum();
    let statistics = bus(&records);
    assert_eq!(statistics.load, busy as f64 / 9_200_000.0);
    let by_id: f64 = statistics.ids.iter().map(|line| line.load).sum();
    assert!((by_id - statistics.load).abs() < 1e-12);
}

/// One cycle of the gate motion, and what the rig said of it.
static RUN: LazyLock<(Vec<Record>, Summary)> = LazyLock::new(|| {
    let mut scenario = Scenario::built_in("gate").unwrap();
    scenario.cycles = 1;
    let config = RunConfig::new(scenario);
    let directory = std::env::temp_dir().join(format!("trace-tools-{}", std::process::id()));
    let summary = execute(&config, &directory).unwrap().summary;
    let log = std::fs::read(directory.join("trace.log")).unwrap();
    std::fs::remove_dir_all(&directory).unwrap();
    let records = Reader::new(log.as_slice()).map(Result::unwrap).collect();
    (records, summary)
});

fn replay(records: &[Record]) -> Result<u64, Difference> {
    let model = RobotModel::irb_930_22_105();
    let config = RigConfig {
        nominal: (&model).into(),
        actual: model,
        period: Period::of_rate(1000.0),
        start: [0.0; 4],
        timing: BitTiming::default(),
    };
    let mut replay = Replay::new(config.controller());
    for record in records {
        replay.record(record)?;
    }
    Ok(replay.compared())
}

fn is_command(record: &Record) -> bool {
    frame_of(record).raw_id() == u32::from(table::COMMAND.id)
}

#[test]
fn a_run_keeps_the_rules_and_replays() {
    let (records, summary) = &*RUN;
    assert_eq!(check(records), None);
    let commands = records.iter().filter(|record| is_command(record)).count();
    assert_eq!(replay(records), Ok(commands as u64));
    assert!(commands > 500);

    let statistics = statistics(records);
    assert_eq!(statistics.frames, summary.frames);
    // The rig divides the same busy time by the whole run, the trace by the time between its first and last frame.
    let (ours, theirs) = (
        statistics.interfaces[0].load * statistics.span_s,
        summary.bus_load * summary.sim_time_s,
    );
    assert!((ours - theirs).abs() <= 1e-9 * theirs, "{ours} {theirs}");
}

/// The last bit of one torque, changed by a sender that protects its frames: only the replay sees it.
#[test]
fn replay_names_sample_and_field() {
    let mut records = RUN.0.clone();
    let at = records.len() / 2
        + records[records.len() / 2..]
            .iter()
            .position(is_command)
            .unwrap();
    let received = codec::decode(&frame_of(&records[at])).unwrap();
    let Message::Command(mut command) = received.message else {
        panic!("a command")
    };
    let original = command.torque[2];
    command.torque[2] = f32::from_bits(original.to_bits() ^ 1);
    let changed = codec::encode(&Message::Command(command), received.counter.unwrap()).unwrap();
    records[at].entry = Entry::Frame(changed);
    assert_eq!(check(&records), None);
    assert_eq!(
        replay(&records),
        Err(Difference::Field {
            due: Box::new(frame_of(&RUN.0[at])),
            field: "torque_lift".into(),
            expected: original.to_string(),
            found: command.torque[2].to_string(),
        })
    );

    records[at].entry = RUN.0[at].entry;
    records.insert(at, records[at]);
    assert!(
        matches!(replay(&records), Err(Difference::Surplus { found }) if *found == frame_of(&records[at]))
    );
    records.remove(at);
    records.retain(|record| !is_command(record));
    let first = frame_of(RUN.0.iter().find(|record| is_command(record)).unwrap());
    assert_eq!(
        replay(&records),
        Err(Difference::Missing {
            due: Box::new(first)
        })
    );
}

/// Every mode of the run and every axis is in the picture; an emergency stop is marked.
#[test]
fn the_picture_shows_what_happened() {
    let mut plot = Plot::new(&IRB_930, "a <run> & more");
    for record in &RUN.0 {
        plot.record(record);
    }
    let stop = CanFrame::classical(StandardId::new(1).unwrap(), &[]).unwrap();
    plot.record(&record(RUN.0.last().unwrap().time_us, stop));
    let svg = page(&[plot]);
    for expected in [
        "a &lt;run&gt; &amp; more",
        "ready from",
        "enabled from",
        "moving from",
        "jump at",
        "emergency stop at",
        ">shoulder<",
        ">lift<",
    ] {
        assert!(svg.contains(expected), "{expected}");
    }
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    // Positions, errors and torques of four axes.
    assert_eq!(svg.matches("<polyline").count(), 12);
}
