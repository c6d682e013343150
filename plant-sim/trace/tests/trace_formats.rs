//! Logs in the formats of other tools, reading back what is written, and selections of a trace.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use protocol::frame::{CanFrame, ExtendedId, StandardId};
use trace::convert::{Converter, Target};
use trace::select::Selection;
use trace::{Direction, Entry, ErrorFrame, Interface, Problem, ReadError, Reader, Record};

fn read(bytes: &[u8]) -> Vec<Result<Record, Problem>> {
    Reader::new(bytes)
        .map(|read| {
            read.map_err(|error| match error {
                ReadError::Line { problem, .. } => problem,
                ReadError::Io { source, .. } => panic!("{source}"),
            })
        })
        .collect()
}

fn log(text: &str) -> Vec<Record> {
    read(text.as_bytes())
        .into_iter()
        .map(Result::unwrap)
        .collect()
}

fn convert(records: &[Record], target: Target) -> Vec<u8> {
    let mut converter = Converter::new(Vec::new(), target).unwrap();
    for record in records {
        converter.record(record).unwrap();
    }
    converter.finish().unwrap()
}

/// Frames of every kind on two interfaces, at times of today.
const MIXED: &str = "\
(1720000000.000123) can0 123#
(1720000000.000124) can0 7FF#1122334455667788
(1720000000.500000) can1 1FFFFFFF#DEAD
(1720000000.500000) can0 123#R T
(1720000001.000000) can1 00000456#R8
(1720000001.000009) can0 1C0##1000102030405060708090A0B
(1720000001.000010) can0 18FF0001##2 T
(1720000001.000011) can1 001##3AB
";

#[test]
fn what_is_written_in_another_format_is_read_back() {
    let records = log(MIXED);
    assert_eq!(records.len(), 8);
    for target in [Target::Pcapng, Target::Asc, Target::Candump] {
        let bytes = convert(&records, target);
        let back: Vec<Record> = read(&bytes).into_iter().map(Result::unwrap).collect();
        assert_eq!(back, records, "{target:?}");
    }
}

#[test]
fn a_direction_is_kept_in_every_format() {
    let records = log("(1.000000) can0 123#00 R\n(1.000001) can0 123#00 T\n");
    let directions: Vec<_> = records.iter().map(|record| record.direction).collect();
    assert_eq!(
        directions,
        [Some(Direction::Received), Some(Direction::Transmitted)]
    );
    assert_eq!(
        read(&convert(&records, Target::Pcapng)),
        records.iter().map(|r| Ok(*r)).collect::<Vec<_>>()
    );
    let asc = String::from_utf8(convert(&records, Target::Asc)).unwrap();
    assert!(
        asc.contains("Rx   d 1 00") && asc.contains("Tx   d 1 00"),
        "{asc}"
    );
}

#[test]
fn error_frames_of_any_length_are_read_and_kept_in_pcapng() {
    let records = log("(1.000000) can0 20000040#\n(1.000001) can0 20000004#0008\n");
    let Entry::Error(error) = records[1].entry else {
        panic!("not an error frame");
    };
    assert_eq!(error, ErrorFrame::new(4, &[0, 8]).unwrap());
    let back = read(&convert(&records, Target::Pcapng));
    assert_eq!(back, records.iter().map(|r| Ok(*r)).collect::<Vec<_>>());
}

/// Classes, problems and places of linux/can/error.h.
#[test]
fn errors_are_said_in_words() {
    for (class, data, words) in [
        (0x001, [0; 8], "tx-timeout"),
        (
            0x002,
            [5, 0, 0, 0, 0, 0, 0, 0],
            "lost-arbitration (at bit 5)",
        ),
        (
            0x004,
            [0, 0x40, 0, 0, 0, 0, 0, 0],
            "controller-problem (back-to-error-active)",
        ),
        (
            0x204,
            [0, 0x30, 0, 0, 0, 0, 130, 7],
            "controller-problem (rx-error-passive, tx-error-passive), error-counter-tx-rx (tx 130, rx 7)",
        ),
        (
            0x088,
            [0, 0, 0x84, 0x19, 0, 0, 0, 0],
            "protocol-violation (bit-stuffing-error, error-on-tx, at acknowledge-slot), bus-error",
        ),
        (
            0x010,
            [0, 0, 0, 0, 0x74, 0, 0, 0],
            "transceiver-status (canh-no-wire, canl-short-to-ground)",
        ),
        (0x020, [0; 8], "no-acknowledgement-on-tx"),
        (0x140, [0; 8], "bus-off, restarted-after-bus-off"),
        (0x400, [0; 8], "class-10"),
        (0, [0; 8], "unspecified"),
    ] {
        assert_eq!(ErrorFrame::new(class, &data).unwrap().to_string(), words);
    }
}

