//! Traces of a run: checked, replayed and plotted.

use super::*;

/// One cycle of the gate motion, and its summary.
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
