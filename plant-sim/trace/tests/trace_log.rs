//! candump logs: output equals that of can-utils and reads back; errors are named.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::io::{self, BufReader, Cursor};

use proptest::prelude::*;
use protocol::frame::{CanFrame, ExtendedId, Id, StandardId};
use trace::{Direction, Entry, ErrorFrame, Interface, Problem, ReadError, Reader, Record, Writer};

fn can0() -> Interface {
    Interface::new("can0").unwrap()
}

fn standard(id: u16) -> StandardId {
    StandardId::new(id).unwrap()
}

fn extended(id: u32) -> ExtendedId {
    ExtendedId::new(id).unwrap()
}

fn write(records: &[Record]) -> (String, String) {
    let interface = records.first().map_or(can0(), |record| record.interface);
    let mut writer = Writer::new(Vec::new(), interface);
    for record in records {
        writer.record(record).unwrap();
    }
    let (bytes, hash) = writer.finish().unwrap();
    (String::from_utf8(bytes).unwrap(), hash.to_string())
}

fn record(time_us: u64, entry: Entry) -> Record {
    Record {
        time_us,
        interface: can0(),
        direction: None,
        entry,
    }
}

/// The first line's record or problem.
fn read(text: &[u8]) -> Result<Record, Problem> {
    match Reader::new(text).next().expect("a line") {
        Ok(record) => Ok(record),
        Err(ReadError::Line { problem, .. }) => Err(problem),
        Err(other) => panic!("{other}"),
    }
}

fn problem(text: &str) -> Problem {
    read(text.as_bytes()).expect_err(text)
}

/// Lines as `candump -L` prints them (can-utils: `(%010llu.%06llu) `, interface, ` `, frame).
#[test]
fn lines_are_those_of_can_utils() {
    let frame = |frame: Option<CanFrame>| Entry::Frame(frame.unwrap());
    let cases = [
        (
            0,
            frame(CanFrame::classical(standard(0), &[])),
            "(0000000000.000000) can0 000#",
        ),
        (
            1_436_509_052_249_713,
            frame(CanFrame::classical(
                standard(0x44),
                &[0x2A, 0x36, 0x6C, 0x2B, 0xBA],
            )),
            "(1436509052.249713) can0 044#2A366C2BBA",
        ),
        (
            1,
            frame(CanFrame::classical(extended(0x123), &[0xDE, 0xAD])),
            "(0000000000.000001) can0 00000123#DEAD",
        ),
        (
            999_999,
            frame(CanFrame::remote(standard(0x7FF), 0)),
            "(0000000000.999999) can0 7FF#R",
        ),
        (
            1_000_000,
            frame(CanFrame::remote(extended(0x1FFF_FFFF), 8)),
            "(0000000001.000000) can0 1FFFFFFF#R8",
        ),
        (
            12_345_678,
            frame(CanFrame::fd(standard(0x1C0), &[0xAB; 12], true)),
            "(0000000012.345678) can0 1C0##1ABABABABABABABABABABABAB",
        ),
        (
            2,
            frame(CanFrame::fd(standard(0x240), &[], false).map(|f| f.with_esi(true))),
            "(0000000000.000002) can0 240##2",
        ),
        (
            u64::MAX,
            Entry::Error(ErrorFrame::new(0x80, &[0, 0, 0, 0, 0, 0, 0x60, 0x01]).unwrap()),
            "(18446744073709.551615) can0 20000080#0000000000006001",
        ),
    ];
    for (time_us, entry, expected) in cases {
        let record = record(time_us, entry);
        let (text, _) = write(&[record]);
        assert_eq!(text.strip_suffix('\n'), Some(expected));
        assert_eq!(read(text.as_bytes()), Ok(record));
    }
}