/// `candump -t a`, without and with `-x`, `-a` and `-e`.
#[test]
fn what_candump_prints_on_a_screen_is_read() {
    let text = " (1720000000.000123)  can0  123   [2]  AA BB\n \
        (1720000000.000124)  vcan10  1FFFFFFF   [0]  \n \
        (1720000000.000125)  can0  RX - -  124   [3]  41 42 43   'ABC'\n \
        (1720000000.000126)  can0  TX B E  125  [08]  00 00 00 00 00 00 00 01\n \
        (1720000000.000127)  can0  126   [4]  remote request\n \
        (1720000000.000128)  can0  20000004   [8]  00 08 00 00 00 00 00 00   ERRORFRAME\n\
        \tcontroller-problem{tx-error-warning}\n";
    let same = "(1720000000.000123) can0 123#AABB\n\
        (1720000000.000124) vcan10 1FFFFFFF#\n\
        (1720000000.000125) can0 124#414243 R\n\
        (1720000000.000126) can0 125##30000000000000001 T\n\
        (1720000000.000127) can0 126#R4\n\
        (1720000000.000128) can0 20000004#0008000000000000\n";
    assert_eq!(log(text), log(same));
    for line in [
        "  can0  123   [2]  AA BB\n",                           // no time
        " (000.000123)  can0  123   [2]  AA BB\n", // since the previous frame, or the start
        " (2024-07-03 11:46:40.000123)  can0  123   [1]  AA\n", // in an unknown time zone
    ] {
        assert_eq!(read(line.as_bytes()), [Err(Problem::Screen)], "{line}");
    }
    let short = " (1720000000.000123)  can0  123   [2]  AA\n";
    assert!(matches!(
        read(short.as_bytes())[..],
        [Err(Problem::Length { found: 1, .. })]
    ));
}

/// The last frame of a log that was cut off counts only if it is complete.
#[test]
fn the_end_of_a_log_that_was_cut_off_is_no_frame() {
    let whole = "(1.000000) can0 123#00\n";
    for cut in [
        "(1.00",
        "(1.000000) can",
        "(1.000000) can0 1C0#",
        "(1.000000) can0 123##100112",
    ] {
        let text = [whole, cut].concat();
        let read = read(text.as_bytes());
        assert!(read[0].is_ok());
        assert_eq!(read[1..], [Err(Problem::Unterminated)], "{cut}");
    }
}

#[test]
fn can_xl_is_named_whatever_its_length() {
    for bytes in [1, 8, 64, 2048] {
        let xl = format!(
            "(1.000000) can0 45123#81:00:12345678#{}\n",
            "AB".repeat(bytes)
        );
        let text = [&xl, "(1.000000) can0 123#00\n"].concat();
        let read = read(text.as_bytes());
        assert_eq!(read[0], Err(Problem::CanXl));
        assert!(read[1].is_ok());
    }
}

