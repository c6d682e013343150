//! `trace decode` and `trace stats`.

use super::*;

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
        entry: Entry::Error(ErrorFrame {
            class: 0x40,
            data: [1, 0, 0, 0, 0, 0, 0, 2],
        }),
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
    assert_eq!(get(2, "interface"), "a\"b,c");
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
    let line = statistics(&records).ids.remove(0);
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
    let line = statistics(&records).ids.remove(0);
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
    let statistics = statistics(&records);
    assert_eq!(statistics.load, busy as f64 / 9_200_000.0);
    let by_id: f64 = statistics.ids.iter().map(|line| line.load).sum();
    assert!((by_id - statistics.load).abs() < 1e-12);
}