/// Forms that only other tools write.
#[test]
fn lines_of_other_tools_are_read() {
    let plain = read(b"(0000000001.500000) can0 123#ABCD\n").unwrap();
    for line in [
        "(1.500000) can0 123#ABCD\n",                      // python-can
        "(0000000001.500000)   can0 123#ABCD\n",           // several interfaces, aligned
        "(1.500000)\tcan0\t 123#ABCD\n", // tabs and blanks of a hand or of a table
        "(0000000001.500000) can0 123#abcd\n", // lower case
        "(1.5) can0 123#ABCD\n",         // fewer decimals
        "(1.500000999) can0 123#ABCD\n", // nanoseconds, which are cut off
        "(1.500000) can0 123#ABCD\r\n",  // line end of another system
        "(1.500000) can0 123#ABCD",      // no line end at the end of the file
        "\u{feff}(1.500000) can0 123#ABCD\n", // byte order mark
        "# two cycles\n\n \r\n(1.500000) can0 123#ABCD\n", // comment and empty lines
    ] {
        assert_eq!(read(line.as_bytes()), Ok(plain), "{line}");
    }
    // CANFD_FDF, set by newer kernels, says nothing new.
    let flags = |digit| read(format!("(1.000000) can0 123##{digit}00\n").as_bytes()).unwrap();
    assert_eq!(flags("4"), flags("0"));
    assert_eq!(flags("7"), flags("3"));
}

#[test]
fn every_wrong_line_is_told_what_is_wrong() {
    let range = |id, max| Problem::IdRange { id, max };
    let length = |found, allowed| Problem::Length { found, allowed };
    let hex = |column, found| Problem::Hex { column, found };
    let fd_lengths = "0 to 8, 12, 16, 20, 24, 32, 48 or 64";
    let cases = [
        (
            "DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 3)\n",
            Problem::Dropped,
        ),
        ("can0 123#00\n", Problem::Timestamp),
        ("(1.000000 can0 123#00\n", Problem::Timestamp),
        ("(1) can0 123#00\n", Problem::Timestamp),
        ("(.000000) can0 123#00\n", Problem::Timestamp),
        ("(-1.000000) can0 123#00\n", Problem::Timestamp),
        ("(1.00 000) can0 123#00\n", Problem::Timestamp),
        ("(1.) can0 123#00\n", Problem::Decimals(0)),
        ("(1.0000000000) can0 123#00\n", Problem::Decimals(10)),
        (
            "(18446744073709.551616) can0 123#00\n",
            Problem::TimestampRange,
        ),
        ("(1.000000)can0 123#00\n", Problem::Interface),
        ("(1.000000) can0\n", Problem::Interface),
        ("(1.000000) a_name_too_long_ 123#00\n", Problem::Interface),
        ("(1.000000) c\u{e4}n0 123#00\n", Problem::Interface),
        ("(1.000000) can0 12300\n", Problem::Separator),
        ("(1.000000) can0 #00\n", Problem::IdDigits(0)),
        ("(1.000000) can0 12#00\n", Problem::IdDigits(2)),
        ("(1.000000) can0 1234#00\n", Problem::IdDigits(4)),
        ("(1.000000) can0 123456789#00\n", Problem::IdDigits(9)),
        ("(1.000000) can0 800#00\n", range(0x800, 0x7FF)),
        (
            "(1.000000) can0 40000000#00\n",
            range(0x4000_0000, 0x1FFF_FFFF),
        ),
        (
            "(1.000000) can0 80000123#00\n",
            range(0x8000_0123, 0x1FFF_FFFF),
        ),
        (
            "(1.000000) can0 60000123#00\n",
            range(0x6000_0123, 0x1FFF_FFFF),
        ),
        ("(1.000000) can0 1G3#00\n", hex(18, 'G')),
        ("(1.000000) can0 123#0x\n", hex(22, 'x')),
        ("(1.000000) can0 123#00.11\n", hex(23, '.')),
        ("(1.000000) can0 123##1000z\n", hex(26, 'z')),
        ("(1.000000) can0 123#000\n", Problem::OddDigits),
        ("(1.000000) can0 123##1000\n", Problem::OddDigits),
        (
            "(1.000000) can0 123#001122334455667788\n",
            length(9, "0 to 8"),
        ),
        (
            "(1.000000) can0 123##1001122334455667788\n",
            length(9, fd_lengths),
        ),
        (
            "(1.000000) can0 20000080#001122334455667788\n",
            length(9, "0 to 8"),
        ),
        (
            "(1.000000) can0 123#0011223344556677_C\n",
            Problem::LengthCode(12),
        ),
        ("(1.000000) can0 123#R9\n", Problem::Remote),
        ("(1.000000) can0 123#R00\n", Problem::Remote),
        ("(1.000000) can0 123##\n", Problem::NoFlags),
        ("(1.000000) can0 123##8\n", Problem::Flags(8)),
        ("(1.000000) can0 123#00 X\n", Problem::Trailing),
    ];
    for (line, expected) in cases {
        assert_eq!(problem(line), expected, "{line}");
    }
    let long = format!("(1.000000) can0 123##1{}\n", "00".repeat(65));
    assert_eq!(problem(&long), length(65, fd_lengths));
}