/// Lines of CANoe and of python-can: decimal numbers, symbolic names, relative times, am and pm, other events.
#[test]
fn asc_of_other_tools_is_read() {
    let body = "\
        // version 13.0.0\n\
        Begin Triggerblock Wed Jul 3 01:46:40.000 pm 2024\n\
        \x20  0.000000 Start of measurement\n\
        \x20  0.100000 CAN 1 Status:chip status error active\n\
        \x20  0.200000 1  Statistic: D 12 R 0 XD 0 XR 0 E 0 O 0 B 2.11%\n\
        \x20  0.250000 1  18                 Rx   d 2 16 255  Length = 250000 BitCount = 65 ID = 18\n\
        \x20  0.250001 1  19                 TxRq d 1 1\n\
        \x20  0.250002 2  419430401x         Tx   r\n\
        \x20  0.250003 2  ErrorFrame\n\
        End TriggerBlock\n";
    let at = |records: &[Record]| -> Vec<u64> {
        records
            .iter()
            .map(|record| record.time_us - records[0].time_us)
            .collect()
    };
    let absolute = log(&format!(
        "date Wed Jul 3 01:46:40.000 pm 2024\nbase dec  timestamps absolute\n{body}"
    ));
    assert_eq!(at(&absolute), [0, 2, 3]);
    let frame = CanFrame::classical(StandardId::new(18).unwrap(), &[16, 255]).unwrap();
    assert_eq!(absolute[0].entry, Entry::Frame(frame));
    assert_eq!(absolute[0].time_us % 60_000_000, 40_250_000);
    let remote = CanFrame::remote(ExtendedId::new(0x1900_0001).unwrap(), 0).unwrap();
    assert_eq!(absolute[1].entry, Entry::Frame(remote));
    assert_eq!(absolute[1].interface.to_string(), "can1");
    assert_eq!(absolute[1].direction, Some(Direction::Transmitted));
    assert_eq!(
        absolute[2].entry,
        Entry::Error(ErrorFrame::new(0x80, &[0; 8]).unwrap())
    );
    let relative = log(&format!(
        "date Mi Jul 3 13:46:40.000 2024\nbase dec  timestamps relative\n{body}"
    ));
    assert_eq!(at(&relative), [0, 500_003, 750_006]);
    let named = "date Wed Jul 3 13:46:40 2024\nbase hex  timestamps absolute\n\
        0.1 CANFD 1 Rx 1C0 Feedback 1 0 9 12 00 01 02 03 04 05 06 07 08 09 0a 0B 130000 130 3000 0 0 0 0 0\n\
        0.2 CANFD 1 Rx 123 0 0 2 2 AA BB 0 0 0 0 0 0 0 0\n";
    let text = "(1.100000) can0 1C0##1000102030405060708090A0B\n(1.200000) can0 123#AABB\n";
    let entries = |records: Vec<Record>| records.into_iter().map(|r| r.entry).collect::<Vec<_>>();
    assert_eq!(entries(log(named)), entries(log(text)));
}

/// What is damaged is counted; events of other kinds are passed over.
#[test]
fn asc_lines_that_are_cut_or_before_the_start_are_not_dropped() {
    let text = "base hex  timestamps absolute\n\
        0.000000 Start of measurement\n\
        0.000000 1  Statistic: D 0 R 0 XD 0 XR 0 E 0 O 0 B 0.00%\n\
        0.100000 1  123             Rx   d 2 00 11\n\
        -0.300000 1  125             Rx   d 2 00 11\n\
        0.400000 1  126\n\
        0.500000\n\
        0,600000 1  123             Rx   d 2 00 11\n\
        0.700000 1  123             Xx   d 2 00 11\n\
        0.800000 CANFD   x Rx        123   1 0 8  8 00 00 00 00 00 00 00 00\n\
        0.900000 CANFD   1 Rx\n\
        (1.000000) can0 123#00\n\
        lorem ipsum\n\
        // lorem ipsum\n\
        no internal events logged\n\
        \n\
        End TriggerBlock\n";
    let read = read(text.as_bytes());
    assert_eq!(read.len(), 10, "{read:?}");
    assert!(read[0].is_ok());
    let damaged = |line: &Result<Record, Problem>| matches!(line, Err(Problem::Asc(_)));
    assert!(read[1..].iter().all(damaged), "{read:?}");
}

/// The microseconds below the millisecond of the header are in the first time.
#[test]
fn asc_loses_no_microsecond() {
    let records = log("(1720000000.000475) can0 123#00\n(1720000000.100475) can0 123#00\n");
    let asc = String::from_utf8(convert(&records, Target::Asc)).unwrap();
    let times: Vec<&str> = asc
        .lines()
        .filter(|line| line.contains(" d 1 "))
        .map(|line| line.split_ascii_whitespace().next().unwrap())
        .collect();
    assert_eq!(times, ["0.000475", "0.100475"]);
}

