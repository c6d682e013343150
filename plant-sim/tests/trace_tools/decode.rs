//! Output of `trace decode`.

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
    assert_eq!(get(2, "error"), "bus-off, error-counter-tx-rx (tx 0, rx 2)");
    assert_eq!(get(2, "interface"), "a\"b,c");
}