#[test]
fn a_message_names_line_fault_and_what_is_allowed() {
    let log = "(1.000000) can0 123#00\n(1.) can0 123#00\n";
    let error = Reader::new(log.as_bytes()).nth(1).unwrap().unwrap_err();
    assert_eq!(
        error.to_string(),
        "line 2: timestamp has 0 decimals; 1 to 9 are allowed"
    );
}

/// A line of 64 KiB costs no memory, and reading continues after it. The small buffer makes it span many fills.
/// One line without an end is no log that was cut off, if it does not begin like one.
#[test]
fn a_foreign_file_of_one_line_is_not_a_log_that_was_cut_off() {
    for text in ["{\"a\": 1}", "t12321122\rT0000012320011\r", "\u{1f}"] {
        assert_eq!(problem(text), Problem::Timestamp, "{text}");
    }
    assert_eq!(problem("(1.0) can0 12"), Problem::Unterminated);
    let old_mac = "(1.0) can0 123#11\r(1.1) can0 123#11\r";
    for text in [old_mac, &old_mac.repeat(100), &format!("{old_mac}\n")] {
        assert_eq!(problem(text), Problem::CarriageReturn, "{text}");
    }
    assert_eq!(
        problem("base oct timestamps absolute\n"),
        Problem::Asc("a base that is neither hex nor dec")
    );
}

#[test]
fn overlong_lines_are_refused_and_skipped() {
    let good = "(1.000000) can0 123#00\n";
    let long = format!("(1.000000) can0 123#{}\n", "00".repeat(32 * 1024));
    let log = [good, &long, good].concat();
    let source = BufReader::with_capacity(7, log.as_bytes());
    let read: Vec<_> = Reader::new(source).collect();
    assert_eq!(read.len(), 3);
    assert!(read[0].is_ok() && read[2].is_ok());
    assert!(matches!(
        read[1],
        Err(ReadError::Line {
            line: 2,
            problem: Problem::TooLong
        })
    ));
    // Also without an end.
    let endless = vec![b'('; 1 << 16];
    assert_eq!(read_all(&endless), [Err(Problem::TooLong)]);
}

fn read_all(bytes: &[u8]) -> Vec<Result<Record, Problem>> {
    Reader::new(bytes)
        .map(|read| {
            read.map_err(|error| match error {
                ReadError::Line { problem, .. } => problem,
                ReadError::Io { source, .. } => panic!("{source}"),
            })
        })
        .collect()
}

/// A sink of 64 bytes and a longer line.
#[test]
fn a_failing_sink_is_reported() {
    let mut writer = Writer::new(Cursor::new([0; 64]), can0());
    let frame = CanFrame::fd(standard(1), &[0; 64], true).unwrap();
    let error = writer.frame(0, &frame).unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::WriteZero);
}