/// A big-endian section with nanoseconds, as written by another machine, and one of a link that is not CAN.
#[test]
fn pcapng_of_other_machines_is_read() {
    fn block(kind: u32, body: &[u8]) -> Vec<u8> {
        let length = (body.len() as u32 + 12).to_be_bytes();
        [&kind.to_be_bytes(), &length[..], body, &length].concat()
    }
    let file = |link_type: u8| {
        let time = 1_720_000_000_000_123_456_u64.to_be_bytes();
        let packet = [0, 0, 0x01, 0x23, 2, 0, 0, 0, 0xAA, 0xBB, 0, 0];
        [
            block(
                0x0A0D_0D0A,
                b"\x1A\x2B\x3C\x4D\0\x01\0\0\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF",
            ),
            block(
                1,
                &[
                    &[0, link_type, 0, 0, 0, 0, 0, 0][..],
                    b"\0\x02\0\x03can\0\0\x09\0\x01\x09\0\0\0\0\0\0\0",
                ]
                .concat(),
            ),
            block(5, &[0; 12]),
            block(
                6,
                &[&[0; 4][..], &time, &[0, 0, 0, 10, 0, 0, 0, 10], &packet].concat(),
            ),
        ]
        .concat()
    };
    assert_eq!(
        read(&file(227)),
        read(b"(1720000000.000123) can 123#AABB\n")
    );
    assert!(matches!(read(&file(1))[..], [Err(Problem::Packet(_))]));
    let mut cut = file(227);
    cut.truncate(cut.len() - 8);
    assert!(Reader::new(cut.as_slice()).any(|read| matches!(read, Err(ReadError::Io { .. }))));
}

#[test]
fn a_selection_takes_identifiers_interfaces_and_times() {
    let records = log(MIXED);
    let count = |selection: &Selection| {
        records
            .iter()
            .filter(|r| {
                selection.interface(r) && selection.id(r) && selection.time(r, records[0].time_us)
            })
            .count()
    };
    let ids = |text: &str| Selection {
        ids: text.split(',').map(|id| id.parse().unwrap()).collect(),
        ..Selection::default()
    };
    assert_eq!(count(&Selection::default()), 8);
    assert_eq!(count(&ids("123")), 2);
    assert_eq!(count(&ids("0x123,00000456")), 3);
    assert_eq!(count(&ids("000-7FF")), 5);
    assert_eq!(count(&ids("10000000-1FFFFFFF")), 2);
    assert_eq!(count(&ids("feedback,EStop")), 2);
    // The same number with 29 bits is another identifier.
    assert_eq!(count(&ids("456")), 0);
    let can1 = Selection {
        interfaces: vec![Interface::new("can1").unwrap()],
        ..Selection::default()
    };
    assert_eq!(count(&can1), 3);
    let between = |from: &str, to: &str| Selection {
        from: Some(from.parse().unwrap()),
        to: Some(to.parse().unwrap()),
        ..Selection::default()
    };
    assert_eq!(count(&between("1720000000.000124", "1720000000.5")), 3);
    assert_eq!(count(&between("+0.000001", "+0.499877")), 3);
    assert_eq!(count(&between("0", "1720000000")), 0);
    for wrong in [
        "",
        "+12",
        "1234",
        "800",
        "20000000",
        "123-00000456",
        "300-200",
        "Feedbak",
        "x",
    ] {
        assert!(wrong.parse::<trace::select::Ids>().is_err(), "{wrong}");
    }
    for wrong in ["", "-1", "now", "1e3", "++1"] {
        assert!(wrong.parse::<trace::select::Moment>().is_err(), "{wrong}");
    }
}

/// Formats that are not read are named with the tool that converts them.
#[test]
fn what_is_not_read_is_named_with_its_converter() {
    for (bytes, tool) in [
        (&b"LOGG\x90\0\0\0"[..], "can.logconvert"),
        (b"MDF     4.10", "can.logconvert FILE.mf4"),
        (b";$FILEVERSION=1.1\n", "can.logconvert FILE.trc"),
        (&b"\xFF\xFE(\x001\0.\0"[..], "iconv -f UTF-16"),
        // What is within a compressed file: the program has unpacked that once.
        (b"\x1F\x8B\x08\0", "compressed twice"),
        (b"\xD4\xC3\xB2\xA1\x02\0\x04\0", "editcap -F pcapng"),
    ] {
        let Some(Err(ReadError::Io { source, .. })) = Reader::new(bytes).next() else {
            panic!("{tool}: no failure");
        };
        assert!(source.to_string().contains(tool), "{source}");
    }
}