/// Expected values: `sha256sum` of files with these bytes.
#[test]
fn the_hash_is_that_of_the_bytes() {
    assert_eq!(
        write(&[]).1,
        "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
    );
    let frame = CanFrame::classical(standard(0x123), &[0xDE, 0xAD]).unwrap();
    let records = [1_500_000, 1_500_135].map(|time| record(time, Entry::Frame(frame)));
    let (text, hash) = write(&records);
    assert_eq!(
        text,
        "(0000000001.500000) can0 123#DEAD\n(0000000001.500135) can0 123#DEAD\n"
    );
    assert_eq!(
        hash,
        "92f4a9280fc482a4dede6242898c0733e8cc07717c1663a75627e953a37d4cbd"
    );
}

fn any_record() -> impl Strategy<Value = Record> {
    let id = || {
        prop_oneof![
            (0_u16..0x800).prop_map(|id| Id::Standard(standard(id))),
            (0_u32..0x2000_0000).prop_map(|id| Id::Extended(extended(id))),
        ]
    };
    let bytes = |max| proptest::collection::vec(any::<u8>(), 0..=max);
    let entry = prop_oneof![
        (id(), bytes(8)).prop_map(|(id, data)| CanFrame::classical(id, &data).unwrap()),
        (id(), 0_usize..=8).prop_map(|(id, len)| CanFrame::remote(id, len).unwrap()),
        (id(), bytes(64), any::<bool>(), any::<bool>()).prop_map(|(id, data, brs, esi)| {
            CanFrame::fd(id, &data, brs).unwrap().with_esi(esi)
        }),
    ]
    .prop_map(Entry::Frame);
    let error = (0_u32..0x2000_0000, bytes(8))
        .prop_map(|(class, data)| Entry::Error(ErrorFrame::new(class, &data).unwrap()));
    let direction = prop_oneof![
        Just(None),
        Just(Some(Direction::Received)),
        Just(Some(Direction::Transmitted)),
    ];
    (any::<u64>(), direction, prop_oneof![4 => entry, 1 => error]).prop_map(
        |(time_us, direction, entry)| Record {
            direction,
            ..record(time_us, entry)
        },
    )
}

proptest! {
    #[test]
    fn what_is_written_is_read_back(records in proptest::collection::vec(any_record(), 0..20)) {
        let (text, _) = write(&records);
        let read: Vec<_> = read_all(text.as_bytes()).into_iter().map(Result::unwrap).collect();
        prop_assert_eq!(read, records);
    }

    /// Two records never share a line, so equal hashes mean equal runs.
    #[test]
    fn different_records_have_different_hashes(a in any_record(), b in any_record()) {
        prop_assert_eq!(write(&[a]).1 == write(&[b]).1, a == b);
    }

    /// Every line up to the last gives a record or a problem or is a comment: damage never hides what follows, and
    /// never panics.
    #[test]
    fn damaged_bytes_are_confined_to_their_line(
        records in proptest::collection::vec(any_record(), 3),
        at in any::<proptest::sample::Index>(),
        byte in any::<u8>().prop_filter("would split or join lines", |&byte| byte != b'\n'),
    ) {
        let (text, _) = write(&records);
        let mut bytes = text.into_bytes();
        let second = bytes.iter().position(|&b| b == b'\n').unwrap() + 1;
        let third = second + bytes[second..].iter().position(|&b| b == b'\n').unwrap();
        bytes[second + at.index(third - second)] = byte;
        let mut read = read_all(&bytes);
        prop_assert_eq!(read.remove(0), Ok(records[0]));
        prop_assert_eq!(read.pop(), Some(Ok(records[2])));
        // Now a comment, or a detail line that follows an error frame on a screen.
        prop_assert!(read.len() == 1 || matches!(byte, b'#' | b'\t'));
    }

    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..600)) {
        read_all(&bytes);
    }

    #[test]
    fn random_bytes_of_the_alphabet_never_panic(text in "\\([0-9.]{0,20}\\) {0,2}[a-z0]{0,17} [0-9A-FR#. ]{0,24}\n") {
        read_all(text.as_bytes());
    }
}
